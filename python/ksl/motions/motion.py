"""A motion: samples of every joint's position over time, with velocities and accelerations given or differentiated."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ksl._core import QUATERNION_ROUNDING, QUATERNION_TOLERANCE
from ksl.errors import MotionError
from ksl.mechanism import Joint, Mechanism
from ksl.motions.columns import METRES, columns_of
from ksl.motions.recorded import count
from ksl.motions.rates import SPLINE_SAMPLES, derivative, rates
from ksl.states import Array

if TYPE_CHECKING:
    pass

CONTRADICTION = 0.05
"""Given rates contradict the samples if they differ from the derivative by more than this share of the largest rate."""


@dataclass(frozen=True)
class Source:
    """Where a motion came from."""

    file: str
    format: str
    """`CSV (semicolons, decimal commas)`, `ROS 1 bag`"""
    samples: int
    """As used: after a window or resampling."""
    step: float
    """Median, s."""
    notes: list[str] = field(default_factory=list)
    """What was converted, renamed, merged or left out in reading, a line each."""

    def __str__(self) -> str:
        return f"{self.file}, {self.format}, {count(self.samples, 'sample')}, median step {self.step:.6g} s"


@dataclass(frozen=True)
class Motion:
    """Samples of a motion: time (n), q (n, nq), v (n, nv), a (n, nv)."""

    time: Array
    q: Array
    v: Array
    a: Array
    differentiated: list[str] = field(default_factory=list)
    """What was not given, a line each."""
    contradictions: list[str] = field(default_factory=list)
    """Given rates that are not the derivatives of what is given, and quaternions that are not of unit length, a line each."""
    source: Source | None = None
    """The file that it was read from, if it was."""


def complete(model: Mechanism, time: Array, q: Array, given: list[list[Array | None]], name: str = "motion", place: Callable[[int], str] | None = None) -> Motion:
    """Computes missing velocities and accelerations.  `given` has [v, a] for each moving joint, each (n, nv) or None.

    name, place: what errors call the motion, and the sample k, if it is read from a file.
    """
    where = place or (lambda k: f"{name}: sample {k + 1}")
    contradictions: list[str] = []
    said: dict[str, list[str]] = {}
    v, a = np.empty((len(time), model.nv)), np.empty((len(time), model.nv))
    joints = model.joints[: len(model.joint_names)]
    missing = [j for j, g in zip(joints, given, strict=True) if g[0] is None or g[1] is None]
    if missing and len(time) < SPLINE_SAMPLES:
        rates = " and ".join(" ".join(group) for group in columns_of(missing[0])[1:])
        raise MotionError(
            f"{name}: {count(len(time), 'sample')}, but differentiating {', '.join(j.name for j in missing)} needs at least {SPLINE_SAMPLES}; "
            f"add samples, or give the columns {rates}"
        )
    if len(time) < 2:
        raise MotionError(f"{name}: {len(time)} sample, but means over time need at least 2; add samples")
    q = q.copy()
    for joint, (joint_v, joint_a) in zip(joints, given, strict=True):
        rows, cols = slice(joint.q_index, joint.q_index + joint.nq), slice(joint.v_index, joint.v_index + joint.nv)
        if joint.quaternion is not None:
            off = np.abs(np.linalg.norm(q[:, rows][:, -4:], axis=1) - 1)
            q[:, rows] = continuous_unit(where, joint, q[:, rows])
            if (off > QUATERNION_ROUNDING).any():
                contradictions.append(f"quaternions of {joint.name} differ from unit length by up to {off.max():.2g}, and were normalised")
        with np.errstate(over="ignore", invalid="ignore"):  # numbers that are not finite are refused later
            v[:, cols], a[:, cols] = _finite_rates(where, joint, time, q[:, rows], joint_v, joint_a)
            contradictions += _contradictions(joint, time, q[:, rows], v[:, cols], joint_v, joint_a)
        how = "accelerations" if joint_v is not None else "velocities" if joint_a is not None else "velocities and accelerations"
        if joint_v is None or joint_a is None:
            said.setdefault(how, []).append(joint.name)
    whose = {how: "all joints" if len(names) == len(joints) else ", ".join(names) for how, names in said.items()}
    differentiated = [f"{how} of {names} differentiated from a quintic spline through the samples" for how, names in whose.items()]
    return Motion(time, q, v, a, differentiated, contradictions)


def _finite_rates(where: Callable[[int], str], joint: Joint, time: Array, q: Array, given_v: Array | None, given_a: Array | None) -> tuple[Array, Array]:
    """Rates, given or differentiated; refuses positions or times that can't be differentiated in floating point."""
    mend = "positions or rates are too large, or times too close: check their units (rad, m, s)"
    try:
        v, a = rates(joint, time, q, given_v, given_a)
    except ValueError:  # a singular system of equations
        raise MotionError(f"{where(0)}: {joint.name} can't be differentiated from this sample on; {mend}") from None
    for rate, x in (("velocity", v), ("acceleration", a)):
        bad = np.flatnonzero(~np.isfinite(x).all(axis=1))
        if len(bad):
            raise MotionError(f"{where(bad[0])}: the {rate} of {joint.name}, differentiated, is not finite; {mend}")
    return v, a


