"""Makes the visual meshes of the iiwa 14 in `iiwa14/meshes/`.

    python models/make_meshes.py

writes one glTF file (and its .bin) per link, the same bits on every run. The
shapes are our own: a link's housing is a signed-distance function put together
from a few rounded cylinders, turned into triangles by surface nets; covers and
rings are turned on a lathe. They look like the robot; they are not its CAD, and
nothing in the dynamics uses them.

A housing's vertices are moved onto the surface by Newton steps and carry the
gradient as their normal, so that a coarse grid still shades smoothly. Housings
use only exactly rounded arithmetic (+, -, *, /, sqrt, min, max), and all
vertices are rounded to 10 micrometres, so that machines agree on the bits.

Lengths are in metres. Link halves are designed in coordinates (x, t, h): h
along the tube, t along the axis of the elbow joint towards the drum's cover.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np

Array = np.ndarray
Sdf = Callable[[Array], Array]

MESH_DIR = Path(__file__).resolve().parent / "iiwa14" / "meshes"

# Linear RGB of each material, then its roughness.
MATERIALS = {
    "silver": ((0.66, 0.68, 0.70), 0.45),
    "orange": ((1.00, 0.17, 0.005), 0.45),
    "grey": ((0.10, 0.105, 0.11), 0.55),
    "black": ((0.012, 0.012, 0.013), 0.50),
}


@dataclass(frozen=True)
class Mesh:
    """Triangles of one colour."""

    material: str
    points: Array  # (n, 3), m.
    normals: Array  # (n, 3).
    triangles: Array  # (m, 3), anticlockwise seen from outside.


# --- Signed distances. Points are (n, 3), distances (n,), in metres. ---


def smooth_min(a: Array, b: Array, radius: float) -> Array:
    """The union of two shapes with a fillet of about `radius`."""
    blend = np.maximum(radius - np.abs(a - b), 0.0) / radius
    return np.minimum(a, b) - blend * blend * radius * 0.25


def smooth_max(a: Array, b: Array, radius: float) -> Array:
    """The intersection of two shapes with a rounded edge."""
    return -smooth_min(-a, -b, radius)


def sphere(center: tuple[float, ...], radius: float) -> Sdf:
    """A ball."""

    def sdf(p: Array) -> Array:
        d = p - np.array(center)
        return np.sqrt(d[:, 0] ** 2 + d[:, 1] ** 2 + d[:, 2] ** 2) - radius

    return sdf


def cone(
    axis: int,
    center: tuple[float, float],
    span: tuple[float, float],
    radii: tuple[float, float],
    edge: float,
) -> Sdf:
    """A round-edged cylinder or cone along a coordinate axis.

    Args:
        axis: 0, 1 or 2.
        center: the two other coordinates, in ascending order.
        span: where it begins and ends along the axis.
        radii: its radius at the two ends.
        edge: radius of the rounded edges.
    """
    i, j = (k for k in range(3) if k != axis)
    middle, half = (span[0] + span[1]) / 2, (span[1] - span[0]) / 2
    slope = (radii[1] - radii[0]) / (span[1] - span[0])

    def sdf(p: Array) -> Array:
        du, dv = p[:, i] - center[0], p[:, j] - center[1]
        along = np.clip(p[:, axis], span[0], span[1]) - span[0]
        side = np.sqrt(du * du + dv * dv) - radii[0] - slope * along + edge
        end = np.abs(p[:, axis] - middle) - half + edge
        outside = np.sqrt(np.maximum(side, 0) ** 2 + np.maximum(end, 0) ** 2)
        return np.minimum(np.maximum(side, end), 0) + outside - edge

    return sdf


def box(center: tuple[float, ...], half: tuple[float, ...], edge: float) -> Sdf:
    """A round-edged box."""

    def sdf(p: Array) -> Array:
        q = np.abs(p - np.array(center)) - np.array(half) + edge
        r = np.maximum(q, 0)
        outside = np.sqrt(r[:, 0] ** 2 + r[:, 1] ** 2 + r[:, 2] ** 2)
        inside = np.maximum(np.maximum(q[:, 0], q[:, 1]), q[:, 2])
        return np.minimum(inside, 0) + outside - edge

    return sdf


def union(shapes: list[Sdf], radius: float) -> Sdf:
    """The smooth union of several shapes."""

    def sdf(p: Array) -> Array:
        result = shapes[0](p)
        for shape in shapes[1:]:
            result = smooth_min(result, shape(p), radius)
        return result

    return sdf


def cut(shape: Sdf, tool: Sdf, radius: float) -> Sdf:
    """`shape` without `tool`, the new edges rounded."""
    return lambda p: smooth_max(shape(p), -tool(p), radius)


# --- Surface nets. ---

Box = tuple[tuple[float, float, float], tuple[float, float, float]]


def _sample(sdf: Sdf, bounds: Box, step: float) -> tuple[Array, Array]:
    """The values on a grid one step wider than `bounds`, and its origin."""
    lower, upper = np.array(bounds[0]) - step, np.array(bounds[1]) + step
    shape = tuple(int(n) for n in np.ceil((upper - lower) / step) + 1)
    index = np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), -1)
    points = lower + index.reshape(-1, 3) * step
    return sdf(points).reshape(shape), lower


def _gradient(sdf: Sdf, points: Array, h: float = 2e-4) -> Array:
    """The unit gradient of `sdf` at the points, (n, 3)."""
    columns = []
    for k in range(3):
        e = np.zeros(3)
        e[k] = h
        columns.append(sdf(points + e) - sdf(points - e))
    g = np.stack(columns, -1)
    norm = np.sqrt(g[:, 0] ** 2 + g[:, 1] ** 2 + g[:, 2] ** 2)
    return g / np.maximum(norm, 1e-12)[:, None]


def _cell_vertices(values: Array) -> tuple[Array, Array]:
    """Cells that the surface crosses, and the mean of their edge crossings."""
    n = tuple(s - 1 for s in values.shape)
    total, count = np.zeros((*n, 3)), np.zeros(n)
    corners = [(i, j, k) for i in (0, 1) for j in (0, 1) for k in (0, 1)]
    at = {
        c: values[tuple(slice(o, o + m) for o, m in zip(c, n, strict=True))]
        for c in corners
    }
    for a in corners:
        for axis in (k for k in range(3) if a[k] == 0):
            b = tuple(v + (k == axis) for k, v in enumerate(a))
            crossed = (at[a] < 0) != (at[b] < 0)
            gap = np.where(crossed, at[a] - at[b], 1.0)
            point = np.broadcast_to(np.array(a, float), (*n, 3)).copy()
            point[..., axis] += at[a] / gap
            total += np.where(crossed[..., None], point, 0.0)
            count += crossed
    cells = np.argwhere(count > 0)
    mean = total[count > 0] / count[count > 0][:, None]
    return cells, cells + mean


def _quads(values: Array, index: Array) -> Array:
    """One quadrilateral of vertex numbers for each crossed grid edge."""
    quads = []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        low = np.delete(values < 0, -1, axis)
        high = np.delete(values < 0, 0, axis)
        edge = np.argwhere(low != high)
        flip = ~low[tuple(edge.T)]
        ring = []
        for du, dv in ((1, 1), (0, 1), (0, 0), (1, 0)):
            cell = edge.copy()
            cell[:, u] -= du
            cell[:, v] -= dv
            ring.append(index[tuple(cell.T)])
        quad = np.stack(ring, -1)
        quads.append(np.where(flip[:, None], quad[:, ::-1], quad))
    return np.concatenate(quads)


def surface(material: str, sdf: Sdf, bounds: Box, step: float) -> Mesh:
    """The zero level of `sdf`, which must lie within `bounds`."""
    values, lower = _sample(sdf, bounds, step)
    cells, mean = _cell_vertices(values)
    index = np.full(tuple(s - 1 for s in values.shape), -1)
    index[tuple(cells.T)] = np.arange(len(cells))
    quads = _quads(values, index)
    if quads.min() < 0:
        raise ValueError("The surface leaves its bounds.")
    points = lower + mean * step
    for _ in range(6):
        offset = np.clip(sdf(points), -step, step)
        points = points - 0.8 * offset[:, None] * _gradient(sdf, points)
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    return Mesh(material, points, _gradient(sdf, points), triangles)


# --- Lathe. ---

Rows = tuple[tuple[int, int], tuple[int, int], tuple[int, int]]


def lathe(material: str, profile: list[tuple[float, float]], sides: int = 36) -> Mesh:
    """Turns a profile about the h axis, each of its segments shaded as a cone.

    Args:
        material: a key of `MATERIALS`.
        profile: points (radius, h), anticlockwise in the (radius, h) half plane.
        sides: number of facets.
    """
    angle = np.arange(sides) * (2 * np.pi / sides)
    c, s = np.cos(angle), np.sin(angle)
    points, normals, triangles = [], [], []
    for k, ((r0, h0), (r1, h1)) in enumerate(pairwise(profile)):
        size = ((r1 - r0) ** 2 + (h1 - h0) ** 2) ** 0.5
        n_r, n_h = (h1 - h0) / size, -(r1 - r0) / size
        for r, h in ((r0, h0), (r1, h1)):
            points.append(np.stack([r * c, r * s, np.full(sides, h)], -1))
            normals.append(np.stack([n_r * c, n_r * s, np.full(sides, n_h)], -1))
        a = 2 * k * sides + np.arange(sides)
        b = 2 * k * sides + (np.arange(sides) + 1) % sides
        if r0 > 0:
            triangles.append(np.stack([a, b, b + sides], -1))
        if r1 > 0:
            triangles.append(np.stack([a, b + sides, a + sides], -1))
    stacked = (np.concatenate(part) for part in (points, normals, triangles))
    return Mesh(material, *stacked)


def ring(material: str, radius: float, low: float, high: float) -> Mesh:
    """A disc with a small chamfer, from h = low to high."""
    b = 0.0015
    corners = [(radius, low), (radius, high - b), (radius - b, high)]
    return lathe(material, [(0, low), *corners, (0, high)])


def placed(mesh: Mesh, rows: Rows, shift: float = 0.0) -> Mesh:
    """A mesh moved by `shift` along h and put into a link's coordinates.

    Args:
        mesh: in (x, t, h).
        rows: for each of x, t, h the link's axis and sign that it lies along.
        shift: in m.
    """
    axes, signs = np.array(rows).T
    points, normals = np.empty_like(mesh.points), np.empty_like(mesh.normals)
    points[:, axes] = (mesh.points + np.array([0.0, 0.0, shift])) * signs
    normals[:, axes] = mesh.normals * signs
    mirrored = np.prod(signs) * np.linalg.det(np.eye(3)[axes]) < 0
    triangles = mesh.triangles[:, ::-1] if mirrored else mesh.triangles
    return replace(mesh, points=points, normals=normals, triangles=triangles)


# --- glTF. ---


def _material(name: str) -> dict:
    rgb, roughness = MATERIALS[name]
    return {
        "name": name,
        "pbrMetallicRoughness": {
            "baseColorFactor": [*rgb, 1.0],
            "metallicFactor": 0.0,
            "roughnessFactor": roughness,
        },
    }


def _y_up(vectors: Array, digits: int) -> Array:
    """Rounded vectors in glTF's axes, float32."""
    x, y, z = (np.round(vectors, digits) + 0.0).T
    return np.stack([x, z, 0.0 - y], -1).astype("<f4")


