"""The same motion with stamps of arrival, and with lost messages: the same verdict."""

from pathlib import Path

import pytest
from recording_variants import VARIANTS, judged


@pytest.mark.slow
def test_the_way_of_recording_changes_no_name(tmp_path: Path) -> None:
    found = {}
    for number, (name, variant) in enumerate(VARIANTS.items()):
        if name.startswith("500 Hz"):
            (folder := tmp_path / str(number)).mkdir()
            found[name] = judged(variant, 1, folder)
    assert len({each.names for each in found.values()}) == 1
    for each in found.values():
        covered = each.covered()
        assert sum(covered.values()) >= 0.8 * len(covered)
