"""What is fuzzed of the import: each format, from the file to the log."""

import dataclasses
import io
import json
import shutil
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path

import numpy as np
import openpyxl
import pyarrow as pa  # type: ignore[import-untyped]
import pyarrow.parquet as pq  # type: ignore[import-untyped]
import yaml
from mutations import Random, damaged, damaged_csv, damaged_workbook, damaged_yaml
from scipy.io import savemat
from scipy.spatial.transform import Rotation
from subject import (
    Subject,
    archive_damage,
    blindly_or,
    either_way,
    file_subject,
    folder_subject,
    new_folder,
    parquet_damage,
    yaml_subject,
)

from drake_disasm.common.archive import Arrays
from drake_disasm.logs.importing import (
    FieldMap,
    ImportProcessing,
    Known,
    Source,
    guessed_map,
    import_recordings,
    map_to_fill_in,
    read_map,
    read_source,
    write_log,
)
from drake_disasm.logs.importing.description import described, summary
from drake_disasm.logs.importing.field_map import Column
from drake_disasm.logs.importing.joining import WAYS, joined
from drake_disasm.logs.importing.lerobot import calibrated
from drake_disasm.logs.importing.orientations import FORMS, JOINTS
from drake_disasm.logs.importing.presets import PRESETS
from drake_disasm.logs.importing.units import NORMALISED
from drake_disasm.stations.fake_cell.bag import FakeBag

_JOINTS = ("shoulder", "elbow")
_URDF = "package://disasm_models/iiwa14/iiwa14.urdf"
_TIME = np.arange(120) / 50.0  # s


def _motion() -> Arrays:
    """Returns the columns of a motion of two joints."""
    found = {"time": _TIME}
    for i, rate in enumerate((0.4, 0.9)):
        found[f"q_{i}"] = np.sin(2.0 * np.pi * rate * _TIME)
        found[f"tau_{i}"] = np.cos(2.0 * np.pi * rate * _TIME)
    return found


def _import(path: Path, kind: str = "joint_motion", known: Known | None = None) -> None:
    """Does all that the program does, with a guessed map."""
    source = read_source(path)
    if known and known.preset:
        source = known.preset.labelled(source)
    described(source, kind)
    map_to_fill_in(kind, source)
    fields = guessed_map(source, kind, known)
    described(source, kind, fields)
    if any(column.unit == NORMALISED for column in fields.columns.values()):
        fields = calibrated(fields, source, "degrees")
    _write(source, fields)


def _write(source: Source, fields: FieldMap) -> None:
    imported = import_recordings([source], fields, ImportProcessing())
    summary(imported)
    folder = new_folder()
    try:
        write_log(imported, [source], fields, folder, {"program": "fuzz"})
    finally:
        shutil.rmtree(folder)


def _csv() -> Subject:
    columns = _motion()
    rows = [",".join(columns), *_text(np.stack(list(columns.values()), axis=1))]

    def make(rng: Random) -> bytes:
        """Returns a damaged one."""
        return either_way("\n".join(rows) + "\n", damaged_csv, rng)

    return file_subject("r.csv", make, _import)


def _text(table: np.ndarray) -> list[str]:
    return [",".join(f"{value:.6g}" for value in row) for row in table]


def _ur() -> Subject:
    """A table without names, as RTDE records it, with late stamps."""
    random = np.random.default_rng(0)
    time = np.maximum.accumulate(_TIME + random.gamma(1.0, 0.004, len(_TIME)))
    q = np.stack([np.sin(k * _TIME) for k in range(1, 7)], axis=1)
    v = np.gradient(q, _TIME, axis=0)
    table = np.column_stack([time, q, v, q + np.sign(v), q + np.sign(v), 9.0 * q])
    text = "\n".join(_text(table)) + "\n"
    known = Known(preset=PRESETS["rtde"])
    return file_subject(
        "r.csv",
        lambda rng: either_way(text, damaged_csv, rng),
        partial(_import, known=known),
    )


