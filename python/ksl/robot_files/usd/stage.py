"""What a USD stage says of units, axes and gravity, and which of its prims are rigid bodies, colliders and joints; SI units."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ksl.base.errors import DescriptionError
from ksl.base.judged import LENGTH, LENGTH_UNIT, MASS_UNIT, RATE, SCALE, judged
from ksl.robot_files.assembly import Array
from ksl.robot_files.mjcf_frames import matrix

EARTH = 9.81
"""m/s²: USD has the magnitude of the Earth's gravity as -inf, and leaves the number to whoever reads it."""
TRUE_ANGLES = 1e-5
"""Cosine of the angle between two axes of a prim, from which on they are sheared: single precision leaves less."""


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
    prims: list[Any] = field(default_factory=list)
    """All that are active and defined, those of instances too, parents before children."""
    bodies: dict[str, Any] = field(default_factory=dict)
    """{path: prim} of rigid bodies that are enabled."""
    joints: dict[str, Any] = field(default_factory=dict)
    """The same of joints of UsdPhysics, enabled or not."""
    names: dict[str, str] = field(default_factory=dict)
    """{path: name} of bodies and joints."""
    owner: dict[str, str] = field(default_factory=dict)
    """{path of a prim at or below a body: path of that body}."""
    parts: dict[str, list[Any]] = field(default_factory=dict)
    """{path of a body: its colliders that are enabled}."""
    massive: dict[str, list[str]] = field(default_factory=dict)
    """{path of a body: paths of prims below it that have a mass or a density and are no collider that counts}."""
    scenes: list[Any] = field(default_factory=list)

    def __post_init__(self) -> None:
        from pxr import UsdGeom

        self.cache = UsdGeom.XformCache()
        self.matrices: dict[Any, Array] = {}
        self.poses: dict[Any, Array] = {}

    def matrix(self, prim: Any) -> Array:
        """From a prim's space to the world's, (4, 4), in units of the file; columns, where USD has rows."""
        found = self.matrices.get(prim)
        if found is None:
            found = np.array(self.cache.GetLocalToWorldTransform(prim)).T
            if not np.isfinite(found).all():
                raise DescriptionError(f"prim {prim.GetPath()}: where it stands is not finite (xformOp); correct it")
            self.matrices[prim] = found
        return found

    def pose(self, prim: Any) -> Array:
        """Rotation and translation (4, 4) of a prim in the world, m, without its scale.  Not to be changed."""
        made = self.poses.get(prim)
        if made is None:
            self.poses[prim] = made = self.matrix(prim).copy()
            R = made[:3, :3]
            if not _is_identity(R) and (np.abs(R.T @ R - np.eye(3)).max() > 1e-12 or np.linalg.det(R) < 0):
                self.scale(prim)
                made[:3, :3] = np.array(self.cache.GetLocalToWorldTransform(prim).RemoveScaleShear().ExtractRotationMatrix()).T
            made[:3, 3] *= self.length
        return made

    def scale(self, prim: Any) -> Array:
        """Lengths of a prim's axes (3) in the world.  Raises OutOfBounds for scales of nothing, or of another world."""
        R = self.matrix(prim)[:3, :3]
        if _is_identity(R):
            return np.ones(3)
        return np.array([judged(float(s), f"prim {prim.GetPath()}: its scale", SCALE) for s in np.sqrt((R * R).sum(axis=0))])

    def sheared(self, prim: Any) -> bool:
        """Whether its axes are no right angles apart, so that a cube of it is none."""
        if _is_identity(self.matrix(prim)[:3, :3]):
            return False
        R = self.matrix(prim)[:3, :3] / self.scale(prim)
        return bool(np.abs(R.T @ R - np.eye(3)).max() > TRUE_ANGLES)

    def point(self, prim: Any, local: Any) -> Array:
        """A point of a prim's space in the world, m: scales of the prim and its ancestors count."""
        x = three(local)
        if not abs(x[0]) + abs(x[1]) + abs(x[2]) <= LENGTH.most / self.length:
            for c in x:
                judged(c * self.length, f"prim {prim.GetPath()}: a coordinate of a point of it", LENGTH)
        M = self.matrix(prim)
        return (M[:3, :3] @ x + M[:3, 3]) * self.length


