"""Real recordings of ../shared/data as cases: whole, and in halves by time."""

import dataclasses
import json
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import real_data
import servo_friction
from numpy.typing import NDArray
from real_data import data_folder

from drake_disasm.common.files import write_text
from drake_disasm.logs import Log, LogHeader, LogWriter, read_log
from drake_disasm.logs.importing import (
    FieldMap,
    ImportProcessing,
    import_recordings,
    read_map,
    read_source,
    write_log,
)
from drake_disasm.logs.importing.field_map import Column
from selection.answer import Case

#: Nm/A, the first set that the authors state.
_UR10E_CONSTANTS = (14.87, 13.26, 11.13, 10.62, 11.03, 11.47)
_UR10E_JOINTS = (
    "shoulder_pan",
    "shoulder_lift",
    "elbow",
    "wrist_1",
    "wrist_2",
    "wrist_3",
)
_ROKAE_CUTOFF = 6.0  # Hz, as the recording's README has it
_SERVO_FITTED = tuple(
    f"{motion}_kp{gain}"
    for motion in ("sin_sin", "lift_and_drop")
    for gain in (100, 200)
)
_SERVO_HELD_OUT = ("sin_time_square_kp100", "up_and_down_kp200")


@dataclasses.dataclass(frozen=True)
class Recorded:
    """A real recording.

    Attributes:
        write: writes its logs into a folder and returns their folders.
        held_out: name of another recording of the same device, or "".
    """

    write: Callable[[Path], tuple[Path, ...]]
    held_out: str = ""


def _ft_static(folder: Path) -> tuple[Path, ...]:
    return (real_data.write_static(100, folder / "log"),)


def _lwr4(number: int) -> Callable[[Path], tuple[Path, ...]]:
    def _write(folder: Path) -> tuple[Path, ...]:
        urdf = real_data.write_arm(folder / "lwr4.urdf")
        return (real_data.write_motion(number, folder / "log", urdf),)

    return _write


def _emps(number: int) -> Callable[[Path], tuple[Path, ...]]:
    def _write(folder: Path) -> tuple[Path, ...]:
        urdf = real_data.write_slide(folder / "emps.urdf")
        return (real_data.write_emps(number, folder / "log", urdf),)

    return _write


def _rack_pinion(folder: Path) -> tuple[Path, ...]:
    log = read_log(data_folder("rack_pinion"))
    with LogWriter(folder / "log", _lasting(log)) as writer:
        for episode in log.episodes:
            writer.write_episode(dict(episode.columns))
    return (folder / "log",)


def _ur10e(name: str) -> Callable[[Path], tuple[Path, ...]]:
    def _write(folder: Path) -> tuple[Path, ...]:
        source = data_folder("ur10e")
        fields = FieldMap(
            "joint_motion",
            {
                "q": Column(tuple(f"column_{i}" for i in range(1, 7))),
                "tau": Column(
                    tuple(f"column_{i}" for i in range(13, 19)),
                    scales=_UR10E_CONSTANTS,
                ),
            },
            time="column_0",
            urdf=str(source / "ur10e.urdf"),
            joints=tuple(f"{joint}_joint" for joint in _UR10E_JOINTS),
        )
        return (_imported(source / f"{name}.csv", fields, folder, None),)

    return _write


def _rokae(folder: Path) -> tuple[Path, ...]:
    source = data_folder("cases") / "delay_or_presliding"
    fields = read_map(source / "map.yaml")
    fields = dataclasses.replace(fields, urdf=str(source / "rokae7.urdf"))
    return (_imported(source / "run.csv", fields, folder, _ROKAE_CUTOFF),)


def _contact(folder: Path) -> tuple[Path, ...]:
    source = data_folder("cases") / "contact_as_static"
    return (_imported(source / "run.csv", read_map(source / "map.yaml"), folder, None),)


def _servo(names: tuple[str, ...]) -> Callable[[Path], tuple[Path, ...]]:
    def _write(folder: Path) -> tuple[Path, ...]:
        servo_friction.written_logs(data_folder("servo_pendulum"), folder)
        return tuple(folder / name for name in names)

    return _write


def _imported(path: Path, fields: FieldMap, folder: Path, cutoff: float | None) -> Path:
    sources = [read_source(path)]
    imported = import_recordings(sources, fields, ImportProcessing(cutoff))
    write_log(imported, sources, fields, folder / "log", {"source": str(path)})
    return folder / "log"


