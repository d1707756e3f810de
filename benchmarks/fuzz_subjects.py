"""What is fuzzed: every reader of files, and every codec of a device."""

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from drake import lcmt_iiwa_status
from fuzz_importers import IMPORTERS
from mutations import Random, damaged, damaged_csv, damaged_yaml
from subject import (
    Subject,
    archive_damage,
    either_way,
    file_subject,
    folder_subject,
    new_folder,
    parquet_damage,
    yaml_subject,
)

from drake_disasm.common.archive import Arrays, unpack
from drake_disasm.common.finished_work import FinishedWork
from drake_disasm.common.resources import models_dir
from drake_disasm.devices.iiwa.status import decode_status as decode_iiwa_status
from drake_disasm.devices.onrobot_hex import codec
from drake_disasm.devices.robotiq import registers
from drake_disasm.logs import LogHeader, LogWriter, read_log
from drake_disasm.logs.files import unfinished_path
from drake_disasm.logs.header import read_header
from drake_disasm.logs.schema import KINDS, Form, Quantity, Rule
from drake_disasm.policies import (
    Admittance,
    LearnedPolicy,
    Network,
    TaskView,
    load_policy,
    save_policy,
)
from drake_disasm.policies.files import POLICY
from drake_disasm.scenario import dump_scenario, load_scenario
from drake_disasm.stations.hardware_config import load_hardware_config
from sysid.scenario_parameters import read_requests

_ROWS, _JOINTS = 6, 3


def _scenario() -> Subject:
    shipped = ("removal_turned", "removal_randomised", "chapter3")
    texts = [dump_scenario(load_scenario(name)) for name in shipped]
    paths = [models_dir() / f"scenarios/{name}.yaml" for name in shipped]
    texts += [path.read_text("utf-8") for path in paths]
    return yaml_subject("s.yaml", texts, lambda path: load_scenario(str(path)))


def _hardware() -> Subject:
    text = (models_dir() / "hardware" / "cell.yaml").read_text("utf-8")
    return yaml_subject("h.yaml", [text], load_hardware_config)


def _parameters() -> Subject:
    text = "contact.friction: {low: 0.0, high: 1.0, nominal: 0.2, scale: linear}\n" * 2
    text += "GroovePose.ry:\n  low: -0.1\n  high: 0.1\n"
    return yaml_subject("p.yaml", [text], lambda path: read_requests([str(path)]))


def _archive(data: bytes, kind: Any) -> Callable[[Random], bytes]:
    return archive_damage(data, *unpack(data, kind))


def _policy() -> Subject:
    rng, path = np.random.default_rng(0), new_folder() / "p.npz"
    widths = ((5, 12), (6, 5))
    network = Network(
        tuple(rng.normal(size=width).astype(np.float32) for width in widths),
        tuple(rng.normal(size=width[0]).astype(np.float32) for width in widths),
    )
    view = TaskView(np.ones(12), np.ones(6), Admittance())
    save_policy(path, LearnedPolicy(network, view))
    return file_subject("p.npz", _archive(path.read_bytes(), POLICY), load_policy)


def _checkpoint() -> Subject:
    from drake_disasm.learning.checkpoint import CHECKPOINT  # PyTorch takes seconds
    from drake_disasm.learning.environments import make_environments
    from drake_disasm.learning.hyperparameters import Hyperparameters
    from drake_disasm.learning.loop import TrainingLoop
    from drake_disasm.learning.training import TrainingSpec, make_training

    scenario = load_scenario("chapter3", ["task.steps=4"])
    config = Hyperparameters(hidden=[4], replay=20, batch=4)
    spec = TrainingSpec(scenario, "twin", config, 0, compiled=False)
    training = make_training(spec)
    TrainingLoop(make_environments([spec]), [training]).run_round()
    path = new_folder() / "c.npz"
    training.save(path)
    return file_subject(
        "c.npz", _archive(path.read_bytes(), CHECKPOINT), training.restore
    )


def _results() -> Subject:
    """Results that a run keeps to be resumed: JSON, lines of JSON, arrays."""
    folder, identity = new_folder(), {"seed": 0, "config": {"rate": 0.1}}
    work = FinishedWork(folder, identity)
    work.keep_all([(["stage", [0.1]], {"x": [1.0, 2.0]}), ("b", 3)])
    work.arrays("key", lambda: {"u": np.arange(3.0)})
    return folder_subject(
        folder, lambda: FinishedWork(folder, identity).arrays("key", dict)
    )


def _columns_of(quantity: Quantity, rng: Random) -> Arrays:
    """Returns valid columns of a quantity."""
    if quantity.form is Form.SCALAR:
        names = [quantity.name]
    else:
        parts = {Form.JOINTS: range(_JOINTS), Form.TERMS: ("a", "b")}
        names = [f"{quantity.name}.{p}" for p in parts.get(quantity.form, ())]
        names += [f"{quantity.name}.{part}" for part in quantity.components]
    columns = {name: rng.normal(size=_ROWS) for name in names}
    for name, values in columns.items():
        if quantity.increasing:
            columns[name] = 0.1 * np.arange(_ROWS)
        elif quantity.boolean:
            columns[name] = np.zeros(_ROWS, dtype=bool)
        elif name.rpartition(".")[2] in ("qw", "qx", "qy", "qz"):
            columns[name] = np.full(_ROWS, float(name.endswith("w")))
        elif quantity.of_step:
            values[-1] = 0.0
    return columns


