"""Figures of pins and of plain bushes."""

from __future__ import annotations

import numpy as np

from ksl.mechanism.states import Array
from ksl.sizing import pins
from ksl.sizing.figures import Formula, significant
from ksl.sizing.samples import JointSamples
from ksl.sizing.utilisation.sheet import Sheet

RADIAL, BOTH = ("radial_force",), ("radial_force", "bending_moment")


def pin_figures(sheet: Sheet) -> None:
    """Adds bending, shear and the pressures in eye and cheeks."""
    part = sheet.part
    if not sheet.has("everything", "diameter", "inner_diameter", "eye_width", "cheek_width", "gap", "position"):
        return
    d, inner, t, b, gap = (float(part.get(key)) for key in ("diameter", "inner_diameter", "eye_width", "cheek_width", "gap"))
    if inner >= d:
        sheet.leave_out("everything", f"{part.where}: inner_diameter {inner:g} m is not less than the diameter {d:g} m")
        return
    s = _middle(sheet)
    moment, used = _moment(sheet, s)
    share = pins.shares(s.force, moment, s.axis, t + 2 * gap + b)
    sizes = sheet.given("diameter", "inner_diameter", "eye_width", "cheek_width", "gap", "moment")
    two = f"{pins.SHARES.text}; "
    worst = int(np.argmax(share))
    said = sizes | {"F": f"{significant(float(s.radial_force[worst]))} N", "R": f"{significant(float(share[worst]))} N"}
    for name, formula, x, key in (
        ("bending stress", pins.BENDING, pins.bending_stress(share, d, inner, t, b, gap), "bending_stress"),
        ("shear stress", pins.SHEAR, pins.shear_stress(share, d, inner), "shear_stress"),
        ("pressure in the cheeks", pins.CHEEK, share / (d * b), "cheek_pressure"),
    ):
        sheet.add(name, Formula(two + formula.text, formula.source), float(x[worst]), "Pa", said, key, at=worst, uses=used)
    bending = np.linalg.norm(moment - (moment @ s.axis)[:, None] * s.axis, axis=1)
    _largest(sheet, "pressure in the eye", pins.PRESSURE, pins.edge_pressure(s.radial_force, bending, d, t), "Pa", sizes, "eye_pressure", used)


def bush_figures(sheet: Sheet) -> None:
    """Adds specific pressure, sliding speed, p·v and the life by wear."""
    part = sheet.part
    if "spacing" in part.refused:
        sheet.leave_out("everything", part.why_absent("spacing"))
        return
    s = _middle(sheet)
    d, width, spacing = sheet.number("diameter"), sheet.number("width"), part.get("spacing")
    moment, used = _moment(sheet, s)
    sizes = sheet.given("diameter", "width", "spacing", "moment")
    if spacing is not None:
        share = pins.shares(s.force, moment, s.axis, float(spacing))
        pressure, formula = share / (d * width), Formula(f"{pins.SHARES.text}; p = R/(d b)", pins.CHEEK.source)
    else:
        bending = np.linalg.norm(moment - (moment @ s.axis)[:, None] * s.axis, axis=1)
        pressure, formula = pins.edge_pressure(s.radial_force, bending, d, width), pins.PRESSURE
    speed = np.abs(s.speed) * d / 2
    _largest(sheet, "specific pressure", formula, pressure, "Pa", sizes, "max_pressure", used)
    _largest(sheet, "sliding speed", pins.SPEED, speed, "m/s", sheet.given("diameter"), "max_speed", ())
    _largest(sheet, "largest p·v", pins.PV_SHORT, pressure * speed, "W/m²", sizes, "max_pv_short", used)
    total = float(s.weight.sum())
    if total <= 0:
        sheet.leave_out("mean p·v and wear", "no case lasts any time")
        return
    mean = float((pressure * speed) @ s.weight) / total
    sheet.add("mean p·v", pins.PV, mean, "W/m²", sizes, "max_pv", case=s.governing_case(pressure * speed * s.weight), uses=used)
    _wear(sheet, s, mean, pressure * speed, used)


def _wear(sheet: Sheet, s: JointSamples, mean: float, pv: Array, used: tuple[str, ...]) -> None:
    """The hours after which the allowed depth has worn off."""
    if all(key not in sheet.part.values for key in ("wear_coefficient", "max_wear")):
        return  # few catalogues have them
    if not sheet.has("life by wear", "wear_coefficient", "max_wear"):
        return
    an_hour = sheet.number("wear_coefficient") * mean * 3600
    if an_hour <= 0:
        sheet.leave_out("life by wear", "the joint does not turn under load in the cycle")
        return
    inputs = sheet.given("wear_coefficient", "max_wear") | {"h of one hour": f"{significant(an_hour)} m"}
    sheet.add(
        "life by wear",
        pins.WEAR,
        sheet.number("max_wear") / an_hour,
        "h",
        inputs,
        sheet.required_life(),
        case=s.governing_case(pv * s.weight),
        smallest=True,
        uses=used,
    )


def _middle(sheet: Sheet) -> JointSamples:
    """The wrenches about the middle of the component."""
    return sheet.samples.about(sheet.number("position") * sheet.samples.axis)


def _moment(sheet: Sheet, s: JointSamples) -> tuple[Array, tuple[str, ...]]:
    """The moment (n, 3) that the component carries, and the quantities that its figures use."""
    return (s.moment, BOTH) if sheet.part.get("moment") == "carried" else (np.zeros_like(s.moment), RADIAL)


def _largest(sheet: Sheet, name: str, formula: Formula, x: Array, unit: str, inputs: dict[str, str], key: str, used: tuple[str, ...]) -> None:
    k = int(np.argmax(x))
    acting = {"F": f"{significant(float(sheet.samples.radial_force[k]))} N"} if used else {"ω": f"{significant(abs(float(sheet.samples.speed[k])))} rad/s"}
    sheet.add(name, formula, float(x[k]), unit, inputs | acting, key, at=k, uses=used)
