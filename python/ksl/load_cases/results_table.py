"""Results of `ksl loads`, read again: one load case with its motion, and what was said of it."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ksl.base.arrow_files import arrow_file, with_text
from ksl.base.errors import MotionError, near_names
from ksl.base.input_files import Unreadable, check_regular
from ksl.mechanism.states import Array
from ksl.motions.reading import read_motion
from ksl.motions.reading_options import OPTIONS as READING

if TYPE_CHECKING:
    import pyarrow as pa

    from ksl.mechanism.calls import Calls

TABLE = "wrenches.parquet"

NUMBERS = ("time", "position", "speed", "acceleration", "effort")
"""Columns that are read, beside the joints' names."""
BRAKE = "brake"
"""Column of tables with cases whose efforts brakes supply; those of drives are zero there."""

AGAIN = "run `ksl loads` again"


COMPONENTS = ("fx", "fy", "fz", "tx", "ty", "tz")
WRENCH = (*COMPONENTS, *(f"constraint_{c}" for c in COMPONENTS))
PLACEMENT = ("on", "at", "axes")


@dataclass(frozen=True)
class JointWrench:
    """The wrench of one joint, as the table expresses it."""

    total: Array
    """(n, 6)."""
    constraint: Array
    """(n, 6)."""
    on: str
    at: str
    axes: str


def is_results(path: Path) -> bool:
    """Whether a path is a folder of results of `ksl loads`, or its table."""
    return (path / TABLE).is_file() or (path.is_file() and path.name == TABLE)


@dataclass(frozen=True)
class SavedCase:
    """One load case of a table of `ksl loads`."""

    case: str
    time: Array
    position: dict[str, Array]
    """Positions (n) of joints with one coordinate, rad or m."""
    speed: dict[str, Array]
    acceleration: dict[str, Array]
    effort: dict[str, Array]
    """What drives and brakes supply."""
    wrenches: Mapping[str, JointWrench] = field(default_factory=dict)
    made_by: Mapping[str, Any] = field(default_factory=dict)
    """The metadata of the table: robot, cases, inputs, directory and more."""

    @property
    def description(self) -> Mapping[str, Any]:
        """What the results say of the load case: gravity, payloads, physics, external, motion."""
        return next((c for c in self.made_by.get("cases", []) if c["name"] == self.case), {})


def read_results(path: Path, case: str | None = None) -> SavedCase:
    """Reads a load case, by default the first, of results.

    Raises MotionError where the file can't be read, or its metadata, columns or times are not those that `ksl loads` writes.
    """
    import pyarrow as pa
    from pyarrow import parquet

    file = path / TABLE if path.is_dir() else path
    mend = "give the folder that `ksl loads` has written, or a motion"
    try:
        check_regular(str(file))
        with arrow_file(file) as opened:
            schema = parquet.read_schema(opened)
        made_by = json.loads((schema.metadata or {}).get(b"ksl", b"{}"))
        _check_metadata(file, made_by)
        absent = [c for c in ("joint", *NUMBERS, *WRENCH, *PLACEMENT) if c not in schema.names]
        if absent:
            raise MotionError(f"{file}: no column {absent[0]!r}, so it is no table of this version of `ksl loads`; {AGAIN}")
        _check_kinds(file, schema)
        names = [c["name"] for c in made_by.get("cases", [])]
        if case is not None and case not in names:
            raise MotionError(f"{file}: no load case named {case!r}; {near_names(case, names)}known: {', '.join(names)}")
        chosen = case or (names[0] if names else "")
        only = [("case", "=", chosen)] if "case" in schema.names and chosen else None
        with arrow_file(file) as opened:
            table = with_text(parquet.read_table(opened, columns=["joint", *PLACEMENT, *_columns(schema)], filters=only))
    except MemoryError:
        raise
    except (OSError, pa.ArrowException, json.JSONDecodeError, UnicodeError, RecursionError, Unreadable) as e:
        raise MotionError(f"{file}: can't be read ({e}); {mend}") from None
    if not len(table):
        raise MotionError(f"{file}: has no samples; {mend}")
    joints = table.column("joint").unify_dictionaries().combine_chunks()
    order = list(dict.fromkeys(joints.slice(0, min(len(table), 100_000)).to_pylist()))
    count = len(order)
    if None in order or len(table) % count:
        raise MotionError(f"{file}: column 'joint' doesn't name the same joints at every time; {AGAIN}")
    columns = {n: table.column(n).to_numpy(zero_copy_only=False).astype(float).reshape(-1, count) for n in _columns(schema)}
    if BRAKE in columns:
        columns["effort"] = columns["effort"] + np.nan_to_num(columns[BRAKE], nan=0.0)
    _check_times(file, columns["time"], count)
    of = {n: {joint: columns[n][:, i] for i, joint in enumerate(order)} for n in NUMBERS[1:]}
    return SavedCase(
        chosen, columns["time"][:, 0].copy(), of["position"], of["speed"], of["acceleration"], of["effort"], _wrenches(file, table, columns, order), made_by
    )


