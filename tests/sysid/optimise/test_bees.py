import json

import numpy as np
import pytest
from bees_comparison import STANDARD, rosenbrock, sphere

from sysid.optimise import BeesAlgorithm, BeesSettings, Box, Whitened
from sysid.optimise.bees import Stop
from tests.refusals import refused

BOX = Box.of([-2.0] * 3, [3.0] * 3)


@pytest.mark.parametrize("name", ["rosenbrock", "rastrigin", "griewank"])
def test_finds_the_known_minimum(name):
    function, half, size = STANDARD[name]
    box = Box.of([-half] * size, [half] * size)
    settings = BeesSettings(8, 5, 8, 1, 20, stagnation_limit=10, shrink=0.9)
    found = [
        BeesAlgorithm(box, settings, seed).run(function, cycles=300).best_value
        for seed in range(5)
    ]
    assert min(found) < 0.05
    assert np.median(found) < 0.1 or name == "rastrigin"


def test_the_thesis_counts_its_evaluations_and_elite_sites_get_more_foragers():
    settings = BeesSettings(
        scouts=1, sites=3, recruits=2, elite_sites=1, elite_recruits=5
    )
    assert [settings.foragers(rank) for rank in range(3)] == [5, 2, 2]
    assert settings.per_cycle == 10
    bees = BeesAlgorithm(BOX, BeesSettings.thesis())
    assert bees.settings.per_cycle == 6  # nb nr + ns
    trace = bees.run(sphere, cycles=10)
    assert trace.evaluations == 6 + 10 * 6
    assert trace.cycle_ends == list(range(6, 67, 6))


def test_asks_for_one_batch_a_cycle_and_the_seed_says_which():
    sizes = []

    def count(points):
        sizes.append(len(points))
        return sphere(points)

    BeesAlgorithm(BOX, BeesSettings(), 0).run(count, cycles=5)
    assert sizes == [BeesSettings().per_cycle] * 6
    first, second, other = (
        BeesAlgorithm(BOX, seed=seed).run(rosenbrock, cycles=8) for seed in (1, 1, 2)
    )
    assert first.values == second.values
    assert first.values != other.values


def test_stays_within_the_box():
    trace = BeesAlgorithm(BOX, BeesSettings.thesis(), 0).run(
        lambda x: -np.sum(x, axis=1), cycles=200
    )
    points = np.array(trace.points)
    assert (points >= BOX.low).all() and (points <= BOX.high).all()


def test_an_interrupted_search_goes_on_from_its_last_cycle(tmp_path):
    whole = BeesAlgorithm(BOX, seed=7).run(rosenbrock, cycles=9)
    path, calls = tmp_path / "bees.json", []

    def interrupted(points):
        calls.append(1)
        if len(calls) == 5:
            raise KeyboardInterrupt
        return rosenbrock(points)

    with pytest.raises(KeyboardInterrupt):
        BeesAlgorithm(BOX, seed=7).run(interrupted, cycles=9, checkpoint=path)
    assert len(json.loads(path.read_text())["trace"]["values"]) == 4 * 16
    again = BeesAlgorithm(BOX, seed=7).run(rosenbrock, cycles=9, checkpoint=path)
    assert again.values == whole.values
    assert np.array_equal(again.points, whole.points)


def _without(state, *keys):
    inner = state
    for key in keys[:-1]:
        inner = inner[key]
    del inner[keys[-1]]
    return json.dumps(state)


@pytest.mark.parametrize(
    "damage",
    [
        lambda state: json.dumps(state)[:-20],
        lambda state: _without(state, "sites", 0, "centre", 0),
        lambda state: json.dumps(state | {"generator": {"bit_generator": "x"}}),
        lambda state: json.dumps(state | {"sites": 3}),
    ],
)
def test_refuses_a_damaged_checkpoint_in_one_line(damage, tmp_path):
    path = tmp_path / "bees.json"
    BeesAlgorithm(BOX).run(sphere, cycles=1, checkpoint=path)
    path.write_text(damage(json.loads(path.read_text())))
    with refused("bees.json", "is damaged", "delete"):
        BeesAlgorithm(BOX).run(sphere, cycles=2, checkpoint=path)


def test_refuses_the_checkpoint_of_another_search(tmp_path):
    path = tmp_path / "bees.json"
    BeesAlgorithm(BOX).run(sphere, cycles=1, checkpoint=path)
    with refused("bees", "other settings"):
        BeesAlgorithm(BOX, BeesSettings.thesis()).run(sphere, 2, checkpoint=path)


