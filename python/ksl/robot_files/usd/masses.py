"""Masses of the bodies of a USD stage, put together as UsdPhysics has it: attribute by attribute.

What PhysicsMassAPI gives of the body itself (mass, centerOfMass, diagonalInertia, principalAxes) counts; each that it leaves open follows from the
colliders of the body that are enabled.  Of these, too, each attribute counts that is given: mass before density, a density of the collider before that
of the body, that before the one of its physics material, and 1000 kg/m³ where none is given.  newton:inertia of a body, the whole tensor in its axes, comes before
diagonalInertia and principalAxes.  `UsdPhysics.RigidBodyAPI.ComputeMassProperties` computes
the same, in single precision, from usd-core 26.11 on; it asks its caller for the volumes of shapes, and tests compare with it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ksl.base.errors import DescriptionError
from ksl.base.judged import DENSITY, MASS, MOMENT, judged
from ksl.base.words import listed
from ksl.robot_files.assembly import Array, Body
from ksl.robot_files.usd.shapes import Solid, solid_of
from ksl.robot_files.usd.stage import UNMOVED, Prim, Stage, rotation, three

WATER = 1000.0
"""kg/m³: the density of shapes that nothing gives one for, of UsdPhysics."""


SAME = 1e-3
"""Tensors that differ by less of their largest element say the same: diagonalInertia is in single precision, and tools round it."""
PRODUCT = MOMENT._replace(signed=True)
NO_SOLID = Solid(0.0, np.zeros(3), np.zeros((3, 3)))


class Lump(NamedTuple):
    """In the axes of a body, kg, m; the tensor is about the centroid."""

    mass: float
    centroid: Array
    tensor: Array


@dataclass
class Given:
    """What a prim says of its mass, in SI units; None where it doesn't."""

    mass: float | None = None
    density: float | None = None
    centroid: Any = None
    """In its own space, in units of the file."""
    moments: Array | None = None
    axes: Array | None = None
    tensor: Array | None = None
    """newton:inertia: about the centroid, in the prim's axes.  It counts before moments and axes, of bodies."""


