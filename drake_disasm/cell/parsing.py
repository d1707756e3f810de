"""Adding model files to a plant."""

from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Frame, ModelInstanceIndex

from drake_disasm.cell.arm_description import BASE, FLANGE, refuse_unfit_arm
from drake_disasm.common.errors import DisasmError
from drake_disasm.common.model_files import add_model


def movable_joints(url: str) -> tuple[str, ...]:
    """Returns the names of a model's joints with one degree of freedom, from its base.

    Raises:
        DisasmError: as of `add_model`.
    """
    plant = MultibodyPlant(0.0)
    instance = add_model(plant, url)
    return _movable(plant, instance)


def arm_joints(url: str) -> tuple[str, ...]:
    """Returns the names of an arm's joints from its base, if a station can take it.

    Raises:
        DisasmError: as of `add_arm`.
    """
    plant = MultibodyPlant(0.0)
    instance, _ = add_arm(plant, url)
    return _movable(plant, instance)


def _movable(plant: MultibodyPlant, instance: ModelInstanceIndex) -> tuple[str, ...]:
    """Returns the names of a model's joints in the order of their velocities."""
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


def add_arm(plant: MultibodyPlant, url: str) -> tuple[ModelInstanceIndex, Frame]:
    """Adds the arm with its base on the world's origin.

    Returns:
        Its model instance and its flange frame F.

    Raises:
        DisasmError: the file is missing, or is not an arm that a station can take.
    """
    constraints = plant.num_constraints()
    instance = add_model(plant, url)
    refuse_unfit_arm(plant, instance, url)
    if plant.num_constraints() > constraints:
        raise DisasmError(
            f"arm.model: {url} has a joint that follows another; take its <mimic> out"
        )
    base = model_frame(plant, instance, BASE, url)
    plant.WeldFrames(plant.world_frame(), base)
    return instance, model_frame(plant, instance, FLANGE, url)
