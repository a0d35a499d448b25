"""The files of a report: report.html, and on request report.json and report.pdf."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ksl.report.input import ReportInput
from ksl.report.pdf import Paper, find_browser, write_pdf

NAMES = ("report.html", "report.json", "report.pdf")


@dataclass(frozen=True)
class ReportFiles:
    """Which files there shall be."""

    json: bool = False
    paper: Paper | None = None
    """Of report.pdf; None for no such file."""
    browser: str = ""
    """That prints it."""

    @staticmethod
    def wanted(json: bool = False, paper: Paper | None = None) -> ReportFiles:
        """Finds the browser if a PDF is wanted.  Raises OutputError if there is none: before an hour of work rather than after it."""
        return ReportFiles(json, paper, find_browser() if paper else "")

    def write(self, directory: Path, report: ReportInput) -> None:
        from ksl.report.page import write_report

        write_report(directory / "report.html", report)
        if self.json:
            from ksl.report.json_file import write_json

            write_json(directory / "report.json", report)
        if self.paper:
            write_pdf(directory / "report.html", directory / "report.pdf", self.browser, self.paper)
