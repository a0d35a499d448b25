"""The job of `ksl loads`: runs a load case and writes its files."""

from __future__ import annotations

import csv as csv_module
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.progress import Progress
from rich.table import Table
from rich.text import Text

from ksl._core import __version__
from ksl.errors import MotionError
from ksl.loads import Block, Curves, LoadCase, Placement, TableWriter, exceeded_limits
from ksl.mechanism import Joint, Mechanism
from ksl.output import staged
from ksl.quantities import EFFORT_PARTS, JointLoads, PowerBalance, summarise, unit

if TYPE_CHECKING:
    import pyarrow as pa

SummaryRow = dict[str, "float | str | None"]

RESULTS = ("wrenches.parquet", "wrenches.csv", "summary.csv", "report.html")
"""Files that a run may write.  Those that it doesn't write are removed, since they are from an earlier run."""


def run_loads(case: LoadCase, motion_file: str, directory: Path, with_csv: bool, console: Console) -> None:
    """Computes everything, writes wrenches.parquet (and .csv), summary.csv and report.html into `directory`, prints the summary."""
    curves = Curves(case)
    with staged(directory, RESULTS) as stage, np.errstate(over="ignore", invalid="ignore"):  # what is not finite is refused
        with Progress(console=console, transient=True, disable=not console.is_terminal) as progress:
            task = progress.add_task("wrenches", total=len(case.motion.time))
            _write_wrenches(case, motion_file, curves, stage, with_csv, lambda n: progress.advance(task, n))
        balance = curves.power_balance()
        rows = [summarise(case.motion.time, loads) for loads in curves.loads]
        _check_summary(motion_file, rows, balance)
        _write_summary(stage / "summary.csv", rows)
        notes = _notes(case, curves)
        _write_report(stage / "report.html", case, motion_file, curves, balance, rows, notes)
        files = sorted(f.name for f in stage.iterdir())
    _print_summary(console, rows, curves.loads, case.placement)
    for line in notes:
        console.print(Text(f"note: {line}"), soft_wrap=True)
    console.print(Text(_balance_line(balance)), soft_wrap=True)
    console.print(Text(f"written to {directory}: {', '.join(files)}"), soft_wrap=True)
    console.print(Text(f"report: {directory / 'report.html'}"), soft_wrap=True)


def _write_wrenches(case: LoadCase, motion_file: str, curves: Curves, stage: Path, with_csv: bool, advance: Callable[[int], None]) -> None:
    """Computes block after block, while a second thread writes the previous one."""
    import pyarrow.csv
    import pyarrow.parquet

    writer = TableWriter(case.model, case.placement)
    sinks = [pyarrow.parquet.ParquetWriter(stage / "wrenches.parquet", writer.schema, compression="zstd", use_dictionary=["joint", "on", "at", "axes"])]
    if with_csv:
        sinks.append(pyarrow.csv.CSVWriter(stage / "wrenches.csv", _plain(writer.schema), write_options=pyarrow.csv.WriteOptions(quoting_style="needed")))

    def write(block: Block) -> None:
        table = writer.table(block)
        sinks[0].write_table(table)
        if with_csv:
            sinks[1].write_table(table.cast(_plain(writer.schema)))

    with ThreadPoolExecutor(1) as pool:
        pending = None
        for block in case.blocks():
            _check_block(case, motion_file, block)
            if pending:
                pending.result()
            pending = pool.submit(write, block)
            curves.add(block)
            advance(len(block.time))
        if pending:
            pending.result()
    for sink in sinks:
        sink.close()


