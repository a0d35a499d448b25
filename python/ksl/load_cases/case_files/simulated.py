"""Motions of load cases that are simulated: a mechanism under its controller, or under brakes, instead of a motion that is prescribed.

The wrenches are then those of this motion, like those of any other.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from ksl.base.errors import MotionError
from ksl.base.printable import one_line
from ksl.base.words import count, listed
from ksl.load_cases.closed_poses import closed_pose, named_joints
from ksl.load_cases.load_case import NEVER
from ksl.load_cases.poses import pose_of
from ksl.load_cases.case_files.stops import nearest_sample
from ksl.load_cases.case_files.wrenches_over_time import WrenchOverTime, total_on_links
from ksl.simulation.drives import PD, Brake, ComputedTorque, Controller, GravityCompensation, Reference
from ksl.model.model import Model
from ksl.simulation.simulate import REASONS, TOO_MANY, Method
from ksl.simulation.simulation_result import Simulation
from ksl.mechanism.states import Array
from ksl.motions.closed_motion import keeps_closed
from ksl.motions.closing import Closing
from ksl.motions.motion import Motion, Source
from ksl.motions.signal.standing import standing_of_integrated
from ksl.motions.signal.suspicions import suspicions_of_pose

ControllerName = Literal["none", "gravity", "pd", "computed torque"]
CONTROLLERS = ("none", "gravity", "pd", "computed torque")
FOLLOWING = ("pd", "computed torque")
"""Controllers that follow a motion."""
RATE = 250.0
"""Samples a second of the motion that is simulated, as of motions that are generated."""
TOLERANCE = 1e-9
MOST_SAMPLES = 10_000_000
MOST_EVENTS = 12
"""Events that a note lists."""
IMPACTS = ("lower limit", "upper limit", "rest")
JUMPS = ("sticks", "slips", "brakes", "lifts")
"""Events at which accelerations jump."""

Numbers = float | Mapping[str, float]
"""One number for all joints, or {joint: number}."""


@dataclass(frozen=True)
class Simulated:
    """How the motion of a load case is simulated.  Times are those of the motion that is followed, or begin at zero."""

    until: float | None = None
    """s; the end of the motion that is followed, if there is one."""
    start: float | None = None
    """s: the run begins in the state of the motion at this time; None: at its first sample."""
    state_of: Motion | None = None
    """The motion in whose state it begins, if none is followed."""
    pose: Mapping[str, Any] | None = None
    """Positions of joints instead, which begin at rest, except for those of `velocity`."""
    velocity: Mapping[str, float] = field(default_factory=dict)
    """rad/s or m/s."""
    controller: ControllerName = "none"
    """"none": no drive has effort; "gravity" holds the weight; "pd" and "computed torque" follow the motion, or hold the pose."""
    stiffness: Numbers = 0.0
    damping: Numbers = 0.0
    brake_at: float | None = None
    """s: brakes engage, and drives have no effort from then on."""
    brake: Numbers | None = None
    """What brakes hold, N m or N; None: the effort limits of the joints."""
    friction: Numbers | None = None
    """Dry friction that sticks and slips, N m or N."""
    restitution: Numbers | None = None
    """Coefficients of restitution of impacts on limits of position; None: there are no limits."""
    rate: float = RATE
    """Samples a second of the result."""
    method: Method = "dop853"
    step: float | None = None
    rtol: float = TOLERANCE
    atol: float = TOLERANCE


def brakes_from(how: Simulated) -> float:
    """From which time on, s, brakes supply the efforts of the run: a sample at that time is behind the jump."""
    return NEVER if how.brake_at is None else how.brake_at


def simulated_motion(
    model: Model, how: Simulated, followed: Motion | None, external: Sequence[WrenchOverTime], progress: Callable[[float, float], object] | None = None
) -> tuple[Motion, str]:
    """The motion, and in words what it is.  progress: is told how much of its time is done, s, and of how much.  Raises MotionError; a run that ends early gives the part before, with a doubt that says why."""
    q, v, begin, closing = _start(model, how, followed)
    times = _times(how, followed, begin)
    if how.brake_at is not None and how.brake_at >= times[-1]:
        raise MotionError(f"simulation: brakes at {how.brake_at:g} s would never engage; it ends at {times[-1]:g} s")
    controller, brake = _controller(model, how, followed, q, times), _brake(model, how)
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always", RuntimeWarning)
        try:
            run = model.simulate(
                q, v, times, efforts=controller, method=how.method, rtol=how.rtol, atol=how.atol, step=how.step,
                external=_wrenches(model, external, times, q), restitution=how.restitution, friction=how.friction, brake=brake,
                progress=None if progress is None else lambda t: progress(t - begin, float(times[-1]) - begin),
            )  # fmt: skip
        except ValueError as e:
            raise MotionError(f"simulation: {e}") from None
    reached = np.isfinite(run.q).all(axis=1) & np.isfinite(run.a).all(axis=1)
    if np.count_nonzero(reached) < 2:
        if run.reason == REASONS[TOO_MANY]:
            raise MotionError("simulation: more steps than 10,000,000; take longer ones, or an earlier end")
        raise MotionError(f"simulation: {run.reason} at its beginning, {run.ended:.6g} s; check the start, gains and units")
    doubts = suspicions_of_pose(model, q) if how.pose is not None else []
    if followed is not None and how.controller in FOLLOWING:
        doubts += followed.doubts
    elif how.pose is None and (there := how.state_of or followed) is not None:
        doubts += there.doubts
    doubts += _left_out(model, how)
    doubts += _at_rest(model, run) + _at_passive_joints(model, how, run)
    doubts += [f"simulation: {one.message}" for one in said if issubclass(one.category, RuntimeWarning)]
    source = Source(
        "simulation",
        f"simulated by {how.method}",
        int(np.count_nonzero(reached)),
        float(times[1] - times[0]),
        _started(how, followed, begin) + _notes(run, how),
    )
    joints, (t, x, v) = model.joints[: len(model.joint_names)], (values[reached] for values in (times, run.q, run.v))
    error = (how.atol, how.rtol) if how.method == "dop853" else (0.0, 0.0)  # the other methods control none
    standing = standing_of_integrated(joints, t, x, v, *error)
    stands, held = keeps_closed(model, x, v, standing.stands), keeps_closed(model, x, run.a[reached], standing.held)
    inside = [e for e in run.events if times[0] < e.time < run.ended]
    corners, breaks = (np.array(sorted({e.time for e in inside if e.what in kinds}), dtype=float) for kinds in (JUMPS, IMPACTS))
    motion = Motion(
        t, x, v, run.a[reached], doubts=doubts, source=source, closing=closing, stands=stands, held=held & stands, resolution=standing.rate,
        corner_times=corners, break_times=breaks, integrated=True,
    )  # fmt: skip
    return motion, _in_words(how, brake, followed is not None and how.controller not in FOLLOWING)


def _started(how: Simulated, followed: Motion | None, begin: float) -> list[str]:
    """Says that a motion is not followed, where one is given."""
    if followed is None or how.controller in FOLLOWING:
        return []
    what = "no drive has effort" if how.controller == "none" else "the drives hold the weight alone"
    used = f"its state at {begin:g} s, where the run begins" + (", and its end" if how.until is None else "") if how.pose is None else "its end"
    return [f"the motion is not followed: of it the run takes {used}; {what}. The controllers pd and computed torque follow it"]


def _left_out(model: Model, how: Simulated) -> list[str]:
    """The physics of joints that the robot's file has, that changes the motion, and that is off."""
    on = " ".join(model.physics)
    having = {"damping": "damping", "friction": "friction", "armature": "armature", "rotor": "rotor_inertia", "spring": "spring_stiffness"}
    off = [
        name
        for name, of in having.items()
        if name not in on and any(getattr(joint, of) for joint in model.joints) and not (name == "friction" and how.friction)
    ]
    off += ["force elements"] if model.force_elements and "force elements" not in on else []
    return (
        [f"the simulated motion is without {_and(off)} of the robot's file: physics of joints is off; turn it on with --physics {','.join(off)}"] if off else []
    )


