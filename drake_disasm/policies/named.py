"""Policies by name: scripted, shipped, from files, and a user's own code."""

import inspect
from types import ModuleType
from typing import Any

from pydrake.systems.framework import System

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.quantity import closest
from drake_disasm.common.text import clipped
from drake_disasm.common.user_code import import_named
from drake_disasm.policies.files import find_policy, load_policy, shipped_policies
from drake_disasm.policies.scripted import SCRIPTED, make_policy
from drake_disasm.scenario import Scenario
from drake_disasm.systems.policy import Policy, action_port

_FORMS = "an .npz file, module:name or FILE.py:Class"


def default_policy(scenario: Scenario) -> str:
    """Returns the name of the best shipped policy for a scenario's part."""
    return "removal_randomised" if scenario.part.way == "xy" else "admittance"


def resolve_policy(name: str, scenario: Scenario) -> Policy | System:
    """Returns the policy of a name.

    Args:
        name: of a scripted policy (`SCRIPTED`) or a shipped one (`shipped_policies`);
            a path to an .npz; or `module:name` or `FILE.py:name` of a callable from
            observation (12,) to action (6,), of a System with such ports, or of a class
            of either, which can be made without arguments.
        scenario: that it is to act on.

    Returns:
        A callable, a System, or a class of Systems, of which each diagram makes its
        own (see `add_task`).

    Raises:
        DisasmError: there is none of that name, it is no policy, or it does not fit
            the scenario.
    """
    if name in SCRIPTED:
        return make_policy(name, scenario)
    path = find_policy(name)
    if path:
        return load_policy(path).acting_on(scenario)
    source, separator, attribute = name.rpartition(":")
    if not separator:
        known = [*SCRIPTED, *shipped_policies()]
        raise DisasmError(
            f"policy '{clipped(name)}' does not exist; {closest(clipped(name), known)}"
            f", or give {_FORMS}"
        )
    return _own_policy(source, attribute, f"policy {clipped(name)}")


def _own_policy(source: str, attribute: str, where: str) -> Policy | System:
    """Returns a policy that a user's module has, or that its class makes."""
    words = [*([] if source.endswith(".py") else source.split(".")), attribute]
    if not all(word.isidentifier() for word in words):
        raise DisasmError(f"{where}: is no module and a name in it; give {_FORMS}")
    try:
        module = import_named(source, "a policy")
    except DisasmError as error:
        raise DisasmError(f"{where}: {clipped(str(error), 400)}") from None
    if not hasattr(module, attribute):
        raise DisasmError(
            f"{where}: {clipped(source)} has no {attribute}; "
            f"{closest(attribute, _defined_in(module))}"
        )
    policy = getattr(module, attribute)
    if not isinstance(policy, type):
        return _checked(policy, where)
    made = _checked(_made(policy, where), where)
    return policy if isinstance(made, System) else made


def _defined_in(module: ModuleType) -> list[str]:
    """Returns the names of what a module defines itself and could be a policy."""
    return [
        name
        for name, value in vars(module).items()
        if callable(value)
        and getattr(value, "__module__", "") == module.__name__
        and not name.startswith("_")
    ]


def _made(kind: type, where: str) -> Any:
    """Returns an object of a class that is made without arguments."""
    if _refuses_arguments(kind):
        raise DisasmError(
            f"{where}: {kind.__name__} needs arguments; give them defaults, or name an "
            "object that is made with them"
        )
    try:
        return kind()
    except Exception as error:  # whatever a user's class does wrong
        reason = clipped(f"{type(error).__name__}: {error}", 400)
        raise DisasmError(f"{where}: {kind.__name__}() fails ({reason})") from None


def _checked(policy: Any, where: str) -> Policy | System:
    """Returns what can be a policy.

    Raises:
        DisasmError: it is neither a System with a policy's ports nor a callable that
            takes one observation.
    """
    if isinstance(policy, System):
        action_port(policy)
    elif not callable(policy):
        raise DisasmError(
            f"{where}: is a {type(policy).__name__} and no policy; give a callable "
            "from (12,) to (6,), or a System with the ports `observation` and `action`"
        )
    elif _refuses_arguments(policy, "observation"):
        raise DisasmError(
            f"{where}: takes other arguments than one observation; it maps (12,) to "
            "(6,)"
        )
    return policy


def _refuses_arguments(function: Any, *arguments: Any) -> bool:
    """Returns whether a function's signature, if it has one, refuses arguments."""
    try:
        signature = inspect.signature(function)
    except ValueError:  # a function in C
        return False
    try:
        signature.bind(*arguments)
    except TypeError:
        return True
    return False
