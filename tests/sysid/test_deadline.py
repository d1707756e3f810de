import math
import time

from sysid.deadline import parts_until


def test_without_a_deadline_all_is_one_part():
    assert list(parts_until(math.inf, 20, 8)) == [slice(0, 20)]
    assert list(parts_until(math.inf, 0, 8)) == []


def test_with_one_all_is_done_if_there_is_time():
    parts = list(parts_until(time.monotonic() + 1e6, 20, 8))
    assert [i for part in parts for i in range(20)[part]] == list(range(20))
    assert len(parts) == 3


def test_the_first_part_is_done_when_the_time_is_over():
    assert list(parts_until(0.0, 20, 8)) == [slice(0, 8)]
