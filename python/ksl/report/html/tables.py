"""The tables of the summary."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from ksl.base.markup import html as escape

from ksl.load_cases.quantities import signed_peak, unit
from ksl.load_cases.undetermined import MARK, is_open
from ksl.mechanism.mechanism import Joint
from ksl.mechanism.states import EFFORT_PARTS
from ksl.report.html.numbers import Clock, format_number, is_round_off
from ksl.report.html.rows import LIMIT_OF, Row, exceeds

Groups = list[tuple[str, list[tuple[str, str]]]]
"""Columns of a table: headings of groups, and for each group (heading, key of the row)."""

LABELS = {
    "axial_force": "axial force",
    "radial_force": "radial force",
    "bending_moment": "bending moment",
    "axial_moment": "moment about axis",
    "force": "force",
    "moment": "moment",
    "effort": "effort",
    "transmitted": "transmitted",
    "damping": "damping",
    "friction": "friction",
    "rotor": "rotor",
    "spring": "spring",
    "brake": "brake",
    "coupling": "effort of the coupling",
    "speed": "speed",
    "power": "power",
}


WITHOUT_MOTOR = ("Turning joints without motor", "Sliding joints without motor")
"""Groups of joints of closed mechanisms: all but the drives, and those that close loops."""


def summary_tables(rows: Sequence[Row], joints: Mapping[str, Joint], anchors: Mapping[str, str], clock: Clock) -> str:
    """Rows of `rows.with_limits`, in tables whose quantities have the same units; each joint leads to its section."""
    return _Tables(joints, anchors, clock).of(rows)


class _Tables:
    def __init__(self, joints: Mapping[str, Joint], anchors: Mapping[str, str], clock: Clock) -> None:
        self._joints, self._anchors, self._clock = joints, anchors, clock

    def of(self, rows: Sequence[Row]) -> str:
        titles = ("Turning joints", "Sliding joints", "Turning mimic joints", "Sliding mimic joints", *WITHOUT_MOTOR, "Joints without one coordinate")
        groups: dict[str, list[Row]] = {title: [] for title in titles}
        for row in rows:
            groups[joint_group(self._joint(row), row)].append(row)
        html = ""
        for title, group in groups.items():
            parts = [part for part in EFFORT_PARTS if any(not is_round_off(float(row.get(f"{part}_peak") or 0.0)) for row in group)]
            for part, columns in _columns(self._joint(group[0]), parts, any("brake_peak" in row for row in group), title not in WITHOUT_MOTOR) if group else []:
                known = [row for row in group if columns[0][1][0][1] in row]  # positions may be missing
                html += self._table(f"{title}{part}", known, columns) if known else ""
        return html

    def _joint(self, row: Row) -> Joint:
        return self._joints[str(row["joint"])]

    def _table(self, title: str, rows: Sequence[Row], groups: Groups) -> str:
        over = "".join(f'<th scope="colgroup" colspan="{len(columns)}">{name}</th>' for name, columns in groups)
        under = "".join(f'<th scope="col"{_edge(k)}>{head}</th>' for _, columns in groups for k, (head, _) in enumerate(columns))
        head = f'<tr><th scope="col" rowspan="2">joint</th><th scope="col" rowspan="2">kind</th>{over}</tr><tr>{under}</tr>'
        body = "".join(self._table_row(row, groups) for row in rows)
        table = f"<table><caption>{title}</caption><thead>{head}</thead><tbody>{body}</tbody></table>"
        return f'<div class="wide" role="region" aria-label="{title}" tabindex="0">{table}</div>'

    def _table_row(self, row: Row, groups: Groups) -> str:
        name = str(row["joint"])
        link = f'<a href="#{self._anchors[name]}">{escape(name)}</a>'
        cells = "".join(f"<td{_edge(k)}>{self._cell(row, key)}</td>" for _, columns in groups for k, (_, key) in enumerate(columns))
        return f'<tr><th scope="row">{link}</th><td>{escape(str(row["kind"]))}</td>{cells}</tr>'

    def _cell(self, row: Row, key: str) -> str:
        value = signed_peak(row, key)
        if key.endswith("_time") and value is not None:
            return self._clock.text(float(value))
        if key in LIMIT_OF.values():  # as the file gives it: 87 and not 87.00
            return "–" if value is None else f'<span class="limit">{float(value):.5g}</span>'
        text = escape(format_number(value)) + (MARK if key.endswith(("_peak", "_rms")) and is_open(row, key.rpartition("_")[0]) else "")
        return f'<strong class="over" title="beyond the limit">{text}</strong>' if exceeds(row, key) else text


def joint_group(joint: Joint, row: Row) -> str:
    """The group of joints that share tables in the summary, since their quantities have the same units."""
    if not joint.one_coordinate:
        return "Joints without one coordinate"
    if joint.leader is not None:
        return "Turning mimic joints" if joint.has_angle else "Sliding mimic joints"
    if row.get("effort_peak") is None and row.get("brake_peak") is None:  # of a closed mechanism
        return WITHOUT_MOTOR[0 if joint.has_angle else 1]
    return "Turning joints" if joint.has_angle else "Sliding joints"


def _columns(joint: Joint, effort_parts: Sequence[str], brakes: bool, motor: bool = True) -> list[tuple[str, Groups]]:
    """The tables of the summary for a joint and its group, each with the end of its title: the wrench, the drive, the parts of its effort.

    effort_parts: those that are not zero throughout.  brakes: whether brakes supply the efforts.
    """

    def group(name: str, last: str | None = "rms", limit: bool = False) -> tuple[str, list[tuple[str, str]]]:
        columns = [("peak", f"{name}_peak"), *([("limit", f"{name}_limit")] if limit else []), ("at, s", f"{name}_peak_time")]
        return f"{LABELS[name]}, {unit(name, joint)}", [*columns, *([(last, f"{name}_{last}")] if last else [])]

    if not joint.one_coordinate:
        return [("", [group("force"), group("moment")])]
    wrench = [group(name) for name in ("axial_force", "radial_force", "bending_moment", "axial_moment")]
    ends = [
        (f"{end} position, {joint.unit}", [("value", f"position_{end}"), ("limit", limit), ("at, s", f"position_{end}_time")])
        for end, limit in (("lowest", "position_lower"), ("highest", "position_upper"))
    ]
    positions = (": positions", ends)
    if joint.leader is not None:
        return [(": the wrench at the chosen point", wrench), (": the coupling", [group("coupling"), group("speed", None, True)]), positions]
    if not motor:
        return [(": the wrench at the chosen point", wrench), (": speeds", [group("speed", None, True)]), positions]
    work = ("work, J", [("positive", "work_positive"), ("negative", "work_negative")])
    drive = [group("effort", limit=True), group("speed", None, True), group("power", "mean"), work]
    parts = [(": what the drive's effort consists of", [group(name) for name in effort_parts])] if effort_parts else []
    brake = [(": the brake", [group("brake")])] if brakes else []
    return [(": the wrench at the chosen point", wrench), *brake, (": the drive", drive), *parts, positions]


def _edge(column: int) -> str:
    """CSS class of a cell: the first column of a group has a line on its left."""
    return ' class="first"' if column == 0 else ""
