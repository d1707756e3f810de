"""Adding model files to a plant."""

from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Frame, ModelInstanceIndex

from drake_disasm.errors import DisasmError
from drake_disasm.resources import model_path, package_map


def add_model(plant: MultibodyPlant, url: str) -> ModelInstanceIndex:
    """Adds the one model of a file to the plant.

    Raises:
        DisasmError: the file is missing or is not a model.
    """
    path = model_path(url)
    parser = Parser(plant)
    parser.package_map().AddMap(package_map())
    try:
        return parser.AddModels(str(path))[0]
    except RuntimeError as error:
        reason = " ".join(str(error).split())
        raise DisasmError(f"model file {url} can't be read: {reason}") from None


def add_arm(plant: MultibodyPlant, url: str) -> tuple[ModelInstanceIndex, Frame]:
    """Adds the arm with its base on the world's origin.

    Returns:
        Its model instance and its flange frame F.
    """
    instance = add_model(plant, url)
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("iiwa_link_0", instance))
    return instance, plant.GetFrameByName("iiwa_link_ee", instance)
