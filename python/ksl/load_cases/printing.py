"""What `ksl loads` prints: the summary in tables."""

from __future__ import annotations

from collections.abc import Sequence

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table
from rich.text import Text

from ksl.load_cases.load_case import Placement
from ksl.load_cases.quantities import EFFORT_PARTS, JointLoads, SummaryRow, unit
from ksl.load_cases.verdict import AMBER, Verdict, percent
from ksl.mechanism import Joint

WRENCH = {"axial_force": "axial", "radial_force": "radial", "bending_moment": "bending", "axial_moment": "about axis"}
"""Columns and headings for the wrench of a joint with an axis."""


STYLE = {"green": "green", "amber": "yellow", "red": "bold red"}


def print_verdict(console: Console, verdict: Verdict, joints: Sequence[Joint]) -> None:
    """The verdict in a line, the reasons that forbid green, and the shares of limits, worst joints first."""
    level = verdict.level
    console.print(Text.assemble(("verdict: ", "bold"), (level.upper(), STYLE[level]), f": {verdict.headline}"), soft_wrap=True)
    for reason in verdict.reasons if level != "red" else ():  # below a red one they are notes
        console.print(Text(f"  not green: {reason}"), soft_wrap=True)
    console.print()
    used = {joint.name: of for joint in joints if (of := verdict.of(joint.name))}
    if not used:
        return
    table = Table(title=Text("Share of limits used", style="table.title"), title_justify="left", box=SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0))
    table.add_column("joint", overflow="fold")
    for quantity in AMBER:
        table.add_column(quantity, justify="right", no_wrap=True)
    for name in sorted(used, key=lambda name: -max(use.share for use in used[name].values())):
        of = used[name]
        table.add_row(Text(name), *(Text(percent(of[q].share), style=STYLE[of[q].level]) if q in of else Text("–") for q in AMBER))
    console.print(table)


def print_summary(console: Console, rows: list[SummaryRow], loads: list[JointLoads], placement: Placement) -> None:
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
