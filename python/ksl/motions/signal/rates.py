"""Velocities and accelerations from splines through the samples of a motion."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from ksl.base.errors import MotionError
from ksl.mechanism.joint_kinds import KINDS
from ksl.mechanism.mechanism import Joint
from ksl.mechanism.states import Array
from ksl.motions.signal.corners import Found, find_jumps, jumps_at
from ksl.motions.signal.noise import step_of
from ksl.motions.signal.splines import spline_through

SPLINE_SAMPLES = 6
"""A quintic needs six samples."""

MOST_CORNERS = 20
"""Corners of a spline that is split: its equations are those of all of them."""

NONE = np.empty(0)

LARGEST = 1e100
"""Beyond this, squares overflow: jumps are not looked for."""


def derivative(time: Array, x: Array, order: int = 1) -> Array:
    """Derivative at the samples of the quintic not-a-knot spline through x (n, …)."""
    rates: Array = spline_through(time, x)(time, nu=order)
    return rates


def rates_beside_corners(time: Array, x: Array, corner_times: Array, break_times: Array = NONE) -> tuple[Array, Array]:
    """First derivatives before and after each sample of a curve x (n), whose first and second derivatives may jump at the corner times.

    They differ where a sample is at a corner.  The spline is split at all corners, see `corners`; where these are many or close together, it ends
    at each.  It ends at break times, where x itself jumps, after a sample there.  Between two ends with fewer samples than a spline needs
    derivatives are NaN.
    """
    corner_times = np.asarray(corner_times)
    edges = np.unique(np.concatenate([[0], np.searchsorted(time, break_times, side="right"), [len(time)]]))
    before, after = np.full((2, len(time)), np.nan)
    for begin, end in pairwise(edges):
        t = time[begin:end]
        inside = corner_times[(corner_times > t[0]) & (corner_times < t[-1])] if len(t) else NONE
        first, last = np.searchsorted(t, inside), np.searchsorted(t, inside, side="right")  # a sample at a corner is on both sides
        if SPLINE_SAMPLES <= len(t) and len(inside) <= MOST_CORNERS and np.diff(first).min(initial=len(t)) >= SPLINE_SAMPLES:
            before[begin:end], after[begin:end] = _beside_corners(t, x[begin:end], inside)
            continue
        for low, high, shared in zip(begin + np.append(0, first), begin + np.append(last, len(t)), np.append(False, first < last), strict=True):
            rate = derivative(time[low:high], x[low:high]) if high - low >= SPLINE_SAMPLES else np.full(high - low, np.nan)
            after[low:high], before[low + shared : high] = rate, rate[int(shared) :]
    return before, after


def _beside_corners(time: Array, x: Array, corner_times: Array) -> tuple[Array, Array]:
    if not len(corner_times):
        rate = derivative(time, x)
        return rate, rate
    slope, curvature = jumps_at(time, x, corner_times)
    after = derivative(time, x - slope(time) - curvature(time)) + slope(time, 1) + curvature(time, 1)
    before = after.copy()
    index = np.searchsorted(time, corner_times)
    at_sample = time[index] == corner_times
    before[index[at_sample]] -= slope.sizes[at_sample]
    return before, after


def derivatives(time: Array, x: Array, order: int, found: Sequence[Found | None] = ()) -> tuple[Array, Array]:
    """First and, if order is 2, second derivatives of all columns of x (n, c); found: the jumps at which their splines are split.

    order: of the derivative that may jump: 2 for positions, 1 for velocities.  A column in which nothing jumps has the derivatives of
    its quintic not-a-knot spline.  O(n c); equations of all columns are factored once.
    """
    spline = spline_through(time, x)
    first: Array = spline(time, nu=1)
    second: Array = spline(time, nu=2) if order == 2 else first
    split = {c: f.jumps for c, f in enumerate(found) if f is not None and len(f.jumps.times)}
    if split:
        cut, jumps = list(split), list(split.values())
        spline = spline_through(time, x[:, cut] - np.column_stack([j(time) for j in jumps]))
        first[:, cut] = spline(time, nu=1) + np.column_stack([j(time, 1) for j in jumps])
        if order == 2:
            second[:, cut] = spline(time, nu=2) + np.column_stack([j(time, 2) for j in jumps])
    return first, second


def jumps_of(time: Array, x: Array, order: int) -> list[Found]:
    """Jumps of the derivative `order` of each column of x (n, c); none where numbers are so large that squares would overflow."""
    if not np.abs(x).max() < LARGEST:
        return [Found.nothing(order)] * x.shape[1]
    try:
        return find_jumps(time, x, order, np.array([step_of(column) for column in x.T]))
    except np.linalg.LinAlgError:  # times so close that polynomials are not determined
        return [Found.nothing(order)] * x.shape[1]


def rates(joint: Joint, time: Array, q: Array) -> tuple[Array, Array]:
    """Velocities and accelerations (n, nv) of a joint from its positions q (n, nq)."""
    if joint.quaternion is not None:
        return _rates_of_poses(time, q)
    if joint.kind == "planar":
        return _rates_in_plane(time, q)
    if not KINDS[joint.kind].velocity_is_rate:
        raise MotionError(f"{joint.name}: positions of a {joint.kind} joint can't be differentiated; give its velocities and accelerations, too")
    spline = spline_through(time, q)
    return spline(time, nu=1), spline(time, nu=2)


def _rates_of_poses(time: Array, q: Array) -> tuple[Array, Array]:
    """Twist in the body's frame and its componentwise derivative, from splines through quaternion and position, if there is one.

    The spline is of unit length only at the samples: n′ = q · q′ corrects for that.
    """
    position, quaternion = np.hsplit(q, [-4])
    q1, q2 = derivative(time, quaternion), derivative(time, quaternion, 2)
    growth = np.sum(quaternion * q1, axis=1, keepdims=True)
    w = 2 * _vector_part(quaternion, q1)
    dw = 2 * _vector_part(quaternion, q2) - 2 * growth * w
    if not position.shape[1]:
        return w, dw
    p1, p2 = derivative(time, position), derivative(time, position, 2)
    v = _into_body(quaternion, p1)
    dv = _into_body(quaternion, p2) - np.cross(w, v)
    return np.hstack([v, w]), np.hstack([dv, dw])


def _rates_in_plane(time: Array, q: Array) -> tuple[Array, Array]:
    """Velocity of a planar joint in the child's axes and its componentwise derivative, from splines through its position."""
    q1, q2 = derivative(time, q), derivative(time, q, 2)
    sine, cosine, w = np.sin(q[:, 2]), np.cos(q[:, 2]), q1[:, 2]
    (vx, vy), (ax, ay) = ((cosine * x[:, 0] + sine * x[:, 1], cosine * x[:, 1] - sine * x[:, 0]) for x in (q1, q2))
    return np.column_stack([vx, vy, w]), np.column_stack([ax + w * vy, ay - w * vx, q2[:, 2]])


def _vector_part(q: Array, r: Array) -> Array:
    """Vector part of q* r."""
    return q[:, 3:] * r[:, :3] - r[:, 3:] * q[:, :3] - np.cross(q[:, :3], r[:, :3])


def _into_body(q: Array, x: Array) -> Array:
    """Rᵀ x of the unit quaternions q (n, 4), xyzw."""
    t = 2 * np.cross(x, q[:, :3])
    return x + q[:, 3:] * t + np.cross(t, q[:, :3])
