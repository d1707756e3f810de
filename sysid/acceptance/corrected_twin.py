"""The corrected twin: what closing the loop wrote, as scenarios to run a policy on."""

import copy
import dataclasses
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.files import read_json
from drake_disasm.effects import Effect, amplitudes, find_effect
from drake_disasm.mdp import STATE_NAMES
from drake_disasm.scenario import Scenario, load_scenario, with_values
from drake_disasm.scenario.randomisation import refuse_broken_ranges
from drake_disasm.scenario.schema import Range

_REMEDY = "run `drake-disasm close-loop` on transitions of the cell, and give its --out"
_VERDICT: dict[str, Any] = {
    "ending": "",
    "sentence": "",
    "provisional": False,
    "suggested": [""],
    "ties": {},
    "parameters": {},
    "invalid": "",
    "misfits": [""],
    "contradictions": [{"effect": ""}],
    "left_in_channels": [{"channel": ""}],
    "left_over": [{"channel": ""}],
    "residual_model": None,
    "errors": {"channels": {}},
}
#: What else makes a verdict one that explains its log but partly.
_PARTLY = ("invalid", "misfits", "contradictions", "suggested")
_PARAMETER = {"interval_95": [0.0], "is_at_bound": False}


@dataclass(frozen=True)
class CorrectedTwin:
    """The twin with the effects of a verdict.

    Attributes:
        scenario: at the verdict's values.
        verdict: `result.json` of `close-loop`.
    """

    scenario: Scenario
    verdict: Mapping[str, Any]

    @classmethod
    def read(cls, folder: Path) -> "CorrectedTwin":
        """Returns the corrected twin in the output folder of `close-loop`.

        Raises:
            DisasmError: the folder holds no verdict, a damaged one, or one on another
                kind of log than transitions.
        """
        path = folder / "result.json"
        if not path.is_file():
            raise DisasmError(f"{folder}: has no result.json; {_REMEDY}")
        if "reference" in read_json(path, _REMEDY, {}):
            raise DisasmError(
                f"{path}: says what has changed since a reference, and is no model of "
                f"the cell; {_REMEDY} without --reference"
            )
        verdict = read_json(path, _REMEDY, _VERDICT)
        example = {"parameters": dict.fromkeys(verdict["parameters"], _PARAMETER)}
        read_json(path, _REMEDY, example)
        channels = verdict["errors"]["channels"]
        if list(channels) != list(STATE_NAMES):
            names = ", ".join(list(channels)[:3])
            raise DisasmError(
                f"{path}: is of another kind of log (channels {names}, ...); {_REMEDY}"
            )
        scenario = folder / "scenario.yaml"
        if not scenario.is_file():
            raise DisasmError(f"{folder}: has no scenario.yaml; {_REMEDY}")
        twin = cls(load_scenario(str(scenario)), verdict)
        refuse_broken_ranges(twin.over_intervals)
        return twin

    @property
    def at_values(self) -> Scenario:
        """At the verdict's values, with nothing drawn."""
        return dataclasses.replace(self.scenario, randomisation=[])

    @property
    def over_intervals(self) -> Scenario:
        """With the verdict's parameters drawn from their intervals."""
        return with_intervals(self.scenario, self.verdict["parameters"])

    @property
    def nominal(self) -> Scenario:
        """Without the verdict's effects, as it was before the loop was closed."""
        effects = [e for e in self.scenario.effects if not self._is_learned(e)]
        scenario = dataclasses.replace(self.at_values, effects=effects)
        present = _kinds(scenario)
        names = [n for n in self.verdict["parameters"] if _is_amplitude(n, present)]
        return with_values(scenario, dict.fromkeys(names, 0.0))

    @property
    def reservations(self) -> list[str]:
        """What the verdict leaves open, as clauses after "a model that"."""
        return list(_reservations(self.verdict))

    @property
    def rivals(self) -> dict[str, list[str]]:
        """Effects that explain the log as well as one of the verdict's, by its name."""
        ties = self.verdict["ties"]
        return {name: list(others) for name, others in ties.items() if others}

    def _is_learned(self, effect: Effect) -> bool:
        """Returns whether an effect is the residual model."""
        learned = self.verdict["residual_model"]
        return bool(learned) and type(effect).__name__ == learned["effect"]


def with_intervals(scenario: Scenario, parameters: Mapping[str, Any]) -> Scenario:
    """Returns a scenario whose effects are drawn from their 95 % intervals.

    Each parameter is drawn by itself, uniformly: of parameters that are correlated the
    draws hold combinations that the log excludes, and so ask more of a policy.

    Args:
        scenario: with the effects.
        parameters: by name, each with its `interval_95`, as in `result.json`.
    """
    present = _kinds(scenario)
    ranges = [
        Range(name, *each["interval_95"])
        for name, each in parameters.items()
        if name.partition(".")[0] in present
        and each["interval_95"][0] < each["interval_95"][1]
    ]
    known = {each.parameter for each in ranges}
    kept = [each for each in scenario.randomisation if each.parameter not in known]
    return dataclasses.replace(scenario, randomisation=[*kept, *ranges])


def refused_verdict(reason: str) -> dict[str, Any]:
    """Returns the verdict, as in `result.json`, on a log that close-loop refuses."""
    lists = [key for key, example in _VERDICT.items() if isinstance(example, list)]
    return (
        copy.deepcopy(_VERDICT)
        | {key: list[Any]() for key in lists}
        | {"ending": "refused", "sentence": f"refused: {reason}"}
        | {"errors": {"channels": {name: {} for name in STATE_NAMES}}}
    )


def _kinds(scenario: Scenario) -> set[str]:
    return {type(effect).__name__ for effect in scenario.effects}


def _is_amplitude(name: str, present: set[str]) -> bool:
    """Returns whether a parameter is one that is zero without its effect.

    Args:
        name: of a verdict's parameter.
        present: kinds of effects that the scenario has.
    """
    kind, field = name.partition(".")[0], name.rpartition(".")[2]
    return kind in present and field in amplitudes(find_effect(kind))


def _reservations(verdict: Mapping[str, Any]) -> Iterator[str]:
    if verdict["provisional"]:
        yield "is provisional (the time was over before the search was)"
    if verdict["ending"] == "too short":
        yield "rests on a log that is too short to decide"
    elif verdict["ending"] in ("unexplained", "refused"):
        yield f"explains nothing for sure (ending: {verdict['ending']})"
    if verdict["invalid"]:
        yield f"does not hold for its log ({verdict['invalid']})"
    if verdict["misfits"]:
        yield f"has rows against it ({'; '.join(verdict['misfits'])})"
    if verdict["contradictions"]:
        kinds = {each["effect"] for each in verdict["contradictions"]}
        yield f"episodes of its log contradict ({', '.join(sorted(kinds))})"
    left = [*verdict["left_in_channels"], *verdict["left_over"]]
    if channels := dict.fromkeys(each["channel"] for each in left):
        yield f"leaves something unexplained in {', '.join(channels)}"
    elif verdict["ending"] == "partly" and not any(verdict[key] for key in _PARTLY):
        yield "leaves more than noise unexplained"
    if verdict["suggested"]:
        yield f"has unconfirmed effects in it ({', '.join(verdict['suggested'])})"
    if verdict["residual_model"]:
        yield "has a learned part in it that is not physical"
    at_bound = [n for n, p in verdict["parameters"].items() if p["is_at_bound"]]
    if at_bound:
        yield f"has values at their bounds ({', '.join(at_bound)})"
