"""What a USD stage says of units, axes and gravity, and which of its prims are rigid bodies, colliders and joints; SI units."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from ksl.base.errors import DescriptionError
from ksl.base.judged import LENGTH, LENGTH_UNIT, MASS_UNIT, RATE, SCALE, judged
from ksl.base.limits import USD_PRIMS
from ksl.base.words import listed
from ksl.robot_files.assembly import Array
from ksl.robot_files.mjcf_frames import matrix

EARTH = 9.81
"""m/s²: USD has the magnitude of the Earth's gravity as -inf, and leaves the number to whoever reads it."""
TRUE_ANGLES = 1e-5
"""Cosine of the angle between two axes of a prim, from which on they are sheared: single precision leaves less."""
EXACT = 1e-12
"""What double precision leaves of products of a rotation's columns."""
STACKS = "newton:jointsAddMobility"
NO_TURN = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
NOTHING: frozenset[str] = frozenset()


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
    related: list[tuple[Prim, list[Any]]] = field(default_factory=list)
    """Prims that are active and defined, those of instances too, parents before children, with the relationships that the file gives them; those that have some."""
    tendons: list[Prim] = field(default_factory=list)
    """Prims with schemas of PhysX's tendons."""
    bodies: dict[str, Prim] = field(default_factory=dict)
    """{path: prim} of rigid bodies that are enabled."""
    joints: dict[str, Prim] = field(default_factory=dict)
    """{path: prim} of joints of UsdPhysics, enabled or not."""
    names: dict[str, str] = field(default_factory=dict)
    """{path: name} of bodies and joints."""
    read: dict[str, set[str]] = field(default_factory=dict)
    """{path of a joint that moves: names of its limits, and of drives' and PhysX's numbers, as far as they are read}."""
    owner: dict[str, str] = field(default_factory=dict)
    """{path of a prim at or below a body: path of that body}."""
    parts: dict[str, list[Prim]] = field(default_factory=dict)
    """{path of a body: its colliders that are enabled}."""
    massive: dict[str, list[Prim]] = field(default_factory=dict)
    """{path of a body: prims below it that have a mass or a density and are no collider that counts}."""
    stacking: set[str] = field(default_factory=set)
    """Paths of articulations in which several joints between two bodies add freedoms, one after the other (newton:jointsAddMobility)."""
    scenes: list[Any] = field(default_factory=list)

    def __post_init__(self) -> None:
        from pxr import Gf, UsdGeom

        self.cache = UsdGeom.XformCache()
        self.unmoved = Gf.Matrix4d(1)
        self.places: dict[str, Place] = {}
        self.sheared: set[str] = set()
        """Prims that are said to be."""
        self.root = other("/", self.stage.GetPseudoRoot())

    def place(self, prim: Prim) -> Place:
        """Where a prim stands.  Raises OutOfBounds for scales of nothing, or of another world."""
        found = self.places.get(prim.path)
        if found is None:
            given = self.cache.GetLocalToWorldTransform(prim.prim)
            self.places[prim.path] = found = UNMOVED if given == self.unmoved else self._placed(prim, given)
        return found

    def _placed(self, prim: Prim, given: Any) -> Place:
        matrix = np.array(given).T
        (a, b, c, _), (d, e, f, _), (g, h, i, _), _ = rows = matrix.tolist()
        if not math.isfinite(sum(map(sum, rows))):
            raise DescriptionError(f"prim {prim.path}: where it stands is not finite (xformOp); correct it")
        pose = matrix.copy()
        pose[:3, 3] *= self.length
        squares = a * a + d * d + g * g, b * b + e * e + h * h, c * c + f * f + i * i
        products = a * b + d * e + g * h, a * c + d * f + g * i, b * c + e * f + h * i
        is_right_handed = a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g) > 0
        if is_right_handed and max(abs(x - 1.0) for x in squares) <= EXACT and max(map(abs, products)) <= EXACT:
            return Place(matrix, pose, (1.0, 1.0, 1.0), False, (a, b, c, d, e, f, g, h, i) == NO_TURN)
        x, y, z = scale = tuple([judged(math.sqrt(x), f"prim {prim.path}: its scale", SCALE) for x in squares])
        cosine = max(abs(products[0]) / (x * y), abs(products[1]) / (x * z), abs(products[2]) / (y * z))
        if cosine <= EXACT:  # turned and scaled alone
            pose[:3, :3] /= scale if is_right_handed else [-x for x in scale]
        else:
            pose[:3, :3] = np.array(given.RemoveScaleShear().ExtractRotationMatrix()).T
        return Place(matrix, pose, scale, cosine > TRUE_ANGLES, False)

    def offset(self, prim: Prim, local: list[float]) -> Array:
        """From the origin of a prim to a point of its space, m, in axes of the world: scales of the prim and its ancestors count."""
        if not abs(local[0]) + abs(local[1]) + abs(local[2]) <= LENGTH.most / self.length:
            for x in local:
                judged(x * self.length, f"prim {prim.path}: a coordinate of a point of it", LENGTH)
        at = self.place(prim)
        if at.is_sheared and any(local) and prim.path not in self.sheared:
            self.sheared.add(prim.path)
            self.said.append(
                f"prim {prim.path}: scales above it that differ by axis shear its space: points of joints and masses are where USD has them, and simulators, which don't shear, take other ones; scale shapes alone"
            )
        return np.array(local) * self.length if at.is_plain else at.matrix[:3, :3] @ local * self.length

    def point(self, prim: Prim, local: list[float]) -> Array:
        """A point of a prim's space in the world, m."""
        return self.place(prim).pose[:3, 3] + self.offset(prim, local)


