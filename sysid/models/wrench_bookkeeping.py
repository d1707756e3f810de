"""Estimates of how readings of a force/torque sensor at rest were written.

All compare the weight of a free rigid load, m R_SW g and c x R_SW g, and a constant
bias with the readings as they are and as they might have been.
"""

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields, replace
from typing import Self

import numpy as np
from scipy.spatial.transform import Rotation

from drake_disasm.effects import BaseTilt, SensorEffect, SensorMounting
from drake_disasm.logs.schema import WRENCH
from sysid.models.channel_grams import (
    FAR_BETTER,
    STANDARD_ERRORS,
    Array,
    ChannelGrams,
    angle_between,
    is_beyond_chance,
    is_replicated,
    jackknife_error,
    runs_of,
)

_TURNED = 1e-4  # rad^2, mean square about the axis that is turned about the least
_EQUAL = 0.9  # of the least loss: permutations that leave less than it / this tie
_MOST_WAYS = 2.0 * np.log(48.0)  # signed permutations of forces and of torques
_FEWEST = 4  # readings: fewer always agree with some frame
_FORCE, _TORQUE = slice(0, 3), slice(3, 6)


@dataclass(frozen=True)
class Readings:
    """Readings of a sensor at rest.

    Attributes:
        R_WS: (n, 3, 3) orientations of the sensor.
        wrench: (n, 6) [f; tau] at So in S.
        g_W: (3,) gravity [m/s^2].
        in_W: whether the log has the wrench in W, from where it was turned into S.
    """

    R_WS: Array
    wrench: Array
    g_W: Array
    in_W: bool

    def turned(self, R: Array) -> Array:
        """Returns the wrenches (n, 6) turned by rotations (n, 3, 3) or (3, 3)."""
        parts = self.wrench.reshape(-1, 2, 3)
        return np.einsum("...ij,...kj->...ki", R, parts).reshape(-1, 6)

    def oriented(self, R_WS: Array) -> Self:
        """Returns the same log, read with other orientations (n, 3, 3)."""
        raw = self.turned(self.R_WS) if self.in_W else self.wrench
        read = replace(self, R_WS=R_WS, wrench=raw)
        if not self.in_W:
            return read
        return replace(read, wrench=read.turned(np.swapaxes(R_WS, 1, 2)))

    def losses(self) -> Array:
        """Returns held-out losses (blocks, 6), relative to what readings vary by."""
        grams = ChannelGrams.of(self.columns(), self.wrench[:, :, None])
        return grams.losses(np.ones((6, 1)), self.scale)

    @property
    def show_weight(self) -> bool:
        """Whether one is known, and leaves less than half of what a bias leaves."""
        weight, error = self.weight()
        rest = ChannelGrams.of(self.columns()[..., 4:], self.wrench[:, :, None])
        alone = rest.losses(np.ones((6, 1)), self.scale)
        explains = self.losses().sum() < FAR_BETTER * alone.sum()
        return bool(np.linalg.norm(weight) > STANDARD_ERRORS * error and explains)

    @property
    def scale(self) -> Array:
        """(6,) what forces, and torques, vary by [N, N m]."""
        varied = self.wrench - self.wrench.mean(axis=0)
        sizes = [np.sqrt(np.mean(varied[:, part] ** 2)) for part in (_FORCE, _TORQUE)]
        return np.repeat(np.where(np.array(sizes) > 0.0, sizes, 1.0), 3)

    def columns(self) -> Array:
        """Returns the derivatives (n, 6, 10) by mass, first moment and bias."""
        g_S = self.g_W @ self.R_WS
        found = np.zeros((len(g_S), 6, 10))
        found[:, _FORCE, 0] = g_S
        for axis in range(3):  # c x g
            found[:, _TORQUE, 1 + axis] = np.cross(np.eye(3)[axis], g_S)
        found[:, :, 4:] = np.eye(6)
        return found

    def weight(self) -> tuple[Array, float]:
        """Returns the weight (3,) in W [N] of whatever direction, and its error.

        The error is infinite where orientations do not tell a weight from a bias.
        """
        R_SW = np.swapaxes(self.R_WS, 1, 2)
        turned = (R_SW - R_SW.mean(axis=0)).reshape(-1, 3)
        least = float(np.linalg.eigvalsh(turned.T @ turned)[0])
        is_told = least > _TURNED * len(R_SW)
        columns = np.concatenate([R_SW, np.tile(np.eye(3), (len(R_SW), 1, 1))], axis=2)
        grams = ChannelGrams.of(columns, self.wrench[:, _FORCE, None])
        without = grams.shared_by_block(np.ones((3, 1)), self.scale[_FORCE])[:, :3]
        known = is_told and len(without) > 1
        return without.mean(axis=0), jackknife_error(without) if known else np.inf


