"""What generators share: limits of the joints that they move, checks, and the motion with what is to be said of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from ksl.base.errors import MotionError
from ksl.mechanism.calls import Calls
from ksl.mechanism.freedoms import freedoms_to_drive
from ksl.mechanism.mechanism import Joint, Mechanism
from ksl.model.model import Model
from ksl.mechanism.states import Array
from ksl.motions.closed_motion import check_drives, closed, held_by, leading
from ksl.motions.motion import Motion

USUAL_SPEED = {"rad": 1.0, "m": 0.25}
"""rad/s and m/s, of joints whose speed the file doesn't limit."""

SHARE = 0.8
"""The share of the limits of speed and effort that motions use where no time is given.  The rest is the controller's."""

ROUND_OFF = 1e-9

SMALLEST, LARGEST = 1e-6, 1e9
"""The bounds of durations, s, and of rates, Hz."""

LOOKED_AT = 100_000
"""Samples at which efforts are looked for, if there are more."""


@dataclass(frozen=True)
class Generated:
    """A motion, and what its user should know of it."""

    motion: Motion
    notes: list[str] = field(default_factory=list)
    facts: dict[str, object] = field(default_factory=dict)
    """How it was made: kind, seed, numbers that were found."""


@dataclass(frozen=True)
class Limits:
    """What the joints with one coordinate may do, (m) each, in the order of q; mimic joints limit their leaders."""

    joints: tuple[Joint, ...]
    lower: Array
    upper: Array
    velocity: Array
    acceleration: Array
    """Infinite unless it was given."""
    effort: Array
    """Infinite where the file gives none."""
    unbounded: tuple[str, ...]
    """Joints for which the file gives no limits of position."""
    notes: list[str]
    """Which other limits it doesn't give."""

    def said(self, by_waypoints: bool = False) -> list[str]:
        """Which limits the file doesn't give, and what that means where waypoints say where joints go."""
        where = "they go where the waypoints are" if by_waypoints else "angles stay within ±π, lengths within ±1 m"
        return [*([f"the file gives no limits of position for {', '.join(self.unbounded)}: {where}"] if self.unbounded else []), *self.notes]

    @property
    def q_index(self) -> Array:
        return np.array([j.q_index for j in self.joints], dtype=int)

    @property
    def v_index(self) -> Array:
        return np.array([j.v_index for j in self.joints], dtype=int)

    @property
    def middle(self) -> Array:
        return (self.lower + self.upper) / 2

    @property
    def half(self) -> Array:
        return (self.upper - self.lower) / 2


def limits_of(model: Mechanism, acceleration: float | None = None) -> Limits:
    """Limits of the file, and `acceleration`, rad/s² or m/s², of every joint.  Raises MotionError for models without a joint to move."""
    if acceleration is not None and not 0 < acceleration < np.inf:
        raise MotionError(f"acceleration {acceleration:g}: expected a positive number, rad/s² or m/s²")
    check_drives(model, "motion")
    lead = leading(model)
    if model.loops and isinstance(model, Calls) and sum(j.nv for j in lead) > freedoms_to_drive(model):
        lead = held_by(model).joints  # the other drives follow
    joints = tuple(j for j in lead if j.nv == 1)
    if not joints:
        raise MotionError(f"{model.name}: no joint with one coordinate, so there is nothing to move")
    index = np.array([j.q_index for j in joints])
    lower, upper = (np.array(r[index]) for r in model.position_ranges)
    unbounded = tuple(j.name for j in joints if not (j.has_limits and j.lower is not None and j.upper is not None))
    velocity = np.array([j.velocity or np.inf for j in joints])
    for follower in map(model.joint, model.follower_names):
        k = next((i for i, j in enumerate(joints) if j.name == follower.leader), None)
        if k is not None and follower.velocity and follower.multiplier:
            velocity[k] = min(velocity[k], follower.velocity / abs(follower.multiplier))
    without_speed = [j.name for j, x in zip(joints, velocity, strict=True) if np.isinf(x)]
    velocity = np.array([USUAL_SPEED[j.unit] if np.isinf(x) else x for j, x in zip(joints, velocity, strict=True)])
    effort = np.array([j.effort or np.inf for j in joints])
    notes = []
    if without_speed:
        notes.append(f"the file gives no limits of speed for {', '.join(without_speed)}: {USUAL_SPEED['rad']:g} rad/s and {USUAL_SPEED['m']:g} m/s were taken")
    resting = [j.name for j in lead if j.nv > 1]
    if resting:
        notes.append(f"{', '.join(resting)}: more than one coordinate, and at rest in this motion")
    return Limits(joints, lower, upper, velocity, np.full(len(joints), np.inf if acceleration is None else acceleration), effort, unbounded, notes)


def check_duration(duration: float) -> None:
    """Raises MotionError for durations that no motion has."""
    if not SMALLEST <= duration <= LARGEST:
        raise MotionError(f"duration {duration:g} s: expected a positive number, {SMALLEST:g} s to {LARGEST:g} s")


def sample_times(duration: float, rate: float) -> Array:
    """Times 0 … duration, `rate` of them a second; the last step ends at the duration.  Raises MotionError."""
    check_duration(duration)
    if not SMALLEST <= rate <= LARGEST:
        raise MotionError(f"{rate:g} samples a second: expected a positive number, {SMALLEST:g} to {LARGEST:g}")
    steps = max(6, round(duration * rate))
    if steps > 10_000_000:
        raise MotionError(f"{duration:g} s at {rate:g} samples a second are {steps:,} samples; give a lower --rate or a shorter --duration")
    out: Array = np.linspace(0, duration, steps + 1)
    return out


