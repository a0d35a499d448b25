"""Results of `ksl loads`, read, checked, and moved to the joints' origins."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ksl.base.arrow_files import arrow_file, with_text
from ksl.base.errors import SizingError, name_among, of_argument, unknown_name
from ksl.base.files_read import being_read
from ksl.base.input_files import Unreadable, check_regular
from ksl.base.rounding import OF_POSITIONS
from ksl.base.words import listed, of_cases
from ksl.mechanism.joint_kinds import has_one_coordinate
from ksl.mechanism.states import Array, offset_in
from ksl.sizing.samples import JointSamples, ResultJoint, Spectrum, moved

if TYPE_CHECKING:
    import pyarrow as pa

WRENCH = ("fx", "fy", "fz", "tx", "ty", "tz")
MOTION = ("position", "speed", "acceleration", "effort")
PARTS = ("rotor", "brake")
"""Columns that are there where the robot or a load case has such a thing."""
UNDETERMINED = "undetermined"
"""The column of components that rigid bodies leave open."""


class Results:
    """Results of `ksl loads`, a table with its metadata."""

    def __init__(self, table: pa.Table, file: str = "results") -> None:
        """Raises SizingError where the table is none of `ksl loads`, or is expressed at a point or in axes that can't be undone."""
        self.file = file
        self.of_sweep = False
        """Whether the cases are those of a sweep, by their numbers."""
        said = (table.schema.metadata or {}).get(b"ksl")
        missing = [name for name in ("time", "joint", *WRENCH) if name not in table.column_names]
        if said is None or missing:
            lacks = "the metadata `ksl`" if said is None else f"the column {missing[0]}"
            raise SizingError(f"{file}: is no table of wrenches, it lacks {lacks}; give the folder or wrenches.parquet that `ksl loads` writes")
        self.metadata = _metadata(said, file)
        if "joints" not in self.metadata or "acceleration" not in table.column_names:
            raise SizingError(f"{file}: was written by an earlier version without joints and accelerations; run `ksl loads` again")
        self.robot = str(self.metadata.get("robot", ""))
        self.joints = _joints(self.metadata["joints"], file)
        _check_columns(table, file)
        if not table.num_rows:
            raise SizingError(f"{file}: holds no samples")
        self._columns = {name: table[name] for name in table.column_names}
        self._sign, self._point_of = self._placement()
        self._rows, self._cases, self._case_index, self.time = self._layout()
        for name in ("time", *WRENCH):
            self._check_numbers(name, ~np.isfinite(self._numbers_of(name)))
        for name in ("effort", *PARTS):  # missing where a joint has none
            if name in self._columns:
                self._check_numbers(name, np.isinf(self._numbers_of(name)))

    @cached_property
    def notes(self) -> list[str]:
        """What the reader should know of the results."""
        doubts = self._doubts()
        if "rotor bodies" not in str(self.metadata.get("physics", "")):
            return doubts
        return [
            *doubts,
            "the results have rotors as bodies (physics: rotor bodies): their torque is part of the efforts; give the motors' rotor_inertia without it",
        ]

    def _doubts(self) -> list[str]:
        """Why `ksl loads` doubts the loads, by case; nothing if the metadata say nothing."""
        cases = self.metadata.get("cases")
        said = [case for case in cases if isinstance(case, Mapping)] if isinstance(cases, list) else []
        doubts = [(str(case.get("name")), case.get("doubts")) for case in said]
        lines = [(name, str(line)) for name, of in doubts if isinstance(of, list) for line in of]
        return of_cases(lines, len(said))

    @property
    def extent(self) -> float:
        """How far the robot reaches, m; 0 if the results don't say."""
        said = self.metadata.get("extent")
        return float(said) if isinstance(said, (int, float)) and math.isfinite(said) else 0.0

    @property
    def cases(self) -> tuple[str, ...]:
        return self._cases

    def holds(self, name: str) -> bool:
        """Whether there are rows of a joint."""
        return name in self._rows

    def _numbers(self, name: str) -> Array:
        """A column; NaN where there is no value."""
        return np.asarray(self._columns[name].to_numpy(), dtype=float)

    def _check_numbers(self, name: str, bad: np.ndarray) -> None:
        if bad.any():
            row = int(np.argmax(bad))
            what = "is infinite" if np.isinf(self._numbers_of(name)[row]) else "is missing or not a number"
            raise SizingError(f"{self.file}: the column {name} {what} in row {row + 1}; run `ksl loads` again")

    def _word(self, name: str) -> str:
        words = self._columns[name].unique().to_pylist() if name in self._columns else [self.metadata.get(name)]
        if len(words) > 1:
            raise SizingError(f"{self.file}: the column {name} has several values, {', '.join(map(repr, words[:3]))}; expected one")
        return str(words[0])

    def _placement(self) -> tuple[float, Callable[[str], Array]]:
        """Sign of the wrenches, and the point of each joint's moments, to undo them.  Only axes of the joint can be: the others change with the pose."""
        on, axes = self._word("on"), self._word("axes")
        if axes != "joint":
            raise SizingError(f"{self.file}: wrenches are in the axes `{axes}`, from which those of the joints don't follow; run `ksl loads` without --axes")
        words, index = _words(self._columns["at"]) if "at" in self._columns else ([self.metadata.get("at")], None)

        def point_of(name: str) -> Array:
            found = [words[0]] if index is None else [words[k] for k in np.unique(index[self._rows[name]])]
            if len(found) > 1:
                raise SizingError(f"{self.file}: moments of {name} are about several points, {listed(map(repr, found))}; expected one: run `ksl loads` again")
            return self._point(str(found[0]))

        if len(words) == 1:
            self._point(str(words[0]))
        return (-1.0 if on == "parent" else 1.0), point_of

    def _point(self, at: str) -> Array:
        """From the joint's origin in its axes, m."""
        try:
            offset = [0.0] * 3 if at == "joint" else offset_in(at)
        except ValueError:
            offset = []
        if offset is None:
            raise SizingError(f"{self.file}: moments are about the point `{at}`, which moves against the joints; run `ksl loads` without --at")
        point = np.array(offset)
        if point.shape != (3,) or not np.isfinite(point).all():
            raise SizingError(f"{self.file}: moments are about the point {at!r}, which is none; run `ksl loads` again")
        return point

    def _layout(self) -> tuple[dict[str, slice | np.ndarray], tuple[str, ...], dict[str, np.ndarray], Array]:
        """Rows of each joint, names of cases, case of each row, times.  Where joints alternate, rows are slices, which are fast."""
        names, index = _words(self._columns["joint"])
        times = self._numbers_of("time")
        count = len(self.joints)
        rows: dict[str, slice | np.ndarray] = {}
        regular = len(index) % count == 0 and bool((index.reshape(-1, count) == index[:count]).all()) and len(set(index[:count].tolist())) == count
        for k, name in enumerate(names):
            rows[name] = slice(int(np.flatnonzero(index[:count] == k)[0]), None, count) if regular else np.flatnonzero(index == k)
        strangers = [name for name in rows if name not in self.joints]
        if strangers:
            raise SizingError(f"{self.file}: the table has a joint {strangers[0]} that its metadata does not know; run `ksl loads` again")
        if "case" in self._columns:
            cases, case_of = _words(self._columns["case"])
            self.of_sweep = any(not isinstance(case, str) for case in cases)  # its cases are numbers
            cases = [str(case) for case in cases]
        else:
            cases, case_of = ["motion"], np.zeros(len(index), dtype=np.intp)
        by_joint = {name: case_of[r] for name, r in rows.items()}
        if any((np.diff(c) < 0).any() for c in by_joint.values()):
            raise SizingError(f"{self.file}: rows of different cases are mixed; sort them by case and time")
        return rows, tuple(cases), by_joint, times

    def named(self, name: str, where: str) -> str:
        """The joint that is meant, by its name alone.  Raises SizingError, which says where, for unknown names."""
        plain: str = name_among(self.joints, name, "joint")
        if plain not in self.joints:
            raise of_argument(SizingError, where, unknown_name("", "joint", name, self.joints))
        return plain

    def joint(self, name: str, spectrum: Spectrum = Spectrum()) -> JointSamples:
        """All samples of a joint, wrenches on the child at the joint's origin in its axes.  Raises SizingError for unknown names."""
        name = self.named(name, self.file)
        if not self.holds(name):
            raise SizingError(f"{self.file}: has no rows of {name}; run `ksl loads` with it among --joints, or without them")
        rows, cases = self._rows[name], self._case_index[name]
        wrench = self._sign * np.column_stack([self._numbers_of(c)[rows] for c in WRENCH])
        force, time, point = wrench[:, :3], self.time[rows], self._point_of(name)
        moment = wrench[:, 3:] + np.cross(point, force) if point.any() else wrench[:, 3:]
        rotor = np.nan_to_num(self._numbers_of("rotor")[rows]) if "rotor" in self._columns else None
        position, speed, acceleration, effort = (self._numbers_of(c)[rows] for c in MOTION)
        if self.joints[name].driven and not all(np.isfinite(x).all() for x in (position, speed, acceleration)):
            raise SizingError(f"{self.file}: {name} has samples without position, speed or acceleration; run `ksl loads` again")
        speed, resolution = self._resolved(name, cases, time, position, speed)
        weight = self._weights(time, cases, spectrum)
        return JointSamples(
            self.joints[name],
            self._cases,
            cases,
            time,
            weight,
            force,
            moment,
            position,
            speed,
            acceleration,
            effort,
            resolution,
            rotor,
            undetermined=self._undetermined(rows, point),
            brake=self._numbers_of("brake")[rows] if "brake" in self._columns else None,
        )

    def _undetermined(self, rows: slice | np.ndarray, point: Array) -> tuple[str, ...]:
        """Components that rigid bodies leave open in any row, of the wrench about the joint's origin; of closed mechanisms."""
        if UNDETERMINED not in self._columns:
            return ()
        words, index = _words(self._columns[UNDETERMINED])
        return moved(sorted({part for k in np.unique(index[rows]) for part in words[k].split()}), point)

    def _resolved(self, name: str, cases: np.ndarray, time: Array, position: Array, speed: Array) -> tuple[Array, float]:
        """Speeds, zero where rounding of the positions makes as much in a step, and the speed up to which the joint stands.

        `ksl loads` knows noise and steps of the positions, too, and says so in the metadata.
        """
        if not self.joints[name].driven or len(time) < 2:
            return speed, 0.0
        steps = np.where(np.diff(cases) == 0, np.diff(time), np.inf)
        with np.errstate(divide="ignore", over="ignore"):
            rounding = OF_POSITIONS * float(np.abs(position).max()) / np.minimum(np.append(np.inf, steps), np.append(steps, np.inf))
        return np.where(np.abs(speed) <= rounding, 0.0, speed), max(float(np.median(rounding)), self._resolution_of(name))

    def _resolution_of(self, name: str) -> float:
        """The largest of those that the metadata say of the cases; 0 if they say none."""
        try:
            found = [float(case.get("resolution", {}).get(name, 0.0)) for case in self.metadata.get("cases", [])]
        except (AttributeError, TypeError, ValueError, OverflowError):
            return 0.0
        return max((x for x in found if math.isfinite(x)), default=0.0)

    def _numbers_of(self, name: str) -> Array:
        """Columns as arrays, converted once."""
        kept = self.__dict__.setdefault("_arrays", {})
        if name not in kept:
            kept[name] = self._numbers(name)
        return np.asarray(kept[name])

    def _weights(self, time: Array, cases: np.ndarray, spectrum: Spectrum) -> Array:
        weight = np.zeros(len(time))
        edges = np.searchsorted(cases, np.arange(len(self._cases) + 1))
        for k, case in enumerate(self._cases):
            part = slice(int(edges[k]), int(edges[k + 1]))
            t = time[part]
            if len(t) < 2:  # one pose: it lasts no time and has no share in a life
                continue
            half = np.diff(t) / 2
            if (half <= 0).any():
                raise SizingError(f"{self.file}: times of case {case} don't increase; run `ksl loads` again")
            weight[part][:-1] += half
            weight[part][1:] += half
            weight[part] *= spectrum.scale(case, float(t[-1] - t[0]))
        return weight