@dataclass(frozen=True)
class Way:
    """A way in which readings may have been written.

    Attributes:
        name, what, remedy: as of Bookkeeping.
        readings: as they should have been.
        estimated: how many values were estimated.
    """

    name: str
    what: str
    remedy: str
    readings: Readings
    estimated: int = 0


def has_no_weight(readings: Readings, known: float) -> bool:
    """Returns whether there is no weight in readings.

    Less than half of the weight that is known to hang on the sensor.

    Args:
        readings: at rest.
        known: the weight [N].
    """
    if len(readings.wrench) < _FEWEST:
        return False
    weight, error = readings.weight()
    return float(np.linalg.norm(weight)) + STANDARD_ERRORS * error < 0.5 * known


def better_ways(readings: Readings) -> list[tuple[Way, float]]:
    """Returns ways to write readings that explain them better, with what they leave."""
    if len(readings.wrench) < _FEWEST:
        return []
    runs, written = runs_of(readings.wrench), readings.losses()
    found = []
    for way in _ways(readings):
        losses = way.readings.losses()
        by_block = losses.sum(axis=1), written.sum(axis=1)
        by_channel = losses.mean(axis=0), written.mean(axis=0)
        is_told = is_beyond_chance(*by_channel, runs, _MOST_WAYS)
        if is_told and is_replicated(*by_block) and way.readings.show_weight:
            found.append((way, float(losses.sum())))
    return found


def _ways(readings: Readings) -> Iterator[Way]:
    yield from _frames(readings)
    yield from _orientations(readings)
    yield from _gravity(readings)
    yield from _mounting(readings)
    yield from _axes(readings)


def _frames(readings: Readings) -> Iterator[Way]:
    """Yields the other frame in which the wrench may be."""
    said, other = ("W", "S") if readings.in_W else ("S", "W")
    R = readings.R_WS if readings.in_W else np.swapaxes(readings.R_WS, 1, 2)
    right = replace(readings, wrench=readings.turned(R), in_W=not readings.in_W)
    yield Way(
        "WrenchFrame",
        f"the wrench is expressed in {other}, where the log says {said}",
        f"write `frames: {{wrench: {other}}}` in the map of import-log",
        right,
    )


def _orientations(readings: Readings) -> Iterator[Way]:
    """Yields the inverse, and other orders of a quaternion's elements."""
    yield Way(
        "OrientationInverse",
        "R_WS is the inverse: the orientation of the world in the sensor's frame",
        "invert the quaternion: turn the signs of its x, y and z",
        readings.oriented(np.swapaxes(readings.R_WS, 1, 2)),
    )
    wxyz = Rotation.from_matrix(readings.R_WS).as_quat(scalar_first=True)
    for by, text in ((-1, "x, y, z, w"), (1, "w, x, y, z")):
        other = Rotation.from_quat(np.roll(wxyz, -by, axis=1), scalar_first=True)
        yield Way(
            "QuaternionOrder",
            f"the columns read as the quaternion are in the order {text}",
            "put the quaternion's columns into the order w, x, y, z, or say which it "
            "is by `as` of R_WS in the map of import-log",
            readings.oriented(other.as_matrix()),
        )


def _gravity(readings: Readings) -> Iterator[Way]:
    """Yields the direction of the weight, where no tilt of the base reaches.

    f_S = R_SW F_W + bias is linear in the weight F_W (Kubus, Kroeger and Wahl 2008).
    """
    weight, error = readings.weight()
    length = float(np.linalg.norm(weight))
    angle = angle_between(weight, readings.g_W)
    if length <= STANDARD_ERRORS * error:
        return
    if angle <= most_of(BaseTilt, "rx") + STANDARD_ERRORS * error / length:
        return
    down = weight / length
    g = float(np.linalg.norm(readings.g_W))
    degrees = np.degrees(angle)
    yield Way(
        "GravityDirection",
        f"the log's frame W is turned: gravity is along {np.round(down, 3).tolist()} "
        f"in it, {degrees:.0f} degrees from where it should be (-z)",
        "turn R_WS (and a wrench in W) into a frame whose z points up, or correct how "
        "the robot's base is mounted",
        replace(readings, g_W=g * down),
        2,
    )


