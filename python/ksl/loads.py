"""Every wrench along a motion: the table, the curves, the power balance.  `ksl loads` writes these results."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from ksl._core import __version__
from ksl.calls import Calls
from ksl.errors import MotionError
from ksl.mechanism import Joint, Mechanism
from ksl.motion import METRES, SPLINE_SAMPLES, Motion, columns_of, complete, derivative
from ksl.quantities import EFFORT_PARTS, JointLoads, PowerBalance, joint_loads, power_round_off, unit
from ksl.states import Array, Order, Point, Side, items_of

if TYPE_CHECKING:
    import pyarrow as pa

BLOCK_ROWS = 1 << 17
"""Rows of the table that are computed and written at a time."""

COMPONENTS = {"lin_ang": ("fx", "fy", "fz", "tx", "ty", "tz"), "ang_lin": ("tx", "ty", "tz", "fx", "fy", "fz")}


@dataclass(frozen=True)
class Placement:
    """Side, point, axes and order of the wrenches; see `Model.reactions`."""

    on: Side = "child"
    at: Point = "joint"
    axes: str = "joint"
    order: Order = "lin_ang"

    @property
    def point(self) -> str:
        """The point in one word or three numbers."""
        return self.at if isinstance(self.at, str) else "joint + " + " ".join(f"{x:g}" for x in self.at)

    @property
    def about(self) -> str:
        """The point as people read it."""
        if not isinstance(self.at, str):
            return f"the point ({', '.join(f'{x:g}' for x in self.at)}) m from the joint's origin, in its axes"
        return {"joint": "the joint's origin", "world": "the world's origin"}.get(self.at, f"the origin of {self.at}")


@dataclass(frozen=True)
class LoadCase:
    """A motion of a model, with the wrenches that the environment exerts on its links: {link: (n, 6)}."""

    model: Calls
    motion: Motion
    placement: Placement = Placement()
    external: Mapping[str, Array] = field(default_factory=dict)

    def blocks(self) -> Iterator[Block]:
        """All samples in order, in blocks of about BLOCK_ROWS rows of the table."""
        samples = max(1, BLOCK_ROWS // len(self.model.joints))
        for start in range(0, len(self.motion.time), samples):
            yield self._block(slice(start, start + samples))

    def _block(self, rows: slice) -> Block:
        p, names = self.placement, [j.name for j in self.model.joints]
        request = self.model._request
        wanted = [request(p.on, p.at, p.axes, p.order, part, names) for part in ("total", "constraint")]
        if p.axes != "joint" or p.order != "lin_ang":
            wanted.append(request(p.on, p.at, "joint", "lin_ang", "total", names))
        if self.model.follower_names:
            wanted.append(request("child", "joint", "joint", "lin_ang", "coupling", self.model.follower_names))
        external = {link: w[rows] for link, w in self.external.items()}
        m = self.motion
        tau, *wrenches = self.model._with_reactions(m.q[rows], m.v[rows], m.a[rows], external, tuple(wanted))
        coupling = self._coupling(wrenches.pop()) if self.model.follower_names else np.empty((len(m.time[rows]), 0))
        parts = self.model.effort_parts(m.q[rows], m.v[rows], m.a[rows], external) if self.model.physics else None
        return Block(rows, m.time[rows], m.v[rows], tau, wrenches[0], wrenches[1], wrenches[-1] if len(wrenches) > 2 else wrenches[0], coupling, parts)

    def _coupling(self, wrenches: Array) -> Array:
        """Efforts (n, followers) from the coupling part (n, followers, 6) of their wrenches, which is h* Sᵀ f."""
        followers = [self.model.joint(name) for name in self.model.follower_names]
        along = [wrenches[:, i, 3:] if j.has_angle else wrenches[:, i, :3] for i, j in enumerate(followers)]
        return np.column_stack([x @ np.array(j.axis) for x, j in zip(along, followers, strict=True)])


@dataclass(frozen=True)
class Block:
    """Results for some samples, with joints in the order of `Model.joints`."""

    rows: slice
    time: Array
    v: Array
    tau: Array
    total: Array
    """(n, joints, 6), expressed as the placement says."""
    constraint: Array
    in_joint_axes: Array
    """The total at the placement's point and side, but in the joint's axes, linear first."""
    coupling: Array
    """(n, followers): the effort of the coupling of each mimic joint, N m or N, in the order of `Model.follower_names`."""
    parts: Array | None
    """(n, 5, nv): what `tau` consists of, in the order of `EFFORT_PARTS`; None for models without physics of joints."""


class TableWriter:
    """Converts blocks to columns of the table, with a row for each sample and joint."""

    def __init__(self, model: Mechanism, placement: Placement) -> None:
        import pyarrow as pa

        self._pa, self._placement = pa, placement
        self._joints = model.joints
        self._driven = np.array([j.one_coordinate and j.leader is None for j in model.joints])
        self._follows = np.array([j.leader is not None for j in model.joints])
        self._v_index = np.array([j.v_index for j in model.joints])[self._driven]
        self._following = [j for j in model.joints if j.leader is not None]
        self._mechanism = model
        names, parts = COMPONENTS[placement.order], EFFORT_PARTS if model.physics else ()
        numbers = ["time", *names, *(f"constraint_{c}" for c in names), "effort", "speed", "power", *(["coupling"] if self._following else []), *parts]
        words = pa.dictionary(pa.int16(), pa.string())
        self.schema = pa.schema(
            [pa.field("time", pa.float64()), pa.field("joint", words)]
            + [pa.field(n, pa.float64()) for n in numbers[1:]]
            + [pa.field(n, words) for n in ("on", "at", "axes")],
            metadata={"ksl": json.dumps(self._description(model))},
        )

    def _description(self, model: Mechanism) -> dict[str, str]:
        p = self._placement
        effort = "motor effort of the joint's drive, the sum of its parts" if model.physics else "transmitted effort of the joint's drive"
        return {
            "version": __version__,
            "robot": model.name,
            "wrench": f"exerted on the {p.on} side through the joint, about the point `at`, in the axes `axes`",
            "on": p.on,
            "at": p.point,
            "axes": p.axes,
            "order": p.order,
            "effort": f"{effort}, the same for every `on`, `at` and `axes`",
            **({"physics": ", ".join(model.physics)} if model.physics else {}),
            **({"coupling": "effort by which its leader moves a mimic joint, which has no drive"} if self._following else {}),
            "units": "s, N, N m; effort N m or N, speed rad/s or m/s, power W",
        }

    def table(self, block: Block) -> pa.Table:
        """One block as a table; samples in order, and in each the joints in order."""
        pa, n, joints = self._pa, len(block.time), len(self._joints)
        columns = [pa.array(np.repeat(block.time, joints)), self._words([j.name for j in self._joints], np.tile(np.arange(joints, dtype=np.int16), n))]
        for wrench in (block.total, block.constraint):
            columns += [pa.array(np.ascontiguousarray(wrench[:, :, i]).reshape(-1)) for i in range(6)]
        effort, speed = block.tau[:, self._v_index], block.v[:, self._v_index]
        speeds = np.empty((n, joints))
        speeds[:, self._driven] = speed
        if self._following:
            speeds[:, self._follows] = np.column_stack([self._mechanism._velocity_of(j, block.v) for j in self._following])
        moving = self._driven | self._follows
        columns += [self._of(self._driven, effort), self._of(moving, speeds[:, moving]), self._of(self._driven, effort * speed)]
        columns += [self._of(self._follows, block.coupling)] if self._following else []
        if block.parts is not None:
            columns += [self._of(self._driven, block.parts[:, i, self._v_index]) for i in range(len(EFFORT_PARTS))]
        columns += [self._words([w], np.zeros(n * joints, dtype=np.int16)) for w in (self._placement.on, self._placement.point, self._placement.axes)]
        return pa.Table.from_arrays(columns, schema=self.schema)

    def _of(self, chosen: Array, x: Array) -> pa.Array:
        """Values of the chosen joints; the others have none."""
        n, joints = len(x), len(self._joints)
        values, absent = np.zeros((n, joints)), np.ones((n, joints), dtype=bool)
        values[:, chosen], absent[:, chosen] = x, False
        return self._pa.array(values.reshape(-1), mask=absent.reshape(-1))

    def _words(self, words: list[str], indices: np.ndarray) -> pa.DictionaryArray:
        return self._pa.DictionaryArray.from_arrays(self._pa.array(indices), self._pa.array(words))


@dataclass
class Curves:
    """Collects from blocks the curves of the summary and the report.  The wrenches themselves are not kept."""

    case: LoadCase
    loads: list[JointLoads] = field(default_factory=list)

    def __post_init__(self) -> None:
        n = len(self.case.motion.time)
        self._drive, self._largest_effort = np.empty(n), 0.0
        self._dissipation = np.empty(n) if self.case.model.physics else None
        model, motion = self.case.model, self.case.motion
        for joint in model.joints:
            empty = joint_loads(joint, np.empty((0, 6)), None, None)
            speed = model._velocity_of(joint, motion.v) if joint.one_coordinate else None
            effort = np.empty(n) if joint.one_coordinate and joint.leader is None else None
            coupling = np.empty(n) if joint.leader is not None else None
            parts: dict[str, Array] = {name: np.empty(n) for name in EFFORT_PARTS} if model.physics and effort is not None else {}
            self.loads.append(JointLoads(joint, {name: np.empty(n) for name in empty.wrench}, speed, effort, coupling, parts))

    def add(self, block: Block) -> None:
        """Adds the samples `block.rows`; each sample must be added once, in any order."""
        followers = {name: i for i, name in enumerate(self.case.model.follower_names)}
        for i, collected in enumerate(self.loads):
            part = joint_loads(collected.joint, block.in_joint_axes[:, i], None, None)
            for name, x in part.wrench.items():
                collected.wrench[name][block.rows] = x
            if collected.effort is not None:
                collected.effort[block.rows] = block.tau[:, collected.joint.v_index]
            if collected.coupling is not None:
                collected.coupling[block.rows] = block.coupling[:, followers[collected.joint.name]]
            if block.parts is not None:
                for k, part_of_effort in enumerate(collected.parts.values()):
                    part_of_effort[block.rows] = block.parts[:, k, collected.joint.v_index]
        self._drive[block.rows] = np.sum(block.tau * block.v, axis=1)
        if self._dissipation is not None and block.parts is not None:
            self._dissipation[block.rows] = np.sum((block.parts[:, 1] + block.parts[:, 2]) * block.v, axis=1)
        self._largest_effort = max(self._largest_effort, float(np.max(np.abs(block.tau), initial=0.0)))

    def power_balance(self) -> PowerBalance | None:
        """The power balance, after all blocks; None if there are too few samples to differentiate the energy."""
        motion, external = self.case.motion, self.case.external
        if len(motion.time) < SPLINE_SAMPLES:
            return None
        kinetic, potential = self.case.model.energy(motion.q, motion.v)
        energy = kinetic + potential
        supplied = self.case.model.external_power(motion.q, motion.v, external) if external else np.zeros(len(motion.time))
        round_off = power_round_off(motion.time, energy, motion.q, self._largest_effort)
        return PowerBalance(self._drive, supplied, energy, derivative(motion.time, energy), round_off, self._dissipation)


def wrench_table(
    model: Calls,
    time: ArrayLike,
    q: ArrayLike,
    v: ArrayLike | None = None,
    a: ArrayLike | None = None,
    *,
    external: Mapping[str, ArrayLike] | None = None,
    on: Side = "child",
    at: Point = "joint",
    axes: str = "joint",
    order: Order = "lin_ang",
) -> pa.Table:
    """Every wrench along a motion: a row for each sample and joint, fixed joints and `base` included.

    time (n), increasing, s; q (n, nq); v, a (n, nv), differentiated from a quintic spline where they are missing (at
    least 6 samples).  external: {link: (n, 6), or (6) for all samples}.  on, at, axes, order: as in `Model.reactions`.
    Columns: time, joint, fx fy fz tx ty tz of the total and constraint_fx … of the constraint part (N, N m); effort,
    speed, power of the drives of joints with one coordinate, the same for every on, at and axes; on, at, axes.  Robots with
    mimic joints have a column `coupling` before these three: the effort by which its leader moves a mimic joint, which has no
    drive.  Models with physics of joints have the parts of the effort there: transmitted, damping, friction, rotor, spring.
    Raises MotionError.
    """
    import pyarrow as pa

    t, positions = _real("time", time), _real("q", q)
    given = [None if x is None else _real(name, x) for name, x in (("v", v), ("a", a))]
    if t.ndim != 1 or positions.shape != (len(t), model.nq) or any(x is not None and x.shape != (len(t), model.nv) for x in given):
        shapes = [None if x is None else x.shape for x in given]
        found = f"time {t.shape}, q {positions.shape}, v {shapes[0]}, a {shapes[1]}"
        raise MotionError(f"shapes don't fit: {found}; expected (n), (n, {model.nq}), (n, {model.nv}), (n, {model.nv})")
    if not all(np.isfinite(x).all() for x in (t, positions, *given) if x is not None):
        raise MotionError("time, q, v and a must be finite")
    if (np.diff(t) <= 0).any():
        raise MotionError("times must increase: sort the samples and remove repeated ones")
    joints = model.joints[: len(model.joint_names)]
    by_joint = [[None if x is None else x[:, j.v_index : j.v_index + j.nv] for x in given] for j in joints]
    motion = complete(model, t, positions, by_joint)
    wrenches = {link: _wrenches(link, w, len(t)) for link, w in items_of(external)}
    case = LoadCase(model, motion, Placement(on, at, axes, order), wrenches)
    writer = TableWriter(model, case.placement)
    return pa.concat_tables([writer.table(block) for block in case.blocks()])


def _real(name: str, x: ArrayLike) -> Array:
    """Converts numbers to float64.  Complex ones are refused, since their imaginary part would be lost."""
    try:
        given = np.asarray(x)
        if given.dtype.kind != "c":
            return np.asarray(given, dtype=float)
    except (TypeError, ValueError) as error:
        raise MotionError(f"{name}: {error}; expected an array of numbers") from None
    raise MotionError(f"{name} is complex ({given.dtype}); expected real numbers: .real takes the real parts")


def _wrenches(link: str, w: ArrayLike, samples: int) -> Array:
    """Converts to (n, 6); one wrench may be given for all samples."""
    given = _real(f"external[{link!r}]", w)
    if given.shape not in ((6,), (1, 6), (samples, 6)):
        raise MotionError(f"external[{link!r}] has shape {given.shape}; expected ({samples}, 6), a wrench for each sample, or (6): force, then moment")
    if not np.isfinite(given).all():
        raise MotionError(f"external[{link!r}] must be finite")
    return np.broadcast_to(given, (samples, 6))


def exceeded_limits(model: Mechanism, motion: Motion, loads: list[JointLoads]) -> list[str]:
    """A line for each limit of the file that the motion exceeds."""
    lines = []
    for l in loads:
        j = l.joint
        if len(j.limits) > 1:
            for c, (column, (lower, upper)) in enumerate(zip(columns_of(j)[0], j.limits, strict=True)):
                x, of = motion.q[:, j.q_index + c], column.rpartition(".")[2]
                m_or_rad = "m" if of in METRES else "rad"
                lines += _exceeded(j, of, "lower", float(x.min()), lower, m_or_rad, lambda x, limit: x < limit)
                lines += _exceeded(j, of, "upper", float(x.max()), upper, m_or_rad, lambda x, limit: x > limit)
        if not j.one_coordinate or l.speed is None:
            continue
        q = model._position_of(j, motion.q)
        if j.has_limits:
            lines += _exceeded(j, "position", "lower", float(q.min()), j.lower, j.unit, lambda x, limit: x < limit)
            lines += _exceeded(j, "position", "upper", float(q.max()), j.upper, j.unit, lambda x, limit: x > limit)
        lines += _exceeded(j, "speed", "velocity", float(np.abs(l.speed).max()), j.velocity, unit("speed", j), lambda x, limit: x > limit)
        if l.effort is not None:
            lines += _exceeded(j, "effort", "effort", float(np.abs(l.effort).max()), j.effort, unit("effort", j), lambda x, limit: x > limit)
    return lines


def _exceeded(joint: Joint, what: str, which: str, value: float, limit: float | None, unit: str, beyond: Callable[[float, float], bool]) -> list[str]:
    if limit is None or not beyond(value, limit):
        return []
    return [f"{joint.name}: {what} {value:.4g} {unit} is beyond the {which} limit {limit:.4g} {unit}"]
