"""Gymnasium ids of the task, registered without loading Drake.

Gymnasium 1.0 and later load no plugins, so `import drake_disasm` registers the ids, or
`gymnasium.make("drake_disasm:drake_disasm/Removal-v0")`, which imports it. What they
name is imported when an environment is made.
"""

from gymnasium.envs.registration import register, registry

#: Registered ids and the scenario of each.
IDS = {
    "drake_disasm/Removal-v0": "removal",
    "drake_disasm/RemovalTurned-v0": "removal_turned",
    "drake_disasm/RemovalRandomised-v0": "removal_randomised",
    "drake_disasm/Peg-v0": "iiwa_peg",
    "drake_disasm/Bayonet-v0": "iiwa_bayonet",
    "drake_disasm/Chapter3-v0": "chapter3",
    "drake_disasm/Chapter3Impedance-v0": "chapter3_impedance",
    "drake_disasm/Chapter3Stiff-v0": "chapter3_stiff",
    "drake_disasm/Chapter4-v0": "chapter4",
    "drake_disasm/Chapter4Impedance-v0": "chapter4_impedance",
    "drake_disasm/Chapter4Stiff-v0": "chapter4_stiff",
    "drake_disasm/Chapter5-v0": "chapter5",
    "drake_disasm/Chapter5Impedance-v0": "chapter5_impedance",
    "drake_disasm/Chapter5Stiff-v0": "chapter5_stiff",
}


def register_environments() -> None:
    """Registers all ids with Gymnasium; once is enough."""
    for name, scenario in IDS.items():
        if name not in registry:
            register(
                name,
                entry_point="drake_disasm.learning.environment:DisassemblyEnv",
                vector_entry_point=(
                    "drake_disasm.learning.vector_environment:DisassemblyVectorEnv"
                ),
                kwargs={"scenario": scenario},
            )
