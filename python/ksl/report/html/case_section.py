"""The sections of one load case: its summary, the power balance, and a section for each joint."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from ksl.base.markup import html as escape
from typing import TYPE_CHECKING

from ksl.report.html.balance_section import balance_section, balance_verdict
from ksl.report.html.charts import Charts
from ksl.report.html.input import CaseCurves
from ksl.report.html.joint_section import JointExtras, joint_section
from ksl.report.html.numbers import Clock
from ksl.report.html.rows import Row, with_limits
from ksl.report.html.tables import summary_tables

if TYPE_CHECKING:
    from ksl.sizing.joints.sizing import Sizing


@dataclass(frozen=True)
class Anchors:
    """The ids of a case's sections: with a number in front where there are several cases."""

    prefix: str
    joints: dict[str, str]

    @staticmethod
    def of(case: CaseCurves, number: int | None) -> Anchors:
        prefix = "" if number is None else f"case-{number}-"
        return Anchors(prefix, {loads.joint.name: f"{prefix}joint-{i}" for i, loads in enumerate(case.joints)})


def case_sections(case: CaseCurves, rows: Sequence[Row], anchors: Anchors, charts: Charts, sizing: Sizing | None = None) -> str:
    """rows: of the summary, those of this case.  sizing: its tables stand in the sections of the joints."""
    clock = Clock.of(case.time)
    html = _summary(case, rows, anchors, clock)
    html += balance_section(case.balance, case.time, charts, clock, f"{anchors.prefix}balance")
    for loads in case.joints:
        name = loads.joint.name
        extras = JointExtras(case.stills.get(name), case.raw_positions.get(name), _components(sizing, name, clock), case.undetermined.of(name))
        html += joint_section(loads, case.time, anchors.joints[name], charts, extras)
    return html


def case_head(case: CaseCurves, anchors: Anchors) -> str:
    """Name, facts, power balance and notes of a case among several."""
    rows = "".join(f'<tr><th scope="row">{escape(name)}</th><td>{escape(text)}</td></tr>' for name, text in case.facts)
    facts = f'<table class="facts"><tbody>{rows}</tbody></table>' if rows else ""
    notes = "".join(f"<li>{escape(note)}</li>" for note in case.notes)
    listed = f'<div class="notes"><ul>{notes}</ul></div>' if notes else ""
    return f"<h2>Load case {escape(case.name)}</h2>{facts}{balance_verdict(case.balance, f'{anchors.prefix}balance')}{listed}"


def _summary(case: CaseCurves, rows: Sequence[Row], anchors: Anchors, clock: Clock) -> str:
    joints = {loads.joint.name: loads.joint for loads in case.joints}
    tables = summary_tables([with_limits(row, joints[str(row["joint"])]) for row in rows], joints, anchors.joints, clock)
    note = "Peaks are of the magnitude; along and about axes, and of drives, they have the sign of that sample, positive along the axis. Means (rms, mean) weigh each sample by the time it stands for. "
    note += "Forces and moments are those of the wrench at the chosen point; effort, speed, power and work are the drive's, whatever point is chosen."
    if clock.origin:
        note += f" Times on this page are counted from the first sample, at {clock.origin!r} s."
    return f'<section id="{anchors.prefix}summary"><h2>Summary</h2><p>{note}</p>{tables}</section>'


def _components(sizing: Sizing | None, joint: str, clock: Clock) -> str:
    """The table of a joint's components.  What makes it is imported where there are some, since that takes a while."""
    if sizing is None:
        return ""
    from ksl.report.html.sizing_section import sizing_table

    return sizing_table(sizing, joint, clock)
