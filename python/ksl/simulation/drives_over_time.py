"""What drives a simulation, as the numbers of the compiled call."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from ksl.base.printable import sentence
from ksl.base.real_arrays import real_array
from ksl.mechanism import given
from ksl.simulation.drives import PD, ComputedTorque, GravityCompensation, Reference
from ksl.mechanism.states import Array

OverTime: TypeAlias = "tuple[Array, Array]"
"""Times (n), and rows (runs, n, columns), or (1, n, columns) for all runs."""


def over_time(x: ArrayLike, times: Array, leading: tuple[int, ...], columns: int, what: str) -> OverTime:
    """Constant numbers (columns), or rows (n, columns) or (…, n, columns) at times."""
    array = np.asarray(real_array(x, what), dtype=float)
    if not np.isfinite(array).all():
        raise ValueError(f"{what} holds numbers that are not finite")
    n = len(times)
    if array.shape == (columns,):
        return times[:1].copy(), array.reshape(1, 1, columns).copy()
    if array.ndim >= 2 and array.shape[-2:] == (n, columns) and array.shape[:-2] in ((), leading):
        return times, np.ascontiguousarray(array.reshape(math.prod(array.shape[:-2]), n, columns))
    runs = "" if not leading else f", or {(*leading, n, columns)} for each run"
    raise ValueError(f"{what} has shape {array.shape}; expected ({columns},) constant, or {(n, columns)} at the times{runs}")


class Allowed(NamedTuple):
    """Numbers from `least` to `most`; infinite ones only where `most` says so."""

    least: float
    most: float
    words: str

    def judge(self, numbers: Array, what: str) -> None:
        bad = ~((numbers >= self.least) & (numbers <= self.most))
        if bad.any():
            raise ValueError(f"{what} is {numbers[bad].flat[0]:g}; expected {self.words}")


LARGEST = float(np.finfo(float).max)
FINITE = Allowed(-LARGEST, LARGEST, "a finite number")
NOT_NEGATIVE = Allowed(0.0, LARGEST, "a finite number, 0 or more")
LIMIT = Allowed(0.0, np.inf, "0 or more")
SHARE = Allowed(0.0, 1.0, "a number from 0 to 1")


def coordinates(model: Any, x: Any, what: str, among: Sequence[int], allowed: Allowed, outside: float = 0.0) -> Array:
    """Numbers (nv): one for all coordinates `among`, {joint: number}, or (nv); `outside` for all others."""
    numbers = np.full(model.nv, outside)
    if isinstance(x, Mapping):
        for name, value in x.items():
            joint = model.joint(name)
            mine = [k for k in range(joint.v_index, joint.v_index + joint.nv) if k in among] if joint.nv else []
            if not mine:
                raise ValueError(sentence(f"{what}: joint {name!r} has no coordinate that can have one; name joints that move and have a drive"))
            numbers[mine] = given.number(value, f"{what} of {name!r}")
            allowed.judge(numbers[mine], sentence(f"{what} of {name!r}"))
        return numbers
    array = np.asarray(real_array(x, what), dtype=float)
    allowed.judge(array if array.ndim == 0 or array.shape != (model.nv,) else array[list(among)], what)
    if array.ndim == 0:
        numbers[list(among)] = float(array)
    elif array.shape == (model.nv,):
        numbers[list(among)] = array[list(among)]
    else:
        raise ValueError(f"{what} has shape {array.shape}; expected one number, {{joint: number}} or ({model.nv},)")
    return numbers


class DriveNumbers:
    """The drives of a simulation.  The arrays live as long as this object."""

    def __init__(self, model: Any, efforts: Any, times: Array, leading: tuple[int, ...], in_lanes: bool) -> None:
        self._model, self._times, self._leading = model, times, leading
        self.function: Callable[..., Any] | None = None
        self._not_finite: list[tuple[float, float]] = []
        """(time, what a function returned) that is no number."""
        self.numbers: dict[str, Any] = dict.fromkeys(("given", "position", "velocity", "acceleration", "stiffness", "damping", "limit", "driven", "function"))
        self.numbers |= {"gravity": False, "computed_torque": False}
        if isinstance(efforts, (PD, GravityCompensation, ComputedTorque)):
            self._control(efforts)
        elif callable(efforts):
            self.function = self.numbers["function"] = self._called(efforts, in_lanes)
        elif efforts is not None:
            self.numbers["given"] = over_time(efforts, times, leading, model.nv, "efforts")

    def first_not_finite(self, begin: float) -> str:
        """What a function of the user returned from a time on that is no number, in words; empty: nothing."""
        late = [one for one in self._not_finite if one[0] >= begin]
        if not late:
            return ""
        t, number = min(late, key=lambda one: one[0])
        return f"efforts returned {number} at t = {t:.9g} s"

    def _control(self, controller: Any) -> None:
        driven = self._driven()
        n = self.numbers
        n["driven"] = driven
        n["damping"] = coordinates(self._model, controller.damping, "damping", driven, FINITE)
        if controller.limit is not None:
            n["limit"] = coordinates(self._model, controller.limit, "limit", driven, LIMIT, np.inf)
        if isinstance(controller, GravityCompensation):
            n["gravity"] = True
            held = Reference(self._times[:1], self._model.neutral()[np.newaxis])  # only its velocity counts: zero
            n["position"] = self._rows(held.times, held.q, self._model.nq, "reference.q")
            return
        n["stiffness"] = coordinates(self._model, controller.stiffness, "stiffness", driven, FINITE)
        self._follow(controller.reference)
        if controller.feed_forward is not None:
            n["given"] = self._feed_forward(controller.feed_forward)
        n["computed_torque"] = isinstance(controller, ComputedTorque)
        n["gravity"] = isinstance(controller, PD) and given.flag(controller.gravity, "gravity")

    def _driven(self) -> list[int]:
        """Coordinates with a drive: those of the model's drives, or all but those of floating joints."""
        model = self._model
        joints = [joint for joint in model.joints if joint.nv and joint.leader is None and joint.kind != "floating"]
        if model.drives:
            joints = [joint for joint in joints if joint.name in model.drives]
        return [joint.v_index + k for joint in joints for k in range(joint.nv)]

    def _follow(self, reference: Any) -> None:
        n, model = self.numbers, self._model
        if not isinstance(reference, Reference):
            position = np.asarray(real_array(reference, "reference"), dtype=float)
            if position.shape not in ((model.nq,), (*self._leading, model.nq)):
                raise ValueError(f"reference has shape {position.shape}; expected a position ({model.nq},), or a ksl.simulation.Reference")
            reference = Reference(self._times[:1], position[..., np.newaxis, :])
        n["position"] = self._rows(reference.times, reference.q, model.nq, "reference.q")
        for name, rows in (("velocity", reference.v), ("acceleration", reference.a)):
            if rows is not None:
                n[name] = self._rows(reference.times, rows, model.nv, f"reference.{name[0]}")

    def _rows(self, times: ArrayLike, rows: ArrayLike, columns: int, what: str) -> OverTime:
        instants = np.asarray(real_array(times, "reference.times"), dtype=float, order="C")
        if instants.ndim != 1 or not len(instants) or not np.isfinite(instants).all() or (np.diff(instants) <= 0).any():
            raise ValueError("reference.times must be finite and increase")
        array = np.asarray(real_array(rows, what), dtype=float)
        shape = (len(instants), columns)
        if array.ndim < 2 or array.shape[-2:] != shape or array.shape[:-2] not in ((), self._leading):
            raise ValueError(f"{what} has shape {array.shape}; expected {shape}, a row for each time")
        if not np.isfinite(array).all():
            raise ValueError(f"{what} holds numbers that are not finite")
        return instants, np.ascontiguousarray(array.reshape(math.prod(array.shape[:-2]), *shape))

    def _feed_forward(self, feed: Any) -> OverTime:
        if isinstance(feed, tuple) and len(feed) == 2:
            return self._rows(feed[0], feed[1], self._model.nv, "feed_forward")
        return over_time(feed, self._times, self._leading, self._model.nv, "feed_forward")

    def _called(self, function: Callable[..., Any], in_lanes: bool) -> Callable[[int, float, Array, Array], Array | None]:
        """A function of the user, as the compiled call wants it."""
        leading, nq, nv = self._leading if in_lanes else (), self._model.nq, self._model.nv

        def efforts(run: int, t: float, q: Array, v: Array) -> Array | None:
            found = function(t, q.reshape(*leading, nq), v.reshape(*leading, nv))
            if found is None:
                return None
            array = np.asarray(real_array(found, "the result of efforts"), dtype=float)
            if array.shape not in ((nv,), (*leading, nv)):
                raise ValueError(f"efforts returned shape {array.shape} at t = {t:.9g} s; expected {(*leading, nv)}")
            if not np.isfinite(array).all():  # a step that is too long may be the reason: it will be tried again
                self._not_finite.append((t, float(array[~np.isfinite(array)][0])))
                if t == self._times[0]:
                    raise ValueError(f"{self.first_not_finite(t)}, where the run begins; expected finite numbers")
            return np.ascontiguousarray(np.broadcast_to(array, (*leading, nv)).reshape(len(q), nv))

        return efforts
