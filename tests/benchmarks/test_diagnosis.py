"""The judge of diagnosis: its worlds, and what is right of them."""

import pytest
from diagnosis.answer import Answer
from diagnosis.judge import is_right, main
from diagnosis.worlds import GROUPS, PAIRS, draw, library

from tests.refusals import refused


@pytest.mark.parametrize("group", GROUPS)
def test_a_world_is_drawn_again_and_no_two_share_a_seed(group: str) -> None:
    worlds = [draw(group, number) for number in range(GROUPS[group][1])]
    assert worlds[3].effects == draw(group, 3).effects
    assert len({world.seed for world in worlds}) == len(worlds)
    assert all(world.real.effects == list(world.effects) for world in worlds)


def test_worlds_are_evenly_of_all_pairs_and_of_effects_that_none_has() -> None:
    pairs = [draw("pairs", number) for number in range(70)]
    assert all(sum(world.pair == pair for world in pairs) == 10 for pair in PAIRS)
    assert all(set(world.hidden) <= set(world.pair) for world in pairs)
    missing = [draw("missing", number) for number in range(20)]
    assert not any(world.is_in_library or world.hidden for world in missing)
    assert not {type(world.effects[0]) for world in missing} & set(library())


def test_right_is_what_is_hidden_and_nothing_in_doubt() -> None:
    world = draw("pairs", 0)
    own = world.hidden
    [other] = set(world.pair) - set(own)
    assert is_right(world, Answer(own))
    assert not is_right(world, Answer(own, open=(other,)))
    assert not is_right(world, Answer((*own, other)))
    assert not is_right(world, Answer(()))


def test_right_of_what_no_library_has_says_on_what_it_depends() -> None:
    world = draw("missing", 0)
    assert is_right(world, Answer((), is_unknown=True, depends_on=("fz",)))
    assert not is_right(world, Answer((), is_unknown=True))
    assert not is_right(world, Answer(("ChainPull",), (), True, ("fz",)))
    assert not is_right(draw("null", 0), Answer((), is_unknown=True))
    assert is_right(draw("null", 0), Answer(()))


@pytest.mark.parametrize("worlds", [("19", "21"), ("3", "5", "20"), ("21",)])
def test_a_world_beyond_its_group_is_refused(worlds: tuple[str, ...], tmp_path) -> None:
    with refused("--worlds", "0 to 19", "no 20"):
        main(["null", "--worlds", *worlds, "--out", str(tmp_path)])
