"""Limits of joints in a file beside those that their motors give through the mechanism."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from ksl.drivetrain.assembly import positions_of
from ksl.drivetrain.efforts import EffortMap
from ksl.drivetrain.ranges import range_of
from ksl.drivetrain.region import usable_positions
from ksl.mechanism.mechanism import Joint
from ksl.mechanism.states import Array

SAMPLES = 240
ROUNDED = 1e-3
"""A share of a limit by which files may round."""
WORDS = {"limit": "the limit of", "reach": "the end of reach", "hold": "where the motors hold nothing", "none": "no end"}
Judgement = Literal["true", "too large", "too small", "partly too large", "not judged"]


@dataclass(frozen=True)
class JudgedLimit:
    """One limit of one joint."""

    file: str
    joint: str
    what: str
    """"lower", "upper", "effort" or "velocity"."""
    given: float | None
    least: float
    """What the motors give: of positions where the range ends; of efforts and velocities the least over the range, of the joint alone."""
    most: float
    box: float
    """What efforts and velocities all joints have together at every position; otherwise NaN."""
    judgement: Judgement
    """"too large": the motors give it nowhere, or not so far; "partly too large": not everywhere; "too small": they give more everywhere, which a file may want;
    "not judged": positions are followed from a start that is beyond a limit."""
    reason: str
    share: float
    """The share of the range in which the file's number is too large."""


def judged_limits(a: EffortMap, joints: dict[str, Joint] | None = None, file: str = "") -> list[JudgedLimit]:
    """The limits of each joint of a map in a file, by default the model's own.

    joints: {name: joint} of the file.  Limits that it doesn't give are left out.  Positions: from the start along each joint, the others kept.
    """
    of_file = {name: a.model.joint(name) for name in a.joints} if joints is None else joints
    at = a.start[positions_of(a.equations, a.equations.part.of_joints)]
    q = usable_positions(a, at, SAMPLES)
    found: list[JudgedLimit] = []
    for k, name in enumerate(a.joints):
        joint = of_file.get(name)
        if joint is None or joint.nv > 1:
            continue
        found += _positions(a, at, joint, file)
        for what, given, alone, box in (("effort", joint.effort, a.effort_alone, a.effort_box), ("velocity", joint.velocity, a.velocity_alone, a.velocity_box)):
            if given and a.has_limits("effort" if what == "effort" else "velocity"):
                found.append(_of_motors(file, name, what, given, alone(q)[:, k], box(q)[:, k, 1].min()))
    return found


def _of_motors(file: str, name: str, what: str, given: float, alone: Array, box: float) -> JudgedLimit:
    least, most = float(alone.min()), float(alone.max())
    share = float(np.mean(alone < given * (1 - ROUNDED)))
    judgement: Judgement = "too large" if share == 1.0 else "partly too large" if share > 0 else "too small" if least > given * (1 + ROUNDED) else "true"
    said = {
        "too large": "motors give it nowhere",
        "partly too large": f"motors don't give it in {max(share, 0.01):.0%} of the range",
        "too small": "motors give more everywhere",
        "true": "",
    }
    return JudgedLimit(file, name, what, given, least, most, float(box), judgement, said[judgement], share)


def _positions(a: EffortMap, at: Array, joint: Joint, file: str) -> list[JudgedLimit]:
    r = range_of(a, joint.name, at, limits=True, own=False)
    found = []
    for what, given, end, by, whose, sign in (
        ("lower", joint.lower, r.lower, r.lower_by, r.lower_name, -1),
        ("upper", joint.upper, r.upper, r.upper_by, r.upper_name, 1),
    ):
        if given is None:
            continue
        if r.upper == r.lower:
            reason = f"the start, {end:.4g} {joint.unit}, is beyond the limit of {whose}; take a map with start= of a closed position within limits"
            found.append(JudgedLimit(file, joint.name, what, given, np.nan, np.nan, np.nan, "not judged", reason, np.nan))
            continue
        beyond = sign * (given - end) > ROUNDED * max(1.0, abs(given))
        reason = f"the range ends at {end:.4g} {joint.unit}, {WORDS[by]}{' ' + whose if whose else ''}" if beyond else ""
        found.append(JudgedLimit(file, joint.name, what, given, end, end, np.nan, "too large" if beyond else "true", reason, np.nan))
    return found
