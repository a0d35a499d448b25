"""A run: load cases of a robot, their summary, verdict, wrenches, and the files of the results."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from numpy.typing import ArrayLike

from ksl.base.errors import MotionError, unknown_name
from ksl.base.printable import one_line
from ksl.load_cases.case_result import CaseResult, compute
from ksl.load_cases.load_case import LoadCase, Payload, Placement
from ksl.load_cases.motion_given import motion_given
from ksl.load_cases.provenance import InputFile, Provenance, input_file, provenance_of
from ksl.load_cases.ranking import Ranking, severity
from ksl.load_cases.result_files import RESULTS, WrenchFiles, refuse_others
from ksl.load_cases.summary_table import SUMMARY, summary_table, worst_rows, write_summary
from ksl.load_cases.verdict import NAMED, Verdict, not_given
from ksl.load_cases.wrench_table import TableWriter, wrenches_of_arrays
from ksl.model.model import Model
from ksl.model.states import External, Order, Point, Side
from ksl.motions.motion import Motion
from ksl.motions.reading_options import check_options
from ksl.output import refuse_inputs, staged, whole_file
from ksl.report.files import ReportFiles

if TYPE_CHECKING:
    import pyarrow as pa

    from ksl.report.input import ReportInput

KEPT_CASES, KEPT_CURVES = 5, 24
"""The report has the curves of the load cases that govern most: of so many at most, and of so many joints in all of them together, but of one at least."""

MotionGiven = str | os.PathLike[str] | Motion | Sequence[ArrayLike] | Any
"""`Any`: a table of pandas, polars or pyarrow."""


class Run:
    """Load cases of a robot and their results, which are computed when they are first asked for.

    All load cases have the same joints and the same placement of wrenches.
    """

    def __init__(self, cases: Sequence[LoadCase], provenance: Provenance) -> None:
        self.cases = tuple(cases)
        self.provenance = provenance
        """Inputs with their hashes, options, versions, date, command line."""
        self._results: list[CaseResult] | None = None
        self._ranking = Ranking()

    @property
    def model(self) -> Model:
        """That of the first load case."""
        return cast(Model, self.cases[0].model)

    @property
    def results(self) -> list[CaseResult]:
        """Of each load case."""
        if self._results is None:
            self._compute()
        assert self._results is not None
        return self._results

    @property
    def summary(self) -> pa.Table:
        """A row per load case and joint: peaks with their times, rms, work; if there are several cases, the worst over all below them.

        Columns as in summary.csv; the metadata (key `ksl`, JSON) says units and what made the numbers.
        """
        return summary_table(self.rows, self.provenance)

    @property
    def wrenches(self) -> pa.Table:
        """Every wrench: a row for each load case, sample and joint, as in wrenches.parquet.  Computed anew each time."""
        import pyarrow as pa

        writer = self._writer()
        return pa.concat_tables([writer.table(block, i) for i, case in enumerate(self.cases) for block in case.blocks()])

    @property
    def rows(self) -> list[dict[str, float | str | None]]:
        """The rows of the summary for the chosen joints, without the worst over all cases."""
        wanted = self.cases[0].placement.wanted
        return [row for result in self.results for row in result.rows if wanted(str(row["joint"]))]

    @property
    def verdict(self) -> Verdict:
        """Red, amber or green over all load cases and joints."""
        lines = self._of_cases([(r.case.name, doubt) for r in self.results for doubt in dict.fromkeys(r.doubts)])
        return Verdict(tuple(use for r in self.results for use in r.uses), (*lines, *not_given(self.model.joints)))

    @property
    def notes(self) -> list[str]:
        """Lines by weight: limits exceeded, doubts, other warnings, what was differentiated, and last what is not used."""
        verdict, several = self.verdict, len(self.cases) > 1
        exceeded = [f"{use.case}: {use.exceeded}" if several else use.exceeded for use in verdict.exceeded]
        read = self._of_cases([(c.name, line) for c in self.cases if c.motion.source for line in c.motion.source.notes])
        differentiated = self._of_cases([(c.name, line) for c in self.cases for line in c.motion.differentiated])
        unused = [f"in the file and not used: {line}" for line in self.model.unused]
        return list(dict.fromkeys([*exceeded, *verdict.reasons, *read, *self.model.warnings, *differentiated, *unused]))

    def _of_cases(self, lines: Sequence[tuple[str, str]]) -> list[str]:
        """Each line once, behind the names of the cases that say it, if there are several cases and not all of them say it."""
        by_line: dict[str, list[str]] = {}
        for name, line in lines:
            by_line.setdefault(line, []).append(name)
        return [line if len(names) == len(self.cases) else f"{_listed(names)}: {line}" for line, names in by_line.items()]

    @property
    def governing(self) -> CaseResult:
        """The result of the load case with the worst use of a limit; where there are no limits, with the largest effort."""
        return max(self.results, key=severity)

    def write(
        self, directory: str | os.PathLike[str], csv: bool = False, force: bool = False, advance: Callable[[int], None] | None = None,
        report: ReportFiles = ReportFiles(),
    ) -> list[str]:  # fmt: skip
        """Writes wrenches.parquet, summary.csv and report.html.

        csv: wrenches.csv too.  force: results of another robot in that folder, and files of others with names of results, are replaced
        and not refused; files that the run reads never are.  advance: is told the number of samples of each block that is done.
        report: whether there shall be report.json and report.pdf, and components that the report checks.  Returns the names of the files.  All are written, or none: see :func:`staged`.
        Raises MotionError where results are not finite, SizingError and OutputError.
        """
        folder = Path(directory)
        refuse_inputs([folder / name for name in RESULTS], [*self._files_read, *([report.components] if report.components else [])])
        check = None if force else partial(refuse_others, folder, self.provenance)
        with staged(folder, RESULTS, check) as stage:
            with WrenchFiles(stage, self._writer(), csv) as files:
                self._compute(files, advance)
            write_summary(stage / SUMMARY, self.rows, self.provenance)
            report.write(stage, replace(self._report_input(self._shown()), sizing=report.sizing(stage, folder)))
            return sorted(f.name for f in stage.iterdir())

    def report(self, path: str | os.PathLike[str], case: str | None = None) -> None:
        """Writes the report as one HTML file: of the load cases that govern most, or of one that is named.  Raises OutputError, also if the run reads that file."""
        from ksl.report.page import write_report

        refuse_inputs([Path(path)], self._files_read)
        by_name = {r.case.name: r for r in self.results}
        if case is not None and case not in by_name:
            raise ValueError(unknown_name("report", "load case", case, by_name))
        shown = self._report_input(self._shown() if case is None else [by_name[case]])
        with whole_file(Path(path)) as part:
            write_report(part, shown)

    @property
    def _files_read(self) -> list[str]:
        return [os.path.join(self.provenance.directory, f.file) for f in self.provenance.inputs]

    def _shown(self) -> list[CaseResult]:
        """The results whose curves the report has, those that matter most first."""
        results = self.results
        return [results[i] for i in self._ranking.first(self._most)]

    def _report_input(self, shown: Sequence[CaseResult]) -> ReportInput:
        from ksl.report.input_of_run import report_input

        return report_input([r if r.loads is not None else compute(r.case) for r in shown], self.rows, self.provenance, self.verdict, self.notes)

    @property
    def _most(self) -> int:
        """Of how many load cases the report has curves."""
        wanted = sum(self.cases[0].placement.wanted(j.name) for j in self.model.joints)
        return max(1, min(KEPT_CASES, KEPT_CURVES // max(1, wanted)))

    def _writer(self) -> TableWriter:
        return TableWriter(self.model, self.cases[0].placement, self.provenance)

    def _compute(self, files: WrenchFiles | None = None, advance: Callable[[int], None] | None = None) -> None:
        """Computes all load cases, one after the other, and writes their wrenches.  Of many, only the curves of those that govern most are kept."""
        results: list[CaseResult] = []
        ranking = Ranking()
        kept: list[int] = []
        wanted = [j.name for j in self.model.joints if self.cases[0].placement.wanted(j.name)]
        for i, case in enumerate(self.cases):
            sink = partial(files.write, case=i) if files else None
            results.append(compute(case, sink, advance))
            ranking.add(results[i], wanted)
            kept.append(i)
            if len(kept) > self._most:
                kept, dropped = (best := ranking.first(self._most, kept)), next(k for k in kept if k not in best)
                results[dropped] = replace(results[dropped], loads=None)
        self._results, self._ranking = results, ranking

    def __repr__(self) -> str:
        cases = f"{len(self.cases)} load cases" if len(self.cases) > 1 else f"load case {self.cases[0].name}"
        verdict = self.verdict
        return f"<ksl run of {self.provenance.robot}: {cases}, {verdict.level}: {verdict.headline}>"

    def _repr_html_(self) -> str:
        """For notebooks: the verdict, and the shares of limits."""
        verdict = self.verdict
        color = {"green": "#2e7d32", "amber": "#b26a00", "red": "#c62828"}[verdict.level]
        head = f'<p><b style="color:{color}">{verdict.level.upper()}</b> {escape(verdict.headline)}</p>'
        reasons = "".join(f"<li>{escape(reason)}</li>" for reason in verdict.reasons)
        rows = "".join(_html_row(str(row["joint"]), row, verdict) for row in worst_rows(self.rows))
        columns = "".join(f"<th>{name}</th>" for name in ("joint", "position", "speed", "effort", "effort peak"))
        table = f"<table><thead><tr>{columns}</tr></thead><tbody>{rows}</tbody></table>"
        return f"{head}{f'<ul>{reasons}</ul>' if reasons else ''}{table}"


def _listed(names: Sequence[str]) -> str:
    return ", ".join(names[:NAMED]) + (f" and {len(names) - NAMED} more" if len(names) > NAMED else "")


def _html_row(joint: str, row: Mapping[str, float | str | None], verdict: Verdict) -> str:
    from ksl.load_cases.verdict import percent

    uses = verdict.of(joint)
    shares = "".join(f"<td>{percent(uses[q].share) if q in uses else '–'}</td>" for q in ("position", "speed", "effort"))
    effort = row.get("effort_peak")
    return f"<tr><th>{escape(joint)}</th>{shares}<td>{f'{float(effort):.4g}' if effort is not None else '–'}</td></tr>"


def loads(
    model: Model | str | os.PathLike[str],
    motion: MotionGiven | None = None,
    cases: str | os.PathLike[str] | Sequence[LoadCase] | None = None,
    *,
    payloads: Mapping[str, tuple[float, Sequence[float]]] | None = None,
    external: External | None = None,
    on: Side = "child",
    at: Point | Mapping[str, Sequence[float]] = "joint",
    axes: str = "joint",
    order: Order = "lin_ang",
    joints: str | Sequence[str] = (),
    reading: Mapping[str, Any] | None = None,
) -> Run:
    """Every wrench of a robot along a motion, or in several load cases, as one object: what `ksl loads` does.

    model: a model, or the robot's file.  motion: a file; time (n), q (n, nq) and, if known, v and a (n, nv); or a table
    of pandas, polars or pyarrow with the columns of a file: `time`, the joints' positions and, if known, rates.
    cases: a file of load cases (TOML; docs/cases.md), where `motion` is that of cases that name none; or load cases.
    payloads: {link: (mass in kg, point in the link's frame in m)}, point masses beside what the model carries; for one motion.
    external: {link: (n, 6), or (6) for all samples}: wrenches of the environment, at the link's origin, in its axes; for one motion.
    on, at, axes, order: as in :meth:`Model.reactions`; `at` may also be {joint: (x, y, z)}: points of single joints, others
    have theirs at "joint".  joints: one or several, whose wrenches are wanted; all by default.
    reading: arguments of :func:`ksl.read_motion`, for example {"degrees": True, "smooth": 20}.
    Raises MotionError, DescriptionError or ValueError, and says how to mend it.  Needs the extra `ksl[loads]`.
    """
    from ksl.model.loading import load

    robot = model if isinstance(model, Model) else load(model)
    if reading is not None and not isinstance(reading, Mapping):
        raise MotionError(f"reading is {type(reading).__name__}; expected a mapping with arguments of ksl.read_motion")
    check_options("reading", reading or {})
    joints = (joints,) if isinstance(joints, str) else tuple(joints)
    common: Point = at if not isinstance(at, Mapping) else "joint"
    points = {joint: tuple(float(x) for x in point) for joint, point in at.items()} if isinstance(at, Mapping) else {}
    placement = checked(robot, Placement(on, common, axes, order, points, joints))
    inputs = [input_file("robot", robot.file)] if robot.file and os.path.exists(robot.file) else []
    if cases is None:
        if motion is None:
            raise MotionError("loads needs a motion, or load cases")
        case, more = one_case(robot, motion, placement, payloads, external, reading)
        found = [case]
    elif isinstance(cases, (str, os.PathLike)):
        from ksl.load_cases.case_file import read_cases

        found, more = read_cases(robot, cases, placement, motion if isinstance(motion, (str, os.PathLike)) else None, reading=reading)
    elif all(isinstance(case, LoadCase) for case in cases):
        found, more = [replace(case, placement=placement) for case in cases], []
    else:
        raise MotionError("cases: expected a file of load cases, or a list of ksl.load_cases.load_case.LoadCase")
    if not found:
        raise MotionError("loads: no load cases")
    run = Run(found, provenance_of(found, [*inputs, *more], {"on": on, "at": _shown(at), "axes": axes, "order": order, "joints": list(joints), **(reading or {})}))
    run._compute()
    return run


def _shown(at: object) -> str:
    return at if isinstance(at, str) else str(at)


def checked(model: Model, placement: Placement) -> Placement:
    """The same placement.  Raises ValueError for unknown sides, points, axes, orders and joints."""
    for joint in (*placement.joints, *placement.points):
        model.joint(joint)
    for point in (placement.at, *placement.points.values()):
        model._request(placement.on, point, placement.axes, placement.order, "total", [])
    return placement


def one_case(
    model: Model,
    motion: MotionGiven,
    placement: Placement,
    payloads: Mapping[str, tuple[float, Sequence[float]]] | None = None,
    external: External | None = None,
    reading: Mapping[str, Any] | None = None,
) -> tuple[LoadCase, list[InputFile]]:
    """The load case of one motion, and the files that it comes from."""
    from ksl.model.given import payload_points
    from ksl.motions.reading import read_motion

    carried = [Payload(link, mass, (x, y, z)) for link, mass, (x, y, z) in payload_points(payloads)]
    for p in carried:
        model = model.with_payload(p.link, p.mass, p.center)
    if isinstance(motion, (str, os.PathLike)):
        file = os.fspath(motion)
        moved, name, inputs = read_motion(model, file, **(reading or {})), one_line(Path(file).stem), [input_file("motion", file)]
    else:
        file, name, inputs = "", "motion", []
        moved = motion_given(model, motion)
    wrenches = wrenches_of_arrays(external, len(moved.time))
    return LoadCase(model, moved, placement, wrenches, name, file, carried), inputs
