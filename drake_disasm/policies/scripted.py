"""Two scripted policies: the naive one, and the classical baseline."""

import dataclasses

import numpy as np

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.quantity import closest


@dataclasses.dataclass(frozen=True)
class Straight:
    """Always moves along +x, whatever the wrench.

    Attributes:
        speed: per step [m].
    """

    speed: float = 0.001

    def __call__(self, observation: np.ndarray) -> np.ndarray:
        """Returns the action (6,) for any observation (12,)."""
        return np.array([self.speed, 0.0, 0.0, 0.0, 0.0, 0.0])


@dataclasses.dataclass(frozen=True)
class Admittance:
    """Pushes along +x, yields to the measured wrench, and lifts once it is stopped.

    A Cartesian admittance per step (Hogan 1985): a = C (w_push + w), where w is
    the measured wrench on the bolt and C its compliance per step. Along x it pushes
    with a bounded force, so it slows down as resistance grows and stops at a stop;
    then, and while the bolt is being lifted, it pushes upwards instead. It knows
    neither the groove's direction nor where it ends.

    Attributes:
        speed: greatest step along x [m].
        push: resistance at which the motion along x stops [N].
        stop: resistance along x that counts as the end of the groove [N].
        lift: resistance at which the motion along y stops [N].
        lift_speed: greatest step along y [m].
        lifted: rise from which on it keeps lifting [m].
        yield_compliance: step per force across the motion [m/N]. Times the arm's
            stiffness it must stay below 1, or the yielding overshoots.
        push_compliance: step per force along x while pushing [m/N].
        lift_compliance: step per force along y while lifting [m/N].
        rotation_compliance: step per torque [rad/(N m)].
    """

    speed: float = 0.0008
    push: float = 12.0
    stop: float = 6.0
    lift: float = 8.0
    lift_speed: float = 0.0015
    lifted: float = 0.0008
    yield_compliance: float = 2.5e-5
    push_compliance: float = 7.5e-5
    lift_compliance: float = 2e-4
    rotation_compliance: float = 1.5e-3

    def __call__(self, observation: np.ndarray) -> np.ndarray:
        """Returns the action (6,) for an observation (12,)."""
        y, f, t = observation[1], observation[6:9], observation[9:12]
        move, turn = self.yield_compliance * f, self.rotation_compliance * t
        lifting = y > self.lifted
        if not lifting:
            move[0] = min(self.speed, self.push_compliance * (self.push + f[0]))
        if lifting or f[0] < -self.stop:
            lift = self.lift_compliance * (self.lift + f[1])
            move[1] = min(self.lift_speed, lift)
        return np.concatenate([move, turn])


#: The scripted policies, by name.
SCRIPTED: dict[str, type[Straight] | type[Admittance]] = {
    "straight": Straight,
    "admittance": Admittance,
}


def make_policy(name: str) -> Straight | Admittance:
    """Returns the scripted policy of a name.

    Raises:
        DisasmError: there is no such policy.
    """
    if name not in SCRIPTED:
        raise DisasmError(
            f"policy '{name}' does not exist; {closest(name, list(SCRIPTED))}"
        )
    return SCRIPTED[name]()