def read_results(path: str | Path) -> Results:
    """Reads the folder that `ksl loads` has written, or its wrenches.parquet.

    Raises SizingError where there is none, or where its metadata, columns or numbers are not those that `ksl loads` writes.
    """
    import pyarrow as pa

    file = Path(path)
    table = file / "wrenches.parquet" if file.is_dir() and (file / "wrenches.parquet").exists() else file
    if (file / "sweep.json").is_file():  # what `ksl sweep` has written
        table = file / "wrenches"
        if not table.is_dir():
            raise SizingError(
                f"{file}: this sweep has no wrenches; run it with --wrenches. With `components` in its [base] it judges them itself, in worst.csv"
            )
    if not _exists(table):
        raise SizingError(f"{file}: no such file; give the folder or wrenches.parquet that `ksl loads` writes")
    if table.is_dir() and not any(table.rglob("*.parquet")):
        raise SizingError(f"{file}: this folder has no wrenches.parquet; give the folder that `ksl loads` writes")
    try:
        parts = sorted(table.rglob("*.parquet")) if table.is_dir() else [table]  # of a sweep there are several
        for each in parts:
            check_regular(str(each))
        tables = []
        for each in parts:
            with being_read("results", each, SizingError):
                tables.append(_columns(each))
        found = Results(pa.concat_tables(tables), str(file))
        _of_one_sweep(parts, tables)
        return found
    except Unreadable as e:
        raise SizingError(f"{table}: {e}; give the folder or wrenches.parquet that `ksl loads` writes") from None
    except (pa.ArrowException, OSError) as e:
        swapped = table.suffix == ".toml"
        reason = "the results come first, then the components" if swapped else str(e).partition("\n")[0].split(". ")[0]
        raise SizingError(f"{table}: is no Parquet file that can be read ({reason}); give the folder or wrenches.parquet that `ksl loads` writes") from None
    except SizingError:
        raise
    except (KeyError, TypeError, AttributeError, IndexError, ValueError, RecursionError, OverflowError):
        raise SizingError(f"{file}: its metadata or columns are not those that `ksl loads` writes; run `ksl loads` again") from None