def _join() -> Subject:
    """Positions in one file, torques in another, of which one is damaged."""
    folder, columns, whole = new_folder(), _motion(), dict[str, str]()
    for ending in ("q", "tau"):
        own = {n: c for n, c in columns.items() if n.startswith((ending, "time"))}
        rows = [",".join(own), *_text(np.stack(list(own.values()), axis=1))]
        whole[ending] = "\n".join(rows) + "\n"

    def make(rng: Random) -> dict[str, bytes]:
        """Returns both files, of which one is damaged."""
        damaged_one = ("q", "tau")[rng.integers(2)]
        content = {name: text.encode() for name, text in whole.items()}
        return content | {damaged_one: either_way(whole[damaged_one], damaged_csv, rng)}

    def read(content: dict[str, bytes]) -> None:
        """Imports both as one recording."""
        for name, data in content.items():
            (folder / f"{name}.csv").write_bytes(data)
        sources = [read_source(folder / f"{name}.csv") for name in ("q", "tau")]
        for way in WAYS:
            source = joined(sources, way, Known())
            _write(source, guessed_map(source, "joint_motion"))

    return Subject(make, read)


def _xlsx() -> Subject:
    columns, stream, book = _motion(), io.BytesIO(), openpyxl.Workbook()
    book.active.append(list(columns))
    for row in np.stack(list(columns.values()), axis=1):
        book.active.append(row.tolist())
    book.create_sheet("empty")
    book.save(stream)
    data = stream.getvalue()
    make = blindly_or(data, partial(damaged_workbook, data))
    return file_subject("r.xlsx", make, _import)


def _npz() -> Subject:
    columns, stream = _motion(), io.BytesIO()
    np.savez(stream, allow_pickle=False, **columns)
    make = archive_damage(stream.getvalue(), columns, {"note": "a"})
    return file_subject("r.npz", make, _import)


def _npy() -> Subject:
    columns, stream = _motion(), io.BytesIO()
    np.save(stream, np.rec.fromarrays(list(columns.values()), names=list(columns)))
    return file_subject("r.npy", partial(damaged, stream.getvalue()), _import)


def _mat() -> Subject:
    columns, stream = _motion(), io.BytesIO()
    savemat(stream, {"run": columns, "gain": 2.0}, do_compression=True)
    plain = io.BytesIO()
    savemat(plain, columns)
    make = blindly_or(stream.getvalue(), partial(damaged, plain.getvalue()))
    return file_subject("r.mat", make, _import)


def _parquet() -> Subject:
    columns, stream = _motion(), io.BytesIO()
    pq.write_table(pa.table(columns), stream)
    return file_subject(
        "r.parquet", parquet_damage(stream.getvalue(), columns), _import
    )


def _lerobot() -> Subject:
    """A dataset of one file, whose positions and commands are lists."""
    folder, columns, stream = new_folder(), _motion(), io.BytesIO()
    q = np.stack([columns["q_0"], columns["q_1"]], axis=1)
    table = {
        "observation.state": q.tolist(),
        "action": (q + 0.01).tolist(),
        "timestamp": columns["time"],
        "episode_index": np.zeros(len(q), dtype=np.int64),
    }
    pq.write_table(pa.table(table), stream)
    flat = {"timestamp": columns["time"], "episode_index": table["episode_index"]}
    for name in ("meta", "data"):
        (folder / name).mkdir()
    names = {"names": ["shoulder.pos", "elbow.pos"]}
    features = {"features": dict.fromkeys(("action", "observation.state"), names)}
    info = json.dumps(features, indent=1)
    path = folder / "data/episode_000000.parquet"

    def read(content: tuple[bytes, bytes]) -> None:
        """Imports what an arm was told and did."""
        meta, data = content
        (folder / "meta/info.json").write_bytes(meta)
        path.write_bytes(data)
        _import(folder, "joint_response")

    damage = parquet_damage(stream.getvalue(), flat)

    def make(rng: Random) -> tuple[bytes, bytes]:
        """Returns metadata and a table, of which one is damaged."""
        if rng.integers(2):
            return either_way(info, damaged_yaml, rng), stream.getvalue()
        return info.encode(), damage(rng)

    return Subject(make, read)


def _calibration() -> Subject:
    """LeRobot's file of its motors' ranges."""
    folder = new_folder()
    columns = {"time": _TIME, "q.0": _TIME, "q.1": 2.0 * _TIME}
    np.savez(folder / "r.npz", allow_pickle=False, **columns)
    source = read_source(folder / "r.npz")
    q = Column(("q.0", "q.1"), NORMALISED)
    fields = FieldMap("joint_motion", {"q": q}, "time", joints=_JOINTS)
    motor = {"id": 1, "range_min": 800, "range_max": 3000}
    text = json.dumps({"0": motor, "1": motor}, indent=1)

    def make(rng: Random) -> bytes:
        """Returns a damaged one."""
        return either_way(text, damaged_yaml, rng)

    def read(path: Path) -> None:
        """Imports with it."""
        _write(source, calibrated(fields, source, str(path)))

    return file_subject("c.json", make, read)


