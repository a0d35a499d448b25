"""A motion: samples of every joint's position over time, with velocities and accelerations given or differentiated."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ksl._core import QUATERNION_ROUNDING
from ksl.base.errors import MotionError
from ksl.base.words import count
from ksl.mechanism.calls import Calls
from ksl.mechanism.joint_kinds import KINDS
from ksl.mechanism.lengths import extent
from ksl.mechanism.mechanism import Joint, Mechanism
from ksl.mechanism.joint_kinds import columns_of, units_of
from ksl.mechanism.states import Array
from ksl.motions.closing import Closing
from ksl.motions.signal.corners import Found
from ksl.motions.signal.dropped import doubts_about_positions
from ksl.motions.signal.gaps import doubts_about_gaps
from ksl.motions.signal.quality import Samples, doubts_about_noise, sentences_about_jumps
from ksl.motions.signal.quaternions import continuous_unit
from ksl.motions.signal.rates import SPLINE_SAMPLES, derivative, derivatives, jumps_of, rates
from ksl.motions.signal.smoothing import smoothed
from ksl.motions.signal.standing import Standing, standing_of
from ksl.motions.signal.suspicions import suspicions

if TYPE_CHECKING:
    pass

TOO_LARGE = "positions or rates are too large, or times too close: check their units (rad, m, s)"
Follow = Callable[[Array, Array, Array], tuple[Array, Array, Array]]
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
    doubts: list[str] = field(default_factory=list)
    """Why results may be far from what the machine does: units that can't be, jumps, noise.  Sentences, the heaviest first; none is good."""
    raw_q: Array | None = None
    """The positions as given (n, nq), where `q` is smoothed."""
    smooth: float | None = None
    """The frequency, Hz, at which positions were smoothed."""
    corner_times: Array = field(default_factory=lambda: np.empty(0))
    """When the acceleration of any joint jumps, s, increasing: splines over time are split there."""
    source: Source | None = None
    """The file that it was read from, if it was."""
    stands: NDArray[np.bool_] | None = None
    """(n, nv): where a rate can't be told from zero, so that the joint stands; None for motions that are made, whose rates are exact."""
    held: NDArray[np.bool_] | None = None
    """(n, nv): those of them that last, at which accelerations that were differentiated are noise."""
    resolution: Array | None = None
    """(nv): rates up to this can't be told from zero, rad/s or m/s: the resolution of the positions over the step between samples."""
    closing: Closing | None = None
    """How positions were closed, for mechanisms with loops."""
    break_times: Array = field(default_factory=lambda: np.empty(0))
    """When velocities jump, at impacts, s, increasing: splines over time end there, and a sample there is before the jump."""
    integrated: bool = False
    """Are these the samples of a simulation, whose rates are exact however far apart samples are."""

    @cached_property
    def resolved_v(self) -> Array:
        """Velocities (n, nv), zero where joints stand: what signs, shares and counts of a motion are taken from."""
        return _zero_at(self.stands, self.v)

    @cached_property
    def resolved_a(self) -> Array:
        """Accelerations (n, nv), zero while joints are held."""
        return _zero_at(self.held, self.a)

    def __repr__(self) -> str:
        """Sizes and what is said about it: arrays would fill a notebook."""
        file = f" of {self.source.file}" if self.source is not None else ""
        lasts = f", {self.time[0]:.6g} s to {self.time[-1]:.6g} s" if len(self.time) else ""
        return "\n  ".join(
            [
                f"<ksl motion{file}: {len(self.time)} samples, {self.v.shape[-1]} degrees of freedom{lasts}>",
                *self.doubts,
                *self.contradictions,
                *self.differentiated,
            ]
        )


def _zero_at(chosen: NDArray[np.bool_] | None, x: Array) -> Array:
    return x if chosen is None or not (chosen & (x != 0)).any() else np.where(chosen, 0.0, x)


