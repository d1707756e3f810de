"""The whole way from a model to its parameters, on a model with known ones."""

import numpy as np
import pytest

from sysid.identification import Journal, SearchSettings, Settings, identify
from sysid.identification.assessment import noise_floor
from sysid.identification.output import summary, to_mapping
from sysid.identification.sensitivity import sensitivity
from sysid.objective import Objective, pseudo_residual, rms
from sysid.optimise import BeesSettings
from sysid.report import report_page
from sysid.workers import Workers
from tests.refusals import refused
from tests.sysid.report.pages import own_part
from tests.sysid.toys import Decay

SEARCH = SearchSettings(evaluations=120, local_evaluations=40)
TRUTH = {"a": 2.0, "b": 1.5, "c": 0.3}


def run(model, folder, settings=None, test=(3,), resume=False, progress=None):
    journal = Journal(folder, {"seed": 0}, resume)
    settings = settings or Settings(search=SEARCH)
    return identify(
        model, test=test, settings=settings, journal=journal, progress=progress
    )


def test_finds_the_truth_and_both_methods_agree(tmp_path):
    found = run(Decay(), tmp_path / "fit")
    for i, p in enumerate(found.parameters):
        low, high = found.interval_bootstrap[i]
        assert low < found.theta[i] < high
        assert abs(found.theta[i] - TRUTH[p.name]) < 2 * (high - low)
    assert found.agreement.agree, found.agreement.text
    assert found.fitted.value_after == pytest.approx(1.0, abs=0.1)
    assert found.held_out.value_after == pytest.approx(1.0, abs=0.15)
    assert found.held_out.value_before > 3.0
    assert (found.whiteness > 1e-3).all()
    assert not found.notes


@pytest.mark.slow
def test_intervals_cover_the_truth_as_often_as_they_say(tmp_path):
    settings = Settings(
        ("nlopt",), SearchSettings(evaluations=60, local_evaluations=10)
    )
    inside = {"gn": [], "bootstrap": []}
    for seed in range(60):
        found = run(Decay(seed=seed, rows=40), tmp_path / str(seed), settings)
        truth = np.array([TRUTH[p.name] for p in found.parameters])
        for name, interval in (
            ("gn", found.interval_gauss_newton), ("bootstrap", found.interval_bootstrap)
        ):  # fmt: skip
            inside[name] += list((interval[:, 0] < truth) & (truth < interval[:, 1]))
    for name, hits in inside.items():
        assert 0.88 < np.mean(hits) < 0.99, (name, np.mean(hits))


def test_a_parameter_without_effect_stops_the_fit_or_is_frozen_by_choice(tmp_path):
    with refused("idle", "no effect", "`unidentifiable` freeze"):
        run(Decay(("a", "idle")), tmp_path / "stopped")
    settings = Settings(search=SEARCH, unidentifiable="freeze")
    found = run(Decay(("a", "idle", "c")), tmp_path / "fit", settings)
    assert [p.name for p in found.parameters] == ["a", "c"]
    assert found.frozen == {"idle": 0.5}
    assert any("idle was frozen" in note for note in found.notes)
    with refused("nothing is left"):
        run(Decay(("idle",)), tmp_path / "nothing", settings)


def test_a_combination_that_the_log_cannot_fix_is_named(tmp_path):
    model = Decay(("a", "twin_of_a", "b"))
    with refused("0.71 a", "0.71 twin_of_a"):
        run(model, tmp_path / "fit")
    objective = Objective(model, Workers())
    found = sensitivity(objective, np.full(3, 0.3))
    assert len(found.loose) == 1 and len(found.to_freeze()) == 1
    np.testing.assert_allclose(
        np.abs(found.loose[0].weights), [0.707, 0.707, 0], atol=0.01
    )


def test_fewer_transitions_than_parameters(tmp_path):
    with refused("2 transitions", "3 parameters"):
        run(Decay(rows=2), tmp_path / "fit", test=(1, 2, 3))


def test_a_parameter_on_its_bound_is_noted(tmp_path):
    found = run(Decay(noise=0.1), tmp_path / "x", test=())
    model = Decay(("a",)).replace(others={"a": 2.0, "b": 0.05, "c": 1.0})
    bound = run(model, tmp_path / "fit")
    assert any("ended on a bound" in note for note in bound.notes)
    assert any("no episode was held out" in note for note in found.notes)


def test_an_interrupted_identification_goes_on_to_the_same_bits(tmp_path):
    whole = run(Decay(), tmp_path / "whole")

    def interrupt(update):
        if update.stage == "nlopt, global" and update.done >= 30:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run(Decay(), tmp_path / "fit", progress=interrupt)
    with refused("`resume`"):
        run(Decay(), tmp_path / "fit")
    again = run(Decay(), tmp_path / "fit", resume=True)
    assert again.theta.tobytes() == whole.theta.tobytes()
    assert again.interval_bootstrap.tobytes() == whole.interval_bootstrap.tobytes()
    for name, method in whole.methods.items():
        for stage, other in zip(method.stages, again.methods[name].stages, strict=True):
            assert stage.trace.values == other.trace.values
    assert again.evaluations < whole.evaluations


def test_a_profile_has_its_minimum_at_the_estimate(tmp_path):
    settings = Settings(search=SEARCH, profiles=("b",))
    (curve,) = run(Decay(), tmp_path / "fit", settings).profiles
    assert curve.name == "b"
    lowest = int(np.argmin(curve.values))
    assert 0 < lowest < len(curve.values) - 1
    assert curve.values[0] > curve.edge < curve.values[-1]
    with refused("`profile` z"):
        run(Decay(), tmp_path / "2", Settings(profiles=("z",)))


def test_the_floor_is_that_of_gaussian_noise():
    assert noise_floor(np.inf) == pytest.approx(1.0, abs=1e-6)
    z = np.random.default_rng(0).normal(size=200_000)
    assert noise_floor(1.0) == pytest.approx(rms(pseudo_residual(z, 1.0)), rel=0.01)


def test_the_report_needs_nothing_else_and_says_it_all(tmp_path):
    settings = Settings(search=SEARCH, profiles=("c",))
    found = run(Decay(), tmp_path / "fit", settings)
    page = own_part(report_page(found, {"command": "test", "data": "abc"}))
    assert page.count("data:image/png;base64,") == 4
    assert page.count('class="plotly-graph-div"') == 2
    assert "Agreement" in page and "abc" in page
    mapping = to_mapping(found)
    assert set(mapping["parameters"]) == {"a", "b", "c"}
    assert "bees and nlopt agree" in summary(found)


def test_the_thesis_search_counts_as_the_thesis_does(tmp_path):
    colony = BeesSettings.thesis()
    search = SearchSettings(cycles=10, local_evaluations=0, bees=colony)
    settings = Settings(search=search, huber_delta=np.inf)
    found = run(Decay(), tmp_path / "fit", settings)
    (stage,) = found.methods["bees"].stages
    assert stage.trace.cycle_ends[:11] == list(range(6, 67, 6))  # then SBPLX
    budgets = {m.stages[0].trace.evaluations for m in found.methods.values()}
    assert max(budgets) - min(budgets) <= 6
