"""Rules of joint limits."""

from __future__ import annotations

import math
from collections.abc import Iterator

from ksl.checks.description.findings import Repair
from ksl.checks.description.repair import digits, shown
from ksl.checks.description.robot import FileJoint, RobotFile
from ksl.checks.rule import Broken, rule
from ksl.mechanism.joint_kinds import KINDS

BOUNDED = frozenset(kind.name for kind in KINDS.values() if kind.in_urdf and kind.has_limits)
LONGEST = 20.0
"""m.  A travel beyond that is more often one in millimetres than a long one; gantries of 20 m exist."""
WIDEST = 4 * math.pi
"""rad.  Wrists and turntables reach two turns; 90 and 180 are degrees."""
UNLIMITED = 1000.0
"""Larger bounds mean that there are none."""


def _unit(joint: FileJoint) -> str:
    return KINDS[joint.kind].position_unit[0]


@rule(
    "limit-missing",
    "error",
    condition="A revolute or prismatic joint has <limit> with effort and velocity, as URDF demands.",
    cause="Left out. Readers that keep to the format refuse the file; KSL takes the joint as unlimited.",
    repair='Add <limit lower="..." upper="..." effort="..." velocity="..."/>, or make a revolute joint continuous.',
    formats=("urdf",),
    whole=True,
)
def limit_missing(robot: RobotFile) -> Iterator[Broken]:
    for joint in robot.joints:
        if joint.kind not in BOUNDED or joint.element is None or joint.element.tag != "joint":
            continue
        if joint.limit_element is None:
            yield Broken(f"{joint.kind} joint without <limit>", joint.line, "joint", joint.name)
            continue
        absent = [name for name in ("effort", "velocity") if joint.limit_element.get(name) is None]
        if absent:
            yield Broken(f"<limit> without {' and '.join(absent)}", joint.limit_line, "joint", joint.name)


@rule(
    "limit-reversed",
    "error",
    condition="The lower limit is below the upper one.",
    cause="The two are exchanged, or the axis was reversed and the limits were not.",
    repair="Exchange them.",
    fix="exchanges them",
)
def limit_reversed(robot: RobotFile) -> Iterator[Broken]:
    for joint in robot.joints:
        lower, upper = joint.lower or 0.0, joint.upper or 0.0
        if joint.kind in BOUNDED and lower > upper:
            fix = _exchanged(joint) if robot.format == "urdf" else None
            yield Broken(f"lower {shown(lower)}, upper {shown(upper)} {_unit(joint)}", joint.limit_line, "joint", joint.name, lower - upper, fix=fix)


def _exchanged(joint: FileJoint) -> Repair:
    def change() -> str:
        limit = joint.limit_element
        assert limit is not None
        lower, upper = limit.get("lower", "0"), limit.get("upper", "0")
        limit.set("lower", upper)
        limit.set("upper", lower)
        return f"lower and upper of <limit> exchanged: {upper} and {lower}"

    return change


@rule(
    "limit-zero",
    "warning",
    condition="A revolute or prismatic joint can move: its limits differ.",
    cause="A template was not filled in: URDF takes limits that are not given as 0.",
    repair="Give the limits, or make the joint fixed, or a revolute one continuous.",
)
def limit_zero(robot: RobotFile) -> Iterator[Broken]:
    for joint in robot.joints:
        lower, upper = joint.lower or 0.0, joint.upper or 0.0
        if joint.kind in BOUNDED and joint.limit_line and lower == upper and not (robot.format != "urdf" and joint.lower is None):
            given = (
                "neither lower nor upper is given" if joint.lower is None and joint.upper is None else f"lower and upper are both {shown(lower)} {_unit(joint)}"
            )
            yield Broken(given, joint.limit_line, "joint", joint.name, lower)


