"""Computes partitions of a sweep.  What a worker does, in whichever engine."""

from __future__ import annotations

import json
import os
import time
import traceback
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ksl._core import __version__
from ksl.base.errors import SweepError
from ksl.base.files_read import InputFile, changed, recorded
from ksl.load_cases.load_case import Block, LoadCase
from ksl.load_cases.provenance import UNITS
from ksl.load_cases.quantities import UNDETERMINED
from ksl.load_cases.reaction_joints import reaction_joints
from ksl.load_cases.summary_table import PEAKS
from ksl.load_cases.undetermined import Undetermined
from ksl.mechanism.mechanism import Joint
from ksl.motions.motion import Motion
from ksl.sizing.catalogue.components import read_components
from ksl.sweeps.description import Sweep, described
from ksl.sweeps.given_model import GivenModel
from ksl.sweeps.joint_summaries import Peaks
from ksl.sweeps.sampling import sample
from ksl.sweeps.variants import Variants

if TYPE_CHECKING:
    import pyarrow as pa

    from ksl.sizing.figures import Figure

UNITS_OF_SWEEPS = f"{UNITS}; shares of limits: 1 is at the limit; parameters: see `parameters`"
CONVENTIONS_OF_SWEEPS = f"{PEAKS}; wrenches are exerted on the child, about the joint's origin, in the joint's axes; effort is the drive's"
UTILISATION = ("utilisation", "utilisation_of")
"""Columns of sweeps with components."""


