"""The section of a joint: what it is, the limits and the share of them that is used, and its curves."""

from __future__ import annotations

from html import escape

from ksl.load_cases.quantities import JointLoads, unit
from ksl.mechanism import Joint
from ksl.report.charts import Charts, Panel
from ksl.report.numbers import peak, quiet
from ksl.states import Array


def joint_section(loads: JointLoads, anchor: str, charts: Charts) -> str:
    """The section, whose id is `anchor`."""
    joint = loads.joint
    figures = _axis_charts(loads, charts) if joint.one_coordinate else _magnitude_charts(loads, charts)
    facts = "".join(f"<div><dt>{name}</dt><dd>{text}</dd></div>" for name, text in _joint_facts(loads))
    heading = f'<h2 id="{anchor}-name">{escape(joint.name)}</h2><dl>{facts}</dl>'
    return f'<section id="{anchor}" class="joint" aria-labelledby="{anchor}-name">{heading}<div class="charts">{figures}</div></section>'


def _magnitude_charts(loads: JointLoads, charts: Charts) -> str:
    force, moment = quiet(loads.wrench["force"]), quiet(loads.wrench["moment"])
    chart = charts.over_time("Force", [Panel("Force, N", {"force": force})])
    return chart + charts.over_time("Moment", [Panel("Moment, N m", {"moment": moment})])


def _axis_charts(loads: JointLoads, charts: Charts) -> str:
    """The drive's effort has a panel of its own, since its limit doesn't apply to moments about points other than the joint's origin."""
    joint, curves = loads.joint, {name: quiet(x) for name, x in loads.wrench.items()}
    slides = not joint.has_angle
    forces = [Panel("Force, N", {"axial": curves["axial_force"], "radial": curves["radial_force"]})]
    moments = [Panel("Moment, N m", {"about axis": curves["axial_moment"], "bending": curves["bending_moment"]})]
    if loads.coupling is not None and loads.speed is not None:
        (forces if slides else moments).append(Panel(f"Coupling, {unit('coupling', joint)}", {"coupling": quiet(loads.coupling)}))
        moving = [Panel(f"Speed, {unit('speed', joint)}", {"speed": quiet(loads.speed)})]
        return charts.over_time("Forces", forces) + charts.over_time("Moments", moments) + charts.over_time("Speed", moving)
    if loads.speed is None or loads.effort is None or loads.power is None:
        return charts.over_time("Forces", forces) + charts.over_time("Moments", moments)
    speed, effort, drive = quiet(loads.speed), quiet(loads.effort), "Drive force" if slides else "Drive torque"
    speed_label, effort_label = f"Speed, {unit('speed', joint)}", f"{drive}, {unit('effort', joint)}"
    (forces if slides else moments).append(Panel(effort_label, {"drive": effort}, _near(joint.effort, effort, 1.5)))
    parts = {name: quiet(x) for name, x in loads.parts.items() if peak(quiet(x)) > 0}
    split = charts.over_time(f"What the {drive.lower()} consists of", [Panel(effort_label, {"drive": effort, **parts}, emphasis=True)]) if parts else ""
    html = charts.over_time("Forces, and drive force" if slides else "Forces", forces, dashed="limit of the effort")
    html += charts.over_time("Moments" if slides else "Moments, and drive torque", moments, dashed="limit of the effort")
    html += charts.over_time(
        "Speed and power",
        [Panel(speed_label, {"speed": speed}, _near(joint.velocity, speed, 1.5)), Panel("Power, W", {"power": quiet(loads.power)})],
        dashed="limit of the speed",
    )
    limits = _near(joint.velocity, speed, 5), _near(joint.effort, effort, 5)
    return html + split + charts.path(f"{drive} over speed", (speed_label, speed), (effort_label, effort), limits)


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
    share = peak(quiet(curve)) / limit
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
    return limit if 0 < limit <= factor * peak(curve) else None
