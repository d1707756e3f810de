"""What the programs share: subcommands, numbers, policies, hidden effects, signals."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from drake_disasm_cli import common, main

from drake_disasm.common import drake_warnings
from drake_disasm.logs import read_log
from drake_disasm.scenario import load_scenario, scenario_from_mapping
from tests.progress import default_signals
from tests.refusals import refused
from tests.tools.programs import ROOT, assert_one_line, run_program

_SWALLOWS = """
import signal
from drake_disasm.common import program, stopping

def main(arguments):
    try:
        signal.raise_signal(signal.SIGINT)
    except KeyboardInterrupt:
        pass  # as a library's callback does
    stopping.stop_if_interrupted()
    return 0

program.run(main)
"""


def _ignore_interrupts() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)


@pytest.mark.parametrize(
    ("prepare", "status"), [(default_signals, 130), (_ignore_interrupts, 0)]
)
def test_a_swallowed_interrupt_stops_a_run_that_is_not_in_the_background(
    prepare, status: int
) -> None:
    """A shell starts `simulate &` with SIGINT ignored; so it must stay."""
    command = [sys.executable, "-c", _SWALLOWS]
    done = subprocess.run(command, capture_output=True, text=True, preexec_fn=prepare)
    assert done.returncode == status
    assert ("interrupted" in done.stderr) == bool(status)


def test_every_subcommand_is_listed_and_has_a_thin_program(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main.main(["--help"]) == 0
    overview = capsys.readouterr().out
    for name in main.SUBCOMMANDS:
        assert f"  {name} " in overview
        assert (ROOT / f"tools/{name.replace('-', '_')}.py").is_file()
    with refused("close-lop", "close-loop"):
        main.main(["close-lop"])
    program = [sys.executable, ROOT / "tools/close_loop.py", "--no-such"]
    done = subprocess.run(program, capture_output=True, text=True)
    assert_one_line(done, ["--log"])


def test_a_missing_system_library_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(_: str) -> None:
        raise ImportError("libSM.so.6: cannot open shared object file: No such file")

    monkeypatch.setattr(main.importlib, "import_module", fails)
    monkeypatch.setattr(main, "complaint", lambda: "Drake needs libSM.so.6")
    with pytest.raises(main.DisasmError, match=r"libSM.so.6"):
        main.main_of("simulate")
    monkeypatch.setattr(main, "complaint", lambda: "")
    with pytest.raises(ImportError):
        main.main_of("simulate")


#: A program, what it needs, and numbers that it refuses, one of each kind.
_NUMBERS = [
    ("simulate", (), "--episodes=0"),
    ("identify", ("--log", "nowhere", "--out", "nowhere"), "--huber=0"),
    ("excite", ("--urdf", "x", "--out", "nowhere"), "--margin=2"),
]


@pytest.mark.parametrize(("name", "needed", "option"), _NUMBERS)
def test_a_number_that_cannot_be_is_one_line(
    name: str, needed: tuple[str, ...], option: str
) -> None:
    done = run_program(name, *needed, option)
    option, _, value = option.partition("=")
    assert_one_line(done, [f"argument {option}", f"'{value}' is not a"])


def test_a_library_s_argument_is_an_option_in_messages(tmp_path: Path) -> None:
    done = run_program("simulate", "--set", "part.clearence=1")
    assert_one_line(done, ["--set part.clearence", "'clearance'"])
    done = run_program("evaluate", "--policy", "straight", "--sweep", "imprecision=7")
    assert_one_line(done, ["imprecision"])


def test_warnings_of_drake_are_counted_and_shown_if_asked_for(tmp_path: Path) -> None:
    arm = (ROOT / "models/iiwa14/iiwa14.urdf").read_text()
    urdf = tmp_path / "arm.urdf"
    extra = '<transmission name="odd"><type>Odd</type></transmission></robot>'
    urdf.write_text(arm.replace("</robot>", extra))
    words = ["excite", "--urdf", urdf, "--out", tmp_path / "x", "--joints", "elbow"]
    command = [sys.executable, "-m", "drake_disasm_cli", *map(str, words)]
    quiet = subprocess.run(command, capture_output=True, text=True)
    assert "1 warning about models" in quiet.stderr and "Odd" not in quiet.stderr
    loud = subprocess.run([*command, "--verbose"], capture_output=True, text=True)
    assert "transmission" in loud.stderr and "--verbose" not in loud.stderr
    assert not drake_warnings.are_kept_back()


class TestHiddenEffects:
    """--hidden adds effects to what is simulated, and not to what is stated."""

    RUN = ("simulate", "--station=twin", "--no-meshcat", "--set", "task.steps=3")

    def test_they_act_and_are_not_in_the_log(self, tmp_path: Path) -> None:
        (tmp_path / "mine.yaml").write_text(
            "task: {steps: 150}  # as in removal\neffects: [!SensorBias {fx: 9.0}]\n"
        )
        for name, more in (("plain", ()), ("biased", ("--hidden", "mine.yaml"))):
            run = (*self.RUN, "--policy=straight", "--record", name, *more)
            assert run_program(*run, cwd=tmp_path).returncode == 0
        plain, biased = (read_log(tmp_path / name) for name in ("plain", "biased"))
        stated = scenario_from_mapping(dict(biased.header.scenario or {}))
        assert stated == load_scenario("removal", ["task.steps=3"])
        assert [len(log.episodes[0]["time"]) for log in (plain, biased)] == [4, 4]
        assert biased.header.provenance["hidden"]
        assert plain.data_hash != biased.data_hash

    @pytest.mark.parametrize(
        ("text", "words"),
        [
            ("lock: {clearance: 0.0003}\neffects: [!SensorBias {}]", ["part", "--set"]),
            ("effects: [!SensorBais {}]", ["SensorBias"]),
        ],
    )
    def test_anything_else_is_refused(
        self, tmp_path: Path, text: str, words: list[str]
    ) -> None:
        (tmp_path / "mine.yaml").write_text(text)
        done = run_program(*self.RUN, "--hidden", "mine.yaml", cwd=tmp_path)
        assert_one_line(done, ["mine.yaml", *words])


def test_ctrl_d_closes_the_page_as_enter_does(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def ends(_: str) -> str:
        raise EOFError

    monkeypatch.setattr("builtins.input", ends)
    common.wait_for_enter("press Enter ")
    assert capsys.readouterr().out == "\n"


_WAITS = """
import ctypes, sys
from drake_disasm.common import program, stopping
stopping._WORKERS_PATIENCE, stopping._PATIENCE = 0.05, 0.1

def main(arguments):
    print("begun", flush=True)
    ctypes.CDLL(None).sleep(60)  # a library that knows nothing of Python's handlers
    return 0

program.run(main)
"""


def test_sigterm_ends_a_program_that_waits_for_a_library() -> None:
    process = subprocess.Popen(
        [sys.executable, "-c", _WAITS],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=default_signals,
        env=os.environ,
    )
    assert process.stdout and process.stdout.readline() == "begun\n"
    process.send_signal(signal.SIGTERM)
    _, errors = process.communicate()
    assert process.returncode == 143
    assert errors == "terminated; what was finished is kept\n"


def test_a_policy_that_is_none_is_one_line() -> None:
    done = run_program("simulate", "--no-meshcat", "--policy", "no_such:x")
    assert_one_line(done, ["no_such"])