class Place(NamedTuple):
    """Where a prim stands in the world.  Its arrays are shared, and not to be changed."""

    matrix: Array
    """(4, 4), in units of the file, with scales; columns, where USD has rows."""
    pose: Array
    """(4, 4), m, without scales."""
    scale: tuple[float, ...]
    """Lengths of its axes (3) in the world."""
    is_sheared: bool
    """Whether its axes are no right angles apart, so that a cube of it is none."""
    is_plain: bool
    """Whether it is neither turned nor scaled, as most are."""


UNMOVED = Place(np.eye(4), np.eye(4), (1.0, 1.0, 1.0), False, True)


class Kind(NamedTuple):
    """What prims of one type with the same schemas have in common.  USD is asked for it once, and not for each of them."""

    type_name: str
    applied: tuple[str, ...]
    """Names of schemas that files apply, known to the installed USD or not."""
    schemas: frozenset[str]
    """Names of those that USD knows, and of those that come with them."""
    is_joint: bool
    is_scene: bool
    fallbacks: dict[str, Any]
    """Values of attributes that a file doesn't give, as far as they were asked for."""


class Prim(NamedTuple):
    """A prim, with what is asked for more than once."""

    path: str
    prim: Any
    kind: Kind
    authored: frozenset[str]
    """Names of the properties that the file gives."""
    relations: dict[str, Any]
    """{name: relationship} that the file gives."""

    def get(self, name: str) -> Any:
        """The value of an attribute; None where the prim has no such attribute, or it has no value."""
        if name in self.authored:
            return self.prim.GetAttribute(name).Get()
        fallbacks = self.kind.fallbacks
        if name not in fallbacks:
            attribute = self.prim.GetAttribute(name)
            fallbacks[name] = attribute.Get() if attribute else None
        return fallbacks[name]


def other(path: str, prim: Any) -> Prim:
    """A prim of which nothing is asked but where it stands."""
    return Prim(path, prim, Kind("", (), NOTHING, False, False, {}), NOTHING, {})


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
    _say_other_units(made)
    return made


