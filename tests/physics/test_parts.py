"""Peg and bayonet against statics."""

import pytest
from parts import detent, play, pulled

from drake_disasm.parts import PegInHole


@pytest.mark.parametrize("section", ["round", "square"])
@pytest.mark.parametrize(("share", "slides"), [(0.8, True), (1.25, False)])
def test_a_peg_jams_where_whitney_says(
    section: str, share: float, slides: bool
) -> None:
    """Pulled beside its axis: it slides while M / F < l / (2 mu)."""
    peg, friction = PegInHole(cross_section=section), 0.5
    way = pulled(peg, friction, share * peg.depth / (2 * friction), duration=0.1)
    assert (way > 1e-3) == slides
    assert slides or way < 4e-4


@pytest.mark.parametrize("section", ["round", "square"])
def test_the_play_of_a_peg_is_the_clearance(section: str) -> None:
    """Under 1 N, which presses a few micrometres in."""
    found = play("part.clearance=1e-4", f"part.cross_section={section}")
    assert 1e-4 < found < 1.06e-4


def test_a_detent_resists_with_its_springs_torque() -> None:
    rows = detent(step=0.03)
    assert max(-stated for _, stated, _ in rows) > 0.14
    for angle, stated, read in rows:
        assert read == pytest.approx(stated, abs=4e-3), angle
