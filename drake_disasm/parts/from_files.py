"""A part of two model files: what stays, and what is gripped and moved.

Each file holds one model of one rigid body, or of bodies that are fixed together. The
root link of the fixed one is G, that of the moved one is B; see `parts.base` for how
their axes point.
"""

import dataclasses
import functools
import os
from collections.abc import Mapping
from pathlib import Path
from typing import ClassVar, Self

import numpy as np
from pydrake.geometry import (
    HydroelasticContactRepresentation,
    Mesh,
    Obb,
    ProximityProperties,
    ReadObjToTriangleSurfaceMesh,
    Role,
    SceneGraph,
)
from pydrake.math import RigidTransform
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, MultibodyPlant
from pydrake.multibody.tree import SpatialInertia
from pydrake.systems.framework import DiagramBuilder

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.model_files import add_model
from drake_disasm.common.quantity import quantity
from drake_disasm.common.resources import model_path
from drake_disasm.effects import Environment
from drake_disasm.parts.base import AXES, WAYS, Part, Solid, Stage
from drake_disasm.parts.materials import grip_material, with_surface
from drake_disasm.parts.registry import register_part

_GRIP = "grip"


@register_part
@dataclasses.dataclass
class FromFiles(Part):
    """A part of two URDF or SDF files.

    Their collision geometries need hydroelastic properties
    (`drake:proximity_properties`): rigid in the fixed file, compliant in the moved one.
    Friction is the scenario's `contact.friction`. What the fingers close on is the
    moved file's collision geometry named `grip`.
    """

    fixed: str = quantity("", "", "model file of what stays")
    moved: str = quantity("", "", "model file of what is gripped")
    way: str = quantity(
        "y", "", "coordinates of the moved body in G along (x, y, z) and about (u, v, "
        "w) which it leaves, one or two", choices=WAYS,
    )  # fmt: skip
    ends: list[float] = quantity(
        [0.02, 0.02], "m, rad", "where each of them ends; after the last it is free",
        low=1e-4, high=6.0,
    )  # fmt: skip
    efforts: list[float] = quantity(
        [12.0, 8.0],
        "N, N m",
        "with which a scripted policy pushes",
        low=0.01,
        high=50.0,
    )
    radius: float = quantity(
        0.01, "m", "at which a turn's way is counted", low=1e-3, high=0.2
    )
    surface_height: float = quantity(
        0.0, "m", "y in G above which there is room for the fingers", low=-0.2, high=0.2
    )
    clearance: float = quantity(
        0.0005, "m", "play of the moved body, for the record", low=1e-5, high=0.01
    )

    file_fields: ClassVar[tuple[str, ...]] = ("fixed", "moved")

    @property
    def stages(self) -> tuple[Stage, ...]:
        """See Part."""
        lines = zip(self.way, self.ends, self.efforts, strict=False)
        return tuple(
            Stage(AXES.index(a), end, effort, self.radius if a in "uvw" else 1.0)
            for a, end, effort in lines
        )

    @property
    def M_moved_B(self) -> SpatialInertia:
        """See Part."""
        return _body(self.moved, "part.moved").M

    @property
    def bottom(self) -> float:
        """See Part."""
        return float(_body(self.fixed, "part.fixed").low[1])

    @property
    def surface(self) -> float:
        """See Part."""
        return self.surface_height

    @property
    def grip_width(self) -> float:
        """See Part."""
        return _body(self.moved, "part.moved").grip_width

    @property
    def touch_radius(self) -> float:
        """See Part: of the moved body's box about its y axis, without the grip."""
        moved = _body(self.moved, "part.moved")
        return float(np.abs([moved.low, moved.high])[:, [0, 2]].max())

    @property
    def moved_solids(self) -> Mapping[str, Solid]:
        """See Part."""
        return _body(self.moved, "part.moved").solids

    def fixed_solids(self, environment: Environment) -> Mapping[str, Solid]:
        """See Part; no effect reshapes it."""
        return _body(self.fixed, "part.fixed").solids

    def fixed_material(
        self, name: str, environment: Environment
    ) -> ProximityProperties:
        """See Part: the file's, with the environment's friction and dissipation."""
        properties = _body(self.fixed, "part.fixed").properties
        return with_surface(properties[name], environment)

    def moved_materials(
        self, environment: Environment, resolution: float
    ) -> dict[str, ProximityProperties]:
        """See Part: the file's, with the environment's friction and dissipation."""
        own = _body(self.moved, "part.moved").properties.items()
        found = {name: with_surface(each, environment) for name, each in own}
        return found | {_GRIP: grip_material(environment.dissipation)}

    def refuse_impossible(self) -> None:
        """See Part: files that can't be a part, bodies that overlap at the start."""
        if (len(self.way) == 2 and self.way[1] in "uvw") or self.way in "uvw":
            raise DisasmError(
                f"part.way: '{self.way}' ends with a turn; end it with the motion "
                "along which the body comes free"
            )
        fixed = _body(self.fixed, "part.fixed")
        moved = _body(self.moved, "part.moved")
        if _GRIP not in moved.solids:
            raise DisasmError(
                f"part.moved: {self.moved} has no collision geometry named '{_GRIP}', "
                "between which the fingers close; name it so"
            )
        shared = sorted(fixed.solids.keys() & moved.solids.keys())
        if shared:
            raise DisasmError(
                f"part.moved: its collision '{shared[0]}' has the name of one in "
                f"{self.fixed}; rename one of them"
            )
        _refuse_overlap(*_keys(self.fixed, self.moved))


