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
from drake_disasm.parts import AXES, Part
from drake_disasm.scenario import Scenario

#: Shares of a force or torque that a step of `Admittance` takes back, or adds.
_YIELD, _PUSH, _LIFT, _TURN = 0.4, 1.2, 3.2, 0.6
_FASTEST, _FASTEST_LIFT, _FASTEST_TURN = 0.001, 0.0015, 0.008  # m, m, rad per step
_STEP_FORCE, _LIFT_STEP_FORCE = 12.8, 24.0  # N that a step against a stop adds
_STEP_EFFORT, _STOP_EFFORT = 0.3, 0.75  # of a turn: share that a step adds; of a stop
_HELD = 0.5  # share of `lift` that holds the bolt down: it is under the lips
_STOP, _STOP_SHARE = 3.0, 0.25  # N that tell a stop, and share of what a step adds


@dataclasses.dataclass(frozen=True)
class Straight:
    """Always moves along the first stage of the way out, whatever the wrench.

    Attributes:
        way: the bolt's coordinate (`AXES`) along or about which it moves.
        speed: per step [m, rad].
    """

    way: str = "x"
    speed: float = 0.001

    def __call__(self, observation: Array) -> Array:
        """Returns the actions (..., 6) for any observations (..., 12)."""
        xp, device = namespace(observation), array_api_compat.device(observation)
        shape = (*observation.shape[:-1], 6)
        action = xp.zeros(shape, dtype=xp.float64, device=device)
        action[..., AXES.index(self.way)] = self.speed
        return action


@dataclasses.dataclass(frozen=True)
class Admittance:
    """Pushes along the way out, yields to the wrench, goes on where it is stopped.

    A Cartesian admittance per step (Hogan 1985): a = C (w_push + w), where w is
    the measured wrench on the bolt and C its compliance per step. Along the first stage
    (x of a door chain) it pushes with a bounded force, so it slows down as resistance
    grows and stops at a stop; then, and while the bolt is being lifted, it pushes along
    the second (y) instead, and along the first again where something holds the bolt
    down. It knows neither the groove's direction nor where it ends. Its gains are for
    an arm and grip of about 16 kN/m; `for_stiffness` gives those for another.

    Attributes:
        way: the bolt's coordinates (`AXES`) along and about which it leaves, one or
            two; a turn's numbers are in rad and N m.
        speed: greatest step along the first stage [m].
        push: resistance at which the motion along it stops [N].
        stop: resistance along it that counts as its end [N].
        lift: resistance at which the motion along the second stage stops [N].
        lift_speed: greatest step along it [m].
        lifted: rise of the bolt from which on it keeps lifting [m].
        yield_compliance: step per force across the motion [m/N]. Times the stiffness
            it must stay below 1, or the yielding overshoots.
        push_compliance: step per force along the first stage while pushing [m/N].
        lift_compliance: step per force along the second while lifting [m/N].
        rotation_compliance: step per torque [rad/(N m)].
        grip_compliance: how far the bolt yields in the grip per force along the second
            stage [m/N].
    """

    way: str = "xy"
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
    def for_stiffness(
        cls,
        stiffness: np.ndarray,
        grip_compliance: np.ndarray,
        part: Part,
    ) -> Self:
        """Returns the policy for a bolt that is held with some stiffness.

        The stiffest axis decides, so that a step's answer to a force or torque takes
        back the same share of it whatever holds the bolt. The softer it is, the less
        force a step adds, the smaller the force that tells a stop from friction, and
        the less the bolt leaps when it comes free.

        Args:
            stiffness: (6,) at the bolt, along and about x, y, z [N/m, N m/rad].
            grip_compliance: (6,) of the bolt in the grip along and about the same axes
                by forces and torques along and about them [m/N, rad/(N m)].
            part: that the bolt leaves.
        """
        k, turning = float(stiffness[:3].max()), float(stiffness[3:].max())
        first, last = part.stages[0], part.stages[-1]
        speed = min(_FASTEST, _STEP_FORCE / k)
        push_compliance, stop = _PUSH / k, _STOP + _STOP_SHARE * speed * k
        if first.is_turn:
            speed = min(_FASTEST_TURN, _STEP_EFFORT * first.effort / turning)
            push_compliance, stop = _PUSH / turning, _STOP_EFFORT * first.effort
        return cls(
            way=part.way,
            speed=speed,
            push=first.effort,
            stop=stop,
            lift=last.effort,
            lift_speed=min(_FASTEST_LIFT, _LIFT_STEP_FORCE / k),
            yield_compliance=_YIELD / k,
            push_compliance=push_compliance,
            lift_compliance=_LIFT / k,
            rotation_compliance=_TURN / turning,
            grip_compliance=float(grip_compliance[last.axis]),
        )

    def __call__(self, observation: Array) -> Array:
        """Returns the actions (..., 6) for observations (..., 12)."""
        xp, wrench = namespace(observation), observation[..., 6:12]
        move = self.yield_compliance * wrench[..., :3]
        turn = self.rotation_compliance * wrench[..., 3:]
        action = xp.concat([move, turn], axis=-1)
        first, last = AXES.index(self.way[0]), AXES.index(self.way[-1])
        against, held = wrench[..., first], wrench[..., last]
        push = at_most(self.speed, self.push_compliance * (self.push + against))
        if len(self.way) == 1:
            action[..., first] = push
            return action
        rise = observation[..., last] + self.grip_compliance * held
        is_lifting = rise > self.lifted
        pushes = ~is_lifting | (held < -_HELD * self.lift)
        lift = at_most(self.lift_speed, self.lift_compliance * (self.lift + held))
        lifts = is_lifting | (against < -self.stop)
        action[..., first] = xp.where(pushes, push, action[..., first])
        action[..., last] = xp.where(lifts, lift, action[..., last])
        return action


#: The scripted policies, by name.
SCRIPTED: dict[str, type[Straight] | type[Admittance]] = {
    "straight": Straight,
    "admittance": Admittance,
}


def name_of(policy: Straight | Admittance) -> str:
    """Returns the name of a scripted policy.

    Raises:
        DisasmError: it is none.
    """
    for name, kind in SCRIPTED.items():
        if type(policy) is kind:
            return name
    raise DisasmError(
        f"has the base {type(policy).__name__}; a file can name {', '.join(SCRIPTED)}"
    )


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
    if scenario is None:
        return SCRIPTED[name]()
    part = scenario.part
    if name == "straight":
        speed = _FASTEST_TURN if part.stages[0].is_turn else _FASTEST
        return Straight(part.way[0], speed)
    grip = np.diag(bolt_compliance(scenario))
    return Admittance.for_stiffness(bolt_stiffness(scenario), grip, part)
