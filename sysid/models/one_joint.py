"""A single axis without a URDF: a packaged body on one joint, known by its log alone.

Inertia and gravity's first moments are parameters of the fit. What is nominal matters
where torques are compared with it: their sign, and how far a gear yields under it. So
the nominal body is the one that explains the log.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from drake_disasm.common.resources import ONE_JOINT_MODELS
from drake_disasm.logs import Episode
from sysid.models.bookkeeping import Assumption
from sysid.models.channel_grams import FAR_BETTER
from sysid.models.gravity_estimate import friction_columns
from sysid.models.regressor import INERTIAL, ArmRegressor, BaseSet

Array = NDArray[np.float64]

_MOST_ROWS = 10_000  # for a fit of six columns
_LEAST = 1e-9  # of the size that alone gives all the torque: an inertia is above zero


def is_one_joint(urdf: str) -> bool:
    """Whether a URDF is one of those that stand in for an unknown axis."""
    return urdf in ONE_JOINT_MODELS.values()


def assumption_of(urdf: str) -> Assumption:
    """Returns what is taken for granted of an axis without a URDF."""
    slides = urdf == ONE_JOINT_MODELS["slides"]
    how = "slides" if slides else "turns"
    other = "unit: rad" if slides else "unit: m"
    return Assumption(
        f"no URDF is known: the joint {how}, and moves one body, whose inertia and "
        "weight are found from the log",
        f"if that is wrong, give `{other}` of q in the map of import-log, or the URDF "
        "by `urdf`",
    )


def likely_inertia(
    arm: ArmRegressor,
    base: BaseSet,
    episodes: Sequence[Episode | Mapping[str, Array]],
) -> Array:
    """Returns the inertial parameters (10,) of the one body that explain torques.

    By least squares with an offset and friction. Neither friction nor inertia drives
    the joint: if torques of the other sign are explained by far better, the body is
    that of these, so that checks of the data find the sign.

    Args:
        arm: of one joint.
        base: its base parameters.
        episodes: with q, v, vd and tau.
    """
    parts = [np.concatenate([e[n] for e in episodes]) for n in ("q", "v", "vd", "tau")]
    q, v, vd, tau = (part[:: -(-len(part) // _MOST_ROWS)] for part in parts)
    Y = arm.regressor(q, v, vd)[:, 0, base.independent]
    names = [INERTIAL[i] for i in base.independent]
    columns = np.column_stack([Y, friction_columns(v)[:, 0]])
    kinds = [*map(_least_of, names), -np.inf, 0.0, 0.0]  # offset, viscous, dry friction
    values, losses = zip(
        *(_fit(columns, sign * tau[:, 0], kinds) for sign in (1.0, -1.0)),
        strict=True,
    )
    best = values[int(losses[1] < FAR_BETTER * losses[0])]
    return _body(dict(zip(names, best[: len(names)], strict=True)))


def _least_of(name: str) -> float:
    """Returns the least value of an inertial parameter, as a share of the largest."""
    return -np.inf if name in ("mx", "my", "mz") else _LEAST


def _fit(columns: Array, tau: Array, least: Sequence[float]) -> tuple[Array, float]:
    """Returns bounded least squares of torques (n,), and what is left of their square.

    Args:
        columns: (n, k).
        tau: (n,).
        least: (k,) the least coefficients, in units of what alone gives all of tau.
    """
    size = np.linalg.norm(columns, axis=0)
    size = np.where(size > 0.0, size, 1.0) / (np.linalg.norm(tau) or 1.0)
    found = lsq_linear(columns / size, tau, (least, np.full(len(size), np.inf)))
    return found.x / size, float(found.cost)


def _body(known: dict[str, float]) -> Array:
    """Returns all ten parameters of a physical body, from those that torques reveal.

    A body on a level axis is as heavy as it needs to be for its first moment.
    """
    if "m" in known:
        mass = inertia = known["m"]
        first = np.zeros(3)
    else:
        first = np.array([known.get(name, 0.0) for name in ("mx", "my", "mz")])
        # Torques at rest say nothing of inertia.
        inertia = known.get("Iyy", max(2.5 * float(first @ first), _LEAST))
        mass = max(1.0, 2.5 * float(first @ first) / inertia)
    return np.array([mass, *first, inertia, 0.0, 0.0, inertia, 0.0, inertia])