def _say_other_units(stage: Stage) -> None:
    """Layers of bodies, colliders and joints that give other units or axes than the stage, which USD doesn't convert."""
    own = {"metersPerUnit": f"{stage.length:g}", "kilogramsPerUnit": f"{stage.mass:g}", "upAxis": stage.up}
    other = {}
    for layer in stage.stage.GetUsedLayers():
        given = {key: layer.pseudoRoot.GetInfo(key) for key in own if layer.pseudoRoot.HasInfo(key)}
        words = {key: x if isinstance(x, str) else f"{x:g}" for key, x in given.items()}
        if differing := [f"{key} = {x}, and the stage {own[key]}" for key, x in words.items() if x != own[key]]:
            other[layer.identifier] = f"layer {layer.GetDisplayName()} gives {'; '.join(differing)}"
    if not other:
        return
    prims = [*stage.bodies.values(), *stage.joints.values(), *(part for parts in stage.parts.values() for part in parts)]
    for identifier in dict.fromkeys(spec.layer.identifier for prim in prims for spec in prim.prim.GetPrimStack()):
        if identifier in other:
            stage.said.append(
                f"{other[identifier]}: USD converts nothing from layer to layer, and KSL takes its numbers as the stage's: scale and turn them where it is referred to, or give both the same"
            )


def _find(stage: Stage) -> None:
    """Goes through all prims once, parents first, and notes which are bodies, parts of them, joints and scenes."""
    from pxr import Usd

    disabled, kinds, types = list[str](), dict[tuple[str, ...], Kind](), dict[str, tuple[bool, bool]]()
    counts, missing = Usd.TraverseInstanceProxies(), _Missing(stage)
    for number, prim in enumerate(Usd.PrimRange.Stage(stage.stage, Usd.TraverseInstanceProxies(~Usd.PrimIsAbstract)), 1):
        if number > USD_PRIMS:
            raise DescriptionError(
                f"its instances unfold to more than {USD_PRIMS:,} prims, which are the most that are read; give the robot's prims in a file of their own"
            )
        if prim.HasVariantSets():
            missing.say_variants(prim)
        if not counts(prim):
            missing.say_undefined(prim)
            continue
        key = (prim.GetTypeName(), *prim.GetPrimTypeInfo().GetAppliedAPISchemas())
        kind = kinds.get(key)
        if kind is None:
            kinds[key] = kind = _kind_of(prim, key, types)
        if kind.is_joint or kind.is_scene or kind.applied:
            _note(stage, prim, kind, disabled)
            continue
        relations = prim.GetAuthoredRelationships()
        if relations or stage.owner:
            path = str(prim.GetPath())
            if relations:
                stage.related.append((Prim(path, prim, kind, NOTHING, {}), relations))
            if (body := stage.owner.get(path.rpartition("/")[0])) is not None:
                stage.owner[path] = body
    stage.unused += [f"rigid body {path} (not enabled)" for path in disabled]
    stage.names = {**short_names(list(stage.bodies)), **short_names(list(stage.joints))}
    if not stage.bodies and disabled:
        raise DescriptionError(
            f"no rigid body is enabled (physics:rigidBodyEnabled): {disabled[0]} and {len(disabled) - 1} more are not; enable those of the robot"
            if len(disabled) > 1
            else f"its only rigid body, {disabled[0]}, is not enabled; set physics:rigidBodyEnabled"
        )


def _kind_of(prim: Any, key: tuple[str, ...], types: dict[str, tuple[bool, bool]]) -> Kind:
    from pxr import UsdPhysics

    type_name, *applied = key
    if type_name not in types:
        types[type_name] = prim.IsA(UsdPhysics.Joint), prim.IsA(UsdPhysics.Scene)
    return Kind(type_name, tuple(applied), frozenset(prim.GetAppliedSchemas()), *types[type_name], {})