def _at_rest(model: Model, run: Simulation) -> list[str]:
    """Says that efforts are not those of drives alone where joints lie on their limits."""
    rests = [e for e in run.events if e.what == "rest" and e.joint and not _is_passive(model, e.joint)]
    if not rests:
        return []
    joints = dict.fromkeys(one_line(e.joint or "") for e in rests)
    said = f"{listed(list(joints))} rest{'s' if len(joints) == 1 else ''} on a limit of position, first at {min(e.time for e in rests):.6g} s"
    return [f"{said}: the effort there is that of drive and stop together, and neither a motor's load nor one for its effort limit"]


def _at_passive_joints(model: Model, how: Simulated, run: Simulation) -> list[str]:
    """Says that stops, brakes and dry friction at joints of loops without a drive are told as efforts of the drives, and that wrenches are those of such drives."""

    def having(what: str, given: Numbers | None) -> dict[str, str]:
        names = given if isinstance(given, Mapping) else model.joint_names if given else ()
        return {name: what for name in names if _is_passive(model, name) and (not isinstance(given, Mapping) or given[name])}

    stops = dict.fromkeys((e.joint for e in run.events if e.what == "rest" and e.joint and _is_passive(model, e.joint)), "stop")
    acting = [*stops.items(), *having("brake", how.brake if how.brake_at is not None else None).items(), *having("dry friction", how.friction).items()]
    if not acting:
        return []
    said = listed([f"{what} at {one_line(name)}" for name, what in acting])
    return [
        f"{said}, which has no drive: efforts are those with which the drives ({listed(list(model.drives or ()))}) would do what it does, and wrenches are those of a mechanism that is driven so"
    ]