class MassReader:
    """Masses of bodies, one after the other."""

    def __init__(self, stage: Stage) -> None:
        self.stage = stage
        self.materials: dict[str, float] = {}
        """{path of a collider: density of its physics material}, of all colliders of the stage, once the first is asked for."""
        self.bound = False
        self.at = UNMOVED
        """Where the body that is read stands."""
        self.left: list[str] = []
        """What simulators are to find of the colliders of the body that is read."""
        self.without_density: list[str] = []
        """Colliders of the body to which the density of water is given."""

    def add(self, body: Body, prim: Prim) -> None:
        """Mass, centroid and tensor of a body, and what is said of those that are left to a simulator."""
        own, self.at = self.given(prim), self.stage.place(prim)
        self._say_uncounted(body, prim.path)
        open_ = own.mass is None or (own.moments is None and own.tensor is None) or own.centroid is None
        lump, weighs = self._of_parts(body, prim.path, own) if open_ else (_at_origin(own.mass), False)
        mass, centroid, tensor = lump
        if own.centroid is not None:
            centroid = self._place(body, prim, own.centroid)
            tensor = tensor + (_shifted(mass, centroid - lump.centroid) if weighs else 0.0)
        moments, axes = own.moments, own.axes
        if own.tensor is not None:
            self._say_contradicted(body, own)
            tensor, moments = own.tensor, None
        elif weighs and (moments is None) != (axes is None):  # the one that isn't given is that of the colliders
            principal, directions = principal_axes(tensor)
            given, other = ("principalAxes", "moments") if moments is None else ("diagonalInertia", "axes")
            self.stage.said.append(
                f"link {body.name}: of inertia, the body has physics:{given} alone; as in USD, the principal {other} are those of its colliders: give both"
            )
            moments, axes = (principal, axes) if moments is None else (moments, directions)
        if moments is not None:
            R = np.eye(3) if axes is None else axes
            tensor = (R * moments) @ R.T
        if mass > 0:
            body.mass, body.centroid, body.tensor = mass, centroid, tensor

    def _of_parts(self, body: Body, path: str, own: Given) -> tuple[Lump, bool]:
        """What the colliders of a body weigh together, with the body's own mass where it has one; whether they weigh anything."""
        self.left, self.without_density = [], []
        parts = self.stage.parts[path]
        lumps = [lump for part in parts if (lump := self._part(body, part, own, own if part.path == path else self.given(part))).mass > 0]
        if not lumps:
            self._say_open(body, own)
            return _at_origin(own.mass), False
        if self.without_density and (own.mass is None or len(self.without_density) < len(lumps)):
            said = f"link {body.name}: neither a mass nor a density of {listed(self.without_density, 6)}; USD's default, {WATER:g} kg/m³, is taken"
            self.stage.said.append(said)
        if self.left:
            self.stage.said.append(
                f"link {body.name}: simulators fit shapes of their own to {listed(self.left, 6)}; KSL counts no mass that isn't given, and takes their origins and point masses: give them by PhysicsMassAPI"
            )
        lump = _sum(lumps)
        factor = 1.0 if own.mass is None else own.mass / lump.mass
        return Lump(lump.mass * factor, lump.centroid, lump.tensor * factor), True

    def given(self, prim: Prim) -> Given:
        if not prim.authored or (
            "PhysicsMassAPI" not in prim.kind.schemas and "NewtonMassAPI" not in prim.kind.applied
        ):  # which contains it, where USD doesn't know it, too
            return Given()
        stage, who, authored = self.stage, f"prim {prim.path}: its physics:", prim.authored
        found = Given(tensor=self._newton_inertia(prim) if "newton:inertia" in authored else None)

        def value(name: str) -> Any:
            return prim.get(f"physics:{name}") if f"physics:{name}" in authored else None  # where nothing is authored, USD's value says so

        for name, bounds, unit in (("mass", MASS, stage.mass), ("density", DENSITY, stage.mass / stage.length**3)):
            x = float(value(name) or 0.0)
            if x:
                setattr(found, name, judged(x * unit, f"{who}{name}", bounds))
        centroid = value("centerOfMass")
        at = None if centroid is None else three(centroid)
        if at is not None and any(map(math.isnan, at)):
            raise DescriptionError(f"{who}centerOfMass is {tuple(at)}; expected three numbers; correct it in the file")
        if at is not None and all(map(math.isfinite, at)):
            found.centroid = at
        moments = value("diagonalInertia")
        if moments is not None and any(moments := three(moments)):
            found.moments = np.array([judged(x * stage.mass * stage.length**2, f"{who}diagonalInertia", MOMENT) for x in moments])
        turn = value("principalAxes")
        if turn is not None and (turn.GetReal() or any(three(turn.GetImaginary()))):
            found.axes = rotation(turn)
        return found

    def _newton_inertia(self, prim: Prim) -> Array | None:
        """The tensor that NewtonMassAPI states, six numbers; None for none, which is its default."""
        numbers = [float(x) for x in prim.get("newton:inertia") or ()]
        if not numbers:
            return None
        who = f"prim {prim.path}: its newton:inertia"
        if len(numbers) != 6:
            raise DescriptionError(f"{who} has {len(numbers)} numbers; expected Ixx, Iyy, Izz, Ixy, Ixz, Iyz; correct it in the file")
        unit = self.stage.mass * self.stage.length**2
        xx, yy, zz, xy, xz, yz = (judged(x * unit, who, MOMENT if k < 3 else PRODUCT) for k, x in enumerate(numbers))
        return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])

    def _say_contradicted(self, body: Body, own: Given) -> None:
        """Where both ways to state a tensor are used, and say different things."""
        if own.moments is None or own.tensor is None:
            return
        R = np.eye(3) if own.axes is None else own.axes
        apart = float(np.abs((R * own.moments) @ R.T - own.tensor).max())
        if apart > SAME * np.abs(own.tensor).max():
            self.stage.said.append(
                f"link {body.name}: newton:inertia and physics:diagonalInertia differ by {apart:.3g} kg m²; the first counts, as in Newton, and other simulators take the second: make them agree"
            )

    def _place(self, body: Body, prim: Prim, local: list[float]) -> Array:
        """A point of a prim in the frame of its body, m."""
        if (at := self.stage.place(prim)) is self.at and at.is_plain:
            return self.stage.offset(prim, local)
        return np.asarray(body.pose[:3, :3].T @ (self.stage.point(prim, local) - body.pose[:3, 3]))

    def _part(self, body: Body, prim: Prim, of_body: Given, own: Given) -> Lump:
        """What a collider weighs; nothing where it is neither given nor the volume of a solid."""
        inertia = own.tensor if own is of_body and own.tensor is not None else own.moments
        missing = [what for what, x in (("mass", own.mass), ("centre of mass", own.centroid), ("inertia", inertia)) if x is None]
        if own is not of_body and own.tensor is not None:
            self.stage.said.append(
                f"link {body.name}: newton:inertia of {prim.path} doesn't count: it is one of bodies; give the body's, or physics:diagonalInertia"
            )
        shell = bool(missing) and is_shell(prim)
        solid = NO_SOLID if not missing else None if shell else solid_of(self.stage, prim)
        if solid is None:
            self.left.append(f"{prim.path} ({prim.kind.type_name or 'no type'}{', a shell' if shell else ''}: {', '.join(missing)})")
            solid = NO_SOLID
        mass = own.mass if own.mass is not None else solid.volume and self._density(prim.path, own, of_body) * solid.volume
        return self._of_part(body, prim, own, mass, solid)

    def _of_part(self, body: Body, prim: Prim, own: Given, mass: float, solid: Solid) -> Lump:
        tensor = np.diag(own.moments) if own.moments is not None else solid.tensor * (mass / solid.volume if solid.volume else 0.0)
        if own.axes is not None:
            tensor = own.axes @ tensor @ own.axes.T
        at = self.stage.place(prim)
        X = at.pose
        if own.centroid is None and at.is_plain and self.at.is_plain:
            return Lump(mass, solid.centroid + (X[:3, 3] - body.pose[:3, 3]), tensor + 0.0)
        R = body.pose[:3, :3].T @ X[:3, :3]
        centroid = R @ solid.centroid + body.pose[:3, :3].T @ (X[:3, 3] - body.pose[:3, 3])
        if own.centroid is not None:
            there = self._place(body, prim, own.centroid)
            if own.moments is None and solid.volume:  # the shape's own tensor, about the point that is given
                tensor = tensor + R.T @ _shifted(mass, there - centroid) @ R
            centroid = there
        return Lump(mass, centroid, R @ tensor @ R.T)

    def _density(self, path: str, own: Given, of_body: Given) -> float:
        found = own.density or of_body.density or self._material(path)
        if not found:
            self.without_density.append(path)
        return found or WATER

    def _material(self, path: str) -> float:
        """The density of the physics material that is bound to a collider; 0 without one."""
        if not self.bound:
            from pxr import UsdPhysics, UsdShade

            self.bound = True
            parts = [part for of_one in self.stage.parts.values() for part in of_one]
            bound = UsdShade.MaterialBindingAPI.ComputeBoundMaterials([part.prim for part in parts], "physics")[0]
            unit = self.stage.mass / self.stage.length**3
            for part, material in zip(parts, bound, strict=True):
                if material and material.GetPrim().HasAPI(UsdPhysics.MaterialAPI):
                    density = float(UsdPhysics.MaterialAPI(material.GetPrim()).GetDensityAttr().Get() or 0.0)
                    self.materials[part.path] = judged(density * unit, f"material {material.GetPath()}: its physics:density", DENSITY)
        return self.materials.get(path, 0.0)

    def _say_open(self, body: Body, own: Given) -> None:
        """What neither the body nor a collider of it gives."""
        said, who, computed = self.stage.said, f"link {body.name}: no physics:", "simulators compute it from collision shapes, KSL takes"
        if own.mass is None:
            said.append(f"{who}mass{', but a density' if own.density else ''}; {computed} none")
            return
        if own.centroid is None:
            said.append(f"{who}centerOfMass; {computed} the origin")
        if own.moments is None and own.tensor is None:
            said.append(f"{who}diagonalInertia; {computed} a point mass")

    def _say_uncounted(self, body: Body, path: str) -> None:
        """Masses of parts that USD doesn't count: PhysicsMassAPI is of bodies and of colliders, and those that are disabled have none."""
        found = [other.path for other in self.stage.massive[path] if (given := self.given(other)).mass or given.density]
        if found:
            self.stage.said.append(
                f"link {body.name}: the mass of {listed(found, 4)} doesn't count: USD counts those of bodies and of colliders that are enabled; apply PhysicsCollisionAPI to them if it should"
            )


