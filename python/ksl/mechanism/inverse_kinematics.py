"""Inverse kinematics: positions at which frames have given poses."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ksl.base.errors import unknown_name
from ksl.base.finite_results import require_finite
from ksl.base.real_arrays import real_array
from ksl.mechanism.given import TypedPose
from ksl.mechanism.requests import Requests, names_in_order
from ksl.mechanism.states import Array, argument

REASONS = ("converged", "iterations", "limits", "stuck")


@dataclass(frozen=True, repr=False)
class InverseKinematics:
    """What was found; each array has the leading shape of the targets."""

    q: Array
    """(…, nq): within tolerance where `converged`, the best that was found elsewhere."""
    converged: NDArray[np.bool_]
    reason: NDArray[np.str_]
    """"converged", or why not, of the best attempt: "iterations" were used up, "limits" of joints held it, or it was "stuck"
    at a local minimum of the error."""
    error: Array
    """(…, 2): the largest error of a position, m, and of an orientation, rad, among the frames that count."""
    iterations: NDArray[np.intc]
    """The iterations of all starts together."""
    starts: NDArray[np.intc]
    """How many were used."""

    def __repr__(self) -> str:
        """One line: whether it converged, and how far off it is; the arrays are in the fields."""
        position, orientation = (float(x) for x in self.error.reshape(-1, 2).max(axis=0)) if self.error.size else (0.0, 0.0)
        off = f"error {position:.3g} m, {orientation:.3g} rad"
        if self.converged.ndim == 0:
            q = np.array2string(np.asarray(self.q), precision=4, separator=", ", threshold=12, edgeitems=3, max_line_width=1000)
            return f"<ksl inverse kinematics: {self.reason}, {off}, q={q}>"
        ends = ", ".join(f"{int(count)} {reason}" for reason in REASONS if (count := np.count_nonzero(self.reason == reason)))
        return f"<ksl inverse kinematics of {self.converged.size} targets: {ends or 'none'}; largest {off}>"


class InverseKinematicsCalls(Requests):
    """The call of a model."""

    def inverse_kinematics(
        self,
        names: str | Sequence[str],
        target: ArrayLike | TypedPose,
        q0: ArrayLike | None = None,
        weights: float | tuple[float, float] | Mapping[str, float | tuple[float, float]] = 1.0,
        limits: bool = True,
        tolerance: float | tuple[float, float] = 1e-6,
        iterations: int = 40,
        starts: int = 5,
        seed: int = 0,
        threads: int | None = None,
    ) -> InverseKinematics:
        """Positions at which links' frames, or joints' (the child links'), have given poses in the world.

        names: one, with target (…, 4, 4) or a :class:`ksl.Pose`, or several, with target (…, names, 4, 4); m.
        q0 (…, nq): the first start, for each target; leading shapes are broadcast.  Without it all starts are random.  Joints
        that don't carry the frames keep its positions, or zero.
        weights: how much errors count: a number, or (position, orientation), or {name: either}.  What has weight zero may be
        anything; the ratios of weights count alone.  With equal weights, a twentieth of the length of the chain that carries the frame counts as a radian.
        limits: keep positions within the joints' limits (`Joint.limits`); a start beyond them begins at them.  tolerance: of positions, m, and of orientations, rad.
        iterations: at most, from each start.  starts: at most.  seed: of the random starts.
        threads: as in :meth:`inverse_dynamics`; results don't depend on it, nor on what the other targets are.  The random starts of a target are
        those of its place among the targets, so that the same target many times gives several solutions.

        Mimic joints move with their leaders, whose range is such that all keep their limits.
        Never raises for a target that is not reached: the result says so, and why.  Raises ResultError for one, or for a start, that is so far
        away that the square of its distance is not finite.  Damped least squares (Levenberg 1944,
        Marquardt 1963; damping as Sugihara, IEEE Trans. Robotics 27 (2011) 984).  About 15 iterations a target, O(depth) each.

            found = m.inverse_kinematics("tool0", m.frame_pose(q, "tool0"), q0=q + 0.1)
            assert found.converged, found.reason
        """
        if not isinstance(names, str) and not isinstance(names, Iterable):
            raise ValueError(f"names={names!r}; expected a link or joint, or several")
        wanted = (names,) if isinstance(names, str) else names_in_order(names, "names")
        if not wanted:
            raise ValueError("names is empty; expected a link or joint, or several")
        for name in weights if isinstance(weights, Mapping) else ():
            if name not in wanted:
                raise ValueError(unknown_name("weights", "frame", name, wanted))
        frames = [(self.frame_link(name), *_weights_of(weights, name)) for name in wanted]
        poses = real_array(target.array_in("world") if isinstance(target, TypedPose) else target, "target")
        axes = (4, 4) if isinstance(names, str) else (len(wanted), 4, 4)
        if poses.dtype.kind not in "fiub" or poses.shape[poses.ndim - len(axes) :] != axes:
            raise ValueError(f"target has shape {poses.shape}; expected (…, {', '.join(map(str, axes))}): poses in the world")
        leading = poses.shape[: poses.ndim - len(axes)]
        start = None
        if q0 is not None:
            start = argument(q0, "q0", self.nq, self._core)
            if start.shape[-1:] != (self.nq,) or start.dtype.kind not in "fiub":
                raise ValueError(f"q0 has shape {start.shape}; expected (…, {self.nq}): nq numbers for each target")
            if not np.isfinite(start).all():
                raise ValueError("q0 has numbers that are not finite")
            try:
                leading = np.broadcast_shapes(leading, start.shape[:-1])
            except ValueError:
                raise ValueError(f"leading shapes don't broadcast: target {poses.shape}, q0 {start.shape}") from None
        single = poses.dtype == np.float32 and (start is None or start.dtype == np.float32)
        position, orientation = _tolerances(tolerance)
        iterations, starts = _count(iterations, "iterations"), _count(starts, "starts")
        if not isinstance(limits, (bool, np.bool_)):
            raise ValueError(f"limits={limits!r}; expected True or False")
        if not isinstance(seed, (int, np.integer)):
            raise ValueError(f"seed={seed!r}; expected a whole number")
        n = int(np.prod(leading))

        def rows(x: Array, own: tuple[int, ...]) -> Array:
            broadcast: Array = np.ascontiguousarray(np.broadcast_to(x, leading + own), np.float32 if single else np.float64)
            return broadcast.reshape(n, int(np.prod(own)))

        q, error, end, used, begun = self._core.inverse_kinematics(
            frames, rows(poses, axes), None if start is None else rows(start, (self.nq,)), position, orientation,
            iterations, starts, int(seed) % 2**64, bool(limits), threads,
        )  # fmt: skip
        require_finite("inverse_kinematics", "q", q)
        require_finite("inverse_kinematics", "error", error)
        end = end.reshape(leading)
        return InverseKinematics(
            q.reshape(*leading, self.nq), end == 0, np.array(REASONS)[end], error.reshape(*leading, 2), used.reshape(leading), begun.reshape(leading)
        )


def _tolerances(given: float | tuple[float, float]) -> tuple[float, float]:
    try:
        position, orientation = map(float, given if isinstance(given, (tuple, list)) else (given, given))
    except (TypeError, ValueError):
        position = orientation = -1.0
    if not (0 < position < np.inf and 0 < orientation < np.inf):
        raise ValueError(f"tolerance={given!r}; expected a positive number, or two, of positions (m) and of orientations (rad)")
    return position, orientation


def _count(given: int, what: str) -> int:
    if not isinstance(given, (int, np.integer)) or not 0 < given < 2**31:
        raise ValueError(f"{what}={given!r}; expected a positive whole number")
    return int(given)


def _weights_of(weights: float | tuple[float, float] | Mapping[str, float | tuple[float, float]], name: str) -> tuple[float, float]:
    given = weights.get(name, 1.0) if isinstance(weights, Mapping) else weights
    try:
        position, orientation = given if isinstance(given, (tuple, list)) else (given, given)
        found = float(position), float(orientation)
    except (TypeError, ValueError):
        found = (-1.0, -1.0)
    if not (0 <= found[0] < np.inf and 0 <= found[1] < np.inf):
        raise ValueError(f"weight of {name}: {given!r}; expected a number that is not negative, or two, of position and orientation")
    return found
