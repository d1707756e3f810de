"""Whether arm and tool are free of collisions where an episode starts."""

from pydrake.geometry import QueryObject
from pydrake.multibody.plant import MultibodyPlant

from drake_disasm.common.errors import DisasmError
from drake_disasm.stations.cell_models import CellModels

_DEPTH = 1e-4  # m, from which shapes overlap


def refuse_collisions(
    plant: MultibodyPlant, query: QueryObject, models: CellModels
) -> None:
    """Refuses a start at which arm and tool overlap each other or the bench.

    Bolt and groove are left out: the gripper is to touch one, and effects move the
    other.

    Args:
        plant: of the cell.
        query: of its geometry, at the start.
        models: of the cell in the plant.

    Raises:
        DisasmError: names the bodies of the deepest overlap, and the remedy.
    """
    moving = {models.arm.instance, *models.tool.instances}
    bench = {plant.GetBodyByName("bench").index()}
    inspector, deepest = query.inspector(), (_DEPTH, "", "")
    for pair in query.ComputePointPairPenetration():
        bodies = [
            plant.GetBodyFromFrameId(inspector.GetFrameId(shape))
            for shape in (pair.id_A, pair.id_B)
        ]
        own = [body for body in bodies if body.model_instance() in moving]
        all_known = all(body in own or body.index() in bench for body in bodies)
        if own and all_known and pair.depth > deepest[0]:
            deepest = (pair.depth, *(body.scoped_name().to_string() for body in bodies))
    depth, first, second = deepest
    if first:
        raise DisasmError(
            f"arm.posture: at the start {first} and {second} are {1e3 * depth:.1f} mm "
            "inside each other; give another posture, move the lock by placement.p_WG, "
            "or, if the shapes are coarse, leave the pair out by a "
            "<drake:collision_filter_group> in the URDF"
        )