class GltfWriter:
    """Collects meshes and writes them as one glTF 2.0 file with its .bin.

    glTF has y up: the axes (x, y, z) of a link are stored as (x, z, -y), which
    Drake turns back when it reads the file.
    """

    def __init__(self) -> None:
        self._blob = b""
        self._views: list[dict] = []
        self._accessors: list[dict] = []
        self._primitives: list[dict] = []
        self._materials: list[str] = []

    def _add_array(self, array: Array, component: int, target: int) -> int:
        data = array.tobytes()
        view = {"buffer": 0, "byteOffset": len(self._blob), "byteLength": len(data)}
        self._views.append({**view, "target": target})
        self._blob += data + b"\0" * (-len(data) % 4)
        accessor = {
            "bufferView": len(self._views) - 1,
            "componentType": component,
            "count": array.size if component == 5123 else len(array),
            "type": "SCALAR" if component == 5123 else "VEC3",
        }
        self._accessors.append(accessor)
        return len(self._accessors) - 1

    def add(self, mesh: Mesh) -> None:
        """Adds a mesh as one primitive."""
        points = _y_up(mesh.points, 5)
        normals = _y_up(mesh.normals, 4)
        position = self._add_array(points, 5126, 34962)
        self._accessors[position]["min"] = points.min(0).tolist()
        self._accessors[position]["max"] = points.max(0).tolist()
        normal = self._add_array(normals, 5126, 34962)
        indices = self._add_array(mesh.triangles.astype("<u2"), 5123, 34963)
        if mesh.material not in self._materials:
            self._materials.append(mesh.material)
        primitive = {
            "attributes": {"POSITION": position, "NORMAL": normal},
            "indices": indices,
            "material": self._materials.index(mesh.material),
        }
        self._primitives.append(primitive)

    def write(self, path: Path) -> None:
        """Writes the file."""
        binary = path.with_suffix(".bin")
        binary.write_bytes(self._blob)
        document = {
            "asset": {"version": "2.0", "generator": "models/make_meshes.py"},
            "scene": 0,
            "scenes": [{"nodes": [0]}],
            "nodes": [{"mesh": 0, "name": path.stem}],
            "meshes": [{"primitives": self._primitives}],
            "materials": [_material(name) for name in self._materials],
            "accessors": self._accessors,
            "bufferViews": self._views,
            "buffers": [{"byteLength": len(self._blob), "uri": binary.name}],
        }
        path.write_text(json.dumps(document, indent=1) + "\n")


