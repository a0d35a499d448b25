"""`ksl.sweep`: runs a sweep, or goes on where an earlier run has stopped."""

from __future__ import annotations

import os
import time
import warnings
from collections.abc import Callable, Generator, Mapping
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from ksl.base.errors import DescriptionWarning, SweepError, of_argument
from ksl.base.extras import require
from ksl.load_cases.verdict import percent
from ksl.mechanism.mechanism import Joint
from ksl.model.model import Model
from ksl.sweeps.description import Sweep, read_sweep, sweep_from
from ksl.sweeps.evaluate import Evaluator, Plan, Result
from ksl.sweeps.given_model import GivenModel
from ksl.sweeps.store import Store

if TYPE_CHECKING:
    import pyarrow.dataset

ROWS = 5000
"""About so many rows of the summary are one partition: half a second of one core, and some hundred kB."""
ROWS_OF_WRENCHES = 400_000
"""With wrenches a partition has no more of these; they are some 50 MB in memory."""


@dataclass(frozen=True)
class SweepResults:
    """The results of a sweep, in its folder."""

    directory: Path
    worst: list[dict[str, Any]]
    """For each joint and quantity the largest value, its unit, and its case with its parameters: the rows of worst.csv."""
    computed: int
    """Cases that this run has computed; others were there, computed from the same files."""
    seconds: float
    share_of_dynamics: float
    """The share of dynamics in the time of the workers; the rest is sums, peaks and tables."""
    replaced: int = 0
    """Partitions that were there, but computed from other contents of the files: they are computed again."""

    def __repr__(self) -> str:
        share = max((row for row in self.worst if row["quantity"].endswith(("_share", "utilisation"))), key=lambda row: row["value"], default=None)
        worst = ""
        if share is not None:
            what = share["quantity"].removesuffix("_share").replace("utilisation", "components")
            worst = f", at most {percent(share['value'])} of a limit ({what} of {share['joint']}, case {share['case']})"
        return f"<ksl sweep in {self.directory}: {self.computed} cases computed in {self.seconds:.3g} s{again_of(self.replaced)}{worst}>"

    @property
    def cases(self) -> pyarrow.dataset.Dataset:
        """A row for each case and joint: `results.cases.to_table()`, and whatever reads a folder of Parquet files.

        The columns are those of docs/sweep.md.  The metadata of the schema (key `ksl`, JSON) say version, robot, joints, parameters,
        units and conventions.
        """
        import pyarrow.dataset

        return pyarrow.dataset.dataset(self.directory / "cases")


def sweep(
    robot: Model | str | os.PathLike[str],
    description: str | os.PathLike[str] | Mapping[str, Any],
    directory: str | os.PathLike[str],
    *,
    engine: Literal["local", "ray"] = "local",
    workers: int | None = None,
    address: str | None = None,
    wrenches: bool = False,
    force: bool = False,
    progress: Callable[[int, int], None] | None = None,
    xacro: Mapping[str, object] | None = None,
    packages: Mapping[str, str | os.PathLike[str]] | None = None,
) -> SweepResults:
    """Computes a load case in all variants that a description names, in parallel, and writes them into a folder.

    robot: a model, or a file, as :func:`ksl.load` takes it.  description: a TOML file, or its tables as a mapping (docs/sweep.md).
    directory: gets cases/part-….parquet, with a row for each case and joint: peaks with their times, root mean squares, work, shares of
    the limits; worst.csv, the worst case of each joint and quantity; sweep.json, what made them; and with `wrenches` every wrench
    at every sample, in wrenches/part-….parquet.  Partitions that are there, of the same sweep, are not computed again.
    engine: "local": processes of this machine; "ray": a Ray cluster at `address`, or a new one.  The results are the same to the bit.
    workers: processes; None: one for each core that this process may use.
    force: replaces the results of another sweep.  progress(cases done, cases): called after each partition.
    xacro, packages: as :func:`ksl.load` takes them, in the place of those of [base].
    One run at a time may write into a folder.  Raises SweepError and OutputError.  About 1 ms of a core for a case of 1,000 samples and 7 joints.

        masses = {"kind": "payload", "link": "tool0", "values": [0.0, 1.0, 2.0]}
        results = ksl.sweep(m, {"base": {"motion": "motion.csv"}, "vary": [masses]}, "swept")
        table = results.cases.to_table()
    """
    for name, what in (("robot", robot), ("directory", directory)):
        if not isinstance(what, (str, os.PathLike)) and not (name == "robot" and isinstance(what, Model)):
            raise SweepError(f"{name} is {type(what).__name__}; expected {'a ksl.Model, or the name of a file' if name == 'robot' else 'the name of a folder'}")
    if not isinstance(description, (str, os.PathLike, Mapping)):
        raise SweepError(f"description is {type(description).__name__}; expected a TOML file, or its tables as a mapping")
    require("a sweep", "pyarrow", "scipy")
    given = sweep_from(description) if isinstance(description, Mapping) else read_sweep(description)
    if xacro is not None:
        given = replace(given, base={**given.base, "xacro": dict(xacro)})
    if packages is not None:
        given = replace(given, base={**given.base, "packages": {name: os.path.abspath(folder) for name, folder in packages.items()}})
    if engine not in ("local", "ray"):
        raise of_argument(SweepError, "engine", "; expected 'local' or 'ray'", engine)
    count = usable_cores() if workers is None else workers
    if not isinstance(count, int) or count < 1:
        raise SweepError(f"workers={workers!r}; expected a number of processes, at least 1")
    start = time.perf_counter()
    plan, joints = _plan(GivenModel.of(robot) if isinstance(robot, Model) else os.path.abspath(robot), given, wrenches)
    with Store(Path(directory), plan, force) as store:
        others = store.remove_others()
        missing = store.missing()
        computed, busy, dynamics = 0, 0.0, 0.0
        done = given.cases - sum(len(plan.cases(p)) for p in missing)
        if progress:
            progress(done, given.cases)
        with closing(_results(plan, missing, engine, count, address)) as results:
            for result in results:
                store.add(result)
                computed += len(plan.cases(result.partition))
                busy, dynamics = busy + result.seconds, dynamics + result.seconds_of_dynamics
                if progress:
                    progress(done + computed, given.cases)
        worst = store.worst(joints)
    return SweepResults(Path(directory), worst, computed, time.perf_counter() - start, dynamics / busy if busy else 0.0, others)


def again_of(replaced: int) -> str:
    """The clause on partitions that were computed again."""
    return "" if not replaced else f", {replaced} partition{'s' if replaced > 1 else ''} again, since files had other contents when they were computed"


def usable_cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _plan(robot: str | GivenModel, given: Sweep, wrenches: bool) -> tuple[Plan, tuple[Joint, ...]]:
    """Checks the sweep on its first case, before any worker starts, and chooses the size of partitions.  Also returns the joints."""
    first = Evaluator(Plan(robot, given, 1))
    joints, samples = first.extent()
    size = given.partition or max(1, ROWS // joints)
    if wrenches and not given.partition:
        size = max(1, min(size, ROWS_OF_WRENCHES // (joints * samples)))
    first.partition(0)
    for doubt in first.doubts:
        warnings.warn(doubt, DescriptionWarning, stacklevel=3)
    return Plan(robot, given, size, wrenches, first.inputs), first.joints


def _results(plan: Plan, missing: list[int], engine: str, workers: int, address: str | None) -> Generator[Result]:
    if not missing:
        return
    if engine == "ray":
        from ksl.sweeps import on_ray

        yield from on_ray.compute(plan, missing, workers, address)
    else:
        from ksl.sweeps import local

        yield from local.compute(plan, missing, workers)
