"""The cell's arm as one URDF: what it carries, and what it could run into."""

from collections.abc import Sequence
from xml.etree import ElementTree

from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import SpatialInertia

from drake_disasm.cell.arm_model import ArmModel, add_arm
from drake_disasm.cell.placement import bench_top, nominal_groove_pose
from drake_disasm.cell.tool import Tool
from drake_disasm.common.resources import model_path
from drake_disasm.scenario import Scenario

_DRAKE = "http://drake.mit.edu"
_AROUND_TOOL = 0.09  # m, radius of a cylinder that has sensor, gripper and bolt in it
_BEYOND_BOLT = 0.05  # m, from Bo to the cylinder's end
_BENCH = (0.5, 0.4)  # m, along and across, from models/bench/bench.urdf
_ABOVE_BENCH = 0.08  # m, that the lock and its plate take


def cell_urdf(scenario: Scenario) -> str:
    """Returns the URDF of the arm with its tool, beside the bench, as text.

    The tool has the inertia of sensor, gripper and bolt, and for collisions a cylinder
    that they are in; the bench is a box with the lock in it. Nothing is to be seen of
    the arm, so that no other file is needed. What its file leaves out of the drives is
    written out, as `add_arm` assumes it.

    Args:
        scenario: of the cell.

    Raises:
        DisasmError: a model file is missing, or the arm is none that a station takes.
    """
    plant = MultibodyPlant(0.0)
    arm = add_arm(plant, scenario.arm)
    plant.Finalize()
    ElementTree.register_namespace("drake", _DRAKE)
    root = ElementTree.parse(model_path(scenario.arm.model)).getroot()
    for link in root.iter("link"):
        for shape in link.findall("visual"):
            link.remove(shape)
    _complete_joints(root, plant, arm)
    tool, X_WG = Tool.from_models(scenario), nominal_groove_pose(scenario.placement)
    length = float(tool.X_FB.translation()[2]) + _BEYOND_BOLT
    link = _add_link(root, "tool", scenario.arm.flange)
    _add_inertia(link, tool.M_F)
    size = {"radius": _text(_AROUND_TOOL), "length": _text(length)}
    _add_collision(link, [0.0, 0.0, 0.5 * length], "cylinder", size)
    x, y, top = bench_top(X_WG, scenario.part)
    height = top + _ABOVE_BENCH
    box = {"size": " ".join(map(_text, (*_BENCH, height)))}
    X_WBase = arm.base.CalcPoseInWorld(plant.CreateDefaultContext())
    bench = _add_link(root, "bench", scenario.arm.base, X_WBase.inverse())
    _add_collision(bench, [x, y, 0.5 * height], "box", box)
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode") + "\n"


def _complete_joints(
    root: ElementTree.Element, plant: MultibodyPlant, arm: ArmModel
) -> None:
    """Fixes the joints that are held, and states drives that are assumed."""
    for joint in root.iter("joint"):
        if joint.get("name") in arm.held:
            joint.set("type", "fixed")
    if not arm.has_assumed_drives:
        return
    for stated in root.findall("transmission"):
        root.remove(stated)
    for index in plant.GetJointActuatorIndices():
        drive = plant.get_joint_actuator(index)
        name = drive.joint().name()
        transmission = ElementTree.SubElement(
            root, "transmission", name=f"{name}_drive"
        )
        kind = ElementTree.SubElement(transmission, "type")
        kind.text = "transmission_interface/SimpleTransmission"
        ElementTree.SubElement(transmission, "joint", name=name)
        actuator = ElementTree.SubElement(transmission, "actuator", name=name)
        for number in ("gear_ratio", "rotor_inertia"):
            value = _text(getattr(drive, f"default_{number}")())
            ElementTree.SubElement(actuator, f"{{{_DRAKE}}}{number}", value=value)


def _add_link(
    root: ElementTree.Element,
    name: str,
    parent: str,
    X_PL: RigidTransform | None = None,
) -> ElementTree.Element:
    """Returns a new link that is fixed to another, its frame there or on that one's."""
    link = ElementTree.SubElement(root, "link", name=name)
    joint = ElementTree.SubElement(root, "joint", name=f"{name}_joint", type="fixed")
    ElementTree.SubElement(joint, "parent", link=parent)
    ElementTree.SubElement(joint, "child", link=name)
    if X_PL is not None and not X_PL.IsExactlyIdentity():
        rpy = RollPitchYaw(X_PL.rotation()).vector()
        place = {"xyz": X_PL.translation(), "rpy": rpy}
        values = {key: " ".join(map(_text, value)) for key, value in place.items()}
        ElementTree.SubElement(joint, "origin", values)
    return link


def _add_inertia(link: ElementTree.Element, M_F: SpatialInertia) -> None:
    """Gives a link a spatial inertia about its own origin."""
    p = M_F.get_com()
    moments = M_F.Shift(p).CalcRotationalInertia().CopyToFullMatrix3()
    inertial = ElementTree.SubElement(link, "inertial")
    ElementTree.SubElement(inertial, "origin", xyz=" ".join(map(_text, p)))
    ElementTree.SubElement(inertial, "mass", value=_text(M_F.get_mass()))
    names = {f"i{'xyz'[i]}{'xyz'[j]}": (i, j) for i in range(3) for j in range(i, 3)}
    values = {name: _text(moments[place]) for name, place in names.items()}
    ElementTree.SubElement(inertial, "inertia", values)


def _add_collision(
    link: ElementTree.Element, p: Sequence[float], shape: str, size: dict[str, str]
) -> None:
    """Gives a link a shape about a point (3,) of its frame [m]."""
    collision = ElementTree.SubElement(link, "collision")
    ElementTree.SubElement(collision, "origin", xyz=" ".join(map(_text, p)))
    geometry = ElementTree.SubElement(collision, "geometry")
    ElementTree.SubElement(geometry, shape, size)


def _text(value: float) -> str:
    return f"{float(value):.17g}"