def _wrenches(file: Path, table: pa.Table, columns: Mapping[str, Array], order: Sequence[str]) -> dict[str, JointWrench]:
    """The wrench of each joint, and how it is expressed, which the first sample says for all."""
    words = {name: table.column(name).slice(0, len(order)).to_pylist() for name in PLACEMENT}
    found = {}
    for i, joint in enumerate(order):
        total, constraint = (np.column_stack([columns[c][:, i] for c in names]) for names in (WRENCH[:6], WRENCH[6:]))
        if not (np.isfinite(total).all() and np.isfinite(constraint).all()):
            raise MotionError(f"{file}: wrenches of {joint} are missing or not finite; {AGAIN}")
        found[joint] = JointWrench(total, constraint, *(str(words[name][i]) for name in PLACEMENT))
    return found


def _check_metadata(file: Path, made_by: Any) -> None:
    """Raises MotionError unless it has the form that `ksl loads` writes, as far as it is used."""
    if not isinstance(made_by, dict):
        raise MotionError(f"{file}: its metadata `ksl` is no JSON object; {AGAIN}")
    for name in ("cases", "inputs"):
        entries = made_by.get(name, [])
        if not isinstance(entries, list) or not all(isinstance(e, dict) for e in entries):
            raise MotionError(f"{file}: `{name}` in its metadata is no list of objects; {AGAIN}")
    if not all(isinstance(c.get("name"), str) for c in made_by.get("cases", [])):
        raise MotionError(f"{file}: a case in its metadata has no name; {AGAIN}")
    if not all(isinstance(i.get(key), str) for i in made_by.get("inputs", []) for key in ("file", "role")):
        raise MotionError(f"{file}: an input in its metadata has no file or role; {AGAIN}")
    for case in made_by.get("cases", []):
        lists = [case.get(name, []) for name in ("gravity", "physics", "payloads", "drives")]
        gravity, physics, payloads, drives = lists
        good = (
            all(isinstance(each, list) for each in lists)
            and all(isinstance(g, (int, float)) for g in gravity)
            and all(isinstance(p, str) for p in (*physics, *drives))
        )
        if not good or not all(isinstance(p, dict) and {"link", "mass", "center"} <= set(p) and isinstance(p["mass"], (int, float)) for p in payloads):
            raise MotionError(
                f"{file}: gravity, physics, payloads or drives of case {case['name']} in its metadata are not as `ksl loads` writes them; {AGAIN}"
            )
        if not isinstance(case.get("motion") or "", str):
            raise MotionError(f"{file}: the motion of case {case['name']} in its metadata is no name of a file; {AGAIN}")
    if not isinstance(made_by.get("options", {}), dict) or not isinstance(made_by.get("directory", ""), str):
        raise MotionError(f"{file}: `options` or `directory` in its metadata is not as `ksl loads` writes it; {AGAIN}")