# --- The links. ---


@dataclass(frozen=True)
class Half:
    """One half of an elbow: a tube that ends in a drum beside the joint.

    The half fills t > `gap` at the drum, its partner t < `gap`.
    """

    height: float  # From the tube's end to the joint's axis, m.
    tube: float  # Tube radius, m.
    drum: float  # Drum radius, m.
    reach: float  # Where the drum ends along the joint's axis, m.
    partner: float  # Radius of the partner's drum, m.
    gap: float = 0.0  # Where the halves meet along the joint's axis, m.

    def shell(self) -> Sdf:
        """The housing."""
        h, r = self.height, self.tube
        tube = cone(2, (0, 0), (0.006, h * 0.62), (r, r * 0.97), 0.006)
        drum = cone(1, (0, h), (self.gap, self.reach), (self.drum, self.drum), 0.03)
        shoulder = sphere((0, self.reach * 0.33, h * 0.66), self.drum * 0.80)
        whole = union([tube, drum, shoulder], 0.04)
        half = cut(self._halved(whole), self._scoop(), 0.006)
        face = self.reach + 0.002
        return lambda p: smooth_max(half(p), p[:, 1] - face, 0.012)

    def _halved(self, whole: Sdf) -> Sdf:
        """`whole` on this side of the plane between the drums, near them."""
        top = self.height - self.partner * 0.25

        def block(p: Array) -> Array:
            return np.maximum(p[:, 1] - self.gap - 0.001, top - p[:, 2])

        return cut(whole, block, 0.006)

    def _scoop(self) -> Sdf:
        """Room for the partner's drum."""
        far = self.gap - 0.2
        r = self.partner + 0.002
        return cone(1, (0, self.height), (far, self.gap + 0.001), (r, r), 0.002)

    def meshes(self, step: float) -> list[Mesh]:
        """Housing, cover and the dark ring at the tube's end."""
        wide, low = self.drum + 0.02, -self.tube - 0.02
        lower = (-wide, low, -0.01)
        upper = (wide, self.reach + 0.03, self.height + self.drum + 0.02)
        return [
            surface("silver", self.shell(), (lower, upper), step),
            *(self._beside(mesh) for mesh in self._cover()),
            ring("black", self.tube + 0.001, 0.001, 0.013),
        ]

    def _cover(self) -> list[Mesh]:
        """The orange cover of the drum, about the h axis."""
        r, t = self.drum * 0.80, self.reach
        rim = [(r, t - 0.03), (r, t + 0.004), (r - 0.003, t + 0.007)]
        dome = [(r * 0.75, t + 0.009), (r * 0.4, t + 0.010), (0.0, t + 0.0105)]
        return [lathe("orange", [*rim, *dome])]

    def _beside(self, mesh: Mesh) -> Mesh:
        """From about the h axis to about the joint's axis."""
        turned = placed(mesh, ((0, -1), (2, 1), (1, 1)))
        return replace(turned, points=turned.points + np.array([0, 0, self.height]))


