"""A real arm's identified numbers, back in its file."""

import xml.etree.ElementTree as ET

import numpy as np
import pytest

from drake_disasm.logs import read_logs
from sysid.effect_selection.close_loop import close_loop
from sysid.export import make_exports
from sysid.export.consistent_inertia import pseudo_inertia
from sysid.models.from_logs import ModelChoice, model_of
from tests.sysid.real_data import write_arm, write_motion


def _without_numbers(root: ET.Element) -> list[tuple[str, ...]]:
    """Returns what an export keeps: elements, names, kinematics and limits."""
    written = ("mass", "inertia", "dynamics")
    return [
        (e.tag, *sorted(f"{k}={v}" for k, v in e.items()))
        for part in root
        for e in part.iter()
        if e.tag not in written and not (part.tag == "link" and e.tag == "origin")
        if "rotor" not in e.tag and "gear" not in e.tag
    ]


@pytest.mark.slow
def test_a_real_arm_is_exported_and_read_again(tmp_path):
    urdf = write_arm(tmp_path / "lwr4.urdf")
    logs = read_logs([write_motion(1, tmp_path / "log", urdf)])
    exports = make_exports(close_loop(model_of(logs, ModelChoice())), ["urdf", "sdf"])
    for trip in exports.trips.values():
        assert trip.share < 1e-9
        assert trip.moved < 0.03 * trip.torque
    bodies = exports.arm.bodies
    for pi in bodies.inertia.reshape(-1, 10):
        if pi[0] > 0.0:
            assert np.linalg.eigvalsh(pseudo_inertia(pi)).min() >= 0.0
    after = ET.fromstring(exports.files["lwr4_identified.urdf"])
    assert _without_numbers(after) == _without_numbers(ET.parse(urdf).getroot())