def _note(stage: Stage, prim: Any, kind: Kind, disabled: list[str]) -> None:
    """Notes a joint, a scene, or a prim to which schemas are applied."""
    path = str(prim.GetPath())
    authored = prim.GetAuthoredPropertyNames()
    relations = prim.GetAuthoredRelationships() if authored else []
    known = Prim(path, prim, kind, frozenset(authored), {r.GetName(): r for r in relations})
    body = stage.owner.get(path.rpartition("/")[0])
    if relations:
        stage.related.append((known, relations))
    if "PhysicsRigidBodyAPI" in kind.schemas:
        if known.get("physics:rigidBodyEnabled"):
            stage.bodies[path] = known
            stage.parts[path], stage.massive[path] = [], []
            body = path
        else:
            disabled.append(path)
    if body is not None:
        stage.owner[path] = body
        if "PhysicsCollisionAPI" in kind.schemas and known.get("physics:collisionEnabled"):
            stage.parts[body].append(known)
        elif body != path and "PhysicsMassAPI" in kind.schemas:
            stage.massive[body].append(known)
    if STACKS in authored and known.get(STACKS) is True:
        stage.stacking.add(path)
    if kind.is_joint:
        stage.joints[path] = known
    elif kind.is_scene:
        stage.scenes.append(prim)
    if any(schema.startswith("PhysxTendon") for schema in kind.applied):
        stage.tendons.append(known)


class _Missing:
    """Says what USD leaves out without a word: variants that aren't there, and physics of prims that nothing defines, as where the path of an `over` has a slip."""

    def __init__(self, stage: Stage) -> None:
        self.said = stage.said
        self.seen: set[str] = set()
        """Prims of prototypes, which are said of the first instance."""

    def say_variants(self, prim: Any) -> None:
        if self._is_said(prim):
            return
        sets = prim.GetVariantSets()
        for name in sets.GetNames():
            chosen = sets.GetVariantSelection(name)
            if chosen and chosen not in (known := sets.GetVariantSet(name).GetVariantNames()):
                self.said.append(
                    f"prim {prim.GetPath()}: variant {chosen} is chosen of {name}, which has {listed(known) or 'none'}: what it would add is missing; choose one of them"
                )

    def say_undefined(self, prim: Any) -> None:
        from pxr import Sdf

        if prim.IsDefined() or prim.GetSpecifier() != Sdf.SpecifierOver or self._is_said(prim):
            return
        if physics := [name for name in (prim.GetTypeName(), *prim.GetAppliedSchemas()) if name.startswith("Physics")]:
            self.said.append(
                f"prim {prim.GetPath()}: has {', '.join(physics)}, and nothing defines it (over): USD leaves it out; correct its path, or write def"
            )

    def _is_said(self, prim: Any) -> bool:
        if not prim.IsInstanceProxy():
            return False
        path = str(prim.GetPrimInPrototype().GetPath())
        if path in self.seen:
            return True
        self.seen.add(path)
        return False


def require_values(stage: Stage) -> None:
    """Values are read without a time, as UsdPhysics' own parser does.  Where a file has time samples alone, these are the values that a schema has for "none"."""
    from pxr import Usd

    if not any(layer.ListAllTimeSamples() for layer in stage.stage.GetUsedLayers()):
        return
    for path in dict.fromkeys(above for of in (*stage.owner, *stage.joints) for above in with_ancestors(of)):
        for attribute in stage.stage.GetPrimAtPath(path).GetAuthoredAttributes():
            alone = attribute.GetNumTimeSamples() and attribute.GetResolveInfo(Usd.TimeCode.Default()).GetSource() != Usd.ResolveInfoSourceDefault
            if alone and attribute.GetName().startswith(("physics:", "xformOp", "limit:", "drive:", "physx", "newton:")):
                raise DescriptionError(f"prim {path}: {attribute.GetName()} has time samples alone; KSL reads values without a time: give it a default value")


def with_ancestors(path: str) -> list[str]:
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
