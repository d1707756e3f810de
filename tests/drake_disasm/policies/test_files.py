"""Policy files: whole, the same every time, and nothing damaged goes unnoticed."""

import dataclasses
import io
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from drake_disasm.common.archive import Arrays, pack, unpack
from drake_disasm.common.errors import DisasmError
from drake_disasm.common.resources import models_dir
from drake_disasm.policies import (
    LearnedPolicy,
    Straight,
    TaskView,
    find_policy,
    load_policy,
    save_policy,
    scenario_hash,
    shipped_policies,
)
from drake_disasm.policies.files import FORMAT, POLICY
from drake_disasm.scenario import load_scenario
from tests.refusals import refusal


@pytest.fixture
def file(policy: LearnedPolicy, tmp_path: Path) -> Path:
    save_policy(tmp_path / "policy.npz", policy)
    return tmp_path / "policy.npz"


def _contents(policy: LearnedPolicy) -> list[Any]:
    arrays = (*policy.network.weights, *policy.network.biases)
    arrays += (policy.view.observation_scale, policy.view.action_scale)
    bits = [(a.dtype.str, a.shape, a.tobytes()) for a in arrays]
    return [*bits, policy.view.base, policy.view.axes, policy.description]


def _refusal(path: Path) -> str:
    """Returns the one line by which a file is refused, with its remedy."""
    message = refusal(load_policy, path)
    assert str(path) in message and "; " in message, message
    return message


@pytest.mark.parametrize(
    ("widths", "base"), [((12, 6), None), ((12, 128, 128, 128, 6), Straight())]
)
def test_round_trip_of_other_shapes(make_network, tmp_path, widths, base):
    view = TaskView(np.ones(12), np.ones(6), base)
    policy = LearnedPolicy(make_network(*widths), view)
    save_policy(tmp_path / "policy.npz", policy)
    assert _contents(load_policy(tmp_path / "policy.npz")) == _contents(policy)


def test_same_policy_same_bytes(policy: LearnedPolicy, file: Path) -> None:
    """Whatever the time, the name, and the order in which a dict was filled."""
    turned = dict(reversed(policy.description.hyperparameters.items()))
    description = dataclasses.replace(policy.description, hyperparameters=turned)
    other = file.with_name("other.npz")
    save_policy(other, dataclasses.replace(policy, description=description))
    assert other.read_bytes() == file.read_bytes()
    with zipfile.ZipFile(file) as archive:
        assert {entry.date_time[0] for entry in archive.infolist()} == {1980}
    save_policy(other, load_policy(file))
    assert other.read_bytes() == file.read_bytes()
    description = dataclasses.replace(policy.description, period=1)  # an int
    save_policy(other, dataclasses.replace(policy, description=description))
    assert load_policy(other).description.period == 1.0
    assert _contents(load_policy(file)) == _contents(policy)
    with np.load(file, allow_pickle=False) as arrays:
        np.testing.assert_array_equal(arrays["weight_0"], policy.network.weights[0])
        assert FORMAT in arrays["text"].tobytes().decode()


def _put(**changes: Any) -> Callable[[Arrays, dict[str, Any]], Any]:
    """Puts arrays (float32 where a shape is given) and parts of the text in."""
    made = {
        k: np.ones(v, np.float32) if isinstance(v, tuple) else v
        for k, v in changes.items()
    }

    def change(arrays: Arrays, text: dict[str, Any]) -> None:
        for name, value in made.items():
            is_text = name in text or isinstance(value, dict)
            target = text if is_text else arrays
            target[name] = value

    return change


def _drop(*names: str) -> Callable[[Arrays, dict[str, Any]], Any]:
    return lambda a, t: [a.pop(n) if n in a else t.pop(n) for n in names]


_LAYERS = tuple(f"{kind}_{i}" for kind in ("weight", "bias") for i in range(3))