def complete(
    model: Mechanism,
    time: Array,
    q: Array,
    given: list[list[Array | None]],
    name: str = "motion",
    place: Callable[[int], str] | None = None,
    smooth: float | None = None,
    measured: Samples | None = None,
    follow: Follow | None = None,
) -> Motion:
    """Computes missing velocities and accelerations.  `given` has [v, a] for each moving joint, each (n, nv) or None.

    name, place: what errors call the motion, and the sample k, if it is read from a file.
    smooth: Hz; positions, and rates that are given, are low-passed at that frequency first, without delay.
    measured: samples as they were before resampling, in which noise is looked for.
    follow: makes q, v and a of the whole mechanism from those of the joints that lead, of a mechanism with loops.
    Accelerations that jump are found, and splines are split there; what is doubtful about the samples is in `doubts`.
    """
    where = place or (lambda k: f"{name}: sample {k + 1}")
    joints = model.joints[: len(model.joint_names)]
    _check_count(name, time, joints, given)
    q, contradictions = _with_unit_quaternions(where, joints, q)
    raw_q = q
    as_given = measured or Samples(time, q, given)  # before the resampling, which would give corners and noise another look
    if smooth is not None:
        q, given = _smoothed(name, joints, time, q, given, smooth)
    with np.errstate(over="ignore", invalid="ignore"):  # numbers that are not finite are refused later
        found = {} if smooth is not None else _jumps(joints, as_given, differentiated=True)
        v, a = _rates(where, joints, time, q, given, found)
        for joint, (joint_v, joint_a) in zip(joints, given, strict=True):
            rows, cols = _places(joint)
            contradictions += _contradictions(joint, time, q[:, rows], v[:, cols], joint_v, joint_a)
        standing = standing_of(joints, as_given, time, q, v, smooth, extent(model) if isinstance(model, Calls) else 0.0)
        given_jumps = _jumps(joints, as_given, differentiated=False)
    if follow is not None:
        q, v, a = follow(q, _zero_at(standing.stands, v), _zero_at(standing.held, a))
    corners, corner_times, impossible = sentences_about_jumps(joints, found, given_jumps, time)
    of_positions = [] if smooth is not None else doubts_about_positions(joints, as_given, found | given_jumps)
    doubts = [*suspicions(model, time, q, v), *impossible, *of_positions, *doubts_about_gaps(joints, as_given.time, as_given.q)]
    if isinstance(model, Calls):
        doubts += doubts_about_noise(model, joints, as_given, found, (q, v, a), smooth, np.asarray(standing.held.all(axis=0)))
    said = [*_differentiated(joints, given, smooth, follow), *corners, *_stands(joints, standing)]
    unsmoothed = None if smooth is None else raw_q
    return Motion(time, q, v, a, said, contradictions, doubts, unsmoothed, smooth, corner_times, None, standing.stands, standing.held, standing.rate)


def _places(joint: Joint) -> tuple[slice, slice]:
    """Where a joint's numbers are in q and in v."""
    return slice(joint.q_index, joint.q_index + joint.nq), slice(joint.v_index, joint.v_index + joint.nv)


def _check_count(name: str, time: Array, joints: tuple[Joint, ...], given: list[list[Array | None]]) -> None:
    missing = [j for j, g in zip(joints, given, strict=True) if g[0] is None or g[1] is None]
    if missing and len(time) < SPLINE_SAMPLES:
        rates = " and ".join(" ".join(group) for group in columns_of(missing[0])[1:])
        raise MotionError(
            f"{name}: {count(len(time), 'sample')}, but differentiating {', '.join(j.name for j in missing)} needs at least {SPLINE_SAMPLES}; "
            f"add samples, or give the columns {rates}"
        )
    if len(time) < 2:
        raise MotionError(f"{name}: {len(time)} sample, but means over time need at least 2; add samples")


def _with_unit_quaternions(where: Callable[[int], str], joints: tuple[Joint, ...], q: Array) -> tuple[Array, list[str]]:
    """Positions whose quaternions are of unit length and don't jump, and lines about those that were not of unit length."""
    q, lines = q.copy(), []
    for joint in joints:
        if joint.quaternion is None:
            continue
        rows, _ = _places(joint)
        off = np.abs(np.linalg.norm(q[:, rows][:, -4:], axis=1) - 1)
        q[:, rows] = continuous_unit(where, joint, q[:, rows])
        if (off > QUATERNION_ROUNDING).any():
            lines.append(f"quaternions of {joint.name} differ from unit length by up to {off.max():.2g}, and were normalised")
    return q, lines


def _smoothed(
    name: str, joints: tuple[Joint, ...], time: Array, q: Array, given: list[list[Array | None]], cutoff: float
) -> tuple[Array, list[list[Array | None]]]:
    """Positions and given rates, low-passed.  Quaternions are, too, and then brought to unit length."""
    if len(time) < SPLINE_SAMPLES:
        raise MotionError(f"{name}: {count(len(time), 'sample')}, but smoothing needs at least {SPLINE_SAMPLES}; add samples, or leave out --smooth")
    q = smoothed(time, q, cutoff, name)
    for joint in joints:
        if joint.quaternion is not None:
            first = joint.q_index + joint.quaternion
            q[:, first : first + 4] /= np.linalg.norm(q[:, first : first + 4], axis=1, keepdims=True)
    return q, [[None if x is None else smoothed(time, x, cutoff, name) for x in group] for group in given]


def _differentiated(joints: tuple[Joint, ...], given: list[list[Array | None]], smooth: float | None, follow: Follow | None) -> list[str]:
    said: dict[str, list[str]] = {}
    for joint, (joint_v, joint_a) in zip(joints, given, strict=True):
        how = "accelerations" if joint_v is not None else "velocities" if joint_a is not None else "velocities and accelerations"
        if joint_v is None or joint_a is None:
            said.setdefault(how, []).append(joint.name)
    whose = {how: "all joints" if len(names) == len(joints) and follow is None else ", ".join(names) for how, names in said.items()}
    lines = [f"{how} of {names} differentiated from a quintic spline through the samples" for how, names in whose.items()]
    if smooth is not None:
        lines.insert(0, f"positions and given rates smoothed at {smooth:g} Hz, without delay: amplitudes at that frequency are halved")
    return lines


