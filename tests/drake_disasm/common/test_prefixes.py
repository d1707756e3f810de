"""SI prefixes of small quantities."""

from drake_disasm.common.prefixes import prefixed_unit


def test_a_small_size_gets_the_prefix_with_which_it_is_about_one():
    for size, unit, found in (
        (0.002, "N m", (1e-3, "mN m")),
        (0.02, "N m", (1.0, "N m")),
        (1e-3, "m", (1e-3, "mm")),
        (2e-5, "rad", (1e-6, "\N{GREEK SMALL LETTER MU}rad")),
        (0.002, "kg m", (1.0, "kg m")),
        (0.0, "m", (1.0, "m")),
        (1e-15, "m", (1.0, "m")),
    ):
        assert prefixed_unit(size, unit) == found