@dataclasses.dataclass(frozen=True)
class _Body:
    """What a model file says of a body.

    Attributes:
        solids, properties: collision geometries by name.
        M: spatial inertia about the root link's origin.
        low, high: corners (3,) of its box, without the grip [m].
        grip_width: along z [m]; NaN without a grip.
    """

    solids: dict[str, Solid]
    properties: dict[str, ProximityProperties]
    M: SpatialInertia
    low: np.ndarray
    high: np.ndarray
    grip_width: float

    @classmethod
    def of(cls, url: str, name: str) -> Self:
        """Reads a file.

        Args:
            url: of the file.
            name: of the scenario's key, for messages.
        """
        builder = DiagramBuilder()
        plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.0)
        root = _add_rigid(plant, url, name)
        plant.Finalize()
        context = builder.Build().CreateDefaultContext()
        solids, properties, boxes = _geometry(scene_graph, context, url, name)
        grip = boxes.pop(_GRIP, np.full((2, 3), np.nan))
        if not boxes:
            raise DisasmError(
                f"{name}: {url} has no collision geometry; add <collision> elements"
            )
        bodies = plant.GetBodyIndices(root)
        plant_context = plant.GetMyContextFromRoot(context)
        M = plant.CalcSpatialInertia(plant_context, plant.world_frame(), bodies)
        if not M.get_mass() > 0.0:
            raise DisasmError(f"{name}: {url} states no mass; add an <inertial>")
        corners = np.array(list(boxes.values()))
        low, high = corners[:, 0].min(axis=0), corners[:, 1].max(axis=0)
        return cls(solids, properties, M, low, high, float(grip[1, 2] - grip[0, 2]))


def _keys(*urls: str) -> tuple[tuple[str, float], ...]:
    """Returns files with the times of their last change."""
    return tuple((url, os.path.getmtime(model_path(url))) for url in urls)


def _body(url: str, name: str) -> _Body:
    """Returns what a file says, from memory while it is the same file.

    Raises:
        DisasmError: it is missing, or no rigid body with geometry and mass.
    """
    if not url:
        raise DisasmError(f"{name}: names no file; give a URDF or SDF")
    model_path(url, f"check `{name}` in the scenario")
    return _read(*_keys(url), name)


@functools.lru_cache(maxsize=16)
def _read(key: tuple[str, float], name: str) -> _Body:
    return _Body.of(key[0], name)


