"""Figures against plain limits of force, moment and speed."""

from __future__ import annotations

import numpy as np

from ksl.sizing.figures import Formula, significant
from ksl.sizing.sheet import RPM, Sheet


def limit_figures(sheet: Sheet) -> None:
    """Adds the largest magnitude of each component for which a limit is given."""
    s = sheet.samples.about(sheet.part.get("at"))
    curves = {
        "axial_force": (np.abs(s.axial_force), "N", "max |F · k|, k the axis"),
        "radial_force": (s.radial_force, "N", "max |F − (F · k) k|"),
        "bending_moment": (s.bending_moment, "N m", "max |M − (M · k) k|"),
        "torque": (np.abs(s.axial_moment), "N m", "max |M · k|"),
        "speed_rpm": (np.abs(s.speed) * RPM, "r/min", "max |n|"),
    }
    known = [key for key in curves if sheet.part.get(key) is not None or key in sheet.part.refused]
    if not known:
        sheet.leave_out("everything", f"no limit is given; known: {', '.join(curves)}")
    for key in known:
        x, unit, text = curves[key]
        figure = "speed" if key == "speed_rpm" else key.replace("_", " ")
        if key == "speed_rpm" and not s.joint.turns:
            sheet.leave_out(figure, f"{s.joint.name} is {s.joint.kind} and has no speed in r/min")
            continue
        if not sheet.has(figure, key):
            continue
        k = int(np.argmax(x))
        others = {
            name: f"{significant(float(c[0][k]))} {c[1]}"
            for name, c in curves.items()
            if name not in (key, "speed_rpm")
        }
        sheet.add(
            figure,
            Formula(text, "wrench on the child at the point `at`"),
            float(x[k]),
            unit,
            {**sheet.given("at"), **others},
            key,
            at=k,
            uses=() if key == "speed_rpm" else ("axial_moment",) if key == "torque" else (key,),
        )
