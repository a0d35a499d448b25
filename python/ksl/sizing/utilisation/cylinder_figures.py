"""Figures of hydraulic cylinders with one rod."""

from __future__ import annotations

import math

import numpy as np

from ksl.sizing.buckling import BUCKLING, critical_force
from ksl.sizing.figures import Formula, significant
from ksl.sizing.utilisation.sheet import Sheet

PUSH = Formula("p = (F/η + p_back A_rod)/A_bore, A_bore = π D²/4, A_rod = π (D² − d²)/4", "balance of the piston, friction against the motion")
PULL = Formula("p = (−F/η + p_back A_bore)/A_rod, A_bore = π D²/4, A_rod = π (D² − d²)/4", PUSH.source)
FLOW_BORE = Formula("Q = A_bore |v|", "conservation of volume")
FLOW_ROD = Formula("Q = A_rod |v|", "conservation of volume")
STROKE = Formula("max of position − retracted position", "geometry")


def cylinder_figures(sheet: Sheet) -> None:
    """Adds pressures on both sides, flows, speed, stroke and buckling.  F is what the cylinder pushes with, negative where it pulls."""
    part, s = sheet.part, sheet.samples
    D, d = sheet.number("bore"), sheet.number("rod_diameter")
    if d >= D:
        sheet.leave_out("everything", f"{part.where}: rod_diameter {d:g} m is not less than the bore {D:g} m")
        return
    sign = 1.0 if part.get("extends") == "positive" else -1.0
    bore, ring = math.pi * D**2 / 4, math.pi * (D**2 - d**2) / 4
    force, speed = sign * s.load_effort, sign * s.speed
    sizes = sheet.given("bore", "rod_diameter", "extends")
    if sheet.has("pressures", "efficiency", "back_pressure"):
        eta, back = sheet.number("efficiency"), sheet.number("back_pressure")
        for side, formula, acting, area, other in (("bore", PUSH, force, bore, ring), ("rod", PULL, -force, ring, bore)):
            k = int(np.argmax(acting))
            if acting[k] > 0:  # a cylinder that never pulls has no pressure there but that of the oil that returns
                said = sizes | sheet.given("efficiency", "back_pressure") | {"F": f"{significant(float(force[k]))} N"}
                sheet.add(f"pressure on the {side} side", formula, (float(acting[k]) / eta + back * other) / area, "Pa", said, "max_pressure", at=k)
    _buckling(sheet, force, sign * s.position)
    travel = sign * s.position - sign * sheet.number("retracted_position")
    lowest, highest = int(np.argmin(travel)), int(np.argmax(travel))
    inputs = sheet.given("retracted_position", "extends") | {"least": f"{significant(float(travel[lowest]))} m"}
    below = "the cylinder is farther in than all in: check retracted_position and extends" if travel[lowest] < -1e-9 else ""
    if below:
        sheet.leave_out("the verdict on “stroke”", f"{below}; least {travel[lowest]:.4g} m")
    sheet.add("stroke", STROKE, float(travel[highest]), "m", inputs, None if below else "stroke", at=highest)
    k = int(np.argmax(np.abs(speed)))
    sheet.add("speed", Formula("max |v|", "kinematics"), abs(float(speed[k])), "m/s", {}, "max_speed", at=k)
    for side, formula, area in (("bore", FLOW_BORE, bore), ("rod", FLOW_ROD, ring)):
        sheet.add(
            f"flow on the {side} side", formula, abs(float(speed[k])) * area, "m³/s", sizes | {"v": f"{significant(float(speed[k]))} m/s"}, "max_flow", at=k
        )


def _buckling(sheet: Sheet, force: np.ndarray, out: np.ndarray) -> None:
    """The least critical force over pushing force: at each sample with its own length."""
    if not force.max() > 0:
        return  # it never pushes
    if not sheet.has("buckling", "retracted_length", "buckling_factor", "elastic_modulus", "required_buckling_safety"):
        return
    sign = 1.0 if sheet.part.get("extends") == "positive" else -1.0
    length = sheet.number("retracted_length") + out - sign * sheet.number("retracted_position")
    if not length.min() > 0:
        sheet.leave_out("buckling", f"the length from pin to pin would be {length.min():.4g} m; check retracted_length and retracted_position")
        return
    critical = critical_force(
        length, sheet.number("rod_diameter"), sheet.part.get("rod_material"), sheet.number("elastic_modulus"), sheet.number("buckling_factor")
    )
    with np.errstate(over="ignore"):
        safety = np.divide(critical, force, out=np.full(force.shape, np.inf), where=force > 0)
    k = int(np.argmin(safety))
    inputs = sheet.given("rod_diameter", "retracted_length", "buckling_factor", "rod_material", "elastic_modulus")
    inputs |= {"L": f"{significant(float(length[k]))} m", "F_k": f"{significant(float(critical[k]))} N", "F_push": f"{significant(float(force[k]))} N"}
    sheet.add("safety against buckling", BUCKLING, float(safety[k]), "", inputs, "required_buckling_safety", at=k, smallest=True)