def _sample_log(folder: Path, kind: str, file_format: str, rng: Random) -> Arrays:
    """Writes a valid log of one episode; returns its columns."""
    keys = KINDS[kind].keys
    header = LogHeader(
        kind,
        "fuzz",
        {"program": "fuzz", "versions": {"a": "1"}},
        frames={"wrench": "S"} if kind in ("static_wrench", "contact") else {},
        period=None if keys["period"] is Rule.FORBIDDEN else 0.1,
        joints=("a", "b", "c") if keys["joints"] is Rule.REQUIRED else (),
    )
    columns: Arrays = {}
    for quantity in KINDS[kind].quantities:
        columns |= _columns_of(quantity, rng)
    LogWriter(folder, header, file_format).write_episode(columns)
    return columns


def _log(file_format: str) -> Subject:
    folders = {kind: new_folder() for kind in KINDS}
    rng = np.random.default_rng(0)
    columns = {k: _sample_log(f, k, file_format, rng) for k, f in folders.items()}
    names = ("log.yaml", f"episode_0000.{file_format}")
    whole = {k: {n: (f / n).read_bytes() for n in names} for k, f in folders.items()}

    def make(rng: Random) -> tuple[str, str, bytes]:
        """Returns a damaged one."""
        kind = list(folders)[rng.integers(len(folders))]
        name = names[min(1, rng.integers(4))]
        data = whole[kind][name]
        if name == "log.yaml":
            return kind, name, either_way(data.decode(), damaged_yaml, rng)
        if file_format == "csv":
            return kind, name, either_way(data.decode(), damaged_csv, rng)
        return kind, name, parquet_damage(data, columns[kind])(rng)

    def read(content: tuple[str, str, bytes]) -> None:
        """Reads it beside what is whole."""
        kind, name, data = content
        for each, good in whole[kind].items():
            (folders[kind] / each).write_bytes(data if each == name else good)
        read_log(folders[kind])

    return Subject(make, read)


def _unfinished() -> Subject:
    """Rows that a killed program leaves, which the next start closes."""
    folder, kind = new_folder(), "transitions"
    _sample_log(folder, kind, "csv", np.random.default_rng(0))
    log = {path.name: path.read_bytes() for path in folder.iterdir()}
    text = log.pop("episode_0000.csv").decode()
    header = read_header(folder)

    def make(rng: Random) -> bytes:
        """Returns damaged rows."""
        return either_way(text, damaged_csv, rng)

    def read(content: bytes) -> None:
        """Resumes a log that has such rows."""
        for path in folder.iterdir():
            path.unlink()
        (folder / "log.yaml").write_bytes(log["log.yaml"])
        unfinished_path(folder, 0).write_bytes(content)
        LogWriter(folder, header, "csv", resume=True)

    return Subject(make, read)


def _datagram(valid: list[bytes], decode: Callable[[bytes], object]) -> Subject:
    """Returns the subject of a codec: valid datagrams that are damaged, and noise."""

    def make(rng: Random) -> bytes:
        """Returns a damaged one."""
        good = valid[rng.integers(len(valid))]
        if rng.integers(4) == 0:
            return rng.bytes(int(rng.integers(2 * len(good))))
        return damaged(good, rng)

    return Subject(make, decode)


def _hex_sample() -> Subject:
    sample = codec.Sample(1, 2, 0, (1.0, -1.0, 0.5, 0.1, 0.2, -0.3))
    return _datagram([codec.encode_sample(sample)], codec.decode_sample)


def _hex_request() -> Subject:
    requests = [codec.BoxRequest(command, 1) for command in codec.BoxCommand]
    valid = [codec.encode_request(request) for request in requests]
    return _datagram(valid, codec.decode_request)


def _registers(decode: Callable[[Any], object]) -> Subject:
    odd = (-1, 0, 255, 65535, 65536, 10**30, 1.5, float("nan"), None, "1", True, [1])

    def make(rng: Random) -> list[Any]:
        """Returns a damaged one."""
        values: list[Any] = rng.integers(2**16, size=3).tolist()
        if rng.integers(2):
            values[rng.integers(3)] = odd[rng.integers(len(odd))]
        return values[: rng.integers(4)] if rng.integers(8) == 0 else values

    return Subject(make, decode)


def _iiwa() -> Subject:
    message = lcmt_iiwa_status()
    message.num_joints = 7
    for name in message.__slots__:
        if name.startswith("joint_"):
            setattr(message, name, [0.1 * i for i in range(7)])
    return _datagram([message.encode()], decode_iiwa_status)


#: By name: what makes each reader's or codec's subject.
SUBJECTS: Mapping[str, Callable[[], Subject]] = {
    "log_csv": partial(_log, "csv"),
    "log_parquet": partial(_log, "parquet"),
    "log_unfinished": _unfinished,
    "scenario": _scenario,
    "policy": _policy,
    "checkpoint": _checkpoint,
    "hardware": _hardware,
    "parameters": _parameters,
    "results": _results,
    **IMPORTERS,
    "hex_sample": _hex_sample,
    "hex_request": _hex_request,
    "robotiq_status": partial(_registers, registers.decode_status),
    "robotiq_command": partial(_registers, registers.decode_command),
    "iiwa_status": _iiwa,
}
