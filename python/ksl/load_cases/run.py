"""The job of `ksl loads`: runs a load case and writes its files."""

from __future__ import annotations

import csv as csv_module
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from rich.console import Console
from rich.progress import Progress
from rich.text import Text

from ksl.errors import MotionError
from ksl.load_cases.curves import Curves
from ksl.load_cases.load_case import Block, LoadCase
from ksl.load_cases.output import staged
from ksl.load_cases.printing import print_summary, print_verdict
from ksl.load_cases.provenance import UNITS, Provenance
from ksl.load_cases.quantities import EFFORT_PARTS, PowerBalance, SummaryRow, summarise
from ksl.load_cases.verdict import Verdict, not_given, uses_of
from ksl.load_cases.wrench_table import TableWriter
from ksl.mechanism import Mechanism
from ksl.report.files import NAMES as REPORT_FILES
from ksl.report.files import ReportFiles
from ksl.report.input import CaseCurves, ReportInput
from ksl.report.stills import stills_of

if TYPE_CHECKING:
    import pyarrow as pa

RESULTS = ("wrenches.parquet", "wrenches.csv", "summary.csv", *REPORT_FILES)
"""Files that a run may write.  Those that it doesn't write are removed, since they are from an earlier run."""


def run_loads(
    case: LoadCase, provenance: Provenance, directory: Path, with_csv: bool, console: Console, report: ReportFiles = ReportFiles()
) -> Verdict:
    """Computes everything, writes wrenches.parquet (and .csv), summary.csv and report.html into `directory`, prints the summary."""
    curves, motion_file = Curves(case), case.motion_file
    with staged(directory, RESULTS) as stage, np.errstate(over="ignore", invalid="ignore"):  # what is not finite is refused
        with Progress(console=console, transient=True, disable=not console.is_terminal) as progress:
            task = progress.add_task("wrenches", total=len(case.motion.time))
            _write_wrenches(case, provenance, curves, stage, with_csv, lambda n: progress.advance(task, n))
        balance = curves.power_balance()
        rows: list[SummaryRow] = [{"case": case.name, **summarise(case.motion.time, loads)} for loads in curves.loads]
        _check_summary(motion_file, rows, balance)
        _write_summary(stage / "summary.csv", rows, provenance)
        uses = [use for joint, row in zip(case.model.joints, rows, strict=True) for use in uses_of(joint, row, case.motion.time, case.motion.q)]
        verdict = Verdict(tuple(uses), (*_doubts(case, balance), *not_given(case.model.joints)))
        notes = _notes(case, verdict)
        shown = _report_input(case, provenance, curves, balance, rows, notes, verdict)
        report.write(stage, replace(shown, sizing=report.sizing(stage)))
        files = sorted(f.name for f in stage.iterdir())
    print_verdict(console, verdict, case.model.joints)
    print_summary(console, rows, curves.loads, case.placement)
    for line in notes:
        console.print(Text(f"note: {line}"), soft_wrap=True)
    console.print(Text(_balance_line(balance)), soft_wrap=True)
    console.print(Text(f"written to {directory}: {', '.join(files)}"), soft_wrap=True)
    console.print(Text(f"report: {directory / 'report.html'}"), soft_wrap=True)
    return verdict


def _write_wrenches(case: LoadCase, provenance: Provenance, curves: Curves, stage: Path, with_csv: bool, advance: Callable[[int], None]) -> None:
    """Computes block after block, while a second thread writes the previous one."""
    import pyarrow.csv
    import pyarrow.parquet

    writer = TableWriter(case.model, case.placement, provenance)
    sinks = [pyarrow.parquet.ParquetWriter(stage / "wrenches.parquet", writer.schema, compression="zstd", use_dictionary=["case", "joint", "on", "at", "axes"])]
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
            _check_block(case, case.motion_file, block)
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


