"""The twin with IMPACT, many steps of the task of many twins at once.

Without the hydroelastic query a step of this twin is a small system of equations; for
all measured steps together, and for all parameter sets of which a search asks at once,
one evaluation of the objective takes a fraction of the diagram's time
(docs/results/identification.md has the figures).
"""

from collections.abc import Sequence

import numpy as np

from drake_disasm.common.rotations import rotation_vectors
from drake_disasm.devices.sensor_chain import sensed, sensed_at_zeroing
from drake_disasm.scenario import Scenario, validate
from drake_disasm.twin.episodes import TwinBatch
from drake_disasm.twin.plant import PlantState, PlantStep
from drake_disasm.twin.stacking import rows_of
from drake_disasm.twin.steps import Ends, Steps, bolt_motion, noise_free
from drake_disasm.twin.twins import Twins


class ImpactReplay:
    """Computes `TwinReplay.transitions` of scenarios with IMPACT contact, faster.

    The diagram is the reference; the equations are those of the batched twin. What one
    scenario gives does not depend on the others.

    Attributes:
        reading_at_zeroing: (k, 6) what each sensor read when it was zeroed, [f; tau]
            in S; NaN where contact finds no balance at A.

    Args:
        scenarios: what the k twins are, `contact.model` being impact.

    Raises:
        DisasmError: a scenario is out of bounds.
    """

    def __init__(self, scenarios: Sequence[Scenario]) -> None:
        for scenario in scenarios:
            validate(scenario)
        silent = [noise_free(scenario) for scenario in scenarios]
        self._batch = TwinBatch(silent, np.zeros(0))
        self._at_rest = self._batch.at_rest(range(len(silent)), silent)
        self._zero()

    def transitions(self, steps: Sequence[Steps]) -> list[np.ndarray]:
        """Returns the states (n, 12) after independent steps, each from its own start.

        NaN where contact finds no balance.

        Args:
            steps: n of each of the k twins; n may differ from one to the next.
        """
        return [ends.states for ends in self.ends(steps)]

    def ends(self, steps: Sequence[Steps]) -> list[Ends]:
        """Returns where independent steps lead, each from its own start.

        NaN where contact finds no balance.

        Args:
            steps: of each of the k twins; see `transitions`.
        """
        counts = [len(each) for each in steps]
        which = np.repeat(np.arange(len(steps)), counts)
        # Steps without a balance may overflow, they end as NaN; others don't care.
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            ends = self._after(which, Steps.concatenated(steps))
        parts = (np.split(part, np.cumsum(counts)[:-1]) for part in ends)
        return [Ends(*each) for each in zip(*parts, strict=True)]

    def _zero(self) -> None:
        """Lets the bolts settle at A and zeroes the sensors."""
        twins = self._batch.twins(self._at_rest)
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            step = twins.plant_at_A.settled(self._at_rest.state)
            reading = sensed_at_zeroing(
                twins.load_S(step.state.arm, step),
                twins.effects.sensor,
                twins.sensing(step.state.arm, self._at_rest.steps),
            )
        self.reading_at_zeroing = np.where(step.is_solved[:, None], reading, np.nan)
        self._offset = twins.processing.offset(self.reading_at_zeroing)

    def _after(self, which: np.ndarray, steps: Steps) -> Ends:
        """Returns where steps of some of the twins (n,) lead."""
        twins = self._batch.twins(rows_of(self._at_rest, which))
        numbers, period = twins.numbers, self._batch.period
        q_bolt = steps.q + numbers.deflection(steps.wrench)
        begin, end = (period * (steps.index + i) for i in (0, 1))
        motion = bolt_motion(
            numbers.coordinates, numbers.body.p_BoTo_B, q_bolt, steps.qd_rate, begin
        )
        arm, v_bolt = np.hstack([steps.q, steps.v]), steps.v + steps.give_rate
        state = PlantState(arm, q_bolt, v_bolt, steps.qd)
        count = round(period / self._batch.h)
        step = twins.plant(motion).advance(state, steps.qd_rate, count)
        states = _observed(twins, step, end, self._offset[which])
        give = step.state.q - step.state.arm[:, :6]
        is_solved = step.is_solved[:, None]
        return Ends(*(np.where(is_solved, part, np.nan) for part in (states, give)))


def _observed(
    twins: Twins, step: PlantStep, time: np.ndarray, offset: np.ndarray
) -> np.ndarray:
    """Returns the states (n, 12) that are seen, their rotations as vectors.

    Args:
        twins: n of them.
        step: of their plants.
        time: (n,) since their episodes began [s].
        offset: (n, 6) of their sensors.
    """
    arm = step.state.arm
    X_GB = twins.numbers.coordinates.poses(arm[:, :6])
    load, sensing = twins.load_S(arm, step), twins.sensing(arm, time)
    reading = sensed(load, twins.effects.sensor, sensing)
    wrench = twins.processing.wrench(X_GB, reading, offset)
    return np.hstack([X_GB.p, rotation_vectors(X_GB.R), wrench])
