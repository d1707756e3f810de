"""Models whose parameters are numbers of a scenario."""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Self

from drake_disasm.effects import Effect
from drake_disasm.scenario import Scenario, with_values
from sysid.models.base import Array, LogModel
from sysid.models.effects import within_reach
from sysid.parameters import Parameter, by_name, by_path


class ScenarioModel(LogModel):
    """A model whose parameters are numbers of a scenario, and its effects, too.

    Attributes:
        scenario: at the parameters' nominal values.
    """

    scenario: Scenario

    @property
    def effects(self) -> tuple[Effect, ...]:
        """The scenario's effects."""
        return tuple(self.scenario.effects)

    def effects_at(self, theta: Array) -> tuple[Effect, ...]:
        """See LogModel."""
        return tuple(self.scenario_at(theta).effects)

    def with_effects(
        self, effects: Sequence[Effect], parameters: Sequence[Parameter] = ()
    ) -> Self:
        """See LogModel."""
        added = within_reach(parameters, effects, self.travel, self._reach_ahead)
        return self.replace(
            scenario=dataclasses.replace(self.scenario, effects=list(effects)),
            parameters=(*self.parameters, *added),
        )

    def freeze(self, values: Mapping[str, float]) -> Self:
        """See LogModel; a frozen value becomes the scenario's."""
        return self.replace(
            scenario=with_values(self.scenario, by_path(self.parameters, values)),
            parameters=tuple(p for p in self.parameters if p.name not in values),
        )

    def scenario_at(self, theta: Array) -> Scenario:
        """Returns the scenario with the parameters' values (p,) in it."""
        values = by_name(self.parameters, theta)
        return with_values(self.scenario, by_path(self.parameters, values))