def _contradictions(joint: Joint, time: Array, q: Array, v: Array, given_v: Array | None, given_a: Array | None) -> list[str]:
    """Lines for given velocities that are not the derivatives of the positions, and for accelerations and velocities likewise."""
    if len(time) < SPLINE_SAMPLES:
        return []
    try:
        checks = [
            ("position", given_v, None if given_v is None else rates(joint, time, q, None, None)[0]),
            ("velocity", given_a, None if given_a is None else derivative(time, v)),
        ]
    except ValueError:  # times too close for a spline: nothing to compare with
        return []
    lines = []
    for (of, given, found), columns, floor in zip(checks, columns_of(joint)[1:], (np.abs(q).max(), np.abs(v).max()), strict=True):
        in_metres = np.array([c.removeprefix(f"{joint.name}.") in METRES for c in columns])
        at = None if given is None or found is None else _largest_contradiction(time, given, found, in_metres, 1e-5 * max(1.0, float(floor)))
        if at is None or given is None or found is None:
            continue
        k, c = at
        of_column = "m" if in_metres[c] else "rad"
        unit = (joint.unit if joint.one_coordinate else of_column) + ("/s" if of == "position" else "/s²")
        changes = f"the {of} of {joint.name} changes at {found[k, c]:.4g} {unit}"
        lines.append(f"{columns[c]} at {time[k]:.6g} s is {given[k, c]:.4g} {unit}, but {changes}; check the column")
    return lines


def _largest_contradiction(time: Array, given: Array, found: Array, in_metres: NDArray[np.bool_], floor: float) -> tuple[int, int] | None:
    """Sample and column at which given rates differ most from the derivatives, or None if the difference is not significant.

    Means over windows are compared, not samples: noise of the positions and corners of the rates, both large in the
    found rates of a few samples, have a mean near zero.  Windows whose integrals differ by less than `floor` are at rest.
    """
    width = min(50, max(SPLINE_SAMPLES - 1, len(time) // 4))
    off = given - found
    integral = np.concatenate([np.zeros((1, off.shape[1])), np.cumsum((off[1:] + off[:-1]) / 2 * np.diff(time)[:, None], axis=0)])
    integral = np.abs(integral[width:] - integral[:-width])
    mean = np.where(integral > floor, integral / (time[width:] - time[:-width])[:, None], 0.0)
    largest = np.maximum(np.abs(given), np.abs(found)).max(axis=0)
    for vector in (in_metres, ~in_metres):  # components share the scale of their vector
        largest[vector] = largest[vector].max(initial=0.0)
    share = np.divide(mean, largest, out=np.zeros_like(mean), where=largest > 0)
    start, column = np.unravel_index(int(np.argmax(share)), share.shape)
    if not share[start, column] > CONTRADICTION:
        return None
    return int(start) + int(np.argmax(np.abs(off[start : start + width + 1, column]))), int(column)


def continuous_unit(where: Callable[[int], str], joint: Joint, q: Array) -> Array:
    """Quaternions of unit length and without jumps between q and −q."""
    position, quaternion = np.hsplit(q, [-4])
    length = np.linalg.norm(quaternion, axis=1)
    bad = np.flatnonzero(np.abs(length - 1) > QUATERNION_TOLERANCE)
    if len(bad):
        raise MotionError(
            f"{where(bad[0])}: the quaternion of {joint.name} has length {length[bad[0]]:.6g}; "
            f"expected a unit quaternion in the columns {joint.name}.qx … .qw"
        )
    unit = quaternion / length[:, None]
    turn = np.where(np.sum(unit[1:] * unit[:-1], axis=1) < 0, -1.0, 1.0)
    return np.hstack([position, unit * np.concatenate([[1.0], np.cumprod(turn)])[:, None]])