def _of_one_sweep(parts: list[Path], tables: list[pa.Table]) -> None:
    """Refuses partitions that were computed from other files than the first."""
    made_of = [_metadata((table.schema.metadata or {}).get(b"ksl", b"{}"), str(part)).get("inputs") for part, table in zip(parts, tables)]
    for part, inputs in zip(parts, made_of):
        if inputs != made_of[0]:
            raise SizingError(f"{part}: was computed from other files than {parts[0].name}; run the sweep again, which computes it anew")


def _columns(file: Path) -> pa.Table:
    """The columns of a file that sizing uses.  `pyarrow.parquet.read_table` would import pandas, which takes longer than to read."""
    import pyarrow.parquet as pq

    with arrow_file(file) as opened, pq.ParquetFile(opened) as parquet:
        names = set(parquet.schema_arrow.names)
        return with_text(parquet.read(columns=[n for n in ("case", "time", "joint", *WRENCH, *MOTION, *PARTS, "on", "at", "axes", UNDETERMINED) if n in names]))


def _exists(path: Path) -> bool:
    try:
        return path.exists()
    except (OSError, ValueError):  # links in a circle, names that no file can have
        return False


def _metadata(said: bytes, file: str) -> dict[str, Any]:
    try:
        metadata = json.loads(said)
    except (ValueError, RecursionError):
        metadata = None
    if not isinstance(metadata, dict):
        raise SizingError(f"{file}: its metadata `ksl` is no JSON object; run `ksl loads` again")
    return metadata


