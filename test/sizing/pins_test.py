"""Pins, plain bushes and hydraulic cylinders against calculations by hand, and components that are fixed to the parent."""

import math

import numpy as np
import pyarrow as pa
import pytest
from results_tables import AXIS, made_table

import ksl
from ksl.base.errors import SizingError
from ksl.sizing.buckling import critical_force

K = np.array(AXIS)
ACROSS, THIRD = np.array([0.0, 1.0, 0.0]), np.cross(K, [0.0, 1.0, 0.0])
TIME = np.linspace(0.0, 2.0, 5)


def columns(force=(0, 0, 0), moment=(0, 0, 0), **others):
    named = dict(zip(("fx", "fy", "fz", "tx", "ty", "tz"), (*np.asarray(force, float), *np.asarray(moment, float)), strict=True))
    return {"time": TIME, **named, **others}


def sized(cases, part, kind="revolute", **top):
    return ksl.size(made_table(cases, kind), {"component": [{"joint": "j", **part}], **top})


def values(sizing):
    return {f.figure: f for f in sizing.figures}


PIN = {
    "kind": "pin",
    "diameter": 0.06,
    "eye_width": 0.08,
    "cheek_width": 0.04,
    "gap": 0.002,
    "bending_stress": 150e6,
    "shear_stress": 80e6,
    "eye_pressure": 25e6,
    "cheek_pressure": 25e6,
}


def test_a_pin_between_two_cheeks():
    """100 kN across a pin of 60 mm in an eye of 80 mm: M = F (t + 2 b + 4 g)/8 = 2,100 N m, W = π d³/32 = 21,206 mm³."""
    found = values(sized({"lift": columns(1e5 * ACROSS + 7e3 * K)}, PIN))
    assert found["bending stress"].value == pytest.approx(2100 / 2.120575e-5, rel=1e-6)
    assert found["shear stress"].value == pytest.approx(4 / 3 * 5e4 / (math.pi * 0.06**2 / 4), rel=1e-12)
    assert found["pressure in the eye"].value == pytest.approx(1e5 / (0.06 * 0.08)) and found["pressure in the cheeks"].value == pytest.approx(
        5e4 / (0.06 * 0.04)
    )
    assert {f.figure: round(f.utilisation, 4) for f in found.values()} == {
        "bending stress": round(99.03e6 / 150e6, 4), "shear stress": 0.2947, "pressure in the eye": 0.8333, "pressure in the cheeks": 0.8333,
    }  # fmt: skip


def test_a_hollow_pin_is_a_thin_ring_at_the_end():
    """The largest shear stress of a thin ring is twice the mean."""
    thin = values(sized({"lift": columns(1e5 * ACROSS)}, PIN | {"inner_diameter": 0.0599}))
    area = math.pi * (0.06**2 - 0.0599**2) / 4
    assert thin["shear stress"].value == pytest.approx(2 * 5e4 / area, rel=1e-3)
    assert "not less than the diameter" in str(sized({"lift": columns(1e5 * ACROSS)}, PIN | {"inner_diameter": 0.06}).left_out[0])


@pytest.mark.parametrize(
    ("moment", "share"), [(400 * ACROSS, math.hypot(5e3, 400 / 0.124)), (400 * THIRD, 5e3 + 400 / 0.124), (-400 * THIRD, 5e3 + 400 / 0.124)]
)
def test_a_moment_loads_one_cheek_more(moment, share):
    """L = 80 + 2 · 2 + 40 mm; a moment about the force adds a couple across it, one across it a couple along it."""
    case = {"lift": columns(1e4 * ACROSS, moment)}
    assert values(sized(case, PIN))["pressure in the cheeks"].value == pytest.approx(share / (0.06 * 0.04), rel=1e-9)
    free = values(sized(case, PIN | {"moment": "none"}))
    assert free["pressure in the cheeks"].value == pytest.approx(5e3 / (0.06 * 0.04)) and free["pressure in the eye"].value == pytest.approx(
        1e4 / (0.06 * 0.08)
    )


def test_the_middle_of_a_pin_may_be_off_the_origin():
    """A force at the origin, 0.1 m beside the pin's middle, is a moment there."""
    found = values(sized({"lift": columns(1e4 * ACROSS)}, PIN | {"position": 0.1}))
    assert found["pressure in the eye"].value == pytest.approx(1e4 / (0.06 * 0.08) + 6 * 1e3 / (0.06 * 0.08**2))


BUSH = {"kind": "plain bush", "diameter": 0.08, "width": 0.05, "moment": "none", "max_pressure": 40e6, "max_speed": 0.2, "max_pv": 2e6, "max_pv_short": 4e6}


