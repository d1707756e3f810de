"""Logs of which some are references: effects act in the others alone."""

import dataclasses

import numpy as np
import pytest

from drake_disasm.common.errors import DisasmError
from drake_disasm.effects import FlangePayload, JointCoulombFriction
from sysid.fitting.candidates import Candidate, extended
from sysid.models.changed import ChangedModel
from sysid.models.joint_motion import JointMotionModel
from sysid.models.response.model import JointResponseModel
from tests.sysid.models.response.servo import write_response
from tests.sysid.models.two_logs import two_logs

ELBOW = JointCoulombFriction("elbow", 0.3)


@pytest.fixture(scope="module")
def model(tmp_path_factory) -> JointMotionModel:
    return JointMotionModel(two_logs(tmp_path_factory.mktemp("logs")))


def is_newer(model) -> np.ndarray:
    return model.measurements.episode == 1


def nominal(model) -> np.ndarray:
    return np.array([parameter.nominal for parameter in model.parameters])


def test_a_change_acts_in_newer_rows_alone(model):
    whole, _ = extended(model, [Candidate.of(ELBOW)])
    changed = ChangedModel(whole, is_newer(whole))
    more, _ = extended(changed, [Candidate.of(JointCoulombFriction("elbow"))])
    theta = np.append(nominal(changed), 0.2)
    found = more.predictions(theta)
    newer = is_newer(model)
    louder = dataclasses.replace(ELBOW, size=0.5)
    with_more, _ = extended(model, [Candidate.of(louder)])
    before, after = (m.predictions(nominal(m)) for m in (whole, with_more))
    assert np.allclose(found[~newer], before[~newer], atol=1e-12)
    assert np.allclose(found[newer], after[newer], atol=1e-12)
    assert not np.allclose(before[newer], after[newer])


def test_rows_are_predicted_one_by_one_as_together(model):
    changed, _ = extended(
        ChangedModel(model, is_newer(model)), [Candidate.of(FlangePayload())]
    )
    theta = np.append(nominal(changed)[: len(model.parameters)], [0.4, 0.1, 0.0, 0.02])
    whole = changed.predictions(theta)
    mask = np.arange(len(whole)) % 7 == 3
    assert np.allclose(changed.of_rows(mask).predictions(theta), whole[mask])
    border = int(np.flatnonzero(is_newer(model))[0])
    across = slice(border - 3, border + 3)
    assert np.allclose(changed.predict(theta, across), whole[across])


def test_parameter_sets_are_simulated_together(tmp_path):
    logs = [write_response(tmp_path / n, episodes=1, duration=1.0) for n in "ab"]
    servo = JointResponseModel(logs)
    changed, _ = extended(
        ChangedModel(servo, is_newer(servo)),
        [Candidate.of(JointCoulombFriction("servo", 0.1))],
    )
    changed = changed.freeze({changed.parameters[1].name: 0.1})
    thetas = nominal(changed) * np.array([[1.0], [0.9], [1.2]])
    assert changed.together > len(thetas)
    for rows in changed.chunks():
        one_by_one = [changed.simulate(theta, rows) for theta in thetas]
        together = changed.simulate_all(thetas, rows)
        np.testing.assert_allclose(together, one_by_one, atol=1e-9)


def test_frozen_parameters_keep_their_values(model):
    changed, _ = extended(ChangedModel(model, is_newer(model)), [Candidate.of(ELBOW)])
    theta = nominal(changed) + 0.01
    first, last = changed.parameters[0].name, changed.parameters[-1].name
    held = changed.freeze({first: float(theta[0]), last: float(theta[-1])})
    assert np.allclose(held.predictions(theta[1:-1]), changed.predictions(theta))


def test_a_friction_may_have_fallen(model):
    changed, ((place,),) = extended(
        ChangedModel(model, is_newer(model)), [Candidate.of(ELBOW)]
    )
    assert changed.parameters[place].low == -changed.parameters[place].high


@pytest.mark.parametrize("value", [True, False])
def test_one_log_alone_is_refused(value, model):
    with pytest.raises(DisasmError, match="at least one reference"):
        ChangedModel(model, np.full(model.measurements.rows, value))
