"""An effect of one's own: hidden in a log, then found and named by closing the loop.

python examples/own_effect.py
"""

import dataclasses
import tempfile
from pathlib import Path

from drake_disasm.common.arrays import as_number, at_most, exponential
from drake_disasm.effects import (
    BoltMotion,
    Environment,
    EnvironmentEffect,
    amplitude,
    register_effect,
    shape_parameter,
)
from drake_disasm.logs import read_log
from drake_disasm.scenario import load_scenario
from sysid.effect_selection import close_loop
from sysid.models.twin import TwinModel
from sysid.validation.synthetic_logs import transitions_log

TRAVEL = 0.06  # m, L, from A to the opening


@register_effect
@dataclasses.dataclass
class MagneticCatch(EnvironmentEffect):
    """A magnet that pulls the bolt towards the opening of the groove.

    Equation: f = F exp((x - L) / d) along the groove, x the travel from A.
    Where it acts: a force on the bolt at Bo.
    """

    force: float = amplitude("N", 0.0, 50.0, "F, of the magnet at the opening")
    reach: float = shape_parameter(0.01, "m", 0.002, 0.05, "d", (0.005, 0.01, 0.02))
    is_local = True
    noun = "a magnetic catch"
    experiment = "slow pulls to the opening and back, without contact at the walls"

    def apply(self, environment: Environment, bolt: BoltMotion) -> Environment:
        """Adds the pull of the magnet."""
        x, y, z = environment.force_Gn
        away = at_most(0.0, as_number(bolt.p[..., 0] - TRAVEL))
        pull = self.force * exponential(away / self.reach)
        return dataclasses.replace(environment, force_Gn=(x + pull, y, z))


if __name__ == "__main__":
    scenario = load_scenario("removal", ["contact.model=impact"])
    magnet = MagneticCatch(force=4.0, reach=0.015)
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "log"  # states the scenario, and was made with a magnet
        transitions_log(log, scenario, [magnet], seed=0, episodes=5, steps=12)
        model = TwinModel([read_log(log)], scenario, ())
    closed = close_loop(model)  # asks all registered effects: the library's, and this
    print(closed.text)
    print(closed.scenario.effects)