def _write_summary(path: Path, rows: list[SummaryRow], provenance: Provenance) -> None:
    """A row for each case and joint, below lines that begin with `# ` and say units and what made the numbers."""
    names = list(dict.fromkeys(name for row in rows for name in row))
    head = [("KSL", f"summary of the joint loads of {provenance.robot}"), *provenance.lines()]
    head += [("units", UNITS), ("peaks", "largest magnitudes, and the time of the first sample that has it; rms and mean are weighted by time")]
    with open(path, "w", newline="", encoding="utf-8") as f:
        f.writelines(f"# {name}: {' '.join(text.split())}\n" for name, text in head)
        table = csv_module.DictWriter(f, names, restval="", lineterminator="\n")
        table.writeheader()
        table.writerows(rows)


def _doubts(case: LoadCase, balance: PowerBalance | None) -> list[str]:
    """Why the numbers themselves are doubted, most important first: reasons that forbid a green verdict."""
    lines = [*case.motion.doubts, *case.motion.contradictions]
    if balance is not None and balance.doubtful:
        lines.append(
            f"power balance: the residual is {balance.relative_residual:.2g} of the largest power: positions, velocities and accelerations "
            "of the motion disagree, or it jumps, or its samples are too far apart"
        )
    of_masses = [line for line in case.model.warnings if line.startswith(("link ", "none of the links"))]
    return lines + of_masses


def _notes(case: LoadCase, verdict: Verdict) -> list[str]:
    """Lines for the user by weight: limits exceeded, doubts, other warnings, what was differentiated, and last what is not used."""
    unused = [f"in the file and not used: {line}" for line in case.model.unused]
    read = case.motion.source.notes if case.motion.source else []
    lines = [*(use.exceeded for use in verdict.exceeded), *verdict.reasons, *read, *case.model.warnings, *case.motion.differentiated, *unused]
    return list(dict.fromkeys(lines))


def _balance_line(balance: PowerBalance | None) -> str:
    if balance is None:
        return "power balance: too few samples to differentiate the energy"
    if balance.at_rest:
        return "power balance: no power but round-off: nothing moves, or what moves takes no power"
    return (
        f"power balance: largest residual {abs(balance.residual).max():.3g} W, {balance.relative_residual:.2g} of the largest power "
        f"(drive + external{'' if balance.dissipation is None else ' − dissipation'} against the rate of change of energy)"
    )


def _report_input(
    case: LoadCase, provenance: Provenance, curves: Curves, balance: PowerBalance | None, rows: list[SummaryRow], notes: list[str],
    verdict: Verdict,
) -> ReportInput:  # fmt: skip
    m = case.model
    facts = [("robot", f"{m.name} ({m.file})"), *_scene(case)]
    title = f"Joint loads of {m.name}"
    raw_q = case.motion.raw_q
    raw = {} if raw_q is None else {j.name: m._position_of(j, raw_q) for j in m.joints if j.one_coordinate}
    shown = CaseCurves(case.name, case.motion.time, curves.loads, balance, raw_positions=raw, stills=stills_of(case, curves.loads))
    return ReportInput(title, facts, notes, rows, [shown], provenance, verdict)


def _scene(case: LoadCase) -> list[tuple[str, str]]:
    """What was computed, for people: the load case, and how its wrenches are expressed."""
    p, m, time = case.placement, case.model, case.motion.time
    return [
        ("motion", case.motion_file or "arrays"),
        ("samples", f"{len(time)}, from {time[0]:.10g} s to {time[-1]:.10g} s"),
        ("gravity", f"({', '.join(f'{g:g}' for g in m.gravity)}) m/s² in world axes"),
        ("payloads", "; ".join(str(payload) for payload in case.payloads) or "none"),
        ("wrenches", f"on the {p.on} side of the joint, moments about {p.about}; here resolved along and across each joint's axis"),
        ("effort and power", "of each joint's drive, whatever point and side are chosen"),
        *([("physics of joints", _physics(m))] if m.physics else []),
        ("in the table", f"axes {p.axes}, order {p.order}"),
        ("external wrenches", ", ".join(case.external) or "none"),
    ]


def _physics(model: Mechanism) -> str:
    """What is on, and the width of friction where its smooth law is."""
    width = f" (smooth, width {model.friction_width:g} rad/s or m/s unless the file gives another)" if "friction" in model.physics else ""
    return ", ".join(name + width if name == "friction" else name for name in model.physics) + ": the effort is the motor's"
