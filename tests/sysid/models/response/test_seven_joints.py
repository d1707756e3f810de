"""Effects are found by where an arm is, without torques."""

import pytest
from seven_joints import HIDDEN, write_log

from sysid.effect_selection.close_loop import close_loop
from sysid.models.response.model import JointResponseModel


def verdict(folder, name):
    effects, seed = HIDDEN[name]
    log = write_log(folder / "log", *effects, seed=seed)
    return close_loop(JointResponseModel([log])).verdict


@pytest.mark.slow
def test_where_nothing_is_hidden_nothing_is_found(tmp_path):
    assert verdict(tmp_path, "nothing").ending == "none"


@pytest.mark.slow
def test_a_hidden_payload_is_found(tmp_path):
    found = verdict(tmp_path, "payload")
    assert found.names == ("FlangePayload",)
    values = {v.name.rpartition(".")[2]: v.value for v in found.values}
    assert values["mass"] == pytest.approx(1.5, rel=0.1)
    assert values["cz"] == pytest.approx(0.12, rel=0.1)
