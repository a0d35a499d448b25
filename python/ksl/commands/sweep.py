"""`ksl sweep`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, cast

import typer

from ksl.commands.app import app, console, errors, fail
from ksl.commands.options import Packages, Robot, Xacro, described_warnings, in_options, path_with_a_name, xacro_arguments

if TYPE_CHECKING:
    from ksl.sweeps.compute_sweep import SweepResults

PRINTED = 8
"""So many of the largest shares."""
NO_PARAMETERS = ("joint", "quantity", "value", "unit", "case", "undetermined")


@app.command()
def sweep(
    robot: Robot,
    description: Annotated[Path, typer.Argument(metavar="SWEEP.toml", help="What is varied, and between what.")],
    output: Annotated[
        Path, typer.Option("--output", "-o", parser=path_with_a_name, metavar="DIR", help="Folder for the results; a run that was stopped goes on there.")
    ] = Path("sweep"),
    engine: Annotated[str, typer.Option(metavar="local|ray", help="Processes of this machine, or a Ray cluster.")] = "local",
    workers: Annotated[int, typer.Option(metavar="N", help="Processes; 0: one for each core.")] = 0,
    address: Annotated[
        str, typer.Option("--ray-address", metavar="ADDRESS", help="Of an existing Ray cluster; otherwise RAY_ADDRESS, or a new one here.")
    ] = "",
    wrenches: Annotated[bool, typer.Option("--wrenches", help="Every wrench at every sample too: large.")] = False,
    force: Annotated[bool, typer.Option("--force", help="Replace the results of another sweep in DIR.")] = False,
    xacro: Xacro = None,
    package: Packages = [],
) -> None:
    """Compute thousands of variants of a load case: payloads, speeds, mountings, motions, uncertain masses.

    Writes cases/part-….parquet, a row for each case and joint, and worst.csv. A run that was interrupted goes on where it stopped.
    """
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

    from ksl.robot_files.xacro_files import Arguments
    from ksl.output import OutputError
    from ksl.sweeps.compute_sweep import sweep as run_sweep

    if workers < 0:
        fail(f"--workers {workers}: expected a number of processes, or 0")
    arguments = xacro_arguments(xacro, package)
    out = console(120)
    columns = (TextColumn("cases"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(), TextColumn("to go"), TimeRemainingColumn())
    try:
        with described_warnings(), Progress(*columns, console=out, transient=True, disable=not out.is_terminal) as progress:
            task = progress.add_task("cases", total=None)
            results = run_sweep(
                robot,
                description,
                output,
                engine=cast(Literal["local", "ray"], engine),
                workers=workers or None,
                address=address or None,
                wrenches=wrenches,
                force=force,
                xacro=arguments,
                packages=arguments.packages if isinstance(arguments, Arguments) else None,
                progress=lambda done, cases: progress.update(task, completed=done, total=cases),
            )
    except KeyboardInterrupt:
        errors.print(f"ksl: interrupted; what is complete is in {output}: the same command goes on from there")
        raise typer.Exit(130) from None
    except (ValueError, OutputError) as e:
        fail(in_options(e, engine=engine))
    print_results(results)


def print_results(results: SweepResults) -> None:
    """The largest shares of limits, or where there are none the largest efforts and moments, and how long it took."""
    from rich.table import Table
    from rich.text import Text

    from ksl.load_cases.quantities import UNDETERMINED
    from ksl.load_cases.undetermined import FOOTNOTE, MARK
    from ksl.load_cases.verdict import percent
    from ksl.report.html.numbers import format_number
    from ksl.sweeps.compute_sweep import again_of

    out = console(80)
    shares = [row for row in results.worst if row["quantity"].endswith(("_share", "utilisation"))]
    rest = [row for row in results.worst if row["quantity"] in ("effort_peak", "moment_peak", "bending_moment_peak")]
    head = "share" if shares else "largest"
    table = Table("joint", "limit of" if shares else "what", head, "in case", box=None, pad_edge=False, header_style="dim")
    table.columns[2].justify = "right"
    for row in sorted(shares or rest, key=lambda row: -row["value"])[:PRINTED]:
        value = percent(row["value"]) if shares else f"{format_number(row['value'])} {row['unit']}{MARK if row.get(UNDETERMINED) == 'yes' else ''}"
        at = ", ".join(f"{name} {_shown(x)}" for name, x in row.items() if name not in NO_PARAMETERS)
        what = row["quantity"].rpartition("_")[0].replace("_", " ") or "components"
        table.add_row(Text(row["joint"]), what, value, Text(f"{row['case']}: {at}"))
    out.print(table)
    if not shares and any(row.get(UNDETERMINED) == "yes" for row in rest):
        out.print(Text(FOOTNOTE))
    rate = f", {results.computed / results.seconds:.0f} a second; {100 * results.share_of_dynamics:.0f} % of the time was dynamics"
    out.print(
        Text(
            f"{results.computed} cases computed in {results.seconds:.1f} s{rate if results.computed else ': all were there, computed from these files'}{again_of(results.replaced)}"
        )
    )
    out.print(Text(f"written to {results.directory}: cases/part-….parquet, worst.csv, sweep.json"), soft_wrap=True)


def _shown(x: float | str) -> str:
    return x if isinstance(x, str) else f"{x:.6g}"
