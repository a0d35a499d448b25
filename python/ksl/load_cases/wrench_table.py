"""Every wrench along a motion, as a table."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ksl.base.errors import MotionError
from ksl.base.extras import require
from ksl.base.finite_results import CHECK_UNITS
from ksl.load_cases.load_case import Block, LoadCase, Placement
from ksl.load_cases.provenance import Provenance, provenance_of
from ksl.load_cases.quantities import UNDETERMINED
from ksl.load_cases.reaction_joints import has_drive, reaction_joints
from ksl.mechanism.calls import Calls
from ksl.mechanism.mechanism import Mechanism
from ksl.mechanism.joint_kinds import columns_of
from ksl.mechanism.states import EFFORT_PARTS, Array, External, Order, Point, Side, items_of
from ksl.motions.closed_motion import check_drives, completed, follow_by_loops
from ksl.motions.motion import Motion
from ksl.motions.signal.ordered import not_increasing

if TYPE_CHECKING:
    import pyarrow as pa

COMPONENTS = {"lin_ang": ("fx", "fy", "fz", "tx", "ty", "tz"), "ang_lin": ("tx", "ty", "tz", "fx", "fy", "fz")}
MOTION = ("position", "speed", "acceleration")


class TableWriter:
    """Converts blocks to columns of the table, with a row for each sample and joint."""

    def __init__(self, model: Mechanism, placement: Placement, provenance: Provenance | None = None) -> None:
        require("a table of wrenches", "pyarrow")
        import pyarrow as pa

        self._pa, self._placement = pa, placement
        cases: list[dict[str, Any]] = provenance.cases if provenance else [{"name": "motion"}]
        self._cases = [str(case["name"]) for case in cases]
        joints = reaction_joints(model)
        self._joints = [j for j in joints if placement.wanted(j.name)]
        self._chosen, self._all = [i for i, j in enumerate(joints) if placement.wanted(j.name)], len(joints)
        self._moving = np.array([j.one_coordinate for j in self._joints])
        self._driven = np.array([has_drive(model, j) for j in self._joints])
        self._follows = np.array([j.leader is not None for j in self._joints])
        self._v_index = np.array([j.v_index for j in self._joints])[self._driven]
        self._following = [model.follower_names.index(j.name) for j in self._joints if j.leader is not None]
        self._with_parts = any(case.get("physics", model.physics) for case in cases)
        self._with_brake = any(case.get("brake") for case in cases)
        self._closed = bool(model.loops)
        names, parts = COMPONENTS[placement.order], EFFORT_PARTS if self._with_parts else ()
        numbers = [*names, *(f"constraint_{c}" for c in names), *MOTION, "effort", "power"]
        numbers += [*(["brake"] if self._with_brake else []), *(["coupling"] if self._following else []), *parts]
        words = pa.dictionary(pa.int16(), pa.string())
        self.schema = pa.schema(
            [pa.field("case", words), pa.field("time", pa.float64()), pa.field("joint", words)]
            + [pa.field(n, pa.float64()) for n in numbers]
            + [pa.field(n, words) for n in ("on", "at", "axes", *([UNDETERMINED] if self._closed else []))],
            metadata={"ksl": json.dumps((provenance.metadata() if provenance else {"robot": model.name}) | self._description(model))},
        )

    def _description(self, model: Mechanism) -> dict[str, str]:
        p = self._placement
        effort = "motor effort of the joint's drive, the sum of its parts" if self._with_parts else "transmitted effort of the joint's drive"
        return {
            "wrench": f"exerted on the {p.on} side through the joint, about the point `at`, in the axes `axes`",
            "on": p.on,
            "at": p.point,
            "axes": p.axes,
            "order": p.order,
            "effort": f"{effort}, the same for every `on`, `at` and `axes`",
            **({"physics": ", ".join(model.physics)} if model.physics else {}),
            **({"brake": "effort that brakes supply at samples where drives don't, whose effort is zero there"} if self._with_brake else {}),
            **(
                {
                    UNDETERMINED: "components that rigid bodies leave open, of the same wrench; their values are those of least norm, or with stiffnesses one of the possible values"
                }
                if self._closed
                else {}
            ),
            **({"coupling": "effort by which its leader moves a mimic joint, which has no drive"} if self._following else {}),
        }

    def table(self, block: Block, case: int = 0) -> pa.Table:
        """One block of a load case, by its number, as a table; samples in order, and in each the joints in order."""
        pa, n, joints = self._pa, len(block.time), len(self._joints)
        columns = {
            "case": self._words(self._cases, np.full(n * joints, case, dtype=np.int16)),
            "time": self._numbers(np.repeat(block.time, joints)),
            "joint": self._words([j.name for j in self._joints], np.tile(np.arange(joints, dtype=np.int16), n)),
        }
        for prefix, wrench in (("", block.total), ("constraint_", block.constraint)):
            chosen = wrench if joints == self._all else wrench[:, self._chosen]
            columns |= {prefix + name: self._numbers(chosen[:, :, i]) for i, name in enumerate(COMPONENTS[self._placement.order])}
        moved = [block.motions.of(j) for j in self._joints if j.one_coordinate]
        for k, name in enumerate(MOTION):
            columns[name] = self._of(self._moving, np.column_stack([of[k] for of in moved]) if moved else np.empty((n, 0)))
        effort, speed = block.tau[:, self._v_index], block.v[:, self._v_index]
        of_drive = block.of_drives(effort)
        with np.errstate(over="ignore"):
            power = of_drive * speed
        if np.isinf(power).any():
            sample, drive = np.argwhere(np.isinf(power))[0]
            joint = [j.name for j, driven in zip(self._joints, self._driven) if driven][drive]
            raise MotionError(
                f"the power of {joint} is not finite at {block.time[sample]:.9g} s: efforts or velocities are too large for double precision; {CHECK_UNITS}"
            )
        columns |= {"effort": self._of(self._driven, of_drive), "power": self._of(self._driven, power)}
        if self._with_brake:
            columns["brake"] = self._of(self._driven, effort, block.braked)
        if self._following:
            columns["coupling"] = self._of(self._follows, block.coupling[:, self._following])
        if block.parts is not None:
            columns |= {name: self._of(self._driven, block.parts[:, i, self._v_index], ~block.braked) for i, name in enumerate(EFFORT_PARTS)}
        elif self._with_parts:
            columns |= dict.fromkeys(EFFORT_PARTS, self._of(np.zeros(joints, dtype=bool), np.empty((n, 0))))
        p = self._placement
        points = list(dict.fromkeys(p.of(j.name) for j in self._joints))
        point_of_row = np.tile(np.array([points.index(p.of(j.name)) for j in self._joints], dtype=np.int16), n)
        same = np.zeros(n * joints, dtype=np.int16)
        columns |= {"on": self._words([p.on], same), "at": self._words(points, point_of_row), "axes": self._words([p.axes], same)}
        if self._closed:
            said = [" ".join(block.undetermined.components.get(j.name, ())) for j in self._joints]
            distinct = list(dict.fromkeys(said))
            columns[UNDETERMINED] = self._words(distinct, np.tile(np.array([distinct.index(x) for x in said], dtype=np.int16), n))
        return pa.Table.from_arrays([columns[name] for name in self.schema.names], schema=self.schema)

    def _of(self, chosen: NDArray[np.bool_], x: Array, rows: NDArray[np.bool_] | None = None) -> pa.Array:
        """Values of the chosen joints; the others have none.  rows: samples that have some, (n); None: all."""
        values = np.zeros((len(x), len(self._joints)))
        values[:, chosen] = x
        present = np.broadcast_to(chosen if rows is None else chosen & rows[:, None], values.shape)
        if present.all():
            return self._numbers(values)
        return self._numbers(values, np.packbits(present.ravel(), bitorder="little"), int(np.sum(~present)))

    def _numbers(self, x: Array, present: np.ndarray | None = None, absent: int = 0) -> pa.Array:
        """A column without a copy.  `pa.array` would import pandas, where it is installed, which takes longer than a small run."""
        pa = self._pa
        flat = np.ascontiguousarray(x, dtype=float).reshape(-1)
        return pa.Array.from_buffers(pa.float64(), len(flat), [None if present is None else pa.py_buffer(present), pa.py_buffer(flat)], absent)

    def _words(self, words: list[str], indices: np.ndarray) -> pa.DictionaryArray:
        pa = self._pa
        numbers = pa.Array.from_buffers(pa.int16(), len(indices), [None, pa.py_buffer(np.ascontiguousarray(indices, dtype=np.int16))])
        return pa.DictionaryArray.from_arrays(numbers, pa.StringArray.from_buffers(len(words), *_text_buffers(pa, words)))


def _text_buffers(pa: Any, words: list[str]) -> tuple[Any, Any]:
    """Offsets and bytes of a column of texts."""
    encoded = [word.encode("utf-8") for word in words]
    offsets = np.cumsum([0, *(len(one) for one in encoded)], dtype=np.int32)
    return pa.py_buffer(offsets), pa.py_buffer(b"".join(encoded))


def wrench_table(
    model: Calls,
    time: ArrayLike,
    q: ArrayLike,
    v: ArrayLike | None = None,
    a: ArrayLike | None = None,
    *,
    external: External | None = None,
    on: Side = "child",
    at: Point = "joint",
    axes: str = "joint",
    order: Order = "lin_ang",
) -> pa.Table:
    """Every wrench along a motion: a row for each sample and joint, fixed joints and `base` included.

    time (n), increasing, s; q (n, nq); v, a (n, nv), differentiated from a quintic spline where they are missing (at
    least 6 samples).  external: {link: (n, 6), or (6) for all samples}.  on, at, axes, order: as in `Model.reactions`.
    Columns: case ("motion"), time, joint, fx fy fz tx ty tz of the total and constraint_fx … of the constraint part (N, N m);
    position, speed and acceleration of joints with one coordinate; effort and power of their drives, the same for every on, at
    and axes; on, at, axes.  Robots with mimic joints have a column `coupling` after these: the effort by which its leader moves a mimic joint, which has no
    drive.  Mechanisms with loops have the joints that close them, too, and last a column `undetermined`: the components that rigid bodies leave open.
    Models with physics of joints have the parts of the effort there: transmitted, damping, friction, rotor, spring.
    The metadata (key `ksl`, JSON) says robot, joints, load case, versions, date, units and conventions.
    Raises MotionError.
    """
    require("a table of wrenches", "pyarrow")
    import pyarrow as pa

    model.reaction_request(on, at, axes, order, "total", None)  # refuses what it can't be
    motion = motion_of_arrays(model, time, q, v, a)
    case = LoadCase(model, motion, Placement(on, at, axes, order), wrenches_of_arrays(external, len(motion.time)))
    writer = TableWriter(model, case.placement, provenance_of([case]))
    return pa.concat_tables([writer.table(block) for block in case.blocks()])


def motion_of_arrays(model: Calls, time: ArrayLike, q: ArrayLike, v: ArrayLike | None = None, a: ArrayLike | None = None) -> Motion:
    """The motion of samples at `time` (n); what is None is differentiated.  Raises MotionError.

    Columns of q of joints that follow by loops may be NaN throughout.
    """
    try:
        t, positions = _real("time", time), _real("q", model.as_array(q, "q"))
        given = [None if x is None else _real(name, model.as_array(x, name)) for name, x in (("v", v), ("a", a))]
    except ValueError as error:
        raise MotionError(str(error)) from None
    given = [np.broadcast_to(x, (len(t), model.nv)) if x is not None and x.shape == (model.nv,) and t.ndim == 1 else x for x in given]
    if t.ndim != 1 or positions.shape != (len(t), model.nq) or any(x is not None and x.shape != (len(t), model.nv) for x in given):
        shapes = [None if x is None else x.shape for x in given]
        found = f"time {t.shape}, q {positions.shape}, v {shapes[0]}, a {shapes[1]}"
        raise MotionError(f"shapes don't fit: {found}; expected (n), (n, {model.nq}), (n, {model.nv}), (n, {model.nv})")
    joints = model.joints[: len(model.joint_names)]
    if np.isnan(positions).any():
        check_drives(model, "motion")
    there = ~np.isnan(positions).all(axis=0)
    columns = np.array([column for j in joints for column in columns_of(j)[0]])
    known = there | ~np.isin(np.arange(model.nq), follow_by_loops(model, columns[there].tolist()))
    positions = np.where(known, positions, model.neutral())
    if not all(np.isfinite(x).all() for x in (t, positions, *given) if x is not None):
        raise MotionError("time, q, v and a must be finite")
    back = np.flatnonzero(np.diff(t) <= 0)
    if len(back):
        raise not_increasing(lambda k: f"sample {k + 1}", t, int(back[0]) + 1)
    by_joint = [[None if x is None else x[:, j.v_index : j.v_index + j.nv] for x in given] for j in joints]
    return completed(model, t, positions, by_joint, known)


def wrenches_of_arrays(external: External | None, samples: int) -> dict[str, Array]:
    """External wrenches for each sample: {link: (samples, 6)}."""
    return {link: _wrenches(link, w, samples) for link, w in items_of(external)}


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
