"""Adding model files to a plant."""

from collections.abc import Sequence

from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Frame, ModelInstanceIndex, RigidBody

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.model_files import add_model


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


def weld_root(plant: MultibodyPlant, bodies: Sequence[RigidBody]) -> None:
    """Welds bodies that are no joint's child to the world: an arm's base."""
    joints = [plant.get_joint(i) for i in plant.GetJointIndices()]
    held = {int(joint.child_body().index()) for joint in joints}
    for body in bodies:
        if int(body.index()) not in held:
            plant.WeldFrames(plant.world_frame(), body.body_frame())


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
