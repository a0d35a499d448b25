"""What couples joints or bodies of a USD stage besides joints of UsdPhysics: schemas of simulators, known and unknown.

The question is whether a prim, or a schema that is applied to it, names two bodies or joints by its relationships.  Mimic joints of Newton and PhysX,
gears and racks of PhysX are read, as joints that follow others.  Whatever else names two is refused: without it the machine would be another one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from ksl.base.errors import DescriptionError
from ksl.base.judged import RATIO, Bounds, judged
from ksl.robot_files.assembly import Array, Body, Connection
from ksl.robot_files.usd.stage import Prim, Stage, rotation, three

SELECT = ("collection:", "material:binding", "proxyPrim", "physics:filtered", "physics:simulationOwner", "skel:", "light:", "inputs:", "outputs:", "isaac:", "omni:", "physxContactReport:", "physxTrigger:", "physxTendon:")  # fmt: skip
"""Beginnings of names of relationships that choose prims, or report of them, and hold none; tendons pull, and are listed as not used."""
BODIES = {"physics:body0", "physics:body1"}
"""What joints connect."""
GEARS = {
    "PhysxPhysicsGearJoint": (("physics:hinge0", "physics:hinge1"), "physics:gearRatio"),
    "PhysxPhysicsRackAndPinionJoint": (("physics:hinge", "physics:prismatic"), "physics:ratio"),
}
"""The relationships to the two joints, in the order of body0 and body1, and the attribute with the ratio."""
OFFSET = Bounds(0.0, 1e9, "rad or m", zero=True, signed=True)
PARALLEL = 1e-4
"""1 − the cosine of the angle between an axis of gears and that of its hinge."""
ACROSS = 1e-3
"""Sine of the angle between a rack and the way that the pinion's rim moves, from which on the sign of their ratio is one."""


@dataclass
class _Coupling:
    follower: str
    """Paths of joints."""
    leader: str
    multiplier: float
    offset: float
    who: str


def couple(stage: Stage, bodies: dict[str, Body], found: dict[str, Connection], independent: bool) -> list[str]:
    """Makes joints follow others by `numbers["mimic"]`, unless they are to be independent; names of those that do.  Raises DescriptionError for what can't be read."""
    _list_tendons(stage)
    couplings: dict[str, _Coupling] = {}
    for prim, relations in stage.related:
        for c in _of_prim(stage, bodies, found, prim, relations):
            if c.follower in couplings:
                raise DescriptionError(f"{c.who} couples joint {stage.names[c.follower]}, which {couplings[c.follower].who} couples already; keep one of both")
            couplings[c.follower] = c
    if independent:
        return []
    for path, c in couplings.items():
        for joint in (path, c.leader):
            kind = found[joint].kind if joint in found else "joint that holds nothing, or is not enabled"
            if kind not in ("revolute", "continuous", "prismatic"):
                raise DescriptionError(f"{c.who} couples joint {stage.names[joint]}, a {kind}; revolute and prismatic joints can be coupled")
        found[path].numbers["mimic"] = (found[c.leader].name, c.multiplier, c.offset)
    return [found[path].name for path in couplings]


def require_in_tree(connections: list[Connection], loops: list[str]) -> None:
    """Joints that close loops have no position that follows another one, or is followed."""
    for c in connections:
        if "mimic" in c.numbers:
            for name in (c.name, c.numbers["mimic"][0]):
                if name in loops:
                    raise DescriptionError(
                        f"joint {c.name} follows joint {c.numbers['mimic'][0]}, but {name} closes a loop, and has no position; exclude another joint from the articulation"
                    )


