"""Which experiment would separate effects that a log can't distinguish."""

from drake_disasm.effects import Effect
from sysid.effect_selection.effect_names import effect_class

_DEFAULT = "a recording with only one of them at work"


def separating(one: str, other: str, setting: str = "") -> str:
    """Returns the experiment that distinguishes two effects, in words.

    What one of them says of the other comes first; else what shows each apart.

    Args:
        one, other: names of effects, each with its joint if it has one, or with
            several joined by "and".
        setting: in which it is to be recorded, see `LogModel`.
    """
    first, second = one.split(" and "), other.split(" and ")
    known = [effect for effect in map(effect_class, first + second) if effect]
    has_own = any(_of_setting(effect, setting) for effect in known)
    if len(first) == len(second) == 1 and len(known) == 2 and not has_own:
        for effect, rival in (known, known[::-1]):
            if experiment := effect.experiments_against.get(rival.__name__):
                return experiment
    shown = [revealing_kind(effect.__name__, setting) for effect in known]
    return "; ".join(dict.fromkeys(filter(None, shown))) or _DEFAULT


def revealing_kind(kind: str, setting: str = "") -> str:
    """Returns the recording that shows a kind of effect; empty if none is known.

    Args:
        kind: name of its class.
        setting: in which it is to be recorded, see `LogModel`.
    """
    known = effect_class(kind)
    return (_of_setting(known, setting) or known.experiment) if known else ""


def _of_setting(effect: type[Effect], setting: str) -> str:
    """Returns what an effect has to say of a setting; empty if it is nothing."""
    known = {"task": effect.task_experiment, "rest": effect.rest_experiment}
    return known.get(setting, "")