def half_link(
    half: Half, rows: Rows, shift: float = 0.0, step: float = 0.0155
) -> list[Mesh]:
    """The meshes of a half in its link's frame."""
    return [placed(mesh, rows, shift) for mesh in half.meshes(step)]


def base() -> list[Mesh]:
    """Link 0: foot, connector box at the back, collar."""
    collar = cone(2, (0, 0), (0.02, 0.150), (0.098, 0.076), 0.012)
    back = box((-0.085, 0, 0.060), (0.075, 0.060, 0.042), 0.02)
    heel = box((-0.085, 0, 0.012), (0.085, 0.070, 0.012), 0.004)
    bounds = (-0.18, -0.11, 0.0), (0.11, 0.11, 0.16)
    return [
        surface("silver", union([collar, back], 0.03), bounds, 0.0165),
        surface("black", heel, ((-0.18, -0.08, 0.0), (0.01, 0.08, 0.03)), 0.02),
        ring("black", 0.108, 0.0, 0.024),
        ring("black", 0.069, 0.145, 0.1570),
    ]


def hand() -> list[Mesh]:
    """Link 7: the media flange."""
    return [
        ring("black", 0.044, -0.008, 0.004),
        ring("grey", 0.047, 0.003, 0.030),
        ring("black", 0.0475, 0.012, 0.020),
        ring("silver", 0.0395, 0.028, 0.045),
    ]


