"""Joints of a USD stage as connections of bodies, in SI units."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ksl.base.errors import DescriptionError
from ksl.base.judged import MOMENT, Bounds, judged
from ksl.robot_files.assembly import AT_REST, Array, Body, Connection, inverse, unused
from ksl.robot_files.usd.couplings import GEARS
from ksl.robot_files.usd.stage import STACKS, Prim, Stage, other, rotation, three, with_ancestors

AXES = dict(zip("XYZ", np.eye(3), strict=True))
_KINDS = {"PhysicsFixedJoint": "fixed", "PhysicsRevoluteJoint": "revolute", "PhysicsPrismaticJoint": "prismatic", "PhysicsSphericalJoint": "spherical"}
CONES = ("physics:coneAngle0Limit", "physics:coneAngle1Limit")
NO_SPEED_LIMIT = 1e6
"""deg/s or units/s: PhysX's default, which limits nothing."""
_FREEDOMS = ("transX", "transY", "transZ", "rotX", "rotY", "rotZ")
POSITION = Bounds(0.0, 1e9, "rad or m", zero=True, signed=True)
SPEED, EFFORT = Bounds(0.0, 1e9, "rad/s or m/s", zero=True), Bounds(0.0, 1e15, "N m or N", zero=True)
"""Limits of joints."""


def joints_of(stage: Stage, bodies: dict[str, Body]) -> tuple[dict[str, Connection], list[str]]:
    """{path: connection} of joints that are enabled, and the names of those that have drives.  Raises DescriptionError for joints that KSL has no kind for."""
    numbers = {path: i for i, path in enumerate(bodies)}
    found, driven = {}, []
    for path, given in stage.joints.items():
        name = stage.names[path]
        if given.kind.type_name in GEARS:  # where PhysX's schemas are installed
            continue
        if not given.get("physics:jointEnabled"):
            stage.unused.append(f"joint {name} (not enabled)")
            continue
        connection = _connection(stage, given, name, numbers)
        if connection is None:
            continue
        found[path] = connection
        if any(schema.startswith("PhysicsDriveAPI") for schema in given.kind.schemas):
            driven.append(name)
    return {**_held(stage, bodies, found), **found}, driven


def stack(stage: Stage, bodies: dict[str, Body], found: dict[str, Connection]) -> None:
    """Puts joints with one coordinate between the same two bodies one after the other, where Newton's schema says that they add freedoms: the first of the file
    is on body0, and a body without mass is after each but the last.  Those elsewhere close loops, as UsdPhysics has it."""
    first_of: dict[tuple[int | None, int | None], tuple[str, Connection]] = {}
    made = list(bodies.values())
    names = {body.name for body in made}
    for path, c in found.items():
        if c.closes or path not in stage.joints:
            continue
        pair = c.first, c.second
        if pair not in first_of and pair[::-1] not in first_of:
            first_of[pair] = path, c
            continue
        _, before = first_of.get(pair) or first_of[pair[::-1]]
        if (
            pair not in first_of
            or c.second is None
            or not all(one.kind in ("revolute", "continuous", "prismatic") for one in (c, before))
            or not _stacks(stage, path)
        ):
            stage.said.append(
                f"joint {c.name}: is between the same bodies as joint {before.name}, and holds them, too, as UsdPhysics has it; if both add freedoms, say so by {STACKS} of their articulation, or give a body between"
            )
            continue
        between = unused(f"{before.name}_body", names)
        names.add(between)
        before.second, c.first, c.at_first = len(made), len(made), c.at_second.copy()
        made.append(Body(between, made[c.second].pose))
        bodies[between] = made[-1]
        first_of[pair] = path, c


def _stacks(stage: Stage, path: str) -> bool:
    ends = [str(target.GetPrimPath()) for relation in stage.joints[path].relations.values() for target in relation.GetTargets()]
    return any(above in stage.stacking for at in (path, *ends) for above in with_ancestors(at))


def _held(stage: Stage, bodies: dict[str, Body], found: dict[str, Connection]) -> dict[str, Connection]:
    """Bodies that a program moves stand where the file has them: each is fixed to the world, unless a joint does that."""
    fixed = {i for c in found.values() if c.kind == "fixed" and None in (c.first, c.second) for i in (c.first, c.second)}
    held = {}
    for i, (path, prim) in enumerate(stage.bodies.items()):
        if prim.get("physics:kinematicEnabled"):
            stage.said.append(f"link {bodies[path].name}: kinematic (physics:kinematicEnabled): a program moves it; KSL holds it where it stands")
            if i not in fixed:
                held[path] = Connection(f"{bodies[path].name}_kinematic", "fixed", None, i, bodies[path].pose, np.eye(4))
    return held


