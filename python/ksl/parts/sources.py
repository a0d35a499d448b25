"""Motions whose free bodies are asked for: of a run, or of results that `ksl loads` has written."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from ksl.base.errors import ArgumentError, MotionError, of_argument, unknown_name
from ksl.base.extras import require
from ksl.load_cases.computed_cases import ComputedCases
from ksl.load_cases.case_files.results_model import external_of_results, model_of_results, require_same
from ksl.load_cases.results_table import TABLE, motion_of_results, read_results
from ksl.mechanism.calls import Calls
from ksl.mechanism.states import Array
from ksl.parts.bodies import BodiesOverTime, Welded

Results = ComputedCases | str | os.PathLike[str]


@dataclass(frozen=True)
class Moved:
    """A load case: samples of a motion, with external wrenches {link: (n, 6)}."""

    case: str
    model: Calls
    time: Array
    q: Array
    v: Array
    a: Array
    external: Mapping[str, Array]
    welded: Welded

    @cached_property
    def bodies(self) -> BodiesOverTime:
        """What acts on each link at all samples, computed once."""
        return BodiesOverTime(self.model, self.q, self.v, self.a, self.external, self.welded)

    def only(self, k: int) -> BodiesOverTime:
        """What acts on each link at sample k alone."""
        rows = slice(k, k + 1)
        return BodiesOverTime(self.model, self.q[rows], self.v[rows], self.a[rows], {link: w[rows] for link, w in self.external.items()}, self.welded)


def moved_of(results: Results, cases: Sequence[str] | None, robot: str | os.PathLike[str] | None, welded: Welded) -> list[Moved]:
    """The load cases that are asked for, all by default.  Raises MotionError, DescriptionError and ArgumentError."""
    if isinstance(results, ComputedCases):
        if robot is not None:
            raise ArgumentError("robot: a run has its robot; robot= is for results that are read from files")
        chosen = _chosen([case.name for case in results.cases], cases)
        return [
            Moved(case.name, case.model, case.motion.time, case.motion.q, case.motion.resolved_v, case.motion.resolved_a, case.external, welded)
            for case in results.cases
            if case.name in chosen
        ]
    if not isinstance(results, (str, os.PathLike)):
        raise ArgumentError(f"results is {type(results).__name__}; expected a run of ksl.compute_loads, or the folder that `ksl loads` has written")
    require("reading results", "pyarrow")
    path = Path(results)
    if not (path / TABLE).is_file() and not path.is_file():
        raise MotionError(f"{path}: no {TABLE} there; give the folder that `ksl loads` has written")
    first = read_results(path)
    names = [str(case["name"]) for case in first.made_by.get("cases", [])] or [first.case]
    return [_of_file(path, name, robot, welded) for name in _chosen(names, cases)]


def _of_file(path: Path, case: str, robot: str | os.PathLike[str] | None, welded: Welded) -> Moved:
    results = read_results(path, case or None)
    model = model_of_results(results, str(path), robot)
    time, q, v, a = motion_of_results(model, results)
    external, why_none = external_of_results(model, results, time)
    if why_none:
        raise MotionError(
            f"{path}: external wrenches of load case {case} can't be read again, since {why_none}; compute the run in Python and give it to ksl.free_bodies"
        )
    require_same(model, results, str(path), (q, v, a), external)
    return Moved(case, model, time, q, v, a, external, welded)


def _chosen(names: Sequence[str], asked: Iterable[str] | None) -> list[str]:
    if asked is None:
        return list(names)
    wanted = [asked] if isinstance(asked, str) else list(asked)
    for name in wanted:
        if name not in names:
            raise of_argument(ArgumentError, "cases", f": {unknown_name('the results', 'load case', name, names)}")
    return [name for name in names if name in wanted]
