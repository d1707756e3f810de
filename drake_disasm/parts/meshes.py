"""Meshes of fixed bodies that no simple shape describes."""

import numpy as np
from pydrake.common import MemoryFile
from pydrake.geometry import InMemoryMesh, Mesh


def circle(radius: float, facets: int) -> np.ndarray:
    """Returns the corners (facets, 2) in x and z of a polygon around a circle [m].

    Its sides are tangent, four of them across x and z: there the radius is exact.
    """
    angle = 2 * np.pi * (np.arange(facets) + 0.5) / facets
    corners = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return radius / np.cos(np.pi / facets) * corners


def tube(inside: np.ndarray, outer: float, low: float, high: float) -> Mesh:
    """Returns a tube along y, closed, as a mesh whose normals point out of it.

    Args:
        inside: (n, 2) corners of the hole in x and z, by angle about y from x to z; a
            ray from the axis meets the outline once [m].
        outer: radius [m].
        low, high: y of its faces [m].
    """
    direction = inside / np.linalg.norm(inside, axis=1, keepdims=True)
    rings = [(xz, y) for y in (low, high) for xz in (inside, outer * direction)]
    corners = [(x, y, z) for xz, y in rings for x, z in xz]
    lines = [f"v {x:.12g} {y:.12g} {z:.12g}" for x, y, z in corners]
    bottom_in, bottom_out, top_in, top_out = (
        1 + ring * len(inside) + np.arange(len(inside)) for ring in range(4)
    )
    for one, other in (
        (top_in, bottom_in),
        (bottom_in, bottom_out),
        (bottom_out, top_out),
        (top_out, top_in),
    ):
        quads = zip(one, other, np.roll(other, -1), np.roll(one, -1), strict=True)
        lines += ["f " + " ".join(map(str, quad)) for quad in quads]
    text = "\n".join(lines).encode()
    return Mesh(InMemoryMesh(mesh_file=MemoryFile(text, ".obj", "tube")))
