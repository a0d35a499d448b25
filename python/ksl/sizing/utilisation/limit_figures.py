"""Figures against plain limits of force, moment and speed."""

from __future__ import annotations

import numpy as np

from ksl.sizing.figures import Formula, significant
from ksl.sizing.samples import JointSamples
from ksl.sizing.utilisation.sheet import RPM, Sheet


def limit_figures(sheet: Sheet) -> None:
    """Adds the largest magnitude of each component for which a limit is given."""
    s = sheet.placed
    if s is None:
        return
    moves = s.joint.driven and (not s.joint.turns or bool(np.cross(sheet.part.get("at"), s.axis).any()))
    sheet.remark = sheet.moves_along if moves else ""  # otherwise the figures are those of either link
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
        others = {name: f"{significant(float(c[0][k]))} {c[1]}" for name, c in curves.items() if name not in (key, "speed_rpm")}
        uses = () if key == "speed_rpm" else ("axial_moment",) if key == "torque" else (key,)
        sheet.add(
            figure, Formula(text, "wrench on the child at the point `at`"), float(x[k]), unit, {**sheet.given("at", "on"), **others}, key, at=k, uses=uses
        )
        if uses and sheet.judged(uses):
            _determined_part(sheet, s, key, figure, unit)


def _determined_part(sheet: Sheet, s: JointSamples, key: str, figure: str, unit: str) -> None:
    """What is known of a force or a moment whose other components rigid bodies leave open: it is at least so large."""
    if sorted(np.abs(s.axis)) != [0, 0, 1] or key not in ("radial_force", "bending_moment"):
        return
    letter, vectors = ("f", s.force) if key == "radial_force" else ("t", s.moment)
    across = np.abs(s.axis) != 1
    known = np.array([f"{letter}{c}" not in s.undetermined for c in "xyz"]) & across
    if not known.any():
        return
    sizes = np.linalg.norm(vectors[:, known], axis=1)
    k = int(np.argmax(sizes))
    names = " and ".join(f"{letter}{c}" for c, is_known in zip("xyz", known, strict=True) if is_known)
    sheet.add(
        f"{figure}, determined part",
        Formula(f"max of {names} together", "wrench on the child at the point `at`, without what rigid bodies leave open"),
        float(sizes[k]),
        unit,
        sheet.given("at", "on"),
        key,
        at=k,
        note="the whole is at least so large: a limit that is exceeded here is exceeded, and one that is kept here may be exceeded by the rest",
        uses=(),
    )
