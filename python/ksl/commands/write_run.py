"""Writes the files of a run, and shows how far it is where a person watches."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import Console

    from ksl.report.files import ReportFiles
    from ksl.report.loads_run import Run


def written(
    run: Run,
    output: Path,
    out: Console,
    csv: bool,
    force: bool,
    report: ReportFiles,
    beside: Mapping[str, Callable[[Path], None]] = MappingProxyType({}),
    xlsx: bool = False,
    mcap: bool = False,
    mat: bool = False,
    rrd: bool = False,
) -> list[str]:
    """The names of the files.  beside, xlsx, mcap, mat, rrd: as of :meth:`Run.write`."""
    if not out.is_terminal:
        return run.write(output, csv, force, report=report, beside=beside, xlsx=xlsx, mcap=mcap, mat=mat, rrd=rrd)
    from rich.progress import Progress

    with Progress(console=out, transient=True) as progress:
        task = progress.add_task("wrenches", total=sum(len(case.motion.time) for case in run.cases))
        return run.write(output, csv, force, lambda samples: progress.advance(task, samples), report, beside, xlsx, mcap, mat, rrd)
