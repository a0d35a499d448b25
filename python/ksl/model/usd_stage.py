"""What a USD stage says of rigid bodies: units, axes, gravity, poses and masses, in SI units."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ksl.model.assembly import Array, Body

EARTH = 9.81
"""m/s²: USD has the magnitude of the Earth's gravity as -inf, and leaves the number to whoever reads it."""


@dataclass
class Stage:
    """A stage with its units, and what is said of it."""

    stage: Any
    length: float
    """m of its unit."""
    mass: float
    """kg of its unit."""
    up: str
    name: str
    """The name of the default prim; empty without one."""
    said: list[str] = field(default_factory=list)
    """Warnings."""
    unused: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        from pxr import UsdGeom

        self.cache = UsdGeom.XformCache()

    def prims(self) -> Iterator[Any]:
        from pxr import Usd

        return iter(Usd.PrimRange.Stage(self.stage, Usd.TraverseInstanceProxies()))

    def pose(self, prim: Any) -> Array:
        """Rotation and translation (4, 4) of a prim in the world, m, without its scale."""
        matrix = self.cache.GetLocalToWorldTransform(prim)
        made = np.eye(4)
        made[:3, :3] = np.array(matrix.RemoveScaleShear().ExtractRotationMatrix()).T  # rows are vectors in USD
        made[:3, 3] = np.array(matrix.ExtractTranslation()) * self.length
        return made

    def point(self, prim: Any, local: Any) -> Array:
        """A point of a prim's space in the world, m: scales of the prim and its ancestors count."""
        return np.array(self.cache.GetLocalToWorldTransform(prim).Transform(_double(local))) * self.length


def _double(vector: Any) -> Any:
    from pxr import Gf

    return Gf.Vec3d(*(float(x) for x in vector))


def units_of(stage: Any) -> Stage:
    """The stage with the units that it gives, or that USD has where it gives none; what is converted is said."""
    from pxr import UsdGeom, UsdPhysics

    length, mass = UsdGeom.GetStageMetersPerUnit(stage), UsdPhysics.GetStageKilogramsPerUnit(stage)
    up = str(UsdGeom.GetStageUpAxis(stage))
    default = stage.GetDefaultPrim()
    made = Stage(stage, float(length), float(mass), up, str(default.GetName()) if default else "")
    if not UsdGeom.StageHasAuthoredMetersPerUnit(stage):
        made.said.append("the file doesn't give metersPerUnit; lengths are taken in centimetres, USD's default: give metersPerUnit = 1 if they are in m")
    elif length != 1.0:
        made.said.append(f"lengths are in units of {length:g} m (metersPerUnit), converted to m")
    if mass != 1.0:
        made.said.append(f"masses are in units of {mass:g} kg (kilogramsPerUnit), converted to kg")
    if up != "Z":
        made.said.append(f"up is the axis {up} of the file (upAxis): the world's axes stay as they are, and gravity points down along {up}")
    return made


def gravity_of(stage: Stage) -> Array:
    """In world axes, m/s²: that of the first physics scene, or the Earth's, down."""
    from pxr import UsdPhysics

    down = np.array((0.0, -1.0, 0.0) if stage.up == "Y" else (0.0, 0.0, -1.0))
    scenes = [prim for prim in stage.prims() if prim.IsA(UsdPhysics.Scene)]
    if not scenes:
        return EARTH * down
    if len(scenes) > 1:
        stage.said.append(f"{len(scenes)} physics scenes; gravity is that of the first, {scenes[0].GetPath()}")
    scene = UsdPhysics.Scene(scenes[0])
    direction = np.array(scene.GetGravityDirectionAttr().Get() or (0, 0, 0), dtype=float)
    magnitude = float(scene.GetGravityMagnitudeAttr().Get())
    size = float(np.linalg.norm(direction))
    if abs(magnitude - EARTH) < 0.1 and stage.length != 1.0:  # which USD has in units of lengths
        stage.said.append(f"gravity is {magnitude * stage.length:.3g} m/s², {magnitude:g} in units of {stage.length:g} m: give {EARTH / stage.length:g} if it is the Earth's")
    return (direction / size if size > 0 else down) * (magnitude * stage.length if math.isfinite(magnitude) and magnitude >= 0 else EARTH)


