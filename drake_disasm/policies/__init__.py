"""Policies: scripted ones, trained ones from files, and a user's own."""

from drake_disasm.policies.exploring import Exploring
from drake_disasm.policies.files import (
    find_policy,
    load_policy,
    save_policy,
    scenario_hash,
    shipped_policies,
)
from drake_disasm.policies.named import default_policy, resolve_policy
from drake_disasm.policies.network import (
    LearnedPolicy,
    Network,
    PolicyDescription,
)
from drake_disasm.policies.scripted import (
    SCRIPTED,
    Admittance,
    Straight,
    make_policy,
)
from drake_disasm.policies.task_view import StageAxes, TaskView, TaskViews

__all__ = [
    "SCRIPTED",
    "Admittance",
    "Exploring",
    "LearnedPolicy",
    "Network",
    "PolicyDescription",
    "StageAxes",
    "Straight",
    "TaskView",
    "TaskViews",
    "default_policy",
    "find_policy",
    "load_policy",
    "make_policy",
    "resolve_policy",
    "save_policy",
    "scenario_hash",
    "shipped_policies",
]
