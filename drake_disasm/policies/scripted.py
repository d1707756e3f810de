"""Two scripted policies: the naive one, and the classical baseline."""

import dataclasses
from typing import Self

import array_api_compat
import numpy as np

from drake_disasm.cell.grip import bolt_compliance
from drake_disasm.cell.twin_parameters import bolt_stiffness
from drake_disasm.common.arrays import Array, at_most, namespace
from drake_disasm.common.errors import DisasmError
from drake_disasm.common.quantity import closest
from drake_disasm.scenario import Scenario

#: Shares of a force or torque that a step of `Admittance` takes back, or adds.
_YIELD, _PUSH, _LIFT, _TURN = 0.4, 1.2, 3.2, 0.6
_FASTEST, _FASTEST_LIFT = 0.001, 0.0015  # m per step
_STEP_FORCE, _LIFT_STEP_FORCE = 12.8, 24.0  # N that a step against a stop adds
_HELD = 0.5  # share of `lift` that holds the bolt down: it is under the lips
_STOP, _STOP_SHARE = 3.0, 0.25  # N that tell a stop, and share of what a step adds


@dataclasses.dataclass(frozen=True)
class Straight:
    """Always moves along +x, whatever the wrench.

    Attributes:
        speed: per step [m].
    """

    speed: float = 0.001

    def __call__(self, observation: Array) -> Array:
        """Returns the actions (..., 6) for any observations (..., 12)."""
        xp, device = namespace(observation), array_api_compat.device(observation)
        shape = (*observation.shape[:-1], 6)
        action = xp.zeros(shape, dtype=xp.float64, device=device)
        action[..., 0] = self.speed
        return action


@dataclasses.dataclass(frozen=True)
class Admittance:
    """Pushes along +x, yields to the measured wrench, and lifts once it is stopped.

    A Cartesian admittance per step (Hogan 1985): a = C (w_push + w), where w is
    the measured wrench on the bolt and C its compliance per step. Along x it pushes
    with a bounded force, so it slows down as resistance grows and stops at a stop;
    then, and while the bolt is being lifted, it pushes upwards instead, and along x
    again where something holds the bolt down. It knows neither the groove's direction
    nor where it ends. Its gains are for an arm and grip
    of about 16 kN/m; `for_stiffness` gives those for another.

    Attributes:
        speed: greatest step along x [m].
        push: resistance at which the motion along x stops [N].
        stop: resistance along x that counts as the end of the groove [N].
        lift: resistance at which the motion along y stops [N].
        lift_speed: greatest step along y [m].
        lifted: rise of the bolt from which on it keeps lifting [m].
        yield_compliance: step per force across the motion [m/N]. Times the stiffness
            it must stay below 1, or the yielding overshoots.
        push_compliance: step per force along x while pushing [m/N].
        lift_compliance: step per force along y while lifting [m/N].
        rotation_compliance: step per torque [rad/(N m)].
        grip_compliance: how far the bolt yields in the grip per force along y [m/N].
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
    grip_compliance: float = 0.0

    @classmethod
    def for_stiffness(cls, stiffness: np.ndarray, grip_compliance: float) -> Self:
        """Returns the policy for a bolt that is held with some stiffness.

        The stiffest axis decides, so that a step's answer to a force or torque takes
        back the same share of it whatever holds the bolt. The softer it is, the less
        force a step adds, the smaller the force that tells a stop from friction, and
        the less the bolt leaps when it comes free.

        Args:
            stiffness: (6,) at the bolt, along and about x, y, z [N/m, N m/rad].
            grip_compliance: see above.
        """
        k, turning = float(stiffness[:3].max()), float(stiffness[3:].max())
        speed = min(_FASTEST, _STEP_FORCE / k)
        return cls(
            speed=speed,
            stop=_STOP + _STOP_SHARE * speed * k,
            lift_speed=min(_FASTEST_LIFT, _LIFT_STEP_FORCE / k),
            yield_compliance=_YIELD / k,
            push_compliance=_PUSH / k,
            lift_compliance=_LIFT / k,
            rotation_compliance=_TURN / turning,
            grip_compliance=grip_compliance,
        )

    def __call__(self, observation: Array) -> Array:
        """Returns the actions (..., 6) for observations (..., 12)."""
        y, f, t = observation[..., 1], observation[..., 6:9], observation[..., 9:12]
        xp = namespace(observation)
        move, turn = self.yield_compliance * f, self.rotation_compliance * t
        fx, fy = f[..., 0], f[..., 1]
        is_lifting = y + self.grip_compliance * fy > self.lifted
        pushes = ~is_lifting | (fy < -_HELD * self.lift)
        push = at_most(self.speed, self.push_compliance * (self.push + fx))
        lift = at_most(self.lift_speed, self.lift_compliance * (self.lift + fy))
        move[..., 0] = xp.where(pushes, push, move[..., 0])
        move[..., 1] = xp.where(is_lifting | (fx < -self.stop), lift, move[..., 1])
        return xp.concat([move, turn], axis=-1)


#: The scripted policies, by name.
SCRIPTED: dict[str, type[Straight] | type[Admittance]] = {
    "straight": Straight,
    "admittance": Admittance,
}


def make_policy(name: str, scenario: Scenario | None = None) -> Straight | Admittance:
    """Returns the scripted policy of a name.

    Args:
        name: one of SCRIPTED.
        scenario: whose arm, control and gripper its gains are for; None: for an arm
            and a grip of about 16 kN/m.

    Raises:
        DisasmError: there is no such policy, or the arm can't reach the lock.
    """
    if name not in SCRIPTED:
        raise DisasmError(
            f"policy '{name}' does not exist; {closest(name, list(SCRIPTED))}"
        )
    if scenario is None or name != "admittance":
        return SCRIPTED[name]()
    grip = bolt_compliance(scenario)[1, 1]
    return Admittance.for_stiffness(bolt_stiffness(scenario), float(grip))