def _joints(said: Any, file: str) -> dict[str, ResultJoint]:
    try:
        joints = {j["name"]: _joint(j) for j in said}
    except (KeyError, TypeError, AttributeError, ValueError, OverflowError):
        joints = {}
    if not joints or not all(isinstance(name, str) for name in joints):
        raise SizingError(f"{file}: `joints` in its metadata is no list of joints with name, kind and axis; run `ksl loads` again")
    return joints


def _check_columns(table: pa.Table, file: str) -> None:
    """Raises SizingError where a column is missing, or holds something else than `ksl loads` writes into it."""
    import pyarrow.types as t

    for name in MOTION:
        if name not in table.column_names:
            raise SizingError(f"{file}: lacks the column {name}; run `ksl loads` again")
    for name in ("time", *WRENCH, *MOTION, *PARTS):
        kind = table.schema.field(name).type if name in table.column_names else None
        if kind is not None and not (t.is_floating(kind) or t.is_integer(kind) or t.is_null(kind)):
            raise SizingError(f"{file}: the column {name} holds {kind}; expected numbers: run `ksl loads` again")
    for name in ("joint", "case"):
        if name not in table.column_names:
            continue
        kind = table.schema.field(name).type
        words = kind.value_type if t.is_dictionary(kind) else kind
        numbered = name == "case" and t.is_integer(words)  # by a sweep
        if not (t.is_string(words) or t.is_large_string(words) or numbered):
            raise SizingError(f"{file}: the column {name} holds {kind}; expected names: run `ksl loads` again")
        if table[name].null_count:
            raise SizingError(f"{file}: the column {name} lacks a name in some rows; run `ksl loads` again")


def _joint(said: Mapping[str, Any]) -> ResultJoint:
    axis = tuple(float(x) for x in said.get("axis") or (0.0, 0.0, 0.0))
    length = math.hypot(*axis)
    one = has_one_coordinate(said["kind"]) and length > 0.5
    x, y, z = axis if one else (0.0, 0.0, 1.0)
    return ResultJoint(said["name"], said["kind"], (x, y, z), one, said.get("parent"), said.get("child", ""))


def _words(column: Any) -> tuple[list[str], np.ndarray]:
    """Distinct words of a column in order of appearance, and the index of each row's."""
    encoded = column.combine_chunks() if hasattr(column, "combine_chunks") else column
    if not hasattr(encoded, "dictionary"):
        encoded = encoded.dictionary_encode()
    if hasattr(encoded, "chunks"):  # chunked arrays of older pyarrow
        encoded = encoded.unify_dictionaries().combine_chunks()
    words, index = encoded.dictionary.to_pylist(), encoded.indices.to_numpy(zero_copy_only=False).astype(np.intp)
    first = np.full(len(words), len(index))
    first[index[::-1]] = np.arange(len(index) - 1, -1, -1)  # what is assigned last stays: the first row of each word
    order = np.argsort(first)[: int(np.count_nonzero(first < len(index)))]
    renumbered = np.zeros(len(words), dtype=np.intp)
    renumbered[order] = np.arange(len(order))
    return [words[k] for k in order], renumbered[index]
