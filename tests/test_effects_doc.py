"""docs/effects.md lists the library as it is."""

from pathlib import Path

from drake_disasm.effects import amplitudes, registered_effects, shape_parameters

_PAGE = (Path(__file__).parents[1] / "docs" / "effects.md").read_text("utf-8")


def test_every_effect_is_listed_with_its_fields():
    rows = {
        line.split("`")[1]: line
        for line in _PAGE.splitlines()
        if line.startswith("| `")
    }
    assert sorted(rows) == sorted(effect.__name__ for effect in registered_effects())
    for effect in registered_effects():
        row = rows[effect.__name__]
        fields = [*amplitudes(effect), *shape_parameters(effect)]
        assert (
            all(name in row for name in fields)
            or f"{len(fields)} such" in row
            or (len(amplitudes(effect)) > 6)
        )
