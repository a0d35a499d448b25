"""Mechanisms with loops: whether they are closed, which freedoms they have, and motions that keep them closed."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import cast, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ksl import _core
from ksl.base.callers import called_from
from ksl.base.errors import QuaternionWarning
from ksl.base.finite_results import require_finite
from ksl.mechanism import given
from ksl.mechanism.chosen_coordinates import Chosen, ChosenCoordinates
from ksl.mechanism.requests import names_in_order
from ksl.mechanism.states import Array, External, ExternalAxes, Order, Part, Point, Side, Undetermined, argument_rows, external_in, items_of, leading_shape
from ksl.mechanism.stiffness import Stiffnesses

Gains = float | tuple[float, float]
"""(α, β) of a correction of errors of loops, 1/s, or one number for both."""
CLOSING = ("closed", "not found", "singular", "limits", "nothing free")
_CLOSING = np.array(CLOSING)
_REASONS, _CONVERGED = tuple(np.array(reason) for reason in CLOSING), tuple(np.array(i == 0)[()] for i in range(len(CLOSING)))  # of one position
for _reason in _REASONS:
    _reason.setflags(write=False)
_CONTRADICTORY, _NEAREST = 2, 1
TOLERANCES = _core.loop_tolerances()
"""The tolerances of closed mechanisms by name, those of the compiled code, which says what each is relative to (include/ksl/engine/algorithms/loops/tolerances.hpp)."""
SAME = TOLERANCES["accepted"]
"""Closed positions that differ by no more in any coordinate, rad or m, are one."""
STARTS = 32
"""From how many positions :meth:`Model.close` searches, where the first ones lead nowhere."""


@dataclass(frozen=True)
class Mobility:
    """The freedoms of a mechanism at a position."""

    mobility: int
    """Freedoms for an instant: nv − rank.  At a singular position there are more than elsewhere."""
    rank: int
    """How many of the loops' equations are independent."""
    redundant: int
    """How many follow from the others.  The reactions of these components are not determined by rigid bodies."""
    redundant_rows: tuple[tuple[str, int], ...]
    """Which: the loop joint's name, and the number of the equation among those of that joint."""
    smallest: float
    """The smallest singular value that counts for the rank, relative to the largest term of the equations: small near a singular position."""
    next: float
    """The largest one that does not count; rounding, where the rank is certain."""
    length: float
    """The length of the mechanism, m, that rows of moments were multiplied by, and coordinates that turn divided."""


@dataclass(frozen=True)
class ForceElementStates:
    """What force elements do; each array is (…, elements), in the order of `force_elements`."""

    length: Array
    """m."""
    rate: Array
    """The rate of the length, m/s."""
    tension: Array
    """N; negative where the element pushes."""


@dataclass(frozen=True, repr=False)
class Closed:
    """What :meth:`Model.close` found; each array has the leading shape of the positions."""

    q: Array
    """(…, nq): closed where `converged`; elsewhere the position at which the search ended."""
    converged: NDArray[np.bool_]
    reason: NDArray[np.str_]
    """"closed", or how the search from q ended: "not found" where the error has a minimum, "singular" where equations lose rank, "limits"
    of joints held it; "nothing free": the joints to hold are all there are.  Only the last proves that there is no closed position."""
    error: Array
    """(…) The largest component of the error that is left, m; angles times the length of the mechanism."""

    def __repr__(self) -> str:
        """One line; the arrays are in the fields."""
        if self.converged.ndim == 0:
            q = np.array2string(np.asarray(self.q), precision=4, separator=", ", threshold=12, edgeitems=3, max_line_width=1000)
            return f"<ksl position: {self.reason}, error {float(self.error):.3g} m, q={q}>"
        ends = ", ".join(f"{int(count)} {reason}" for reason in CLOSING if (count := np.count_nonzero(self.reason == reason)))
        return f"<ksl positions, {self.converged.size}: {ends or 'none'}; largest error {float(self.error.max(initial=0.0)):.3g} m>"


