"""Units that can't be: degrees taken as radians, millimetres as metres, milliseconds as seconds."""

from __future__ import annotations

import numpy as np

from ksl.mechanism.calls import Calls
from ksl.mechanism.lengths import extent
from ksl.mechanism.mechanism import Joint, Mechanism
from ksl.mechanism.states import Array

DEGREE = np.pi / 180

FAR = 1.5
"""Positions in degrees are suspected where they go beyond the range of the limits by this share of it."""

MANY_TURNS = 100.0
"""rad; joints without limits that go further, 16 turns, are suspected to be in degrees."""

FAR_SLIDE = 20.0
"""Slides without limits that go further than so many times the extent of the robot are suspected to be in millimetres."""

USUAL_SPEED = 2.0
"""rad/s or m/s, where the file gives no limit."""

SLOW = 5e-3
"""A motion whose fastest joint doesn't reach this share of its limit is suspected to have times in a smaller unit …"""

LONG_STEP = 0.1
"""… if its samples are also further apart than this, s."""

TIME_UNITS = {1e-3: ("milliseconds", "ms"), 1e-6: ("microseconds", "us"), 1e-9: ("nanoseconds", "ns")}


def suspicions(model: Mechanism, time: Array, q: Array, v: Array) -> list[str]:
    """Sentences that name a unit that can't be and the option that mends it; q (n, nq), v (n, nv)."""
    joints = [j for j in model.joints[: len(model.joint_names)] if j.one_coordinate]
    mend = 'Then give their unit in a map: unit = "mm" (--map)'
    found = [_about_degrees(joints, q, "Then add --degrees"), _about_millimetres(model, joints, q, mend), _about_time(joints, time, v)]
    return [sentence for sentence in found if sentence is not None]


def suspicions_of_pose(model: Mechanism, q: Array) -> list[str]:
    """Sentences about units that can't be of one pose q (nq), which has no speeds."""
    joints = [j for j in model.joints[: len(model.joint_names)] if j.one_coordinate]
    angles = _about_degrees(joints, q[None], "Positions are in rad; on the command line 90deg is an angle in degrees")
    return [x for x in (angles, _about_millimetres(model, joints, q[None], "Positions of slides are in m")) if x is not None]


def _about_degrees(joints: list[Joint], q: Array, mend: str) -> str | None:
    turning = [j for j in joints if j.has_angle]
    if not turning:
        return None
    reach = {j.name: float(np.abs(q[:, j.q_index]).max()) for j in turning}
    far = [j for j in turning if reach[j.name] > _range(j)]
    if not far or any(reach[j.name] * DEGREE > _range(j) for j in turning):  # as degrees all of them must be possible
        return None
    joint = max(far, key=lambda j: reach[j.name] / _range(j))
    bounds = _bounds(joint)
    limit = f", and its limits are {bounds[0]:.4g} and {bounds[1]:.4g} rad" if bounds else ""
    return f"{joint.name} reaches {reach[joint.name]:.4g} rad{limit}: are these degrees? {mend}"


def _about_millimetres(model: Mechanism, joints: list[Joint], q: Array, mend: str) -> str | None:
    reach = {j.name: float(np.abs(q[:, j.q_index]).max()) for j in joints if not j.has_angle}
    if not any(x > 1 for x in reach.values()):
        return None
    without_limits = FAR_SLIDE * extent(model) if isinstance(model, Calls) else 0.0
    most = {j.name: _range(j, without_limits or np.inf) for j in joints if j.name in reach}
    far = [name for name, x in reach.items() if x > most[name]]
    if not far or any(reach[name] / 1000 > most[name] for name in far):  # as millimetres they must be possible
        return None
    joint = max((j for j in joints if j.name in far), key=lambda j: reach[j.name] / most[j.name])
    bounds = _bounds(joint)
    limits = (
        f"its limits are {bounds[0]:.4g} and {bounds[1]:.4g} m"
        if bounds
        else f"the robot's extent is {extent(model):.3g} m"
        if isinstance(model, Calls)
        else ""
    )
    return f"{joint.name} reaches {reach[joint.name]:.4g} m, and {limits}: are these millimetres? {mend}"


def _bounds(joint: Joint) -> tuple[float, float] | None:
    """The limits of a joint that has two; equal ones mean none."""
    lower, upper = joint.lower, joint.upper
    return (lower, upper) if joint.has_limits and lower is not None and upper is not None and lower < upper else None


def _range(joint: Joint, without_limits: float = MANY_TURNS) -> float:
    """Beyond which a position is not to be expected, rad or m."""
    if bounds := _bounds(joint):
        return FAR * max(abs(bounds[0]), abs(bounds[1]), bounds[1] - bounds[0])
    return without_limits


def _about_time(joints: list[Joint], time: Array, v: Array) -> str | None:
    if not joints:
        return None
    speeds = {j.name: float(np.abs(v[:, j.v_index]).max()) / (j.velocity or USUAL_SPEED) for j in joints}
    name = max(speeds, key=lambda n: speeds[n])
    share, step = speeds[name], float(np.median(np.diff(time)))
    limit = "its limit" if next(j for j in joints if j.name == name).velocity else f"{USUAL_SPEED:g} rad/s or m/s"
    if 0 < share < SLOW and step > LONG_STEP:
        for unit, (word, option) in TIME_UNITS.items():
            if 0.02 < share / unit <= 1 and step * unit < 1:
                return (
                    f"samples are {step:.4g} s apart, and {name} is the fastest joint with {share:.2g} of {limit}: "
                    f"are times in {word}? Then add --time-unit {option}"
                )
    if share > 100 and time[-1] - time[0] < 0.1 and step < 1e-4:
        return (
            f"all is over in {time[-1] - time[0]:.3g} s, and {name} reaches {share:.3g} times {limit}: check the unit of the times, --time-unit if it is given"
        )
    return None
