"""Candidates as plain data, and back."""

import json

from drake_disasm.effects import JointCoulombFriction, TorqueOffset
from sysid.fitting.candidates import Candidate
from sysid.monitoring.plain_effects import candidates_of, mappings_of


def test_more_candidates_than_a_scenario_may_have_come_back():
    known = [Candidate.of(TorqueOffset(f"joint_{n}", 0.1 * n)) for n in range(130)]
    known.append(Candidate.of(JointCoulombFriction("joint_1", 0.0, 0.02)))
    assert candidates_of(json.loads(json.dumps(mappings_of(known)))) == tuple(known)
