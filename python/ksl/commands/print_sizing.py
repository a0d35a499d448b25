"""What `ksl size` prints: figures with their inputs, formulas and sources, the worst ones, the simultaneous sets."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Callable, Iterable, Sequence

from rich.console import Console
from rich.text import Text

from ksl.commands.print_info import table_lines
from ksl.sizing.choice.selection import Chosen
from ksl.sizing.figures import Figure, LeftOut, significant
from ksl.sizing.peaks import PeakRow
from ksl.sizing.joints.sizing import Sizing

WORST_SHOWN = 15
KEPT_TOGETHER = re.compile(r"(?<=Σ) |(?<=\d) (?=[A-Za-zµ%(·])|(?<=\bN) (?=m\b)|(?<=kg) (?=m²)| (?==)|(?<==) ")
"""Spaces at which no line is broken: between numbers and units, and around equality signs."""

HEADINGS = {
    "axial_force": "axial N",
    "radial_force": "radial N",
    "bending_moment": "bending N m",
    "axial_moment": "torque N m",
    "effort": "drive N m",
    "speed": "rad/s",
}
SLIDING = {"effort": "drive N", "speed": "m/s"}
"""Headings where a joint slides."""


def print_sizing(sizing: Sizing, console: Console, brief: bool = False, peaks: bool = False) -> None:
    """Prints figures by joint, formulas, what is left out, the worst figures, and the verdict at the end, where it is seen."""
    if sizing.figures and not brief:
        notes = {note: chr(ord("a") + k) for k, note in enumerate(dict.fromkeys(f.note for f in sizing.figures if f.note))}
        references = _references(sizing.in_order)
        for joint in dict.fromkeys(f.joint for f in sizing.figures):  # the joint with the worst figure first
            _print_joint(console, sizing.of_joint(joint), references, notes)
        _print_formulas(console, references, notes)
    if sizing.choices:
        _print_choices(console, sizing.choices, sizing.rounds)
    if peaks:
        print_peaks(sizing.peaks, console)
    _print_left_out(console, sizing.left_out)
    for note in sizing.notes:
        _wrapped(console, f"note: {note}", "  ")
    if sizing.figures:
        _print_worst(console, sizing.figures, None if brief else WORST_SHOWN)
    console.print()
    if not sizing.figures and not sizing.left_out:
        _wrapped(console, "`ksl size --example` prints a components file; with it, motors, gears, bearings and bolts are checked against these loads.", "")
        return
    _wrapped(console, sizing.verdict, "  ", _style(sizing.worst) or "bold")


def _print_choices(console: Console, choices: Sequence[Chosen], rounds: int) -> None:
    """A row for each choice: the entry, what it uses, why the next smaller one fails, and what else holds."""
    console.print(Text(f"\nChosen from the catalogue, after {rounds} rounds", style="bold"), soft_wrap=True)
    priced = any(c.price is not None for c in choices)
    groups = [["joint"], ["kind", "chosen", "kg", *(["price"] if priced else []), "use", "worst figure"], ["next smaller fails"]]
    rows = [
        [c.joint, c.kind, c.name, significant(c.mass), *([significant(c.price)] if priced else []), _use(c.utilisation).strip(), c.figure, c.why]
        for c in choices
    ]
    console.out("\n".join(table_lines(groups, rows, max(console.width, 60))), highlight=False)
    for c in choices:
        front = f"; of mass against use, the best are {', '.join(c.front)}" if len(c.front) > 1 else ""
        _wrapped(console, f"{c.joint}, {c.kind}: {', '.join(c.holds)} hold{'s' if len(c.holds) == 1 else ''}{front}", "    ", first="  ")


def _references(figures: Iterable[Figure]) -> dict[tuple[str, str], int]:
    """Numbers of the formulas with their sources, each printed once."""
    distinct = dict.fromkeys((f.formula, f.source) for f in figures)
    return {pair: k for k, pair in enumerate(distinct, 1)}


def _print_joint(console: Console, figures: Sequence[Figure], references: dict[tuple[str, str], int], notes: dict[str, str]) -> None:
    console.print(Text(f"\n{figures[0].joint}", style="bold"), soft_wrap=True)
    names, values = max(len(f.figure) for f in figures), max(len(_value(f)) for f in figures)
    several = len({f.case for f in figures if f.case}) > 1
    for name, kind in dict.fromkeys((f.component, f.kind) for f in figures):
        console.print(Text(f"  {name}" + (f" ({kind})" if kind != name else "")), soft_wrap=True)
        for f in (f for f in figures if (f.component, f.kind) == (name, kind)):
            limit = _limit(f)
            marks = f"[{references[f.formula, f.source]}]" + (f" ({notes[f.note]})" if f.note else "")
            line = f"  {_use(f.utilisation)}  {f.figure:<{names}}  {_value(f):>{values}}  {limit:<9} {marks}"
            console.print(Text(line, style=_style(f)), soft_wrap=True)
            where = [f"at {significant(f.time, 6)} s"] if f.time is not None else []
            where += [f"in {f.case}" if f.time is not None else f"mostly {f.case}"] if several and f.case else []
            _wrapped(console, "; ".join(filter(None, [f.inputs, " ".join(where)])), " " * 10, "dim", first=" " * 10)


def _print_formulas(console: Console, references: dict[tuple[str, str], int], notes: dict[str, str]) -> None:
    console.print(Text("\nFormulas and sources", style="bold"))
    for (formula, source), k in references.items():
        _wrapped(console, formula, " " * 6, first=f"{f'[{k}]':>5} ")
        _wrapped(console, source, " " * 8, "dim", first=" " * 8)
    for note, letter in notes.items():
        _wrapped(console, note, " " * 6, first=f"{f'({letter})':>5} ")


def _print_left_out(console: Console, left_out: Iterable[LeftOut]) -> None:
    """Prints what is left out, and a reason that several joints have once."""
    together: dict[tuple[str, str, str], list[str]] = {}
    for x in left_out:
        together.setdefault((x.component, x.figure, x.why), []).append(x.joint)
    if together:
        console.print(Text("\nLeft out", style="bold"))
    for (component, figure, why), joints in together.items():
        _wrapped(console, f"{component}, {figure}: {why} ({', '.join(joints)})", "    ", first="  ")


def _print_worst(console: Console, figures: Sequence[Figure], most: int | None) -> None:
    """One line a figure, the worst first."""
    compared = [f for f in figures if f.utilisation is not None]
    shown = compared[:most]
    if not shown:
        return
    console.print(Text("\nUtilisation, worst first: 1 is at the limit", style="bold"))
    columns: list[Callable[[Figure], str]] = [lambda f: f.joint, lambda f: f.component, lambda f: f.figure, _value, _limit]
    widths = [max(len(text(f)) for f in shown) for text in columns]
    # values and limits go to a line of their own where there is no room
    fitting = next((k for k in (5, 3) if 8 + sum(widths[:k]) + 2 * k <= console.width + 2), 2)
    if most is None and not console.is_terminal:  # a line for each figure, for programs
        fitting = 5
    for f in shown:
        cells = [f"{text(f):>{w}}" if k == 3 else f"{text(f):<{w}}" for k, (text, w) in enumerate(zip(columns, widths, strict=True))]
        lines = [f"  {_use(f.utilisation)}  " + "  ".join(cells[:fitting])] + ([" " * 10 + "  ".join(cells[fitting:]).strip()] if fitting < 5 else [])
        for line in lines:
            console.print(Text(line.rstrip(), style=_style(f)), soft_wrap=True)
    if len(compared) > len(shown):
        console.print(f"          and {len(compared) - len(shown)} more, of at most {_use(compared[len(shown)].utilisation).strip()}")


def _limit(f: Figure) -> str:
    return "" if f.limit is None else f"{f.bound} {significant(f.limit)}"


def _use(utilisation: float | None) -> str:
    """A utilisation in six characters."""
    if utilisation is None or utilisation == float("inf"):
        return f"{'–' if utilisation is None else '∞':>6}"
    return "<0.001" if 0 < utilisation < 0.001 else f"{utilisation:6.3f}" if utilisation < 100 else f"{significant(utilisation, 3):>6}"


def _value(f: Figure) -> str:
    return f"{significant(f.value)} {f.unit}".strip()


def print_peaks(rows: Sequence[PeakRow], console: Console) -> None:
    """The simultaneous sets of each joint: a row for each extreme, with everything that acts in that sample."""
    for joint in dict.fromkeys(str(row["joint"]) for row in rows):
        own = [row for row in rows if row["joint"] == joint]
        cases = {str(row["case"]) for row in own}
        several = len(cases) > 1
        about = "its origin" if own[0]["point"] == "0 0 0" else f"({', '.join(str(own[0]['point']).split())}) m from it"
        console.print()
        _wrapped(console, f"{joint}: what acts together at each peak, on the child, about {about}" + ("" if several else f"; case {cases.pop()}"), "  ", "bold")
        columns = [name for name in HEADINGS if any(row[name] is not None for row in own)]
        if all(row["effort"] == row["axial_moment"] for row in own):  # the drive supplies what is about the axis, nothing else
            columns = [name for name in columns if name != "effort"]
            own = [row for row in own if not str(row["extreme"]).startswith("effort")]
        cells = [[_extreme(str(row["extreme"])), *(_number(row[name]) for name in columns), _number(row["time"], 6), str(row["case"])] for row in own]
        headings = HEADINGS | (SLIDING if own[0]["unit"] == "m" else {})
        groups = [["peak"], [headings[name] for name in columns] + ["at s"] + (["case"] if several else [])]
        cells = cells if several else [row[:-1] for row in cells]
        console.out("\n".join(table_lines(groups, cells, max(console.width, 60))), highlight=False)


def _extreme(words: str) -> str:
    quantity, _, which = words.rpartition(" ")
    name = {"axial_moment": "torque"}.get(quantity, quantity.partition("_")[0])
    return f"{name} {which}"


def _number(x: object, digits: int = 4) -> str:
    return significant(x, digits) if isinstance(x, float) else ""


def _style(f: Figure | None) -> str:
    return {"over": "red", "near": "yellow"}.get(f.verdict if f else "", "")


def _wrapped(console: Console, text: str, indent: str, style: str = "", first: str = "") -> None:
    """Lines of the console's width; a number stays with its name and its unit."""
    together = KEPT_TOGETHER.sub("\xa0", text)
    for line in textwrap.wrap(together, max(console.width, 40), initial_indent=first, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False):
        console.print(Text(line.replace("\xa0", " "), style=style), soft_wrap=True)