@dataclass(frozen=True)
class Plan:
    """All that a worker needs to know, on any machine that has the files."""

    robot: str | GivenModel
    """A file, or a model."""
    sweep: Sweep
    size: int
    """Cases of a partition."""
    with_wrenches: bool = False
    inputs: tuple[InputFile, ...] = ()
    """The files as they were read when the sweep began: workers refuse others.  Empty: none are known yet."""

    @property
    def key(self) -> str:
        """A name that equal plans share."""
        return repr(self)

    @property
    def partitions(self) -> int:
        return -(-self.sweep.cases // self.size)

    def cases(self, partition: int) -> range:
        """The cases of a partition."""
        return range(partition * self.size, min(self.sweep.cases, (partition + 1) * self.size))


@dataclass(frozen=True)
class Result:
    """A partition, computed."""

    partition: int
    files: dict[str, bytes]
    """{name of a data set: the contents of its Parquet file}."""
    seconds: float
    """Time of the worker, and what of it was spent in the dynamics."""
    seconds_of_dynamics: float


class Evaluator:
    """Computes any partition of a plan: the same bits in any order, on any worker."""

    def __init__(self, plan: Plan) -> None:
        self.plan = plan
        with recorded() as ledger:
            self._variants = Variants(plan.robot, plan.sweep)
            self._components = read_components(plan.sweep.path(plan.sweep.components)) if plan.sweep.components is not None else None
        given = [InputFile("robot", f"model {plan.robot.name}", plan.robot.sha256)] if isinstance(plan.robot, GivenModel) else []
        self.inputs = (*given, *ledger.files)
        """The files that it was read from, with the hashes of what was read."""
        if plan.inputs:
            _check_unchanged(plan.inputs, self.inputs)
        self._values = sample(plan.sweep)
        self._peaks = Peaks(self._variants.model)
        taken = [p.name for p in plan.sweep.parameters if p.name in (*self._peaks.names(), *UTILISATION)]
        if taken:
            raise SweepError(f"{plan.sweep.file}: parameter {taken[0]!r} is named like a column of the results; give it another `name`")
        self._dynamics = 0.0
        self._notes: tuple[str, ...] = ()
        """What sizing says of the components, of the first case that is computed."""
        self._open: dict[int, Undetermined] = {}

    @property
    def doubts(self) -> list[str]:
        """What the sweep most likely has in other units, and once a case is computed what of its components doesn't apply."""
        return [*self._variants.doubts(), *self._notes]

    @property
    def joints(self) -> tuple[Joint, ...]:
        return reaction_joints(self._variants.model)

    def extent(self) -> tuple[int, int]:
        """Joints, and samples of the longest motion."""
        return len(self.joints), self._variants.most_samples

    def partition(self, index: int) -> Result:
        """Raises SweepError, with the case, where results are not finite."""
        start, self._dynamics = time.perf_counter(), 0.0
        cases = self.plan.cases(index)
        tables: dict[str, list[pa.Table]] = {}
        rows: list[dict[str, Any]] = []
        for case in cases:
            row, wrenches = self._case(cases, case)
            rows.append(row)
            if wrenches is not None and self.plan.with_wrenches:
                tables.setdefault("wrenches", []).append(wrenches)
        tables["cases"] = [self._table(cases, rows)]
        files = {name: _parquet(parts) for name, parts in tables.items()}
        return Result(index, files, time.perf_counter() - start, self._dynamics)

    def _case(self, cases: range, case: int) -> tuple[dict[str, Any], pa.Table | None]:
        """The row of a case, and its wrenches if they are wanted or components need them."""
        values = {name: x[case].item() for name, x in self._values.items()}
        try:
            with np.errstate(over="ignore", invalid="ignore"):
                load_case, block = self._block(values)
                row: dict[str, Any] = self._peaks.of(block)
            if load_case.model.loops:
                row[UNDETERMINED] = [" ".join(block.undetermined.of(j.name)) for j in self.joints]
            if not (np.isfinite(block.tau).all() and np.isfinite(block.in_joint_axes).all()):
                raise ValueError("results are not finite; check the values, and the units of the motion")
            wrenches = None
            if self.plan.with_wrenches or self._components is not None:
                wrenches = self._wrenches(cases, case, load_case, block)
            if self._components is not None:
                row |= self._utilisations(wrenches)
            return row, wrenches
        except ValueError as error:
            raise SweepError(f"{self.plan.sweep.file}: case {case}: {_listed(values)}: {error}") from None
        except ModuleNotFoundError as error:
            raise SweepError(f"{self.plan.sweep.components}: needs the package {error.name}; install it with: pip install 'ksl[size]'") from None

    def _utilisations(self, wrenches: pa.Table) -> dict[str, Any]:
        """The largest utilisation of each joint's components, and of which component and figure it is."""
        from ksl.sizing.joints.compute_sizing import size

        worst: dict[str, Figure] = {}
        sizing = size(wrenches, self._components)
        self._notes = self._notes or sizing.notes
        for figure in sizing.figures:  # worst first
            if figure.utilisation is not None:
                worst.setdefault(figure.joint, figure)
        of = [worst.get(j.name) for j in self.joints]
        share = np.array([np.nan if f is None or f.utilisation is None else f.utilisation for f in of])
        return {UTILISATION[0]: share, UTILISATION[1]: [None if f is None else f"{f.component}: {f.figure}" for f in of]}

    def _block(self, values: dict[str, Any]) -> tuple[LoadCase, Block]:
        model, motion = self._variants.case(values)
        case = LoadCase(model, motion, known_undetermined=self._undetermined(motion))
        start = time.perf_counter()
        block = case.block(slice(0, len(motion.time)), threads=1)
        self._dynamics += time.perf_counter() - start
        return case, block

    def _undetermined(self, motion: Motion) -> Undetermined:
        """What rigid bodies leave open depends on the positions alone, which many cases share."""
        if not self._variants.model.loops:
            return Undetermined()
        if self.plan.sweep.simulated is not None:  # each case has positions of its own
            return LoadCase(self._variants.model, motion).undetermined
        key = id(motion.q)  # of the motions that the variants keep
        if key not in self._open:
            self._open[key] = LoadCase(self._variants.model, motion).undetermined
        return self._open[key]

    def _table(self, cases: range, rows: list[dict[str, Any]]) -> pa.Table:
        """A row for each case and joint."""
        import pyarrow as pa

        joints = self.joints
        count = len(joints)
        columns: dict[str, Any] = {"case": pa.array(np.repeat(np.arange(cases.start, cases.stop), count))}
        columns |= {name: pa.array(np.repeat(x[cases.start : cases.stop], count)) for name, x in self._values.items()}
        columns["joint"] = pa.array([j.name for j in joints] * len(cases))
        columns["kind"] = pa.array([j.kind for j in joints] * len(cases))
        for name in self._peaks.names():
            values = np.concatenate([row[name] for row in rows])
            columns[name] = pa.array(values, mask=np.isnan(values))
        if self._variants.model.loops:
            columns[UNDETERMINED] = pa.array([text for row in rows for text in row[UNDETERMINED]])
        if self._components is not None:
            values = np.concatenate([row[UTILISATION[0]] for row in rows])
            columns[UTILISATION[0]] = pa.array(values, mask=np.isnan(values))
            columns[UTILISATION[1]] = pa.array([text for row in rows for text in row[UTILISATION[1]]], pa.string())
        return pa.table(columns, metadata={"ksl": json.dumps(self._said())})

    def _said(self) -> dict[str, Any]:
        """What the metadata of the partitions say: the same in all, and no date, so that the bits are the same each time."""
        from ksl.load_cases.provenance import joint_description

        model = self._variants.model
        return {
            "version": __version__,
            "robot": model.name,
            "joints": [joint_description(j) for j in self.joints],
            "inputs": portable(self.inputs),
            "parameters": described(self.plan.sweep),
            "units": UNITS_OF_SWEEPS,
            "conventions": CONVENTIONS_OF_SWEEPS,
        }

    def _wrenches(self, cases: range, case: int, load_case: LoadCase, block: Block) -> pa.Table:
        """Every wrench of a case.  The metadata say the parameters of all cases of the partition, and no date: the same bits each time."""
        import pyarrow as pa

        from ksl.load_cases.provenance import Provenance, joint_description
        from ksl.load_cases.wrench_table import TableWriter

        cases_described = [{"name": str(i), **{name: x[i].item() for name, x in self._values.items()}} for i in cases]
        provenance = Provenance(
            load_case.model.name, [joint_description(j) for j in load_case.joints], cases_described, portable_files(self.inputs), extent=self._variants.extent
        )
        table = TableWriter(load_case.model, load_case.placement, provenance).table(block, case - cases.start)
        return table.set_column(0, "case", pa.array(np.full(len(table), case)))


def portable_files(inputs: Sequence[InputFile]) -> list[InputFile]:
    """Without folders: results are the same wherever the files are."""
    return [InputFile(f.role, os.path.basename(f.file), f.sha256) for f in inputs]


def portable(inputs: Sequence[InputFile]) -> list[dict[str, Any]]:
    """The files without folders, as values that JSON can hold."""
    return [asdict(f) for f in portable_files(inputs)]


def _check_unchanged(expected: Sequence[InputFile], found: Sequence[InputFile]) -> None:
    """Raises SweepError for files that are no longer those with which the sweep began."""
    before = {f.file: f.sha256 for f in expected}
    for f in found:
        if f.sha256 != before.get(f.file):
            raise SweepError(
                changed(f.file, "since the sweep began, and no case of the other contents is computed") + "; what was computed before stays in the folder"
            )


def refused(error: Exception) -> SweepError:
    """What a worker answers instead of a partition.  A ValueError is of the robot, the motion or a case; others are faults of KSL."""
    if isinstance(error, ValueError):
        return SweepError(str(error))
    if isinstance(error, MemoryError):
        return SweepError("the memory of a worker is too small; use fewer workers")
    last = traceback.extract_tb(error.__traceback__)[-1]
    return SweepError(f"a fault in KSL: {type(error).__name__}: {error} ({last.filename}:{last.lineno}); please report it, with the sweep")


def _parquet(tables: list[pa.Table]) -> bytes:
    import pyarrow as pa
    import pyarrow.parquet

    sink = pa.BufferOutputStream()
    pyarrow.parquet.write_table(pa.concat_tables(tables), sink, compression="zstd")
    contents: bytes = sink.getvalue().to_pybytes()
    return contents


def _listed(values: dict[str, Any]) -> str:
    return ", ".join(f"{name} = {value}" for name, value in values.items())
