"""The largest loads over all load cases, each with the case that governs and a link to the joint there."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from ksl.base.markup import html as escape

from ksl.load_cases.quantities import COMPARED, signed_peak, unit
from ksl.load_cases.undetermined import MARK, is_open
from ksl.mechanism.mechanism import Joint
from ksl.report.html.numbers import format_number, link
from ksl.report.html.rows import Row, exceeds
from ksl.report.html.tables import LABELS, joint_group


def worst_section(rows: Sequence[Row], joints: Mapping[str, Joint], anchors: Mapping[tuple[str, str], str]) -> str:
    """rows: of `rows.with_limits`, of all cases.  anchors: of the sections of joints, by case and joint, of cases whose curves are shown."""
    groups: dict[str, list[str]] = {}
    for name, row in {str(row["joint"]): row for row in rows}.items():
        groups.setdefault(joint_group(joints[name], row), []).append(name)
    tables = "".join(_table(title, names, rows, joints, anchors) for title, names in groups.items())
    note = "The largest peak of each quantity over all load cases, and below it the case that governs. Its name leads to the joint's curves there."
    count, shown = len({row["case"] for row in rows}), len({case for case, _ in anchors})
    if shown < count:
        note += f" Curves of {shown} of {count} load cases are shown: of the one with the worst use of a limit, and of those that govern most."
    return f'<section id="worst"><h2>Worst over all load cases</h2><p>{note}</p>{tables}</section>'


def governing(rows: Sequence[Row], joint: str, quantity: str) -> Row | None:
    """The row of a joint with the largest peak of a quantity; the first of equal ones, and None where the joint has no such quantity."""
    key = f"{quantity}_peak"
    return max((row for row in rows if row["joint"] == joint and row.get(key) is not None), key=lambda row: float(row[key] or 0.0), default=None)


def _table(title: str, names: Sequence[str], rows: Sequence[Row], joints: Mapping[str, Joint], anchors: Mapping[tuple[str, str], str]) -> str:
    quantities = [q for q in COMPARED if any(governing(rows, name, q) is not None for name in names)]
    head = "".join(f'<th scope="col" class="first">{LABELS[q]}, {unit(q, joints[names[0]])}</th>' for q in quantities)
    body = ""
    for name in names:
        cells = "".join(_cell(governing(rows, name, q), q, anchors) for q in quantities)
        body += f'<tr><th scope="row">{escape(name)}</th>{cells}</tr>'
    table = f'<table class="worst"><caption>{title}</caption><thead><tr><th scope="col">joint</th>{head}</tr></thead><tbody>{body}</tbody></table>'
    return f'<div class="wide" role="region" aria-label="{title}, worst case" tabindex="0">{table}</div>'


def _cell(row: Row | None, quantity: str, anchors: Mapping[tuple[str, str], str]) -> str:
    if row is None:
        return '<td class="first">–</td>'
    key, case = f"{quantity}_peak", str(row["case"])
    number = format_number(signed_peak(row, key)) + (MARK if is_open(row, quantity) else "")
    shown = f'<strong class="over" title="beyond the limit">{number}</strong>' if exceeds(row, key) else number
    return f'<td class="first">{shown}<small>{link(anchors.get((case, str(row["joint"]))), case)}</small></td>'
