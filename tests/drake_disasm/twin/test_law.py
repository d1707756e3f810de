"""IMPACT against its closed form."""

import pytest

from drake_disasm.parts import ImpactConfig
from drake_disasm.twin.equations import normal_force
from drake_disasm.twin.law import ImpactLaw

LAW = ImpactLaw(stiffness=2000.0, exponent=1.5, damping=4.0, depth=0.2)
MM = 1e-3


def force(law: ImpactLaw, penetration_mm: float, rate_mm_s: float = 0.0) -> float:
    return normal_force(penetration_mm * MM, rate_mm_s * MM, law.row)[0]


def test_without_motion_it_is_a_power_of_the_penetration() -> None:
    for p in (0.01, 1.0):
        assert force(LAW, p) == pytest.approx(2000.0 * p**1.5)
    assert force(LAW, 0.0, 5.0) == force(LAW, -0.1, 5.0) == 0.0
    assert force(LAW, 0.1, -1000.0) == 0.0  # it never pulls
    config = ImpactConfig(stiffness=7.0, exponent=2.0, damping=3.0, depth=0.5)
    assert ImpactLaw.of(config) == ImpactLaw(7.0, 2.0, 3.0, 0.5)


def test_damping_rises_by_adams_cubic_step():
    """step(p, 0, 0, d, c) = c x^2 (3 - 2 x), x = p / d; at once where d is zero."""
    for p, share in ((0.05, 0.15625), (0.1, 0.5), (0.2, 1), (0.5, 1)):
        assert force(LAW, p, 3.0) - force(LAW, p) == pytest.approx(4.0 * share * 3.0)
    law = ImpactLaw(100.0, 1.0, 2.0, 0.0)
    assert force(law, 1e-6, 5.0) == pytest.approx(10.0, rel=1e-4)


@pytest.mark.parametrize(("p", "v"), [(0.08, 2.0), (0.3, -1.0)])
def test_slopes_are_the_derivatives(p, v):
    _, by_p, by_rate = normal_force(p * MM, v * MM, LAW.row)
    d = 1e-6
    in_mm = (force(LAW, p + d, v) - force(LAW, p - d, v)) / (2 * d)
    assert by_p * MM == pytest.approx(in_mm, rel=1e-5)
    in_mm = (force(LAW, p, v + d) - force(LAW, p, v - d)) / (2 * d)
    assert by_rate * MM == pytest.approx(in_mm, rel=1e-5)
