"""Every program refuses numbers that can't be, in one line that names the option."""

import pytest

from tests.tools.programs import run_program

LOG = ("--log", "nowhere", "--out", "nowhere")
#: Program, the options that it needs, and options of numbers with what is refused.
PROGRAMS: list[tuple[str, tuple[str, ...], list[str]]] = [
    (
        "simulate",
        ("--no-meshcat",),
        [
            *("--seed=-1", "--seed=x", "--episodes=0", "--explore=nan"),
            *("--explore=-1", "--realtime-rate=nan", "--realtime-rate=-1"),
        ],
    ),
    (
        "evaluate",
        ("--policy", "straight"),
        ["--seed=-1", "--psi=nan", "--psi=-1", "--episodes=0", "--workers=0"],
    ),
    ("fake_cell", (), ["--seed=-1", "--seed=1.5"]),
    (
        "train",
        ("--out", "nowhere"),
        [
            *("--episodes=-1", "--psi=inf", "--first-seed=-1", "--seeds=0"),
            *("--updates=0", "--validation=0", "--threads=0", "--workers=-1"),
        ],
    ),
    (
        "identify",
        LOG,
        ["--seed=-1", "--huber=nan", "--huber=0", "--cycles=0", "--budget=0"],
    ),
    ("endurance", (), ["--minutes=nan", "--minutes=0", "--minutes=-1"]),
    ("disturbed", (), ["--minutes=inf", "--seed=-1"]),
    ("stalls", (), ["--repeats=0", "--stalls=nan", "--stalls=-1"]),
    ("fuzz", (), ["--files=0", "--datagrams=x", "--seed=-1", "--case=-1"]),
    ("close_loop", LOG, ["--huber=nan", "--huber=-1", "--workers=0"]),
    (
        "study",
        ("twin_transfer", "--out", "nowhere"),
        [
            *("--seeds=0", "--first-seed=-1", "--episodes=0", "--validation=0"),
            *("--robot-episodes=-1", "--workers=0"),
        ],
    ),
    ("benchmark", (), ["--seeds=-1", "--nulls=-1", "--pairs=x"]),
]
CASES = [(p, needed, option) for p, needed, options in PROGRAMS for option in options]


@pytest.mark.parametrize(("name", "needed", "option"), CASES)
def test_number_is_refused(name: str, needed: tuple[str, ...], option: str) -> None:
    done = run_program(name, *needed, option)
    assert done.returncode == 2 and not done.stdout
    option, _, value = option.partition("=")
    assert done.stderr.startswith(f"error: argument {option}: '{value}' is not a ")
    assert len(done.stderr.splitlines()) == 1


@pytest.mark.parametrize(
    "policy", [":x", "x:", ":", "a/b:c", ".:x", "no_such:x", "a b:c"]
)
def test_policy_that_is_no_name_is_one_line(policy: str) -> None:
    done = run_program("simulate", "--no-meshcat", "--policy", policy)
    assert done.returncode == 2
    assert done.stderr.startswith(f"error: policy {policy}: ")
    assert len(done.stderr.splitlines()) == 1


def test_unknown_option_is_one_line() -> None:
    done = run_program("simulate", "--sede", "1")
    assert done.returncode == 2
    assert done.stderr == ("error: unrecognized arguments: --sede 1; see --help\n")
