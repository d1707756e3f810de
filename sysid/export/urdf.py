"""A user's URDF with the identified numbers, and all else as it was."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.files import read_bytes
from drake_disasm.common.resources import model_path
from sysid.export.identified_arm import IdentifiedArm, JointNumbers, Link
from sysid.export.xml_edits import Element, XmlEdits

Array = NDArray[np.float64]

_MOST = 2**26  # bytes of a URDF
_NAMESPACE = "http://drake.mit.edu"
_ROUNDING = 1e-15
_TENSOR = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")

_INERTIAL = """<inertial>
  <origin xyz="{xyz}" rpy="0 0 0"/>
  <mass value="{mass}"/>
  <inertia {inertia}/>
</inertial>"""
_PAYLOAD = """<link name="{name}">
  {inertial}
</link>
<joint name="{name}_weld" type="fixed">
  <parent link="{flange}"/>
  <child link="{name}"/>
</joint>"""
_TRANSMISSION = """<transmission name="{joint}_transmission">
  <type>transmission_interface/SimpleTransmission</type>
  <joint name="{joint}"/>
  <actuator name="{joint}">
    <drake:gear_ratio value="1"/>
    <drake:rotor_inertia value="{rotor}"/>
  </actuator>
</transmission>"""


@dataclass(frozen=True)
class Body:
    """A body as files write it.

    Attributes:
        mass: [kg].
        centre: (3,) p_BoBcm_B [m].
        inertia: (6,) about Bcm in B: xx, xy, xz, yy, yz, zz [kg m^2].
    """

    mass: float
    centre: Array
    inertia: Array

    @classmethod
    def of(cls, inertial: Array) -> "Body":
        """Returns the body of INERTIAL (10,)."""
        mass, c = inertial[0], inertial[1:4] / inertial[0]
        shift = mass * (c @ c * np.eye(3) - np.outer(c, c))
        return cls(float(mass), c, inertial[4:] - shift[np.triu_indices(3)])


def urdf_bytes(arm: IdentifiedArm) -> bytes:
    """Returns the URDF of an identified arm.

    Only values of `inertial`, `dynamics` and the rotors' inertias differ from the
    user's file, and a payload is added as a link of its own.

    Raises:
        DisasmError: the file can't be read, or lacks a joint or link.
    """
    path = model_path(arm.urdf)
    data = read_bytes(path, "give the robot's URDF", _MOST)
    edits = XmlEdits(data, path.name)
    links = {e.attributes.get("name", ""): e for e in edits.root.all("link")}
    joints = {e.attributes.get("name", ""): e for e in edits.root.all("joint")}
    for link in arm.links:
        _set_body(edits, _of(links, link.name, path.name), link)
    for name, numbers in arm.joints.items():
        _set_dynamics(edits, _of(joints, name, path.name), numbers)
        _set_rotor(edits, name, numbers.rotor)
    if arm.payload is not None:
        body = _inertial_text(Body.of(arm.payload.inertial)).replace("\n", "\n  ")
        name = arm.payload.name
        text = _PAYLOAD.format(name=name, inertial=body, flange=arm.flange)
        edits.add_child(edits.root, text)
    return edits.result()


def number(value: float) -> str:
    """Returns a number as text that reads back as the same; rounding errors are 0."""
    return repr(float(value)) if abs(value) > _ROUNDING else "0.0"


def _of(elements: Mapping[str, Element], name: str, file: str) -> Element:
    if name not in elements:
        raise DisasmError(
            f"{file}: has no element named '{name}', which was identified"
        )
    return elements[name]


def _set_body(edits: XmlEdits, element: Element, link: Link) -> None:
    """Writes a link's body into its element."""
    body = Body.of(link.inertial)
    inertial = element.first("inertial")
    if inertial is None:
        edits.add_child(element, _inertial_text(body), first=True)
        return
    for tag, values in _values(body).items():
        child = inertial.first(tag)
        if child is not None:
            if "rpy" in values and "rpy" not in child.attributes:
                del values["rpy"]
            edits.set_attributes(child, values)
        else:
            text = " ".join(f'{name}="{value}"' for name, value in values.items())
            edits.add_child(inertial, f"<{tag} {text}/>")


def _values(body: Body) -> dict[str, dict[str, str]]:
    """Returns the attributes of each element of a body."""
    return {
        "origin": {"xyz": " ".join(map(number, body.centre)), "rpy": "0 0 0"},
        "mass": {"value": number(body.mass)},
        "inertia": dict(zip(_TENSOR, map(number, body.inertia), strict=True)),
    }


def _inertial_text(body: Body) -> str:
    values = _values(body)
    inertia = " ".join(f'{n}="{v}"' for n, v in values["inertia"].items())
    mass = values["mass"]["value"]
    return _INERTIAL.format(xyz=values["origin"]["xyz"], mass=mass, inertia=inertia)


def _set_dynamics(edits: XmlEdits, joint: Element, numbers: JointNumbers) -> None:
    """Writes damping and friction of a joint; zeros only where others stand."""
    values = {"damping": number(numbers.damping), "friction": number(numbers.friction)}
    dynamics = joint.first("dynamics")
    if dynamics is not None:
        edits.set_attributes(dynamics, values)
    elif numbers.damping or numbers.friction:
        text = " ".join(f'{name}="{value}"' for name, value in values.items())
        edits.add_child(joint, f"<dynamics {text}/>")


def _set_rotor(edits: XmlEdits, joint: str, reflected: float) -> None:
    """Writes the rotor's inertia of a joint, which gears multiply by their ratio^2."""
    actuator = _actuator(edits.root, joint)
    if actuator is None:
        if reflected:
            text = _TRANSMISSION.format(joint=joint, rotor=number(reflected))
            edits.add_child(edits.root, text)
            _declare_drake(edits)
        return
    gear, rotor = (
        actuator.first(f"drake:{n}") for n in ("gear_ratio", "rotor_inertia")
    )
    ratio = 1.0 if gear is None else float(gear.attributes.get("value", "1"))
    inertia = number(reflected / ratio**2)
    if rotor is not None:
        edits.set_attributes(rotor, {"value": inertia})
    elif reflected:
        edits.add_child(actuator, f'<drake:rotor_inertia value="{inertia}"/>')
        _declare_drake(edits)


def _actuator(root: Element, joint: str) -> Element | None:
    """Returns the actuator of a joint's transmission; None if there is none."""
    for transmission in root.all("transmission"):
        names = [each.attributes.get("name") for each in transmission.all("joint")]
        if joint in names:
            return transmission.first("actuator")
    return None


def _declare_drake(edits: XmlEdits) -> None:
    if "xmlns:drake" not in edits.root.attributes:
        edits.root.attributes["xmlns:drake"] = _NAMESPACE
        edits.set_attributes(edits.root, {"xmlns:drake": _NAMESPACE})
