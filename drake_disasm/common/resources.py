"""Where the models are, in a checkout and in an installed wheel."""

import importlib.util
import os
from functools import cache
from pathlib import Path

from pydrake.multibody.parsing import PackageMap

from drake_disasm.common.errors import DisasmError

MODELS_PACKAGE = "disasm_models"
#: Of one body on one joint, for an axis without a URDF, by what the joint does.
ONE_JOINT_MODELS = {
    "turns": f"package://{MODELS_PACKAGE}/one_joint/revolute.urdf",
    "slides": f"package://{MODELS_PACKAGE}/one_joint/prismatic.urdf",
}


@cache
def models_dir() -> Path:
    """Returns the folder that `package://disasm_models/` stands for."""
    checkout = Path(__file__).resolve().parents[2] / "models"
    if (checkout / "package.xml").is_file():
        return checkout
    spec = importlib.util.find_spec(MODELS_PACKAGE)
    for folder in (spec.submodule_search_locations or []) if spec else []:
        if (Path(folder) / "package.xml").is_file():
            return Path(folder)
    raise DisasmError(
        f"package {MODELS_PACKAGE} is not installed; run `pip install .` again"
    )


def package_map() -> PackageMap:
    """Returns a map that knows our models alone, so nothing is downloaded."""
    packages = PackageMap.MakeEmpty()
    packages.Add(MODELS_PACKAGE, str(models_dir()))
    return packages


def model_path(url: str, remedy: str = "check the `model` key in the scenario") -> Path:
    """Returns the file of a `package://disasm_models/...` URL or a plain path.

    Args:
        url: of the file.
        remedy: what to do if it is missing.

    Raises:
        DisasmError: there is no such file.
    """
    prefix = f"package://{MODELS_PACKAGE}/"
    path = models_dir() / url.removeprefix(prefix) if url.startswith(prefix) else url
    if not os.path.isfile(path):  # pathlib's raises on a name that is too long
        raise DisasmError(f"model file {url} is missing (looked at {path}); {remedy}")
    return Path(path)
