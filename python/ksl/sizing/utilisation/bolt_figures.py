"""Figures of a bolted flange."""

from __future__ import annotations

import math

import numpy as np

from ksl.base.errors import SizingError
from ksl.mechanism.states import Array
from ksl.sizing import bolts
from ksl.sizing.bolt_strength import AMPLITUDE_LIMIT, PRELOAD, RESILIENCE
from ksl.sizing.figures import Formula, significant
from ksl.sizing.utilisation.sheet import Sheet


def flange_figures(sheet: Sheet) -> None:
    """Adds the figures of a flange: the most loaded bolt, its force, the clamp force that is left, slip."""
    part, s = sheet.part, sheet.placed
    if s is None:
        return
    sheet.remark = sheet.moves_along
    axes = _flange_axes(sheet)
    points = _points(sheet)
    # The wrench is what the parent exerts on the child; the child pulls at its bolts with the opposite.
    try:
        loads = bolts.pattern_loads(points, -s.force @ axes.T, -s.moment @ axes.T)
    except ValueError as e:
        raise SizingError(f"{part.where}: {part.name}: {e}") from None
    axial, shear = loads.axial, np.hypot(loads.shear[..., 0], loads.shear[..., 1])
    inputs = {"bolts": str(len(points))} | (sheet.given("circle_diameter") if part.get("bolts") else {}) | sheet.given("at", "on")
    k, bolt = _worst(axial)
    sheet.add("axial load of a bolt", bolts.PATTERN, float(axial[k, bolt]), "N", {**inputs, "bolt": _bolt(points, bolt)}, at=k)
    k, bolt = _worst(shear)
    sheet.add("shear load of a bolt", bolts.PATTERN, float(shear[k, bolt]), "N", {**inputs, "bolt": _bolt(points, bolt)}, at=k)
    phi, said = _load_factor(sheet)
    if phi is None:
        return
    _bolt_force(sheet, phi, said, axial, points)
    if sheet.has("clamp force, slip and required preload", "preload", "embedding_loss", "required_clamp"):
        _clamp(sheet, phi, said, axial, shear, points)


def _flange_axes(sheet: Sheet) -> Array:
    """Rows: x, y and z of the flange in the joint's axes."""
    part = sheet.part
    normal = np.array(part.get("normal") or sheet.samples.axis, dtype=float)
    if not normal.any():
        raise SizingError(f"{part.where}: {part.name}: normal is zero; give a direction along the bolts, [0, 0, 1] for instance")
    z = normal / np.linalg.norm(normal)
    given = part.get("x_axis")
    x = np.array(given or np.eye(3)[0 if abs(z[0]) < 0.9 else 1], dtype=float)
    length = np.linalg.norm(x)
    x = x - (x @ z) * z
    if np.linalg.norm(x) <= 1e-6 * length:
        raise SizingError(f"{part.where}: {part.name}: x_axis is zero or along the normal; give a direction across the bolts")
    x /= np.linalg.norm(x)
    return np.array([x, np.cross(z, x), z])


def _points(sheet: Sheet) -> Array:
    part = sheet.part
    if part.get("points") is not None:
        return np.array(part.get("points"), dtype=float)
    return bolts.circle(part.get("bolts"), part.get("circle_diameter") / 2, math.radians(part.get("first_angle_deg")))


def _load_factor(sheet: Sheet) -> tuple[float | None, dict[str, str]]:
    """Φ, as it is given or from resiliences, and what it comes from."""
    if sheet.part.get("load_factor") is not None:
        phi = sheet.number("load_factor")
        return phi, {"Φ": f"{phi:g}"}
    if not sheet.has("bolt force, clamp force, slip", "bolt_resilience", "plate_resilience", "load_introduction"):
        return None, {}
    keys = ("bolt_resilience", "plate_resilience", "load_introduction")
    phi = bolts.load_factor(*(sheet.number(key) for key in keys))
    from_name = ("clamp_length", "shank_length", "plates", "thread_in") if _is_derived(sheet, *keys[:2]) else ()
    return phi, {"Φ": f"{significant(phi)}", **sheet.given(*keys, *from_name)}


def _is_derived(sheet: Sheet, *keys: str) -> bool:
    """Whether one of these numbers follows from the bolt's name."""
    return any(key in sheet.part.derived and key not in sheet.part.values for key in keys)


def _of_name(sheet: Sheet, formula: Formula) -> tuple[Formula, dict[str, str]]:
    """The formula with those by which numbers follow from the bolt's name, and the name among the inputs."""
    used = [f for keys, f in ((("preload",), PRELOAD), (("bolt_resilience", "plate_resilience"), RESILIENCE)) if _is_derived(sheet, *keys)]
    if not used:
        return formula, {}
    inputs = sheet.given("tightening", "thread_friction", "yield_share") if used[0] is PRELOAD else {}
    whole = Formula("; ".join(f.text for f in (formula, *used)), "; ".join(f.source for f in (formula, *used)))
    return whole, {"thread and class": sheet.part.get("bolt"), **inputs}


