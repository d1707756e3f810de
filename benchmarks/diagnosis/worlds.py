"""Hidden worlds: a cell that lacks nothing, or one effect that its model does not have.

Models have IMPACT contact, about as stiff as the cell's.

A world is drawn from its group and its number alone. Of effects of the library,
sizes are such that the true model takes away a quarter to nine tenths of the loss of
two removals of a door chain; a delay takes away nothing there.
"""

import copy
import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from diagnosis.unknown_effects import UNKNOWN
from drake_disasm.effects import Effect, find_effect, registered_effects
from drake_disasm.scenario import Scenario, load_scenario
from sysid.models.twin import with_impact_as_stiff

#: Effects that logs of removals leave ambiguous.
PAIRS = (
    ("SensorDrift", "SensorWarmUp"),
    ("SensorCrossTalk", "SensorMounting"),
    ("GroovePose", "GrooveBend"),
    ("GrooveFriction", "GrooveStribeckFriction"),
    ("SensorGain", "PayloadError"),
    ("SensorDelay", "SensorLag"),
    ("Backlash", "Compliance"),
)
_SEEDS = 1000  # of noise in each world
_PARTS = ("removal", "iiwa_peg", "iiwa_bayonet")
#: Of each group: first seed, and how many worlds there are. Those held out are of
#: pairs, for a last judgement: no rule was chosen on those from 94 on.
GROUPS: Mapping[str, tuple[int, int]] = {
    "pairs": (100, 100),
    "null": (200, 20),
    "missing": (300, 20),
    "parts": (400, 60),
    "held_out": (500, 140),
}
_NULLS, _MISSING = 9, 9  # of the worlds of all parts; the others are of pairs

_Range = tuple[float, float]


@dataclasses.dataclass(frozen=True)
class Sizes:
    """Of an effect: one of its fields is drawn, and its size.

    Attributes:
        fields: to choose from, with least and greatest size.
        is_signed: whether it may be negative.
        shape: its other fields, all of them.
    """

    fields: Mapping[str, _Range]
    is_signed: bool = True
    shape: Mapping[str, _Range] = dataclasses.field(default_factory=dict)


_SLIP = {"velocity": (0.012, 0.018)}
SIZES: Mapping[str, Sizes] = {
    "SensorDrift": Sizes(
        {"fx": (0.025, 0.06), "fy": (0.025, 0.06), "fz": (0.07, 0.16)}
    ),
    "SensorWarmUp": Sizes(
        {"fx": (0.8, 2.0), "fy": (0.8, 2.0), "fz": (2.0, 5.0)},
        shape={"time_constant": (10.0, 30.0)},
    ),
    "SensorCrossTalk": Sizes({"fy_fx": (0.15, 0.35), "fz_fx": (0.3, 0.45)}),
    "SensorMounting": Sizes(
        {"rx": (0.01, 0.03), "ry": (0.07, 0.17), "rz": (0.1, 0.24)}
    ),
    "GroovePose": Sizes({"ry": (0.006, 0.012), "rz": (0.012, 0.024)}),
    "GrooveBend": Sizes({"ky": (0.4, 0.8), "kz": (0.15, 0.3)}),
    "GrooveFriction": Sizes({"coefficient": (0.2, 0.4)}, False),
    "GrooveStribeckFriction": Sizes({"coefficient": (0.3, 0.5)}, False, _SLIP),
    "SensorGain": Sizes({"fx": (0.15, 0.35)}),
    "PayloadError": Sizes({"mass": (0.5, 0.9), "cy": (0.04, 0.07)}),
    "SensorDelay": Sizes({"delay": (0.05, 0.12)}, False, {"share": (1.0, 1.0)}),
    "SensorLag": Sizes({"share": (0.9, 1.0)}, False, {"time_constant": (0.1, 0.4)}),
    "Backlash": Sizes(dict.fromkeys("yz", (1e-4, 3e-4)), False),
    "Compliance": Sizes(dict.fromkeys("xy", (3.2e-5, 3.9e-5)), False),
    "SensorBeat": Sizes({"a": (1.0, 3.0)}, shape={"frequency": (0.1, 0.4)}),
    "SensorCurvature": Sizes({"c": (0.015, 0.04)}),
    "WavyPull": Sizes({"a": (1.0, 3.0)}, shape={"length": (0.01, 0.02)}),
    "Flutter": Sizes({"a": (1.0, 3.0)}, shape={"frequency": (0.1, 0.4)}),
}