def test_a_plain_bush():
    """20 kN on 80 mm × 50 mm are 5 MPa; 2 rad/s slide at 0.08 m/s.  Half of the time it stands: its trapezoids weigh a quarter each of five samples."""
    speed = np.array([2.0, 2.0, 0.0, 0.0, 0.0])
    part = BUSH | {"wear_coefficient": 1e-15, "max_wear": 1e-4, "required_life_h": 50.0}
    found = values(sized({"dig": columns(2e4 * THIRD, speed=speed)}, part))
    assert (
        found["specific pressure"].value == pytest.approx(5e6)
        and found["sliding speed"].value == pytest.approx(0.08)
        and found["largest p·v"].value == pytest.approx(4e5)
    )
    mean = 4e5 * 0.75 / 2.0
    assert found["mean p·v"].value == pytest.approx(mean)
    assert found["life by wear"].value == pytest.approx(1e-4 / (1e-15 * mean * 3600)) and found["life by wear"].utilisation == pytest.approx(
        50 * 1e-15 * mean * 3600 / 1e-4
    )


def test_two_bushes_share_a_tilting_moment():
    """6 kN m across 0.3 m add 20 kN to the half of 20 kN on one bush: 30 kN."""
    part = BUSH | {"moment": "carried", "spacing": 0.3}
    assert values(sized({"dig": columns(2e4 * ACROSS, 6e3 * THIRD)}, part))["specific pressure"].value == pytest.approx(3e4 / (0.08 * 0.05))
    one = values(sized({"dig": columns(2e4 * ACROSS, 10 * THIRD)}, BUSH | {"moment": "carried"}))
    assert one["specific pressure"].value == pytest.approx(2e4 / 0.004 + 6 * 10 / (0.08 * 0.05**2))


def test_bushes_that_never_turn_or_last_no_time():
    still = sized({"hold": columns(2e4 * ACROSS)}, BUSH | {"wear_coefficient": 1e-15, "max_wear": 1e-4})
    assert any("does not turn under load" in str(x) for x in still.left_out)
    pose = {name: np.atleast_1d(x)[:1] for name, x in columns(2e4 * ACROSS).items()}
    assert any("no case lasts any time" in str(x) for x in sized({"pose": pose}, BUSH).left_out)


CYLINDER = {
    "kind": "hydraulic cylinder", "bore": 0.1, "rod_diameter": 0.056, "max_pressure": 25e6, "stroke": 0.8, "retracted_length": 1.2, "max_flow": 2e-3, "max_speed": 0.5,
}  # fmt: skip
BORE, RING = math.pi * 0.1**2 / 4, math.pi * (0.1**2 - 0.056**2) / 4


@pytest.mark.parametrize("extends", ["positive", "negative"])
def test_a_hydraulic_cylinder(extends):
    """It pushes with 100 kN at 0.8 m and pulls with 40 kN; λ = 4 · 2.0/0.056 = 143 is in Euler's range: π² E I/L² = 250,139 N."""
    sign = 1 if extends == "positive" else -1
    position, effort, speed = sign * np.array([0, 0.2, 0.8, 0.5, 0.1]), sign * np.array([0, 5e4, 1e5, -4e4, 0]), sign * np.array([0, 0.2, 0, -0.3, 0])
    found = values(sized({"dig": columns(position=position, effort=effort, speed=speed)}, CYLINDER | {"extends": extends}, "prismatic"))
    assert found["pressure on the bore side"].value == pytest.approx(1e5 / BORE) and found["pressure on the rod side"].value == pytest.approx(4e4 / RING)
    assert found["pressure on the bore side"].time == TIME[2] and found["pressure on the rod side"].time == TIME[3]
    assert found["safety against buckling"].value == pytest.approx(2.50139, rel=1e-5) and found["safety against buckling"].verdict == "over"
    assert found["stroke"].value == pytest.approx(0.8) and found["stroke"].utilisation == pytest.approx(1.0) and found["speed"].value == pytest.approx(0.3)
    assert found["flow on the bore side"].value == pytest.approx(0.3 * BORE) and found["flow on the rod side"].value == pytest.approx(0.3 * RING)


def test_friction_and_back_pressure_of_a_cylinder():
    case = {"dig": columns(position=0.1, effort=np.array([1e5, 0, -1e4, 0, 0]))}
    found = values(sized(case, CYLINDER | {"efficiency": 0.9, "back_pressure": 1e6}, "prismatic"))
    assert found["pressure on the bore side"].value == pytest.approx((1e5 / 0.9 + 1e6 * RING) / BORE)
    assert found["pressure on the rod side"].value == pytest.approx((1e4 / 0.9 + 1e6 * BORE) / RING)
    assert "pressure on the rod side" not in values(sized({"dig": columns(position=0.1, effort=1e5)}, CYLINDER, "prismatic"))


