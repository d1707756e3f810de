"""The identified arm as SDF, from its identified URDF."""

import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from xml.sax.saxutils import escape

import jinja2

from drake_disasm.common.errors import DisasmError
from sysid.export.xml_edits import parsed

Node = ElementTree.Element

_ENVIRONMENT = jinja2.Environment(
    loader=jinja2.PackageLoader("sysid.export", "."),
    autoescape=False,  # values are escaped as they are read
    trim_blocks=True,
    lstrip_blocks=True,
    undefined=jinja2.StrictUndefined,
)
_TYPES = ("revolute", "continuous", "prismatic", "fixed")
_TENSOR = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
_LIMITS = ("lower", "upper", "effort", "velocity")
_ZEROS = "0 0 0"
#: Of the root, which is fixed: SDF has no link without mass.
_FIXED_MASS = {"mass": "1", "inertia": [(tag, "1") for tag in ("ixx", "iyy", "izz")]}


def sdf_text(urdf: str, source: str) -> str:
    """Returns the SDF of a URDF.

    Links without mass become frames; the root, if it has none, gets 1 kg, which no
    joint carries.

    Args:
        urdf: text, as `urdf_bytes` writes it.
        source: the name of its file.

    Raises:
        DisasmError: it has a joint that SDF can't hold.
    """
    root = parsed(urdf)
    by_child = {
        _linked(joint, "child"): joint
        for joint in root.iter("joint")
        if _is_joint(joint)
    }
    links = [link for link in root.findall("link") if link.get("name") != "world"]
    frames = {
        _name(link) for link in links if _is_frame(link, by_child.get(_name(link)))
    }
    joints = [j for child, j in by_child.items() if child not in frames]
    return _ENVIRONMENT.get_template("robot.sdf.j2").render(
        source=escape(source).replace("--", "- -"),
        name=_name(root),
        links=[
            _link(link, by_child.get(_name(link)))
            for link in links
            if _name(link) not in frames
        ],
        frames=[_frame(by_child[_name(x)]) for x in links if _name(x) in frames],
        joints=[_joint(joint, root) for joint in joints],
    )


def _is_joint(element: Node) -> bool:
    """Whether an element is a joint, and not the name of one in a transmission."""
    return element.find("child") is not None


def _is_frame(link: Node, joint: Node | None) -> bool:
    is_fixed = joint is not None and joint.get("type") == "fixed"
    shapes = [*link.findall("visual"), *link.findall("collision")]
    return is_fixed and not _mass(link) and not shapes


def _mass(link: Node) -> float:
    mass = link.find("inertial/mass")
    return 0.0 if mass is None else float(mass.get("value", "0"))


def _link(link: Node, joint: Node | None) -> dict[str, object]:
    name = _name(link)
    values: dict[str, object] = {
        "name": name,
        "joint": None if joint is None else _name(joint),
        "pose": f"{_ZEROS} {_ZEROS}",
        "shapes": list(_shapes(link)),
        **_FIXED_MASS,
    }
    inertial = link.find("inertial")
    if inertial is None or not _mass(link):
        if joint is not None:
            raise DisasmError(
                f"export: link {name} moves or has shapes, and has no mass, which SDF "
                "does not know; leave sdf out, or give the link an inertial"
            )
        return values
    tensor = inertial.find("inertia")
    inertia = (
        [] if tensor is None else [(t, escape(tensor.get(t, "0"))) for t in _TENSOR]
    )
    mass = str(_mass(link))
    return values | {"pose": _pose(inertial), "mass": mass, "inertia": inertia}


def _frame(joint: Node) -> dict[str, str]:
    """Returns the frame that stands for the child of a fixed joint."""
    parent, name = _linked(joint, "parent"), _linked(joint, "child")
    return {"name": name, "parent": parent, "pose": _pose(joint)}


