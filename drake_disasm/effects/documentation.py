"""The documentation of effects, generated from their classes."""

import dataclasses
from collections.abc import Iterator, Sequence

from drake_disasm.effects.base import (
    ArmEffect,
    Effect,
    EnvironmentEffect,
    MotionEffect,
    PoseEffect,
    SensorEffect,
)
from drake_disasm.effects.fields import shape_parameters

_SECTIONS: dict[type[Effect], str] = {
    EnvironmentEffect: "Environment: around the bolt",
    MotionEffect: "Motion: from command to arm",
    PoseEffect: "Pose: from encoders to what is reported",
    SensorEffect: "Sensor: from load to reading",
    ArmEffect: "Arm: from joint to torque reading",
}


def documentation(effects: Sequence[type[Effect]]) -> str:
    """Returns effects with their fields as Markdown, in sections by where they act."""
    return "\n".join(
        line
        for place, title in _SECTIONS.items()
        for line in _section(title, [e for e in effects if issubclass(e, place)])
    )


def _section(title: str, effects: Sequence[type[Effect]]) -> Iterator[str]:
    """Yields an overview of the effects at a place, then each in full."""
    if not effects:
        return
    yield from (f"## {title}", "", "| effect | what it is |", "|---|---|")
    for effect in effects:
        link = f"[`{effect.__name__}`](#{effect.__name__.lower()})"
        yield f"| {link} | {_cell(effect.description())} |"
    yield ""
    for effect in effects:
        yield from _entry(effect)


def _entry(effect: type[Effect]) -> Iterator[str]:
    """Yields an effect's description, equation, fields and experiments."""
    yield from (f"### `{effect.__name__}`", "", effect.description(), "")
    if equation := effect.equation():
        yield from ("```text", equation, "```", "")
    if place := effect.place():
        yield from (f"Where it acts: {place}", "")
    yield from (
        "| field | kind | unit | from | to | what |",
        "|---|---|---|---|---|---|",
    )
    for field in dataclasses.fields(effect):
        yield _row(effect, field)
    yield ""
    if effect.experiment:
        yield from (f"Revealed by: {effect.experiment}.", "")
    for rival, experiment in effect.experiments_against.items():
        yield from (f"Distinguished from `{rival}` by: {experiment}.", "")


def _row(effect: type[Effect], field: dataclasses.Field) -> str:
    data = field.metadata
    kind, unit, low, high = "name", "", "", ""
    if isinstance(field.default, float):
        kind, unit = "amplitude", data["unit"]
        low, high = f"{data['low']:g}", f"{data['high']:g}"
    if field.name in shape_parameters(effect):
        kind = f"shape ({field.default:g})"
    cells = (f"`{field.name}`", kind, unit, low, high, data.get("doc", ""))
    return "| " + " | ".join(_cell(cell) for cell in cells) + " |"


def _cell(text: str) -> str:
    return text.replace("|", "\\|")