def _is_passive(model: Model, joint: str) -> bool:
    """Whether it is a joint of a closed mechanism that no drive acts on."""
    return bool(model.loops) and joint not in (model.drives or ())


def _and(names: Sequence[str]) -> str:
    return " and ".join(x for x in (", ".join(names[:-1]), names[-1]) if x)


def _start(model: Model, how: Simulated, followed: Motion | None) -> tuple[Array, Array, float, Closing | None]:
    """q (nq), v (nv), the time there, and how loops were closed."""
    there = how.state_of or followed
    if how.pose is None and there is not None:
        if how.start is not None and not there.time[0] <= how.start <= there.time[-1]:
            raise MotionError(f"from {how.start:g} s: the motion is from {there.time[0]:g} s to {there.time[-1]:g} s")
        k = 0 if how.start is None else nearest_sample(there, how.start)
        v = there.resolved_v[k].copy()
        return there.q[k], _with_velocities(model, there.q[k], v, how), float(there.time[k]), there.closing
    pose, closing = how.pose or {}, None
    q = pose_of(model, pose)
    if model.loops:
        q, closing = closed_pose(model, q, named_joints(model, pose))
    begin = how.start if how.start is not None else float(followed.time[0]) if followed is not None else 0.0
    return q, _with_velocities(model, q, np.zeros(model.nv), how), begin, closing


def _with_velocities(model: Model, q: Array, v: Array, how: Simulated) -> Array:
    """Velocities that are given by name; joints of mechanisms with loops follow them."""
    for name, speed in how.velocity.items():
        joint = model.joint(name)
        if joint.nv != 1:
            raise MotionError(f"velocity: joint {one_line(name)} has {joint.nv} coordinates; those with one can be given")
        v[joint.v_index] = speed
    if model.loops and how.velocity:
        found: Array = model.consistent_velocity(q, v, given=list(how.velocity))
        return found
    return v


def samples_of(how: Simulated, followed: Motion | None) -> int:
    """How many samples the motion will have."""
    begin = how.start if how.start is not None else float(followed.time[0]) if followed is not None else 0.0
    return len(_times(how, followed, begin))


