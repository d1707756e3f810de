"""A policy that performs one experiment after the other, on any station."""

import numpy as np

from drake_disasm.experiments.base import Plan


class Performer:
    """Maps observations to the actions of the experiment that it is given.

    Attributes:
        plan: of the next episode, which `reset` begins; None stays where it is.
        is_done: whether all its phases are over.
    """

    def __init__(self, plan: Plan | None = None) -> None:
        self.plan = plan
        self.reset()

    def reset(self) -> None:
        """Begins the plan."""
        self._phase, self._step = 0, 0
        self.is_done = self.plan is None

    def __call__(self, observation: np.ndarray) -> np.ndarray:
        """Returns the action (6,) for an observation (12,)."""
        phases = self.plan.phases if self.plan else ()
        while self._phase < len(phases):
            action = phases[self._phase].act(observation, self._step)
            if action is not None:
                self._step += 1
                return action
            self._phase, self._step = self._phase + 1, 0
        self.is_done = True
        return np.zeros(6)
