"""Motor constants of a small simulated arm, whose currents are torques by them."""

import dataclasses
from types import MappingProxyType

import numpy as np
import pytest
from motor_constants import in_currents

from drake_disasm.common.errors import DisasmError
from drake_disasm.effects import (
    FlangePayload,
    JointCoulombFriction,
    JointLoadFriction,
    JointViscousFriction,
)
from sysid.models.from_logs import ModelChoice, model_of
from sysid.motor_constants import (
    constants_by_payload,
    constants_by_urdf,
    given_constants,
    has_currents,
)
from tests.sysid.models.two_logs import two_logs

_TRUE = (8.0, 2.5)  # N m/A
_FRICTION = [
    JointCoulombFriction("shoulder", 1.0),
    JointViscousFriction("shoulder", 0.3),
    JointCoulombFriction("elbow", 0.8),
    JointLoadFriction("elbow", 0.05),
]
_PAYLOAD = FlangePayload(1.5, 0.02, 0.0, 0.03)


@pytest.fixture(scope="module")
def logs(tmp_path_factory):
    """An arm without and with a payload, with friction that nobody declared."""
    folder = tmp_path_factory.mktemp("arm")
    logs = two_logs(folder, _FRICTION, [_PAYLOAD], rows=800)
    return [in_currents(log, _TRUE) for log in logs]


def test_a_known_payload_gives_the_constants(logs):
    found = constants_by_payload(logs, 1, _PAYLOAD.mass)
    for value, interval, true in zip(found.values, found.intervals, _TRUE, strict=True):
        assert value == pytest.approx(true, rel=0.02)
        assert interval[0] < true < interval[1] < 1.1 * true
    wrong = constants_by_payload(logs, 1, 2.0 * _PAYLOAD.mass)
    np.testing.assert_allclose(wrong.values, 2.0 * np.array(found.values), rtol=0.01)
    assert "a known payload of 1.5 kg" in found.text


def test_the_urdf_gives_the_constants(logs):
    found = constants_by_urdf(logs[:1])
    np.testing.assert_allclose(found.values, _TRUE, rtol=0.02)
    assert all(low < high for low, high in found.intervals)


def test_a_current_that_does_not_follow_the_urdf_determines_nothing(logs):
    random = np.random.default_rng(0)

    def _scrambled(episode):
        columns = dict(episode.columns)
        columns["current.1"] = random.permutation(columns["current.1"])
        return dataclasses.replace(episode, columns=MappingProxyType(columns))

    log = dataclasses.replace(logs[0], episodes=(_scrambled(logs[0].episodes[0]),))
    found = constants_by_urdf([log])
    assert found.intervals[1] is None
    assert found.values[1] == pytest.approx(found.values[0])
    assert "not identifiable at elbow" in found.text


def test_a_current_of_the_other_sign_is_refused(logs):
    [log] = constants_by_urdf(logs[:1]).torques(logs[:1])
    reversed_ = [in_currents(log, (_TRUE[0], -_TRUE[1]))]
    with pytest.raises(DisasmError, match="the current of elbow has the other sign"):
        constants_by_urdf(reversed_)


def test_given_constants_make_torques(logs):
    constants = given_constants(logs[0].header.joints, _TRUE)
    [log] = constants.torques(logs[:1])
    assert has_currents(logs) and not has_currents([log])
    np.testing.assert_allclose(
        log.episodes[0]["tau"], logs[0].episodes[0]["current"] * _TRUE
    )
    assert model_of([log], ModelChoice()).measurements.rows == 800
    with pytest.raises(DisasmError, match="give them"):
        model_of(logs[:1], ModelChoice())


@pytest.mark.parametrize("values", [(1.0, 2.0, 3.0), (1.0, 0.0), (1.0, np.inf)])
def test_constants_that_no_arm_has_are_refused(logs, values):
    with pytest.raises(DisasmError, match="motor constant"):
        given_constants(logs[0].header.joints, values)


def test_a_payload_needs_both_kinds_of_logs(logs):
    for references, payload in ((0, 1.0), (2, 1.0), (1, 0.0)):
        with pytest.raises(DisasmError, match="known payload"):
            constants_by_payload(logs, references, payload)