def bodies_of(stage: Stage) -> dict[str, Body]:
    """{path of the prim: body} of all rigid bodies that are enabled."""
    from pxr import UsdPhysics

    found: dict[str, Any] = {}
    for prim in stage.prims():
        if prim.HasAPI(UsdPhysics.RigidBodyAPI):
            if UsdPhysics.RigidBodyAPI(prim).GetRigidBodyEnabledAttr().Get():
                found[str(prim.GetPath())] = prim
            else:
                stage.unused.append(f"rigid body {prim.GetPath()} (not enabled)")
    names = short_names(list(found))
    return {path: _body(stage, prim, names[path], found.keys()) for path, prim in found.items()}


def short_names(paths: list[str]) -> dict[str, str]:
    """The last parts of paths, as many as tell them apart."""
    names: dict[str, str] = {}
    groups: dict[str, list[str]] = {}
    for path in paths:
        groups.setdefault(path.rpartition("/")[2], []).append(path)
    for last, same in groups.items():
        for path in same:
            names[path] = last if len(same) == 1 else path.strip("/").replace("/", "_")
    return names


def _body(stage: Stage, prim: Any, name: str, bodies: Any) -> Body:
    from pxr import Usd, UsdPhysics

    body = Body(name, stage.pose(prim))
    parts = [prim] if _mass(prim) > 0 else []
    if not parts:  # the mass of a body is that of its parts, where it has none of its own
        walk = iter(Usd.PrimRange(prim, Usd.TraverseInstanceProxies()))
        for child in walk:
            if child != prim and str(child.GetPath()) in bodies:
                walk.PruneChildren()
            elif _mass(child) > 0:
                parts.append(child)
    if not parts:
        dense = prim.HasAPI(UsdPhysics.MassAPI) and float(UsdPhysics.MassAPI(prim).GetDensityAttr().Get() or 0.0) > 0
        stage.said.append(f"link {name}: no physics:mass{', but a density' if dense else ''}; simulators compute it from collision shapes, KSL takes none")
    lumps = [_lump(stage, part, body, name) for part in parts]
    body.mass = sum(m for m, _, _ in lumps)
    if body.mass > 0:
        body.centroid = np.sum([m * c for m, c, _ in lumps], axis=0) / body.mass
        for m, c, I in lumps:
            d = c - body.centroid
            body.tensor = body.tensor + I + m * (d @ d * np.eye(3) - np.outer(d, d))
    return body


def _mass(prim: Any) -> float:
    from pxr import UsdPhysics

    return float(UsdPhysics.MassAPI(prim).GetMassAttr().Get() or 0.0) if prim.HasAPI(UsdPhysics.MassAPI) else 0.0


def _lump(stage: Stage, prim: Any, body: Body, name: str) -> tuple[float, Array, Array]:
    """Mass, centroid and tensor about it, in the body's frame; kg, m."""
    from pxr import UsdPhysics

    api = UsdPhysics.MassAPI(prim)
    centre = np.array(api.GetCenterOfMassAttr().Get(), dtype=float)
    diagonal = np.array(api.GetDiagonalInertiaAttr().Get(), dtype=float)
    quaternion = api.GetPrincipalAxesAttr().Get()
    if not np.isfinite(centre).all():
        stage.said.append(f"link {name}: no physics:centerOfMass; simulators compute it from collision shapes, KSL takes the origin")
        centre = np.zeros(3)
    if not diagonal.any():
        stage.said.append(f"link {name}: no physics:diagonalInertia; simulators compute it from collision shapes, KSL takes a point mass")
    R = body.pose[:3, :3].T @ stage.pose(prim)[:3, :3] @ rotation(quaternion)
    centroid = body.pose[:3, :3].T @ (stage.point(prim, centre) - body.pose[:3, 3])
    return _mass(prim) * stage.mass, centroid, (R * diagonal) @ R.T * stage.mass * stage.length**2


def rotation(quaternion: Any) -> Array:
    """(3, 3) of a quaternion of USD; the identity for that of length 0, which means that none is given."""
    from ksl.model.mjcf_frames import matrix

    wxyz = np.array([quaternion.GetReal(), *quaternion.GetImaginary()], dtype=float) if quaternion is not None else np.zeros(4)
    return matrix(wxyz) if wxyz.any() else np.eye(3)