def _bolt_force(sheet: Sheet, phi: float, said: dict[str, str], axial: Array, points: Array) -> None:
    k, bolt = _worst(axial)
    if sheet.has("bolt force", "preload", "tightening_factor"):
        force = sheet.number("tightening_factor") * sheet.number("preload") + phi * float(axial[k, bolt])
        inputs = {**sheet.given("tightening_factor", "preload"), **said, "F_A": f"{significant(float(axial[k, bolt]))} N", "bolt": _bolt(points, bolt)}
        formula, name = _of_name(sheet, bolts.BOLT_FORCE)
        inputs |= name
        sheet.add("bolt force", formula, force, "N", inputs, "yield_force", at=k)
    formula, name = bolts.AMPLITUDE, {}
    if _is_derived(sheet, "amplitude_limit"):
        formula = Formula(f"{formula.text}; {AMPLITUDE_LIMIT.text}", f"{formula.source}; {AMPLITUDE_LIMIT.source}")
        name = {"thread and class": sheet.part.get("bolt")}
    amplitude = phi * np.ptp(axial, axis=0) / 2
    bolt = int(np.argmax(amplitude))
    inputs = {**said, "F_A": f"{significant(float(axial[:, bolt].min()))} to {significant(float(axial[:, bolt].max()))} N", "bolt": _bolt(points, bolt), **name}
    sheet.add("force amplitude of a bolt", formula, float(amplitude[bolt]), "N", inputs, "amplitude_limit", at=int(np.argmax(axial[:, bolt])))


def _clamp(sheet: Sheet, phi: float, said: dict[str, str], axial: Array, shear: Array, points: Array) -> None:
    preload, embedding, wanted = sheet.number("preload"), sheet.number("embedding_loss"), sheet.number("required_clamp")
    clamping, name = _of_name(sheet, bolts.CLAMP)
    given = {**sheet.given("preload", "embedding_loss"), **said, **name}
    k, bolt = _worst(axial)
    left = float(bolts.residual_clamp(preload, embedding, phi, axial[k, bolt]))
    share = float(bolts.required_preload(wanted, phi, axial[k, bolt], embedding)) / preload
    inputs = {**given, "F_A": f"{significant(float(axial[k, bolt]))} N", **sheet.given("required_clamp"), "bolt": _bolt(points, bolt)}
    formula = Formula(f"{clamping.text}; use: (F_Kerf + (1 − Φ) F_A + F_Z)/F_M", clamping.source)
    sheet.add(
        "residual clamp force",
        formula,
        left,
        "N",
        inputs,
        wanted,
        at=k,
        smallest=True,
        share=share,
        note="the joint opens at this bolt: the linear distribution no longer holds" if left < 0 else "",
    )
    if not sheet.has("slip and required preload", "friction", "interfaces"):
        return
    needed = bolts.clamp_against_slip(shear, sheet.number("friction"), sheet.number("interfaces"))
    clamp = bolts.residual_clamp(preload, embedding, phi, axial)
    ratio = np.where(clamp > 0, needed / np.where(clamp > 0, clamp, 1.0), np.inf)
    k, bolt = _worst(ratio)
    friction = sheet.given("friction", "interfaces")
    inputs = {"F_KR": f"{significant(float(clamp[k, bolt]))} N", "F_Q": f"{significant(float(shear[k, bolt]))} N", **friction, "bolt": _bolt(points, bolt)}
    sheet.add("slip", bolts.SLIP, float(ratio[k, bolt]), "", inputs, 1.0, at=k)
    smallest = bolts.required_preload(np.maximum(needed, wanted), phi, axial, embedding)
    k, bolt = _worst(smallest)
    inputs = {
        "F_A": f"{significant(float(axial[k, bolt]))} N",
        "F_Q": f"{significant(float(shear[k, bolt]))} N",
        **said,
        **friction,
        "bolt": _bolt(points, bolt),
    }
    sheet.add("required preload", bolts.PRELOAD, float(smallest[k, bolt]), "N", inputs, "preload", at=k)


def _worst(x: Array) -> tuple[int, int]:
    """Sample and bolt of the largest value."""
    k, bolt = np.unravel_index(int(np.argmax(x)), x.shape)
    return int(k), int(bolt)


def _bolt(points: Array, bolt: int) -> str:
    return f"{bolt + 1} at ({', '.join(significant(float(c)) for c in points[bolt])}) m"
