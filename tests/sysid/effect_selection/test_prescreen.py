"""Far from the data: the bolt is inside the wall of the model's groove."""

from drake_disasm.effects import GrooveBend, GroovePose, SensorGain, SensorSaturation
from drake_disasm.logs import read_log
from sysid.effect_selection.close_loop import close_loop
from sysid.models.twin import TwinModel
from sysid.validation.blind_tests import nominal
from sysid.validation.synthetic_logs import transitions_log
from sysid.workers import Workers

_LIBRARY = [GrooveBend, GroovePose, SensorGain, SensorSaturation]


def test_a_groove_turned_by_three_degrees_is_named_and_measured(tmp_path):
    hidden = [GroovePose(ry=-0.0524)]
    transitions_log(tmp_path / "log", nominal(), hidden, 0, episodes=6, steps=20)
    model = TwinModel([read_log(tmp_path / "log")], nominal(), ())
    with Workers(2) as pool:
        closed = close_loop(model, test=[5], library=_LIBRARY, workers=pool)
    assert closed.first.objective > 10.0
    assert closed.verdict.ending == "explained"
    assert closed.verdict.names == ("GroovePose",)
    found = {value.name: value.value for value in closed.verdict.values}
    assert abs(found["GroovePose.ry"] + 0.0524) < 1e-3
    assert closed.errors.in_noise(closed.errors.after) < 1.1
