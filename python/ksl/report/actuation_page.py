"""report.html of `ksl actuation`: limits beside the true ones, maps over the range, the serial model, and a motion."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ksl._core import __version__
from ksl.base.markup import html as escape
from ksl.base.words import listed
from ksl.mechanism.states import Array
from ksl.report.html.charts import Charts, Panel
from ksl.report.html.numbers import format_number
from ksl.report.html.page import write_page

if TYPE_CHECKING:
    from ksl.report.actuation_results import ActuationResults, JointCurves

CURVES = ("structure", "drive", "external", "part-1", "part-2", "part-4", "structure-2", "part-5")
"""Colours of curves of which there may be several."""
WORDS = {"too large": "over", "partly too large": "near", "too small": "", "not judged": "near", "true": "good"}
SECTIONS = (("limits", "Limits"), ("maps", "Maps over the range"), ("serial", "The serial model"))


def write_actuation_page(path: Path, run: ActuationResults) -> None:
    """Writes one HTML file that holds all it needs."""
    charts = Charts(len(run.curves) + 1)
    a = run.actuation
    title = f"{a.model.name}: {listed(a.joints)} by {listed(a.motors)}"
    sections = [_limits(run), *_maps(run, charts), _serial(run), _motion(run, charts)]
    links = [*SECTIONS, *([("motion", "Along the motion")] if run.motion else [])]
    navigation = "".join(f'<li><a href="#{anchor}">{text}</a></li>' for anchor, text in links)
    head = f'<h1>{escape(title)}</h1><p class="made">KSL {escape(__version__)}</p>{_facts(run)}'
    write_page(path, title, f'<nav aria-label="Contents"><ul>{navigation}</ul></nav><main><header>{head}</header>{"".join(sections)}</main>', charts)


def _facts(run: ActuationResults) -> str:
    a = run.actuation
    rods = [rod.link for rod in a.equations.rods]
    rows = [
        ("Joints", listed(a.joints)),
        ("Motors", f"{listed(a.motors)}: numbers are those of their joints, on the output side of gears"),
        ("Loops", listed(a.loops) or "none: each joint is its own motor"),
        ("Rods that turn idly", f"{listed(rods)}: they have balls at both ends, and no spin" if rods else "none"),
        ("Curves go through", ", ".join(f"{name} {format_number(x)} {a.model.joint(name).unit}" for name, x in zip(a.joints, run.at))),
        ("Command", run.command),
    ]
    cells = "".join(f'<tr><th scope="row">{escape(name)}</th><td>{escape(text)}</td></tr>' for name, text in rows if text)
    return f'<table class="facts"><caption class="unseen">What was computed</caption><tbody>{cells}</tbody></table>'


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Cells are HTML."""
    top = "".join(f'<th scope="col">{cell}</th>' for cell in head)
    body = "".join(f'<tr><th scope="row">{row[0]}</th>{"".join(f"<td>{cell}</td>" for cell in row[1:])}</tr>' for row in rows)
    return f'<div class="wide"><table><thead><tr>{top}</tr></thead><tbody>{body}</tbody></table></div>'


def _unit(run: ActuationResults, joint: str, what: str) -> str:
    unit = run.actuation.model.joint(joint).unit
    return {"effort": "N m" if unit == "rad" else "N", "velocity": f"{unit}/s"}.get(what, unit)


def _limits(run: ActuationResults) -> str:
    limits = run.limits
    said = "What files allow, and what the motors give: of efforts and velocities of the joint alone, least and most over the range, and what all joints have together everywhere."
    several = len({row.file for row in limits}) > 1
    rows = []
    for row in limits:
        between = (
            ""
            if row.judgement == "not judged"
            else format_number(row.least)
            if row.least == row.most
            else f"{format_number(row.least)} to {format_number(row.most)}"
        )
        colour = WORDS[row.judgement]
        verdict = f'<span style="color:var(--{colour})">{row.judgement}</span>' if colour else row.judgement
        name = f"{escape(row.file)}: {escape(row.joint)}" if several else escape(row.joint)
        reason = f'<span class="reason">{escape(row.reason)}</span>'
        together = format_number(row.box) if np.isfinite(row.box) else ""
        rows.append((name, f"{row.what}, {_unit(run, row.joint, row.what)}", format_number(row.given or 0.0), between, together, verdict, reason))
    return (
        f'<section id="limits"><h2>Limits</h2><p>{said}</p>{_table(("Joint", "Limit", "File", "Motors give", "Together", "The file is", ""), rows)}</section>'
    )


def _maps(run: ActuationResults, charts: Charts) -> list[str]:
    sections = []
    for i, c in enumerate(run.curves):
        others = ", ".join(f"{name} at {format_number(x)}" for name, x in zip(run.actuation.joints, run.at) if name != c.joint)
        figures = "".join(_figures(run, c, charts))
        anchor = ' id="maps"' if i == 0 else ""
        sections.append(
            f'<section{anchor}><h2>{escape(c.joint)}</h2>{f"<p>With {escape(others)}.</p>" if others else ""}<div class="charts">{figures}</div></section>'
        )
    return sections


