"""Real measurements for tests, which are skipped where ../shared/data is not there."""

import functools
from collections.abc import Callable
from pathlib import Path

import pytest
import real_data

DATA = real_data.DATA


def _or_skip(write: Callable[..., Path]) -> Callable[..., Path]:
    @functools.wraps(write)
    def written(*arguments: object, **options: object) -> Path:
        """Returns what is written; skips the test where the data are missing."""
        try:
            return write(*arguments, **options)
        except real_data.MissingDataError as error:
            pytest.skip(str(error))

    return written


real_folder = _or_skip(real_data.data_folder)
write_arm = _or_skip(real_data.write_arm)
write_emps = _or_skip(real_data.write_emps)
write_motion = _or_skip(real_data.write_motion)
write_slide = _or_skip(real_data.write_slide)
write_static = _or_skip(real_data.write_static)
