"""A payload on the flange that the controller's tool data do not include."""

from collections.abc import Sequence

from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Frame, RigidBody, SpatialInertia, UnitInertia

from drake_disasm.cell.tool import summed
from drake_disasm.common.errors import DisasmError
from drake_disasm.effects import ArmEffect, FlangePayload


def add_payload_body(
    plant: MultibodyPlant, frame_F: Frame, effects: Sequence[ArmEffect]
) -> RigidBody:
    """Returns a body welded to the flange, whose inertia is that of the payloads.

    A body of its own, since a plant has no way to change the default inertia of one
    that came from a file.
    """
    instance = plant.AddModelInstance("flange_payload")
    body = plant.AddRigidBody("flange_payload", instance, payload_inertia(effects))
    plant.WeldFrames(frame_F, body.body_frame())
    return body


def payload_inertia(effects: Sequence[ArmEffect]) -> SpatialInertia:
    """Returns the inertia of all payloads together, about Fo in F.

    Raises:
        DisasmError: a payload has a first moment but no mass.
    """
    M_F = SpatialInertia.Zero()
    for payload in effects:
        if not isinstance(payload, FlangePayload):
            continue
        if payload.mass > 0.0:
            xx, xy, xz, yy, yz, zz = payload.inertial[4:] / payload.mass
            G = UnitInertia(xx, yy, zz, xy, xz, yz)
            p_FoPcm_F = payload.first_moment / payload.mass
            more = SpatialInertia(payload.mass, p_FoPcm_F, G, skip_validity_check=True)
            M_F = more if M_F.get_mass() == 0.0 else summed([M_F, more])
        elif payload.first_moment.any():
            raise DisasmError(
                "FlangePayload: no body has a first moment (cx, cy, cz) and no mass; "
                "give it a mass"
            )
    return M_F
