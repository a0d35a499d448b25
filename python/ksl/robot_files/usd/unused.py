"""Attributes of bodies and joints of a USD stage that KSL doesn't use, by name."""

from __future__ import annotations

import math
import re
from typing import Any

import numpy as np

from ksl.base.words import listed
from ksl.robot_files.usd.stage import Stage

READ = re.compile(
    r"physics:(body[01]|local(Pos|Rot)[01]|axis|(lower|upper)Limit|jointEnabled|excludeFromArticulation|(min|max)Distance|mass|density|centerOfMass|diagonalInertia"
    r"|principalAxes|rigidBodyEnabled|kinematicEnabled|gearRatio|ratio|hinge[01]?|prismatic)|limit:\w+:physics:(low|high)|drive:\w+:physics:maxForce"
    r"|physxJoint:(maxJointVelocity|armature)|physxMimicJoint:.*|newton:mimic.*|newton:jointsAddMobility"
)
"""What joints.py, masses.py and couplings.py read, or list themselves."""
NUMBERS = re.compile(r"physics:(lower|upper)Limit|limit:\w+:physics:(low|high)|drive:\w+:physics:maxForce|physxJoint:(maxJointVelocity|armature)")
"""Numbers that a joint of another kind has no use for, a linear drive of a hinge for instance: they are read where `Stage.read` has them."""
OF_MASS = {"PhysicsMassAPI", "NewtonMassAPI"}
"""Schemas with which masses.py reads newton:inertia."""
SHOWN = ("xformOp", "material:", "primvars:", "collection:", "ui:", "isaac:", "omni:", "physxTendon:")
"""Beginnings of names that say how a prim stands or looks, or whom it belongs to; tendons are listed as such."""


def list_unused(stage: Stage) -> None:
    """A line for each attribute that has a value, with the bodies and joints that have it.  Attributes without a namespace are of shapes."""
    found: dict[str, list[str]] = {}
    known: dict[str, bool] = {}
    for of_kind in (stage.bodies, stage.joints):
        for path, prim in of_kind.items():
            for name in sorted(prim.authored):
                if name == "newton:inertia" and of_kind is stage.bodies and not OF_MASS.isdisjoint(prim.kind.applied):
                    continue
                if name not in known:
                    known[name] = ":" not in name or READ.fullmatch(name) is not None or name.startswith(SHOWN)
                is_idle = not known[name] or (path in stage.read and name not in stage.read[path] and NUMBERS.fullmatch(name) is not None)
                if is_idle and _says_something(prim.prim.GetProperty(name)):
                    found.setdefault(name, []).append(stage.names[path])
    stage.unused += [f"{name} of {listed(names, 6)}" for name, names in found.items()]


def _says_something(of: Any) -> bool:
    """Whether a property has a value that isn't nothing: no number, 0, false, or no limit."""
    value = of.Get() if hasattr(of, "Get") else of.GetTargets()
    if value is None or isinstance(value, str):
        return bool(value)
    try:
        numbers = np.asarray(value, dtype=float)
    except (TypeError, ValueError):  # a quaternion, or paths
        return bool(value)
    return bool(numbers.size) and not all(x == 0 or math.isinf(x) for x in numbers.ravel().tolist())
