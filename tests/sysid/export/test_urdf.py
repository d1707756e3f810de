"""The user's URDF keeps all bytes but those of identified numbers."""

import difflib
import re

import pytest

from drake_disasm.effects import (
    FlangePayload,
    JointCoulombFriction,
    JointViscousFriction,
    RotorInertia,
)
from sysid.export.identified_arm import IdentifiedArm
from sysid.export.urdf import urdf_bytes
from sysid.export.xml_edits import XmlEdits
from tests.refusals import refused
from tests.sysid.export.arms import IIWA, IIWA_JOINTS, fitted, text_of, two_links
from tests.sysid.models.arm import JOINTS

EFFECTS = (
    JointViscousFriction("iiwa_joint_2", 1.5),
    JointCoulombFriction("iiwa_joint_2", 2.5),
    RotorInertia("iiwa_joint_3", 0.4),
    FlangePayload(1.2, 0.05, 0.0, 0.1),
)
OURS = re.compile(
    r"\s*<(origin|mass|inertia|dynamics|drake:rotor_inertia|/?inertial)\b.*>\s*"
)


def test_only_lines_of_inertial_dynamics_and_payload_differ(tmp_path):
    closed = fitted(tmp_path / "log", IIWA, IIWA_JOINTS, EFFECTS)
    before = text_of(IIWA).decode().splitlines()
    after = urdf_bytes(IdentifiedArm.of(closed)).decode().splitlines()
    diff = list(difflib.unified_diff(before, after, n=0))[2:]
    added = [line for line in diff if line[0] in "+-"]
    at = next(i for i, line in enumerate(added) if "identified_payload" in line)
    assert all(OURS.fullmatch(line[1:]) for line in added[:at]), added[:at]
    assert "".join(line[1:].strip() for line in added[at:]).endswith("</joint>")
    assert [line[0] for line in added[at:]] == ["+"] * len(added[at:])
    assert '  <dynamics damping="1.5" friction="2.5"/>' in "\n".join(after)


@pytest.mark.parametrize("line", ["\n", "\r\n"])
def test_comments_quotes_and_odd_layout_stay(line):
    text = line.join(
        [
            '<?xml version="1.0"?><!-- a > b -->',
            "<robot name='x'  ><!-- kept -->",
            "  <link name='a'/><link",
            "     name='b' >  <inertial><mass value = '1' /></inertial></link >",
            "  <gazebo><x>&lt; 1</x></gazebo>",
            "</robot>",
        ]
    ).encode()
    edits = XmlEdits(text, "x.urdf")
    a, b = edits.root.all("link")
    mass = b.first("inertial").first("mass")
    edits.set_attributes(mass, {"value": "2.5", "unit": "kg"})
    edits.add_child(a, "<inertial>\n  <mass/>\n</inertial>")
    edits.add_child(edits.root, "<link name='c'/>")
    end = line.encode()
    expected = text.replace(b"value = '1' />", b'value = "2.5" unit="kg" />')
    inertial = end.join([b"    <inertial>", b"      <mass/>", b"    </inertial>"])
    expected = expected.replace(
        b"<link name='a'/>", b"<link name='a'>" + end + inertial + end + b"  </link>"
    )
    expected = expected.replace(b"</robot>", b"  <link name='c'/>" + end + b"</robot>")
    assert edits.result() == expected
    assert XmlEdits(text, "x.urdf").result() == text


def test_rotors_get_a_transmission_and_the_prefix_that_it_needs(tmp_path):
    urdf = two_links(tmp_path / "arm.urdf")
    effects = [RotorInertia("elbow", 0.3)]
    closed = fitted(tmp_path / "log", urdf, JOINTS, effects)
    text = urdf_bytes(IdentifiedArm.of(closed)).decode()
    assert text.startswith('<robot name="two" xmlns:drake="http://drake.mit.edu">')
    assert '<drake:rotor_inertia value="0.3"/>' in text and "<!-- mine -->" in text


@pytest.mark.parametrize(
    "data, words",
    [
        (b"<robot", "is no XML"),
        (b"", "is no XML"),
        ("<robot/>".encode("utf-16"), "UTF-16"),
        (b"<a>" * 70 + b"</a>" * 70, "nested"),
    ],
)
def test_what_is_no_urdf_is_refused(data, words):
    with refused("x.urdf", words):
        XmlEdits(data, "x.urdf")
