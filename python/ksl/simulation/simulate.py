"""Mechanisms in motion: the call of a model."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, Literal, TypeAlias, get_args

import numpy as np
from numpy.typing import ArrayLike

from ksl.base.errors import ResultError, near_names
from ksl.base.finite_results import CHECK_UNITS
from ksl.base.printable import sentence
from ksl.base.real_arrays import real_array
from ksl.mechanism import given
from ksl.mechanism.calls import Calls
from ksl.mechanism.core_sentences import as_call
from ksl.simulation.drives import Brake, Controller
from ksl.simulation.drives_over_time import FINITE, NOT_NEGATIVE, SHARE, DriveNumbers, OverTime, coordinates, over_time
from ksl.simulation.simulation_result import HAPPENINGS, Drift, Event, Simulation
from ksl.mechanism.states import Array, External, ExternalAxes, items_of

Method = Literal["semi_implicit_euler", "rk4", "rkmk4", "dop853", "sdirk4", "variational"]
METHODS: tuple[Method, ...] = get_args(Method)
"""In the order of `stepping` (include/ksl/simulate.hpp), since the extension takes their numbers."""

IN_LANES = ("semi_implicit_euler", "rk4", "rkmk4")
"""Methods that step many runs at once (`go_in_lanes_under_laws`, src/simulate/runs/runs_under_laws.cpp)."""

REASONS = (
    "complete",
    "an event ended it",
    "a function ended it",
    "the step that the error allows became too small to go on",
    "it takes more steps than most_steps",
    "numbers are not finite",
    "the equations of an implicit step have no solution nearby; take a smaller step",
    "no closed position was found from here",
    "events follow each other at this instant without end",
)
"""How runs end, in the order of the compiled enumeration."""
COMPLETE, OF_EVENT, OF_FUNCTION, UNDERFLOW, TOO_MANY, NOT_FINITE, ENDLESS = 0, 1, 2, 3, 4, 5, 8

Efforts: TypeAlias = "ArrayLike | Callable[[float, Array, Array], ArrayLike] | Controller | None"
EventFunction = Callable[[float, Array, Array], float]


class SimulationCalls(Calls):
    """The call of a model."""

    def simulate(
        self,
        q: ArrayLike,
        v: ArrayLike,
        times: ArrayLike,
        efforts: Efforts = None,
        method: Method = "dop853",
        rtol: float = 1e-9,
        atol: float = 1e-9,
        step: float | None = None,
        external: External | None = None,
        external_axes: ExternalAxes = "link",
        restitution: float | Mapping[str, float] | None = None,
        friction: float | Mapping[str, float] | None = None,
        brake: Brake | None = None,
        events: Iterable[EventFunction] | EventFunction = (),
        project: bool = True,
        most_steps: int = 10_000_000,
        threads: int | None = None,
        progress: Callable[[float], object] | None = None,
    ) -> Simulation:
        """The motion from q (…, nq), v (…, nv) at times[0], at all `times` (n), s, increasing: forward dynamics over time.

        efforts: of the drives.  None is none; (nv) constant; (n, nv) or (…, n, nv) at the times, straight lines between; a function of
        (t, q, v), which gets and returns numbers of one run, or, with the methods in lanes and without exact laws and events, those of all runs
        with their leading shape, and ends the run if it returns None; or a controller: :class:`ksl.simulation.PD`, `GravityCompensation` or `ComputedTorque`.
        method: "dop853", order 8 with error control by rtol and atol; with steps of at most `step`, s: "rk4" and "rkmk4", order 4, "semi_implicit_euler", order 1, which compute many runs in lanes; "sdirk4", order 4, implicit, for stiff
        springs and gains; "variational", order 2, whose energy has no trend.  docs/simulation.md says which to take.
        rtol, atol: error of one step, of each number of a step and of v: atol + rtol |number|; with loops that are projected both are at most 1e-8.  step: each interval of `times` has a whole
        number of steps.  most_steps: of a run.
        external: {link: (6) constant, (n, 6) or (…, n, 6) at the times}, or {link: ksl.Wrench}; external_axes: as in :meth:`inverse_dynamics`.
        restitution: limits of joints throw back with −restitution times the speed, one number or {joint: number}; None: no limits.
        friction: dry friction that sticks and slips by the exact law, N m or N, beside that of the model's "exact friction".
        brake: a :class:`ksl.simulation.Brake`.
        events: functions of (t, q, v) of one run, whose zeros are located and recorded; with an attribute `terminal` true the run ends
        there, with `direction` 1 or −1 only zeros where it rises or falls count.
        restitution, friction and brake go with all methods but "variational", events with all.
        project: whether positions and velocities of mechanisms with loops are moved to the nearest closed ones after each step.
        threads: at most, for many runs; functions of Python are called by one.
        progress: is told, some times a second, the time that the first run has reached, s.  Ctrl-C ends the call.

        Joint physics is that of the model (:meth:`with_physics`).  A run that ends early warns, keeps what it has, and says why in
        `reason`.  Raises ValueError for starts of mechanisms with loops that are not closed, and for arguments that don't fit.

            run = m.simulate(q, v, np.linspace(0.0, 2.0, 201))
            run.q, run.drift.energy
        """
        at, moving, leading = self._several((q, "q", self.nq), (v, "v", self.nv))
        instants = _times(times)
        which = _one_of_methods(method)
        self._require_closed_start(at, moving)
        laws = self._exact_laws(restitution, friction, brake, at)
        watched = list(events) if isinstance(events, Iterable) else [events]
        are_alone = bool(watched) or "exact friction" in self.physics or any(laws[name] is not None for name in ("restitution", "friction", "brake"))
        drives = DriveNumbers(self, efforts, instants, leading, which in IN_LANES and not are_alone)
        most, most_threads = _count(most_steps, "most_steps"), given.threads(threads)
        how = {
            "method": METHODS.index(which),
            "step": _step(step, which, instants),
            "rtol": _positive(rtol, "rtol", zero=True),
            "atol": _positive(atol, "atol", zero=True),
            "most_steps": most,
            "project": given.flag(project, "project"),
        }
        wrenches = self._wrenches_over_time(external, external_axes, instants, leading)
        if progress is not None and not callable(progress):
            raise ValueError(f"progress: {type(progress).__name__} is no function of the time")
        is_called = drives.function is not None or bool(watched)
        arrays, ends, happened = self._core.simulate(
            at,
            moving,
            instants,
            how,
            drives.numbers,
            wrenches,
            external_axes == "world",
            laws,
            [(_direction(f), bool(getattr(f, "terminal", False))) for f in watched],
            _event_values(watched) if watched else None,
            1 if is_called else most_threads,
            progress,
        )
        result = self._simulation(instants, leading, arrays, ends, happened, not wrenches)
        self._warn_of_ends(result, ends, drives, most)
        return result

    def _require_closed_start(self, q: Array, v: Array) -> None:
        """Refuses starts at which loops are open, by the sentences of forward dynamics, which name the way out."""
        if not self.loops or not len(q):
            return
        try:
            self.forward_dynamics(q, v, np.zeros_like(v))
        except ResultError as error:
            error.args = (as_call(error, "forward_dynamics", "simulate"),)
            raise

    def _exact_laws(self, restitution: Any, friction: Any, brake: Brake | None, q: Array) -> dict[str, Any]:
        laws: dict[str, Any] = {"restitution": None, "lower": None, "upper": None, "friction": None, "brake": None, "brake_at": 0.0, "cut_efforts": False}
        single = [joint for joint in self.joints[: self._moving] if joint.one_coordinate]
        one = [joint.v_index for joint in single]
        if restitution is not None:
            laws["restitution"] = coordinates(self, restitution, "restitution", one, SHARE, outside=-1.0)
            laws["lower"], laws["upper"] = np.full(self.nv, -np.inf), np.full(self.nv, np.inf)
            for joint in single:
                k = joint.q_index
                laws["lower"][joint.v_index], laws["upper"][joint.v_index] = self.lower[k], self.upper[k]
                beyond = (q[:, k] < self.lower[k]) | (q[:, k] > self.upper[k])
                if laws["restitution"][joint.v_index] >= 0 and beyond.any():
                    said = f"q: {joint.name!r} starts at {q[beyond, k][0]:g}, beyond its limits {self.lower[k]:g} and {self.upper[k]:g}"
                    raise ValueError(sentence(f"{said}; start within them, or leave the joint out of restitution"))
        if friction is not None:
            laws["friction"] = coordinates(self, friction, "friction", one, NOT_NEGATIVE)
        if brake is not None:
            if not isinstance(brake, Brake):
                raise ValueError(f"brake is {type(brake).__name__}; expected a ksl.simulation.Brake")
            laws["brake"] = coordinates(self, brake.effort, "brake", one, NOT_NEGATIVE)
            laws["brake_at"], laws["cut_efforts"] = given.number(brake.at, "brake.at"), given.flag(brake.cut, "brake.cut")
            FINITE.judge(np.array(laws["brake_at"]), "brake.at")
        return laws

    def _wrenches_over_time(self, external: External | None, axes: str, times: Array, leading: tuple[int, ...]) -> list[tuple[int, OverTime]]:
        if axes not in ("link", "world"):
            raise ValueError(f"external_axes={axes!r}; {near_names(axes, ('link', 'world'))}expected one of 'link', 'world'")
        found = []
        for link, wrench in items_of(external, axes):
            number = self._index(self._link_index, link, "link")
            found.append((number, over_time(wrench, times, leading, 6, sentence(f"external[{link!r}]"))))
        return found

    def _simulation(self, times: Array, leading: tuple[int, ...], arrays: Any, ends: Any, happened: Any, is_free: bool) -> Simulation:
        shaped = {
            name: x.reshape(*leading, *(x.shape[1:2] if x.shape[2] == 1 and name not in ("q", "v", "a", "tau") else x.shape[1:])) for name, x in arrays.items()
        }
        how = np.array([end[0] for end in ends], dtype=int).reshape(leading)
        energy = shaped["kinetic"] + shaped["potential"]
        with np.errstate(invalid="ignore"):  # infinite ones are warned of
            lost = energy - energy[..., :1] - shaped["work"]
        drift = Drift(lost, self._momentum_lost(shaped["momentum"], times) if is_free else None, shaped.get("closure"))
        joints = {joint.v_index + k: joint.name for joint in self.joints[: self._moving] for k in range(joint.nv)}
        recorded = []
        for run, time, what, number, speed in happened:
            is_of_joint = HAPPENINGS[what] not in ("brakes", "singular", "event")
            recorded.append(Event(run, time, HAPPENINGS[what], joints[number] if is_of_joint else None, number if number >= 0 else None, speed))
        count = [np.array([end[place] for end in ends], dtype=np.int64).reshape(leading) for place in (2, 3, 4)]
        return Simulation(
            times, shaped["q"], shaped["v"], shaped["a"], shaped["tau"], shaped["kinetic"], shaped["potential"], shaped["work"], drift,
            tuple(recorded), how == COMPLETE, np.array([REASONS[k] for k in how.ravel()], dtype=object).astype(str).reshape(leading),
            np.array([end[1] for end in ends], dtype=float).reshape(leading), *count,
        )  # fmt: skip

    def _momentum_lost(self, momentum: Array, times: Array) -> Array | None:
        """For mechanisms that only floating joints carry: momentum less what gravity gave."""
        roots = [joint for joint in self.joints[: self._moving] if joint.parent is None or not self._is_moved(joint.parent)]
        if not roots or any(joint.kind != "floating" for joint in roots) or self.loops:
            return None
        mass = sum(self.subtree_mass(joint.name) for joint in roots)
        lost = momentum - momentum[..., :1, :]
        lost[..., :3] -= mass * np.asarray(self.gravity) * (times - times[0])[:, np.newaxis]
        return lost  # gravity has no moment about the centre of mass

    def _is_moved(self, link: str) -> bool:
        return any(self.joint(name).nv or self.joint(name).leader for name in self.support(link))

    def _warn_of_ends(self, run: Simulation, ends: Sequence[tuple[int, float, int, int, int, int, int]], drives: DriveNumbers, most_steps: int) -> None:
        early = [k for k, end in enumerate(ends) if end[0] not in (COMPLETE, OF_EVENT, OF_FUNCTION)]  # these were wanted
        if not early:
            self._warn_of_overflow(run)
            return
        how, time, *_, coordinate, element = ends[early[0]]
        names = [joint.name for joint in self.joints[: self._moving] if joint.v_index <= coordinate < joint.v_index + joint.nv]
        which = f"run {early[0]}" + (f", the first of {len(early)}," if len(early) > 1 else "") if len(ends) > 1 else "the run"
        energy = np.reshape(run.energy, (len(ends), len(run.times)))[early[0]]
        last = energy[np.isfinite(energy)]
        said_of_joint = {UNDERFLOW: "; joint {!r} is where the error is largest", ENDLESS: "; joint {!r} has the last one"}.get(
            how, ", those of joint {!r} first"
        )
        at = said_of_joint.format(names[0]) if names else ""
        at += f", {most_steps:,}; take longer steps, a larger error or an earlier end" if how == TOO_MANY else ""
        by_function = drives.first_not_finite(time) if how == NOT_FINITE else ""
        at += f"; {by_function}" if by_function else ""
        if element >= 0:
            of = self.force_elements[element]
            is_limited = (of.lower is not None or of.upper is not None) and not of.stop_stiffness
            beyond = "it is beyond a limit without a stop, or " if is_limited else ""
            at += f"; force element {of.name} has no force there: {beyond}its points on links {of.link1} and {of.link2} coincide"
        held = f"; its energy was {last[-1]:.4g} J" if len(last) else ""
        said = f"{which} ended at {time:.9g} s of {run.times[-1]:g} s: {REASONS[how]}{at}{held}.  Rows after that are NaN."
        warnings.warn(sentence(said), RuntimeWarning, stacklevel=3)

    def _warn_of_overflow(self, run: Simulation) -> None:
        """Says where motions are finite, and squares of velocities are not.  Rows behind the end of a run, by an event say, are NaN."""
        known = np.isfinite(run.v).any(axis=-1)
        bad = (known & ~np.isfinite([run.kinetic, run.potential, run.work]).all(axis=0)).reshape(-1, len(run.times))
        if bad.any():
            state, sample = np.argwhere(bad)[0]
            which = f"run {state}" if run.complete.ndim else "the run"
            said = f"{which}: its energy or the work done on it is not finite at {run.times[sample]:.9g} s: velocities, efforts or wrenches are too large for double precision; {CHECK_UNITS}"
            warnings.warn(said, RuntimeWarning, stacklevel=4)


def _times(times: ArrayLike) -> Array:
    instants = np.asarray(real_array(times, "times"), dtype=float, order="C")
    if instants.ndim != 1 or not len(instants):
        raise ValueError(f"times has shape {instants.shape}; expected (n), the first that of the start")
    if not np.isfinite(instants).all():
        raise ValueError("times must be finite")
    late = np.flatnonzero(np.diff(instants) <= 0)
    if len(late):
        k = int(late[0]) + 1
        raise ValueError(f"times[{k}] is {instants[k]:g} after {instants[k - 1]:g}; times must increase")
    return instants


def _one_of_methods(method: object) -> str:
    if not isinstance(method, str) or method not in METHODS:
        raise ValueError(f"method={method!r}; {near_names(method, METHODS)}expected one of {', '.join(METHODS)}")
    return method


def _step(step: float | None, method: str, times: Array) -> float:
    if method == "dop853":
        if step is not None:
            raise ValueError("step is for methods with steps of the same length; dop853 chooses its own, by rtol and atol")
        return 0.0
    if step is None and len(times) > 1:
        raise ValueError(f"the method {method} has steps of the same length; give step, s")
    return _positive(step, "step") if step is not None else 1.0


def _positive(x: Any, what: str, zero: bool = False) -> float:
    number = given.number(x, what)
    if not (number > 0 or (zero and number == 0)) or not np.isfinite(number):
        raise ValueError(f"{what} is {number:g}; expected a finite number {'that is not negative' if zero else 'above zero'}")
    return number


def _count(x: Any, what: str) -> int:
    if type(x) is bool or not isinstance(x, (int, np.integer)) or x < 1:
        raise ValueError(f"{what}={x!r}; expected a number of steps, 1 or more")
    return int(x)


def _direction(function: Any) -> int:
    if not callable(function):
        raise ValueError(f"events: {type(function).__name__} is no function of (t, q, v)")
    direction = given.number(getattr(function, "direction", 0), "direction of an event")
    FINITE.judge(np.array(direction), "direction of an event")
    return int(np.sign(direction))


def _event_values(functions: Sequence[EventFunction]) -> Callable[[int, float, Array, Array], Array]:
    """All functions at once, for the compiled call."""

    def values(run: int, t: float, q: Array, v: Array) -> Array:
        found = np.array([given.number(f(t, q[0], v[0]), f"the result of events[{k}]") for k, f in enumerate(functions)])
        if not np.isfinite(found).all():
            k = int(np.flatnonzero(~np.isfinite(found))[0])
            raise ValueError(f"events[{k}] is {found[k]} at t = {t:.9g} s of run {run}; expected a finite number")
        return found

    return values
