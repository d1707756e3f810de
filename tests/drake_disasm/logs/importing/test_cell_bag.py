"""A bag of our own cell: the shift in it, and the verdict that the log itself has."""

from pathlib import Path

import pytest
from cell_bag import FRICTION, LATE, verdicts

from drake_disasm.scenario import load_scenario

#: What the arm has, and its URDF doesn't say. Beside that either verdict may name what
#: a filter leaves of friction's edges where there is no noise: delays below 3 ms. The
#: bag, which has noise, shows less of the controller's small viscous friction.
_OF_THE_ARM = ("RotorInertia", "JointCoulombFriction")


@pytest.mark.slow
def test_a_bag_of_the_cell_has_the_verdict_of_its_log(tmp_path: Path) -> None:
    bag, own, shift = verdicts(tmp_path)
    # A discrete plant's forces are those of the step before: the cell's own delay.
    delay = load_scenario("removal").simulation.cell_time_step
    assert shift == pytest.approx(-(LATE + delay), abs=1e-3)
    assert bag.ending == own.ending
    for kind in _OF_THE_ARM:
        named = [{n for n in v.names if n.startswith(kind)} for v in (bag, own)]
        assert named[0] == named[1] and named[0]
    for verdict in (bag, own):
        values = {v.name: v.value for v in verdict.values}
        for joint, size in FRICTION.items():
            found = values[f"JointCoulombFriction.{joint}.size"]
            # Viscous friction that is not named is part of it.
            assert found == pytest.approx(size, rel=0.05)
