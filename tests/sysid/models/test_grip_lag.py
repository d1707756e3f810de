"""What the grip's springs carry of a measured wrench, against springs and dampers."""

import numpy as np

from drake_disasm.cell.grip import AXIS_ORDER
from drake_disasm.scenario import load_scenario
from sysid.models.grip_lag import GripLag


def test_it_follows_springs_and_dampers_in_parallel():
    """A deflection that is integrated finely under wrenches that change evenly."""
    lag = GripLag.of(load_scenario("removal"))
    random = np.random.default_rng(0)
    wrench = random.uniform(-1, 1, (6, 6)) * ([2.0] * 3 + [0.2] * 3)
    k, c = lag.springs.stiffness, lag.springs.damping
    at_grip = wrench @ lag.to_grip.T
    give, elastic, fine = at_grip[0] / k, wrench[:1], 2000
    for begin in range(5):
        for i in range(fine):
            share = (i + 0.5) / fine
            force = (1.0 - share) * at_grip[begin] + share * at_grip[begin + 1]
            give = give + lag.period / fine * (force - k * give) / c
        elastic = lag.after(elastic, wrench[None, begin : begin + 2])
        np.testing.assert_allclose(elastic[0] @ lag.to_grip.T / k, give, rtol=0.02)
        rates = lag.rates(elastic, wrench[None, begin + 1])[0]
        of_grip = ((at_grip[begin + 1] - k * give) / c)[list(AXIS_ORDER)]
        np.testing.assert_allclose(rates, of_grip, rtol=0.02, atol=2e-4)


def test_springs_of_a_stiff_grip_carry_all():
    lag = GripLag.of(load_scenario("removal", ["gripper.compliance=rigid"]))
    wrench = np.array([[[0.0] * 6, [1.0, 2.0, -1.0, 0.1, 0.2, -0.1]]])
    elastic = lag.after(np.zeros((1, 6)), wrench)
    np.testing.assert_array_equal(elastic, wrench[:, 1])
    np.testing.assert_array_equal(lag.rates(elastic, wrench[:, 1]), 0.0)
