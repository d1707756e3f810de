"""Whether a file that was written gives the torques that the verdict predicts."""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import JointActuatorIndex, MultibodyForces

from drake_disasm.cell.parsing import weld_root
from drake_disasm.common.errors import DisasmError
from drake_disasm.common.resources import package_map
from drake_disasm.common.text import clipped
from drake_disasm.effects import ArmEffect
from sysid.export.identified_arm import DRY, HELD, IdentifiedArm
from sysid.export.xml_edits import parsed
from sysid.models.arm_motion import ArmMotion
from sysid.models.joint_motion import JointMotionModel

Array = NDArray[np.float64]

#: Of a joint's torque, rms, by which a file may differ from the verdict. Rounding gives
#: 1e-12; a tenth of a percent is below what torque sensors are linear to, and a wrong
#: sign, frame or order of a single link gives more.
LARGEST_DIFFERENCE = 1e-3
_MOST_ROWS = 5000
_SMALL = 1e-3  # of all torques: a joint with less is compared with that
_MESH = r"(<mesh[^>]*?\bfilename=[\"'])"
_RELATIVE = r"(?!\w+://|/)"

#: Gives the torques (n, joints) of states q, v, vd (n, joints), by a file.
Reader = Callable[[Array, Array, Array], Array]


@dataclass(frozen=True)
class RoundTrip:
    """How a file compares with the verdict on held-out rows, in rms over all joints.

    Attributes:
        torque: of the verdict's prediction.
        difference: of what the file gives from what the verdict gives for the effects
            that a file holds.
        left_out: of what the verdict gives by effects, filters and shifts in time that
            no file holds.
        moved: by how much the prediction changed since no physical arm has exactly the
            identified base parameters.
        share: difference over torque of the joint where that is worst.
    """

    torque: float
    difference: float
    left_out: float
    moved: float
    share: float

    def refuse_difference(self, name: str) -> None:
        """Refuses a file that is not what was identified.

        Raises:
            DisasmError: it differs by more than LARGEST_DIFFERENCE.
        """
        if not self.share <= LARGEST_DIFFERENCE:
            raise DisasmError(
                f"export: {name}, read again, differs by {100 * self.share:.2g} % of "
                f"the torque from what was identified ({100 * LARGEST_DIFFERENCE:g} % "
                "at most), and is not written; leave this format out"
            )