def _of_prim(stage: Stage, bodies: dict[str, Body], found: dict[str, Connection], prim: Prim, given: list[Any]) -> list[_Coupling]:
    path, type_name = prim.path, prim.kind.type_name
    of_joint = path in stage.joints and type_name not in GEARS
    if of_joint and prim.relations.keys() <= BODIES:
        return []
    relations = {name: r for r in given if not (name := r.GetName()).startswith(SELECT)}
    if not relations or (of_joint and relations.keys() <= BODIES):
        return []
    if not of_joint and prim.prim.HasAttribute("physics:jointEnabled") and not prim.prim.GetAttribute("physics:jointEnabled").Get():
        stage.unused.append(f"joint {path} ({type_name}, not enabled)")
        return []
    if type_name in GEARS:
        return [_of_gear(stage, bodies, found, prim, type_name)]
    named = {path} if of_joint or path in stage.bodies else set()
    couplings, unknown = [], []
    for name, relation in relations.items():
        if name in BODIES and of_joint:
            continue
        targets = _named(stage, relation)
        if name in BODIES and targets:
            raise DescriptionError(
                f"prim {path}: connects bodies ({name} is {targets[0]}) as a {type_name or 'prim without a type'}, which KSL has no kind for; give a joint of UsdPhysics, or disable it"
            )
        if name == "prototypes" and any(f"{body}/".startswith(f"{target}/") for target in relation.GetTargets() for body in stage.bodies):
            raise DescriptionError(f"prim {path}: a {type_name} makes copies of rigid bodies, which KSL can't read; write each as a prim of its own")
        mimic = _mimic(stage, found, prim, name, targets) if of_joint else None
        if mimic is not None:
            couplings += mimic
        elif targets:
            unknown.append((name, targets))
    names = sorted(named.union(*(targets for _, targets in unknown))) if unknown else []
    if len(names) >= 2:
        what = ", ".join(stage.names[n] for n in names[:4])
        raise DescriptionError(
            f"prim {path}: {', '.join(name for name, _ in unknown)} names {what}, and KSL doesn't know what that holds or couples; without it the machine would be another one: "
            "remove it if it holds nothing, or give joints of UsdPhysics, NewtonMimicAPI or PhysxMimicJointAPI"
        )
    if len(names) == 1 and names[0] != path and names[0] in stage.joints:
        stage.unused.append(f"{type_name or 'prim'} {path} at joint {stage.names[names[0]]}")  # actuators of Newton, for instance
    return couplings


def _named(stage: Stage, relation: Any) -> list[str]:
    """Paths of the joints and bodies that a relationship leads to; a body also by a prim below it."""
    found = []
    for target in relation.GetTargets():
        path = str(target.GetPrimPath())
        if path in stage.joints or path in stage.owner:
            found.append(path if path in stage.joints else stage.owner[path])
    return found


def _number(prim: Prim, name: str, default: float) -> float:
    value = prim.prim.GetAttribute(name).Get() if prim.prim.HasAttribute(name) else None
    return default if value is None else float(value)


def _unit(stage: Stage, found: dict[str, Connection], path: str) -> float:
    """rad or m of the unit in which a file has a joint's position."""
    return stage.length if path in found and found[path].kind == "prismatic" else math.radians(1.0)


def _mimic(stage: Stage, found: dict[str, Connection], prim: Prim, name: str, targets: list[str]) -> list[_Coupling] | None:
    """What a relationship of a mimic schema means; None for other relationships.

    Newton: q = coef0 + coef1 × that of the leader.  PhysX: q + gearing × that of the leader + offset = 0.  Both in units of the file, degrees or lengths."""
    instance = name.split(":")[1] if name.startswith("physxMimicJoint:") and name.endswith(":referenceJoint") else ""
    newton = name == "newton:mimicJoint"
    if not (newton or instance) or ("NewtonMimicAPI" if newton else f"PhysxMimicJointAPI:{instance}") not in prim.kind.applied:
        return None
    path = prim.path
    who = f"joint {stage.names[path]}: {'NewtonMimicAPI' if newton else f'PhysxMimicJointAPI:{instance}'}"
    if path not in found:  # it is not enabled, and listed as that
        return []
    if newton and prim.get("newton:mimicEnabled") is False:
        stage.unused.append(f"{who} (not enabled)")
        return []
    if len(targets) != 1 or targets[0] not in stage.joints or targets[0] == path:
        raise DescriptionError(f"{who}: {name} names {len(targets)} joints; expected one other joint; correct it, or remove the schema")
    if curved := [f"mjc:coef{k}" for k in (2, 3, 4) if _number(prim, f"mjc:coef{k}", 0.0)]:
        raise DescriptionError(f"{who}: {', '.join(curved)} of MjcEqualityJointAPI make a polynomial of it that isn't linear; make it linear, or remove it")
    unit, of_leader = _unit(stage, found, path), _unit(stage, found, targets[0])
    if newton:
        if unit != of_leader:
            raise DescriptionError(f"{who}: a joint that turns and one that slides have no unit in common there; use PhysxMimicJointAPI, whose gearing has one")
        multiplier, offset = _number(prim, "newton:mimicCoef1", 1.0), _number(prim, "newton:mimicCoef0", 0.0)
    else:
        start = f"physxMimicJoint:{instance}"
        multiplier, offset = -_number(prim, f"{start}:gearing", 1.0), -_number(prim, f"{start}:offset", 0.0)
        if _number(prim, f"{start}:naturalFrequency", 0.0) or _number(prim, f"{start}:dampingRatio", 0.0):
            stage.unused.append(f"{who}: naturalFrequency and dampingRatio; the coupling is exact")
    ratio = judged(multiplier * unit / of_leader, f"{who}: its ratio", RATIO)
    return [_Coupling(path, targets[0], ratio, judged(offset * unit, f"{who}: its offset", OFFSET), who)]


