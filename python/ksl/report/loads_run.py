"""A run: load cases with their results, and the files that are written of them."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property, partial
from ksl.base.markup import html as escape
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

from ksl.base.errors import unknown_name
from ksl.base.notes import NoteKind, not_of_kind
from ksl.load_cases.case_result import CaseResult, compute_case
from ksl.load_cases.computed_cases import ComputedCases
from ksl.load_cases.summary_table import SUMMARY, worst_rows, write_summary
from ksl.load_cases.verdict import Verdict, percent
from ksl.output import refuse_inputs, staged, whole_file
from ksl.report import mat_file, mcap_file, rrd_file
from ksl.report.files import ReportFiles
from ksl.report.result_files import RESULTS, WrenchFiles, refuse_others
from ksl.report.workbook import WORKBOOK, check_package, write_workbook

if TYPE_CHECKING:
    from ksl.report.html.input import ReportInput
    from ksl.sizing.joints.sizing import Sizing


class Run(ComputedCases):
    """Load cases of a robot and their results, and the files and the report of them.

    All load cases have the same joints and the same placement of wrenches.  Results are computed when they are first asked for.
    """

    sizing: Sizing | None = None
    """The components that the written report judges."""

    def write(
        self, directory: str | os.PathLike[str], csv: bool = False, force: bool = False, advance: Callable[[int], None] | None = None,
        report: ReportFiles = ReportFiles(), beside: Mapping[str, Callable[[Path], None]] = MappingProxyType({}), xlsx: bool = False,
        mcap: bool = False, mat: bool = False, rrd: bool = False,
    ) -> list[str]:  # fmt: skip
        """Writes wrenches.parquet, summary.csv and report.html.

        csv: wrenches.csv too.  force: results of another robot in that folder, and files of others with names of results, are replaced
        and not refused; files that the run reads never are.  advance: is told the number of samples of each block that is done.
        report: whether there shall be report.json and report.pdf, and components that the report checks.  beside: more files by name, and what
        writes each.  xlsx: results.xlsx too, a sheet for each table, with units; needs the extra `ksl[xlsx]`.
        mcap: wrenches.mcap, messages of ROS 2 for Foxglove, PlotJuggler and RViz; needs `ksl[bags]`.  mat: wrenches.mat for MATLAB.
        rrd: wrenches.rrd, a recording for Rerun; needs `ksl[rerun]`.
        Returns the names of the files.  All are written, or none: see :func:`staged`.
        Raises MotionError where results are not finite, SizingError and OutputError.

            ksl.compute_loads("robot.urdf", "motion.csv").write("results", csv=True)
        """
        folder = Path(directory)
        if xlsx:
            check_package()
        if mcap:
            mcap_file.check_package()
        if rrd:
            rrd_file.check_package()
        names = (*RESULTS, *beside)
        refuse_inputs([folder / name for name in names], [*self._files_read, *([report.components] if report.components else [])])
        check = None if force else partial(refuse_others, folder, self.provenance)
        with staged(folder, names, check) as stage:
            with WrenchFiles(stage, self.writer(), csv) as files:
                self.compute(files.write, advance)
            write_summary(stage / SUMMARY, self.rows, self.provenance)
            if xlsx:
                write_workbook(stage / WORKBOOK, stage / "wrenches.parquet", self.rows, self.provenance)
            if mcap:
                mcap_file.write_mcap(stage / mcap_file.FILE, self.cases, self.provenance)
            if mat:
                mat_file.write_mat(stage / mat_file.FILE, self.cases, self.provenance)
            if rrd:
                rrd_file.write_rrd(stage / rrd_file.FILE, self.cases, self.provenance)
            self.sizing = report.sizing(stage, folder)
            report.write(stage, replace(self._report_input(self._shown()), sizing=self.sizing))
            for name, write in beside.items():
                write(stage / name)
            return sorted(f.name for f in stage.iterdir())

    def report(self, path: str | os.PathLike[str], case: str | None = None) -> None:
        """Writes the report as one HTML file: of the load cases that govern most, or of one that is named.  Raises OutputError, also if the run reads that file."""
        from ksl.report.html.page import write_report

        refuse_inputs([Path(path)], self._files_read)
        by_name = {r.case.name: r for r in self.results}
        if case is not None and case not in by_name:
            raise ValueError(unknown_name("report", "load case", case, by_name))
        shown = self._report_input(self._shown() if case is None else [by_name[case]])
        with whole_file(Path(path)) as part:
            write_report(part, shown)

    @property
    def notes(self) -> list[str]:
        """The notes of the load cases; what the pictures of the report show is not called unused, and meshes that they lack are named."""
        drawn, missing = self._pictures
        notes = [*super().notes, *missing]
        return not_of_kind(notes, NoteKind.VISUALS) if drawn else notes

    @cached_property
    def _pictures(self) -> tuple[bool, list[str]]:
        from ksl.viewer.visuals import of_file

        return of_file(self.model)

    @property
    def _files_read(self) -> list[str]:
        return [os.path.join(self.provenance.directory, f.file) for f in self.provenance.inputs]

    def _shown(self) -> list[CaseResult]:
        """The results whose curves the report has, those that matter most first."""
        results = self.results
        return [results[i] for i in self._ranking.first(self._most)]

    def _report_input(self, shown: Sequence[CaseResult]) -> ReportInput:
        from ksl.report.input_of_run import report_input

        return report_input(
            [r if r.loads is not None else compute_case(r.case) for r in shown], self.cases, self.rows, self.provenance, self.verdict, self.notes
        )

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


def _html_row(joint: str, row: Mapping[str, float | str | None], verdict: Verdict) -> str:
    uses = verdict.of(joint)
    shares = "".join(f"<td>{percent(uses[q].share) if q in uses else '–'}</td>" for q in ("position", "speed", "effort"))
    effort = row.get("effort_peak")
    return f"<tr><th>{escape(joint)}</th>{shares}<td>{f'{float(effort):.4g}' if effort is not None else '–'}</td></tr>"
