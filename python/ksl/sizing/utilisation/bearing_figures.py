"""Figures of crossed roller bearings, of two bearings on an axis, and of two opposed single rows."""

from __future__ import annotations

import numpy as np

from ksl.mechanism.states import Array
from ksl.sizing import bearing_pair, bearings
from ksl.sizing.figures import Formula, significant
from ksl.sizing.life import BALL, ROLLER
from ksl.sizing.utilisation.sheet import Sheet


def crossed_roller_figures(sheet: Sheet) -> None:
    """Adds the figures of a crossed roller bearing, with the moment about its pitch plane."""
    if not sheet.has("everything", "pitch_diameter"):
        return
    dp, s = sheet.number("pitch_diameter"), sheet.samples.about(sheet.number("position") * sheet.samples.axis)
    Fr, Fa, M = s.radial_force, np.abs(s.axial_force), s.bending_moment
    P = bearings.crossed_roller_load(Fr, Fa, M, dp).P
    if sheet.has("life", "C", "load_factor"):
        sheet.life(
            "",
            sheet.number("C"),
            P,
            ROLLER,
            bearings.CROSSED_ROLLER,
            sheet.given("position", "pitch_diameter"),
            sheet.number("load_factor"),
            bearings.CROSSED_ROLLER_LIFE,
        )
    P0 = bearings.crossed_roller_static(Fr, Fa, M, dp)
    _static(sheet, "", "", P0, bearings.CROSSED_ROLLER_STATIC, {"Fr": Fr, "Fa": Fa}, {"M": M})


def pair_figures(sheet: Sheet) -> None:
    """Adds the figures of a locating and a floating bearing; the locating one carries the axial force."""
    s, part = sheet.samples, sheet.part
    a, b = part.get("locating.position"), part.get("floating.position")
    R = bearing_pair.radial_reactions(s.force, s.moment, s.axis, a, b)
    for which, radial, axial in (("locating", R.a, np.abs(s.axial_force)), ("floating", R.b, np.zeros(len(s.time)))):
        _one_of_pair(sheet, which, np.linalg.norm(radial, axis=1), axial)


def _one_of_pair(sheet: Sheet, which: str, Fr: Array, Fa: Array) -> None:
    deep = sheet.part.get(f"{which}.type") == "deep groove"
    angle = int(sheet.part.get(f"{which}.contact_angle_deg"))
    place = sheet.given("locating.position") | {"position of the other": sheet.given("floating.position")["position"]}
    if which == "floating":
        place = {"position": place["position of the other"], "position of the other": place["position"]}
    if deep:
        formula, static = bearings.DEEP_GROOVE, bearings.DEEP_GROOVE_STATIC
        P0 = bearings.deep_groove_static(Fr, Fa)
        place |= sheet.given(f"{which}.f0")
    else:
        formula, static = bearings.ANGULAR_PAIR, bearings.ANGULAR_PAIR_STATIC
        P0 = bearings.angular_contact_static(Fr, Fa, angle, "pair")
        place |= sheet.given(f"{which}.contact_angle_deg")
    needed = ("C", "C0", "f0") if deep and which == "locating" else ("C",)
    if sheet.has(f"{which}: life", *(f"{which}.{key}" for key in needed)):
        if not deep:
            P = bearings.angular_contact_load(Fr, Fa, angle, "pair").P
        elif which == "locating":
            P = bearings.deep_groove_load(Fr, Fa, sheet.number(f"{which}.C0"), sheet.number(f"{which}.f0")).P
        else:  # no axial force: P = Fr whatever C0 and f0 are
            P = Fr
        split = Formula(f"{bearing_pair.REACTIONS.text}; {formula.text}", f"{bearing_pair.REACTIONS.source}; {formula.source}")
        sheet.life(f"{which}: ", sheet.number(f"{which}.C"), P, BALL, split, place)
    _static(sheet, f"{which}: ", f"{which}.", P0, static, {"Fr": Fr, "Fa": Fa})


def opposed_figures(sheet: Sheet) -> None:
    """Adds the figures of two opposed single rows, each with the axial force that the other one's radial load induces."""
    s, part = sheet.samples, sheet.part
    a, b = part.get("a.position"), part.get("b.position")
    angle = int(part.get("contact_angle_deg"))
    R = bearing_pair.radial_reactions(s.force, s.moment, s.axis, a, b)
    Fr = {"a": np.linalg.norm(R.a, axis=1), "b": np.linalg.norm(R.b, axis=1)}
    # The joint's wrench is what the parent exerts on the child; the shaft presses against the bearings with its opposite.
    push = -s.axial_force if part.get("shaft") == "child" else s.axial_force
    towards_a = push if bearing_pair.loaded_by_positive(a, b, part.get("arrangement")) == "a" else -push
    Fa = dict(zip("ab", bearing_pair.opposed_axial_loads(Fr["a"], Fr["b"], towards_a, bearings.ANGULAR_CONTACT[angle].e), strict=True))
    text = f"{bearing_pair.REACTIONS.text}; {bearing_pair.OPPOSED.text}; {bearings.ANGULAR_SINGLE.text}"
    source = f"{bearing_pair.REACTIONS.source}; {bearing_pair.OPPOSED.source}; {bearings.ANGULAR_SINGLE.source}"
    for which in "ab":
        place = {**sheet.given(f"{which}.position", "arrangement", "contact_angle_deg"), "e": f"{bearings.ANGULAR_CONTACT[angle].e:g}"}
        if sheet.has(f"{which}: life", f"{which}.C"):
            P = bearings.angular_contact_load(Fr[which], Fa[which], angle, "single").P
            sheet.life(f"{which}: ", sheet.number(f"{which}.C"), P, BALL, Formula(text, source), place)
        P0 = bearings.angular_contact_static(Fr[which], Fa[which], angle, "single")
        _static(sheet, f"{which}: ", f"{which}.", P0, bearings.ANGULAR_SINGLE_STATIC, {"Fr": Fr[which], "Fa": Fa[which]})


def _static(sheet: Sheet, of: str, prefix: str, P0: Array, formula: Formula, forces: dict[str, Array], moments: dict[str, Array] | None = None) -> None:
    """Static safety at the worst sample of all cases, against what is asked for."""
    if not sheet.has(f"{of}static safety", f"{prefix}C0", f"{prefix}required_static_safety"):
        return
    k = int(np.argmax(P0))
    named = {name: f"{significant(float(x[k]))} N" for name, x in forces.items()}
    named |= {name: f"{significant(float(x[k]))} N m" for name, x in (moments or {}).items()}
    C0, required = sheet.number(f"{prefix}C0"), sheet.number(f"{prefix}required_static_safety")
    inputs = {**sheet.given(f"{prefix}C0"), "P0": f"{significant(float(P0[k]))} N", **named, "required": f"{required:g}"}
    sheet.add(f"{of}static safety", formula, float(bearings.static_safety(C0, P0[k])), "", inputs, required, at=k, smallest=True)
