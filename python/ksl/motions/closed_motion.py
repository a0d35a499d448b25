"""Motions of mechanisms with loops: the columns of the drives are enough, and the other joints follow."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Collection, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ksl.base.errors import MotionError
from ksl.base.words import count, listed
from ksl.mechanism.calls import Calls
from ksl.mechanism.freedoms import are_enough, freedoms_to_drive, idle_bodies, leads
from ksl.mechanism.loops import TOLERANCES, length_of
from ksl.mechanism.mechanism import Joint, Mechanism
from ksl.mechanism.joint_kinds import columns_of, slides, units_of
from ksl.mechanism.states import Array
from ksl.motions.closing import Closing, Held, NotClosed, closed_along, closed_side_by_side, determining, first_closed, home, left_moving, searched_home
from ksl.motions.motion import CONTRADICTION, Motion, complete
from ksl.motions.signal.quality import Samples

TOLD, DOUBTED = TOLERANCES["accepted"], 1e-2
"""Positions that were given for joints that follow are told to differ from this on, rad, or lengths of the mechanism; and doubted from this on."""
OPENED = 1e-9
"""Rates that open a loop by more than this share of the terms of its equation belong to its motion."""
BLOCK = 1024
"""Samples whose Jacobians are in memory at a time."""
DEAD = 1e-5
"""At a dead point: the smallest singular value of what the joints that follow do to the loops, beside the largest.  Positions are closed to 1e-12
of the mechanism's length, so that their distances from the dead point err by 1e-12 / DEAD², a hundredth, there."""
JUMP = 0.2
"""A joint that follows has changed its branch if it moves by this much more in a step than its rates say, rad, or lengths of the mechanism."""


def moving_joints(model: Mechanism) -> tuple[Joint, ...]:
    return model.joints[: len(model.joint_names)]


def leading(model: Mechanism) -> tuple[Joint, ...]:
    """The joints whose positions a motion must give: all of a tree, and of a closed mechanism its drives and what floats freely; all where drives aren't known."""
    joints = moving_joints(model)
    if not model.loops or model.drives is None:
        return joints
    return tuple(j for j in joints if leads(model, j))


def check_drives(model: Mechanism, name: str) -> None:
    """Raises MotionError for a closed mechanism of which nobody says which joints have motors."""
    if model.loops and model.drives is None:
        raise MotionError(
            f"{name}: {model.name} has loops, and doesn't say which joints have motors; name them: --drives (drives= in Python), "
            f"from among {', '.join(model.joint_names)}"
        )


def follow_by_loops(model: Mechanism, there: Collection[str] = ()) -> NDArray[np.intp]:
    """Columns of q of the joints that follow the leading ones; none of a tree.  there: names of the columns that are given."""
    lead = leading(model)
    given = [j for j in lead if all(column in there for column in columns_of(j)[0])]
    if model.loops and len(given) < len(lead) and are_enough(model, given):
        lead = tuple(given)
    return np.array([j.q_index + k for j in moving_joints(model) if j not in lead for k in range(j.nq)], dtype=np.intp)