def test_what_a_cylinder_can_not_be():
    case = {"dig": columns(position=-0.1, effort=1e5)}
    said = [str(x) for x in sized(case, CYLINDER, "prismatic").left_out]
    assert any("farther in than all in" in x for x in said)
    assert any("rod_diameter 0.1 m is not less than the bore" in str(x) for x in sized(case, CYLINDER | {"rod_diameter": 0.1}, "prismatic").left_out)
    assert any("length from pin to pin would be" in str(x) for x in sized(case, CYLINDER | {"retracted_length": 0.05}, "prismatic").left_out)
    with pytest.raises(SizingError, match="sits on a joint that slides along one axis, and j is revolute"):
        sized(case, CYLINDER)
    with pytest.raises(SizingError, match="sits on a joint that turns about one axis, and j is prismatic"):
        sized(case, BUSH, "prismatic")


def test_the_lines_of_tetmajer_meet_those_of_euler():
    """At λ = 60, E335: 335 − 0.62 · 60 = 297.8 MPa; at the limit slenderness the two agree within the textbooks' rounding."""
    d = 0.05
    assert critical_force(60 * d / 4, d) == pytest.approx(297.8e6 * math.pi * d**2 / 4)
    assert critical_force(60 * d / 4, d, "S235") == pytest.approx((310 - 1.14 * 60) * 1e6 * math.pi * d**2 / 4)
    assert critical_force(200 * d / 4, d, factor=0.5) == pytest.approx(critical_force(100 * d / 4, d))
    for steel, limit in (("E335", 88.0), ("S235", 104.0)):
        below, above = critical_force(np.array([limit - 1e-9, limit]) * d / 4, d, steel)
        assert below == pytest.approx(above, rel=0.05)


# fixed to the parent

FLANGE = {"kind": "bolted flange", "bolts": 4, "circle_diameter": 0.2, "normal": list(ACROSS), "x_axis": list(K)}


def test_a_flange_of_the_parent_does_not_turn_with_the_child():
    """A force that stays with the parent, in the axes of a child that turns: on the parent it is constant, 1,000 N along the bolts."""
    q = np.linspace(0, 3, 5)
    turned = {
        "lift": columns(position=q)
        | dict(zip(("fx", "fy", "fz"), (np.cos(q)[:, None] * 1e3 * ACROSS - np.sin(q)[:, None] * 1e3 * np.cross(K, ACROSS)).T, strict=True))
    }
    child, parent = (sized(turned, FLANGE | on) for on in ({}, {"on": "parent"}))
    axial = values(parent)["axial load of a bolt"]
    assert abs(axial.value) == pytest.approx(250) and axial.note == "" and values(parent)["shear load of a bolt"].value == pytest.approx(0, abs=1e-9)
    assert 'it turns with b; write on = "parent" for one that stays with a' in values(child)["axial load of a bolt"].note
    assert values(child)["shear load of a bolt"].value > 200


def test_a_point_of_the_parent_stays_while_the_child_slides():
    """1,000 N across the slide at 0.5 m: about a point of the parent at its origin they are 500 N m, and about that of the child nothing."""
    case = {"slide": columns(1e3 * ACROSS, position=np.linspace(0, 0.5, 5))}
    limits = {"kind": "limits", "bending_moment": 400.0}
    child, parent = (values(sized(case, limits | on, "prismatic"))["bending moment"] for on in ({}, {"on": "parent"}))
    assert (child.value, parent.value) == (0, pytest.approx(500)) and parent.verdict == "over" and "it slides with b" in child.note


def test_sides_of_joints_of_several_coordinates():
    said = sized({"x": columns(1e3 * ACROSS)}, {"kind": "limits", "axial_force": 1.0, "on": "parent"}, "spherical").left_out
    assert 'on = "parent" needs a joint that turns or slides along one axis, or is fixed; j is spherical' in str(said[0])
    assert values(sized({"x": columns([0, 0, 7.0])}, {"kind": "limits", "axial_force": 9.0, "on": "parent"}, "fixed"))["axial force"].value == 7


@pytest.mark.parametrize(("open_ones", "judged"), [("fx", True), ("fx fy", False)])
def test_the_determined_part_of_a_force_is_judged(open_ones, judged):
    """Of 3 N along x, which rigid bodies leave open, and 4 N along y."""
    table = made_table({"x": columns([3.0, 4.0, 0.0])}).append_column("undetermined", pa.array([open_ones] * 5))
    said = table.schema.metadata[b"ksl"].decode().replace("0.6, 0.0, 0.8", "0.0, 0.0, 1.0")
    sizing = ksl.size(table.replace_schema_metadata({"ksl": said}), {"component": [{"joint": "j", "kind": "limits", "radial_force": 3.5}]})
    found = values(sizing)
    assert found["radial force"].value == pytest.approx(5) and found["radial force"].verdict == "" and len(sizing.left_out) == 1
    assert [f.verdict for name, f in found.items() if "determined part" in name] == (["over"] if judged else [])
