"""A user's own policies by name, and what is no policy."""

from pathlib import Path

import numpy as np
import pytest
from pydrake.systems.framework import LeafSystem

from drake_disasm.common.errors import DisasmError
from drake_disasm.policies import Exploring, Straight, resolve_policy
from drake_disasm.scenario import Scenario, load_scenario
from drake_disasm.task.episode import run_episode
from drake_disasm.task.simulation import TaskSimulation

_FILE = '''
import numpy as np
from pydrake.systems.framework import LeafSystem

class Ports(LeafSystem):
    def __init__(self, observation=12, action=6):
        super().__init__()
        self.DeclareVectorInputPort("observation", observation)
        self.DeclareVectorOutputPort("action", action, self.calc)
    def calc(self, context, output):
        output.SetFromVector(push(self.get_input_port().Eval(context)))

class Wide(Ports):
    def __init__(self):
        super().__init__(action=7)

class NoPorts(LeafSystem):
    pass

class Counting:
    """Pushes, and counts the episodes."""
    episodes = 0
    def reset(self):
        self.episodes += 1
    def __call__(self, observation):
        return push(observation)

class NeedsGain:
    def __init__(self, gain):
        self.gain = gain
    def __call__(self, observation):
        return np.zeros(6)

class Fails:
    def __init__(self):
        raise RuntimeError("no weights\\nhere")

class NoPolicy:
    pass

def push(observation):
    return np.array([5e-4, 0, 0, 0, 0, 0])

def no_argument():
    return np.zeros(6)

made = NeedsGain(2.0)
number = 3
'''


@pytest.fixture
def scenario() -> Scenario:
    return load_scenario("removal", ["task.steps=3", "contact.model=impact"])


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / f"own_{abs(hash(tmp_path))}.py"
    path.write_text(_FILE)
    return path


def test_a_class_of_a_file_acts_and_is_told_of_episodes(scenario, file):
    policy = resolve_policy(f"{file}:Counting", scenario)
    simulation = TaskSimulation(scenario, "twin", policy)
    for seed in range(2):
        run_episode(simulation, seed)
    assert policy.episodes == 2
    assert simulation.observation()[0] == pytest.approx(1.5e-3, abs=1e-4)


def test_a_leaf_system_acts_as_its_callable_does(scenario, file):
    ends = []
    for name in ("Ports", "push"):
        policy = resolve_policy(f"{file}:{name}", scenario)
        simulation = TaskSimulation(scenario, "twin", policy)
        for seed in (0, 1):  # the diagram's Context is reset between them
            run_episode(simulation, seed)
        ends.append(simulation.observation())
    np.testing.assert_array_equal(*ends)


def test_a_system_class_acts_in_every_diagram(file: Path) -> None:
    """A clearance that is drawn anew needs a diagram anew."""
    scenario = load_scenario("removal_randomised", ["task.steps=2"])
    policy = resolve_policy(f"{file}:Ports", scenario)
    assert issubclass(policy, LeafSystem)
    with pytest.raises(DisasmError, match=r"Ports: is a System.*`explore`"):
        Exploring(policy, 1e-4, 0)
    simulation = TaskSimulation(scenario, "twin", policy)
    first = simulation.diagram
    for seed in (0, 1):
        run_episode(simulation, seed)
    assert simulation.diagram is not first
    assert simulation.observation()[0] == pytest.approx(1e-3, abs=5e-4)


def test_objects_functions_and_modules_may_be_named(scenario, file, monkeypatch):
    assert resolve_policy(f"{file}:made", scenario).gain == 2.0
    assert resolve_policy("numpy:zeros", scenario) is np.zeros
    assert resolve_policy("drake_disasm.policies:Straight", scenario) == Straight()
    monkeypatch.chdir(file.parent)
    assert resolve_policy(f"{file.name}:push", scenario).__name__ == "push"


@pytest.mark.parametrize(("name", "words"), [
    ("FILE:Count", "has no Count; did you mean 'Counting'?"),
    ("FILE:", "is no module and a name in it; give an .npz file"),
    ("FILE:NeedsGain", "NeedsGain needs arguments; give them defaults"),
    ("FILE:Fails", r"Fails\(\) fails \(RuntimeError: no weights here\)"),
    ("FILE:NoPolicy", "is a NoPolicy and no policy; give a callable"),
    ("FILE:number", "is a int and no policy"),
    ("FILE:no_argument", "takes other arguments than one observation"),
    ("FILE:NoPorts", "NoPorts: has no input port 'observation' of size 12"),
    ("FILE:Wide", "Wide: its output port 'action' has size 7; make it 6"),
    ("nowhere.py:Policy", r"nowhere\.py: no such file; name a Python file with a"),
    ("no_such_module:policy", "no_such_module: can't be imported"),
    ("straigt", "'straigt' does not exist; did you mean 'straight'?"),
    ("own.py", r"'own\.py' does not exist.*FILE\.py:Class"),
])  # fmt: skip
def test_what_is_no_policy_and_a_name_of_nothing_say_why(name, words, scenario, file):
    with pytest.raises(DisasmError, match=words) as error:
        resolve_policy(name.replace("FILE", str(file), 1), scenario)
    assert "\n" not in str(error.value)