def keeps_closed(model: Calls, q: Array, rates: Array, chosen: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """The chosen samples (n, nv) whose rates, velocities or accelerations (n, nv), can be taken as none: without them the loops stay closed."""
    out = chosen.copy()
    if not model.loops:
        return out
    some = np.flatnonzero((chosen & (rates != 0)).any(axis=1))
    for first in range(0, len(some), BLOCK):
        k = some[first : first + BLOCK]
        terms = model.loop_jacobian(q[k]) * rates[k][:, None, :]
        while True:
            left = np.where(out[k][:, None, :], terms, 0.0)
            opened = np.abs(left.sum(axis=2)) > OPENED * np.abs(terms).sum(axis=2)
            if not opened.any():
                break
            out[k] &= ~((left != 0) & opened[:, :, None]).any(axis=1)
    return out


def held_by(model: Calls, name: str = "motion", known: NDArray[np.bool_] | None = None) -> Held:
    """The joints of a closed mechanism that are held where a motion says: of the leading ones those that others don't follow from.

    known: for each column of q whether it was given; where drives are more than the freedoms, those that were come first.
    Raises MotionError where they leave freedoms.
    """
    drives = model.drives or ()
    lead = sorted(leading(model), key=lambda j: (not _is_known(j, known), j.kind != "floating", drives.index(j.name) if j.name in drives else 0))
    try:
        start = home(model, [j.name for j in lead] if model.drives is not None else ())
    except NotClosed as e:
        raise MotionError(f"{name}: {e.why}") from None
    free = freedoms_to_drive(model)
    if sum(j.nv for j in lead) > free:
        chosen = determining(model, start, lead)
        absent = [j.name for j in chosen if not _is_known(j, known)]
        if absent:
            given = listed([j.name for j in lead if _is_known(j, known)])
            raise MotionError(f"{name}: the columns of {given} don't say where the mechanism is; add those of {listed(absent)}")
        if sum(j.nv for j in chosen) == free:
            return Held(model, chosen)
    if sum(j.nv for j in lead) < free:
        raise MotionError(f"{name}: {_too_few(model, lead, start, free)}")
    return Held(model, tuple(lead))


def _is_known(joint: Joint, known: NDArray[np.bool_] | None) -> bool:
    return known is None or bool(known[joint.q_index : joint.q_index + joint.nq].all())


def _too_few(model: Calls, lead: list[Joint], q: Array, free: int) -> str:
    """What is said of a mechanism whose leading joints leave freedoms: how many, and which joints still move at a closed position q (nq)."""
    left = free - sum(j.nv for j in lead)
    named = f"drives {', '.join(model.drives)}" if model.drives else "no drives"
    moving = [j for j in left_moving(model, q, lead) if j.kind != "floating"]
    idle = any(joint.kind == "spherical" for joint in moving)
    return (
        f"the mechanism has {count(free, 'freedom')}, and {named} leave {left} of {'it' if free == 1 else 'them'} open; "
        f"name more: --drives (drives= in Python), from among {', '.join(j.name for j in moving)}"
        f"{'. A rod that turns about itself between two spherical joints needs none if its mass is the same all round its line; otherwise a universal joint at one end' if idle else ''}"
    )


def completed(
    model: Mechanism, time: Array, q: Array, given: list[list[Array | None]], known: NDArray[np.bool_], name: str = "motion",
    place: Callable[[int], str] | None = None, smooth: float | None = None, measured: Samples | None = None,
) -> Motion:  # fmt: skip
    """The motion, as :func:`complete` makes it; of a closed mechanism with all joints where those that are given say.

    known: for each column of q whether it was given.  Columns of joints that lead must be; others are compared with those that follow.
    """
    if not (model.loops and isinstance(model, Calls)):
        return complete(model, time, q, given, name, place, smooth, measured)
    follower = Follower(model, time, q, known, name, None if place is None else lambda k: f"{place(k)} (time {time[k]:.9g})")
    measured = Samples(measured.time, *follower.without_others(measured.q, measured.given)) if measured else None
    found = complete(model, time, *follower.without_others(q, given), name, place, smooth, measured, follower)
    return follower.motion(found)


def closed_again(model: Mechanism, motion: Motion, q: Array) -> Array:
    """Positions near those of a motion, with the held joints as in q (n, nq); of a tree they are q."""
    if motion.closing is None or not isinstance(model, Calls):
        return q
    held = Held(model, tuple(model.joint(name) for name in motion.closing.held))
    return model.close(held.put(motion.q, q), hold=held.names, starts=1).q


def followed(model: Mechanism, closing: Closing, first: Array, motion: tuple[Array, Array, Array]) -> tuple[Array, Array, Array]:
    """q, v and a, each (m, n, …), of m motions from closed positions `first` (m, nq), with the held joints as in `motion`.

    Raises NotClosed, with the number of the first motion for which no closed positions were found.
    """
    assert isinstance(model, Calls)  # it has made that closing
    held = Held(model, tuple(model.joint(name) for name in closing.held))
    q, found = closed_side_by_side(held, motion[0], first)
    if not found.all():
        k, sample = np.argwhere(~found)[0]
        raise NotClosed(
            int(k),
            f"with {held.said(motion[0][k, sample])} no closed position is found near that of the sample before; it may be out of reach, or beyond a singular position",
        )
    v = model.consistent_velocity(q, motion[1], held.names)
    return q, v, model.consistent_acceleration(q, v, motion[2], held.names)


def closed(model: Mechanism, motion: Motion, where: Callable[[int], str] | None = None) -> Motion:
    """A motion that was made for the joints that lead, with those that follow; of a tree it is the same.

    where: a sample in words.  Raises MotionError.
    """
    if not (model.loops and isinstance(model, Calls)):
        return motion
    follower = Follower(model, motion.time, motion.q, np.zeros(model.nq, dtype=bool), "motion", where)
    follower.remedy = _allowed(follower.held)
    q, v, a = follower(motion.q, motion.v, motion.a)
    return follower.motion(replace(motion, q=q, v=v, a=a))


def _allowed(held: Held) -> str:
    """What to do where a motion that keeps to the limits of these joints has no closed position that is found."""
    limits = [f"{j.name} {_range(j)}" for j in held.joints if j.one_coordinate and j.has_limits]
    return (
        f"; the limits allow {', '.join(limits)}, which may be more than can be reached: choose narrower waypoints or limits"
        if limits
        else "; choose narrower waypoints"
    )


def _range(joint: Joint) -> str:
    ends = [f"{word} {bound:.6g}" for word, bound in (("from", joint.lower), ("to", joint.upper)) if bound is not None]
    return f"{' '.join(ends)} {joint.unit}"


class Follower:
    """Makes the motion of a closed mechanism from that of the joints that are held."""

    def __init__(self, model: Calls, time: Array, q: Array, known: NDArray[np.bool_], name: str, where: Callable[[int], str] | None) -> None:
        """where: a sample in words, with its time."""
        self._model, self._time, self._given, self._known = model, time, q, known
        self.held = held_by(model, name, known if known.any() else None)
        self._others = [j for j in moving_joints(model) if j not in self.held.joints]
        self._where = where or (lambda k: f"{name}: sample {k + 1} (time {time[k]:.9g})")
        self.remedy = ""
        """What to do where no closed position is found, the end of a sentence."""
        self._length: float
        self._rates: dict[str, Array] = {}
        self._searched: int

    def without_others(self, q: Array, given: list[list[Array | None]]) -> tuple[Array, list[list[Array | None]]]:
        """Positions and rates in which joints that follow stand still: nothing of them is differentiated, smoothed or doubted."""
        q, neutral = np.array(q), self._model.neutral()
        names = self.held.names
        joints = moving_joints(self._model)
        self._rates = {j.name: rates[0] for j, rates in zip(joints, given, strict=True) if j.name not in names and rates[0] is not None}
        for joint in self._others:
            part = slice(joint.q_index, joint.q_index + joint.nq)
            q[:, part] = neutral[part]
        return q, [rates if j.name in names else [np.zeros((len(q), j.nv))] * 2 for j, rates in zip(joints, given, strict=True)]

    def __call__(self, q: Array, v: Array, a: Array) -> tuple[Array, Array, Array]:
        """The motion of all joints from that of the held ones."""
        positions = self._closed(q)
        self._length = length_of(self._model)
        self._check_determined(positions)
        velocities = self._consistent(positions, lambda rows: self._model.consistent_velocity(positions[rows], v[rows], self.held.names), "velocities")
        rates = self._consistent(
            positions, lambda rows: self._model.consistent_acceleration(positions[rows], velocities[rows], a[rows], self.held.names), "accelerations"
        )
        self._check_branch(positions, velocities)
        return positions, velocities, rates

    def _closed(self, q: Array) -> Array:
        start = self._given[0] if self._known.all() else None
        try:
            self._searched = 0 if start is not None else searched_home(self._model, self.held.names)[1]
            first = first_closed(self.held, q[0], start)
            return closed_along(self.held, q, first)
        except NotClosed as e:
            raise MotionError(f"{self._where(e.row)}: {e.why}{self.remedy}") from None

    def _consistent(self, q: Array, rates: Callable[[slice], Array], what: str) -> Array:
        """Rates of all samples at once; where that fails, the sample is looked for."""
        with warnings.catch_warnings():
            warnings.simplefilter("error", UserWarning)
            try:
                return rates(slice(None))
            except (ValueError, UserWarning):
                for k in range(len(q)):
                    try:
                        rates(slice(k, k + 1))
                    except (ValueError, UserWarning):
                        raise self._at_a_dead_point(k, q[k], what) from None
                raise

    def _at_a_dead_point(self, k: int, q: Array, what: str) -> MotionError:
        return MotionError(
            f"{self._where(k)}: {what} of the other joints don't follow from those of "
            f"{', '.join(self.held.names)}: with {self.held.said(q)} the mechanism is at a singular position, a dead point say"
        )

    def _check_determined(self, q: Array) -> None:
        """Refuses positions so near to a dead point that those of the joints that follow have no digits there."""
        others, idle = np.setdiff1d(np.arange(self._model.nv), self.held.rates), idle_bodies(self._model)
        for first in range(0, len(q) if len(others) else 0, BLOCK):
            J = self._model.loop_jacobian(q[first : first + BLOCK])[:, :, others] * self._lengths()[:, None]
            size = np.sqrt(np.square(J).sum(axis=1)).max(axis=0)
            alike = J / np.where(size > 0, size, 1.0)
            values = np.linalg.eigvalsh(np.swapaxes(alike, 1, 2) @ alike)  # squares of singular values
            dead = np.flatnonzero(values[:, idle] <= DEAD**2 * values[:, -1])
            if len(dead):
                k = first + int(dead[0])
                raise self._at_a_dead_point(k, q[k], "positions and rates")

    def _check_branch(self, q: Array, v: Array) -> None:
        """Refuses positions that have changed the branch from one sample to the next: the drives passed a singular position between them."""
        if len(q) < 2:
            return
        moved = self._model.difference(q[:-1], q[1:])
        expected = (v[1:] + v[:-1]) / 2 * np.diff(self._time)[:, None]
        for joint in self._others:
            columns = slice(joint.v_index, joint.v_index + joint.nv)
            off = self._shares(joint, moved[:, columns] - expected[:, columns])
            # where the rates alone change by as much in a step, the samples are too far apart to tell
            bad = np.flatnonzero(off > JUMP + self._shares(joint, np.diff(v[:, columns], axis=0)) * np.diff(self._time))
            if len(bad):
                k = int(bad[0]) + 1
                raise MotionError(
                    f"{self._where(k)}: joint {joint.name}, which follows {', '.join(self.held.names)}, jumps to another branch; "
                    "the mechanism passes a singular position there, or samples are too far apart: give more samples"
                )

    def motion(self, found: Motion) -> Motion:
        """With what is known of the joints that follow."""
        model, held = self._model, self.held
        stands, still = (None if x is None else self._of_all(x) for x in (found.stands, found.held))
        raw = found.raw_q
        if raw is not None:  # there is nothing that was smoothed
            raw = held.put(found.q, raw)
        errors = self._errors(found.q)
        k = int(np.argmax(errors))
        compared, doubts = self._compared(found.q)
        doubts += self._other_rates(found.v)
        closing = Closing(tuple(held.names), float(errors[k]), float(self._time[k]), tuple(compared), sum(j.nv for j in held.joints))
        notes = [_followed(self._others, held), *compared]
        if self._searched:
            notes.append(
                f"the neutral position does not lead to a closed one: a search found {count(self._searched, 'assembly').replace('assemblys', 'assemblies')}, and the nearest "
                "was taken; give the columns of all joints to say which is meant"
            )
        resolution = found.resolution
        if resolution is not None:
            resolution = np.where(np.isin(np.arange(model.nv), held.rates), resolution, 0.0)
        return replace(
            found, raw_q=raw, stands=stands, held=still, closing=closing, differentiated=[*found.differentiated, *notes],
            contradictions=[*found.contradictions, *doubts], resolution=resolution,
        )  # fmt: skip

    def _of_all(self, chosen: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Joints that follow stand where all do that they follow."""
        out, rates = chosen.copy(), self.held.rates
        others = np.setdiff1d(np.arange(self._model.nv), rates)
        out[:, others] = np.all(chosen[:, rates], axis=1, keepdims=True)
        return out

    def _lengths(self) -> Array:
        """(rows): what makes lengths of errors of the loops' equations."""
        scale = []
        for loop in self._model.loops:
            forces = 3 - slides(loop.kind)  # equations of moments follow
            scale += [1.0] * forces + [self._length] * (loop.equations - forces)
        return np.array(scale)

    def _other_rates(self, v: Array) -> list[str]:
        """A line for each velocity that was given for a joint that follows, and is another one by more than a share of the largest.

        Differences that would not move the joint by DOUBTED in the whole motion are none.
        """
        lines, duration = [], float(self._time[-1] - self._time[0])
        for joint in self._others:
            for i, column in enumerate(columns_of(joint)[1] if joint.name in self._rates else ()):
                given, true = self._rates[joint.name][:, i], v[:, joint.v_index + i]
                off, unit = np.abs(given - true), units_of(joint)[1][i]
                k, length = int(np.argmax(off)), 1.0 if unit == "rad" else self._length
                if off[k] > CONTRADICTION * np.abs([given, true]).max() and off[k] * duration > DOUBTED * length:
                    lines.append(
                        f"{column} at {self._time[k]:.6g} s is {given[k]:.4g} {unit}/s, but the joint follows at {true[k]:.4g} {unit}/s; check the column"
                    )
        return lines

    def _shares(self, joint: Joint, distance: Array) -> Array:
        """(n): the largest of distances (n, nv) of a joint: angles, and lengths as shares of that of the mechanism."""
        scale = [1.0 if unit == "rad" else self._length for unit in units_of(joint)[1]]
        return np.asarray((np.abs(distance) / scale).max(axis=1))

    def _errors(self, q: Array) -> Array:
        """(n): the largest component of the error at each sample, m."""
        return np.asarray(np.abs(self._model.loop_error(q) * self._lengths()).max(axis=1, initial=0.0))

    def _compared(self, q: Array) -> tuple[list[str], list[str]]:
        """Lines about positions that were given for joints that follow; and doubts, where they are far off."""
        lines, doubts = [], []
        same: dict[str, list[tuple[str, float]]] = {}
        for joint in self._others:
            part, rates = slice(joint.q_index, joint.q_index + joint.nq), slice(joint.v_index, joint.v_index + joint.nv)
            if not np.all(self._known[part]):
                continue
            mixed = np.array(q)
            mixed[:, part] = self._given[:, part]
            if joint.quaternion is not None:  # rounded ones are near enough for a comparison
                length = np.linalg.norm(mixed[:, part][:, -4:], axis=1, keepdims=True)
                mixed[:, part][:, -4:] /= np.where(length > 0, length, 1.0)
            off = self._model.difference(q, mixed)[:, rates]
            if joint.one_coordinate and joint.has_angle:
                off = np.remainder(off + math.pi, 2 * math.pi) - math.pi  # a whole turn is none
            shares = self._shares(joint, off)
            k = int(np.argmax(shares))
            share, size, unit = shares[k], np.abs(off).max(axis=1), " or ".join(dict.fromkeys(units_of(joint)[1]))
            line = f"positions of {joint.name} in the motion differ from those that follow by up to {size[k]:.3g} {unit}, at {self._time[k]:.6g} s"
            if share > DOUBTED:
                doubts.append(f"{line}: check dimensions, offsets and the branch; those that follow are used")
            elif share > TOLD:
                lines.append(line)
            else:
                same.setdefault(unit, []).append((joint.name, float(size[k])))
        for unit, found in same.items():
            size_of_all = max(size for _, size in found)
            lines.append(f"positions of {_some([name for name, _ in found])} in the motion are those that follow, within {size_of_all:.1g} {unit}")
        return lines, doubts


def _followed(others: Sequence[Joint], held: Held) -> str:
    """Whose positions were found from those of the held joints, in words."""
    if not held.joints:
        return "the mechanism is rigid: no joint moves, whatever the motion says"
    if not others:
        return f"the loops are closed wherever {', '.join(held.names)} {'is' if len(held.joints) == 1 else 'are'}"
    return f"positions of {_some([j.name for j in others])} closed from those of {', '.join(held.names)}; rates, too"


def _some(names: list[str]) -> str:
    return ", ".join(names[:6]) + (f" and {len(names) - 6} more" if len(names) > 6 else "")