def _check_block(case: LoadCase, motion_file: str, block: Block) -> None:
    """Refuses results that overflow, because numbers of the motion, of external wrenches or of the robot are finite but huge."""
    power = block.tau * block.v
    for x in (block.total, block.constraint, block.in_joint_axes):
        if not np.isfinite(x).all():
            sample, joint, _ = np.argwhere(~np.isfinite(x))[0]
            raise _overflow(motion_file, case.model.joints[joint].name, f"sample {block.rows.start + sample + 1} (time {block.time[sample]:.9g})", "wrench")
    parts = [] if block.parts is None else [(name, block.parts[:, i]) for i, name in enumerate(EFFORT_PARTS)]
    for what, x in (("effort", block.tau), ("power", power), *parts):
        if not np.isfinite(x).all():
            sample, column = np.argwhere(~np.isfinite(x))[0]
            joint = next(j.name for j in case.model.joints if j.v_index <= column < j.v_index + j.nv)
            raise _overflow(motion_file, joint, f"sample {block.rows.start + sample + 1} (time {block.time[sample]:.9g})", what)


def _check_summary(motion_file: str, rows: list[SummaryRow], balance: PowerBalance | None) -> None:
    """Refuses a summary that overflows: squares, integrals and energies may overflow even if wrenches don't."""
    for row in rows:
        for name, value in row.items():
            if isinstance(value, float) and not np.isfinite(value):
                raise _overflow(motion_file, str(row["joint"]), "summary", name)
    if balance is not None and not (np.isfinite(balance.energy).all() and np.isfinite(balance.residual).all()):
        raise _overflow(motion_file, "all joints", "power balance", "energy or power")


def _overflow(motion_file: str, joint: str, where: str, what: str) -> MotionError:
    return MotionError(
        f"{motion_file}: {where}: {what} of {joint} is not finite; "
        "positions, rates, external wrenches or masses are too large: check their units (rad, m, s, N, N m, kg)"
    )


def _plain(schema: pa.Schema) -> pa.Schema:
    """The schema with plain strings instead of dictionaries, as CSV needs."""
    import pyarrow as pa

    return pa.schema([pa.field(f.name, pa.string() if pa.types.is_dictionary(f.type) else f.type) for f in schema])


def _write_summary(path: Path, rows: list[SummaryRow]) -> None:
    names = list(dict.fromkeys(name for row in rows for name in row))
    with open(path, "w", newline="", encoding="utf-8") as f:
        table = csv_module.DictWriter(f, names, restval="")
        table.writeheader()
        table.writerows(rows)


def _notes(case: LoadCase, curves: Curves) -> list[str]:
    """Notes for the user: rates that were differentiated or contradict, exceeded limits, impossible inertias, unused content."""
    unused = [f"in the file and not used: {line}" for line in case.model.unused]
    return [*case.motion.differentiated, *case.motion.contradictions, *exceeded_limits(case.model, case.motion, curves.loads), *case.model.warnings, *unused]


def _balance_line(balance: PowerBalance | None) -> str:
    if balance is None:
        return "power balance: too few samples to differentiate the energy"
    if balance.at_rest:
        return "power balance: no power but round-off: nothing moves, or what moves takes no power"
    return (
        f"power balance: largest residual {abs(balance.residual).max():.3g} W, {balance.relative_residual:.2g} of the largest power "
        f"(drive + external{'' if balance.dissipation is None else ' − dissipation'} against the rate of change of energy)"
    )


def _physics(model: Mechanism) -> str:
    """What is on, and the width of friction where its smooth law is."""
    width = f" (smooth, width {model.friction_width:g} rad/s or m/s unless the file gives another)" if "friction" in model.physics else ""
    return ", ".join(name + width if name == "friction" else name for name in model.physics) + ": the effort is the motor's"


def _write_report(path: Path, case: LoadCase, motion_file: str, curves: Curves, balance: PowerBalance | None, rows: list[SummaryRow], notes: list[str]) -> None:
    from ksl.report import ReportInput, write_report

    p, m = case.placement, case.model
    facts = [
        ("robot", f"{m.name} ({m.file})"),
        ("motion", motion_file),
        ("samples", f"{len(case.motion.time)}, from {case.motion.time[0]:.10g} s to {case.motion.time[-1]:.10g} s"),
        ("gravity", f"({', '.join(f'{g:g}' for g in m.gravity)}) m/s² in world axes"),
        ("wrenches", f"on the {p.on} side of the joint, moments about {p.about}; here resolved along and across each joint's axis"),
        ("effort and power", "of each joint's drive, whatever point and side are chosen"),
        *([("physics of joints", _physics(case.model))] if case.model.physics else []),
        ("in the table", f"axes {p.axes}, order {p.order}"),
        ("external wrenches", ", ".join(case.external) or "none"),
        ("made by", f"KSL {__version__}"),
    ]
    write_report(path, ReportInput(f"Joint loads of {m.name}", facts, notes, rows, case.motion.time, curves.loads, balance))


