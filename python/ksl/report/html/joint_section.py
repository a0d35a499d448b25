"""The section of a joint: what it is, the limits and the share of them that is used, and its curves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from ksl.base.markup import html as escape

from ksl.load_cases.joint_limits import limits_of
from ksl.load_cases.quantities import JointLoads, unit
from ksl.load_cases.reaction_joints import LoopJoint
from ksl.load_cases.verdict import ROUND_OFF
from ksl.mechanism.mechanism import Joint
from ksl.mechanism.states import Array
from ksl.report.html.charts import Charts, Limits, Panel, limits_in_sight
from ksl.report.html.numbers import peak, quiet
from ksl.report.html.stills import Still

REACH = 3.0
"""Over time, limits are drawn that are up to this many times as far away as the curve."""
REACH_OF_PATH = 5.0
"""Over speed, limits of effort are drawn that are up to this many times as far away as the path."""


NOTHING = "It carries nothing throughout: there are no curves to show."


@dataclass(frozen=True)
class JointExtras:
    """What may stand in the section of a joint besides its curves."""

    still: Still | None = None
    raw_position: Array | None = None
    """(n), where the motion was smoothed."""
    table: str = ""
    """Below the curves."""
    undetermined: Sequence[str] = ()
    """Quantities of the wrench that rigid bodies leave open."""


def joint_section(loads: JointLoads, time: Array, anchor: str, charts: Charts, extras: JointExtras = JointExtras()) -> str:
    """The section, whose id is `anchor`."""
    joint = loads.joint
    facts = "".join(f"<div><dt>{name}</dt><dd>{text}</dd></div>" for name, text in [*_joint_facts(loads), *_undetermined(extras.undetermined)])
    heading = f'<h2 id="{anchor}-name">{escape(joint.name)}</h2><dl>{facts}</dl>'
    if _carries_nothing(loads):
        return f'<section id="{anchor}" class="joint" aria-labelledby="{anchor}-name">{heading}<p>{NOTHING}</p>{extras.table}</section>'
    figures = _axis_charts(loads, time, charts) if joint.one_coordinate else _magnitude_charts(loads, time, charts)
    figures = (charts.still(extras.still, time) if extras.still else "") + figures
    if extras.raw_position is not None and loads.position is not None:
        figures += _smoothing_chart(loads.position, extras.raw_position, joint.unit, time, charts)
    return f'<section id="{anchor}" class="joint" aria-labelledby="{anchor}-name">{heading}<div class="charts">{figures}</div>{extras.table}</section>'


def _undetermined(quantities: Sequence[str]) -> list[tuple[str, str]]:
    words = ", ".join(name.replace("_", " ") for name in quantities)
    return (
        [
            (
                "not determined",
                f"{words}: rigid bodies, and stiffnesses if there are some, leave {'them' if len(quantities) > 1 else 'it'} open; shown is one of the possible values, without stiffnesses that of least norm",
            )
        ]
        if words
        else []
    )


def _carries_nothing(loads: JointLoads) -> bool:
    """No force, no moment and no effort at any sample, but for round-off."""
    curves = [*loads.wrench.values(), *(x for x in (loads.effort, loads.coupling, loads.brake) if x is not None)]
    return all(peak(quiet(x)) == 0 for x in curves)


def _magnitude_charts(loads: JointLoads, time: Array, charts: Charts) -> str:
    force, moment = quiet(loads.wrench["force"]), quiet(loads.wrench["moment"])
    chart = charts.over_time(time, "Force", [Panel("Force, N", {"force": force})])
    return chart + charts.over_time(time, "Moment", [Panel("Moment, N m", {"moment": moment})])


def _axis_charts(loads: JointLoads, time: Array, charts: Charts) -> str:
    joint, curves = loads.joint, {name: quiet(x) for name, x in loads.wrench.items()}
    along, about = ("", "about axis") if joint.has_angle else ("axial", "")  # what the drive exerts, or a coupling
    html = charts.over_time(time, "Forces", [Panel("Force, N", {"axial": curves["axial_force"], "radial": curves["radial_force"]}, driven=along)])
    html += charts.over_time(time, "Moments", [Panel("Moment, N m", {"about axis": curves["axial_moment"], "bending": curves["bending_moment"]}, driven=about)])
    moving, names = [], []
    if loads.position is not None:
        given = limits_of(joint)
        moving.append(Panel(f"Position, {joint.unit}", {"position": loads.position}, limits_in_sight(loads.position, given.lower, given.upper, REACH)))
        names.append("position")
    if loads.speed is not None:
        speed = quiet(loads.speed)
        moving.append(Panel(f"Speed, {unit('speed', joint)}", {"speed": speed}, _in_sight(speed, joint.velocity, REACH)))
        names.append("speed")
    if moving:
        html += charts.over_time(time, " and ".join(names).capitalize(), moving)
    if loads.coupling is not None:
        html += charts.over_time(time, "Effort of the coupling", [Panel(f"Coupling, {unit('coupling', joint)}", {"coupling": quiet(loads.coupling)})])
    return html + _drive_charts(loads, time, charts)


def _drive_charts(loads: JointLoads, time: Array, charts: Charts) -> str:
    """Charts of the brake, and of the drive that it relieves, if that has an effort.

    The drive's limit applies to its effort, and not to moments about points other than the joint's origin.
    """
    joint = loads.joint
    if loads.speed is None or loads.effort is None or loads.power is None:
        return ""
    speed, effort, drive = quiet(loads.speed), quiet(loads.effort), "Drive torque" if joint.has_angle else "Drive force"
    speed_label, effort_label = f"Speed, {unit('speed', joint)}", f"{drive}, {unit('effort', joint)}"
    html = ""
    if loads.brake is not None:
        brake = "Brake torque" if joint.has_angle else "Brake force"
        html = charts.over_time(time, brake, [Panel(f"{brake}, {unit('brake', joint)}", {"brake": quiet(loads.brake)})])
        if peak(effort) == 0:
            return html
    driven = Panel(effort_label, {"drive": effort}, _in_sight(effort, joint.effort, REACH))
    html += charts.over_time(time, f"{drive} and power", [driven, Panel("Power, W", {"power": quiet(loads.power)})])
    parts = {name: quiet(x) for name, x in loads.parts.items() if peak(quiet(x)) > 0}
    if parts:
        html += charts.over_time(time, f"What the {drive.lower()} consists of", [Panel(effort_label, {"drive": effort, **parts}, emphasis=True)])
    limits = _in_sight(speed, joint.velocity, REACH_OF_PATH), _in_sight(effort, joint.effort, REACH_OF_PATH)
    return html + charts.path(time, f"{drive} over speed", (speed_label, speed), (effort_label, effort), limits)


def _smoothing_chart(position: Array, raw: Array, unit: str, time: Array, charts: Charts) -> str:
    """Raw and smoothed positions, and between them what was taken away: one would not see it in the positions."""
    both = Panel(f"Position, {unit}", {"raw": raw, "smoothed": position}, emphasis=True)
    return charts.over_time(time, "Positions, raw and smoothed", [both, Panel(f"Raw − smoothed, {unit}", {"difference": raw - position})])


def _in_sight(x: Array, limit: float | None, reach: float) -> Limits:
    """A limit of the magnitude, on each side of zero where the curve comes near it."""
    return limits_in_sight(x, -limit, limit, reach) if limit else ()


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
    if isinstance(joint, LoopJoint):
        return [*facts, ("closes", "a loop")]
    if loads.effort is None and joint.leader is None:
        facts.append(("motor", "none"))
    else:
        facts.append(("effort limit", _limit(joint.effort, loads.effort, unit("effort", joint))))
    facts.append(("velocity limit", _limit(joint.velocity, loads.speed, unit("speed", joint))))
    return [*facts, ("position limits", _range(joint, loads.position))]


def _limit(limit: float | None, curve: Array | None, unit: str) -> str:
    if limit is None:
        return "none given"
    if limit == 0:
        return "none given (the file says 0)"
    text = f"{limit:.6g} {unit}"
    if curve is None or not limit > 0:
        return text
    share = peak(quiet(curve)) / limit
    used = f"{100 * share:.3g} % used"
    return f'{text}, <strong class="over">{used}: exceeded</strong>' if share > 1 + ROUND_OFF else f"{text}, {used}"


def _range(joint: Joint, position: Array | None) -> str:
    given = limits_of(joint)
    lower, upper = given.lower, given.upper
    if lower is None and upper is None:
        return "none given" if joint.lower is None else f"none given (the file says {joint.lower:g} for both)"
    text = f"{'–' if lower is None else f'{lower:.6g}'} to {'–' if upper is None else f'{upper:.6g}'} {joint.unit}"
    if position is None:
        return text
    low, high = float(position.min()), float(position.max())
    used = f"motion from {low:.5g} to {high:.5g}"
    beyond = (lower is not None and lower - low > ROUND_OFF) or (upper is not None and high - upper > ROUND_OFF)
    return f'{text}, <strong class="over">{used}: exceeded</strong>' if beyond else f"{text}, {used}"
