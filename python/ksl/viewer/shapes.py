"""Surfaces of triangles: boxes, cylinders, spheres, arrows, and their simplification.  NumPy alone."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ksl.mechanism.states import Array

Faces = NDArray[np.int32]
Colour = tuple[float, float, float]
"""Red, green and blue, 0 to 1."""

GREY: Colour = (0.75, 0.76, 0.78)
"""The colour of links whose colour the file doesn't give."""


@dataclass(frozen=True)
class Shape:
    """A surface of triangles in one colour."""

    vertices: Array
    """(n, 3), m."""
    faces: Faces
    """(m, 3), indices of vertices, counter-clockwise seen from outside."""
    colour: Colour = GREY

    def moved(self, pose: Array) -> Shape:
        """This shape after a displacement (4, 4)."""
        return replace(self, vertices=self.vertices @ pose[:3, :3].T + pose[:3, 3])


def box(size: Array) -> Shape:
    """A box of these edges (3), m, about the origin."""
    corners = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)]) * size
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    # each side has its own corners, so that edges stay sharp when normals are averaged at vertices
    faces = [[4 * k + a, 4 * k + b, 4 * k + c] for k in range(6) for a, b, c in ((0, 1, 2), (0, 2, 3))]
    return Shape(corners[np.ravel(quads)], np.array(faces, dtype=np.int32))


def surface_of_revolution(radius: Array, height: Array, around: int = 24) -> Shape:
    """The surface that a polyline of radii and heights (n), m, sweeps about z; the heights increase."""
    angle = np.linspace(0, 2 * np.pi, around, endpoint=False)
    circle = np.column_stack([np.cos(angle), np.sin(angle)])
    vertices = np.concatenate([np.column_stack([r * circle, np.full(around, z)]) for r, z in zip(radius, height, strict=True)])
    ring = np.arange(around)
    following = (ring + 1) % around
    faces = []
    for k in range(len(radius) - 1):
        low, high = k * around, (k + 1) * around
        faces += [np.column_stack([low + ring, low + following, high + following]), np.column_stack([low + ring, high + following, high + ring])]
    return Shape(vertices, np.concatenate(faces).astype(np.int32))


def cylinder(radius: float, length: float, around: int = 24) -> Shape:
    """A closed cylinder about z, its centre at the origin; m."""
    half = length / 2  # rings at the rims are doubled, so that the edges stay sharp
    return surface_of_revolution(np.array([0, radius, radius, radius, radius, 0]), np.array([-half, -half, -half, half, half, half]), around)


def ellipsoid(semi_axes: Array, around: int = 20) -> Shape:
    """An ellipsoid about the origin with these semi-axes (3) along x, y and z, m."""
    latitude = np.linspace(-np.pi / 2, np.pi / 2, around // 2 + 1)
    unit = surface_of_revolution(np.cos(latitude), np.sin(latitude), around)
    return replace(unit, vertices=unit.vertices * semi_axes)


def arrows(start: Array, vector: Array, radius: float, heads: int = 1, around: int = 10) -> Shape:
    """Arrows from `start` (n, 3) along `vector` (n, 3), whose tips are at start + vector; m.

    The shaft has this radius.  The head is six radii long, or 0.4 of a short arrow; with heads=2 a second one follows the first.
    """
    length = np.linalg.norm(vector, axis=1)
    parts = [_arrow(s, v, l, radius, heads, around) for s, v, l in zip(start, vector, length, strict=True) if l > 0]
    return joined(parts) if parts else Shape(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int32))


def rod(start: Array, end: Array, radius: float, colour: Colour, around: int = 8) -> Shape:
    """A closed cylinder between two points (3), m."""
    length = float(np.linalg.norm(end - start))
    if length == 0:
        return Shape(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int32), colour)
    tube = surface_of_revolution(np.array([0, radius, radius, 0]), np.array([0, 0, length, length]), around)
    return replace(tube.moved(_pose_along(start, (end - start) / length)), colour=colour)


def unit_shaft() -> Shape:
    """A cylinder of radius 1 m from the origin to z = 1 m."""
    return surface_of_revolution(np.array([0.0, 1, 1, 1, 1, 0]), np.array([0.0, 0, 0, 1, 1, 1]), 12)


def unit_head() -> Shape:
    """A cone of radius 1 m whose base is at the origin, and whose tip is at z = 1 m."""
    return surface_of_revolution(np.array([0.0, 1, 1, 0]), np.array([0.0, 0, 0, 1]), 16)


def _arrow(start: Array, vector: Array, length: float, radius: float, heads: int, around: int) -> Shape:
    head = min(6 * radius, 0.4 * length / heads)
    thick = radius * head / (6 * radius)  # short arrows are thinner, too
    r, z = [0.0, thick, thick], [0.0, 0.0, length - heads * head]
    for k in range(heads, 0, -1):
        r += [2.2 * thick, thick if k > 1 else 0.0]
        z += [length - k * head, length - (k - 1) * head]
    return surface_of_revolution(np.array(r), np.array(z), around).moved(_pose_along(start, vector / length))


def _pose_along(origin: Array, z: Array) -> Array:
    """A pose whose z points along a unit vector."""
    x = np.cross(np.eye(3)[np.argmin(np.abs(z))], z)
    x /= np.linalg.norm(x)
    pose = np.eye(4)
    pose[:3, 0], pose[:3, 1], pose[:3, 2], pose[:3, 3] = x, np.cross(z, x), z, origin
    return pose


def joined(parts: list[Shape]) -> Shape:
    """One surface of several, in the colour of the first."""
    starts = np.cumsum([0, *(len(p.vertices) for p in parts[:-1])])
    faces = np.concatenate([p.faces + start for p, start in zip(parts, starts, strict=True)]).astype(np.int32)
    return Shape(np.concatenate([p.vertices for p in parts]), faces, parts[0].colour)


def simplified(shape: Shape, most: int) -> Shape:
    """The surface with at most about `most` triangles: vertices in the same cell of a grid become one, at their mean.

    The cells grow until few enough triangles are left.  O(triangles) for each of about ten sizes.
    Rossignac and Borrel, Multi-resolution 3D approximations for rendering complex scenes, 1993.
    """
    if len(shape.faces) <= most:
        return shape
    low = shape.vertices.min(axis=0)
    extent = float((shape.vertices.max(axis=0) - low).max())
    coarse, fine = 3.0, 512.0  # cells along the longest edge of the bounding box
    result = _clustered(shape, low, extent / coarse)
    for _ in range(8):
        cells = np.sqrt(coarse * fine)
        found = _clustered(shape, low, extent / cells)
        if len(found.faces) > most:
            fine = cells
        else:
            coarse, result = cells, found
            if len(found.faces) > 0.8 * most:
                break
    return result


def _clustered(shape: Shape, low: Array, cell: float) -> Shape:
    index = ((shape.vertices - low) / cell).astype(np.int64)
    key = (index[:, 0] << 42) | (index[:, 1] << 21) | index[:, 2]
    _, of, count = np.unique(key, return_inverse=True, return_counts=True)
    means = np.column_stack([np.bincount(of, weights=shape.vertices[:, c]) for c in range(3)]) / count[:, None]
    faces = of.reshape(-1)[shape.faces]
    keep = (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])
    return Shape(means, np.unique(faces[keep], axis=0).astype(np.int32), shape.colour)