def _of_gear(stage: Stage, bodies: dict[str, Body], found: dict[str, Connection], prim: Prim, type_name: str) -> _Coupling:
    """Gears, and a pinion with its rack, of PhysX: between joints by which two bodies move on a third one, or on the world.

    Gears: ratio × θ₀ + θ₁ = 0.  A rack: θ = ratio × x, with the sign that its place beside the pinion has; degrees for a unit of length."""
    who, relations, ratio_name = f"joint {prim.path} ({type_name})", *GEARS[type_name]
    ratio = judged(_number(prim, ratio_name, 1.0), f"{who}: its {ratio_name}", RATIO)
    joints, axes, places, others = [], [], [], []
    for k, relation in enumerate(relations):
        named = {r: _named(stage, prim.prim.GetRelationship(r)) for r in (relation, f"physics:body{k}")}
        if any(len(targets) != 1 for targets in named.values()) or named[relation][0] not in found:
            raise DescriptionError(f"{who}: {relation} and physics:body{k} name no joint that is enabled and a body of it; give both, or remove it")
        joint, body = found[named[relation][0]], list(bodies).index(named[f"physics:body{k}"][0])
        if body not in (joint.first, joint.second) or joint.kind not in (("prismatic",) if relation.endswith("prismatic") else ("revolute", "continuous")):
            raise DescriptionError(
                f"{who}: {relation} is joint {joint.name}, which is {'a ' + joint.kind + ' joint' if body in (joint.first, joint.second) else f'no joint of physics:body{k}'}; correct it"
            )
        turn, place = (prim.prim.GetAttribute(f"physics:local{what}{k}").Get() for what in ("Rot", "Pos"))
        own = bodies[stage.owner[named[f"physics:body{k}"][0]]].pose
        axis = own[:3, :3] @ rotation(turn)[:, 0]
        at = _joint_axes(list(bodies.values()), joint, body) @ np.asarray(joint.axis)
        if abs(float(axis @ at)) < 1 - PARALLEL:
            raise DescriptionError(
                f"{who}: the x axis of its frame on physics:body{k} isn't that of joint {joint.name}; turn physics:localRot{k} so that it is"
            )
        # the angle of the body against the other one, about the axis of the gear
        joints.append((named[relation][0], math.copysign(1.0, float(axis @ at)) * (1.0 if body == joint.second else -1.0)))
        axes.append(axis)
        places.append(stage.point(stage.bodies[named[f"physics:body{k}"][0]], three(place or (0, 0, 0))))
        others.append(joint.first if body == joint.second else joint.second)
    if others[0] != others[1]:
        raise DescriptionError(
            f"{who}: its joints {' and '.join(found[j].name for j, _ in joints)} are on different bodies, on which the ratio depends; give both on one body"
        )
    (leader, s0), (follower, s1) = joints
    if type_name == "PhysxPhysicsGearJoint":
        return _Coupling(follower, leader, -ratio * s0 / s1, 0.0, who)
    rim = np.cross(axes[0], places[1] - places[0])
    along = float(rim @ axes[1])
    if abs(along) <= ACROSS * float(np.linalg.norm(places[1] - places[0])) or not along:
        raise DescriptionError(
            f"{who}: its rack stands where the pinion's rim doesn't move along it, so that the sign of its ratio is open; move its frames, physics:localPos0 and physics:localPos1"
        )
    turn_for_length = ratio * math.radians(1.0) / stage.length * math.copysign(1.0, along)
    return _Coupling(follower, leader, judged(s0 / (s1 * turn_for_length), f"{who}: its ratio", RATIO), 0.0, who)


def _joint_axes(bodies: list[Body], joint: Connection, body: int) -> Array:
    """The axes (3, 3) of a joint's frame on one of its bodies, in the world, as the file has them."""
    at = joint.at_second if body == joint.second else joint.at_first
    return np.asarray(bodies[body].pose[:3, :3] @ at[:3, :3])


def _list_tendons(stage: Stage) -> None:
    """Tendons of PhysX, which pull as springs do: what they are called, and at which joints or bodies."""
    tendons: dict[str, list[str]] = {}
    for prim in stage.tendons:
        for schema in prim.kind.applied:
            if schema.startswith("PhysxTendon"):
                tendons.setdefault(schema.partition(":")[2], []).append(prim.path.rpartition("/")[2])
    stage.unused += [f"tendon {name} (PhysX) at {', '.join(dict.fromkeys(at))}" for name, at in tendons.items()]