def _connection(stage: Stage, given: Prim, name: str, numbers: dict[str, int]) -> Connection | None:
    kind, freedom = _kind(stage, given, name)
    first, at_first = _side(stage, given, 0, numbers, name)
    second, at_second = _side(stage, given, 1, numbers, name)
    if not kind:
        return None
    if first == second:
        stage.unused.append(f"joint {name} (both of its sides are the same body, or the world)")
        return None
    closes = bool(given.get("physics:excludeFromArticulation"))
    if kind != "fixed":
        stage.read[given.path] = {f"limit:{f}:physics:{end}" for f in _FREEDOMS for end in ("low", "high")} if given.kind.type_name == "PhysicsJoint" else set()
    limits = _numbers(stage, given, name, kind, freedom) if kind in ("revolute", "prismatic") else {}
    if kind == "revolute" and "limits" not in limits:
        kind = "continuous"
    return Connection(name, kind, first, second, at_first, at_second, AXES[freedom[-1]] if freedom else None, limits, closes)


def _kind(stage: Stage, given: Prim, name: str) -> tuple[str, str]:
    """The kind, and its axis: X, or the freedom of a joint of six (rotX, transZ); empty for kinds without an axis; no kind where the joint holds nothing."""
    type_name = given.kind.type_name
    if type_name in _KINDS:
        kind = _KINDS[type_name]
        if closed := [cone for cone in CONES if given.get(cone) == 0]:
            stage.said.append(
                f"joint {name}: {', '.join(closed)} of 0 lets a ball turn about its axis alone; KSL reads one that turns freely: give a revolute joint"
            )
        if kind not in ("revolute", "prismatic"):
            return kind, ""
        axis = str(given.get("physics:axis"))
        if axis not in AXES:
            raise DescriptionError(f'joint {name}: its physics:axis is "{axis}"; expected X, Y or Z')
        return kind, axis
    if type_name == "PhysicsDistanceJoint":
        _require_slack(stage, given, name)
        stage.unused.append(f"joint {name}: a distance joint, as if its bodies were within its limits")
        return "", ""
    if type_name != "PhysicsJoint":
        raise DescriptionError(f"joint {name}: is a {type_name}, which KSL has no kind for; exclude it, or give a joint of UsdPhysics")
    return _kind_of_six(stage, given, name)


def _require_slack(stage: Stage, given: Prim, name: str) -> None:
    """A distance joint without any is a rod, which no machine stays the same without.  Negative distances limit nothing."""
    least, most = (float(given.get(f"physics:{end}Distance")) for end in ("min", "max"))
    if math.isnan(least) or math.isnan(most):
        raise DescriptionError(f"joint {name}: its minDistance or maxDistance is no number; correct it")
    if 0.0 <= most <= max(least, 0.0):
        raise DescriptionError(
            f"joint {name}: holds its bodies {most * stage.length:.4g} m apart (maxDistance = {most:g}), which KSL has no kind for; give a body with a spherical joint at each end, or disable the joint"
        )


def _kind_of_six(stage: Stage, given: Prim, name: str) -> tuple[str, str]:
    """The kind, and the axis, of a joint that limits each of six freedoms: one whose lower limit is above the upper one, or both of which are 0, is locked."""
    free, held = [], []
    for freedom in _FREEDOMS:
        low, high = _bounds(given, freedom)
        if low is None or high is None or low < high or low == high != 0:
            free.append(freedom)
            held += [f"{freedom} (at {low:g})"] if low is not None and low == high else []
    turns, slides = [f for f in free if f.startswith("rot")], [f for f in free if f.startswith("trans")]
    limited = [f for f in free if any(x is not None and math.isfinite(x) for x in _bounds(given, f))]
    if held and len(free) > 1:
        raise DescriptionError(f"joint {name}: is held in {', '.join(held)} by limits that are the same; turn or move its frames so that it is held at 0")
    if len(free) == 6:
        limits = f", as if within the limits of {', '.join(limited)}" if limited else ""
        stage.unused.append(f"joint {name} (all of its freedoms are free{limits})")
        return "", ""
    known: dict[tuple[int, int], str] = {(0, 0): "fixed", (1, 0): "revolute", (0, 1): "prismatic", (3, 0): "spherical", (0, 3): "translation"}
    along_one = len(turns) == len(slides) == 1 and turns[0][-1] == slides[0][-1]
    kind = known.get((len(turns), len(slides)), "cylindrical" if along_one else "")
    if not kind:
        raise DescriptionError(
            f"joint {name}: is free in {', '.join(free)}, which no kind of joint is; lock some of them, or give two joints with a body between"
        )
    if limited and kind not in ("revolute", "prismatic"):
        stage.unused.append(f"limits of joint {name} in {', '.join(limited)}: those of revolute and prismatic joints are read")
    return kind, (turns or slides)[0] if kind in ("revolute", "prismatic", "cylindrical") else ""


def _bounds(given: Prim, freedom: str) -> tuple[Any, Any]:
    low, high = (given.get(f"limit:{freedom}:physics:{end}") for end in ("low", "high"))
    return low, high


