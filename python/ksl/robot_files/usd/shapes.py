"""Volumes of UsdGeom's solids, which densities make masses of: cubes, spheres, cylinders, cones and capsules."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ksl.base.judged import LENGTH, judged
from ksl.robot_files.assembly import Array
from ksl.robot_files.usd.stage import Prim, Stage

_SOLIDS = {"Cube": ("size",), "Sphere": ("radius",), "Cylinder": ("radius", "height"), "Cone": ("radius", "height"), "Capsule": ("radius", "height")}
"""Types of prims that have a volume, and their lengths."""


class Solid(NamedTuple):
    """In the axes of its prim, without scale: m."""

    volume: float
    centroid: Array
    tensor: Array
    """About the centroid, of density 1, m⁵."""


def solid_of(stage: Stage, prim: Prim) -> Solid | None:
    """The solid that a prim is, with its scale; None for meshes and whatever else a simulator fits shapes of its own to.

    Scales that differ along the axes make no ellipsoid: as UsdPhysics' own parser, a radius takes the largest of those across the axis."""
    kind = prim.kind.type_name
    if kind not in _SOLIDS or (at := stage.place(prim)).is_sheared:
        return None
    x, y, z = at.scale
    lengths = tuple([_length(prim, name) for name in _SOLIDS[kind]])
    axis = "XYZ".index(str(prim.get("axis"))) if len(lengths) == 2 else 2
    return _solid(kind, axis, lengths, (x * stage.length, y * stage.length, z * stage.length))


@lru_cache(maxsize=256)  # parts of a robot are often alike
def _solid(kind: str, axis: int, lengths: tuple[float, ...], scale: tuple[float, float, float]) -> Solid:
    if kind == "Cube":
        return _box(lengths[0] * np.array(scale))
    if kind == "Sphere":
        return _about_axis(_ball(lengths[0] * max(scale)), axis)
    radius, height = lengths[0] * max(x for k, x in enumerate(scale) if k != axis), lengths[1] * scale[axis]
    return _about_axis({"Cylinder": _cylinder, "Cone": _cone, "Capsule": _capsule}[kind](radius, height), axis)


def _length(prim: Prim, name: str) -> float:
    x = float(prim.get(name))
    judged(x, f"prim {prim.path}: its {name}", LENGTH)
    if x < 0:
        raise ValueError(f"prim {prim.path}: its {name} is {x:g}; expected a positive length; correct it in the file")
    return x


_AboutAxis = tuple[float, float, float, float]
"""Volume, the centroid's place on the axis, and the moments across it and about it, of density 1."""


def _box(sides: Array) -> Solid:
    squares = sides**2
    volume = float(sides.prod())
    return Solid(volume, np.zeros(3), np.diag(volume / 12 * (squares.sum() - squares)))


def _ball(radius: float) -> _AboutAxis:
    volume = 4 / 3 * math.pi * radius**3
    return volume, 0.0, 0.4 * volume * radius**2, 0.4 * volume * radius**2


def _cylinder(radius: float, height: float) -> _AboutAxis:
    volume = math.pi * radius**2 * height
    return volume, 0.0, volume * (radius**2 / 4 + height**2 / 12), volume * radius**2 / 2


def _cone(radius: float, height: float) -> _AboutAxis:
    """A cone, whose tip is at + height / 2, its centroid a quarter of the height above the base."""
    volume = math.pi * radius**2 * height / 3
    return volume, -height / 4, volume * (3 / 20 * radius**2 + 3 / 80 * height**2), volume * 3 / 10 * radius**2


def _capsule(radius: float, height: float) -> _AboutAxis:
    """A cylinder with a half ball on each end: the half's centroid is 3/8 of the radius away from the end, and its moment across the axis there 83/320 m r²."""
    middle, _, across, about = _cylinder(radius, height)
    ball, _, _, about_ball = _ball(radius)
    ends = ball * (83 / 320 * radius**2 + (height / 2 + 3 / 8 * radius) ** 2)
    return middle + ball, 0.0, across + ends, about + about_ball


def _about_axis(of: _AboutAxis, axis: int) -> Solid:
    volume, along, across, about = of
    centroid, moments = np.zeros(3), np.full(3, across)
    centroid[axis], moments[axis] = along, about
    return Solid(volume, centroid, np.diag(moments))
