"""What was checked against the catalogue: its part of the verdict, and a table in the section of each joint."""

from __future__ import annotations

import math
from ksl.base.markup import html as escape

from ksl.load_cases.verdict import Level
from ksl.report.html.numbers import Clock
from ksl.report.html.verdict_section import ComponentsVerdict
from ksl.sizing.figures import Figure, significant
from ksl.sizing.joints.sizing import Sizing

OF_FIGURE: dict[Level, str] = {"green": "", "amber": " near the limit", "red": " exceeded"}
LEVEL: dict[str, Level] = {"over": "red", "near": "amber", "within": "green", "": "green"}
"""The level of a figure's verdict."""


def sizing_verdict(sizing: Sizing) -> ComponentsVerdict:
    """For the card at the top.  Figures that are left out, or nothing that was compared, forbid green."""
    words = "" if sizing.worst else "no component was compared with a limit"
    return ComponentsVerdict(sizing.level, sizing.verdict, [str(x) for x in sizing.left_out], words)


def sizing_table(sizing: Sizing, joint: str, clock: Clock) -> str:
    """The figures of one joint, each with its formula, inputs and source."""
    figures = sizing.of_joint(joint)
    left_out = [x for x in sizing.left_out if x.joint == joint]
    if not figures and not left_out:
        return ""
    rows = "".join(_row(figure, clock) for figure in figures)
    rows += "".join(
        f'<tr><th scope="row">{escape(x.component)}</th><td>{escape(x.figure)}</td><td colspan="4"><strong class="amber">left out</strong>: {escape(x.why)}</td></tr>'
        for x in left_out
    )
    heads = ("component", "figure", "value", "limit", "utilisation", "governed by")
    head = "".join(f'<th scope="col">{name}</th>' for name in heads)
    table = f'<table class="sizing"><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>'
    title = f"Components of {escape(joint)}"
    return f'<h3>Components</h3><div class="wide" role="region" aria-label="{title}" tabindex="0">{table}</div>'


def _row(f: Figure, clock: Clock) -> str:
    unit = f" {f.unit}" if f.unit else ""
    limit = "–" if f.limit is None else f"{significant(f.limit)}{unit}"
    at = f.case + (f", {clock.text(f.time)} s" if f.time is not None else "")
    how = f"{f.formula}; {f.inputs}" if f.inputs else f.formula
    note = f"<br>{escape(f.note)}" if f.note else ""
    return (
        f'<tr><th scope="row">{escape(f.component)}<small>{escape(f.kind)}</small></th>'
        f"<td>{escape(f.figure)}<small>{escape(how)}<br>{escape(f.source)}{note}</small></td>"
        f"<td>{significant(f.value)}{escape(unit)}</td><td>{escape(limit)}</td><td>{_utilisation(f)}</td><td>{escape(at)}</td></tr>"
    )


def _utilisation(f: Figure) -> str:
    if f.utilisation is None:
        return "–"
    level = LEVEL[f.verdict]
    width = 100 * min(max(f.utilisation, 0.0), 1.0)
    number = f"{100 * f.utilisation:.3g} %" if math.isfinite(f.utilisation) else "∞"
    bar = f'<span class="bar"><span class="{level}" style="width:{width:.1f}%"></span></span>'
    return f'<strong class="{level}">{number}{OF_FIGURE[level]}</strong>{bar}'
