"""Identified effects as systems around a plant, against their formulas."""

import numpy as np
import pytest
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource

from drake_disasm.effects import (
    ArmDelay,
    ArmTilt,
    EncoderError,
    JointCoulombFriction,
    JointDahlFriction,
    JointElasticity,
    JointLoadFriction,
    JointViscousFriction,
    RotorInertia,
    TorqueGain,
)
from drake_disasm.scenario import Scenario
from sysid.export import add_identified_effects
from tests.refusals import refused
from tests.sysid.models.arm import JOINTS, write_two_link_arm


def _plant(builder, folder, time_step=0.0, drive=True, damping=""):
    path = write_two_link_arm(folder / "arm.urdf")
    if damping:
        text = path.read_text().replace('effort="99"/>', f'effort="99"/>{damping}')
        path.write_text(text)
    plant = builder.AddSystem(MultibodyPlant(time_step))
    Parser(plant).AddModels(str(path))
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("base"))
    for name in JOINTS if drive else ():
        plant.AddJointActuator(name, plant.GetJointByName(name))
    plant.Finalize()
    return plant


class _Run:
    """A diagram of an arm with effects, at a state, with constant drives."""

    def __init__(self, folder, effects, q, v, u, time_step=0.0, damping=""):
        builder = DiagramBuilder()
        self.plant = _plant(builder, folder, time_step, damping=damping)
        scenario = Scenario(effects=list(effects))
        self.added = add_identified_effects(builder, self.plant, scenario)
        drives = builder.AddSystem(ConstantVectorSource(np.array(u)))
        builder.Connect(drives.get_output_port(), self.plant.get_actuation_input_port())
        self.simulator = Simulator(builder.Build())
        self.root = self.simulator.get_mutable_context()
        self.of_plant = self.plant.GetMyMutableContextFromRoot(self.root)
        self.plant.SetPositions(self.of_plant, q)
        self.plant.SetVelocities(self.of_plant, v)
        self.simulator.Initialize()

    def torques(self):
        system = self.added.torques
        return system.torques(system.GetMyContextFromRoot(self.root))

    def force(self):
        port = self.plant.get_applied_generalized_force_input_port()
        return port.Eval(self.plant.GetMyContextFromRoot(self.root))

    def read(self, name):
        port = getattr(self.added, name)
        return port.Eval(port.get_system().GetMyContextFromRoot(self.root))


Q, V, U = [0.3, -0.4], [0.05, -0.8], [12.0, -1.0]


@pytest.mark.parametrize("time_step", [0.0, 1e-3])
def test_friction_is_its_formula(tmp_path, time_step):
    effects = [
        JointCoulombFriction("shoulder", 2.0, 0.05),
        JointViscousFriction("elbow", 0.5),
    ]
    run = _Run(tmp_path, effects, Q, V, U, time_step)
    expected = [2.0 * np.tanh(1.0), 0.5 * -0.8]
    np.testing.assert_allclose(run.torques(), expected, rtol=1e-12)
    np.testing.assert_allclose(run.force(), np.negative(expected), rtol=1e-12)


def test_the_plants_own_damping_is_not_added_again(tmp_path):
    dynamics = '<dynamics damping="0.5"/>'
    run = _Run(
        tmp_path, [JointViscousFriction("elbow", 0.5)], Q, V, U, damping=dynamics
    )
    np.testing.assert_allclose(run.torques(), [-0.5 * 0.05, 0.0], atol=1e-14)


def test_load_friction_takes_the_load_from_inverse_dynamics(tmp_path):
    run = _Run(tmp_path, [JointLoadFriction("shoulder", 0.2)], Q, V, U, 1e-4)
    run.simulator.AdvanceTo(2e-3)
    # The drive's torque is the load and what friction takes of it.
    by_friction = run.torques()[0]
    load = U[0] - by_friction
    v = run.plant.GetVelocities(run.of_plant)[0]
    expected = 0.2 * abs(load) * np.tanh(v / 0.02)
    assert by_friction == pytest.approx(expected, rel=0.02)


def test_pre_sliding_friction_follows_the_path(tmp_path):
    friction = JointDahlFriction("elbow", 1.5, 0.01)
    run = _Run(tmp_path, [friction], Q, V, U)
    assert run.torques()[1] == pytest.approx(0.0, abs=1e-12)
    run.simulator.set_target_realtime_rate(0.0)
    run.simulator.AdvanceTo(0.02)
    moved = run.plant.GetPositions(run.of_plant)[1] - Q[1]
    expected = friction.torque(friction.remember(np.array(0.0), np.array(moved)))
    assert run.torques()[1] == pytest.approx(float(expected), rel=1e-6)
    assert abs(expected) > 0.5


def test_a_tilt_is_another_gravity(tmp_path):
    tilted = _Run(tmp_path, [ArmTilt(0.01, -0.02)], Q, [0.0, 0.0], U)
    plant, g = tilted.plant, 9.81
    context, upright = plant.CreateDefaultContext(), tilted.force()
    plant.SetPositions(context, Q)
    before = plant.CalcGravityGeneralizedForces(context)
    other = MultibodyPlant(0.0)
    Parser(other).AddModels(str(tmp_path / "arm.urdf"))
    other.WeldFrames(other.world_frame(), other.GetFrameByName("base"))
    other.mutable_gravity_field().set_gravity_vector([g * -0.02, -g * 0.01, -g])
    other.Finalize()
    context = other.CreateDefaultContext()
    other.SetPositions(context, Q)
    after = other.CalcGravityGeneralizedForces(context)
    np.testing.assert_allclose(upright, after - before, atol=1e-9)


def test_readings_have_the_sensors_errors_and_delays(tmp_path):
    effects = [
        EncoderError("shoulder", 0.02, 0.1),
        TorqueGain("elbow", 0.1),
        ArmDelay(0.0025),
    ]
    run = _Run(tmp_path, effects, Q, V, U, 1e-3)
    np.testing.assert_allclose(run.read("position"), [0.3 * 1.1 + 0.02, -0.4])
    np.testing.assert_allclose(run.read("velocity"), [0.05 * 1.1, -0.8])
    run.simulator.AdvanceTo(0.02)
    # Two and a half steps late, the drive is constant and the load is not.
    torque = run.read("torque")
    assert torque[0] == pytest.approx(U[0])
    assert torque[1] == pytest.approx(1.1 * U[1], rel=1e-3)
    q = run.plant.GetPositions(run.of_plant)
    assert run.read("position")[1] == pytest.approx(q[1])


def test_a_late_motion_is_read_late(tmp_path):
    run = _Run(tmp_path, [ArmDelay(-0.0025)], Q, V, U, 1e-3)
    past = []
    for step in range(1, 12):
        run.simulator.AdvanceTo(1e-3 * step)
        past.append(run.plant.GetPositions(run.of_plant)[1])
    expected = 0.5 * (past[-3] + past[-4])
    assert run.read("position")[1] == pytest.approx(expected, abs=1e-12)


def test_what_a_plant_cannot_carry_is_refused(tmp_path):
    builder = DiagramBuilder()
    plant = _plant(builder, tmp_path)
    for effect, words in (
        (JointElasticity("elbow", 1e-3), "can't carry it"),
        (JointCoulombFriction("knee", 1.0), "no actuator at a joint 'knee'"),
        (RotorInertia("elbow", 0.2), "parse the exported file"),
    ):
        with refused(words):
            add_identified_effects(builder, plant, Scenario(effects=[effect]))
    add_identified_effects(builder, plant, Scenario())
    with refused("applied_generalized_force is connected"):
        add_identified_effects(builder, plant, Scenario())
