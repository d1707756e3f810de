"""What is taken apart: a body that stays, and one that is gripped and moved.

To add one to the library: a file, and its import below. To add one of your own from
anywhere else: `register_part`.
"""

from drake_disasm.parts.base import AXES, WAYS, Part, Solid, Stage, Wrench
from drake_disasm.parts.contact import ContactConfig, ImpactConfig
from drake_disasm.parts.registry import (
    find_part,
    import_own,
    register_part,
    registered_parts,
)

# Parts are registered and documented in the order of these lines.
# isort: off
from drake_disasm.parts.door_chain import DoorChain
from drake_disasm.parts.peg_in_hole import PegInHole
from drake_disasm.parts.bayonet import Bayonet
from drake_disasm.parts.from_files import FromFiles
# isort: on

__all__ = [
    "AXES",
    "WAYS",
    "Bayonet",
    "ContactConfig",
    "DoorChain",
    "FromFiles",
    "ImpactConfig",
    "Part",
    "PegInHole",
    "Solid",
    "Stage",
    "Wrench",
    "find_part",
    "import_own",
    "register_part",
    "registered_parts",
]