def _figures(run: ActuationResults, c: JointCurves, charts: Charts) -> list[str]:
    a, k = run.actuation, run.actuation.joints.index(c.joint)
    joint = a.model.joint(c.joint)
    x = (f"{c.joint}, {c.unit}", c.q[:, k])
    effort, inertia = ("N m", "kg m²") if c.unit == "rad" else ("N", "kg")
    positions, ratios = ({name: rows[:, j] for j, name in enumerate(a.motors)} for rows in (c.motors, c.ratios))
    units = {a.model.joint(name).unit for name in a.motors}
    motor_unit = units.pop() if len(units) == 1 else "rad or m"
    found = [
        charts.over("Motors' positions", x, [Panel(f"Motors, {motor_unit}", positions, colours=CURVES)]),
        charts.over("Motors' velocities for one of the joint", x, [Panel(f"Ratio, {motor_unit}/{c.unit}", ratios, colours=CURVES)]),
    ]
    for title, alone, box, limit, label in (
        ("Efforts that motors give", c.effort, c.effort_box, joint.effort, f"Effort, {effort}"),
        ("Velocities that motors give", c.velocity, c.velocity_box, joint.velocity, f"Velocity, {c.unit}/s"),
    ):
        if alone is not None and box is not None:
            both = {"alone": alone} if len(a.joints) == 1 else {"alone": alone, "with all joints together": box}
            found.append(charts.over(title, x, [Panel(label, both, limits=(limit,) if limit else (), colours=CURVES)]))
    found.append(
        charts.over("Reflected inertia", x, [Panel(f"Inertia, {inertia}", {"rotors": c.rotors, "rods and cranks": c.rods}, colours=("drive", "structure"))])
    )
    found.append(
        charts.over("Distance from where motors hold nothing (1 here, 0 there)", x, [Panel("Relative det, 1", {"distance": c.distance}, colours=CURVES)])
    )
    return found


def _serial(run: ActuationResults) -> str:
    a, serial, e = run.actuation, run.serial, run.errors
    rows = []
    for k, name in enumerate(a.joints):
        joint = serial.joint(name)
        unit = "N m" if joint.unit == "rad" else "N"
        limits = [format_number(x) if x else "none" for x in (joint.effort, joint.velocity)]
        mine, naive = (
            f"{format_number(rms[k])}, at most {format_number(largest[k])} {unit}"
            for rms, largest in ((e.root_mean_square, e.largest), (e.naive_root_mean_square, e.naive_largest))
        )
        units = ("kg m²" if joint.unit == "rad" else "kg", unit, f"{joint.unit}/s")
        rows.append((escape(name), *(f"{x} {u}" for x, u in zip((format_number(joint.armature), *limits), units)), mine, naive))
    inertia = a.reflected_inertia(run.at)
    left = _off_diagonal(inertia, a.joints)
    said = "A tree without loops for simulators: serial.urdf and serial.xml. At the place of the curves its mass, centre of mass and diagonal of the mass matrix are exact."
    head = ("Joint", "Armature", "Effort limit", "Velocity limit", "Efforts are off by, over the range", "Without rods and rotors")
    return f'<section id="serial"><h2>The serial model</h2><p>{said}</p>{_table(head, rows)}<p>{escape(left)}</p></section>'


def _off_diagonal(inertia: Array, joints: Sequence[str]) -> str:
    """What a diagonal armature leaves out."""
    pairs = [(joints[i], joints[j], float(inertia[i, j]), float(np.sqrt(inertia[i, i] * inertia[j, j]))) for i in range(len(joints)) for j in range(i)]
    pairs = [pair for pair in pairs if pair[3] > 0]
    if not pairs:
        return ""
    named = "; ".join(f"{format_number(x)} between {one} and {other}, {abs(x) / size:.0%} of what its diagonal would bear" for one, other, x, size in pairs)
    return f"An armature has no off-diagonal. Left out is, of rotors and rods at the place of the curves: {named}."


def _motion(run: ActuationResults, charts: Charts) -> str:
    if run.motion is None:
        return ""
    x, a = run.motion, run.actuation
    rows = []
    for k, name in enumerate(a.motors):
        joint = a.model.joint(name)
        units = [_unit(run, name, what) for what in ("effort", "velocity", "effort")]
        peaks = [np.abs(values[:, k]).max() for values in (x.efforts, x.speeds, x.efforts - x.static)]
        shares = [f"{peak / limit:.0%} of {format_number(limit)}" if limit else "no limit" for peak, limit in zip(peaks, (joint.effort, joint.velocity))]
        largest = [f"{format_number(peak)} {unit}" for peak, unit in zip(peaks, units)]
        rows.append((escape(name), largest[0], shares[0], largest[1], shares[1], largest[2]))
    figures = []
    for k, name in enumerate(a.motors):
        both = {"with rods and rotors": x.efforts[:, k], "static map": x.static[:, k]}
        figures.append(
            charts.over_time(x.time, f"Effort of {escape(name)}", [Panel(f"Effort, {_unit(run, name, 'effort')}", both, colours=("drive", "motion-2"))])
        )
    if a.loops:
        figures.append(
            charts.over_time(
                x.time, "Forces at the ends of rods", [Panel("Force, N", {name: x.forces[:, k] for k, name in enumerate(a.loops)}, colours=CURVES)]
            )
        )
    e = x.errors
    off = "; ".join(
        f"{name} {format_number(e.root_mean_square[k])} (without rods and rotors {format_number(e.naive_root_mean_square[k])})"
        for k, name in enumerate(a.joints)
    )
    forces = "; ".join(f"{name} {format_number(np.abs(x.forces[:, k]).max())} N" for k, name in enumerate(a.loops))
    head = ("Motor", "Largest effort", "Share", "Largest velocity", "Share", "The static map errs by")
    lines = f"<p>Rods: {escape(forces)}.</p>" if forces else ""
    lines += f"<p>Doubts:</p><ul>{''.join(f'<li>{escape(doubt)}</li>' for doubt in x.doubts)}</ul>" if x.doubts else ""
    lines += f"<p>Efforts of the serial model are off along it, root mean square: {escape(off)}.</p>"
    return f'<section id="motion"><h2>Along the motion</h2>{_table(head, rows)}{lines}<div class="charts">{"".join(figures)}</div></section>'
