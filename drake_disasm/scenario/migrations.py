"""Scenarios of older versions, in today's words."""

import yaml

from drake_disasm.common import bounded_yaml

_RIGID = ("compliance", "rigid")
_OF_LOCK = {"bolt_mass": "mass"}


def upgraded(text: str) -> str:
    """Returns the text of a scenario in today's words; most is returned as it is.

    A section `lock` is of the time when the door chain was the only part. A section
    `twin` is of the time when the twin's springs were written by hand and the gripper
    was rigid: they follow from arm and gripper now, so the section goes, and with it
    ranges of its numbers; the gripper stays rigid unless it says otherwise.
    """
    try:
        bounded_yaml.check_bounds(text)
        root = yaml.compose(text)
    except Exception:  # the reader says what is wrong
        return text
    if not isinstance(root, yaml.MappingNode):
        return text
    has_twin = _section(root, "twin") is not None
    if not has_twin and not _speaks_of_lock(root):
        return text
    _rename_lock(root)
    if has_twin:
        _drop_twin(root)
    return str(yaml.serialize(root))


def _speaks_of_lock(root: yaml.MappingNode) -> bool:
    """Returns whether a scenario has the section `lock`, or ranges of its numbers."""
    in_ranges = any(parameter.value.startswith("lock.") for parameter in _ranged(root))
    return in_ranges or _section(root, "lock") is not None


def _rename_lock(root: yaml.MappingNode) -> None:
    for key, value in root.value:
        if key.value == "lock" and isinstance(value, yaml.MappingNode):
            key.value, value.tag = "part", "!DoorChain"
            for word, _ in value.value:
                word.value = _OF_LOCK.get(word.value, word.value)
    for parameter in _ranged(root):
        if parameter.value.startswith("lock."):
            word = parameter.value.removeprefix("lock.")
            parameter.value = f"part.{_OF_LOCK.get(word, word)}"


def _drop_twin(root: yaml.MappingNode) -> None:
    root.value = [(key, value) for key, value in root.value if key.value != "twin"]
    gripper = _section(root, "gripper")
    if gripper is None:
        gripper = yaml.MappingNode("tag:yaml.org,2002:map", [])
        root.value.append((_word("gripper"), gripper))
    if isinstance(gripper, yaml.MappingNode) and not _section(gripper, _RIGID[0]):
        gripper.value.append((_word(_RIGID[0]), _word(_RIGID[1])))
    ranges = _section(root, "randomisation")
    if isinstance(ranges, yaml.SequenceNode):
        ranges.value = [node for node in ranges.value if not _is_of_twin(node)]


def _section(node: yaml.MappingNode, name: str) -> yaml.Node | None:
    found = [value for key, value in node.value if key.value == name]
    return found[0] if found else None


def _ranged(root: yaml.MappingNode) -> list[yaml.ScalarNode]:
    """Returns the nodes that name what the ranges of a scenario are of."""
    ranges = _section(root, "randomisation")
    lines = ranges.value if isinstance(ranges, yaml.SequenceNode) else []
    named = [
        _section(line, "parameter")
        for line in lines
        if isinstance(line, yaml.MappingNode)
    ]
    return [node for node in named if isinstance(node, yaml.ScalarNode)]


def _is_of_twin(node: yaml.Node) -> bool:
    if not isinstance(node, yaml.MappingNode):
        return False
    parameter = _section(node, "parameter")
    return isinstance(parameter, yaml.ScalarNode) and parameter.value.startswith(
        "twin."
    )


def _word(text: str) -> yaml.ScalarNode:
    return yaml.ScalarNode("tag:yaml.org,2002:str", text)
