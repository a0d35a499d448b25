"""The files of a report: report.html, and on request report.json and report.pdf."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from ksl.base.errors import SizingError
from ksl.report.html.input import ReportInput
from ksl.report.pdf import Paper, find_browser, write_pdf

if TYPE_CHECKING:
    from ksl.sizing.joints.sizing import Sizing

NAMES = ("report.html", "report.json", "report.pdf")


@dataclass(frozen=True)
class ReportFiles:
    """Which files there shall be."""

    json: bool = False
    paper: Paper | None = None
    """The paper of report.pdf; None for no such file."""
    browser: str = ""
    """The browser that prints report.pdf."""
    components: Path | None = None
    """A file for :func:`ksl.size`, whose figures are shown beside the curves of their joints."""

    @staticmethod
    def wanted(json: bool = False, paper: Paper | None = None, components: Path | None = None) -> ReportFiles:
        """Finds the browser if a PDF is wanted, and reads the components.

        Raises OutputError without a browser, and SizingError for components: before an hour of work rather than after it.
        """
        if components is not None:
            from ksl.sizing.catalogue.components import read_components

            read_components(components)
        return ReportFiles(json, paper, find_browser() if paper else "", components)

    def sizing(self, directory: Path, later: Path) -> Sizing | None:
        """The components against the wrenches in a folder; None without components.  later: where they will be found.  Raises SizingError."""
        if self.components is None:
            return None
        from ksl.sizing.joints.compute_sizing import size

        try:
            found = size(directory, self.components)
        except SizingError as e:
            raise SizingError(f"{e}".replace(str(directory), str(later))) from None  # the name of the folder, and no word of the sentence
        except ModuleNotFoundError as e:
            raise SizingError(f"{self.components}: needs the package {e.name}; install it with: pip install 'ksl[size]'") from None
        for file in found.provenance["inputs"]:
            if file["role"] == "results":
                file["file"] = str(later / Path(file["file"]).name)
        return found

    def write(self, directory: Path, report: ReportInput) -> None:
        from ksl.report.html.page import write_report

        write_report(directory / "report.html", report)
        if self.json:
            from ksl.report.json_file import write_json

            write_json(directory / "report.json", report)
        if self.paper:
            write_pdf(directory / "report.html", directory / "report.pdf", self.browser, self.paper)
