"""The thesis's studies: what is varied, what is measured, and what came of it."""

from drake_disasm.studies.baselines import BaselineStudy
from drake_disasm.studies.hyperparameters import HyperparameterStudy
from drake_disasm.studies.precision import PrecisionStudy
from drake_disasm.studies.precision_transfer import PrecisionTransferStudy
from drake_disasm.studies.study import Study

#: By name.
STUDIES: dict[str, type[Study]] = {
    study.name: study
    for study in (
        PrecisionStudy,
        PrecisionTransferStudy,
        HyperparameterStudy,
        BaselineStudy,
    )
}
