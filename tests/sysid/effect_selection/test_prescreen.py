"""Where derivatives at null tell nothing: inside a wall, and behind a stop."""

import dataclasses
import math

import pytest

from drake_disasm.effects import (
    BoltMotion,
    Environment,
    EnvironmentEffect,
    GrooveBend,
    GrooveFriction,
    GroovePose,
    SensorBias,
    SensorGain,
    SensorSaturation,
    amplitude,
    registry,
)
from drake_disasm.logs import read_log
from drake_disasm.scenario import load_scenario
from sysid.effect_selection.close_loop import close_loop
from sysid.effect_selection.settings import DEFAULT_SETTINGS
from sysid.models.twin import TwinModel
from sysid.validation.blind_tests import nominal
from sysid.validation.synthetic_logs import transitions_log
from sysid.workers import Workers

_LIBRARY = [GrooveBend, GroovePose, SensorGain, SensorSaturation]


@pytest.mark.slow
def test_a_groove_turned_by_three_degrees_is_named_and_measured(tmp_path):
    hidden = [GroovePose(ry=-0.0524)]
    transitions_log(tmp_path / "log", nominal(), hidden, 0, episodes=6, steps=20)
    model = TwinModel([read_log(tmp_path / "log")], nominal(), ())
    with Workers(2) as pool:
        closed = close_loop(model, test=[5], library=_LIBRARY, workers=pool)
    assert closed.first.objective > 10.0
    assert closed.verdict.ending == "explained", closed.text
    assert closed.verdict.names == ("GroovePose",)
    found = {value.name: value.value for value in closed.verdict.values}
    assert abs(found["GroovePose.ry"] + 0.0524) < 1e-3
    assert closed.errors.in_noise(closed.errors.after) < 1.1


@dataclasses.dataclass
class ClosedEndMagnet(EnvironmentEffect):
    """A magnet at A, whose pull there the end of the groove takes up.

    Equation: f = -F exp(-x / 8 mm) along the groove.
    Where it acts: a force on the bolt at Bo.
    """

    force: float = amplitude("N", 0.0, 50.0, "F")
    is_local = True
    experiment = "slow pulls"

    def apply(self, environment: Environment, bolt: BoltMotion) -> Environment:
        """Adds the pull of the magnet."""
        x, y, z = environment.force_Gn
        x -= self.force * math.exp(-max(bolt.p[0], 0.0) / 0.008)
        return dataclasses.replace(environment, force_Gn=(x, y, z))


@pytest.mark.slow
def test_an_effect_that_a_stop_hides_at_null_is_found_by_fits(tmp_path, monkeypatch):
    """A little of it moves the bolt at A, and so the sensor's zero; more does not."""
    known = registry._effects | {ClosedEndMagnet.__name__: ClosedEndMagnet}
    monkeypatch.setattr(registry, "_effects", known)
    scenario = load_scenario("removal", ["contact.model=impact"])
    magnet = ClosedEndMagnet(1.5)
    transitions_log(tmp_path / "log", scenario, [magnet], 0, episodes=5, steps=12)
    model = TwinModel([read_log(tmp_path / "log")], scenario, ())
    library = [ClosedEndMagnet, GrooveFriction, SensorBias]
    closed = close_loop(model, library=library)
    assert closed.begin.effects[0].gain < DEFAULT_SETTINGS.refit_min_linear_gain
    assert closed.verdict.names == ("ClosedEndMagnet",)
    assert closed.scenario.effects[0].force == pytest.approx(1.5, rel=0.02)
