"""Which experiment would separate effects that a log can't distinguish."""

from drake_disasm.effects import Effect
from sysid.effect_selection.effect_names import effect_class

_DEFAULT = "a recording with only one of them at work"


def separating(one: str, other: str, at_task: bool = False) -> str:
    """Returns the experiment that distinguishes two effects, in words.

    What one of them says of the other comes first; else what shows each apart.

    Args:
        one, other: names of effects, each with its joint if it has one, or with
            several joined by "and".
        at_task: whether it is to be recorded in steps of the task, not at rest.
    """
    first, second = _classes(one), _classes(other)
    is_rest = at_task and any(effect.task_experiment for effect in first + second)
    if len(first) == len(second) == 1 and not is_rest:
        (a,), (b,) = first, second
        for effect, rival in ((a, b), (b, a)):
            if experiment := effect.experiments_against.get(rival.__name__):
                return experiment
    shown = [revealing(effect, at_task) for effect in first + second]
    return "; ".join(dict.fromkeys(filter(None, shown))) or _DEFAULT


def revealing(effect: type[Effect], at_task: bool = False) -> str:
    """Returns the recording that shows an effect apart from others, in words.

    Args:
        effect: its class.
        at_task: whether it is to be recorded in steps of the task, not at rest.
    """
    return (at_task and effect.task_experiment) or effect.experiment


def revealing_kind(kind: str, at_task: bool = False) -> str:
    """Returns the recording that shows a kind of effect; empty if none is known.

    Args:
        kind: name of its class.
        at_task: as of `revealing`.
    """
    known = effect_class(kind)
    return revealing(known, at_task) if known else ""


def _classes(name: str) -> list[type[Effect]]:
    """Returns the classes of effects that a name speaks of, as far as known."""
    found = [effect_class(part) for part in name.split(" and ")]
    return [each for each in found if each]
