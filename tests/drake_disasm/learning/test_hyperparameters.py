"""The presets are the thesis's tables, and changes to them are checked."""

import pytest

from drake_disasm.common.errors import DisasmError
from drake_disasm.learning.hyperparameters import (
    ALGORITHMS,
    PRESETS,
    override,
    preset,
)

TABLES = {
    "chapter3": ([50, 50], 1e-3, 30, 0.9, 0.003, 0.995, 100_000, 200, "delayed"),
    "chapter4": ([128] * 3, 5e-4, 2000, 0.9, 0.005, 0.95, 100_000, 150, "delayed"),
    "chapter5": ([128] * 2, 5e-3, 100, 0.5, 0.003, 0.95, 10_000, 100, "every_step"),
}


@pytest.mark.parametrize("name", TABLES)
def test_presets_are_the_tables(name: str) -> None:
    config = preset(name, "ddpg")
    assert TABLES[name] == (
        config.hidden,
        config.actor_rate,
        config.batch,
        config.tau,
        config.exploration,
        config.exploration_decay,
        config.replay,
        config.episodes,
        config.schedule,
    )
    assert (config.gamma, config.adam_epsilon) == (0.9, 1e-7)
    assert config.critic_rate == config.actor_rate
    assert not config.layer_norm and config.critics == 1 and config.base == ""


@pytest.mark.parametrize("name", PRESETS)
@pytest.mark.parametrize("algorithm", ALGORITHMS)
def test_every_preset_has_every_algorithm(name: str, algorithm: str) -> None:
    assert preset(name, algorithm).algorithm == algorithm


def test_td3_and_sac_have_their_own_parameters() -> None:
    td3, sac = preset("chapter3", "td3"), preset("chapter3", "sac")
    assert (td3.policy_delay, td3.target_noise, td3.target_noise_limit) == (
        2,
        0.01,
        0.01,
    )
    assert (td3.critics, sac.critics, sac.entropy) == (2, 2, 0.2)


def test_best_has_its_own_algorithm() -> None:
    assert preset("best").algorithm == "sac" and preset("chapter3").algorithm == "ddpg"


def test_overrides_are_read_as_the_kind_that_they_change() -> None:
    config = override(
        preset("chapter3"),
        ["hidden=[16, 8]", "tau=1e-2", "layer_norm=true", "batch=7", "base=admittance"],
    )
    assert (config.hidden, config.tau, config.batch) == ([16, 8], 0.01, 7)
    assert config.layer_norm and config.base == "admittance"
    assert override(config, ["base="]).base == ""


@pytest.mark.parametrize(
    ("pair", "message"),
    [
        ("gama=0.9", "did you mean 'gamma'"),
        ("gamma", "write it as key=value"),
        ("gamma=high", "is no float"),
        ("gamma=1.5", "gamma: 1.5 is out of range"),
        ("gamma=.nan", "gamma: nan"),
        ("batch=2.5", "is no int"),
        ("layer_norm=1", "is no bool"),
        ("hidden=[]", "at least one width"),
        ("hidden=[a]", "is no int"),
        (f"hidden=[{10**400}]", "is out of range; give a value from 1 to 10000"),
        (f"hidden=[{'9, ' * 50}]", "50 widths; give at least one width, and 20"),
        ("gamma=2020-13-45", "hyper-parameter 'gamma': not YAML"),
        (f"gamma={'[' * 5000}", "nested deeper than 40"),
        ("hidden=50", "is no list"),
        ("residual=[1, 1]", "2 values given, 6 needed"),
        ("schedule=sometimes", "use one of"),
        ("algorithm=ppo", "use one of"),
    ],
)
def test_bad_changes_are_named(pair: str, message: str) -> None:
    with pytest.raises(DisasmError) as caught:
        override(preset("chapter3"), [pair])
    assert message in str(caught.value) and "\n" not in str(caught.value)


def test_unknown_presets_and_agents_are_named() -> None:
    with pytest.raises(DisasmError, match="did you mean 'chapter3'"):
        preset("chapter_3")
    with pytest.raises(DisasmError, match="agent 'ppo' does not exist"):
        preset("chapter3", "ppo")
