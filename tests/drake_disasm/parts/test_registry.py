"""Which classes can be parts, and where a scenario finds them."""

import dataclasses

import pytest

from drake_disasm.common.quantity import quantity
from drake_disasm.parts import (
    DoorChain,
    Part,
    PegInHole,
    find_part,
    register_part,
    registry,
)
from drake_disasm.scenario import dump_scenario, load_scenario
from tests.refusals import refused


@pytest.fixture(autouse=True)
def own_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    """Parts that a test registers are gone after it."""
    monkeypatch.setattr(registry, "_parts", dict(registry._parts))


def test_a_part_of_ones_own_is_a_tag_of_scenarios(tmp_path) -> None:
    @register_part
    @dataclasses.dataclass
    class LoosePeg(PegInHole):
        """A peg with more play."""

        clearance: float = quantity(0.0009, "m", "more", low=1e-4, high=1e-3)

    scenario = load_scenario("iiwa_peg", ["part=!LoosePeg {depth: 0.03}"])
    assert (scenario.part.clearance, scenario.part.depth) == (0.0009, 0.03)
    (tmp_path / "again.yaml").write_text(dump_scenario(scenario))
    assert load_scenario(str(tmp_path / "again.yaml")) == scenario


def test_what_is_no_part_is_refused() -> None:
    with refused("part int: ", "no class derived from Part"):
        register_part(int)
    with refused("part Half: lacks ", "moved_solids"):
        register_part(type("Half", (Part,), {}))
    fake = dataclasses.make_dataclass("DoorChain", [], bases=(DoorChain,))
    with refused("part DoorChain: ", "rename one of them"):
        register_part(fake)
    with refused("part 'Peg' is not registered", "PegInHole"):
        find_part("Peg")
