"""What the batched twin is made of, as numbers of a scenario without its effects."""

import dataclasses
import functools
from typing import Any

import numpy as np
from pydrake.multibody.tree import SpatialInertia

from drake_disasm.cell.coordinates import BoltCoordinates
from drake_disasm.cell.grip import (
    AXIS_ORDER,
    Springs,
    bolt_compliance,
    deflection,
)
from drake_disasm.cell.placement import nominal_groove_pose
from drake_disasm.cell.sensor import sensor_under_part
from drake_disasm.cell.tool import summed
from drake_disasm.cell.twin_parameters import TwinParameters, twin_of
from drake_disasm.common.arrays import Array
from drake_disasm.common.rotations import Pose
from drake_disasm.effects import Environment
from drake_disasm.mdp import TaskGeometry, action_bounds
from drake_disasm.parts.gaps import Gaps
from drake_disasm.scenario import Scenario, TaskConfig
from drake_disasm.systems.imprecision import Imprecise
from drake_disasm.systems.observation import Mounting
from drake_disasm.twin.arm_step import ArmStep
from drake_disasm.twin.law import ImpactLaw
from drake_disasm.twin.plant import Body

_GRAVITY_W = np.array([0.0, 0.0, -9.81])
_JOINTS = [3, 4, 5, *(axis - 3 for axis in AXIS_ORDER[3:])]  # of Drake's [w; v]


@dataclasses.dataclass(frozen=True)
class TwinNumbers:
    """All that a twin is made of, except effects; of n of them, arrays (n, ...).

    Attributes:
        law, gaps: of the contact, at the nominal environment.
        M: (6, 6) mass matrix of the twin's joints at their zero.
        arm: a step of it.
        grip: springs between arm and bolt.
        body: that the sensor carries.
        nominal: the environment without effects.
        mounting: of the sensor.
        task, geometry: of the MDP.
        bounds: (6,) largest action [m, rad].
        imprecise: of the scenario's imprecision.
        noise, quantum: (6,) of the sensor.
    """

    law: ImpactLaw
    gaps: Gaps
    M: Array
    arm: ArmStep
    grip: Springs
    body: Body
    nominal: Environment
    mounting: Mounting
    task: TaskConfig
    geometry: TaskGeometry
    bounds: Array
    imprecise: Imprecise
    noise: Array
    quantum: Array

    @classmethod
    def of(cls, scenario: Scenario) -> "TwinNumbers":
        """Returns the numbers of a scenario, whatever its effects.

        Arm, tool and bolt take milliseconds, where they are not those of an earlier
        scenario: then they come from memory.

        Raises:
            DisasmError: the arm can't reach the lock.
        """
        rigid = _rigid(_Case.of(scenario))
        part, bounds = scenario.part, action_bounds(scenario.task)
        return cls(
            law=ImpactLaw.of(scenario.contact.impact),
            gaps=part.required_gaps(),
            M=rigid.M,
            arm=rigid.arm,
            grip=rigid.grip,
            body=rigid.body,
            nominal=part.environment(scenario.contact),
            mounting=rigid.mounting,
            task=scenario.task,
            geometry=TaskGeometry.of(scenario, rigid.compliance),
            bounds=bounds,
            imprecise=Imprecise.of(scenario.imprecision, bounds),
            noise=np.array(scenario.ft_sensor.noise),
            quantum=np.array(scenario.ft_sensor.quantum),
        )

    @property
    def coordinates(self) -> BoltCoordinates:
        """The twin's."""
        return BoltCoordinates(self.body.p_BoTo_B)

    def deflection(self, wrench: Array) -> Array:
        """Returns by how much the grip gives (n, 6) under wrenches (n, 6) on the bolt.

        In the twin's coordinates; see `cell.grip.deflection`.
        """
        body = self.body
        return deflection(self.grip, body.p_BoTo_B, body.mass * body.g_Gn, wrench)


@dataclasses.dataclass(frozen=True)
class _Case:
    """What arm, tool and bolt depend on; equal if its text is."""

    text: str
    scenario: Scenario = dataclasses.field(compare=False)

    @classmethod
    def of(cls, scenario: Scenario) -> "_Case":
        """Returns the case of a scenario."""
        part = scenario.part
        fixed: dict[str, Any] = dict.fromkeys(part.fixed_fields, 0.0)
        is_weighed = scenario.ft_sensor.place == "part"
        parts = (
            part if is_weighed else dataclasses.replace(part, **fixed),
            scenario.simulation.twin_time_step,
            scenario.placement,
            scenario.arm,
            scenario.gripper,
            scenario.ft_sensor.model,
            scenario.ft_sensor.place,
            scenario.task.period,
        )
        return cls(repr(parts), scenario)


@dataclasses.dataclass(frozen=True)
class _Rigid:
    """The part of the numbers that takes time; see TwinNumbers, TaskGeometry."""

    M: np.ndarray
    arm: ArmStep
    grip: Springs
    body: Body
    mounting: Mounting
    compliance: np.ndarray


@functools.lru_cache(maxsize=4096)
def _rigid(case: _Case) -> _Rigid:
    scenario = case.scenario
    parameters = twin_of(scenario)
    time_step = scenario.simulation.twin_time_step
    M_B = summed([scenario.part.M_moved_B, parameters.M_fingers_B])
    return _Rigid(
        M=_mass_matrix(M_B, parameters.p_BoTo_B),
        arm=ArmStep.of(parameters.arm, parameters.grip, time_step),
        grip=parameters.grip,
        body=_body(scenario, M_B, parameters.p_BoTo_B),
        mounting=_mounting(scenario, M_B, parameters),
        compliance=bolt_compliance(scenario),
    )


def _mass_matrix(M_B: SpatialInertia, p_BoTo_B: np.ndarray) -> np.ndarray:
    """Returns the mass matrix (6, 6) of the twin's joints at To."""
    whole = M_B.Shift(p_BoTo_B).CopyToFullMatrix6()
    return whole[np.ix_(_JOINTS, _JOINTS)]


def _body(scenario: Scenario, M_B: SpatialInertia, p_BoTo_B: np.ndarray) -> Body:
    R_WG = nominal_groove_pose(scenario.placement).rotation()
    return Body(
        M_B.get_mass(),
        M_B.get_com(),
        M_B.CalcRotationalInertia().CopyToFullMatrix3(),
        R_WG.matrix().T @ _GRAVITY_W,
        p_BoTo_B,
    )


def _mounting(
    scenario: Scenario, M_B: SpatialInertia, parameters: TwinParameters
) -> Mounting:
    R_WG = nominal_groove_pose(scenario.placement).rotation().matrix()
    X_SB, X_GS = parameters.X_SB, None
    mass, p_SoScm_S = M_B.get_mass(), X_SB @ M_B.get_com()
    if scenario.ft_sensor.place == "part":
        there, M_S = sensor_under_part(scenario)
        mass, p_SoScm_S, X_GS = M_S.get_mass(), M_S.get_com(), Pose.of(there)
    return Mounting(Pose.of(X_SB), R_WG, mass, p_SoScm_S, _GRAVITY_W, X_GS)
