"""What the twins say of policies, in plain English and as plain data."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from sysid.acceptance.acceptance import Acceptance
from sysid.acceptance.corrected_twin import CorrectedTwin

_LINE = (
    "{twin_says:9}  {at_values:6}  {draws:5}  {at_least:>8}  {nominal:7}  "
    "{mean_force:6.2f}  {peak_force:6.2f}  {mean_torque:6.3f}  {peak_torque:6.3f}  "
    "{duration:4.1f}"
)


def conclusion(judged: Sequence[Acceptance], twin: CorrectedTwin) -> str:
    """Returns which policy to take, or that there is none, and under which model."""
    best, accepted = judged[0], sum(each.is_accepted for each in judged)
    under = "; ".join(twin.reservations)
    model = f", under a model that {under}" if under else ""
    if not accepted:
        return (
            f"refused: the corrected twin accepts no policy{model}. Train several "
            "seeds on its scenario.yaml"
        )
    count = f" ({accepted} of {len(judged)} are accepted)" if len(judged) > 1 else ""
    return f"accepted: take {best.policy}{count}{model}"


def remarks(judged: Sequence[Acceptance], twin: CorrectedTwin) -> list[str]:
    """Returns what to know besides: bounds, rivals, and what the nominal twin says."""
    draws = len(judged[0].draws)
    low = 100.0 * 0.05 ** (1.0 / draws)
    said = ["each parameter is drawn by itself, also where the log ties it to others"]
    if judged[0].is_accepted:
        said.append(
            f"success in {draws} of {draws} draws shows that at least {low:.0f} % of "
            "all draws succeed (95 % confidence)"
        )
    if not twin.over_intervals.randomisation:
        said.append("the verdict has no interval to draw from: draws differ in noise")
    for name, others in twin.rivals.items():
        said.append(
            f"the verdict has rivals, on which no policy was tried: {name} or "
            f"{' or '.join(others)}"
        )
    for nominal, verbs in ((True, "accepts refuses"), (False, "refuses accepts")):
        unlike = [each for each in judged if each.nominal.succeeded is nominal]
        names = [each.policy for each in unlike if each.is_accepted is not nominal]
        if names:
            verb, other = verbs.split()
            said.append(
                f"the nominal twin {verb} {', '.join(names)}: the corrected one {other}"
            )
    return said


def as_text(judged: Sequence[Acceptance], twin: CorrectedTwin) -> str:
    """Returns a table of policies, why some are refused, and the conclusion."""
    limits = twin.scenario.task.reward
    width = max(6, *(len(each.policy) for each in judged))
    lines = [
        f"{'policy':{width}}  twin says  values  draws  at least  nominal  "
        "mean F  peak F  mean T  peak T  time",
        f"{'':{width}}                          (95 %)            "
        f"  [N]   of {limits.f_max:g}  [N m]    of {limits.t_max:g}   [s]",
    ]
    for each in judged:
        cells = _LINE.format(**figures_of(each))
        lines.append(f"{each.policy:{width}}  {cells}")
    lines += [f"{each.policy}: {each.reason}" for each in judged if each.reason]
    return "\n".join([*lines, *remarks(judged, twin), conclusion(judged, twin)])


def figures_of(judged: Acceptance) -> dict[str, Any]:
    """Returns the cells of a policy's line; forces are over all its trials."""
    trials = judged.trials
    return {
        "twin_says": "accepted" if judged.is_accepted else "refused",
        "at_values": "yes" if judged.values.succeeded else "no",
        "draws": f"{judged.successes}/{len(judged.draws)}",
        "at_least": f"{100.0 * judged.success_low:.0f} %",
        "nominal": "yes" if judged.nominal.succeeded else "no",
        "mean_force": float(np.mean([t.mean_force for t in trials])),
        "peak_force": max(t.peak_force for t in trials),
        "mean_torque": float(np.mean([t.mean_torque for t in trials])),
        "peak_torque": max(t.peak_torque for t in trials),
        "duration": float(np.mean([t.duration for t in trials])),
    }


def to_mapping(judged: Sequence[Acceptance], twin: CorrectedTwin) -> dict[str, Any]:
    """Returns everything that a program may want to know."""
    limits = twin.scenario.task.reward
    return {
        "accepted": judged[0].is_accepted,
        "recommended": judged[0].policy if judged[0].is_accepted else None,
        "conclusion": conclusion(judged, twin),
        "reservations": twin.reservations,
        "rivals": twin.rivals,
        "remarks": remarks(judged, twin),
        "verdict": twin.verdict["sentence"],
        "limits": {"force": limits.f_max, "torque": limits.t_max},
        "ranges": {
            r.parameter: [r.low, r.high] for r in twin.over_intervals.randomisation
        },
        "policies": [
            each.to_mapping() | {"figures": figures_of(each)} for each in judged
        ],
    }
