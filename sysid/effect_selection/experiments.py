"""Which experiment would separate effects that a log can't distinguish."""

from drake_disasm.effects import Effect, registered_effects

_DEFAULT = "a recording with only one of them at work"


def separating(one: str, other: str) -> str:
    """Returns the experiment that distinguishes two effects, in words.

    What one of them says of the other comes first; else what shows each apart.

    Args:
        one, other: names of effects, each with its joint if it has one, or with
            several joined by "and".
    """
    first, second = _classes(one), _classes(other)
    if len(first) == len(second) == 1:
        (a,), (b,) = first, second
        for effect, rival in ((a, b), (b, a)):
            if experiment := effect.experiments_against.get(rival.__name__):
                return experiment
    shown = [effect.experiment for effect in first + second if effect.experiment]
    return "; ".join(dict.fromkeys(shown)) or _DEFAULT


def _classes(name: str) -> list[type[Effect]]:
    """Returns the classes of effects that a name speaks of, as far as known."""
    known = {effect.__name__: effect for effect in registered_effects()}
    names = [part.partition(".")[0] for part in name.split(" and ")]
    return [known[each] for each in names if each in known]
