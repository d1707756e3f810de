"""Reading model files: URDF, SDF and what else Drake parses."""

from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import ModelInstanceIndex

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.resources import model_path, package_map


def add_model(plant: MultibodyPlant, url: str) -> ModelInstanceIndex:
    """Adds the one model of a file to the plant.

    Raises:
        DisasmError: the file is missing or does not hold one model.
    """
    path = model_path(url)
    parser = Parser(plant)
    parser.package_map().AddMap(package_map())
    try:
        instances = parser.AddModels(str(path))
    except RuntimeError as error:
        reason = " ".join(str(error).split())
        remedy = (
            "name it relative to the model's folder, or take that shape out"
            if "URI" in reason
            else "give a URDF of one robot"
        )
        raise DisasmError(
            f"model file {url} can't be read: {reason.rstrip('.')}; {remedy}"
        ) from None
    if len(instances) != 1:
        raise DisasmError(f"model file {url} holds {len(instances)} models; give one")
    return instances[0]