@dataclass(frozen=True)
class HeldOutRows:
    """Rows that were not fitted, with what is predicted of them.

    Attributes:
        motion: of the rows.
        held: (n, joints) torques by the bodies and the effects that files hold, but
            dry friction.
        dry: (n, joints) of dry friction.
        whole: (n, joints) by all effects, as the log's filters leave them.
        before: (n, joints) the same by the parameters as identified.
    """

    motion: ArmMotion
    held: Array
    dry: Array
    whole: Array
    before: Array

    @classmethod
    def of(
        cls, model: JointMotionModel, arm: IdentifiedArm, theta: Array
    ) -> "HeldOutRows":
        """Returns the rows that a model was not fitted to; all, if there are none.

        Args:
            model: of the log.
            arm: as identified.
            theta: the parameters as identified.
        """
        model = model.unfitted()
        count = len(model.motion.time)
        rows = slice(None, None, -(-count // _MOST_ROWS))
        motion, beta = model.motion.rows(rows), arm.theta[: len(arm.bodies.beta)]
        held: list[ArmEffect] = [e for e in arm.effects if isinstance(e, HELD)]
        smooth = [e for e in held if not isinstance(e, DRY)]
        of_bodies = motion.torques(beta, smooth)
        with_dry = motion.torques(beta, held)
        whole, before = (
            model.predict(each, slice(0, count))[rows] for each in (arm.theta, theta)
        )
        return cls(motion, of_bodies, with_dry - of_bodies, whole, before)

    def compare(
        self, read: Reader, friction: Mapping[str, float], arm: IdentifiedArm
    ) -> RoundTrip:
        """Returns how a file compares.

        Args:
            read: the file's torques without dry friction.
            friction: dry, of each joint, as the file has it.
            arm: as identified.
        """
        tau = read(self.motion.q, self.motion.v, self.motion.vd)
        sizes = [numbers.friction for numbers in arm.joints.values()]
        written = [friction.get(joint, 0.0) for joint in arm.joints]
        share = [w / s if s else 1.0 for w, s in zip(written, sizes, strict=True)]
        added = [w if s == 0.0 else 0.0 for w, s in zip(written, sizes, strict=True)]
        tau = tau + self.dry * share + np.sign(self.motion.v) * added
        expected = self.held + self.dry
        off, torque = _by_joint(tau - expected), _by_joint(self.whole)
        worst = np.max(off / np.maximum(torque, _SMALL * _rms(self.whole)))
        return RoundTrip(
            _rms(self.whole),
            _rms(tau - expected),
            _rms(self.whole - expected),
            _rms(self.whole - self.before),
            float(worst),
        )


class DrakeReader:
    """A file's torques by a fresh MultibodyPlant.

    Args:
        text: of the file.
        kind: urdf or sdf.
        folder: that the file names meshes relative to.
        arm: as identified, for gravity and joints.
    """

    def __init__(self, text: str, kind: str, folder: Path, arm: IdentifiedArm) -> None:
        plant = MultibodyPlant(0.0)
        plant.mutable_gravity_field().set_gravity_vector(arm.gravity)
        parser = Parser(plant)
        parser.package_map().AddMap(package_map())
        try:
            models = parser.AddModelsFromString(absolute_meshes(text, folder), kind)
        except RuntimeError as error:
            reason = " ".join(str(error).split())
            raise DisasmError(
                f"export: the {kind} can't be read again by Drake, and is not written: "
                f"{clipped(reason)}; leave {kind} out"
            ) from None
        (instance,) = models
        bodies = [plant.get_body(i) for i in plant.GetBodyIndices(instance)]
        weld_root(plant, bodies)
        plant.Finalize()
        self._plant, self._context = plant, plant.CreateDefaultContext()
        joints = [plant.GetJointByName(name) for name in arm.joints]
        self._columns = [joint.velocity_start() for joint in joints]
        self._rotor = self._missing_rotors(arm)

    def __call__(self, q: Array, v: Array, vd: Array) -> Array:
        """Returns torques (n, joints), without dry friction, which Drake lacks."""
        plant, context = self._plant, self._context
        tau, full = np.empty_like(q), np.zeros((3, plant.num_velocities()))
        forces = MultibodyForces(plant)
        for i, state in enumerate(zip(q, v, vd, strict=True)):
            full[:, self._columns] = state
            plant.SetPositions(context, full[0])
            plant.SetVelocities(context, full[1])
            plant.CalcForceElementsContribution(context, forces)
            tau[i] = plant.CalcInverseDynamics(context, full[2], forces)[self._columns]
        return tau + self._rotor * vd

    def _missing_rotors(self, arm: IdentifiedArm) -> Array:
        """Returns the rotors (joints,) of joints for which Drake makes no actuator.

        It makes none for a limit of the effort of zero.
        """
        plant = self._plant
        actuators = [
            plant.get_joint_actuator(JointActuatorIndex(i))
            for i in range(plant.num_actuators())
        ]
        driven = {actuator.joint().name() for actuator in actuators}
        rotors = {joint: numbers.rotor for joint, numbers in arm.joints.items()}
        return np.array([0.0 if j in driven else rotors[j] for j in arm.joints])


def written_friction(text: str) -> dict[str, float]:
    """Returns dry friction of each joint of a URDF or SDF, by its name."""
    friction = {}
    for joint in parsed(text).iter("joint"):
        name = joint.get("name", "")
        for dynamics in joint.iter("dynamics"):
            text_of_sdf = dynamics.findtext("friction")
            friction[name] = float(text_of_sdf or dynamics.get("friction") or 0.0)
    return friction


def absolute_meshes(text: str, folder: Path) -> str:
    """Returns a robot's file whose relative names of meshes are those of a folder."""
    start = f"{folder.resolve()}/".replace("\\", r"\\")
    text = re.sub(_MESH + _RELATIVE, rf"\g<1>{start}", text)
    return re.sub("(<uri>)" + _RELATIVE, rf"\g<1>{start}", text)


def _by_joint(values: Array) -> Array:
    """Returns the rms (joints,) of torques (n, joints)."""
    return np.asarray(np.sqrt(np.mean(values**2, axis=0)))


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))