def _is_identity(R: Array) -> bool:
    """Whether a prim is neither turned nor scaled, as most are."""
    identity: bool = R.tolist() == [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    return identity


def units_of(stage: Any) -> Stage:
    """The stage with the units that it gives, or that USD has where it gives none; what is converted is said.  Raises ValueError for units that are none."""
    from pxr import UsdGeom, UsdPhysics

    length = judged(float(UsdGeom.GetStageMetersPerUnit(stage)), "metersPerUnit", LENGTH_UNIT)
    mass = judged(float(UsdPhysics.GetStageKilogramsPerUnit(stage)), "kilogramsPerUnit", MASS_UNIT)
    judged(float(stage.GetTimeCodesPerSecond()), "timeCodesPerSecond", RATE)
    up = str(UsdGeom.GetStageUpAxis(stage))
    default = stage.GetDefaultPrim()
    made = Stage(stage, length, mass, up, str(default.GetName()) if default else "")
    if not UsdGeom.StageHasAuthoredMetersPerUnit(stage):
        made.said.append("the file doesn't give metersPerUnit; lengths are taken in centimetres, USD's default: give metersPerUnit = 1 if they are in m")
    elif length != 1.0:
        made.said.append(f"lengths are in units of {length:g} m (metersPerUnit), converted to m")
    if mass != 1.0:
        made.said.append(f"masses are in units of {mass:g} kg (kilogramsPerUnit), converted to kg")
    if up != "Z":
        made.said.append(f"up is the axis {up} of the file (upAxis): the world's axes stay as they are, and gravity points down along {up}")
    _find(made)
    return made


def _find(stage: Stage) -> None:
    """Goes through all prims once, parents first, and notes which are bodies, parts of them, joints and scenes."""
    from pxr import Usd, UsdPhysics

    disabled = []
    for prim in Usd.PrimRange.Stage(stage.stage, Usd.TraverseInstanceProxies()):
        stage.prims.append(prim)
        path = str(prim.GetPath())
        schemas = prim.GetAppliedSchemas()
        body = stage.owner.get(path.rpartition("/")[0])
        if "PhysicsRigidBodyAPI" in schemas:
            if UsdPhysics.RigidBodyAPI(prim).GetRigidBodyEnabledAttr().Get():
                stage.bodies[path] = prim
                stage.parts[path], stage.massive[path] = [], []
                body = path
            else:
                disabled.append(path)
        if body is not None:
            stage.owner[path] = body
            if "PhysicsCollisionAPI" in schemas and UsdPhysics.CollisionAPI(prim).GetCollisionEnabledAttr().Get():
                stage.parts[body].append(prim)
            elif body != path and "PhysicsMassAPI" in schemas:
                stage.massive[body].append(path)
        if prim.IsA(UsdPhysics.Joint):
            stage.joints[path] = prim
        elif prim.IsA(UsdPhysics.Scene):
            stage.scenes.append(prim)
    stage.unused += [f"rigid body {path} (not enabled)" for path in disabled]
    stage.names = {**short_names(list(stage.bodies)), **short_names(list(stage.joints))}
    if not stage.bodies and disabled:
        raise DescriptionError(
            f"no rigid body is enabled (physics:rigidBodyEnabled): {disabled[0]} and {len(disabled) - 1} more are not; enable those of the robot"
            if len(disabled) > 1
            else f"its only rigid body, {disabled[0]}, is not enabled; set physics:rigidBodyEnabled"
        )


def applied(prim: Any) -> list[str]:
    """Names of schemas that are applied, known to the installed USD or not."""
    return list(prim.GetPrimTypeInfo().GetAppliedAPISchemas())


def require_values(stage: Stage) -> None:
    """Values are read without a time, as UsdPhysics' own parser does.  Where a file has time samples alone, these are the values that a schema has for "none"."""
    from pxr import Usd

    if not any(layer.ListAllTimeSamples() for layer in stage.stage.GetUsedLayers()):
        return
    for path in dict.fromkeys(above for of in (*stage.owner, *stage.joints) for above in _with_ancestors(of)):
        for attribute in stage.stage.GetPrimAtPath(path).GetAuthoredAttributes():
            alone = attribute.GetNumTimeSamples() and attribute.GetResolveInfo(Usd.TimeCode.Default()).GetSource() != Usd.ResolveInfoSourceDefault
            if alone and attribute.GetName().startswith(("physics:", "xformOp", "limit:", "drive:", "physx", "newton:")):
                raise DescriptionError(f"prim {path}: {attribute.GetName()} has time samples alone; KSL reads values without a time: give it a default value")


def _with_ancestors(path: str) -> list[str]:
    parts = path.split("/")
    return ["/".join(parts[:k]) for k in range(2, len(parts) + 1)]


def gravity_of(stage: Stage) -> Array:
    """In world axes, m/s²: that of the first physics scene, or the Earth's, down."""
    from pxr import UsdPhysics

    down = np.array((0.0, -1.0, 0.0) if stage.up == "Y" else (0.0, 0.0, -1.0))
    if not stage.scenes:
        return EARTH * down
    if len(stage.scenes) > 1:
        stage.said.append(f"{len(stage.scenes)} physics scenes; gravity is that of the first, {stage.scenes[0].GetPath()}")
    scene = UsdPhysics.Scene(stage.scenes[0])
    direction = np.array(scene.GetGravityDirectionAttr().Get() or (0, 0, 0), dtype=float)
    magnitude = float(scene.GetGravityMagnitudeAttr().Get())
    if not np.isfinite(direction).all() or math.isnan(magnitude) or magnitude == math.inf:
        raise DescriptionError(f"physics scene {scene.GetPath()}: its gravity is not finite; correct physics:gravityDirection and physics:gravityMagnitude")
    size = float(np.linalg.norm(direction))
    if abs(magnitude - EARTH) < 0.1 and stage.length != 1.0:  # which USD has in units of lengths
        stage.said.append(
            f"gravity is {magnitude * stage.length:.3g} m/s², {magnitude:g} in units of {stage.length:g} m: give {EARTH / stage.length:g} if it is the Earth's"
        )
    if _weightless(scene.GetPrim()):
        return np.zeros(3)
    return (direction / size if size > 0 else down) * (magnitude * stage.length if magnitude >= 0 else EARTH)


def _weightless(scene: Any) -> bool:
    """Whether a scene has no gravity, as Newton's schema says it."""
    return scene.HasAttribute("newton:gravityEnabled") and scene.GetAttribute("newton:gravityEnabled").Get() is False


def short_names(paths: Iterable[str]) -> dict[str, str]:
    """The last parts of paths, as many as tell them apart."""
    names: dict[str, str] = {}
    groups: dict[str, list[str]] = {}
    for path in paths:
        groups.setdefault(path.rpartition("/")[2], []).append(path)
    for last, same in groups.items():
        for path in same:
            names[path] = last if len(same) == 1 else path.strip("/").replace("/", "_")
    return names


def three(vector: Any) -> list[float]:
    """The numbers of a vector of USD.  Python's own way through one costs fifty times as much: each ends by an exception, for which USD looks at the stack."""
    numbers: list[float] = np.array(vector, dtype=float).tolist()
    if len(numbers) != 3:
        raise TypeError(f"{vector} has {len(numbers)} numbers, not 3")
    return numbers


def rotation(quaternion: Any) -> Array:
    """(3, 3) of a quaternion of USD; the identity for that of length 0, which means that none is given."""
    w, (x, y, z) = (0.0, (0.0, 0.0, 0.0)) if quaternion is None else (quaternion.GetReal(), three(quaternion.GetImaginary()))
    if not (x or y or z) and w in (0.0, 1.0):
        return np.eye(3)
    if not math.isfinite(w + x + y + z):
        raise DescriptionError(f"a quaternion is {(w, x, y, z)}; expected four finite numbers")
    return matrix(np.array((w, x, y, z)))