def _add_rigid(plant: MultibodyPlant, url: str, name: str) -> int:
    """Adds the body of a file, its root link on the world's origin."""
    instance = add_model(plant, url)
    moving = [
        joint.name()
        for joint in map(plant.get_joint, plant.GetJointIndices(instance))
        if joint.num_velocities() > 0
    ]
    if moving:
        raise DisasmError(
            f"{name}: {url} has the movable joint '{moving[0]}'; a part's body is "
            "rigid: make it fixed"
        )
    children = {
        plant.get_joint(index).child_body().index()
        for index in plant.GetJointIndices(instance)
    }
    roots = [i for i in plant.GetBodyIndices(instance) if i not in children]
    if len(roots) == 1:
        body = plant.get_body(roots[0])
        plant.WeldFrames(plant.world_frame(), body.body_frame())
    elif roots:
        raise DisasmError(f"{name}: {url} has {len(roots)} loose links; join them")
    return instance


def _geometry(
    scene_graph: SceneGraph, context: object, url: str, name: str
) -> tuple[dict[str, Solid], dict[str, ProximityProperties], dict[str, np.ndarray]]:
    """Returns solids, properties and boxes (2, 3) of collision geometry, by name."""
    port = scene_graph.get_query_output_port()
    query = port.Eval(scene_graph.GetMyContextFromRoot(context))
    inspector = query.inspector()
    solids, properties, boxes = {}, {}, {}
    for geometry in inspector.GetAllGeometryIds(Role.kProximity):
        label = inspector.GetName(geometry).rpartition("::")[2]
        shape, X_B = inspector.GetShape(geometry), query.GetPoseInWorld(geometry)
        _refuse_open(shape, url, name)
        solids[label] = RigidTransform(X_B), shape
        properties[label] = ProximityProperties(
            inspector.GetProximityProperties(geometry)
        )
        boxes[label] = _box(inspector.GetObbInGeometryFrame(geometry), X_B)
    return solids, properties, boxes


def _box(obb: Obb | None, X_B: RigidTransform) -> np.ndarray:
    """Returns the corners (2, 3) of a geometry's box in its body; none is infinite."""
    if obb is None:
        return np.array([np.full(3, -np.inf), np.full(3, np.inf)])
    X_BO = X_B @ obb.pose()
    half = np.abs(X_BO.rotation().matrix()) @ obb.half_width()
    return np.array([X_BO.translation() - half, X_BO.translation() + half])


def _refuse_open(shape: object, url: str, name: str) -> None:
    """Refuses a mesh with an edge that not two triangles share."""
    if not isinstance(shape, Mesh) or shape.source().is_in_memory():
        return
    path = Path(shape.source().path())
    if path.suffix.lower() != ".obj":
        return
    mesh = ReadObjToTriangleSurfaceMesh(str(path))
    triangles = np.array(
        [[t.vertex(i) for i in range(3)] for t in mesh.triangles()], dtype=int
    )
    edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    _, counts = np.unique(edges, axis=0, return_counts=True)
    if (counts != 2).any():
        raise DisasmError(
            f"{name}: mesh {path.name} of {url} is not watertight "
            f"({int((counts != 2).sum())} edges have not two triangles); close it"
        )


@functools.lru_cache(maxsize=16)
def _refuse_overlap(fixed: tuple[str, float], moved: tuple[str, float]) -> None:
    """Refuses bodies that are inside each other where an episode begins."""
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.0)
    _add_rigid(plant, fixed[0], "part.fixed")
    add_model(plant, moved[0])  # free: between welded bodies no contact is looked for
    plant.Finalize()
    context = builder.Build().CreateDefaultContext()
    port = scene_graph.get_query_output_port()
    query = port.Eval(scene_graph.GetMyContextFromRoot(context))
    surfaces, pairs = query.ComputeContactSurfacesWithFallback(
        HydroelasticContactRepresentation.kPolygon
    )
    touching = [(s.id_M(), s.id_N()) for s in surfaces]
    touching += [(p.id_A, p.id_B) for p in pairs if p.depth > 0.0]
    if touching:
        names = [query.inspector().GetName(i).rpartition("::")[2] for i in touching[0]]
        raise DisasmError(
            f"part.moved: '{names[0]}' and '{names[1]}' overlap where an episode "
            "begins (both root links in one place); move one, or leave more play"
        )
