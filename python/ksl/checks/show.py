"""Findings as text for a terminal, by rule."""

from __future__ import annotations

from textwrap import wrap
from typing import TYPE_CHECKING

from ksl.checks.description.findings import STATUS, Finding, Findings

if TYPE_CHECKING:
    from rich.console import Console

    from ksl.checks.run import Fixed

SHOWN = 5
"""Places of a rule that are printed unless all are asked for."""
NARROW, WIDE = 60, 100
"""Columns: names in robot files are long, and lines longer than this are hard to read."""

STYLES = {"error": "bold red", "warning": "bold yellow", "note": "bold"}


def print_findings(findings: Findings, console: Console, everything: bool = False) -> None:
    """The findings by rule, errors first; at most five places of a rule unless `everything`."""
    from rich.text import Text

    from ksl.checks.run import RULES

    groups: dict[tuple[str, str], list[Finding]] = {}
    order = list(RULES)
    for f in sorted(findings, key=lambda f: (-STATUS[f.severity], order.index(f.rule))):
        groups.setdefault((f.severity, f.rule), []).append(f)
    for (severity, rule), same in groups.items():
        console.print(Text.assemble((f"{severity}  {rule}", STYLES[severity]), f"  {len(same)} places" if len(same) > 1 else ""))
        _print_rule(same, console, everything)
        console.print()
    for what in findings.not_checked:
        _paragraph(console, "not checked: ", what)
    if findings.ignored:
        _paragraph(console, "ignored: ", ", ".join(findings.ignored))
    style = STYLES["error"] if findings.errors else STYLES["warning"] if findings.warnings else "bold green"
    console.print(Text(f"{findings.file}: {findings.summary}", style=style), soft_wrap=True)


def _print_rule(same: list[Finding], console: Console, everything: bool) -> None:
    """What all places of a rule share is said once."""
    shared = {what: getattr(same[0], what) if len({getattr(f, what) for f in same}) == 1 else None for what in ("cause", "repair")}
    _paragraph(console, "  expected  ", same[0].condition)
    places = same if everything else same[:SHOWN]
    for f in places:
        named = f"{f.kind} {f.name}: " if f.name else ""
        _paragraph(console, "  found     ", f"{'line ' + str(f.line) + ': ' if f.line else ''}{named}{f.found}")
        for what in ("cause", "repair"):
            if shared[what] is None:
                _paragraph(console, f"    {what}".ljust(12), getattr(f, what))
    if len(places) < len(same):
        _paragraph(console, "            ", f"… and {len(same) - len(places)} more; --all prints them")
    for what, text in shared.items():
        if text:
            _paragraph(console, f"  {what}".ljust(12), text)
    if any(f.fixable for f in same):
        number = sum(f.fixable for f in same)
        _paragraph(console, "            ", "--fix does this." if number == len(same) else f"--fix repairs {number} of these {len(same)}.")
    if any(f.acceptable for f in same):
        _paragraph(console, "            ", f"If the cause is right, --fix with --accept {same[0].rule} does this.")


def print_fixed(fixed: Fixed, console: Console, everything: bool = False) -> None:
    """What was changed, and what is left."""
    from rich.text import Text

    if not fixed.changes:
        console.print(f"{fixed.path}: written; nothing could be repaired without a decision\n", soft_wrap=True)
    else:
        console.print(Text(f"{fixed.path}: written, with {len(fixed.changes)} change{'s' if len(fixed.changes) > 1 else ''}", style="bold"), soft_wrap=True)
    for finding, change in fixed.changes:
        where = f"{finding.kind} {finding.name}: " if finding.name else ""
        _paragraph(console, "  ", f"line {finding.line}: {where}{change} ({finding.rule})")
    if fixed.changes:
        console.print()
    if len(fixed.left):
        console.print(Text("Left for you to decide:", style="bold"))
        console.print()
    print_findings(fixed.left, console, everything)


def _paragraph(console: Console, head: str, text: str) -> None:
    """Text that is wrapped beside its head; long names and paths are not cut."""
    from rich.text import Text

    width = max(NARROW, min(WIDE, console.width)) - len(head)
    lines = wrap(text, width, break_long_words=False, break_on_hyphens=False) or [""]
    for i, line in enumerate(lines):
        console.print(Text.assemble((head if i == 0 else " " * len(head), "dim"), line), soft_wrap=True)