def _columns(schema: pa.Schema) -> list[str]:
    return [*NUMBERS, *WRENCH, *([BRAKE] if BRAKE in schema.names else [])]


def _check_kinds(file: Path, schema: pa.Schema) -> None:
    import pyarrow.types as t

    for name in _columns(schema):
        kind = schema.field(name).type
        if not (t.is_floating(kind) or t.is_integer(kind) or t.is_null(kind)):
            raise MotionError(f"{file}: column {name!r} holds {kind}; expected numbers: {AGAIN}")
    kind = schema.field("joint").type
    words = kind.value_type if t.is_dictionary(kind) else kind
    if not (t.is_string(words) or t.is_large_string(words)):
        raise MotionError(f"{file}: column 'joint' holds {kind}; expected names: {AGAIN}")


def _check_times(file: Path, time: Array, count: int) -> None:
    """time (n, count): of each sample and joint.  Raises MotionError unless they are finite, the same for all joints, and increase."""
    bad = np.flatnonzero(~np.isfinite(time.ravel()))
    if len(bad):
        what = "is infinite" if np.isinf(time.flat[bad[0]]) else "is missing or not a number"
        raise MotionError(f"{file}: column 'time' {what} at sample {int(bad[0]) // count + 1}; {AGAIN}")
    if (time != time[:, :1]).any():
        raise MotionError(f"{file}: column 'joint' doesn't name the same joints at every time; {AGAIN}")
    back = np.flatnonzero(np.diff(time[:, 0]) <= 0)
    if len(back):
        raise MotionError(f"{file}: column 'time' doesn't increase at sample {int(back[0]) + 2}; {AGAIN}")


def motion_of_results(model: Calls, results: SavedCase) -> tuple[Array, Array, Array, Array]:
    """Times, positions, velocities and accelerations of a load case: those of the table where every joint has one coordinate, otherwise those
    of the motion file that the table names.  Raises MotionError."""
    joints = model.joints[: len(model.joint_names)]
    unknown = [j.name for j in joints if j.name not in results.effort and j.name not in {of.get("name") for of in results.made_by.get("joints", [])}]
    if unknown:
        made = results.made_by.get("robot", "another robot")
        raise MotionError(f"the results have no joint {unknown[0]!r}: they are those of {made}, and not of {model.name}; give the robot file of that run")
    if all(j.one_coordinate and j.name in results.position for j in joints):
        time = results.time
        q, v, a = (
            np.column_stack([x[j.name] for j in joints]) if joints else np.zeros((len(time), 0))
            for x in (results.position, results.speed, results.acceleration)
        )
        for column, x in (("position", q), ("speed", v), ("acceleration", a)):
            bad = np.argwhere(~np.isfinite(x))
            if len(bad):
                where = f"of {joints[bad[0][1]].name} at sample {bad[0][0] + 1}"
                raise MotionError(f"the results: column {column!r} is missing or not finite {where}; {AGAIN}")
    else:
        named = results.description.get("motion")
        if not named:
            raise MotionError(
                f"the table doesn't hold the pose of {next(j.name for j in joints if not j.one_coordinate or j.name not in results.position)}; give the motion file instead of the results"
            )
        motion = read_motion(model, beside(results, named), **reading_of(results))
        time, q, v, a = motion.time, motion.q, motion.v, motion.a
        if len(time) != len(results.time) or not np.allclose(time, results.time, rtol=1e-9, atol=1e-9):
            raise MotionError(f"{named}: its times are not those of the results, which it is needed for; {AGAIN}")
    return time, q, v, a


def reading_of(results: SavedCase) -> dict[str, Any]:
    """How the run read its motion, as `read_motion` takes it."""
    options = results.made_by.get("options", {})
    found = {name: options[name] for name in READING if options.get(name) not in (None, "", False)}
    return found | ({"map": str(beside(results, str(found["map"])))} if "map" in found else {})


def beside(results: SavedCase, file: str) -> Path:
    """A file that the metadata names, relative to the folder in which the run was started."""
    return Path(results.made_by.get("directory", "")) / file
