"""The gripper's client against a gripper that fails on demand."""

import dataclasses
import socket
import sys
import threading
import time
from collections.abc import Iterator

import numpy as np
import psutil
import pytest

from drake_disasm.common.ports import Health
from drake_disasm.devices.codec_error import CodecError
from drake_disasm.devices.robotiq import Activation, RobotiqClient, RobotiqSettings
from drake_disasm.devices.robotiq.fake_gripper import FakeRobotiqGripper
from tests.progress import wait_until
from tests.refusals import refusal

OPEN = bytes.fromhex("09 10 03 E8 00 03 06 09 00 00 00 FF FF 72 19")
RESET = bytes.fromhex("09 10 03 E8 00 03 06 00 00 00 00 00 00 73 30")
ACTIVATE = bytes.fromhex("09 10 03 E8 00 03 06 01 00 00 00 00 00 72 E1")

#: Strong and quick: speed and force are all ones on the wire.
SETTINGS = RobotiqSettings("rtu_over_tcp", "127.0.0.1", speed=0.250, force=125.0)


@pytest.fixture
def fake() -> Iterator[FakeRobotiqGripper]:
    with FakeRobotiqGripper() as fake:
        yield fake


@pytest.fixture(autouse=True)
def _nothing_left() -> Iterator[None]:
    threads, files = set(threading.enumerate()), psutil.Process().num_fds()
    yield
    assert set(threading.enumerate()) <= threads
    assert psutil.Process().num_fds() <= files


def _client(fake: FakeRobotiqGripper, activate: bool = False) -> RobotiqClient:
    settings = dataclasses.replace(
        SETTINGS, port=fake.port, activate=activate, period=0.005
    )
    return RobotiqClient(settings)


def _wait_for_polls(fake: FakeRobotiqGripper, number: int = 10) -> None:
    more = len(fake.frames) + number
    wait_until(lambda: len(fake.frames) >= more)


def _wait_for_sample(client: RobotiqClient) -> None:
    now = time.monotonic()
    wait_until(lambda: client.read().time >= now)  # NaN is not


def _wait_for_attempts(
    client: RobotiqClient, monkeypatch: pytest.MonkeyPatch, number: int = 3
) -> None:
    """Waits until a client has tried again a few times."""
    attempts, attempt = [], client._try_cycle
    monkeypatch.setattr(
        client, "_try_cycle", lambda: (attempts.append(None), attempt())[1]
    )
    wait_until(lambda: len(attempts) > number)


def test_writes_nothing_until_commanded_and_then_once(fake: FakeRobotiqGripper) -> None:
    client = _client(fake)
    client.command(0.0)
    client.command(None)
    with client:
        _wait_for_polls(fake)
        reading = client.read()
        np.testing.assert_allclose(reading.values, [0.140, 0.0])
        assert reading.error == ""
        assert reading.health(reading.time, 0.1) is Health.READY
        assert fake.writes == []
        client.command(1.0)
        wait_until(lambda: fake.writes)
        _wait_for_polls(fake)
    assert fake.writes == [OPEN]
    with pytest.raises(CodecError, match="NaN"):
        client.command(np.nan)


def test_dry_run_leaves_the_inactive_alone() -> None:
    with FakeRobotiqGripper(activated=False) as inactive, _client(inactive) as client:
        client.command(0.0)  # which would activate it
        _wait_for_polls(inactive)
        assert "not activated" in client.read().error
    assert inactive.writes == []
    assert client.read().health(0.0, 0.1) is Health.ERROR


def test_follows_to_the_opening_with_a_rate(
    fake: FakeRobotiqGripper, monkeypatch: pytest.MonkeyPatch
) -> None:
    fake.rate, client, rates = 20, _client(fake), []
    put = client._mailbox.put
    monkeypatch.setattr(
        client._mailbox, "put", lambda v, time: (rates.append(v[1]), put(v, time))
    )
    with client:
        client.command(0.070)
        wait_until(lambda: abs(client.read().values[0] - 0.070) < 0.0006)
        wait_until(lambda: client.read().values[1] == 0.0)
    assert min(rates) < 0.0 and max(rates) == 0.0


def test_activates_once_if_it_may() -> None:
    with (
        FakeRobotiqGripper(activated=False) as inactive,
        _client(inactive, activate=True) as client,
    ):
        wait_until(lambda: client.read().health(0.0, 9.0) is Health.READY)
        assert inactive.writes == [RESET, ACTIVATE]
        inactive.state = Activation.RESET  # somebody resets it in mid-run
        wait_until(lambda: "not activated" in client.read().error)
        _wait_for_polls(inactive)
        assert inactive.writes == [RESET, ACTIVATE]