def is_shell(prim: Prim) -> bool:
    """Whether Newton's or MuJoCo's schema says that a collider weighs at its surface, with a thickness that simulators choose."""
    return prim.get("newton:massModel") == "shell" or prim.get("mjc:shellinertia") is True


def _at_origin(mass: float | None) -> Lump:
    return Lump(mass or 0.0, np.zeros(3), np.zeros((3, 3)))


def _sum(lumps: list[Lump]) -> Lump:
    mass = sum(lump.mass for lump in lumps)
    masses, centroids, tensors = (np.array(x) for x in zip(*lumps, strict=True))
    centroid = np.sum(masses[:, None] * centroids, axis=0) / mass
    d = centroids - centroid
    squares = d[:, None, :] @ d[:, :, None]
    return Lump(mass, centroid, np.sum(tensors + masses[:, None, None] * (squares * np.eye(3) - d[:, :, None] * d[:, None, :]), axis=0))


def _shifted(mass: float, d: Array) -> Array:
    """What a tensor about the centroid has more about a point at this distance (Steiner)."""
    return np.asarray(mass * (d @ d * np.eye(3) - np.outer(d, d)))


def principal_axes(tensor: Array) -> tuple[Array, Array]:
    """Principal moments, and their axes as the columns of a rotation, by rotations about the coordinate axis with the largest product of inertia (Jacobi).

    Each turns by 45° at most, so that the axes stay those of the body that they are nearest to; moments sorted by size would be about other ones.
    That pairs moments and axes as UsdPhysics does."""
    R = np.eye(3)
    for _ in range(50):
        D = R.T @ tensor @ R
        i, j, k = max(((0, 1, 2), (1, 2, 0), (2, 0, 1)), key=lambda axis: abs(D[axis[1], axis[2]]))
        if abs(D[j, k]) <= 1e-16 * np.abs(D).max():
            break
        angle = 0.5 * math.atan2(2 * D[j, k], D[j, j] - D[k, k])
        angle -= math.copysign(math.pi / 2, angle) if abs(angle) > math.pi / 4 else 0.0
        turn = np.eye(3)
        turn[j, j] = turn[k, k] = math.cos(angle)
        turn[k, j], turn[j, k] = math.sin(angle), -math.sin(angle)
        R = R @ turn
    return np.diag(R.T @ tensor @ R).copy(), R


def bodies_of(stage: Stage) -> dict[str, Body]:
    """{path of the prim: body} of all rigid bodies that are enabled."""
    masses = MassReader(stage)
    made = {}
    for path, prim in stage.bodies.items():
        made[path] = Body(stage.names[path], stage.place(prim).pose)
        masses.add(made[path], prim)
    return made