WRENCH = {"axial_force": "axial", "radial_force": "radial", "bending_moment": "bending", "axial_moment": "about axis"}
"""Columns and headings for the wrench of a joint with an axis."""


def _print_summary(console: Console, rows: list[SummaryRow], loads: list[JointLoads], placement: Placement) -> None:
    """Tables: the wrench at the chosen point, what drives supply, what couplings transmit, and joints without one coordinate."""
    joints = {l.joint.name: l.joint for l in loads}
    with_axis, driven = [row for row in rows if "axial_force_peak" in row], [row for row in rows if "effort_peak" in row]
    coupled = [row for row in rows if "coupling_peak" in row]
    wrench = [(q, part) for q in WRENCH for part in ("peak", "rms", "peak_time")]
    drive = [("effort", "peak"), ("effort", "rms"), ("effort", "peak_time"), ("speed", "peak"), ("speed", "peak_time")]
    drive += [("power", "peak"), ("power", "peak_time"), ("power", "mean"), ("work", "positive"), ("work", "negative")]
    whole = [(q, part) for q in ("force", "moment") for part in ("peak", "rms", "peak_time")]
    for title, chosen, columns in (
        (f"Wrench on the {placement.on} side, moments about {placement.about}", with_axis, wrench),
        ("Drive", driven, drive),
        ("What the effort consists of", [row for row in driven if "transmitted_peak" in row], [(q, part) for q in EFFORT_PARTS for part in ("peak", "rms")]),
        ("Coupling: what moves the mimic joints", coupled, [("coupling", "peak"), ("coupling", "rms"), ("coupling", "peak_time"), ("speed", "peak"), ("speed", "peak_time")]),
        ("Joints without one coordinate: magnitudes of the same wrench", [row for row in rows if "force_peak" in row], whole),
    ):
        for scope, together in _by_unit(chosen, joints, {q for q, _ in columns}):
            console.print(_table(title + scope, together, [joints[str(row["joint"])] for row in together], columns))


def _by_unit(rows: list[SummaryRow], joints: dict[str, Joint], quantities: set[str]) -> list[tuple[str, list[SummaryRow]]]:
    """Rows whose quantities have the same units, with what is added to the title: one table of both would be too wide for a terminal."""
    turning = [row for row in rows if joints[str(row["joint"])].has_angle]
    sliding = [row for row in rows if row not in turning]
    if turning and sliding and not quantities.isdisjoint(("effort", "coupling", *EFFORT_PARTS)):
        return [(", joints that turn", turning), (", joints that slide", sliding)]
    return [("", rows)] if rows else []


def _table(title: str, rows: list[SummaryRow], joints: list[Joint], columns: list[tuple[str, str]]) -> Table:
    table = Table(title=Text(title, style="table.title"), title_justify="left", box=SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0))
    table.add_column("joint", overflow="fold")
    words = {"peak_time": "at s", "work": "J"}
    for q, part in columns:
        of = words.get(q) or " or ".join(sorted({unit(q, joint) for joint in joints}))
        name = WRENCH.get(q, q) if part in ("peak", "positive") else ""
        table.add_column(f"{name}\n{words.get(part) or f'{part} {of}'}", justify="right", no_wrap=True)
    for row in rows:
        table.add_row(Text(str(row["joint"])), *(f"{row[f'{q}_{part}']:.4g}" for q, part in columns))
    return table
