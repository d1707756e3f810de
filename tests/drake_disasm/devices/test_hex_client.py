"""The HEX's client against a box on the loopback that can misbehave."""

from collections.abc import Iterator

import numpy as np
import pytest

from drake_disasm.common.ports import Health
from drake_disasm.devices.onrobot_hex import BoxCommand, BoxRequest, HexClient
from drake_disasm.devices.onrobot_hex.fake_box import JUMP, FakeHexBox
from drake_disasm.devices.reading import Counters
from tests.progress import wait_until
from tests.refusals import refusal

WRENCH = (1.0, -2.0, 3.0, 0.1, -0.2, 0.3)
STREAM = [
    BoxRequest(BoxCommand.FILTER, 4),
    BoxRequest(BoxCommand.PERIOD, 2),
    BoxRequest(BoxCommand.START, 0),
]
PATIENT = 1e6  # [s], silence that no machine reaches


class _Clock:
    """Stands until a test moves it."""

    now = 0.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock() -> _Clock:
    return _Clock()


@pytest.fixture
def box(clock: _Clock) -> Iterator[FakeHexBox]:
    with FakeHexBox(clock=clock) as box:
        yield box


@pytest.fixture
def client(box: FakeHexBox, clock: _Clock) -> Iterator[HexClient]:
    with HexClient("127.0.0.1", box.port, clock=clock, silence=PATIENT) as client:
        wait_until(lambda: box.started)
        yield client


def _send(box: FakeHexBox, *faults: str) -> None:
    """Sends a sample for each fault; its fx is the sample's place in the row."""
    for number, fault in enumerate(faults, start=1):
        box.fault = fault
        box.send((float(number), *WRENCH[1:]))


def _counted(client: HexClient, **expected: int) -> None:
    """Waits until the counters are as expected."""
    wait_until(lambda: client.read().counters == Counters(**expected))


def test_a_sample_is_read_after_the_settings(box, client, clock) -> None:
    assert client.read().health(0.0, stale_after=0.1) == Health.NO_DATA
    clock.now = 2.0
    box.send(WRENCH)
    _counted(client, received=1)
    np.testing.assert_array_equal(client.read().values, WRENCH)
    assert client.read().time == 2.0
    assert client.read().health(2.05, stale_after=0.1) == Health.READY
    assert box.requests == STREAM
    client.stop()
    wait_until(lambda: not box.started)
    assert box.requests == [*STREAM, BoxRequest(BoxCommand.STOP)]


@pytest.mark.parametrize(
    ("faults", "newest", "counters"),
    [
        (("", "loss", "loss", ""), 4.0, Counters(received=2, lost=2)),
        # Of each pair the older one was missed first, and dropped when it came.
        (("", "reorder", "reorder"), 3.0, Counters(received=2, lost=1, reordered=1)),
        # Whether the unreadable ones were the missing numbers can't be known.
        (("", "short", "header"), 1.0, Counters(received=1, invalid=2)),
        (("", "short", ""), 3.0, Counters(received=2, invalid=1, lost=1)),
        (("", "jump"), 2.0 + JUMP, Counters(received=2)),
        (("", "frozen", "frozen"), 1.0, Counters(received=1, reordered=2)),
    ],
    ids=lambda value: "-".join(value) if isinstance(value, tuple) else None,
)
def test_faults_are_counted(box, client, faults, newest, counters) -> None:
    _send(box, *faults)
    wait_until(lambda: client.read().counters == counters)
    assert client.read().values[0] == newest
    assert not client.read().error


def test_what_is_late_or_has_an_old_number_grows_stale(
    box: FakeHexBox, client: HexClient, clock: _Clock
) -> None:
    _send(box, "delay")  # is held back
    clock.now = box.delay_s
    _send(box, "loss")
    _counted(client, received=1)
    clock.now += 1.0
    box.sequence = 1
    _send(box, "frozen")
    _counted(client, received=1, reordered=1)
    assert client.read().health(clock.now, stale_after=0.1) == Health.STALE


def test_a_bad_status_is_an_error_until_a_good_one(box, client) -> None:
    _send(box, "", "status")
    wait_until(lambda: bool(client.read().error))
    assert "HEX status 0x2: " in client.read().error
    assert client.read().values[0] == 1.0
    assert client.read().health(0.0, stale_after=0.1) == Health.ERROR
    box.fault = ""
    box.send(WRENCH)
    _counted(client, received=2)
    assert not client.read().error


def test_numbers_wrap_and_begin_anew(box: FakeHexBox, client: HexClient) -> None:
    box.sequence = 2**32 - 2
    _send(box, "", "", "")
    _counted(client, received=3)
    box.sequence = 5000
    _send(box, "")
    _counted(client, received=4, lost=4999)
    box.sequence = 0
    _send(box, "")
    _counted(client, received=5, lost=4999)


def test_a_silent_or_restarted_box_is_asked_again() -> None:
    with FakeHexBox() as box, HexClient("127.0.0.1", box.port, silence=0.02) as client:
        wait_until(lambda: client.read().counters.reconnects >= 2)
        wait_until(lambda: len(box.requests) >= 6)
        assert box.requests[:6] == [*STREAM, *STREAM]
    with FakeHexBox() as old, HexClient("127.0.0.1", old.port, silence=0.02) as client:
        wait_until(lambda: old.started)
        old.stop()
        wait_until(lambda: client.read().counters.reconnects >= 2)
        with FakeHexBox(old.port) as box:

            def sends_until_read() -> bool:
                box.send(WRENCH)
                return client.read().counters.received > 0

            wait_until(lambda: box.started)
            wait_until(sends_until_read)
    np.testing.assert_array_equal(client.read().values, WRENCH)


def test_wrong_settings_and_addresses_are_refused() -> None:
    message = refusal(HexClient, "127.0.0.1", silence=0.002)
    assert "must be longer than period" in message
    client = HexClient("127.0.0.1", port=70_000)
    assert "check the address" in refusal(client.start)