def whole_motion(model: Mechanism, limits: Limits, time: Array, q: Array, v: Array, a: Array, where: Callable[[int], str] | None = None) -> Motion:
    """The motion of all joints, of which those of the limits have positions q, v and a (n, m); the others rest, or follow by loops.

    where: a sample in words.  Raises MotionError where they can't follow.
    """
    n = len(time)
    whole = np.tile(model.neutral(), (n, 1)), np.zeros((n, model.nv)), np.zeros((n, model.nv))
    for x, part, index in zip(whole, (q, v, a), (limits.q_index, limits.v_index, limits.v_index), strict=True):
        x[:, index] = part
    return closed(model, Motion(time, *whole), where)


def beyond_limits(model: Mechanism, motion: Motion) -> list[str]:
    """Notes on joints that follow by loops, and that this takes beyond the limits of the file: only those of the joints that lead were kept."""
    lead = [j.name for j in leading(model)] if motion.closing is None else motion.closing.held
    lines = []
    for joint in (j for j in model.joints[: len(model.joint_names)] if j.name not in lead and j.nv == 1):
        position, speed = motion.q[:, joint.q_index], np.abs(motion.v[:, joint.v_index])
        if joint.has_limits:
            for end, bound, k in (("lower", joint.lower, int(position.argmin())), ("upper", joint.upper, int(position.argmax()))):
                if bound is not None and (position[k] - bound) * (1 if end == "upper" else -1) > 0:
                    at = f"sample {k + 1} (time {motion.time[k]:.6g})"
                    lines.append(
                        f"{joint.name} follows to {position[k]:.4g} {joint.unit} at {at}, beyond its {end} limit {bound:.4g} {joint.unit}; narrow the waypoints"
                    )
        k = int(speed.argmax())
        if joint.velocity and speed[k] > joint.velocity:
            at = f"sample {k + 1} (time {motion.time[k]:.6g})"
            lines.append(
                f"{joint.name} follows at {speed[k]:.4g} {joint.unit}/s at {at}, beyond its limit {joint.velocity:.4g} {joint.unit}/s; give a longer --duration"
            )
    return lines


@dataclass(frozen=True)
class Use:
    """How far a joint uses one of its limits at most, along a motion."""

    share: float
    """1 is at the limit; of positions 0 is the middle of the range."""
    quantity: str
    joint: Joint
    sample: int
    limit: float

    @property
    def of_limit(self) -> str:
        """`of its limit 2 rad/s`."""
        unit = self.joint.unit if self.quantity != "effort" else "N m" if self.joint.has_angle else "N"
        return f"of its limit {self.limit:.6g} {unit}{({'speed': '/s', 'acceleration': '/s²'}).get(self.quantity, '')}"


def worst_use(limits: Limits, q: Array, v: Array, a: Array) -> Use:
    """The limit of position, speed or acceleration that a motion (n, m) of these joints uses most."""
    # positions: the distance from the middle, so that 1 is at a limit
    position = _use("position", limits, np.abs(q - limits.middle), np.maximum(limits.half, 1e-300))
    return max(position, worst_rate(limits, v, a), key=lambda use: use.share)


def worst_rate(limits: Limits, v: Array, a: Array) -> Use:
    """The limit of speed or acceleration that it uses most."""
    uses = _use("speed", limits, np.abs(v), limits.velocity), _use("acceleration", limits, np.abs(a), limits.acceleration)
    return max(uses, key=lambda use: use.share)


def worst_effort(model: Model, limits: Limits, motion: Motion) -> Use:
    """The limit of effort that a motion uses most, without friction."""
    bare = model.with_physics(None) if model.physics else model
    tau = bare.inverse_dynamics(motion.q, motion.v, motion.a)[:, limits.v_index]
    return _use("effort", limits, np.abs(tau), limits.effort)


def _use(quantity: str, limits: Limits, size: Array, bound: Array) -> Use:
    shares = size / bound
    sample, joint = np.unravel_index(int(np.argmax(shares)), shares.shape)
    return Use(float(shares[sample, joint]), quantity, limits.joints[int(joint)], int(sample), float(bound[joint]))


def effort_stretch(model: Model, limits: Limits, motion: Motion, share: float = 1.0) -> tuple[float, list[str]]:
    """By which factor a motion must be slowed down to keep to a share of the limits of efforts, and notes on joints that can't hold still.

    Slowed down by s, efforts are those of rest plus 1/s² of the others: speeds are divided by s, accelerations by s².
    """
    some = slice(None, None, max(1, len(motion.time) // LOOKED_AT))
    q, v, a = motion.q[some], motion.v[some], motion.a[some]
    bare = model.with_physics(None) if model.physics else model
    still = bare.inverse_dynamics(q, 0 * v, 0 * a)[:, limits.v_index]
    moving = bare.inverse_dynamics(q, v, a)[:, limits.v_index] - still
    bound = np.where(np.isfinite(limits.effort), share * limits.effort, 1e300)
    heavy = (np.abs(still) > bound).any(axis=0)
    room = np.where(moving > 0, bound - still, bound + still)  # in the direction of what is added
    with np.errstate(divide="ignore", invalid="ignore"):
        needed = np.where(room > 0, np.abs(moving) / room, 1.0)
    names = [limits.joints[k].name for k in np.flatnonzero(heavy)]
    notes = (
        [f"{', '.join(names)}: holding still takes {100 * share:.0f} % of the limit of the effort or more at some positions, which no time mends"]
        if names
        else []
    )
    return float(np.sqrt(needed[:, ~heavy].max(initial=1.0))), notes