#: All recordings, by name.
RECORDED = {
    "rack_pinion": Recorded(_rack_pinion),
    "ft_static": Recorded(_ft_static),
    "emps_fit": Recorded(_emps(1), "emps_pulses"),
    "emps_pulses": Recorded(_emps(2), "emps_fit"),
    "lwr4_1": Recorded(_lwr4(1), "lwr4_2"),
    "lwr4_2": Recorded(_lwr4(2), "lwr4_1"),
    "ur10e_unloaded": Recorded(_ur10e("unloaded")),
    "ur10e_loaded": Recorded(_ur10e("loaded")),
    "rokae": Recorded(_rokae),
    "contact": Recorded(_contact),
}
#: The same of those that are simulated to be predicted, which takes long.
SLOW = {
    "servo": Recorded(_servo(_SERVO_FITTED), "servo_others"),
    "servo_others": Recorded(_servo(_SERVO_HELD_OUT), "servo"),
}


def write_whole(name: str, folder: Path, cache: Path) -> Case:
    """Writes a recording as a case.

    Args:
        name: of RECORDED or SLOW.
        folder: of the case.
        cache: folder of logs that cases share.
    """
    recorded = _known(name)
    logs = _shared(name, cache)
    held_out = _shared(recorded.held_out, cache) if recorded.held_out else ()
    folder.mkdir(parents=True, exist_ok=True)
    return Case(
        f"real/{name}/whole", _texts(logs), "real whole", held_out=_texts(held_out)
    )


def write_half(name: str, half: str, folder: Path, cache: Path) -> Case:
    """Writes a half of a recording as a case; the other half is held out.

    Args:
        name: of RECORDED or SLOW.
        half: "first" or "second".
        folder: of the case.
        cache: folder of logs that cases share.
    """
    logs = [read_log(path) for path in _shared(name, cache)]
    other = {"first": "second", "second": "first"}[half]
    parts = {
        which: _half_of(logs, which == "first", folder / which)
        for which in ("first", "second")
    }
    return Case(
        f"real/{name}/{half}",
        _texts(parts[half]),
        "real half",
        held_out=_texts(parts[other]),
        partner=f"real/{name}/{other}",
    )


def _half_of(logs: list[Log], is_first: bool, folder: Path) -> tuple[Path, ...]:
    """Writes a half of the time of each log; returns their folders."""
    written = []
    for log in logs:
        columns = [dict(e.columns) for e in log.episodes]
        clocks = [c["time"] if "time" in c else c["order"] for c in columns]
        ends = np.cumsum([clock[-1] - clock[0] for clock in clocks])
        path = folder / log.folder.name
        with LogWriter(path, _lasting(log)) as writer:
            for own, clock, end in zip(columns, clocks, ends, strict=True):
                at = end - (clock[-1] - clock)
                rows = (at <= ends[-1] / 2.0) == is_first
                if rows.sum() > 1:
                    writer.write_episode(_of_rows(own, rows))
        written.append(path)
    return tuple(written)


def _lasting(log: Log) -> LogHeader:
    """Returns a log's header, its URDF named so that any folder finds it."""
    urdf = log.header.urdf
    if urdf and not Path(urdf).is_absolute():
        return dataclasses.replace(log.header, urdf=str((log.folder / urdf).resolve()))
    return log.header


def _of_rows(
    columns: dict[str, NDArray[np.float64]], rows: NDArray[np.bool_]
) -> dict[str, NDArray[np.float64]]:
    """Returns some rows of columns, their clock from its first row on."""
    kept = {name: values[rows] for name, values in columns.items()}
    for clock in ("time", "order"):
        if clock in kept:
            kept[clock] = kept[clock] - kept[clock][0]
    return kept


def _shared(name: str, cache: Path) -> tuple[Path, ...]:
    """Returns the logs of a recording; they are written if they are not there."""
    done = cache / "recordings" / name / "logs.json"
    if not done.exists():
        shutil.rmtree(done.parent, ignore_errors=True)
        done.parent.mkdir(parents=True)
        logs = _known(name).write(done.parent)
        write_text(done, json.dumps(_texts(logs)))
    return tuple(Path(path) for path in json.loads(done.read_text()))


def _known(name: str) -> Recorded:
    return (RECORDED | SLOW)[name]


def _texts(paths: tuple[Path, ...]) -> tuple[str, ...]:
    return tuple(str(path) for path in paths)