def test_a_stagnant_site_shrinks_and_is_left_and_the_best_never():
    """On a constant nothing improves: sites lose a life a cycle, but the best."""
    settings = BeesSettings(2, 2, 2, 0, 0, stagnation_limit=2, shrink=0.5)
    bees = BeesAlgorithm(BOX, settings, 0)
    seen = []

    def record(b):
        seen.append([(s.lives, s.edge[0] / BOX.width[0]) for s in b.sites])

    bees.run(lambda x: np.ones(len(x)), cycles=3, callback=record)
    # (lives, edge) of best and second; a cycle halves the edge and costs a life.
    assert seen[0] == [(2, 0.5), (2, 0.5)]
    assert seen[1] == [(2, 0.25), (1, 0.25)]
    assert seen[2] == [(2, 0.125), (0, 0.125)]
    assert seen[3] == [(2, 0.0625), (2, 0.5)]  # the second was left, for a new one


def test_improvement_keeps_neighbourhood_and_lives():
    settings = BeesSettings(0, 1, 4, 0, 0, stagnation_limit=9, shrink=0.5)
    bees = BeesAlgorithm(BOX, settings, 0)
    bees.run(sphere, cycles=0)
    before = bees.sites[0]
    bees.run(lambda x: np.full(len(x), before.value - 1.0), cycles=1)
    after = bees.sites[0]
    assert after.value == before.value - 1.0
    assert np.array_equal(after.edge, before.edge)


@pytest.mark.parametrize(
    ("stop", "reason"),
    [
        (Stop(cycles=3), "3 cycles"),
        (Stop(evaluations=50), "budget of 50"),
        (Stop(value=1.0, cycles=500), "value 1 reached"),
        (Stop(stagnation=4, cycles=500), "no progress in 4 cycles"),
    ],
)
def test_stopping_rules(stop, reason):
    constant = stop.stagnation is not None
    function = (lambda x: np.ones(len(x))) if constant else sphere
    trace = BeesAlgorithm(BOX, seed=0).run(function, stop=stop)
    assert reason in trace.stopped
    if stop.evaluations:
        assert trace.evaluations <= stop.evaluations


def test_whitened_coordinates_find_a_narrow_valley_and_the_box_does_not():
    """A valley a thousandth wide along a diagonal, as two parameters that trade off."""
    H = np.array([[1.0, 0.999998], [0.999998, 1.0]]) * 1e8
    best = np.array([0.61, 0.37])

    def valley(x):
        d = x - best
        return np.sqrt(1.0 + np.einsum("bi,ij,bj->b", d, H, d))

    raw = BeesAlgorithm(Box.unit(2), seed=1).run(valley, cycles=20)
    start = best + 2.0 * np.linalg.cholesky(np.linalg.inv(H))[:, 0]
    white = Whitened(start, np.linalg.cholesky(np.linalg.inv(H)), Box.unit(2))
    found = BeesAlgorithm(white.box, seed=1).run(white.wrap(valley), cycles=20)
    assert found.best_value < 1.1
    assert raw.best_value > 2.0 * found.best_value


def test_proposals_take_the_place_of_scouts():
    told = []

    def propose(trace, box, count, generator):
        told.append((trace.evaluations, count))
        return np.zeros((count, box.size))

    bees = BeesAlgorithm(BOX, BeesSettings(), 0, propose)
    trace = bees.run(sphere, cycles=2)
    assert told == [(16, 4), (32, 4)]
    assert trace.best_value == 0.0 and trace.evaluations == 48


@pytest.mark.parametrize(
    ("bad", "word"),
    [
        ({"sites": 0}, "sites"),
        ({"elite_sites": 4}, "elite_sites"),
        ({"shrink": 1.0}, "shrink"),
        ({"scouts": -1}, "negative"),
        ({"elite_recruits": 0}, "elite_recruits"),
    ],
)
def test_refuses_a_colony_that_cannot_work(bad, word):
    with refused(word):
        BeesSettings(**bad)


def test_refuses_bounds_that_are_no_box():
    bounds = [([1.0], [0.0]), ([0.0], [np.inf]), ([], [])]
    for (low, high), word in zip(bounds, ("swap", "finite", "one"), strict=True):
        with refused(word):
            Box.of(low, high)


def test_points_that_are_known_to_be_good_are_among_the_first():
    start = np.array([[0.1, 0.2, 0.3], [9.0, 0.0, 0.0]])
    trace = BeesAlgorithm(BOX, BeesSettings(), 0, start=start).run(sphere, cycles=0)
    assert trace.evaluations == BeesSettings().initial
    np.testing.assert_array_equal(trace.points[:2], [[0.1, 0.2, 0.3], [3.0, 0.0, 0.0]])