def _joint(joint: Node, root: Node) -> dict[str, object]:
    name, kind = _name(joint), joint.get("type", "")
    if kind not in _TYPES or joint.find("mimic") is not None:
        what = "follows another" if kind in _TYPES else f"is of the type '{kind}'"
        raise DisasmError(
            f"export: joint {name} {what}, which the SDF that is written can't hold; "
            "leave sdf out"
        )
    parent, axis = _linked(joint, "parent"), joint.find("axis")
    dynamics, limit = (_attributes(joint, tag) for tag in ("dynamics", "limit"))
    rotor, gear = _rotor(root, name)
    return {
        "name": name,
        "type": kind,
        "parent": parent,
        "child": _linked(joint, "child"),
        "base": "__model__" if parent == "world" else parent,
        "pose": _pose(joint),
        "axis": None if kind == "fixed" else escape(_axis_of(axis)),
        "limits": [(t, escape(limit[t])) for t in _LIMITS if t in limit],
        "damping": escape(dynamics.get("damping", "0")),
        "friction": escape(dynamics.get("friction", "0")),
        "rotor": rotor,
        "gear": gear,
    }


def _attributes(joint: Node, tag: str) -> dict[str, str]:
    """Returns the attributes of a joint's element; none if it is not there."""
    element = joint.find(tag)
    return {} if element is None else dict(element.attrib)


def _axis_of(axis: Node | None) -> str:
    return "1 0 0" if axis is None else axis.get("xyz", "1 0 0")


def _rotor(root: Node, joint: str) -> tuple[str, str]:
    """Returns a rotor's inertia and its gear's ratio; empty if there is none."""
    for transmission in root.findall("transmission"):
        if any(each.get("name") == joint for each in transmission.findall("joint")):
            rotor, gear = (
                transmission.find(f"actuator/drake_{tag}")
                for tag in ("rotor_inertia", "gear_ratio")
            )
            ratio = "1" if gear is None else gear.get("value", "1")
            return ("" if rotor is None else rotor.get("value", "")), ratio
    return "", "1"


def _shapes(link: Node) -> Iterator[dict[str, str]]:
    """Yields a link's visuals and collisions, as far as SDF has them."""
    for kind in ("visual", "collision"):
        for number, shape in enumerate(link.findall(kind)):
            geometry = shape.find("geometry")
            text = None if geometry is None else _geometry(geometry)
            if text is not None:
                name = escape(shape.get("name") or f"{kind}_{number}")
                yield {
                    "kind": kind,
                    "name": name,
                    "pose": _pose(shape),
                    "geometry": text,
                }


def _geometry(geometry: Node) -> str | None:
    """Returns a shape in SDF's words; None if SDF has no such shape."""
    for shape in geometry:
        values = {key: escape(value) for key, value in shape.attrib.items()}
        round_shape = "<radius>{}</radius>".format(values.get("radius", "0"))
        match shape.tag:
            case "box":
                return f"<box><size>{values['size']}</size></box>"
            case "sphere":
                return f"<sphere>{round_shape}</sphere>"
            case "cylinder" | "capsule":
                length = f"<length>{values.get('length', '0')}</length>"
                return f"<{shape.tag}>{round_shape}{length}</{shape.tag}>"
            case "mesh":
                scale = f"<scale>{values.get('scale', '1 1 1')}</scale>"
                return f"<mesh><uri>{values['filename']}</uri>{scale}</mesh>"
    return None


def _pose(element: Node) -> str:
    """Returns the pose of an element's origin: xyz and rpy."""
    origin = element.find("origin")
    if origin is None:
        return f"{_ZEROS} {_ZEROS}"
    return escape(f"{origin.get('xyz', _ZEROS)} {origin.get('rpy', _ZEROS)}")


def _linked(joint: Node, tag: str) -> str:
    element = joint.find(tag)
    return "" if element is None else escape(element.get("link", ""), {'"': "&quot;"})


def _name(element: Node) -> str:
    return escape(element.get("name", ""), {'"': "&quot;"})
