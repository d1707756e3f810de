"""SI prefixes, so that small quantities in a sentence are read with ease."""

_PREFIXES = {1.0: "", 1e-3: "m", 1e-6: "\N{GREEK SMALL LETTER MU}", 1e-9: "n"}
_SMALL = 0.01
_TAKE_PREFIX = ("m", "N", "N m", "rad", "s")


def prefixed_unit(size: float, unit: str) -> tuple[float, str]:
    """Returns the unit in which a small size is one or more, and how large that is.

    As (1e-3, "mN m") for 0.002 N m. From a hundredth on, and if it takes no prefix, the
    unit is kept.

    Args:
        size: SI, without its sign.
        unit: SI.
    """
    if unit in _TAKE_PREFIX and 0.0 < size < _SMALL:
        for factor, prefix in _PREFIXES.items():
            if size >= factor:
                return factor, prefix + unit
    return 1.0, unit
