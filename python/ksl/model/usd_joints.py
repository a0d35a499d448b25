"""Joints of a USD stage as connections of bodies, in SI units."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ksl.base.errors import DescriptionError
from ksl.model.assembly import Array, Body, Connection
from ksl.model.usd_stage import Stage, rotation, short_names

AXES = {"X": np.array([1.0, 0.0, 0.0]), "Y": np.array([0.0, 1.0, 0.0]), "Z": np.array([0.0, 0.0, 1.0])}
_KINDS = {"PhysicsFixedJoint": "fixed", "PhysicsRevoluteJoint": "revolute", "PhysicsPrismaticJoint": "prismatic", "PhysicsSphericalJoint": "spherical"}
NO_SPEED_LIMIT = 1e6
"""deg/s or units/s: PhysX's default, which limits nothing."""
_FREEDOMS = ("transX", "transY", "transZ", "rotX", "rotY", "rotZ")


def joints_of(stage: Stage, bodies: dict[str, Body]) -> tuple[list[Connection], list[str]]:
    """Joints that are enabled, and the names of those that have drives.  Raises DescriptionError for joints that KSL has no kind for."""
    from pxr import UsdPhysics

    prims = [prim for prim in stage.prims() if prim.IsA(UsdPhysics.Joint)]
    names, numbers = short_names([str(prim.GetPath()) for prim in prims]), {path: i for i, path in enumerate(bodies)}
    found, driven = [], []
    for prim in prims:
        name = names[str(prim.GetPath())]
        if not UsdPhysics.Joint(prim).GetJointEnabledAttr().Get():
            stage.unused.append(f"joint {name} (not enabled)")
            continue
        connection = _connection(stage, prim, name, numbers, list(bodies.values()))
        if connection is None:
            continue
        found.append(connection)
        if any(schema.startswith("PhysicsDriveAPI") for schema in prim.GetAppliedSchemas()):
            driven.append(name)
    return found, driven


def _connection(stage: Stage, prim: Any, name: str, numbers: dict[str, int], bodies: list[Body]) -> Connection | None:
    from pxr import UsdPhysics

    kind, axis = _kind(stage, prim, name)
    joint = UsdPhysics.Joint(prim)
    first, at_first = _side(stage, joint.GetBody0Rel(), joint.GetLocalPos0Attr(), joint.GetLocalRot0Attr(), numbers, bodies, name)
    second, at_second = _side(stage, joint.GetBody1Rel(), joint.GetLocalPos1Attr(), joint.GetLocalRot1Attr(), numbers, bodies, name)
    if not kind:
        return None
    if first == second:
        stage.unused.append(f"joint {name} (both of its sides are the same body, or the world)")
        return None
    closes = bool(joint.GetExcludeFromArticulationAttr().Get())
    limits: dict[str, Any] = _numbers(stage, prim, kind)
    if kind == "revolute" and "limits" not in limits:
        kind = "continuous"
    return Connection(name, kind, first, second, at_first, at_second, axis, limits, closes)


def _kind(stage: Stage, prim: Any, name: str) -> tuple[str, Array | None]:
    """The kind and its axis; no kind where the joint holds nothing."""
    type_name = str(prim.GetTypeName())
    if type_name in _KINDS:
        kind = _KINDS[type_name]
        axis = AXES.get(str(prim.GetAttribute("physics:axis").Get())) if kind in ("revolute", "prismatic") else None
        return kind, axis
    if type_name == "PhysicsDistanceJoint":
        _require_slack(stage, prim, name)
        stage.unused.append(f"joint {name}: a distance joint, as if its bodies were within its limits")
        return "", None
    if type_name != "PhysicsJoint":
        raise DescriptionError(f"joint {name}: is a {type_name}, which KSL has no kind for; exclude it, or give a joint of UsdPhysics")
    return _kind_of_six(stage, prim, name)


def _require_slack(stage: Stage, prim: Any, name: str) -> None:
    """A distance joint without any is a rod, which no machine stays the same without.  Negative distances limit nothing."""
    least, most = (float(prim.GetAttribute(f"physics:{end}Distance").Get()) for end in ("min", "max"))
    if 0.0 <= most <= max(least, 0.0):
        raise DescriptionError(
            f"joint {name}: holds its bodies {most * stage.length:.4g} m apart (maxDistance = {most:g}), which KSL has no kind for; give a body with a spherical joint at each end, or disable the joint"
        )