#: What is done to a file before its checksum is made, and what is said about it.
BROKEN: list[tuple[Callable[[Arrays, dict[str, Any]], Any], str]] = [
    (_put(format="drake_disasm/policy/2"), f"drake_disasm/policy/2 {FORMAT}"),
    (_drop("format"), f"None {FORMAT}"),
    (_drop("weight_1"), "lacks 'weight_1'"),
    (_drop(*_LAYERS), "lacks 'bias_0'"),
    (_drop("action_scale"), "lacks 'action_scale'"),
    (_put(spam=(1,)), "unknown 'spam'"),
    (_put(weight_1=(5, 9)), "weight_1 (5, 9) (5, 7)"),
    (_put(bias_0=()), "shape train it again"),
    (_put(weight_0=(7, 11)), "weight_0 (7, 11) (7, 12)"),
    (_put(weight_2=(5, 5), bias_2=(5,)), "(5, 5) (6, 5)"),
    (_put(observation_scale=np.ones(6)), "observation_scale (6,) (12,)"),
    (lambda a, t: a["weight_1"].__setitem__((0, 0), np.nan), "NaN weight_1"),
    (lambda a, t: a["observation_scale"].__setitem__(0, 0.0), "scale zero"),
    (lambda a, t: a["action_scale"].__setitem__(0, -1.0), "scale negative"),
    (_put(weight_0=np.ones((7, 12))), "weight_0 float64 float32"),
    (_put(base={"name": "strait", "parameters": {}}), "'strait' 'straight'"),
    (_put(base={"name": "straight", "parameters": {"sped": 1.0}}), "'sped' 'speed'"),
    (_put(base={"name": "straight", "parameters": {"speed": "fast"}}), "speed 'fast'"),
    (_put(base="straight"), "base"),
    (_put(axes={"way": "xy", "ends": [1.0], "switch": 1.0}), "way 'xy' axes"),
    (_put(axes={"way": "x", "ends": [1e999], "switch": 1.0}), "axes end"),
    (_put(axes={"way": "x"}), "'ends'"),
    (_drop("description"), "description"),
    (lambda a, t: t["description"].pop("period"), "description"),
    (lambda a, t: t["description"].update(period="0.1"), "description period float"),
]


@pytest.mark.parametrize(("change", "words"), BROKEN)
def test_whole_file_with_broken_content_is_refused(file, change, words):
    arrays, text = unpack(file.read_bytes(), POLICY)
    change(arrays, text)
    file.write_bytes(pack(arrays, text))
    message = _refusal(file)
    assert all(word in message for word in words.split()), message


def test_broken_policy_is_not_written(policy: LearnedPolicy, file: Path) -> None:
    """What was there stays, and what `load_policy` would refuse is refused at once."""
    before = file.read_bytes()
    policy.network.biases[0][0] = np.nan
    with pytest.raises(DisasmError, match=r"not written.*NaN.*bias_0"):
        save_policy(file, policy)
    nothing = lambda observation: np.zeros(6)  # noqa: E731
    strange = dataclasses.replace(policy.view, base=nothing)
    policy.network.biases[0][0] = 0.0
    with pytest.raises(DisasmError, match="a file can name straight, admittance"):
        save_policy(file, dataclasses.replace(policy, view=strange))
    with pytest.raises(DisasmError, match=r"written; make the folder .*such"):
        save_policy(file.parent / "no/such/policy.npz", policy)
    assert file.read_bytes() == before
    assert [path.name for path in file.parent.iterdir()] == [file.name]


def test_two_arrays_of_one_name_or_no_mapping_are_refused(file: Path) -> None:
    """Else the zip's last one would win without a word."""
    arrays, _ = unpack(file.read_bytes(), POLICY)
    file.write_bytes(pack(arrays, ["a", "list"]))  # type: ignore[arg-type]
    assert "no mapping" in _refusal(file)
    data = io.BytesIO(file.read_bytes())
    with zipfile.ZipFile(data, "a") as archive, pytest.warns(UserWarning):
        content = io.BytesIO()
        np.lib.format.write_array(content, np.zeros(7, np.float32))
        archive.writestr("bias_0.npy", content.getvalue())
    file.write_bytes(data.getvalue())
    assert "is there twice" in _refusal(file)


def test_names_of_policies_and_shipped_ones_written_as_they_were(
    tmp_path: Path,
) -> None:
    assert find_policy("a/b.npz") == Path("a/b.npz")
    assert find_policy("no_such_policy") is None
    assert find_policy("a" * 5000) is None
    for name in shipped_policies():
        path = models_dir() / f"policies/{name}.npz"
        assert find_policy(name) == path
        shipped = load_policy(path)
        save_policy(tmp_path / "again.npz", shipped)  # the entries keep their names
        assert (tmp_path / "again.npz").read_bytes() == path.read_bytes()
        assert shipped.description.station in ("cell", "twin")


def test_scenario_hash_is_of_content() -> None:
    removal = scenario_hash(load_scenario("removal"))
    assert removal == scenario_hash(load_scenario("removal"))
    assert len(removal) == 64
    for override in ("part.clearance=0.0003", "effects=[!SensorBias {fx: 0.5}]"):
        assert removal != scenario_hash(load_scenario("removal", [override]))


def test_flipped_bits_never_go_unnoticed(policy: LearnedPolicy, file: Path) -> None:
    """A flip in what a zip says of itself may be harmless; then nothing changed."""
    data, generator = file.read_bytes(), np.random.default_rng(0)
    expected, refused = _contents(policy), 0
    for place in generator.integers(len(data), size=200):
        damaged = bytearray(data)
        damaged[place] ^= int(generator.integers(1, 256))
        file.write_bytes(damaged)
        try:
            assert _contents(load_policy(file)) == expected
        except DisasmError as error:
            assert "\n" not in str(error)
            refused += 1
    assert refused > 100