def _mounting(readings: Readings) -> Iterator[Way]:
    """Yields the rotation of the sensor's axes, where no mounting error reaches.

    The one that turns weights into forces best, by singular values (Kabsch 1976).
    """
    force = readings.wrench[:, _FORCE]
    g_S = readings.g_W @ readings.R_WS
    U, _, Vt = np.linalg.svd((force - force.mean(axis=0)).T @ (g_S - g_S.mean(axis=0)))
    Q = U @ np.diag([1.0, 1.0, np.linalg.det(U @ Vt)]) @ Vt
    vector = Rotation.from_matrix(Q).as_rotvec()
    angle = float(np.linalg.norm(vector))
    if angle <= most_of(SensorMounting, "rx"):
        return
    yield Way(
        "SensorFrame",
        f"the sensor's frame is turned by {np.degrees(angle):.0f} degrees about "
        f"{np.round(vector / angle, 2).tolist()} from S",
        "turn R_WS, or the wrench, by that",
        replace(readings, wrench=readings.turned(Q.T)),
        3,
    )


def _axes(readings: Readings) -> Iterator[Way]:
    """Yields the exchange of axes, and their signs, that explains readings best.

    Of forces and of torques, each in the sensor's frame and in that of the table.
    """
    identity = np.broadcast_to(np.eye(3), readings.R_WS.shape)
    for R in (readings.R_WS, identity) if readings.in_W else (identity,):
        where = " in W" if R is readings.R_WS else ""
        turned = readings.turned(R)
        right, texts = turned.copy(), []
        columns = np.einsum(
            "nij,nkjm->nkim", R, readings.columns().reshape(-1, 2, 3, 10)
        ).reshape(-1, 6, 10)
        for part in (_FORCE, _TORQUE):
            targets = np.repeat(turned[:, None, part], 3, axis=1)
            grams = ChannelGrams.of(columns[:, part], targets)
            P = _signed_permutation(grams, readings.scale[part])
            right[:, part] = turned[:, part] @ P.T
            names = WRENCH[part]
            texts += [
                signed_text(names, P, int(i))
                for i in np.flatnonzero((np.eye(3) != P).any(axis=1))
            ]
        if texts:
            back = replace(readings, wrench=right)
            yield Way(
                "WrenchAxes",
                f"axes{where} are exchanged, or have the other sign: "
                f"{', '.join(texts)}",
                "exchange the columns, or turn the signs, in the map of import-log",
                replace(readings, wrench=back.turned(np.swapaxes(R, 1, 2))),
            )


def _signed_permutation(grams: ChannelGrams, scale: Array) -> Array:
    """Returns the signed permutation (3, 3) of a vector's axes that leaves the least.

    That which moves the fewest, of those that leave the same: a negative mass explains
    forces of the other sign as well.
    """
    lost = {
        tuple(map(tuple, P)): float(grams.loss(P, scale).sum())
        for P in signed_permutations()
    }
    written = float(grams.loss(np.eye(3), scale).sum())
    least = min(lost.values())
    if least > FAR_BETTER * written:
        return np.eye(3)
    near = [np.array(P) for P, each in lost.items() if each <= least / _EQUAL + 1e-12]
    return max(near, key=lambda P: float(np.trace(P)))


def signed_permutations() -> Iterator[Array]:
    """Yields the 47 signed permutations (3, 3) of axes that change something."""
    for axes in itertools.permutations(range(3)):
        for signs in itertools.product((1.0, -1.0), repeat=3):
            if axes != (0, 1, 2) or min(signs) < 0:
                yield np.diag(signs) @ np.eye(3)[list(axes)]


def signed_text(names: Sequence[str], P: Array, row: int) -> str:
    """Returns what a channel should be, such as `fz = -fy`.

    Args:
        names: of the channels.
        P: signed permutation of them.
        row: number of the channel.
    """
    source = int(np.argmax(np.abs(P[row])))
    sign = "-" if P[row, source] < 0 else ""
    return f"{names[row]} = {sign}{names[source]}"


def most_of(kind: type[SensorEffect], name: str) -> float:
    """Returns up to what size a field of an effect goes."""
    return float(next(f.metadata["high"] for f in fields(kind) if f.name == name))
