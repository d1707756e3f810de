import numpy as np

from sysid.optimise import BeesAlgorithm, BeesSettings, Box, Trace
from sysid.optimise.bees import Stop
from sysid.optimise.surrogate import propose

BOX = Box.of([-2.0] * 2, [3.0] * 2)


def bowl(x):
    return np.sum((x - 0.7) ** 2, axis=1)


SETTINGS = BeesSettings(scouts=3, sites=2, recruits=2, elite_sites=0, elite_recruits=0)


def test_proposes_near_the_minimum_of_a_bowl():
    generator = np.random.default_rng(0)
    trace = Trace()
    points = BOX.sample(40, generator)
    trace.add(points, 1.0 + np.sum((points - 0.7) ** 2, axis=1))
    proposed = propose(trace, BOX, 3, generator)
    assert proposed.shape == (3, 2)
    assert np.abs(proposed - 0.7).max(axis=1).min() < 0.3
    assert len(np.unique(proposed, axis=0)) == 3
    assert (proposed >= BOX.low).all() and (proposed <= BOX.high).all()


def test_helps_the_bees_at_equal_evaluations():
    box, stop = Box.of([-2.0] * 4, [3.0] * 4), Stop(evaluations=70)

    def best(seed, surrogate):
        bees = BeesAlgorithm(box, SETTINGS, seed, propose if surrogate else None)
        trace = bees.run(bowl, stop=stop)
        assert trace.evaluations == 70
        return trace.best_value

    alone = [best(seed, False) for seed in range(3)]
    helped = [best(seed, True) for seed in range(3)]
    assert np.median(helped) < 0.5 * np.median(alone)
