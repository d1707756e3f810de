"""Studies of what identification and closing the loop are worth to what is learned."""

from drake_disasm.studies.study import Study
from sysid.studies.twin_transfer import TwinTransferStudy

#: By name; beside those of `drake_disasm.studies`.
STUDIES: dict[str, type[Study]] = {TwinTransferStudy.name: TwinTransferStudy}
