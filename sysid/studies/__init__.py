"""Studies of learning, and of what an identified twin is worth to it."""

from sysid.studies.baselines import BaselineStudy
from sysid.studies.hyperparameters import HyperparameterStudy
from sysid.studies.precision import PrecisionStudy
from sysid.studies.precision_transfer import PrecisionTransferStudy
from sysid.studies.study import Study
from sysid.studies.twin_transfer import TwinTransferStudy

#: By name.
STUDIES: dict[str, type[Study]] = {
    study.name: study
    for study in (
        PrecisionStudy,
        PrecisionTransferStudy,
        HyperparameterStudy,
        BaselineStudy,
        TwinTransferStudy,
    )
}
