"""Contact between bolt and groove: one strategy for each contact model.

A strategy writes an `Environment` into a Context, and adds its systems to the diagram.
`Parts` maps a system of the station to its Context.
"""

import abc
import dataclasses
from collections.abc import Iterable

import numpy as np
from pydrake.geometry import (
    CollisionFilterDeclaration,
    GeometryId,
    GeometrySet,
    SceneGraph,
)
from pydrake.math import RotationMatrix
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import DiagramBuilder, OutputPort

from drake_disasm.cell.lock import (
    Lock,
    reshape_groove,
    set_environment,
    set_pose,
)
from drake_disasm.effects import Environment
from drake_disasm.parts.materials import has_same_material
from drake_disasm.stations.base import Parts
from drake_disasm.stations.six_axis_spring import SixAxisSpring
from drake_disasm.systems.bolt_environment import BoltEnvironment
from drake_disasm.twin.conditions import ImpactConditions
from drake_disasm.twin.contact_system import ImpactContact
from drake_disasm.twin.law import ImpactLaw


class ContactStrategy(abc.ABC):
    """A model of the contact between bolt and groove.

    Attributes:
        surroundings: the environment in force.
    """

    def __init__(
        self,
        plant: MultibodyPlant,
        scene_graph: SceneGraph,
        lock: Lock,
        surroundings: BoltEnvironment,
    ) -> None:
        self._plant, self._scene_graph, self._lock = plant, scene_graph, lock
        self.surroundings = surroundings

    @abc.abstractmethod
    def add_forces(self, builder: DiagramBuilder, forces: OutputPort) -> OutputPort:
        """Adds the system that computes the contact, if that is not the plant.

        Args:
            forces: that act on the bolt from outside.

        Returns:
            The port of all forces that the plant is to apply.
        """

    @abc.abstractmethod
    def reconfigure(self, lock: Lock, parts: Parts) -> None:
        """Changes the part; `set_environment` must be called next."""

    @abc.abstractmethod
    def set_environment(self, environment: Environment, parts: Parts) -> None:
        """Writes the bolt's environment into a Context."""

    def change_environment(self, environment: Environment, parts: Parts) -> None:
        """Writes what has changed of the bolt's environment into a Context."""
        self.set_environment(environment, parts)


class HydroelasticContact(ContactStrategy):
    """Drake's own contact, of the surfaces' materials in the scene graph."""

    def add_forces(self, builder: DiagramBuilder, forces: OutputPort) -> OutputPort:
        """See ContactStrategy."""
        return forces

    def reconfigure(self, lock: Lock, parts: Parts) -> None:
        """See ContactStrategy."""
        self._lock = lock
        self._reshape(lock.environment, parts)

    def set_environment(self, environment: Environment, parts: Parts) -> None:
        """See ContactStrategy; reassigns all materials, which takes milliseconds."""
        known = self.surroundings.get(parts(self.surroundings))
        if environment.clearance != known.clearance:
            self._reshape(environment, parts)
        self.surroundings.set(parts(self.surroundings), environment)
        set_environment(
            self._lock,
            environment,
            parts(self._plant),
            self._scene_graph,
            parts(self._scene_graph),
        )

    def change_environment(self, environment: Environment, parts: Parts) -> None:
        """See ContactStrategy; skips materials that have not changed noticeably."""
        context = parts(self.surroundings)
        known = self.surroundings.get(context)
        if not has_same_material(known, environment):
            self.set_environment(environment, parts)
            return
        set_pose(self._lock, environment, parts(self._plant))
        # With the friction that the scene graph has, so that it can't drift away.
        changed = dataclasses.replace(environment, friction=known.friction)
        self.surroundings.set(context, changed)

    def _reshape(self, environment: Environment, parts: Parts) -> None:
        scene_graph, context = self._scene_graph, parts(self.surroundings)
        reshape_groove(self._lock, environment, scene_graph, parts(scene_graph))
        known, clearance = self.surroundings.get(context), environment.clearance
        self.surroundings.set(context, dataclasses.replace(known, clearance=clearance))


class ImpactContactForce(ContactStrategy):
    """The thesis's contact law, as a force on the bolt; the plant sees no contact.

    Args:
        spring: the twin's, which the law's solution depends on, as on the masses.
        R_WGn, time_step: of the station [s].
        p_BoTo_B: (3,) where the spring is [m].
        environment: of the default Context.
        is_weighed: whether the groove is pushed back, onto a sensor.
    """

    def __init__(
        self,
        plant: MultibodyPlant,
        scene_graph: SceneGraph,
        lock: Lock,
        surroundings: BoltEnvironment,
        *,
        spring: SixAxisSpring,
        R_WGn: RotationMatrix,
        p_BoTo_B: np.ndarray,
        time_step: float,
        environment: Environment,
        is_weighed: bool = False,
    ) -> None:
        super().__init__(plant, scene_graph, lock, surroundings)
        self._spring, self._M = spring, spring.mass_matrix()
        self._p_BoTo_B = p_BoTo_B
        exclude_collisions(scene_graph, lock.bolt_ids.values(), lock.groove_ids)
        self.system = ImpactContact(
            lock.bolt.index(),
            R_WGn,
            time_step,
            self._conditions(environment),
            lock.groove.index() if is_weighed else None,
        )

    def add_forces(self, builder: DiagramBuilder, forces: OutputPort) -> OutputPort:
        """See ContactStrategy."""
        system = builder.AddNamedSystem("impact_contact", self.system)
        state = self._plant.get_state_output_port(self._spring.instance)
        builder.Connect(state, system.GetInputPort("state"))
        desired = builder.GetSubsystemByName("arm_ahead").get_output_port()
        builder.Connect(desired, system.GetInputPort("desired_state"))
        builder.Connect(forces, system.GetInputPort("applied_spatial_force"))
        return system.get_output_port()

    def reconfigure(self, lock: Lock, parts: Parts) -> None:
        """See ContactStrategy.

        The scene graph keeps the old shapes: changing them would drop the collision
        filter between bolt and groove.
        """
        self._lock = lock

    def set_environment(self, environment: Environment, parts: Parts) -> None:
        """See ContactStrategy."""
        self.surroundings.set(parts(self.surroundings), environment)
        set_pose(self._lock, environment, parts(self._plant))
        conditions = self._conditions(environment)
        self.system.set_conditions(parts(self.system), conditions)

    def _conditions(self, environment: Environment) -> ImpactConditions:
        (K, D), lock = self._spring.gains(), self._lock
        return ImpactConditions.of(
            ImpactLaw.of(lock.contact.impact),
            lock.part.required_gaps(),
            environment,
            np.zeros((1, 3)),
            M=self._M,
            K=K,
            D=D,
            p_BoTo_B=self._p_BoTo_B,
        )


def exclude_collisions(
    scene_graph: SceneGraph, one: Iterable[GeometryId], other: Iterable[GeometryId]
) -> None:
    """Has no geometry of one group meet one of the other, in any new Context."""
    declaration = CollisionFilterDeclaration().ExcludeBetween(
        GeometrySet(list(one)), GeometrySet(list(other))
    )
    scene_graph.collision_filter_manager().Apply(declaration)


#: By the scenario's `contact.model`.
CONTACTS: dict[str, type[ContactStrategy]] = {
    "hydroelastic": HydroelasticContact,
    "impact": ImpactContactForce,
}
