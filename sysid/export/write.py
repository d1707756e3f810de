"""Robots' files of what closing the loop identified, checked by reading them again."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from drake_disasm.common.files import write_bytes
from drake_disasm.common.resources import model_path
from drake_disasm.effects import amplitudes, shape_parameters
from drake_disasm.scenario import dump_scenario
from sysid.effect_selection.close_loop import ClosedLoop
from sysid.export.identified_arm import IdentifiedArm, exportable
from sysid.export.mjcf import MujocoReader, load_mujoco, mjcf_text
from sysid.export.round_trip import (
    DrakeReader,
    HeldOutRows,
    RoundTrip,
    written_friction,
)
from sysid.export.sdf import sdf_text
from sysid.export.urdf import urdf_bytes
from sysid.models.base import LogModel

#: Formats, with the endings of their files.
FORMATS = {"urdf": ".urdf", "sdf": ".sdf", "mjcf": ".xml"}
NOTES = "export.md"

_NOTES = """# {stem}: what was identified, and what the files hold

{exactness}

| file | read by | differs from the verdict, % of the torque of the worst joint |
|---|---|---|
{trips}

The torques have an rms of {torque:.3g} N m; no file holds {left_out:.3g} N m of it.

## What the files do not hold

{rows}

Dry friction is in the files by its size when the joint slides, not how it builds up.
Drake's MultibodyPlant does not simulate it. Systems add it, and what the files lack:

```python
from drake_disasm.scenario import load_scenario
from sysid.export import add_identified_effects

scenario = load_scenario("{stem}_effects.yaml")
add_identified_effects(builder, plant, scenario)  # a plant of {stem}, finalized
```

Damping, friction and rotors are zero where none was identified, whatever the original
file has. Inertia of a rotor that the motion does not separate from a link's is in the
link. Meshes are named as in the original file: relative names need the file in its
folder. MJCF has no meshes.
"""
_EXACT = "The bodies are physical and have exactly the identified base parameters."
_MOVED = (
    "No physical arm has exactly the identified base parameters. Those of the files "
    "are within the joint 95 % interval, at {ratio:.2f} of the way to its edge. This "
    "moves the predicted torques by {moved:.3g} N m rms, and friction with them."
)


@dataclass(frozen=True)
class Exports:
    """Files of an identified arm, each read again with success.

    Attributes:
        files: content, by name.
        trips: how each format compares with the verdict.
        arm: as identified.
    """

    files: Mapping[str, bytes]
    trips: Mapping[str, RoundTrip]
    arm: IdentifiedArm

    def write(self, folder: Path) -> None:
        """Writes all files into a folder."""
        for name, content in self.files.items():
            write_bytes(folder / name, content)

    def to_mapping(self) -> dict[str, Any]:
        """Returns what a program may want to know, for `result.json`."""
        bodies = self.arm.bodies
        return {
            "files": list(self.files),
            "base_parameters_are_exact": bodies.is_exact,
            "distance_in_joint_interval": _ratio(self.arm),
            "divergence": bodies.divergence,
            "round_trips": {
                kind: dataclasses.asdict(trip) for kind, trip in self.trips.items()
            },
        }


def refuse_export(model: LogModel, formats: Sequence[str]) -> None:
    """Refuses what can't be exported, before anything is fitted.

    Raises:
        DisasmError: the model is not of a robot's torques, or MuJoCo is missing.
    """
    exportable(model)
    if "mjcf" in formats:
        load_mujoco()


def make_exports(closed: ClosedLoop, formats: Sequence[str]) -> Exports:
    """Returns robots' files of a closed loop, each read again.

    Args:
        closed: of an arm's joint torques.
        formats: of FORMATS.

    Raises:
        DisasmError: the arm can't be exported, or a file that is read again differs
            from the verdict.
    """
    arm = IdentifiedArm.of(closed)
    model = exportable(closed.last.model)
    rows = HeldOutRows.of(model, arm, closed.last.theta)
    source = model_path(arm.urdf)
    stem = f"{source.stem}_identified"
    written = urdf_bytes(arm)
    urdf = written.decode(errors="replace")  # names of links are in ASCII
    files, trips = {}, {}
    for kind in dict.fromkeys(formats):
        name = stem + FORMATS[kind]
        text = _TEXTS[kind](urdf, arm, source)
        read, friction = _reader(kind, text, arm, source.parent)
        trips[kind] = rows.compare(read, friction, arm)
        trips[kind].refuse_difference(name)
        files[name] = written if kind == "urdf" else text.encode()
    scenario = model.scenario_at(arm.theta)
    files[f"{stem}_effects.yaml"] = dump_scenario(scenario).encode()
    files[NOTES] = _notes(arm, stem, trips).encode()
    return Exports(files, trips, arm)


_TEXTS: dict[str, Callable[[str, IdentifiedArm, Path], str]] = {
    "urdf": lambda urdf, arm, source: urdf,
    "sdf": lambda urdf, arm, source: sdf_text(urdf, source.name),
    "mjcf": lambda urdf, arm, source: mjcf_text(urdf, arm, source.name),
}


def _reader(
    kind: str, text: str, arm: IdentifiedArm, folder: Path
) -> tuple[Callable[..., Any], dict[str, float]]:
    """Returns what reads a file again, and the dry friction in it."""
    if kind == "mjcf":
        by_mujoco = MujocoReader(text, arm)
        return by_mujoco, by_mujoco.friction
    return DrakeReader(text, kind, folder, arm), written_friction(text)


def _ratio(arm: IdentifiedArm) -> float:
    """Returns how far the base parameters are on the way to their interval's edge."""
    return float(np.sqrt(arm.bodies.distance / arm.bodies.limit))


def _notes(arm: IdentifiedArm, stem: str, trips: Mapping[str, RoundTrip]) -> str:
    first = next(iter(trips.values()))
    moved = _MOVED.format(ratio=_ratio(arm), moved=first.moved)
    lines = [
        f"| {stem}{FORMATS[kind]} | {'MuJoCo' if kind == 'mjcf' else 'Drake'} | "
        f"{100 * trip.share:.2g} |"
        for kind, trip in trips.items()
    ]
    rows = ["| effect | joint | values |", "|---|---|---|"]
    for effect in arm.left_out:
        kind = type(effect)
        numbers = [*amplitudes(kind), *shape_parameters(kind)]
        values = ", ".join(f"{n} = {getattr(effect, n):.4g}" for n in numbers)
        rows.append(
            f"| {kind.in_words()} | {getattr(effect, 'joint', '')} | {values} |"
        )
    return _NOTES.format(
        stem=stem,
        exactness=_EXACT if arm.bodies.is_exact else moved,
        trips="\n".join(lines),
        torque=first.torque,
        left_out=first.left_out,
        rows="\n".join(rows) if arm.left_out else "Nothing.",
    )