def _side(stage: Stage, given: Prim, k: int, numbers: dict[str, int], name: str) -> tuple[int | None, Array]:
    """The body of one side, None for the world, and the joint's frame (4, 4) in it.  Bodies may be named by a prim below them."""
    prim, body = _target(stage, given, k, name)
    number, own = (None, stage.root) if body is None else (numbers[body], stage.bodies[body])
    frame = AT_REST.copy()
    if (turn := f"physics:localRot{k}") in given.authored:
        frame[:3, :3] = rotation(given.get(turn)) + 0.0  # no zeros with a sign
    local = given.get(place) if (place := f"physics:localPos{k}") in given.authored else None
    at = stage.place(prim)
    if local is not None:
        frame[:3, 3] = stage.offset(prim, three(local)) + 0.0
        if not at.is_plain:
            frame[:3, 3] = at.pose[:3, :3].T @ frame[:3, 3]
    return number, frame if prim is own else inverse(stage.place(own).pose) @ at.pose @ frame


def _target(stage: Stage, given: Prim, k: int, name: str) -> tuple[Prim, str | None]:
    """The prim that one side of a joint names, and the path of the body that it belongs to; the root without one, and None for what belongs to the world."""
    relation_name = f"physics:body{k}"
    relation = given.relations.get(relation_name)
    targets = relation.GetTargets() if relation else []
    if len(targets) > 1:
        raise DescriptionError(f"joint {name}: {relation_name} names {len(targets)} prims; a side of a joint is one body")
    if not targets:
        _require_none(relation, name)
        return stage.root, None
    path = targets[0].GetPrimPath()
    at = str(path)
    if at in stage.bodies:
        return stage.bodies[at], at
    prim = stage.stage.GetPrimAtPath(path)
    if not prim:
        raise DescriptionError(f"joint {name}: {relation_name} is {targets[0]}, and no such prim is there; correct the path")
    if not (prim.IsActive() and prim.IsDefined()):
        raise DescriptionError(f"joint {name}: {relation_name} is {targets[0]}, which is not active; activate it, or disable the joint")
    return other(at, prim), stage.owner.get(at)


def _require_none(relation: Any, name: str) -> None:
    """No target means the world, where the file gives none.  One that USD drops, since it leads out of what a reference takes, means a body that is missing."""
    named = (
        [path for spec in relation.GetPropertyStack() for path in spec.targetPathList.GetAddedOrExplicitItems()]
        if relation and relation.HasAuthoredTargets()
        else []
    )
    if named:
        raise DescriptionError(
            f"joint {name}: {relation.GetName()} is {named[0]}, which USD can't follow from there; give the file that has that prim, or correct the path"
        )


def _numbers(stage: Stage, given: Prim, name: str, kind: str, freedom: str) -> dict[str, Any]:
    """Limits of UsdPhysics, and what PhysX's attributes say of speed, armature and friction: SI units."""
    turns = kind == "revolute"
    unit, inertia = (math.radians(1.0), stage.mass * stage.length**2) if turns else (stage.length, stage.mass)
    of_effort = stage.mass * stage.length ** (2 if turns else 1)
    general = given.kind.type_name == "PhysicsJoint"
    found: dict[str, Any] = {}
    ends = [f"limit:{freedom}:physics:{end}" for end in ("low", "high")] if general else [f"physics:{end}" for end in ("lowerLimit", "upperLimit")]
    bounds = [given.get(end) for end in ends]
    stage.read[given.path].update(ends)
    limits = [None if x is None or math.isinf(x) else judged(float(x) * unit, f"joint {name}: a limit of its position", POSITION) for x in bounds]
    if None not in limits and limits[0] > limits[1]:  # type: ignore[operator]
        stage.said.append(f"joint {name}: its lower limit ({bounds[0]:g}) is above its upper one ({bounds[1]:g}); neither is taken")
    elif limits != [None, None]:
        found["limits"] = tuple(limits)
    drive = freedom if general else "angular" if turns else "linear"
    for ours, theirs, factor, kept in (
        ("effort", f"drive:{drive}:physics:maxForce", of_effort, EFFORT),
        ("velocity", "physxJoint:maxJointVelocity", unit, SPEED),
        ("armature", "physxJoint:armature", inertia, MOMENT),
    ):
        stage.read[given.path].add(theirs)
        value = _positive(given, theirs)
        if value is not None and not (ours == "velocity" and value >= NO_SPEED_LIMIT):
            found[ours] = judged(value * factor, f"joint {name}: {theirs}", kept)
    return found


def _positive(given: Prim, name: str) -> float | None:
    """What limits something: 0 and ∞ limit nothing, and so does the largest number that single precision has, or one near it."""
    value = given.get(name)
    if value is None or value == 0 or value > 1e30:
        return None
    return float(value)
