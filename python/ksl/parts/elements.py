"""Solid elements of meshes: their faces, shape functions and points of integration, numbered as Abaqus and CalculiX have them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ksl.mechanism.states import Array

ORDER = 4
"""Points of Gauss and Legendre in each direction: exact for polynomials of degree 5 in tetrahedra and 7 in hexahedra."""

TETRAHEDRON_EDGES = ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3))
HEXAHEDRON_CORNERS = np.array([(-1, -1, -1), (1, -1, -1), (1, 1, -1), (-1, 1, -1), (-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)], dtype=float)
HEXAHEDRON_EDGES = ((0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7))
TETRAHEDRON_FACES = ((0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0))
HEXAHEDRON_FACES = ((0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0))


@dataclass(frozen=True)
class Kind:
    """A kind of solid element."""

    nodes: int
    faces: tuple[tuple[int, ...], ...]
    """Corners of each face, S1 first."""
    edges: tuple[tuple[int, int], ...]
    """Ends of the edges whose middles are the nodes after the corners."""
    shape: Callable[[Array], Array]
    """(points, nodes) shape functions at points (points, 3)."""
    slope: Callable[[Array], Array]
    """(points, nodes, 3) their derivatives."""
    nastran: str
    is_tetrahedron: bool

    @property
    def corners(self) -> int:
        return 4 if self.is_tetrahedron else 8

    @cached_property
    def rule(self) -> tuple[Array, Array]:
        """Points (points, 3) and weights of integration."""
        x, w = np.polynomial.legendre.leggauss(ORDER)
        grid = np.stack(np.meshgrid(x, x, x, indexing="ij"), axis=-1).reshape(-1, 3)
        weight = np.einsum("i,j,k->ijk", w, w, w).ravel()
        if not self.is_tetrahedron:
            return grid, weight
        u, v, t = ((grid + 1) / 2).T  # a cube whose far end is drawn together (Stroud 1971)
        return np.column_stack([u, v * (1 - u), t * (1 - u) * (1 - v)]), weight / 8 * (1 - u) ** 2 * (1 - v)

    def face_nodes(self, face: int) -> tuple[int, ...]:
        """All nodes of a face, those of its edges too."""
        corners = self.faces[face]
        middles = [self.corners + i for i, (a, b) in enumerate(self.edges) if a in corners and b in corners] if self.nodes > self.corners else []
        return (*corners, *middles)


def _barycentric(x: Array) -> Array:
    return np.column_stack([1 - x.sum(axis=1), x])


_SLOPES = np.vstack([-np.ones(3), np.eye(3)])


def _tetrahedron(x: Array) -> Array:
    return _barycentric(x)


def _tetrahedron_slope(x: Array) -> Array:
    return np.broadcast_to(_SLOPES, (len(x), 4, 3))


def _tetrahedron_10(x: Array) -> Array:
    L = _barycentric(x)
    middles = [4 * L[:, a] * L[:, b] for a, b in TETRAHEDRON_EDGES]
    return np.column_stack([L * (2 * L - 1), *middles])


def _tetrahedron_10_slope(x: Array) -> Array:
    L = _barycentric(x)
    corners = (4 * L - 1)[..., None] * _SLOPES
    middles = [4 * (L[:, a, None] * _SLOPES[b] + L[:, b, None] * _SLOPES[a]) for a, b in TETRAHEDRON_EDGES]
    return np.concatenate([corners, np.stack(middles, axis=1)], axis=1)


def _hexahedron(x: Array) -> Array:
    return np.asarray(np.prod(1 + x[:, None] * HEXAHEDRON_CORNERS, axis=2) / 8)


def _hexahedron_slope(x: Array) -> Array:
    f = 1 + x[:, None] * HEXAHEDRON_CORNERS
    return np.stack([HEXAHEDRON_CORNERS[:, i] * f[..., (i + 1) % 3] * f[..., (i + 2) % 3] / 8 for i in range(3)], axis=-1)


def _middles() -> Array:
    return np.array([(HEXAHEDRON_CORNERS[a] + HEXAHEDRON_CORNERS[b]) / 2 for a, b in HEXAHEDRON_EDGES])


def _hexahedron_20(x: Array) -> Array:
    corners = _hexahedron(x) * (x @ HEXAHEDRON_CORNERS.T - 2)
    m = _middles()
    factors = np.where(m == 0, 1 - x[:, None] ** 2, 1 + x[:, None] * m)
    return np.concatenate([corners, np.prod(factors, axis=2) / 4], axis=1)


def _hexahedron_20_slope(x: Array) -> Array:
    corners = _hexahedron_slope(x) * (x @ HEXAHEDRON_CORNERS.T - 2)[..., None] + _hexahedron(x)[..., None] * HEXAHEDRON_CORNERS
    m = _middles()
    f = np.where(m == 0, 1 - x[:, None] ** 2, 1 + x[:, None] * m)
    d = np.where(m == 0, -2 * x[:, None], m)
    middles = np.stack([d[..., i] * f[..., (i + 1) % 3] * f[..., (i + 2) % 3] / 4 for i in range(3)], axis=-1)
    return np.concatenate([corners, middles], axis=1)


_TETRAHEDRON = Kind(4, TETRAHEDRON_FACES, TETRAHEDRON_EDGES, _tetrahedron, _tetrahedron_slope, "CTETRA", True)
_TETRAHEDRON_10 = Kind(10, TETRAHEDRON_FACES, TETRAHEDRON_EDGES, _tetrahedron_10, _tetrahedron_10_slope, "CTETRA", True)
_HEXAHEDRON = Kind(8, HEXAHEDRON_FACES, HEXAHEDRON_EDGES, _hexahedron, _hexahedron_slope, "CHEXA", False)
_HEXAHEDRON_20 = Kind(20, HEXAHEDRON_FACES, HEXAHEDRON_EDGES, _hexahedron_20, _hexahedron_20_slope, "CHEXA", False)

KINDS: dict[str, Kind] = {
    "C3D4": _TETRAHEDRON, "C3D10": _TETRAHEDRON_10, "C3D10M": _TETRAHEDRON_10, "C3D10T": _TETRAHEDRON_10,
    "C3D8": _HEXAHEDRON, "C3D8R": _HEXAHEDRON, "C3D8I": _HEXAHEDRON, "C3D20": _HEXAHEDRON_20, "C3D20R": _HEXAHEDRON_20,
}  # fmt: skip
"""Solid elements that are read, by their names there."""