def _kind_of_six(stage: Stage, prim: Any, name: str) -> tuple[str, Array | None]:
    """The kind, and the axis, of a joint that limits each of six freedoms: one whose lower limit is above the upper one is locked."""
    free = []
    for freedom in _FREEDOMS:
        low, high = (prim.GetAttribute(f"limit:{freedom}:physics:{end}").Get() for end in ("low", "high"))
        if low is None or high is None or low <= high:
            free.append(freedom)
    turns, slides = [f[-1] for f in free if f.startswith("rot")], [f[-1] for f in free if f.startswith("trans")]
    if len(free) == 6:
        stage.unused.append(f"joint {name} (all of its freedoms are free)")
        return "", None
    known: dict[tuple[int, int], str] = {(0, 0): "fixed", (1, 0): "revolute", (0, 1): "prismatic", (3, 0): "spherical", (0, 3): "translation"}
    kind = known.get((len(turns), len(slides)), "cylindrical" if turns == slides and len(turns) == 1 else "")
    if not kind:
        raise DescriptionError(f"joint {name}: is free in {', '.join(free)}, which no kind of joint is; lock some of them, or give two joints with a body between")
    return kind, AXES[(turns or slides)[0]] if kind in ("revolute", "prismatic", "cylindrical") else None


def _side(stage: Stage, relation: Any, position: Any, turn: Any, numbers: dict[str, int], bodies: list[Body], name: str) -> tuple[int | None, Array]:
    """The body of one side, None for the world, and the joint's frame (4, 4) in it.  Bodies may be named by a prim below them."""
    targets = relation.GetTargets()
    if len(targets) > 1:
        raise DescriptionError(f"joint {name}: {relation.GetName()} names {len(targets)} prims; a side of a joint is one body")
    local, R = position.Get() or (0, 0, 0), rotation(turn.Get())
    frame = np.eye(4)
    if not targets:
        frame[:3, :3], frame[:3, 3] = R, np.array(local, dtype=float) * stage.length
        return None, frame
    prim = stage.stage.GetPrimAtPath(targets[0])
    if not prim:
        raise DescriptionError(f"joint {name}: {relation.GetName()} is {targets[0]}, and no such prim is there; correct the path")
    frame[:3, :3], frame[:3, 3] = stage.pose(prim)[:3, :3] @ R, stage.point(prim, local)
    at = prim
    while at and str(at.GetPath()) not in numbers:
        at = at.GetParent()
    if not at:
        return None, frame
    i = numbers[str(at.GetPath())]
    return i, np.linalg.inv(bodies[i].pose) @ frame


def _numbers(stage: Stage, prim: Any, kind: str) -> dict[str, Any]:
    """Limits of UsdPhysics, and what PhysX's attributes say of speed, armature and friction: SI units."""
    if kind not in ("revolute", "prismatic"):
        return {}
    turns = kind == "revolute"
    unit, of_effort = (math.radians(1.0), stage.mass * stage.length**2) if turns else (stage.length, stage.mass * stage.length)
    freedom = "angular" if turns else "linear"
    found: dict[str, Any] = {}
    bounds = [prim.GetAttribute(f"physics:{end}").Get() for end in ("lowerLimit", "upperLimit")]
    if prim.GetTypeName() == "PhysicsJoint":
        ends = [(f, [prim.GetAttribute(f"limit:{f}:physics:{end}").Get() for end in ("low", "high")]) for f in _FREEDOMS if f.startswith("rot") == turns]
        bounds = next(([low, high] for _, (low, high) in ends if low is not None and high is not None and low <= high), [None, None])
    if all(x is not None and math.isfinite(x) for x in bounds) and bounds[0] <= bounds[1]:
        found["limits"] = tuple(float(x) * unit for x in bounds)
    force = _positive(prim, f"drive:{freedom}:physics:maxForce")
    if force is not None:
        found["effort"] = force * (of_effort if turns else stage.mass * stage.length)
    for ours, theirs, factor in (("velocity", "physxJoint:maxJointVelocity", unit), ("armature", "physxJoint:armature", stage.mass * (stage.length**2 if turns else 1.0))):
        value = _positive(prim, theirs)
        if value is not None and (ours != "velocity" or value < NO_SPEED_LIMIT):
            found[ours] = value * factor
    return found


def _positive(prim: Any, name: str) -> float | None:
    value = prim.GetAttribute(name).Get() if prim.HasAttribute(name) else None
    return float(value) if value is not None and math.isfinite(value) and 0 < value < 1e30 else None
