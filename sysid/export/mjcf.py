"""The identified arm as MJCF, by MuJoCo's own reader of URDFs.

MuJoCo is an optional dependency: `pip install 'drake_disasm[mujoco]'`.
"""

import xml.etree.ElementTree as ElementTree
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drake_disasm.common.errors import DisasmError
from sysid.export.identified_arm import IdentifiedArm
from sysid.export.xml_edits import parsed

Array = NDArray[np.float64]

#: Bodies stay apart, also those that are welded: a payload is one.
_COMPILER = {"fusestatic": "false", "balanceinertia": "false"}


def load_mujoco() -> Any:
    """Returns the module mujoco.

    Raises:
        DisasmError: it is not installed.
    """
    try:
        import mujoco
    except ImportError:
        raise DisasmError(
            "export: MJCF is compiled by MuJoCo, which is not installed; "
            "pip install 'drake_disasm[mujoco]', or leave mjcf out"
        ) from None
    return mujoco


def mjcf_text(urdf: str, arm: IdentifiedArm, name: str) -> str:
    """Returns the MJCF of an identified arm, compiled by MuJoCo.

    Shapes that are meshes are left out: MuJoCo reads few of a URDF's formats.

    Args:
        urdf: text, as `urdf_bytes` writes it.
        arm: as identified.
        name: of the file, for messages.

    Raises:
        DisasmError: MuJoCo is not installed, or can't read the arm.
    """
    mujoco = load_mujoco()
    try:
        spec = mujoco.MjSpec.from_string(_readable(urdf))
        for joint, numbers in arm.joints.items():
            own = spec.joint(joint)
            own.armature = numbers.rotor
            own.frictionloss = numbers.friction
        spec.option.gravity = list(arm.gravity)
        spec.compile()
        return str(spec.to_xml())
    except (ValueError, RuntimeError, AttributeError) as error:
        reason = " ".join(str(error).split())
        raise DisasmError(
            f"export: MuJoCo can't read {name}: {reason}; leave mjcf out"
        ) from None


def _readable(urdf: str) -> str:
    """Returns a URDF without what MuJoCo can't read, and with how it is to be read."""
    root = parsed(urdf)
    for link in root.iter("link"):
        for kind in ("visual", "collision"):
            for shape in link.findall(kind):
                if shape.find("geometry/mesh") is not None:
                    link.remove(shape)
    extension = root.find("mujoco")
    if extension is None:
        extension = ElementTree.SubElement(root, "mujoco")
    compiler = extension.find("compiler")
    if compiler is None:
        compiler = ElementTree.SubElement(extension, "compiler")
    compiler.attrib.update(_COMPILER)
    return ElementTree.tostring(root, encoding="unicode")


class MujocoReader:
    """A file's torques by MuJoCo's inverse dynamics.

    Attributes:
        friction: dry, of each joint as compiled, by its name.

    Args:
        text: of an MJCF.
        arm: as identified, for gravity and joints.
    """

    def __init__(self, text: str, arm: IdentifiedArm) -> None:
        mujoco = load_mujoco()
        self._mujoco = mujoco
        self._model = mujoco.MjModel.from_xml_string(text)
        self._model.opt.gravity[:] = arm.gravity
        # Soft friction depends on the acceleration; the formula is added instead.
        bits = mujoco.mjtDisableBit
        disabled = bits.mjDSBL_FRICTIONLOSS | bits.mjDSBL_CONTACT | bits.mjDSBL_LIMIT
        self._model.opt.disableflags |= int(disabled)
        self._data = mujoco.MjData(self._model)
        joints = [self._model.joint(name) for name in arm.joints]
        self._q = [int(joint.qposadr[0]) for joint in joints]
        self._v = [int(joint.dofadr[0]) for joint in joints]
        loss = self._model.dof_frictionloss
        self.friction = {
            name: float(loss[dof])
            for name, dof in zip(arm.joints, self._v, strict=True)
        }

    def __call__(self, q: Array, v: Array, vd: Array) -> Array:
        """Returns torques (n, joints), without dry friction."""
        data, tau = self._data, np.empty_like(q)
        for i in range(len(q)):
            data.qpos[self._q], data.qvel[self._v] = q[i], v[i]
            data.qacc[self._v] = vd[i]
            self._mujoco.mj_inverse(self._model, data)
            tau[i] = data.qfrc_inverse[self._v]
        return tau