def _bag(mcap: bool = True) -> Path:
    """Returns the folder of a bag of the motion with a wrench."""
    bag, folder = FakeBag(), new_folder() / "bag"
    columns = _motion()
    q, tau = (
        np.stack([columns[f"{name}_{i}"] for i in (0, 1)], axis=1)
        for name in ("q", "tau")
    )
    for i, time in enumerate(_TIME):
        bag.add_joint_state(time, _JOINTS, q[i], tau[i])
        bag.add_wrench(time + 0.003, np.concatenate([q[i], tau[i], q[i]]))
    bag.write(folder, mcap)
    return folder


def _mcap() -> Subject:
    data = next(_bag().glob("*.mcap")).read_bytes()
    return file_subject("r.mcap", partial(damaged, data), _import)


def _ros2() -> Subject:
    """A folder of SQLite's file and its description."""
    folder = _bag(mcap=False)
    return folder_subject(folder, partial(_import, folder))


def _ros1() -> Subject:
    """The same bag as ROS 1 has it."""
    from rosbags.convert import convert
    from rosbags.typesys import Stores, get_typestore

    path, stores = new_folder() / "r.bag", (Stores.LATEST, Stores.ROS1_NOETIC)
    types = [get_typestore(store) for store in stores]
    convert([_bag()], path, "", 0, None, "", *types, (), (), (), ())
    return file_subject("r.bag", partial(damaged, path.read_bytes()), _import)


def _map() -> Subject:
    path = new_folder() / "r.npz"
    np.savez(path, allow_pickle=False, **_motion())
    source = read_source(path)
    guess = guessed_map(source, "joint_motion")
    rated = dataclasses.replace(guess, time=None, rate=50.0)
    texts = [guess.to_yaml(), rated.to_yaml()]
    return yaml_subject("m.yaml", texts, lambda m: _write(source, read_map(m)))


def _orientations() -> Subject:
    """Maps of readings at rest, whose orientation is given in each form."""
    folder, wrench = new_folder(), [f"w.{i}" for i in range(6)]
    q = np.stack([np.sin(_TIME), np.cos(2.0 * _TIME), 0.1 * _TIME], axis=1)
    turns = Rotation.from_rotvec(q)
    arrays = {
        "rotation_vector": q,
        "roll_pitch_yaw": turns.as_euler("xyz"),
        "quaternion_xyzw": turns.as_quat(),
        "matrix": turns.as_matrix().reshape(-1, 9),
        "joints": q[:, :2],
    }
    w = np.ones((len(_TIME), 6))
    np.savez(folder / "r.npz", allow_pickle=False, t=_TIME, w=w, **arrays)
    arm = {"joints": ["iiwa_joint_1", "iiwa_joint_2"], "urdf": _URDF}
    texts = []
    for form, values in arrays.items():
        channels = [f"{form}.{i}" for i in range(values.shape[1])]
        column = {"from": channels, "as": form}
        column |= {"unit": "rad"} if FORMS[form].has_angles else {}
        column |= {"frame": "iiwa_link_7"} if form == JOINTS else {}
        fields = {"kind": "static_wrench", "time": {"from": "t"}}
        fields |= arm if form == JOINTS else {}
        columns = {"R_WS": column, "wrench": {"from": wrench}}
        fields |= {"frames": {"wrench": "S"}, "columns": columns}
        texts.append(yaml.safe_dump(fields, sort_keys=False))
    source = read_source(folder / "r.npz")
    return yaml_subject("m.yaml", texts, lambda m: _write(source, read_map(m)))


#: By name: what makes each format's subject.
IMPORTERS: Mapping[str, Callable[[], Subject]] = {
    "import_csv": _csv,
    "import_ur": _ur,
    "import_join": _join,
    "import_calibration": _calibration,
    "import_xlsx": _xlsx,
    "import_npz": _npz,
    "import_npy": _npy,
    "import_mat": _mat,
    "import_parquet": _parquet,
    "import_lerobot": _lerobot,
    "import_mcap": _mcap,
    "import_ros2": _ros2,
    "import_ros1": _ros1,
    "import_map": _map,
    "import_orientations": _orientations,
}
