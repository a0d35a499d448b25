"""report.html: one page that needs no network, with all curves, their peaks, and the power balance as a check."""

from __future__ import annotations

import base64
import json
import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from importlib import resources
from pathlib import Path
from string import Template
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ksl.load_cases.provenance import Provenance
from ksl.load_cases.quantities import EFFORT_PARTS, JointLoads, PowerBalance, unit
from ksl.load_cases.verdict import Verdict
from ksl.mechanism import Joint
from ksl.states import Array

Row = Mapping[str, float | str | None]
Indices = NDArray[np.intp]
Groups = list[tuple[str, list[tuple[str, str]]]]
"""Columns of a table: headings of groups, and for each group (heading, key of the row)."""

POINTS = 2000
"""Approximate number of points of a decimated curve."""
ROUND_OFF = 1e-9
"""Loads, speeds and powers below it, in SI units, are shown as zero."""
LARGE_RESIDUAL = 1e-2
"""Residual, relative to the largest power, from which on the page explains what may be wrong."""
FAR_START = 1000
"""If times begin later than this many durations (times of a clock), they are shown relative to the first sample."""
STILL = 1e-6
"""A path that varies by no more than this, relative to its size, is drawn as a point."""
TOO_FEW = "too few samples to differentiate the energy"
AT_REST = "no power but round-off: nothing moves, or what moves takes no power"
FEW_NOTES = 8
"""Up to this number, notes are shown unfolded."""

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
    "coupling": "effort of the coupling",
    "speed": "speed",
    "power": "power",
}


@dataclass(frozen=True)
class ReportInput:
    """The contents of a report."""

    title: str
    facts: list[tuple[str, str]]
    """What was computed, and how: a small table at the head."""
    notes: list[str]
    """Warnings, unused content of the files, limits exceeded: a line each, foldable."""
    summary: list[dict[str, float | str | None]]
    """Rows of :func:`ksl.load_cases.quantities.summarise`, of any of `joints`."""
    time: Array
    """(n), s."""
    joints: list[JointLoads]
    balance: PowerBalance | None
    """None if there are too few samples to differentiate the energy."""
    provenance: Provenance | None = None
    """Inputs with their hashes, versions, date, command line: what a signature needs."""
    verdict: Verdict | None = None
    """Red, amber or green, with the shares of limits and the reasons."""


def write_report(path: str | os.PathLike[str], report: ReportInput) -> None:
    """Writes one HTML file that holds all it needs, plotly.js included (about 5 MB; 0.2 MB more for each joint)."""
    from plotly.offline import get_plotlyjs

    page = _Page(report)
    content = page.content()
    data = {"start": float(report.time[0]) - page.origin, "charts": page.charts}
    html = Template(_asset("report.html")).substitute(
        title=escape(report.title),
        style=_asset("report.css"),
        content=content,
        data=json.dumps(data, allow_nan=False).replace("<", "\\u003c"),
        plotly=_inline(get_plotlyjs()),
        script=_inline(_asset("report.js")),
    )
    Path(path).write_bytes(html.encode("utf-8", errors="replace"))