@dataclasses.dataclass(frozen=True)
class World:
    """A cell, and what is hidden in it.

    Attributes:
        group, number: of which it is drawn.
        model: what is known of it, with the quick contact model.
        effects: that are hidden.
        pair: to which they belong; empty for none.
    """

    group: str
    number: int
    model: Scenario
    effects: tuple[Effect, ...]
    pair: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """Of its folder."""
        return f"{self.group}_{self.number}"

    @property
    def seed(self) -> int:
        """Of the noise of its first episode; others follow, and no world shares one."""
        return _SEEDS * (GROUPS[self.group][0] + self.number)

    @property
    def hidden(self) -> tuple[str, ...]:
        """Names that a verdict is to have: none of an effect that is in no library."""
        kinds = [type(effect) for effect in self.effects]
        return tuple(kind.__name__ for kind in kinds if kind not in UNKNOWN)

    @property
    def is_in_library(self) -> bool:
        """Whether the library has what is hidden."""
        return len(self.hidden) == len(self.effects)

    @property
    def real(self) -> Scenario:
        """The cell as it is: with hydroelastic contact, and what is hidden."""
        real = copy.deepcopy(self.model)
        real.contact.model, real.effects = "hydroelastic", list(self.effects)
        return real


def library() -> list[type[Effect]]:
    """Returns the effects that may be named: all but those that no library has."""
    return [kind for kind in registered_effects() if kind not in UNKNOWN]


def draw(group: str, number: int) -> World:
    """Returns a world."""
    seed, _ = GROUPS[group]
    random = np.random.default_rng([seed, number])
    if group != "parts":
        kind = "pairs" if group == "held_out" else group
        return _drawn(group, number, _PARTS[0], kind, number, random)
    part = _PARTS[number % len(_PARTS)]
    if number < _NULLS:
        return _drawn(group, number, part, "null", number, random)
    if number < _NULLS + _MISSING:
        return _drawn(group, number, part, "missing", number - _NULLS, random)
    turn = (number - _NULLS - _MISSING) // len(_PARTS)
    return _drawn(group, number, part, "pairs", turn, random)


def _drawn(
    group: str,
    number: int,
    part: str,
    kind: str,
    turn: int,
    random: np.random.Generator,
) -> World:
    model = with_impact_as_stiff(load_scenario(part))
    if kind == "null":
        return World(group, number, model, ())
    if kind == "missing":
        name = UNKNOWN[turn % len(UNKNOWN)].__name__
        return World(group, number, model, (_effect(name, random),))
    pair = PAIRS[turn % len(PAIRS)]
    return World(group, number, model, (_effect(pair[_coin(random)], random),), pair)


def _coin(random: np.random.Generator) -> int:
    return int(random.integers(2))


def _effect(name: str, random: np.random.Generator) -> Effect:
    sizes = SIZES[name]
    field = str(random.choice(list(sizes.fields)))
    size = _between(sizes.fields[field], random)
    sign = -1.0 if sizes.is_signed and _coin(random) else 1.0
    values: dict[str, Any] = {field: sign * size}
    shape = {key: _between(of, random) for key, of in sizes.shape.items()}
    return find_effect(name)(**values, **shape)


def _between(of: Sequence[float], random: np.random.Generator) -> float:
    """Returns a number between two, even on a logarithmic scale."""
    return float(f"{np.exp(random.uniform(*np.log(of))):.4g}")
