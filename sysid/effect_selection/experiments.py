"""Which experiment would separate effects that a log can't distinguish."""

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
    first, second = one.split(" and "), other.split(" and ")
    known = [effect for effect in map(effect_class, first + second) if effect]
    is_rest = at_task and any(effect.task_experiment for effect in known)
    if len(first) == len(second) == 1 and len(known) == 2 and not is_rest:
        for effect, rival in (known, known[::-1]):
            if experiment := effect.experiments_against.get(rival.__name__):
                return experiment
    shown = [revealing_kind(effect.__name__, at_task) for effect in known]
    return "; ".join(dict.fromkeys(filter(None, shown))) or _DEFAULT


def revealing_kind(kind: str, at_task: bool = False) -> str:
    """Returns the recording that shows a kind of effect; empty if none is known.

    Args:
        kind: name of its class.
        at_task: whether it is to be recorded in steps of the task, not at rest.
    """
    known = effect_class(kind)
    return ((at_task and known.task_experiment) or known.experiment) if known else ""