class LoopCalls(ChosenCoordinates):
    """The calls of a model.  Without loops their answers are those of a tree: no equations, all coordinates independent."""

    def mobility(self, q: ArrayLike) -> Mobility:
        """The freedoms at a position q (nq), by the rank of the loops' equations.

        Rows of moments are multiplied by the length of the mechanism, and coordinates that turn divided by it, so that all terms are
        lengths; a singular value counts as zero below 1e-9 of a length, and below a hundred times what the position is open by.  An open position
        is one of another mechanism, and a warning says so.

            m.mobility(q).mobility
        """
        positions = self._one_position(q)
        opened = np.abs(self.loop_error(positions)).max(initial=0.0)
        if opened > TOLERANCES["accepted"] * max(1.0, length_of(self)):
            said = f"q is open by {opened:.3g} m or rad: these freedoms are those of the position, not of the mechanism; close(q) gives the nearest closed one"
            warnings.warn(said, UserWarning, stacklevel=2)
        mobility, rank, redundant, smallest, following, length, rows = self._core.mobility(positions)
        return Mobility(mobility, rank, redundant, tuple(self._equation(row) for row in rows), smallest, following, length)

    def loop_error(self, q: ArrayLike) -> Array:
        """The errors (…, rows) of the loops' equations for q (…, nq): zero where the loops are closed; m and rad.

        Rows are 6 − nv for each loop joint, in the order of `loop_names`: of the displacement between the joint's two frames, less what
        the joint's best position explains, the components that the joint resists, forces first, in the axes of the frame on the successor.
        """
        positions, leading = self._states((q, "q", self.nq))
        return _finite("loop_error", "error", self._core.loop_error(positions)).reshape(*leading, self._core.loop_rows)

    def loop_jacobian(self, q: ArrayLike) -> Array:
        """The Jacobian J (…, rows, nv) of the loops' equations for q (…, nq): d(error) = J dv at closed positions, and J v = 0."""
        positions, leading = self._states((q, "q", self.nq))
        return _finite("loop_jacobian", "J", self._core.loop_jacobian(positions)).reshape(*leading, self._core.loop_rows, self.nv)

    def loop_acceleration(self, q: ArrayLike, v: ArrayLike, a: ArrayLike) -> Array:
        """The rates (…, rows) of J v, J a + (rate of J) v, for q (…, nq), v and a (…, nv): zero for motions that keep the loops closed."""
        *arrays, leading = self._several((q, "q", self.nq), (v, "v", self.nv), (a, "a", self.nv))
        return _finite("loop_acceleration", "acceleration", self._core.loop_acceleration(*arrays)).reshape(*leading, self._core.loop_rows)

    def force_element_states(self, q: ArrayLike, v: ArrayLike = 0.0) -> ForceElementStates:
        """Lengths, their rates and tensions of the springs, dampers and cylinders between two points, for q (…, nq) and v (…, nv).

        They don't depend on whether `physics` names them.  Raises :class:`ksl.ResultError` where an element has no force: its points
        coincide, or its length is beyond a limit without a stop.

            m.force_element_states(q).tension
        """
        at, rates, leading = self._several((q, "q", self.nq), (v, "v", self.nv))
        numbers = _finite("force_element_states", "states", self._core.force_element_states(at, rates))
        found = numbers.reshape(*leading, 3, len(self.force_elements))
        return ForceElementStates(found[..., 0, :], found[..., 1, :], found[..., 2, :])

    def independent(self, q: ArrayLike) -> NDArray[np.intp]:
        """Indices into v, ascending, of coordinates that all others follow from at q (nq).

        They are those of the drives, and one of each idle body, where these are as many as the freedoms and determine the motion, else those that elimination with
        complete pivoting leaves.  Columns of derivatives are in this order, and `hold=` and `given=` of the calls below take it.
        """
        return np.array(self._core.independent(self._one_position(q)), dtype=np.intp)

    def close(self, q: ArrayLike, hold: Chosen = (), limits: bool = False, iterations: int = 100, starts: int = STARTS) -> Closed:
        """The closed position nearest to q (…, nq), with the coordinates of some joints kept.

        hold: joints whose positions stay as they are, those of drives for example: names, or indices of :meth:`independent`.  limits: keep the limits of joints.
        Nearest is the norm of :meth:`difference` over all coordinates, in rad and m; it is found from q by Gauss–Newton steps with a line
        search, then along the closed positions, so that it may be a local one.  Where that ends open, the search goes on from other starts,
        `starts` with q, the same in every call, and takes the nearest of the first that it finds: starts=1 finds positions near q alone.
        Converged is an error below 1e-12 of the mechanism's length, or below the rounding of angles that have turned often, up to 1e-9.
        A search that fails says how it ended in `reason`; q and error are then those of the position that is least open.

            near = m.close(m.neutral(), hold=["crank"])
        """
        positions, leading = self._states((q, "q", self.nq))
        if type(iterations) is bool or not isinstance(iterations, (int, np.integer)) or iterations < 1:
            raise ValueError(f"iterations={iterations!r}; expected a number of steps, 1 or more")
        many = _starts(starts)
        found, how, error = self._core.close(positions, self._held_of_positions(hold), given.flag(limits, "limits"), int(iterations), many)
        if not leading:  # one position, in less time
            return Closed(found[0], _CONVERGED[how[0]], _REASONS[how[0]], np.array(error[0]))
        ends = np.array(how, dtype=np.intp).reshape(leading)
        return Closed(found.reshape(*leading, self.nq), (ends == 0)[()], _CLOSING[ends, ...], np.array(error).reshape(leading))

    def branches(self, q: ArrayLike, hold: Chosen = (), starts: int = 64, seed: int = 0, limits: bool = False) -> Array:
        """Distinct closed positions (branches, nq) with the coordinates of `hold` as in q (nq), nearest to q first.

        The search closes the mechanism from q and from `starts` − 1 random positions (:meth:`random`, with this seed), and keeps positions
        that differ by more than 1e-6 in a coordinate.  It finds the branches that these starts lead to, and can't say that there are no others.
        Where the held joints leave freedoms, the branches are samples of a continuum.
        """
        start = self._one_position(q)
        held = self._held_of_positions(hold)
        tried = np.vstack([start, self.random(seed, size=_starts(starts) - 1)])
        kept = [k for joint in self.joints[: self._moving] for k in self._numbers_held(joint, held)]
        tried[:, kept] = start[0, kept]
        closed = self.close(tried, hold=held, limits=limits, starts=1)
        found: list[Array] = []
        for position in closed.q[closed.converged]:
            if all(np.abs(self._difference(other, position)).max(initial=0.0) > SAME for other in found):
                found.append(position)
        found.sort(key=lambda position: math.hypot(*self._difference(start[0], position).tolist()))
        return np.array(found).reshape(len(found), self.nq)

    def consistent_velocity(self, q: ArrayLike, v: ArrayLike, given: Chosen) -> Array:
        """Velocities (…, nv) that keep the loops closed at q (…, nq), with the coordinates of the joints `given` as in v (…, nv).

        given: names of joints, or indices into v, as :meth:`independent` has them.
        Idle bodies, rods with balls at both ends, have no spin about their lines where joints are given, and none of theirs is.
        Where the given joints leave other freedoms, the result is the one nearest to v, in the sum of squares of its numbers, and a warning says
        so.  Coordinates that no motion of the closed mechanism has are a ValueError.

            v = m.consistent_velocity(q, v, given=["crank"])
        """
        at, moving, leading = self._several((q, "q", self.nq), (v, "v", self.nv))
        wanted = self._chosen(given, "given")
        found, how = self._core.consistent_velocity(at, moving, self._coordinates_of(wanted, "given"))
        self._judge(how, wanted, "velocities")
        return _finite("consistent_velocity", "v", found).reshape(*leading, self.nv)

    def consistent_acceleration(self, q: ArrayLike, v: ArrayLike, a: ArrayLike, given: Chosen) -> Array:
        """Accelerations (…, nv) that keep the loops closed at q and v, with the coordinates of the joints `given` as in a (…, nv).

        v must keep the loops closed.  The rate of the equations, which velocities cause, is included.  Otherwise as
        :meth:`consistent_velocity`.
        """
        at, moving, rates, leading = self._several((q, "q", self.nq), (v, "v", self.nv), (a, "a", self.nv))
        wanted = self._chosen(given, "given")
        found, how = self._core.consistent_acceleration(at, moving, rates, self._coordinates_of(wanted, "given"))
        self._judge(how, wanted, "accelerations")
        return _finite("consistent_acceleration", "a", found).reshape(*leading, self.nv)

    def reactions_null_basis(self, q: ArrayLike, joints: Iterable[str] | None = None) -> Array:
        """Patterns (redundant, joints, 6) of wrenches that may be added to the reactions at q (nq) without a change that can be observed.

        They are orthonormal over all joints, tree and loop, in N and N m, each wrench at the joint's frame on the side called child;
        those of the joints asked for are then taken.  Components that no combination of them reaches with 1e-9, or with ten times the digits of
        a file's joints, are zero in all.  joints: as in :meth:`reactions`.
        """
        position = self._one_position(q)
        names = self.joint_names if joints is None else self._names_of(names_in_order(joints, "joints") or (), "joints")
        where = [self._reaction_index(name) for name in names]
        if not self.loops:
            return np.zeros((0, len(names), 6))
        patterns = self._core.reaction_patterns(position)
        chosen: Array = patterns.reshape(len(patterns), len(self.joints) + len(self.loops), 6)[:, where]
        return chosen

    def reactions_unique(self, q: ArrayLike, joints: Iterable[str] | None = None) -> NDArray[np.bool_]:
        """Which components (joints, 6) of the reactions at q (nq) every balance of rigid bodies shares.

        The others are those in which a pattern of :meth:`reactions_null_basis` has something.  :meth:`reactions` gives for them the values
        of least norm, which are a convention.
        """
        open_components = np.any(self.reactions_null_basis(q, joints) != 0, axis=0)
        unique: NDArray[np.bool_] = np.logical_not(np.asarray(open_components))
        return unique

    def _with_stiffness(self, stiffness: Stiffnesses) -> Any:
        """The model with these stiffnesses, which is made by a room above."""
        raise NotImplementedError

    def _stabilised(
        self, q: ArrayLike, v: ArrayLike, tau: ArrayLike, external: External | None, out: object, external_axes: ExternalAxes, gains: Gains,
        threads: int | None,
    ) -> Array:  # fmt: skip
        """Accelerations that correct errors of the loops."""
        if out is not None:
            raise ValueError("forward_dynamics: out= is for calls without stabilise=; leave one of both out")
        given.threads(threads)
        both = np.asarray(given.numbers(gains, "stabilise"), dtype=float)
        if both.shape not in ((), (2,)) or not np.isfinite(both).all() or (both < 0).any():
            raise ValueError(f"stabilise={gains!r}; expected (α, β) in 1/s, or one number for both, 0 or more")
        alpha, beta = np.broadcast_to(both, (2,)).tolist()
        arrays, links, leading = self._with_external((q, "q", self.nq), (v, "v", self.nv), (tau, "tau", self.nv), external=external, axes=external_axes)
        at, moving, efforts, *wrenches = arrays
        found: Array = self._core.stabilised_forward_dynamics(at, moving, efforts, links, wrenches, external_axes == "world", alpha, beta)
        return _finite("forward_dynamics", "a", found).reshape(*leading, self.nv)

    def _reactions_along(
        self, states: tuple[ArrayLike, ArrayLike, ArrayLike], external: External | None, on: Side, at: Point, axes: str, order: Order, part: Part,
        joints: Iterable[str] | None, out: object, external_axes: ExternalAxes, undetermined: Undetermined, threads: int | None,
    ) -> tuple[Array, Array, Array]:  # fmt: skip
        """Derivatives of reactions along the mechanism, which :mod:`ksl.model.surgery` has: they need the tree."""
        raise NotImplementedError

    def _with_external(
        self, *inputs: tuple[ArrayLike, str, int], external: External | None, axes: ExternalAxes
    ) -> tuple[list[Array], list[int], tuple[int, ...]]:
        """Arrays (states, columns) of inputs and of wrenches, the links of these, and the common leading shape."""
        external_in(external, axes)
        items = items_of(external, axes)
        wrenches = [(wrench, f"external[{link!r}]", 6) for link, wrench in items]
        *arrays, leading = self._several(*inputs, *wrenches)
        return arrays, [self._index(self._link_index, link, "link") for link, _ in items], leading

    def _along(
        self, call: str, q: ArrayLike, v: ArrayLike, x: tuple[ArrayLike, str], external: External | None, out: object, external_axes: ExternalAxes,
        threads: int | None,
    ) -> tuple[Array, Array, Array]:  # fmt: skip
        """Derivatives along the mechanism: columns are the independent coordinates; those by efforts are all."""
        if out is not None:
            raise ValueError(f"{call}: out= is for models without loops; the number of columns follows from the position")
        given.threads(threads)
        if external is None and external_axes == "link":  # one state of plain arrays, which is soon computed
            of_state = self._core.closed_derivatives_of_state(q, v, x[0], x[1] == "tau")
            if of_state is not None:
                return cast("tuple[Array, Array, Array]", of_state)
        arrays, links, leading = self._with_external((q, "q", self.nq), (v, "v", self.nv), (*x, self.nv), external=external, axes=external_axes)
        by_q, by_v, by_x, free = self._core.closed_derivatives(arrays[0], arrays[1], arrays[2], links, arrays[3:], external_axes == "world", x[1] == "tau")
        for name, by in zip(("q", "v", x[1]), (by_q, by_v, by_x)):
            require_finite(call, f"derivative by {name}", by)
        if not leading:  # one state
            return by_q.reshape(self.nv, free), by_v.reshape(self.nv, free), by_x.reshape(self.nv, -1)
        columns = self.nv if x[1] == "tau" else free
        return by_q.reshape(*leading, self.nv, free), by_v.reshape(*leading, self.nv, free), by_x.reshape(*leading, self.nv, columns)

    def _equation(self, row: int) -> tuple[str, int]:
        for loop in self.loops:
            if row < loop.equations:
                return loop.name, row
            row -= loop.equations
        raise IndexError(row)

    def _difference(self, q0: Array, q1: Array) -> Array:
        return self._core.difference(q0, q1, None, None, None, None, None, None)

    def _reaction_index(self, name: str) -> int:
        """Where a joint's wrench is among those of all joints, tree and loop."""
        loop = self._loop_index.get(self._plain(name, "joint"))
        return self.joint_index(name) if loop is None else len(self.joints) + loop

    def _names_of(self, names: Iterable[str], what: str) -> list[str]:
        return given.names(names, what)

    def _states(self, *inputs: tuple[ArrayLike, str, int]) -> tuple[Array, tuple[int, ...]]:
        array, leading = self._several(*inputs)
        return array, leading

    def _one_position(self, q: ArrayLike) -> Array:
        """(1, nq): of calls whose answer is that of one position."""
        positions, leading = self._states((q, "q", self.nq))
        if len(positions) != 1:
            raise ValueError(f"q has {len(positions)} positions, {(*leading, self.nq)}; expected one, ({self.nq},)")
        return positions

    def _several(self, *inputs: tuple[ArrayLike, str, int]) -> list[Any]:
        """Arrays (states, columns) of doubles, and their common leading shape.  The first are positions, whose quaternions get unit length."""
        if (one := _one_state(inputs)) is not None:
            return [self._with_unit_quaternions(one[0]), *one[1:], ()]
        arrays = {name: argument_rows(x, name, columns, self._core) for x, name, columns in inputs}
        leading = leading_shape(arrays)
        rows = [
            np.ascontiguousarray(np.broadcast_to(array, (*leading, array.shape[-1])).reshape(math.prod(leading), array.shape[-1])) for array in arrays.values()
        ]
        return [self._with_unit_quaternions(rows[0]), *rows[1:], leading]

    def _with_unit_quaternions(self, q: Array) -> Array:
        """Positions (states, nq), judged as calls of algorithms judge them: refused, or normalised with a warning."""
        if not self._quaternions or self._core.has_unit_quaternions(q):
            return q
        method, level = called_from()
        warnings.warn(self._core.judged_quaternions(q, method), QuaternionWarning, stacklevel=level)
        q = q.copy()
        for part in self._quaternions:
            q[:, part] /= np.linalg.norm(q[:, part], axis=-1, keepdims=True)
        return q

    def _judge(self, how: Sequence[int], names: Sequence[str | int], what: str) -> None:
        """Refuses contradictions, and says where freedoms were left."""
        if _CONTRADICTORY in how:
            state = f" of state {how.index(_CONTRADICTORY)}" if len(how) > 1 else ""
            if not names:  # K a = −K̇ v has no solution: where equations lose rank, closed positions bend away from v
                said = "no accelerations keep the loops closed at these velocities: the equations lose rank at this position; move away from it, or take other velocities"
                raise ValueError(said + state)
            mend = "give fewer joints, those of the drives say; where those say nothing else, the equations lose rank: move away from this position"
            raise ValueError(f"given {list(names)}: no motion of the closed mechanism has these {what}{state}; {mend}")
        if _NEAREST in how:
            said = f"given {list(names)}: they leave freedoms; of these, the {what} are those nearest to the ones passed"
            warnings.warn(said, UserWarning, stacklevel=3)