@rule(
    "limit-units",
    "warning",
    condition=(f"Limits are in rad and m: angles within {WIDEST / math.pi:g} π, travels within {LONGEST:g} m, or no bounds (beyond {UNLIMITED:g})."),
    cause="Degrees or millimetres. URDF has rad and m.",
    repair="Multiply degrees by π/180 and millimetres by 0.001.",
    accept="multiplies lower and upper by π/180 or 0.001",
)
def limit_units(robot: RobotFile) -> Iterator[Broken]:
    for joint in robot.joints:
        if joint.kind not in BOUNDED:
            continue
        largest = max(abs(x) for x in (joint.lower or 0.0, joint.upper or 0.0))
        degrees = _unit(joint) == "rad"
        if (WIDEST if degrees else LONGEST) * 1.001 < largest < UNLIMITED:
            found = f"lower {shown(joint.lower or 0.0)}, upper {shown(joint.upper or 0.0)} {_unit(joint)}"
            cause = f"Degrees: {shown(math.radians(largest))} rad is likely meant for {shown(largest)}." if degrees else "Millimetres."
            yield Broken(found, joint.limit_line, "joint", joint.name, largest, cause=cause, guess=_scaled(joint, degrees) if robot.format == "urdf" else None)


def _scaled(joint: FileJoint, degrees: bool) -> Repair:
    def change() -> str:
        assert joint.limit_element is not None
        for what, value in (("lower", joint.lower), ("upper", joint.upper)):
            if value is not None:
                joint.limit_element.set(what, digits(math.radians(value) if degrees else value / 1000))
        return f"lower and upper of <limit> are now {joint.limit_element.get('lower')} and {joint.limit_element.get('upper')} {_unit(joint)}"

    return change


@rule(
    "effort-zero",
    "warning",
    condition="The effort limit of a joint is above zero.",
    cause=("Not known, and 0 was written. KSL takes 0 as not given; simulators and controllers then hold the joint without force."),
    repair="Give the peak torque (N m) or force (N) of the drive.",
)
def effort_zero(robot: RobotFile) -> Iterator[Broken]:
    yield from _zero(robot, "effort")


@rule(
    "velocity-zero",
    "warning",
    condition="The velocity limit of a joint is above zero.",
    cause="Not known, and 0 was written. KSL takes 0 as not given; planners then refuse to move the joint.",
    repair="Give the largest speed, rad/s or m/s.",
)
def velocity_zero(robot: RobotFile) -> Iterator[Broken]:
    yield from _zero(robot, "velocity")


def _zero(robot: RobotFile, what: str) -> Iterator[Broken]:
    model = robot.model
    passive = set(model.joint_names).difference(model.drives) if model is not None and model.loops and model.drives is not None else set()
    for joint in robot.joints:
        # followers have no drive of their own, and their limits are often left at zero; of closed mechanisms only drives have an effort
        if joint.moves and not joint.mimic and getattr(joint, what) == 0 and not (what == "effort" and joint.name in passive):
            yield Broken(f"{what} 0", joint.limit_line, "joint", joint.name, 0.0)


@rule(
    "limit-negative",
    "error",
    condition="Effort and velocity limits are magnitudes.",
    cause="A wrong sign, or a number in the wrong place.",
    repair="Give the magnitude.",
    fix="removes the sign, except where −1 may stand for no limit",
)
def limit_negative(robot: RobotFile) -> Iterator[Broken]:
    for joint in robot.joints:
        for what, value in (("effort", joint.effort), ("velocity", joint.velocity)):
            if value is None or value >= 0 or (robot.format != "urdf" and value == -1):  # SDF: −1 is none
                continue
            fix = _magnitude(joint, what) if robot.format == "urdf" and value != -1 else None
            yield Broken(f"{what} {shown(value)}", joint.limit_line, "joint", joint.name, value, fix=fix)


def _magnitude(joint: FileJoint, what: str) -> Repair:
    def change() -> str:
        assert joint.limit_element is not None
        text = joint.limit_element.get(what, "").strip().lstrip("-")
        joint.limit_element.set(what, text)
        return f"{what} of <limit>: -{text} is now {text}"

    return change
