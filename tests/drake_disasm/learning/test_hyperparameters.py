"""The presets are the thesis's tables, and changes to them are checked."""

import itertools

import pytest

from drake_disasm.learning.hyperparameters import ALGORITHMS, PRESETS, override, preset
from tests.refusals import refused

TABLES = {
    "chapter3": ([50, 50], 1e-3, 30, 0.9, 0.003, 0.995, 100_000, 200, "delayed"),
    "chapter4": ([128] * 3, 5e-4, 2000, 0.9, 0.005, 0.95, 100_000, 150, "delayed"),
    "chapter5": ([128] * 2, 5e-3, 100, 0.5, 0.003, 0.95, 10_000, 100, "every_step"),
}


@pytest.mark.parametrize("name", TABLES)
def test_presets_are_the_tables(name: str) -> None:
    config = preset(name, "ddpg")
    keys = "hidden actor_rate batch tau exploration exploration_decay replay"
    keys = [*keys.split(), "episodes", "schedule"]
    assert TABLES[name] == tuple(getattr(config, key) for key in keys)
    assert (config.gamma, config.adam_epsilon) == (0.9, 1e-7)
    assert config.critic_rate == config.actor_rate
    assert not config.layer_norm and config.critics == 1 and config.base == ""


def test_every_preset_has_every_algorithm_and_one_of_its_own() -> None:
    for name, algorithm in itertools.product(PRESETS, ALGORITHMS):
        assert preset(name, algorithm).algorithm == algorithm
    assert preset("best").algorithm == "sac" and preset("chapter3").algorithm == "ddpg"
    td3, sac = preset("chapter3", "td3"), preset("chapter3", "sac")
    assert (td3.policy_delay, td3.target_noise) == (2, 0.01)
    assert td3.target_noise_limit == 0.01
    assert (td3.critics, sac.critics, sac.entropy) == (2, 2, 0.2)


def test_overrides_are_read_as_the_kind_that_they_change() -> None:
    config = override(
        preset("chapter3"),
        ["hidden=[16, 8]", "tau=1e-2", "layer_norm=true", "batch=7", "base=admittance"],
    )
    assert (config.hidden, config.tau, config.batch) == ([16, 8], 0.01, 7)
    assert config.layer_norm and config.base == "admittance"
    assert override(config, ["base="]).base == ""


@pytest.mark.parametrize(("pair", "message"), [
    ("gama=0.9", "did you mean 'gamma'"),
    ("gamma", "key=value"),
    ("gamma=high", "is no float"),
    ("gamma=1.5", "gamma: 1.5 is out of range"),
    ("gamma=.nan", "gamma: nan"),
    ("batch=2.5", "is no int"),
    ("layer_norm=1", "is no bool"),
    ("hidden=[]", "at least one width"),
    ("hidden=[a]", "is no int"),
    (f"hidden=[{10**400}]", "from 1 to 10000"),
    (f"hidden=[{'9, ' * 50}]", "50 widths"),
    ("gamma=2020-13-45", "'gamma': not YAML"),
    ("hidden=50", "is no list"),
    ("residual=[1, 1]", "6 needed"),
    ("schedule=sometimes", "use one of"),
])  # fmt: skip
def test_bad_changes_are_named(pair: str, message: str) -> None:
    with refused(message):
        override(preset("chapter3"), [pair])


def test_unknown_presets_and_agents_are_named() -> None:
    with refused("did you mean 'chapter3'"):
        preset("chapter_3")
    with refused("agent 'ppo'"):
        preset("chapter3", "ppo")
