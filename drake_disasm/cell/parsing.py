"""Adding model files to a plant."""

from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Frame, ModelInstanceIndex

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


def movable_joints(url: str) -> tuple[str, ...]:
    """Returns the names of a model's joints with one degree of freedom, from its base.

    Raises:
        DisasmError: as of `add_model`.
    """
    plant = MultibodyPlant(0.0)
    instance = add_model(plant, url)
    plant.Finalize()
    joints = [plant.get_joint(index) for index in plant.GetJointIndices(instance)]
    moving = [joint for joint in joints if joint.num_velocities() == 1]
    moving.sort(key=lambda joint: joint.velocity_start())  # a file may list them anyhow
    return tuple(joint.name() for joint in moving)


def model_frame(
    plant: MultibodyPlant, instance: ModelInstanceIndex, name: str, url: str
) -> Frame:
    """Returns a frame that a model must have to serve in its place.

    Args:
        url: of the model's file, for the message.

    Raises:
        DisasmError: the model has no such frame.
    """
    if not plant.HasFrameNamed(name, instance):
        raise DisasmError(
            f"model file {url} has no link or frame '{name}', which its place in the "
            "cell needs; check the `model` key in the scenario"
        )
    return plant.GetFrameByName(name, instance)