def decimate(*curves: Array, points: int = POINTS) -> Indices:
    """Sorted indices of samples to draw, about `points` of them, such that no extreme of any curve (n) is lost.

    Samples are split into buckets of equal count; of each, the smallest and the largest value of every curve stay, and
    the first and the last sample.  Curves that share an abscissa, or span a plane together, are decimated together.
    All indices if n ≤ points; at most points + 2 otherwise.  O(n).
    """
    n = len(curves[0])
    if n <= points:
        return np.arange(n)
    size = math.ceil(n / max(1, points // (2 * len(curves))))
    starts = np.arange(0, n, size)
    kept = [np.array([0, n - 1])]
    for x in curves:
        # the last bucket is padded with its last value; argmin and argmax return the first position of a value
        buckets = np.pad(x, (0, len(starts) * size - n), mode="edge").reshape(-1, size)
        kept += [starts + buckets.argmin(axis=1), starts + buckets.argmax(axis=1)]
    return np.unique(np.concatenate(kept))


def format_number(x: float | str | None, digits: int = 4) -> str:
    """Formats with significant digits: plain from 0.001 up to 100,000, elsewhere with an exponent that is a multiple of three."""
    if x is None or isinstance(x, str) or not math.isfinite(x):
        return "–" if not isinstance(x, str) else x
    if abs(x) < ROUND_OFF:
        return "0"
    exponent = int(f"{x:.{digits - 1}e}".partition("e")[2])
    shift = 0 if -3 <= exponent < 5 else 3 * (exponent // 3)
    decimals = digits - 1 - (exponent - shift)
    mantissa = f"{round(x / 10.0**shift, decimals):.{max(0, decimals)}f}"
    return f"{mantissa}e{shift}" if shift else mantissa


class _Page:
    """The body of the page, and beside it the data of the charts that the script draws into its figures."""

    def __init__(self, report: ReportInput) -> None:
        self.report = report
        self.charts: list[dict[str, Any]] = []
        self.anchors = {loads.joint.name: f"joint-{i}" for i, loads in enumerate(report.joints)}
        start, duration = float(report.time[0]), float(report.time[-1] - report.time[0])
        self.origin = start if abs(start) > FAR_START * duration else 0.0
        self.time_decimals = max(3, 3 - math.floor(math.log10(duration))) if duration > 0 else 3

    def content(self) -> str:
        r = self.report
        header = f"<header><h1>{escape(r.title)}</h1>{self._facts()}{self._notes()}</header>"
        sections = self._summary() + self._balance() + "".join(self._joint(loads) for loads in r.joints)
        return f"{self._navigation()}<main>{header}{sections}</main>"

    def _facts(self) -> str:
        facts = self.report.facts + _origin(self.report.provenance)
        rows = "".join(f'<tr><th scope="row">{escape(name)}</th><td>{escape(text)}</td></tr>' for name, text in facts)
        return f'<table class="facts"><caption class="unseen">What was computed</caption><tbody>{rows}</tbody></table>{_limits(self.report.verdict)}{self._verdict()}'

    def _notes(self) -> str:
        notes = self.report.notes
        if not notes:
            return ""
        items = "".join(f"<li>{escape(note)}</li>" for note in notes)
        unfolded = " open" if len(notes) <= FEW_NOTES else ""
        return f'<details class="notes"{unfolded}><summary>Notes ({len(notes)})</summary><ul>{items}</ul></details>'

    def _navigation(self) -> str:
        links = "".join(f'<li><a href="#{self.anchors[j.joint.name]}">{escape(j.joint.name)}</a></li>' for j in self.report.joints)
        fixed = '<li><a href="#summary">Summary</a></li><li><a href="#balance">Power balance</a></li>'
        return f'<nav aria-label="Contents"><ul>{fixed}</ul><h2>Joints</h2><ul>{links}</ul></nav>'

    # -------------------------------------------------------------------------------------------------------- summary

    def _summary(self) -> str:
        joints = {loads.joint.name: loads.joint for loads in self.report.joints}
        groups = ("Turning joints", "Sliding joints", "Turning mimic joints", "Sliding mimic joints", "Joints without one coordinate")
        rows: dict[str, list[Row]] = {group: [] for group in groups}
        for row in self.report.summary:
            rows[_group(joints[str(row["joint"])])].append(row)
        tables = ""
        for title, group in rows.items():
            for part, columns in _columns(joints[str(group[0]["joint"])], "transmitted_peak" in group[0]) if group else []:
                tables += self._table(f"{title}{part}", group, columns)
        note = "Peaks are of the magnitude. Means (rms, mean) weigh each sample by the time it stands for. "
        note += "Forces and moments are those of the wrench at the chosen point; effort, speed, power and work are the drive's, whatever point is chosen."
        if self.origin:
            note += f" Times on this page are counted from the first sample, at {self.origin!r} s."
        return f'<section id="summary"><h2>Summary</h2><p>{note}</p>{tables}</section>'

    def _table(self, title: str, rows: Sequence[Row], groups: Groups) -> str:
        over = "".join(f'<th scope="colgroup" colspan="{len(columns)}">{name}</th>' for name, columns in groups)
        under = "".join(f'<th scope="col"{_edge(k)}>{head}</th>' for _, columns in groups for k, (head, _) in enumerate(columns))
        head = f'<tr><th scope="col" rowspan="2">joint</th><th scope="col" rowspan="2">kind</th>{over}</tr><tr>{under}</tr>'
        body = "".join(self._table_row(row, groups) for row in rows)
        table = f"<table><caption>{title}</caption><thead>{head}</thead><tbody>{body}</tbody></table>"
        return f'<div class="wide" role="region" aria-label="{title}" tabindex="0">{table}</div>'

    def _table_row(self, row: Row, groups: Groups) -> str:
        name = str(row["joint"])
        link = f'<a href="#{self.anchors[name]}">{escape(name)}</a>'
        cells = "".join(f"<td{_edge(k)}>{self._cell(key, row.get(key))}</td>" for _, columns in groups for k, (_, key) in enumerate(columns))
        return f'<tr><th scope="row">{link}</th><td>{escape(str(row["kind"]))}</td>{cells}</tr>'

    def _cell(self, key: str, value: float | str | None) -> str:
        return self._time(float(value)) if key.endswith("_time") and value is not None else escape(format_number(value))

    def _time(self, t: float) -> str:
        return f"{t - self.origin:.{self.time_decimals}f}"

    # -------------------------------------------------------------------------------------------------- power balance

    def _verdict(self) -> str:
        b = self.report.balance
        if b is None:
            return f'<p class="verdict">Power balance: {TOO_FEW}.</p>'
        if b.at_rest:
            return f'<p class="verdict"><a href="#balance">Power balance</a>: {AT_REST}.</p>'
        worse = "" if b.relative_residual <= LARGE_RESIDUAL else " large"
        return f'<p class="verdict{worse}"><a href="#balance">Power balance</a>: largest residual {_share(b.relative_residual)} of the largest power.</p>'

    def _balance(self) -> str:
        b = self.report.balance
        if b is None:
            return f'<section id="balance"><h2>Power balance</h2><p>Not checked: {TOO_FEW}.</p></section>'
        lost, energy = ("", "mechanical energy") if b.dissipation is None else (" − dissipation by damping and friction", "energy, rotors and springs included")
        text = (
            f"Drive power + power of external wrenches{lost} = rate of change of {energy}, at every sample. The right side comes from "
            "a spline through the energies, not from the dynamics: the two sides agree only if the efforts belong to this motion. "
        )
        text += f"<strong>Here there is {AT_REST}.</strong>" if b.at_rest else self._residual(b)
        sides = {"rate of energy": b.energy_rate, "drive": b.drive}
        if np.any(b.external):
            sides |= {"external": b.external}
        if b.dissipation is not None:
            sides |= {"− dissipation": -b.dissipation}
        if len(sides) > 2:
            sides |= {" + ".join(list(sides)[1:]).replace("+ −", "−"): b.supplied}
        residual = b.residual
        if b.at_rest:  # curves of rounding errors would look like results
            sides, residual = {name: np.zeros_like(x) for name, x in sides.items()}, np.zeros_like(residual)
        powers = self._time_chart("Power of both sides", [_Panel("Power, W", sides, emphasis=True)])
        rest = self._time_chart("Residual, and energy", [_Panel("Residual, W", {"residual": residual}), _Panel("Energy, J", {"energy": b.energy})])
        return f'<section id="balance"><h2>Power balance</h2><p>{text}</p><div class="charts">{powers}{rest}</div></section>'

    def _residual(self, b: PowerBalance) -> str:
        worst = int(np.argmax(np.abs(b.residual)))
        text = (
            f"<strong>Largest residual: {_share(b.relative_residual)} of the largest power</strong>, "
            f"{abs(b.residual[worst]):.3g} W at {self._time(self.report.time[worst])} s."
        )
        if b.relative_residual <= LARGE_RESIDUAL:
            return text
        return text + (
            ' <strong class="over">That is large</strong>: the positions, velocities and accelerations of the motion disagree, '
            "or it jumps, or its samples are too far apart."
        )

    # --------------------------------------------------------------------------------------------------------- joints

    def _joint(self, loads: JointLoads) -> str:
        joint, anchor = loads.joint, self.anchors[loads.joint.name]
        charts = self._axis_charts(loads) if joint.one_coordinate else self._magnitude_charts(loads)
        facts = "".join(f"<div><dt>{name}</dt><dd>{text}</dd></div>" for name, text in _joint_facts(loads))
        heading = f'<h2 id="{anchor}-name">{escape(joint.name)}</h2><dl>{facts}</dl>'
        return f'<section id="{anchor}" class="joint" aria-labelledby="{anchor}-name">{heading}<div class="charts">{charts}</div></section>'

    def _magnitude_charts(self, loads: JointLoads) -> str:
        force, moment = _quiet(loads.wrench["force"]), _quiet(loads.wrench["moment"])
        chart = self._time_chart("Force", [_Panel("Force, N", {"force": force})])
        return chart + self._time_chart("Moment", [_Panel("Moment, N m", {"moment": moment})])

    def _axis_charts(self, loads: JointLoads) -> str:
        """The drive's effort has a panel of its own, since its limit doesn't apply to moments about points other than the joint's origin."""
        joint, curves = loads.joint, {name: _quiet(x) for name, x in loads.wrench.items()}
        slides = not joint.has_angle
        forces = [_Panel("Force, N", {"axial": curves["axial_force"], "radial": curves["radial_force"]})]
        moments = [_Panel("Moment, N m", {"about axis": curves["axial_moment"], "bending": curves["bending_moment"]})]
        if loads.coupling is not None and loads.speed is not None:
            (forces if slides else moments).append(_Panel(f"Coupling, {unit('coupling', joint)}", {"coupling": _quiet(loads.coupling)}))
            moving = [_Panel(f"Speed, {unit('speed', joint)}", {"speed": _quiet(loads.speed)})]
            return self._time_chart("Forces", forces) + self._time_chart("Moments", moments) + self._time_chart("Speed", moving)
        if loads.speed is None or loads.effort is None or loads.power is None:
            return self._time_chart("Forces", forces) + self._time_chart("Moments", moments)
        speed, effort, drive = _quiet(loads.speed), _quiet(loads.effort), "Drive force" if slides else "Drive torque"
        speed_label, effort_label = f"Speed, {unit('speed', joint)}", f"{drive}, {unit('effort', joint)}"
        (forces if slides else moments).append(_Panel(effort_label, {"drive": effort}, _near(joint.effort, effort, 1.5)))
        parts = {name: _quiet(x) for name, x in loads.parts.items() if _peak(_quiet(x)) > 0}
        split = self._time_chart(f"What the {drive.lower()} consists of", [_Panel(effort_label, {"drive": effort, **parts}, emphasis=True)]) if parts else ""
        html = self._time_chart("Forces, and drive force" if slides else "Forces", forces, dashed="limit of the effort")
        html += self._time_chart("Moments" if slides else "Moments, and drive torque", moments, dashed="limit of the effort")
        html += self._time_chart(
            "Speed and power",
            [_Panel(speed_label, {"speed": speed}, _near(joint.velocity, speed, 1.5)), _Panel("Power, W", {"power": _quiet(loads.power)})],
            dashed="limit of the speed",
        )
        limits = _near(joint.velocity, speed, 5), _near(joint.effort, effort, 5)
        return html + split + self._path_chart(f"{drive} over speed", (speed_label, speed), (effort_label, effort), limits)

    # --------------------------------------------------------------------------------------------------------- charts

    def _time_chart(self, title: str, panels: list[_Panel], dashed: str = "limits") -> str:
        """Curves over time, one panel over the other, all at the same samples."""
        curves = [x for panel in panels for x in panel.curves.values()]
        keep = decimate(*curves, points=POINTS * len(curves))
        note = dashed if any(panel.limit for panel in panels) else ""
        return self._figure(title, note, {"time": self._packed_time(keep), "panels": [panel.packed(keep) for panel in panels]})

    def _path_chart(self, title: str, x: tuple[str, Array], y: tuple[str, Array], limits: tuple[float | None, float | None]) -> str:
        """One curve over another: a path in their plane, within the rectangle of limits."""
        keep = decimate(x[1], y[1], points=2 * POINTS)
        if all(math.isfinite(_peak(z)) and np.ptp(z) <= STILL * _peak(z) for z in (x[1], y[1])):
            keep = keep[:1]  # a single point needs a marker, since a line would be invisible
        abscissa = {"label": x[0], "data": _packed(x[1][keep]), "limit": limits[0]}
        panel = _Panel(y[0], {title: y[1]}, limits[1])
        dashed = "limits" if all(limits) else "limit of the speed" if limits[0] else "limit of the effort" if limits[1] else ""
        return self._figure(title, dashed, {"time": self._packed_time(keep), "x": abscissa, "panels": [panel.packed(keep)]})

    def _packed_time(self, keep: Indices) -> str:
        """Times since the first sample, since single precision can't represent seconds since 1970."""
        return _packed(self.report.time[keep] - self.report.time[0])

    def _figure(self, title: str, dashed: str, chart: dict[str, Any]) -> str:
        self.charts.append(chart)
        note = f" <small>dashed: {dashed}</small>" if dashed else ""
        return f'<figure><figcaption>{title}{note}</figcaption><div class="chart" data-chart="{len(self.charts) - 1}"></div></figure>'


@dataclass(frozen=True)
class _Panel:
    """Curves that share an ordinate."""

    label: str
    curves: dict[str, Array]
    limit: float | None = None
    """Drawn on both sides of zero."""
    emphasis: bool = False
    """The first curve is drawn wide, so that others drawn over it leave it visible."""

    def packed(self, keep: Indices) -> dict[str, Any]:
        curves = [{"name": name, "data": _packed(x[keep])} for name, x in self.curves.items()]
        return {"label": self.label, "curves": curves, "limit": self.limit, "emphasis": self.emphasis}


def _limits(verdict: Verdict | None) -> str:
    """The verdict on limits, in a line at the head."""
    if verdict is None:
        return ""
    reasons = "".join(f" Not green: {escape(reason)}." for reason in verdict.reasons)
    bad = "" if verdict.level == "green" else " large"
    return f'<p class="verdict{bad}"><strong>{verdict.level.upper()}</strong>: {escape(verdict.headline)}.{reasons}</p>'


def _origin(provenance: Provenance | None) -> list[tuple[str, str]]:
    """What made the results, without the load case, which is among the facts already."""
    if provenance is None:
        return []
    in_facts = {"motion", "gravity", "payloads", "physics of joints", "external wrenches"}
    return [(name, text) for name, text in provenance.lines() if name not in in_facts and not name.startswith("case ")]


def _group(joint: Joint) -> str:
    """Of joints that share tables in the summary, since their quantities have the same units."""
    if not joint.one_coordinate:
        return "Joints without one coordinate"
    if joint.leader is not None:
        return "Turning mimic joints" if joint.has_angle else "Sliding mimic joints"
    return "Turning joints" if joint.has_angle else "Sliding joints"


def _columns(joint: Joint, with_parts: bool) -> list[tuple[str, Groups]]:
    """The tables of the summary for a joint and its group, each with the end of its title: the wrench, the drive, the parts of its effort."""

    def group(name: str, last: str | None = "rms") -> tuple[str, list[tuple[str, str]]]:
        columns = [("peak", f"{name}_peak"), ("at, s", f"{name}_peak_time"), *([(last, f"{name}_{last}")] if last else [])]
        return f"{LABELS[name]}, {unit(name, joint)}", columns

    if not joint.one_coordinate:
        return [("", [group("force"), group("moment")])]
    wrench = [group(name) for name in ("axial_force", "radial_force", "bending_moment", "axial_moment")]
    if joint.leader is not None:
        return [(": the wrench at the chosen point", wrench), (": the coupling", [group("coupling"), group("speed", None)])]
    work = ("work, J", [("positive", "work_positive"), ("negative", "work_negative")])
    drive = [group("effort"), group("speed", None), group("power", "mean"), work]
    parts = [(": what the drive's effort consists of", [group(name) for name in EFFORT_PARTS])] if with_parts else []
    return [(": the wrench at the chosen point", wrench), (": the drive", drive), *parts]


def _edge(column: int) -> str:
    """CSS class of a cell: the first column of a group has a line on its left."""
    return ' class="first"' if column == 0 else ""


def _joint_facts(loads: JointLoads) -> list[tuple[str, str]]:
    """Kind, links, pitch and limits, with the share of each that the motion uses."""
    joint = loads.joint
    parent = "ground" if joint.parent is None else escape(joint.parent)
    facts = [("kind", joint.kind), ("links", f"{parent} → {escape(joint.child)}")]
    for name, axis in (("axis", joint.axis if joint.has_axis else None), ("second axis", joint.axis2)):
        if axis:
            facts.append((name, " ".join(f"{x:.4g}" for x in axis)))
    if not joint.one_coordinate:
        return facts
    if joint.pitch:
        facts.append(("pitch", f"{joint.pitch:.4g} m/rad"))
    if joint.leader is not None:
        facts.append(("follows", f"{joint.multiplier:.6g} × {escape(joint.leader)}" + (f" + {joint.offset:.6g}" if joint.offset else "")))
    facts.append(("effort limit", _limit(joint.effort, loads.effort, unit("effort", joint))))
    facts.append(("velocity limit", _limit(joint.velocity, loads.speed, unit("speed", joint))))
    return [*facts, ("position limits", _range(joint))]


def _limit(limit: float | None, curve: Array | None, unit: str) -> str:
    if limit is None:
        return "none given"
    text = f"{limit:.6g} {unit}"
    if curve is None or not limit > 0:
        return text
    share = _peak(_quiet(curve)) / limit
    used = f"{100 * share:.3g} % used"
    return f'{text}, <strong class="over">{used}</strong>' if share > 1 else f"{text}, {used}"


def _range(joint: Joint) -> str:
    if joint.lower is None and joint.upper is None:
        return "none given"
    lower, upper = ("–" if x is None else f"{x:.6g}" for x in (joint.lower, joint.upper))
    return f"{lower} to {upper} {joint.unit}"


def _near(limit: float | None, curve: Array | None, factor: float) -> float | None:
    """A limit to draw; None if it is so far away that it would flatten the curve."""
    if limit is None or curve is None:
        return None
    return limit if 0 < limit <= factor * _peak(curve) else None


def _share(x: float) -> str:
    """Two digits: 1.2e-6."""
    if not math.isfinite(x):
        return "–"
    mantissa, _, exponent = f"{x:.1e}".partition("e")
    return f"{mantissa}e{int(exponent)}" if x else "0"


def _peak(x: Array) -> float:
    return float(np.max(np.abs(x)))


def _quiet(x: Array) -> Array:
    """Replaces pure rounding errors by zero."""
    return np.zeros_like(x) if _peak(x) < ROUND_OFF else x


def _packed(x: Array) -> str:
    """Single precision (7 digits), little-endian, in base 64: short, and quick to write and to read.

    What is too large for it becomes infinite, and as what isn't finite a gap in the curve.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        return base64.b64encode(x.astype("<f4").tobytes()).decode("ascii")


def _inline(script: str) -> str:
    """Escapes JavaScript for an HTML page, so that no string in it ends the element or opens a comment."""
    return script.replace("</script", "<\\/script").replace("<!--", "<\\!--")


def _asset(name: str) -> str:
    return resources.files("ksl").joinpath("report", "assets", name).read_text(encoding="utf-8")
