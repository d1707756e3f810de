"""A result as plain data, for `result.json`, and as a table for a terminal."""

from typing import Any

import numpy as np

from sysid.identification.result import Comparison, Identification, MethodResult


def to_mapping(found: Identification) -> dict[str, Any]:
    """Returns the whole result as plain data, for `result.json`."""
    names = found.sensitivity_after.names
    return {
        "parameters": _parameters(found),
        "frozen": found.frozen,
        "derived": {
            name: {"value": value, "unit": unit, "interval_95": list(interval)}
            for name, (value, unit, interval) in found.derived.items()
        },
        "objective": _objective(found),
        "channels": _channels(found),
        "correlation": found.uncertainty.correlation.tolist(),
        "identifiability": [
            {"combination": c.text(names), "interval_95": c.interval}
            for c in found.sensitivity_after.combinations
        ],
        "best_method": found.best_method,
        "methods": {name: _method(found, m) for name, m in found.methods.items()},
        "verdict": _agreement(found),
        "profiles": [
            {"parameter": p.name, "values": p.theta.tolist(),
             "objective": p.values.tolist(), "edge_95": p.edge}
            for p in found.profiles
        ],
        "block_rows": found.uncertainty.block,
        "evaluations": found.evaluations,
        "failed_simulations": found.failures,
        "notes": found.notes,
    }  # fmt: skip


def summary(found: Identification) -> str:
    """Returns the result as a table for a terminal."""
    width = max(len(p.name) for p in found.parameters)
    head = f"{'parameter':{width}} {'start':>11} {'identified':>11}  95 % interval"
    lines = [head]
    for i, p in enumerate(found.parameters):
        low, high = found.interval_bootstrap[i]
        unit = "" if p.unit == "1" else f" {p.unit}"
        lines.append(
            f"{p.name:{width}} {found.start[i]:11.5g} {found.theta[i]:11.5g}  "
            f"{low:.5g} to {high:.5g}{unit}"
        )
    for name, (value, unit, (low, high)) in found.derived.items():
        lines.append(
            f"{name:{width}} {'':11} {value:11.5g}  {low:.5g} to {high:.5g} {unit}"
        )
    lines.append(_fit_line("fitted rows", found.fitted))
    if found.held_out:
        lines.append(_fit_line("held-out rows", found.held_out))
    lines.append(f"a perfect model would reach {found.noise_floor:.3f}")
    if found.agreement:
        lines.append(found.agreement.text)
    return "\n".join(lines + [f"note: {note}" for note in found.notes])


def _fit_line(label: str, comparison: Comparison) -> str:
    return (
        f"objective on {label}: {comparison.value_before:.4g} before, "
        f"{comparison.value_after:.4g} after"
    )


def _parameters(found: Identification) -> dict[str, Any]:
    return {
        p.name: {
            "value": float(found.theta[i]),
            "start": float(found.start[i]),
            "unit": p.unit,
            "bounds": [p.low, p.high],
            "log_scale": p.log_scale,
            "meaning": p.doc,
            "interval_95_gauss_newton": found.interval_gauss_newton[i].tolist(),
            "interval_95_bootstrap": found.interval_bootstrap[i].tolist(),
            "effect_over_range": float(found.sensitivity_after.effect[i]),
        }
        for i, p in enumerate(found.parameters)
    }


def _objective(found: Identification) -> dict[str, Any]:
    units = [channel.unit for channel in found.channels]
    rows = {"fitted": found.fitted, "held_out": found.held_out}
    return {
        "noise_floor": found.noise_floor,
        **{
            name: {
                "rows": len(c.measured),
                "episodes": list(c.names),
                "before": c.value_before,
                "after": c.value_after,
                "relative_error_before": c.relative_errors(c.before, units),
                "relative_error_after": c.relative_errors(c.after, units),
            }
            for name, c in rows.items()
            if c is not None
        },
    }


def _channels(found: Identification) -> dict[str, Any]:
    fitted, held = found.fitted, found.held_out
    table = {
        "rms_before": fitted.rms(fitted.before),
        "rms_after": fitted.rms(fitted.after),
        "relative_error_after": fitted.relative_error(fitted.after),
        "whiteness_p": found.whiteness,
    }
    if held is not None:
        table["held_out_rms_before"] = held.rms(held.before)
        table["held_out_rms_after"] = held.rms(held.after)
    return {
        channel.name: {
            "unit": channel.unit,
            "noise": channel.noise,
            "noise_from": channel.origin,
            **{key: float(values[i]) for key, values in table.items()},
        }
        for i, channel in enumerate(found.channels)
    }


def _method(found: Identification, method: MethodResult) -> dict[str, Any]:
    scaling = {p.name: p for p in found.parameters}
    return {
        "objective": method.value,
        "unit_box": dict(zip(scaling, method.u.tolist(), strict=True)),
        "parts": {
            stage.name: {
                "rows": stage.rows,
                "evaluations": stage.trace.evaluations,
                "stopped": stage.trace.stopped,
                "best_so_far": stage.trace.best_so_far().tolist(),
            }
            for stage in method.stages
        },
    }


def _agreement(found: Identification) -> dict[str, Any] | None:
    v = found.agreement
    if v is None:
        return None
    return {
        "agree": bool(v.agree),
        "objective_gap": v.objective_gap,
        "parameter_gap_in_sigma": dict(
            zip(
                [p.name for p in found.parameters],
                np.asarray(v.parameter_gap).tolist(),
                strict=True,
            )
        ),
        "distance": v.distance,
        "text": v.text,
    }
