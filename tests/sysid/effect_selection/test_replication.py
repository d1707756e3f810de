"""Which effects are confirmed: by parts of a log that had no say in choosing them."""

import numpy as np
import pytest

from sysid.effect_selection.replication import part_numbers
from tests.sysid.effect_selection.made import TIME, linear_system, placed

_ROWS, _NAME = 480, "JointCoulombFriction.j"
_QUARTER = np.repeat(np.arange(4), _ROWS // 4)


def _placed(acts, recordings=1, joint="j", column=None, seed=0, **more):
    """Returns where an effect stands that has a size (rows,) over a log."""
    random = np.random.default_rng(seed)
    column = random.standard_normal(_ROWS) if column is None else column
    r = acts * column + random.standard_normal(_ROWS)
    others = {f"k{i}": random.standard_normal((_ROWS, 1)) for i in range(5)}
    columns = {joint: column[:, None], **others}
    return placed(linear_system(columns, r, **more), recordings)


def test_what_acts_in_all_quarters_is_confirmed():
    found = _placed(np.full(_ROWS, 2.0))
    assert list(found) == [_NAME]
    assert found[_NAME].status == "confirmed" and found[_NAME].votes == 4
    assert found[_NAME].gain == pytest.approx(0.8, abs=0.05)


@pytest.mark.parametrize("size", [1.5, 10.0])
def test_what_acts_in_one_quarter_only_is_rarely_confirmed(size):
    """A quarter that needs it, and three that contradict."""
    found = [
        _placed(np.where(seed % 4 == _QUARTER, size, 0.0), seed=seed)
        for seed in range(20)
    ]
    assert (
        sum(_NAME in each and each[_NAME].status == "confirmed" for each in found) <= 4
    )


def test_what_can_show_in_one_quarter_only_is_confirmed_where_the_others_are_silent():
    rust = np.where(_QUARTER == 2, np.random.default_rng(1).standard_normal(_ROWS), 0.0)
    found = _placed(4.0, column=rust)
    assert found[_NAME].status == "confirmed" and found[_NAME].votes == 3


def test_what_changes_its_sign_is_not_confirmed():
    found = _placed(np.array([3.0, 3.0, 3.0, -1.5])[_QUARTER])
    assert found[_NAME].status == "suggested"


@pytest.mark.parametrize(
    ("recordings", "is_stated", "status"),
    [(1, False, "suggested"), (2, False, "confirmed"), (1, True, "confirmed")],
)
def test_slow_noise_looks_like_an_effect_of_time(recordings, is_stated, status):
    """Unless its size is known, or a second session repeats the effect."""
    time = np.tile(np.linspace(-1.7, 1.7, _ROWS // recordings), recordings)
    episode = np.repeat(np.arange(recordings), _ROWS // recordings)
    found = _placed(
        2.0, recordings, TIME, time, episode=episode, noise_is_stated=is_stated
    )
    assert found["SensorDrift"].status == status


@pytest.mark.parametrize("episodes", [1, 6])
def test_parts_are_of_whole_episodes_where_there_are_enough(episodes):
    episode = np.repeat(np.arange(episodes), 240 // episodes)
    system = linear_system({"j": np.ones((240, 1))}, np.ones(240), episode=episode)
    equations = system.equations()
    parts = part_numbers(equations.episode, 4)
    assert set(np.diff(parts)) <= {0, 1} and parts[-1] == 3
    if episodes > 1:
        of = [set(parts[equations.episode == number]) for number in range(episodes)]
        assert all(len(each) == 1 for each in of)
