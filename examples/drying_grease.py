"""An effect that depends on time: grease that dries while the robot works.

python examples/drying_grease.py
"""

import dataclasses
import tempfile
from pathlib import Path

from drake_disasm.common.arrays import namespace
from drake_disasm.effects import (
    BoltMotion,
    Environment,
    EnvironmentEffect,
    GrooveFriction,
    amplitude,
    register_effect,
    shape_parameter,
)
from drake_disasm.logs import read_log
from drake_disasm.scenario import load_scenario
from sysid.effect_selection import close_loop
from sysid.models.twin import TwinModel
from sysid.validation.synthetic_logs import transitions_log


@register_effect
@dataclasses.dataclass
class DryingGrease(EnvironmentEffect):
    """Grease in the groove that dries during an episode.

    Equation: mu = mu_0 + c (1 - exp(-t / T)), t the time since the episode began.
    Where it acts: the contact of bolt and groove.
    """

    coefficient: float = amplitude("1", 0.0, 1.0, "c, friction that drying adds")
    time: float = shape_parameter(3.0, "s", 0.3, 30.0, "T, of drying", (1.0, 3.0, 9.0))
    is_local = True  # it changes from step to step
    noun = "drying grease"
    experiment = "the same stroke several times in one episode"

    def apply(self, environment: Environment, bolt: BoltMotion) -> Environment:
        """Adds what the grease has dried by now."""
        xp = namespace(bolt.p)
        dried = 1.0 - xp.exp(-(0.0 * bolt.p[..., 0] + bolt.time) / self.time)
        friction = environment.friction + self.coefficient * dried
        return dataclasses.replace(environment, friction=friction)


if __name__ == "__main__":
    scenario = load_scenario("removal_turned", ["contact.model=impact"])
    grease = DryingGrease(coefficient=0.3, time=2.0)
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "log"  # states the scenario, and was made with the grease
        transitions_log(log, scenario, [grease], seed=0, episodes=6, steps=40)
        model = TwinModel([read_log(log)], scenario, ())
    print(close_loop(model, library=[GrooveFriction, DryingGrease]).text)