def _finite(call: str, result: str, rows: Array) -> Array:
    """Results (states, numbers), all of which must be finite."""
    require_finite(call, result, rows)
    return rows


def length_of(model: LoopCalls) -> float:
    """The length of the mechanism, m, that errors of loops are relative to; 0 without loops."""
    return float(model._core.mobility(np.asarray(model.neutral())[None])[5])


def one_position(model: LoopCalls, q: ArrayLike) -> Array:
    """A position (nq) with unit quaternions, for calls whose answer is that of one.  Raises ValueError for several."""
    position: Array = model._one_position(q)[0]
    return position


def one_row(model: LoopCalls, x: ArrayLike | None, name: str) -> Array:
    """The numbers (nv) of v, a or tau of one state; zeros for None.  Raises ValueError for several."""
    if x is None:
        return np.zeros(model.nv)
    rows = argument_rows(x, name, model.nv, model._core)
    if rows.size != model.nv:
        raise ValueError(f"{name} has shape {rows.shape}; expected that of one state, ({model.nv},)")
    return np.array(rows, dtype=float).reshape(model.nv)


def _one_state(inputs: Sequence[tuple[ArrayLike, str, int]]) -> list[Array] | None:
    """One state whose numbers can be read as they are, which takes a tenth of the time; None for all else."""
    rows: list[Array] = []
    for x, _, columns in inputs:
        if type(x) is not np.ndarray or x.dtype != np.float64 or x.shape != (columns,) or not (x.flags.c_contiguous and x.flags.aligned):
            return None
        if not math.isfinite(sum(x.tolist())):  # of numbers so large that their sum is not, others say what they are
            return None
        rows.append(x[None])
    return rows


def least_open(model: LoopCalls) -> float:
    """Elements of :meth:`LoopCalls.reactions_null_basis`, in whatever axes, from which on a component counts as open."""
    return model._core.open_component()


def _starts(starts: Any) -> int:
    if type(starts) is bool or not isinstance(starts, (int, np.integer)) or starts < 1:
        raise ValueError(f"starts={starts!r}; expected a number of starts, 1 or more")
    return int(starts)