def _times(how: Simulated, followed: Motion | None, begin: float) -> Array:
    until = how.until if how.until is not None else float(followed.time[-1]) if followed is not None else None
    if until is None:
        raise MotionError("simulation: no end; give until, s")
    if not math.isfinite(until):
        raise MotionError(f"simulation: until is {until:g}; expected a time, s")
    if not until > begin:
        raise MotionError(f"simulation: until {until:g} s is not after its beginning, {begin:g} s")
    if not 0 < how.rate < math.inf:
        raise MotionError(f"simulation: rate {how.rate:g}; expected samples a second, more than 0")
    wanted = (until - begin) * how.rate + 1
    samples = max(2, round(min(wanted, 2.0**53)))
    if samples > MOST_SAMPLES:
        told = f"{samples:,}" if wanted < 2.0**53 else f"{wanted:.3g}"
        raise MotionError(f"simulation: {told} samples; give a lower rate than {how.rate:g} a second, or an earlier end")
    times: Array = np.linspace(begin, until, samples)
    return times


def _controller(model: Model, how: Simulated, followed: Motion | None, q: Array, times: Array) -> Controller | None:
    if how.controller == "none":
        return None
    if how.controller == "gravity":
        return GravityCompensation(how.damping)
    is_followed = followed is not None and how.pose is None and len(followed.time) > 1
    reference = Reference(followed.time, followed.q, followed.resolved_v, followed.resolved_a) if is_followed and followed is not None else q
    if how.controller == "pd":
        return PD(reference, how.stiffness, how.damping, gravity=True)
    return ComputedTorque(reference, how.stiffness, how.damping)


def _brake(model: Model, how: Simulated) -> Brake | None:
    if how.brake_at is None:
        return None
    if how.brake is not None:
        return Brake(how.brake, how.brake_at)
    limits = {j.name: j.effort for j in model.joints if j.nv == 1 and j.effort and (not model.drives or j.name in model.drives)}
    if not limits:
        raise MotionError("brake_at: no joint has an effort limit, which brakes hold where nothing else is said; give brake, N m or N")
    return Brake(limits, how.brake_at)


def _wrenches(model: Model, external: Sequence[WrenchOverTime], times: Array, q: Array) -> dict[str, Array] | None:
    """External wrenches at the times, in the axes of their links, which must not depend on the position."""
    for one in external:
        if one.axes != "link":
            raise MotionError(f"external wrench on {one.link}: axes {one.axes!r} turn with the simulated motion; give it in those of the link")
    return total_on_links(external, model, times, np.broadcast_to(q, (len(times), len(q)))) or None


def _notes(run: Simulation, how: Simulated) -> list[str]:
    """What the report says about the run: steps, losses, events."""
    lost = float(np.nanmax(np.abs(run.drift.energy)))
    largest = float(np.nanmax(np.abs(run.energy - run.energy[0]), initial=0.0))
    notes = [f"{count(int(run.steps), 'step')} of {how.method}; energy lost by integration {lost:.2g} J, where energy changed by {largest:.3g} J"]
    if run.drift.closure is not None:
        notes.append(f"loops opened by {float(np.nanmax(run.drift.closure)):.2g} m at most within a step, and were closed after it")
    if run.events:
        words = {"brakes": "brakes engage", "singular": "singular position"}
        told = [f"{words.get(e.what, e.what)}{f' of {one_line(e.joint)}' if e.joint else ''} at {e.time:.6g} s" for e in run.events[:MOST_EVENTS]]
        more = f" and {len(run.events) - MOST_EVENTS} more" if len(run.events) > MOST_EVENTS else ""
        notes.append(f"events: {'; '.join(told)}{more}")
    if how.friction:
        notes.append("efforts are those of drives, brakes and dry friction together: friction adds to what is compared with effort limits")
    if any(e.what in IMPACTS for e in run.events):
        notes.append("impacts on limits are shorter than any sample: wrenches during them are in no result")
    return notes


def _in_words(how: Simulated, brake: Brake | None, from_motion: bool) -> str:
    by = {"none": "without drives", "gravity": "with the weight held", "pd": "under a PD controller", "computed torque": "under computed torque"}[
        how.controller
    ]
    return (
        f"simulated {by}"
        + (", from a state of the motion, which is not followed" if from_motion and how.pose is None else "")
        + (f", brakes from {brake.at:g} s" if brake else "")
    )
