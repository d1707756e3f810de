"""A search that was stopped goes on, and ends as it would have."""

import pytest

import sysid.effect_selection.fitter as selection
from drake_disasm.effects import CommandGain, SensorBias, registered_effects
from drake_disasm.logs import read_log
from sysid.effect_selection.candidates import candidates
from sysid.effect_selection.close_loop import close_loop
from sysid.effect_selection.output import to_mapping
from sysid.models.twin import TwinModel
from sysid.report import closing_page
from sysid.validation.blind_tests import nominal
from sysid.validation.synthetic_logs import transitions_log

_LIBRARY = [CommandGain, SensorBias]


class _StopError(Exception):
    """What Ctrl-C is here."""


@pytest.mark.slow
def test_what_was_fitted_is_not_fitted_again_and_the_verdict_is_the_same(
    tmp_path, monkeypatch
):
    hidden = [CommandGain(x=0.03), SensorBias(fy=0.3)]
    transitions_log(tmp_path / "log", nominal(), hidden, 0, episodes=4, steps=8)
    fitted = []
    fit = selection.gauss_newton

    def counted(*arguments, **options):
        if len(fitted) == stop_at:
            raise _StopError
        fitted.append(arguments)
        return fit(*arguments, **options)

    def closed(folder):
        model = TwinModel([read_log(tmp_path / "log")], nominal(), ())
        return close_loop(model, test=[3], library=_LIBRARY, folder=folder)

    monkeypatch.setattr(selection, "gauss_newton", counted)
    stop_at = None
    whole = closed(tmp_path / "whole")
    count = len(fitted)
    fitted.clear()
    stop_at = count // 2
    with pytest.raises(_StopError):
        closed(tmp_path / "fits")
    assert len(list((tmp_path / "fits").iterdir())) == stop_at
    fitted.clear()
    stop_at = None
    resumed = closed(tmp_path / "fits")
    assert len(fitted) == count - count // 2
    assert to_mapping(resumed) == to_mapping(whole)


def test_a_budget_of_time_ends_in_a_provisional_verdict_that_goes_on(tmp_path):
    hidden = [CommandGain(x=0.03)]
    transitions_log(tmp_path / "log", nominal(), hidden, 0, episodes=4, steps=8)
    model = TwinModel([read_log(tmp_path / "log")], nominal(), ())
    options = {"test": [3], "library": _LIBRARY, "folder": tmp_path / "fits"}
    first = close_loop(model, time_budget=0.0, **options)
    assert first.is_provisional and first.text.startswith("provisional: ")
    assert to_mapping(first)["provisional"] and not first.verdict.names
    found = close_loop(model, **options)
    assert not found.is_provisional and found.verdict.names == ("CommandGain",)
    assert "missing: CommandGain" in found.text


def test_candidates_that_the_time_was_not_enough_for_are_counted(tmp_path):
    """A verdict may not say that no effect explains what it hasn't tried."""
    transitions_log(tmp_path / "log", nominal(), [SensorBias(fy=2.0)], 0, 4, 8)
    model = TwinModel([read_log(tmp_path / "log")], nominal(), ())
    found = close_loop(model, test=[3], time_budget=0.0)
    count = len(found.end.untested)
    assert 0 < count < len(candidates(model, registered_effects()))
    assert f"the time was over before {count} candidate effects were" in found.text
    assert "no effect tried so far explains" in found.sentence
    assert "No effect tried so far explains the residual" in found.text
    assert to_mapping(found)["end"]["untested"] == list(found.end.untested)
    page = closing_page(found, {})
    assert f"{count} candidate effects were not tested" in page