# Link axes along which x, t and h lie (axis, sign); see the joint table.
BELOW_MINUS_Y = ((0, 1), (1, -1), (2, 1))
BELOW_PLUS_Y = ((0, 1), (1, 1), (2, 1))
ABOVE = ((0, 1), (2, 1), (1, -1))


def links() -> dict[str, list[Mesh]]:
    """The meshes of each link in its own frame."""
    elbow2, elbow4 = (0.080, 0.092), (0.074, 0.086)
    one = Half(0.2025, 0.070, *elbow2, 0.080)
    two = Half(0.2045, 0.068, *elbow2, 0.080)
    three = Half(0.2155, 0.066, *elbow4, 0.074)
    four = Half(0.1845, 0.064, *elbow4, 0.074)
    five = Half(0.2155, 0.060, 0.056, 0.082, 0.066, 0.018)
    six = Half(0.081, 0.046, 0.066, 0.072, 0.056, -0.016)
    return {
        "link_0": base(),
        "link_1": half_link(one, BELOW_MINUS_Y),
        "link_2": half_link(two, ABOVE, -0.2045),
        "link_3": half_link(three, BELOW_PLUS_Y),
        "link_4": half_link(four, ABOVE, -0.1845),
        "link_5": half_link(five, BELOW_PLUS_Y),
        "link_6": half_link(six, ABOVE, -0.081, 0.0125),
        "link_7": hand(),
    }


def main() -> None:
    """Writes every mesh."""
    MESH_DIR.mkdir(parents=True, exist_ok=True)
    for name, meshes in links().items():
        writer = GltfWriter()
        for mesh in meshes:
            writer.add(mesh)
        writer.write(MESH_DIR / f"{name}.gltf")


if __name__ == "__main__":
    main()
