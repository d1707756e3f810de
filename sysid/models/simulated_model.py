"""Models that simulate commanded steps, each from where it was measured to begin."""

import abc
from collections.abc import Sequence
from typing import Self

from drake_disasm.common.errors import DisasmError
from sysid.models.base import Array, LogModel, PredictionError
from sysid.models.scenario_model import ScenarioModel

#: Of a simulation.
FAILURES = (RuntimeError, DisasmError, ValueError)


class SimulatedModel(ScenarioModel):
    """A model whose rows are commanded steps of an arm that a scenario's twin takes.

    The arm may scatter about its commands, so that steps are displaced from them; and
    how a step begins is not all measured.
    """

    @abc.abstractmethod
    def with_displacement(self, displacement: Array, push: Array) -> Self:
        """Returns the same model with each step displaced from its command.

        Args:
            displacement: (rows, 3) of the step's end, where the next one begins, in G
                [m].
            push: (rows, 3) of the end further, of which the next knows nothing [m].
        """

    @abc.abstractmethod
    def begin_error(self, theta: Array) -> Array | None:
        """Returns by how much predictions are off for what no reading shows.

        (rows, channels) standard deviations in units of the stated error, beyond which
        they come, at parameters (p,); None if that is nothing, or unknown.
        """

    @abc.abstractmethod
    def _simulated(self, thetas: Array, rows: slice) -> Sequence[Array | str]:
        """Returns what `simulate` gives of parameter sets (k, p), or why it can't."""

    def predict(self, theta: Array, rows: slice) -> Array:
        """See LogModel."""
        return self.read(theta, rows, self.simulate(theta, rows))

    def simulate(self, theta: Array, rows: slice) -> Array:
        """See LogModel."""
        [found] = self.simulate_all(theta[None], rows)
        if isinstance(found, str):
            raise PredictionError(found)
        return found

    def simulate_all(self, thetas: Array, rows: slice) -> list[Array | str]:
        """See LogModel."""
        try:
            return list(self._simulated(thetas, rows))
        except FAILURES as error:
            if len(thetas) > 1:  # it is not said of which
                return super().simulate_all(thetas, rows)
            return [" ".join(str(error).split())]


def simulation_of(model: LogModel) -> SimulatedModel | None:
    """Returns a model, if it simulates commanded steps."""
    return model if isinstance(model, SimulatedModel) else None
