"""What `ksl loads` prints: how far it is, the verdict, and the summary in tables that fit a terminal of 80 columns."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table
from rich.text import Text

from ksl.commands.app import say
from ksl.commands.print_notes import print_notes
from ksl.load_cases.force_elements import element_ranges
from ksl.load_cases.case_result import CaseResult
from ksl.load_cases.load_case import LoadCase
from ksl.load_cases.quantities import LOADS, PowerBalance, SummaryRow, round_off_in, round_off_of, signed_peak, unit, weight_of
from ksl.load_cases.ranking import severity
from ksl.load_cases.summary_table import worst_rows
from ksl.load_cases.undetermined import MARK, footnote, is_open, way_out
from ksl.load_cases.verdict import AMBER, Verdict, percent
from ksl.mechanism.mechanism import Joint
from ksl.mechanism.states import EFFORT_PARTS
from ksl.report.loads_run import Run

if TYPE_CHECKING:
    from ksl.sizing.joints.sizing import Sizing

Columns = list[tuple[str, str]]
"""Quantity, and which of its numbers."""

MOST_CASES = 20
"""So many load cases have a line of their own."""
LABELS = {"axial_force": "axial", "radial_force": "radial", "bending_moment": "bending", "axial_moment": "about axis"}
STYLE = {"green": "green", "amber": "yellow", "red": "bold red"}


@contextmanager
def progress(console: Console, run: Run) -> Iterator[Callable[[int], None] | None]:
    """What :meth:`Run.write` tells how many samples are done, for a bar in the terminal; None elsewhere."""
    if not console.is_terminal:
        yield None
        return
    from rich.progress import Progress

    with Progress(console=console, transient=True) as shown:
        task = shown.add_task("wrenches", total=sum(len(case.motion.time) for case in run.cases))
        yield lambda samples: shown.advance(task, samples)


def print_run(console: Console, run: Run, written: Sequence[str] = ()) -> None:
    """Everything: the summary, of several load cases the worst over all, notes, power balance, what was written; and last, where it is seen, the verdict."""
    verdict, several = run.verdict, len(run.cases) > 1
    rows = worst_rows(run.rows) if several else run.rows
    print_summary(console, rows, run.cases[0], "worst over all load cases" if several else "")
    print_notes(console, [*run.notes, *(run.sizing.notes if run.sizing else ())], verdict.reasons)  # those are printed below
    worst = max(run.results, key=_residual)
    of = f"power balance, worst of {len(run.cases)} load cases, {worst.case.name}: " if several else "power balance: "
    say(console, of + balance_line(worst.balance))
    for case in run.cases:
        for element in element_ranges(case):
            say(console, f"force element {element.name}{f', {case.name}' if several else ''}: {element.text}")
    for line in written:
        say(console, line)
    console.print()
    if several:
        _print_cases(console, run)
    print_verdict(console, verdict, run.cases[0].joints, run.sizing)


def _residual(result: CaseResult) -> float:
    """Relative; −1 where there is none."""
    return -1.0 if result.balance is None or result.balance.at_rest else result.balance.relative_residual


def print_verdict(console: Console, verdict: Verdict, joints: Sequence[Joint], sizing: Sizing | None = None) -> None:
    """The shares of limits, worst joints first; the reasons that forbid green; and in the last lines the verdict, and that of components."""
    level = verdict.level
    _print_shares(console, verdict, joints)
    for reason in verdict.reasons:
        say(console, f"  {'doubt' if level == 'red' else 'not green'}: {reason}")
    say(console, Text.assemble(("verdict: ", "bold"), (level.upper(), STYLE[level]), f": {verdict.headline}"))
    if sizing:
        for left_out in sizing.left_out:
            say(console, f"  {left_out}")
        say(console, Text.assemble(("components: ", "bold"), (sizing.level.upper(), STYLE[sizing.level]), f": {sizing.verdict}"))


def _print_shares(console: Console, verdict: Verdict, joints: Sequence[Joint]) -> None:
    used = {joint.name: of for joint in joints if (of := verdict.of(joint.name))}
    if not used:
        return
    table = _empty_table()
    for quantity in AMBER:
        table.add_column(quantity, justify="right", no_wrap=True)
    for name in sorted(used, key=lambda name: -max(use.share for use in used[name].values())):
        of = used[name]
        table.add_row(Text(name), *(Text(percent(of[q].share), style=STYLE[of[q].level]) if q in of else Text("–") for q in AMBER))
    _print_table(console, "Share of limits used", table)


def _print_cases(console: Console, run: Run) -> None:
    """A line for each load case: its verdict and what governs it; of many, those with the worst use of a limit, worst first."""
    table = _empty_table("case")
    table.add_column("verdict")
    table.add_column("governed by", overflow="fold")
    shown = run.results if len(run.results) <= MOST_CASES else sorted(run.results, key=severity, reverse=True)[:MOST_CASES]
    for result in shown:
        verdict = Verdict(tuple(result.uses))
        table.add_row(Text(result.case.name), Text(verdict.level, style=STYLE[verdict.level]), Text(verdict.headline))
    _print_table(console, "Load cases" if shown is run.results else f"The worst {MOST_CASES} of {len(run.results)} load cases; all are in summary.csv", table)


def print_summary(console: Console, rows: Sequence[SummaryRow], case: LoadCase, what: str = "") -> None:
    """Tables by topic: forces and moments at the chosen point, drives, power, brakes, couplings, and joints without one coordinate.

    what: said of rows that are the worst over all load cases, whose tables name the case that governs.
    """
    by_name, placement = {j.name: j for j in case.joints}, case.placement
    acting = {q for row in rows for q in ("damping", "friction", "rotor", "spring") if row.get(f"{q}_peak")}
    with_parts = [of for of in (("transmitted", "damping", "friction"), ("rotor", "spring")) if acting & set(of)]
    side, about = f"on the {placement.on} side", f"about {placement.about}"
    of_the_same = "magnitudes of the same wrench" if any("axial_force_peak" in row for row in rows) else f"magnitudes of the wrench {side}, moments {about}"
    extremes = _peak_time_case if what else _peak_rms_time  # over several load cases a rms would be that of another case than the peak
    peak_time = ("peak", "peak_time", "peak_case") if what else ("peak", "peak_time")
    topics: list[tuple[str, str, Columns]] = [
        (f"Forces {side}", "axial_force", extremes("axial_force", "radial_force")),
        (f"Moments {side}, {about}", "axial_force", extremes("bending_moment", "axial_moment")),
        ("Drive", "effort", [*extremes("effort"), *(("speed", part) for part in peak_time)]),
        ("Power and work of the drive", "effort", [*(("power", part) for part in peak_time), ("power", "mean"), ("work", "positive"), ("work", "negative")]),
        ("Brakes", "brake", extremes("brake")),
        *(("What the effort consists of", of[0], [(q, part) for q in of for part in ("peak", "rms")]) for of in with_parts),
        ("Joints without a motor", "speed", [("position", "lowest"), ("position", "highest"), *(("speed", part) for part in peak_time)]),
        ("Coupling: what moves the mimic joints", "coupling", [*extremes("coupling"), *(("speed", part) for part in peak_time)]),
        (f"Joints without one coordinate: {of_the_same}", "force", extremes("force", "moment")),
    ]
    open_too, least = False, _least_of(rows, weight_of(case.model))
    for title, having, columns in topics:
        chosen = [row for row in rows if f"{having}_peak" in row and (having != "speed" or not {"effort_peak", "coupling_peak"} & set(row))]
        for scope, together in _by_unit(chosen, by_name, {q for q, _ in columns}):
            title_and_scope = title + scope + (f", {what}" if what else "")
            _print_table(console, title_and_scope, _table(together, [by_name[str(row["joint"])] for row in together], columns, least))
            open_too |= any(is_open(row, q) for row in together for q, _ in columns)
    if open_too:
        say(console, f"{footnote(case.model)}. {way_out(case.model)}")


def _peak_rms_time(*quantities: str) -> Columns:
    return [(q, part) for q in quantities for part in ("peak", "rms", "peak_time")]


def _peak_time_case(*quantities: str) -> Columns:
    return [(q, part) for q in quantities for part in ("peak", "peak_time", "peak_case")]


def _by_unit(rows: list[SummaryRow], joints: dict[str, Joint], quantities: set[str]) -> list[tuple[str, list[SummaryRow]]]:
    """Rows whose quantities have the same units, with what is added to the title: one table of both would be too wide for a terminal."""
    turning = [row for row in rows if joints[str(row["joint"])].has_angle]
    sliding = [row for row in rows if row not in turning]
    if turning and sliding and not quantities.isdisjoint(("effort", "brake", "coupling", *EFFORT_PARTS)):
        return [(", joints that turn", turning), (", joints that slide", sliding)]
    return [("", rows)] if rows else []


def _empty_table(first: str = "joint") -> Table:
    table = Table(box=SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0))
    table.add_column(first, overflow="fold")
    return table


def _print_table(console: Console, title: str, table: Table) -> None:
    """The title is printed apart: that of a table would be folded to its width."""
    console.print(Text(title, style="italic"))
    console.print(table)


def _table(rows: list[SummaryRow], joints: list[Joint], columns: Columns, least: Mapping[str, float]) -> Table:
    table = _empty_table()
    words = {"peak_time": "at s", "peak_case": "case", "work": "J"}
    for q, part in columns:
        of = words.get(q) or " or ".join(sorted({unit(q, joint) for joint in joints}))
        name = LABELS.get(q, q) if part in ("peak", "positive", "lowest") else ""
        if part == "peak_case":
            table.add_column("\ncase", overflow="fold")
        else:
            table.add_column(f"{name}\n{words.get(part) or f'{part} {of}'}", justify="right", no_wrap=True)
    for row in rows:
        cells = (
            (signed_peak(row, f"{q}_{part}"), MARK if part in ("peak", "rms") and is_open(row, q) else "", 0.0 if part == "peak_time" else least.get(q, 0.0))
            for q, part in columns
        )
        table.add_row(Text(str(row["joint"])), *(Text(x) if isinstance(x, str) else _number(x, lowest) + mark for x, mark, lowest in cells))
    return table


def _number(x: float | None, least: float) -> str:
    """Four digits; round-off of what is zero by the axes of joints is zero."""
    return "–" if x is None else f"{0.0 if abs(x) < least else x:.4g}"


def _position(x: float) -> str:
    """Four decimals, unless that leaves nothing of a position that is more than round-off."""
    return f"{x:.4g}" if 1e-9 < abs(x) < 5e-5 else f"{round(x, 4) + 0.0:.4f}"


def _least_of(rows: Sequence[SummaryRow], weight: float) -> dict[str, float]:
    """What is round-off of each quantity that loads make."""
    load = round_off_in(rows, weight)
    power = load * max((abs(x) for row in rows if isinstance(x := row.get("speed_peak"), float)), default=0.0)
    return dict.fromkeys(LOADS, load) | {"power": power, "work": power}


def balance_line(balance: PowerBalance | None) -> str:
    if balance is None:
        return "too few samples to differentiate the energy"
    if balance.at_rest:
        return "no power but round-off: nothing moves, or what moves takes no power"
    return (
        f"largest residual {abs(balance.residual).max():.3g} W, {balance.relative_residual:.2g} of the largest power "
        f"(drive + external{'' if balance.dissipation is None else ' − dissipation'} against the rate of change of energy)"
    )


def print_pose(console: Console, run: Run, written: Sequence[str] = ()) -> None:
    """A run of one sample: the pose with efforts, every wrench, and last the verdict."""
    result = run.results[0]
    case = result.case
    rows = {str(row["joint"]): row for row in run.wrenches.to_pylist()}
    components = [name for name in run.wrenches.column_names if name in ("fx", "fy", "fz", "tx", "ty", "tz")]
    least = round_off_of((row[c] for row in rows.values() for c in (*components, "effort")), weight_of(case.model))
    table = _empty_table()
    for head in ("position", "effort", "limit", "share"):
        table.add_column(head, justify="right", no_wrap=True)
    for joint in case.joints:
        row, uses = rows[joint.name], run.verdict.of(joint.name)
        if row["position"] is None:
            continue
        of, effort = unit("effort", joint), row["effort"]
        limit = uses["effort"].limit if "effort" in uses else None
        share = percent(uses["effort"].share) if "effort" in uses else "–"
        table.add_row(Text(joint.name), f"{_position(row['position'])} {joint.unit}", "–" if effort is None else f"{_number(effort, least)} {of}",
                      "–" if limit is None else f"{limit:.4g} {of}", share)  # fmt: skip
    _print_table(console, f"Pose and efforts: {case.kind}", table)
    wrenches = _empty_table()
    open_of = case.undetermined.components
    for name in components:
        wrenches.add_column(f"{name}\n{'N' if name.startswith('f') else 'N m'}", justify="right", no_wrap=True)
    for joint in case.joints:
        marked = open_of.get(joint.name, ())
        cells = (f"{_number(rows[joint.name][c], least)}{MARK if c in marked else ''}" for c in components)
        wrenches.add_row(Text(joint.name), *cells)
    p = case.placement
    _print_table(console, f"Wrenches on the {p.on} side, moments about {p.about}, axes {p.axes}", wrenches)
    if open_of:
        say(console, f"{footnote(case.model)}. {way_out(case.model)}")
    print_notes(console, run.notes, run.verdict.reasons)
    for line in written:
        say(console, line)
    print_verdict(console, run.verdict, ())