@pytest.mark.parametrize("fault", ["crc", "silent", "drop"])
def test_what_is_broken_is_no_sample(fake: FakeRobotiqGripper, fault: str) -> None:
    with _client(fake) as client:
        _wait_for_sample(client)
        fake.fault = fault
        wait_until(lambda: client.read().counters.invalid > 0)
        stale = client.read()
        wait_until(lambda: client.read().counters.invalid > stale.counters.invalid)
        assert client.read().time == stale.time
        assert client.read().health(stale.time + 1.0, 0.2) is Health.STALE
        fake.fault = ""
        _wait_for_sample(client)
        assert client.read().counters.reconnects > 0


def test_commands_again_after_a_reconnect(fake: FakeRobotiqGripper) -> None:
    with _client(fake) as client:
        client.command(1.0)
        wait_until(lambda: fake.writes)
        fake.fault = "drop"
        wait_until(lambda: client.read().counters.invalid > 0)
        fake.fault = ""
        wait_until(lambda: len(fake.writes) > 1)
    assert set(fake.writes) == {OPEN}


def test_a_fault_stops_commands_and_an_allowed_activation_clears_it(fake) -> None:
    fake.fault = "status"
    with _client(fake) as client:
        client.command(1.0)
        _wait_for_polls(fake)
        assert "0x0E: overcurrent" in client.read().error
        assert fake.writes == []
        fake.fault = ""
        wait_until(lambda: fake.writes)
        assert client.read().error == ""
    with FakeRobotiqGripper() as fake:
        fake.fault = "status"
        with _client(fake, activate=True) as client:
            wait_until(lambda: RESET in fake.writes)
            fake.fault = ""
            wait_until(lambda: ACTIVATE in fake.writes)
            wait_until(lambda: client.read().error == "")


def test_nobody_there(monkeypatch: pytest.MonkeyPatch) -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
    settings = dataclasses.replace(SETTINGS, port=port, period=0.001)
    with RobotiqClient(settings) as client:
        _wait_for_attempts(client, monkeypatch)
        assert client.read().health(0.0, 0.1) is Health.NO_DATA


def test_modbus_tcp() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
        settings = dataclasses.replace(SETTINGS, transport="tcp", port=port)
        with RobotiqClient(settings) as client, server.accept()[0] as connection:
            request = connection.recv(64)
            assert request[2:] == bytes.fromhex("0000 0006 09 03 07D0 0003")
            reply = bytes.fromhex("0000 0009 09 03 06 F900 0000 E600")
            connection.sendall(request[:2] + reply)  # the number comes back
            wait_until(lambda: not np.isnan(client.read().time))
            assert client.read().values[0] == 0.0


def test_the_thread_survives_surprises(
    fake: FakeRobotiqGripper, monkeypatch: pytest.MonkeyPatch
) -> None:
    with _client(fake) as client:
        with monkeypatch.context() as patch:
            patch.setattr(client, "_cycle", lambda: 1 / 0)
            wait_until(lambda: "please report" in client.read().error)
        _wait_for_sample(client)
        assert client.read().error == ""


def test_stops_twice_and_starts_again(fake: FakeRobotiqGripper) -> None:
    client = _client(fake)
    client.stop()
    for _ in range(2):
        client.start()
        client.start()
        _wait_for_sample(client)
        client.stop()
        client.stop()


def test_wrong_settings_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delitem(sys.modules, "serial", raising=False)
    for change, words in (
        ({"speed": 0.3}, "speed is 0.3"),
        ({"force": np.nan}, "force is nan"),
        ({"transport": "udp"}, "rtu_over_tcp, tcp, serial"),
        ({"transport": "serial"}, "pip install pyserial"),
    ):
        assert words in refusal(RobotiqClient, dataclasses.replace(SETTINGS, **change))


def test_a_serial_line_carries_the_same_frames_until_it_is_unplugged() -> None:
    with FakeRobotiqGripper() as fake:
        line = {"transport": "serial", "address": f"socket://127.0.0.1:{fake.port}"}
        client = RobotiqClient(dataclasses.replace(SETTINGS, period=0.005, **line))
        client.start()
        _wait_for_sample(client)
        np.testing.assert_allclose(client.read().values, [0.140, 0.0])
        client.command(1.0)
        wait_until(lambda: fake.writes)
        _wait_for_polls(fake)
        assert fake.writes == [OPEN]
        assert client.read().counters.invalid == 0
    wait_until(lambda: client.read().counters.invalid)
    client.stop()