def _stands(joints: tuple[Joint, ...], standing: Standing) -> list[str]:
    """A line for each joint that stands although its numbers are not still."""
    return [
        f"{j.name} stands where its position keeps within {standing.noisy[j.name]:.2g} {j.unit}, which is noise or rounding: "
        f"rates up to {standing.rate[j.v_index]:.2g} {j.unit}/s are taken as none there"
        for j in joints
        if j.name in standing.noisy and j.one_coordinate
    ]


def _jumps(joints: tuple[Joint, ...], samples: Samples, differentiated: bool) -> dict[str, Found]:
    """What jumps, by column: in positions or velocities that are differentiated, or in velocities that are given with their accelerations."""
    columns: dict[int, dict[str, Array]] = {1: {}, 2: {}}  # by the order of the derivative that may jump
    for joint, (v, a) in zip(joints, samples.given, strict=True):
        if (v is None or a is None) != differentiated:
            continue
        if v is not None:
            columns[1] |= dict(zip(columns_of(joint)[1], v.T, strict=True))
        elif _plain(joint):
            columns[2] |= dict(zip(columns_of(joint)[0], samples.q[:, _places(joint)[0]].T, strict=True))
    found: dict[str, Found] = {}
    for order, x in columns.items():
        if x and len(samples.time) >= SPLINE_SAMPLES:
            found |= dict(zip(x, jumps_of(samples.time, np.column_stack(list(x.values())), order), strict=True))
    return found


def _plain(joint: Joint) -> bool:
    """Whether velocities are the derivatives of positions, number by number."""
    return KINDS[joint.kind].velocity_is_rate


def _rates(
    where: Callable[[int], str], joints: tuple[Joint, ...], time: Array, q: Array, given: list[list[Array | None]], found: Mapping[str, Found]
) -> tuple[Array, Array]:
    """Velocities and accelerations, given or differentiated, by splines that are split at the jumps of their columns.

    Refuses positions or times that can't be differentiated in floating point.  Columns of joints without quaternions share one spline:
    its equations are factored once.
    """
    v, a = (np.empty((len(time), sum(j.nv for j in joints))) for _ in range(2))
    plain: dict[int, list[Joint]] = {1: [], 2: []}  # joints of which velocities, or positions, are differentiated
    for joint, (given_v, given_a) in zip(joints, given, strict=True):
        rows, cols = _places(joint)
        if given_v is not None and given_a is None:
            plain[1].append(joint)
        elif given_v is None and _plain(joint):
            plain[2].append(joint)
        elif given_v is None:
            with _differentiable(where, joint):
                v[:, cols], a[:, cols] = rates(joint, time, q[:, rows])
    for order, of in plain.items():
        if of:
            names = [c for j in of for c in columns_of(j)[2 - order]]
            v_of = {j.name: g[0] for j, g in zip(joints, given, strict=True)}
            by_joint = [q[:, _places(j)[0]] if (x := v_of[j.name]) is None else x for j in of]
            with _differentiable(where, of[0]):
                first, second = derivatives(time, np.column_stack(by_joint), order, [found.get(name) for name in names])
            columns = np.concatenate([np.arange(_places(j)[1].start, _places(j)[1].stop) for j in of])
            a[:, columns] = second if order == 2 else first
            if order == 2:
                v[:, columns] = first
    for joint, (given_v, given_a) in zip(joints, given, strict=True):
        _, cols = _places(joint)
        if given_v is not None:
            v[:, cols] = given_v
        if given_a is not None:
            a[:, cols] = given_a
        for rate, x in (("velocity", v[:, cols]), ("acceleration", a[:, cols])):
            bad = np.flatnonzero(~np.isfinite(x).all(axis=1))
            if len(bad):
                raise MotionError(f"{where(bad[0])}: the {rate} of {joint.name}, differentiated, is not finite; {TOO_LARGE}")
    return v, a


@contextmanager
def _differentiable(where: Callable[[int], str], joint: Joint) -> Iterator[None]:
    """Says of a singular system of equations what causes it."""
    try:
        yield
    except ValueError:
        raise MotionError(f"{where(0)}: {joint.name} can't be differentiated from this sample on; {TOO_LARGE}") from None


def _contradictions(joint: Joint, time: Array, q: Array, v: Array, given_v: Array | None, given_a: Array | None) -> list[str]:
    """Lines for given velocities that are not the derivatives of the positions, and for accelerations and velocities likewise."""
    if len(time) < SPLINE_SAMPLES:
        return []
    lines = []
    of_positions, of_velocities = columns_of(joint)[1:]
    checks: list[tuple[str, Array, Array | None, Sequence[str], Callable[[], Array]]] = [
        ("position", q, given_v, of_positions, lambda: rates(joint, time, q)[0]),
        ("velocity", v, given_a, of_velocities, lambda: derivative(time, v)),
    ]
    for of, x, given, columns, derived in checks:
        if given is None:
            continue
        try:
            found = derived()
        except ValueError:  # times too close for a spline: nothing to compare with
            continue
        in_metres = np.array([unit == "m" for unit in units_of(joint)[1]])
        at = _largest_contradiction(time, given, found, in_metres, 1e-5 * max(1.0, float(np.abs(x).max())))
        if at is None:
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
