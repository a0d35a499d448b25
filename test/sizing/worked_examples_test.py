"""Every worked example of test/reference/sizing by name: bearings, gears, motors, bolts, fatigue."""

import json
from pathlib import Path

import numpy as np
import pytest
from ksl.sizing import bearing_pair, bearings, bolts, fatigue, gears, life, motor

EXAMPLES = Path(__file__).resolve().parents[1] / "reference" / "sizing"


def example(name: str) -> dict:
    return json.loads((EXAMPLES / f"{name}.json").read_text())


def cases(name: str) -> list:
    """Cases of an example, each with its number and what distinguishes it as the name of the test."""
    return [pytest.param(c, id=f"{i}-{c.get('kind', '')}") for i, c in enumerate(example(name)["cases"])]


def near(x, y, tolerance=1e-12):
    np.testing.assert_allclose(x, y, rtol=tolerance, atol=tolerance)


# bearings


def test_bearing_tables_are_those_of_the_reference():
    deep, angular = example("bearing_deep_groove"), example("bearing_angular_contact")["table"]
    table = deep["table"]
    assert list(bearings.DEEP_GROOVE_AXIAL) == table["f0_Fa_over_C0"]
    assert list(bearings.DEEP_GROOVE_E) == table["e"] and list(bearings.DEEP_GROOVE_Y) == table["Y"]
    assert {str(k): v._asdict() for k, v in bearings.ANGULAR_CONTACT.items()} == angular
    assert {f"{k:g}": v for k, v in life.RELIABILITY[2007].items()} == deep["reliability"]["a1"]


@pytest.mark.parametrize("e, X, Y", [(f.e, f.X_single, f.Y_single) for f in bearings.ANGULAR_CONTACT.values()])
def test_equivalent_load_is_continuous_at_e(e, X, Y):
    assert abs(e - (1 - X) / Y) < 0.006


@pytest.mark.parametrize("case", cases("bearing_deep_groove"))
def test_bearing_deep_groove(case):
    i, o = case["inputs"], case["outputs"]
    e, _ = bearings.deep_groove_factors(i["Fa"], i["C0"], i["f0"])
    load = bearings.deep_groove_load(i["Fr"], i["Fa"], i["C0"], i["f0"])
    revolutions = life.rating_life(i["C"], load.P)
    P0 = bearings.deep_groove_static(i["Fr"], i["Fa"])
    near([e, load.X, load.Y, load.P], [o["e"], o["X"], o["Y"], o["P"]])
    near([revolutions, life.hours(revolutions, i["n_rpm"])], [o["L10_million_rev"], o["L10h"]])
    near([P0, bearings.static_safety(i["C0"], P0)], [o["P0"], o["s0"]])
    printed = case.get("published", {})
    if "L10_million_rev" in printed:  # the catalogue's example: 169 million, 940 h
        assert round(float(revolutions)) == printed["L10_million_rev"]
    if "L10h" in printed:
        assert float(f"{float(life.hours(revolutions, i['n_rpm'])):.3g}") == printed["L10h"]


@pytest.mark.parametrize("case", cases("bearing_angular_contact"))
def test_bearing_angular_contact(case):
    i, o = case["inputs"], case["outputs"]
    arrangement = "single" if i["arrangement"] == "single" else "pair"
    load = bearings.angular_contact_load(i["Fr"], i["Fa"], i["contact_angle_deg"], arrangement)
    P0 = bearings.angular_contact_static(i["Fr"], i["Fa"], i["contact_angle_deg"], arrangement)
    revolutions = life.rating_life(i["C"], load.P)
    near([load.X, load.Y, load.P, P0], [o["X"], o["Y"], o["P"], o["P0"]])
    near([revolutions, life.hours(revolutions, i["n_rpm"]), bearings.static_safety(i["C0"], P0)], [o["L10_million_rev"], o["L10h"], o["s0"]])


@pytest.mark.parametrize("case", cases("bearing_crossed_roller"))
def test_bearing_crossed_roller(case):
    i, o = case["inputs"], case["outputs"]
    load = bearings.crossed_roller_load(i["Fr"], i["Fa"], i["M"], i["dp"])
    P0 = bearings.crossed_roller_static(i["Fr"], i["Fa"], i["M"], i["dp"])
    revolutions = life.rating_life(i["C"] / i["fw"], load.P, life.ROLLER)
    near([load.X, load.Y, load.P, P0], [o["X"], o["Y"], o["P"], o["P0"]])
    near([revolutions, life.hours(revolutions, i["n_rpm"]), bearings.static_safety(i["C0"], P0)], [o["L10_million_rev"], o["L10h"], o["fs"]])


A1 = {  # ISO 281:2007, Table 12, and ISO 281:1990, Table 5
    2007: {90: 1.0, 95: 0.64, 96: 0.55, 97: 0.47, 98: 0.37, 99: 0.25},
    1990: {90: 1.0, 95: 0.62, 96: 0.53, 97: 0.44, 98: 0.33, 99: 0.21},
}
DEEP_GROOVE = {  # ISO 281:2007, Table 3: f0 Fa/C0 → e, Y; X is 0.56
    0.172: (0.19, 2.30), 0.345: (0.22, 1.99), 0.689: (0.26, 1.71), 1.03: (0.28, 1.55), 1.38: (0.30, 1.45),
    2.07: (0.34, 1.31), 3.45: (0.38, 1.15), 5.17: (0.42, 1.04), 6.89: (0.44, 1.00),
}  # fmt: skip
ANGULAR = {  # the same, and ISO 76:2006, Table 2: angle → e, X, Y; Y1, X2, Y2 of a pair; X0, Y0; X0, Y0 of a pair
    20: (0.57, 0.43, 1.00, 1.09, 0.70, 1.63, 0.5, 0.42, 1.0, 0.84), 25: (0.68, 0.41, 0.87, 0.92, 0.67, 1.41, 0.5, 0.38, 1.0, 0.76),
    30: (0.80, 0.39, 0.76, 0.78, 0.63, 1.24, 0.5, 0.33, 1.0, 0.66), 35: (0.95, 0.37, 0.66, 0.66, 0.60, 1.07, 0.5, 0.29, 1.0, 0.58),
    40: (1.14, 0.35, 0.57, 0.55, 0.57, 0.93, 0.5, 0.26, 1.0, 0.52), 45: (1.34, 0.33, 0.50, 0.47, 0.54, 0.81, 0.5, 0.22, 1.0, 0.44),
}  # fmt: skip


@pytest.mark.parametrize("edition", A1)
def test_every_reliability_factor(edition):
    """By the function that lives take them from, and nothing else."""
    assert {r: life.reliability_factor(r, edition) for r in A1[edition]} == A1[edition] == life.RELIABILITY[edition]


def test_every_row_of_deep_groove_bearings():
    """At each row's axial load the bearing has the row's e and Y: below e Fa does not count, beyond it P = 0.56 Fr + Y Fa."""
    C0, f0 = 10000.0, 13.0
    for relative, (e, Y) in DEEP_GROOVE.items():
        Fa = relative * C0 / f0
        near(bearings.deep_groove_factors(Fa, C0, f0), [e, Y])
        near(bearings.deep_groove_load(1.01 * Fa / e, Fa, C0, f0).P, 1.01 * Fa / e)
        near(bearings.deep_groove_load(0.99 * Fa / e, Fa, C0, f0).P, 0.56 * 0.99 * Fa / e + Y * Fa)
    near(bearings.deep_groove_factors([0.0, 1e6], C0, f0), [(0.19, 0.44), (2.30, 1.00)])  # held beyond both ends
    assert len(bearings.DEEP_GROOVE_AXIAL) == len(DEEP_GROOVE)


def test_every_row_of_angular_contact_bearings():
    for angle, (e, X, Y, Y1, X2, Y2, X0, Y0, X0_pair, Y0_pair) in ANGULAR.items():
        for Fr, Fa in ((1000.0, 999.0 * e), (1000.0, 1001.0 * e)):
            light = Fa < e * Fr
            near(bearings.angular_contact_load(Fr, Fa, angle, "single").P, Fr if light else X * Fr + Y * Fa)
            near(bearings.angular_contact_load(Fr, Fa, angle, "pair").P, Fr + Y1 * Fa if light else X2 * Fr + Y2 * Fa)
        near(bearings.angular_contact_static(1000.0, 4000.0, angle, "single"), X0 * 1000 + Y0 * 4000)
        near(bearings.angular_contact_static(1000.0, 100.0, angle, "single"), 1000.0)
        near(bearings.angular_contact_static(1000.0, 4000.0, angle, "pair"), X0_pair * 1000 + Y0_pair * 4000)
    assert bearings.ANGULAR_CONTACT.keys() == ANGULAR.keys()


def test_factors_that_stand_in_formulas():
    """ISO 76:2006, 5.2: 0.6 and 0.5.  Crossed rollers: 1.5; 1, 0.45; 0.67, 0.67; 0.44.  Exponents 3 and 10/3.  Wave generator: 10⁴ peaks."""
    near(bearings.deep_groove_static([1000.0, 1000.0], [4000.0, 100.0]), [0.6 * 1000 + 0.5 * 4000, 1000.0])
    near(bearings.crossed_roller_load(100.0, [299.0, 301.0], 10.0, 0.2).P, [200 + 0.45 * 299, 0.67 * 200 + 0.67 * 301])
    near(bearings.crossed_roller_static(100.0, 300.0, 10.0, 0.2), 200 + 0.44 * 300)
    assert (life.BALL, life.ROLLER) == (3, 10 / 3)
    near(life.rating_life(2000.0, 1000.0, life.ROLLER, 0.47), 0.47 * 2 ** (10 / 3))
    near(life.hours(6.0, 1000.0), 100.0)
    near(gears.momentary_events(1500.0, 2.0), 100.0)
    near(gears.wave_generator_life(50.0, 1000.0, 100.0, 2000.0), 7000 * 8 * 2)


def test_reliability_factors_name_the_edition():
    assert life.reliability_factor(95) == 0.64 and life.reliability_factor(95, 1990) == 0.62
    with pytest.raises(ValueError, match="no a1 for a reliability of 92 %; it has 90, 95"):
        life.reliability_factor(92)
    with pytest.raises(ValueError, match="ISO 281:2010 is unknown"):
        life.reliability_factor(95, 2010)


# mean load


def mean_load_case(kind: str) -> dict:
    return next(c["outputs"] | {"inputs": c.get("inputs", {})} for c in example("mean_load")["cases"] if c["kind"].startswith(kind))


def test_mean_load_of_steps():
    o = mean_load_case("steps")
    i = o["inputs"]
    near(life.mean_load(i["P"], i["n_rpm"], i["t"]), o["Pm_ball"])
    near(life.mean_load(i["P"], i["n_rpm"], i["t"], life.ROLLER), o["Pm_roller"])
    near(life.mean_speed(i["n_rpm"], i["t"]), o["mean_speed_rpm"])


def gauss(points: int, start: float, end: float, panels: int):
    """Nodes and weights of an integral: samples and how long each of them lasts."""
    x, w = np.polynomial.legendre.leggauss(points)
    edges = np.linspace(start, end, panels + 1)
    half = np.diff(edges)[:, None] / 2
    return (edges[:-1, None] + half * (1 + x)).ravel(), np.tile(w, panels) * np.repeat(half, points)


def test_mean_load_of_a_sine():
    o = mean_load_case("P = 1000")
    angle, weight = gauss(30, 0, np.pi, 20)
    near(life.mean_load(1000 * np.sin(angle), np.ones_like(angle), weight), o["Pm_ball"], 1e-9)
    near(life.mean_load(1000 * np.sin(angle), np.ones_like(angle), weight, life.ROLLER), o["Pm_roller"], 1e-9)


def test_mean_load_of_a_ramp():
    o = mean_load_case("linear")
    x, weight = gauss(30, 0, 1, 1)
    near(life.mean_load(2000 + 4000 * x, np.ones_like(x), weight), o["Pm_ball"], 1e-9)
    near(life.mean_load(2000 + 4000 * x, np.ones_like(x), weight, life.ROLLER), o["Pm_roller"], 1e-9)


def test_mean_load_of_an_oscillation():
    o = mean_load_case("oscillation")
    t, weight = gauss(30, 0, np.pi, 4)
    speed = np.cos(2 * t)
    near(life.mean_load(3000 + 1000 * np.sin(2 * t), speed, weight), o["Pm_ball"], 1e-9)
    near(life.mean_speed(speed, weight), o["mean_abs_speed_rad_s"], 1e-9)
    near(life.mean_speed(speed, weight) * np.pi / (2 * np.pi), o["revolutions_per_cycle"], 1e-9)


def test_mean_load_of_standstill():
    assert np.isnan(life.mean_load([1, 2], [0, 0], [1, 1])) and life.mean_load([0, 0], [1, 1], [1, 1]) == 0


# gears and motors


def test_strain_wave_gear():
    e = example("strain_wave_gear")
    i, o, printed = e["inputs"], e["outputs"], e["published"]
    torque = life.mean_load(i["torque_Nm"], i["n_out_rpm"], i["t_s"])
    output = life.mean_speed(i["n_out_rpm"], i["t_s"])
    L10 = gears.wave_generator_life(torque, i["ratio"] * output, i["rated_torque"], i["rated_input_rpm"], i["L10_rated"])
    events = gears.momentary_events(i["ratio"] * i["emergency"]["n_out_rpm"], i["emergency"]["t"])
    near([torque, output, i["ratio"] * output], [o["T_average"], o["n_out_average_rpm"], o["n_in_average_rpm"]])
    near([L10, events, i["ratio"] * max(i["n_out_rpm"])], [o["L10h"], o["allowed_momentary_events"], o["n_in_max_rpm"]])
    assert (int(torque), round(output), int(events)) == (printed["T_average"], printed["n_out_average_rpm"], printed["allowed_momentary_events"])
    rounded = gears.wave_generator_life(319, 1440, i["rated_torque"], i["rated_input_rpm"], i["L10_rated"])  # as the catalogue goes on
    near(rounded, e["rounded_chain"]["L10h"])
    assert int(rounded / 10) * 10 == printed["L10h"]


def test_motor_rms_of_a_trapezoid_with_hold():
    case = example("motor_rms")["cases"][0]
    i, o = case["inputs"], case["outputs"]
    a = {"accelerate": i["w"] / i["t_accelerate"], "cruise": 0.0, "decelerate": -i["w"] / i["t_decelerate"], "hold": 0.0}
    load = np.array([i["J_load"] * a[p] + i["gravity_torque"] + (0 if p == "hold" else i["friction_torque"]) for p in a])
    near(load, list(o["load_torque"].values()))
    moving = np.array([1.0, 1.0, 1.0, 0.0])
    duration = np.array([i["t_accelerate"], i["t_cruise"], i["t_decelerate"], i["t_hold"]])
    torque = motor.rotor_torque(load, i["w"] * moving, list(a.values()), i["J_motor"], i["ratio"], i["efficiency"])
    near(torque, list(o["motor_torque"].values()))
    near(motor.root_mean_square(torque, duration), o["motor_torque_rms"])
    near(np.abs(torque).max(), o["motor_torque_peak"])
    mean = i["w"] * np.array([0.5, 1.0, 0.5, 0.0])  # of a ramp
    near(torque * i["ratio"] * mean * duration, list(o["motor_energy"].values()))
    near(max(torque * i["ratio"] * i["w"] * moving), o["motor_peak_power"])
    near(life.mean_speed(i["ratio"] * mean, duration), o["mean_abs_motor_speed"])
    near(i["J_motor"] * i["ratio"] ** 2, o["reflected_motor_inertia"])


def test_motor_that_lowers_a_load():
    case = example("motor_rms")["cases"][1]
    i, o = case["inputs"], case["outputs"]
    torque = float(motor.rotor_torque(i["gravity_torque"], i["w"], 0.0, 1e-4, i["ratio"], i["efficiency"]))
    power = torque * i["ratio"] * i["w"]
    near([torque, power, i["gravity_torque"] * i["w"]], [o["motor_torque"], o["motor_power"], o["load_power"]])
    near(power - i["gravity_torque"] * i["w"], o["loss"])


# bolts


def test_bolt_circle():
    e = example("bolt_circle")
    i, o = e["inputs"], e["outputs"]
    loads = bolts.pattern_loads(bolts.circle(i["n"], i["radius"], i["first_angle"]), i["force"], i["moment"])
    near(loads.axial, [b["axial"] for b in o["bolts"]])
    near(loads.shear, [(b["shear_x"], b["shear_y"]) for b in o["bolts"]])
    shear = np.linalg.norm(loads.shear, axis=1)
    near(shear, [b["shear"] for b in o["bolts"]])
    near([loads.axial.max(), loads.axial.min(), shear.max()], [o["axial_max"], o["axial_min"], o["shear_max"]])


def test_bolt_pattern():
    e = example("bolt_pattern")
    i, o = e["inputs"], e["outputs"]
    loads = bolts.pattern_loads(i["points"], i["force"], i["moment"])
    near(loads.axial, o["axial"])
    near(loads.shear, o["shear"])
    p = np.array(i["points"])  # the shares sum to the wrench
    near([loads.axial.sum(), p[:, 1] @ loads.axial, -p[:, 0] @ loads.axial], [i["force"][2], *i["moment"][:2]])
    near([*loads.shear.sum(axis=0), p[:, 0] @ loads.shear[:, 1] - p[:, 1] @ loads.shear[:, 0]], [*i["force"][:2], i["moment"][2]])


def test_bolts_on_a_line_and_two_bolts_are_refused():
    with pytest.raises(ValueError, match="lie on one line"):
        bolts.pattern_loads([[0, 0], [1, 1], [2, 2]], [0, 0, 1], [0, 0, 0])
    for size in (1e-3, 1.0, 1e3):  # Sxx Syy = 4/3 h² against 1e-12 (Sxx + Syy)², of any size
        for height, is_line in ((1.72e-6, True), (1.74e-6, False)):
            for turn in (np.eye(2), np.array([[0.6, 0.8], [-0.8, 0.6]]), np.array([[1, 1], [-1, 1]]) / np.sqrt(2)):
                points = size * np.array([[-1, 0], [1, 0], [0, height]]) @ turn
                if is_line:
                    with pytest.raises(ValueError, match="lie on one line"):
                        bolts.pattern_loads(points, [0, 0, 1], [0, 0, 0])
                else:
                    near(bolts.pattern_loads(points, [0, 0, 3], [0, 0, 0]).axial.sum(), 3, 1e-6)
    with pytest.raises(ValueError, match="at least three bolts"):
        bolts.pattern_loads([[0, 0], [1, 1]], [0, 0, 1], [0, 0, 0])


def test_bolt_load_factor():
    e = example("bolt_load_factor")
    i, o = e["inputs"], e["outputs"]
    phi = bolts.load_factor(i["delta_S"], i["delta_P"], i["load_introduction_n"])
    clamp = float(bolts.residual_clamp(i["F_M"], i["F_Z"], phi, i["F_A"]))
    needed = float(bolts.clamp_against_slip(i["F_Q"], i["mu_T"], i["q_F"]))
    smallest = float(bolts.required_preload(needed, phi, i["F_A"], i["F_Z"]))
    near([phi, phi * i["F_A"], (1 - phi) * i["F_A"], i["F_M"] + phi * i["F_A"]], [o["Phi"], o["F_SA"], o["F_PA"], o["F_S_max"]])
    near([clamp, needed, clamp / needed], [o["F_KR"], o["F_KQ"], o["slip_safety"]])
    near([smallest, i["alpha_A"] * smallest], [o["F_M_min_required"], o["F_M_max_required"]])
    near([phi * i["F_A"] / 2, (i["F_M"] - i["F_Z"]) / (1 - phi)], [o["bolt_load_amplitude_for_pulsating"], o["opens_at_F_A"]])


# fatigue


def range_counts(cycles):
    """(range, count) in increasing order of the range."""
    return [(r, cycles.counts[cycles.ranges == r].sum()) for r in np.unique(cycles.ranges)]


def test_rainflow():
    e = example("rainflow")
    found, o = fatigue.rainflow_cycles(e["inputs"]["series"]), e["outputs"]
    assert [list(x) for x in range_counts(found)] == o["range_counts"]
    key = lambda c: (c["range"], c["mean"], c["count"])
    assert sorted(zip(*(x.tolist() for x in found), strict=True)) == sorted(map(key, o["cycles"]))


def test_rainflow_of_a_history_that_repeats():
    e = example("rainflow")
    found = fatigue.rainflow_cycles(e["inputs"]["series"], "repeating")
    assert [list(x) for x in range_counts(found)] == e["outputs"]["repeating_range_counts"]


def test_rainflow_of_samples_between_the_turns():
    """Plateaus, samples on the way and a constant history change nothing."""
    series = np.array(example("rainflow")["inputs"]["series"], dtype=float)
    fine = np.interp(np.linspace(0, len(series) - 1, 401), np.arange(len(series)), series)
    plateaus = np.repeat(fine, 2)
    for x in (fine, plateaus):
        assert range_counts(fatigue.rainflow_cycles(x)) == range_counts(fatigue.rainflow_cycles(series))
    assert range_counts(fatigue.rainflow_cycles(np.ones(10))) == []
    assert range_counts(fatigue.rainflow_cycles([])) == []


def test_miner():
    e = example("miner")
    i, o = e["inputs"], e["outputs"]
    ranges, counts = np.array(i["range_counts"]).T
    S, line = ranges / 2, (i["k"], i["S_k"], i["N_k"])
    damage = fatigue.miner_sum(S, counts, *line)
    near([damage, 1 / damage], [o["damage"], o["repetitions_to_failure"]])
    near(fatigue.miner_sum(S, counts, *line, "haibach"), o["damage_haibach"])
    near(fatigue.miner_sum(S, counts, *line, "original"), o["damage_original"])
    near(fatigue.equivalent_amplitude(S, counts, i["k"], counts.sum()), o["equivalent_amplitude_for_same_count"])
    near(fatigue.equivalent_amplitude(S, counts, i["k"], i["N_k"]), o["equivalent_amplitude_at_N_k"])


def test_miner_with_goodmans_correction():
    e, history = example("miner"), example("rainflow")["inputs"]["series"]
    i = e["inputs"]
    found = fatigue.rainflow_cycles(history)
    S = fatigue.corrected_amplitude(found.ranges / 2, found.means, "goodman", i["S_u"])
    near(fatigue.miner_sum(S, found.counts, i["k"], i["S_k"], i["N_k"]), e["outputs"]["damage_goodman"])


@pytest.mark.parametrize(
    ("method", "expected"),
    [
        ("none", [10, 10, 10, 10, 0, 10]),
        ("goodman", [10 / 1.5, 20, 10 / 0.01, np.inf, 0, np.inf]),
        ("goodman in tension", [10, 20, 10 / 0.01, np.inf, 0, np.inf]),
    ],
)
def test_amplitudes_about_means(method, expected):
    """S_a/(1 − S_m/S_u): infinite from S_m = S_u on, where there is an amplitude; in compression smaller, or the same."""
    near(fatigue.corrected_amplitude([10.0, 10, 10, 10, 0, 10], [-50.0, 50, 99, 100, 100, 150], method, 100.0), expected, 1e-9)
    if method != "none":
        with pytest.raises(ValueError, match="needs the ultimate strength"):
            fatigue.corrected_amplitude(1.0, 1.0, method)


@pytest.mark.parametrize(("below", "expected"), [("elementary", 2e6 * 2**5), ("haibach", 2e6 * 2**9), ("original", np.inf)])
def test_the_line_above_and_below_its_knee(below, expected):
    near(fatigue.cycles_to_failure([100.0, 50, 200], 5.0, 100.0, 2e6, below), [2e6, expected, 2e6 / 32])
    assert fatigue.equivalent_amplitude([0.0, 0.0], [1.0, 1.0], 5.0, 1e6) == fatigue.equivalent_amplitude([], [], 5.0, 1e6) == 0
    near(fatigue.equivalent_amplitude([3.0, 6.0], [64.0, 1.0], 6.0, 1.0), 6 * 2 ** (1 / 6))


@pytest.mark.parametrize(
    ("series", "turns"),
    [([], []), ([3], [3]), ([3, 3], [3]), ([1, 2], [1, 2]), ([1, 2, 2, 3], [1, 3]), ([1, 2, 1], [1, 2, 1]), ([2, 2, 0, 1, 5, 5, 4], [2, 0, 5, 4])],
)
def test_turning_points(series, turns):
    assert fatigue.turning_points(series).tolist() == turns


def test_cycles_that_are_rounding():
    """From a millionth of the largest stress on they count."""
    cycles = fatigue.Cycles(np.array([0.99e-6, 1.01e-6, 1.0]), np.zeros(3), np.ones(3))
    assert fatigue.without_round_off(cycles, 1.0).ranges.tolist() == [1.01e-6, 1.0] and len(fatigue.without_round_off(cycles, 2.0).counts) == 1


def test_bearings_and_gears_without_a_load_or_at_rest():
    assert (
        life.mean_speed([3.0], [0.0]) == 0
        and np.isinf(life.rating_life(1.0, 0.0))
        and np.isinf(life.hours(1.0, 0.0))
        and np.isinf(bearings.static_safety(1.0, 0.0))
    )
    near(life.mean_load([1e300, 9.0], [1.0, 0.0], [1.0, 1.0]), 1e300)  # what stands weighs nothing, and powers don't overflow
    assert np.isinf(gears.momentary_events(0.0, 1.0)) and np.isinf(gears.momentary_events(-9.0, 0.0)) and gears.momentary_events(-60.0, 5.0) == 1000
    assert np.isinf(gears.wave_generator_life(0.0, 1.0, 1.0, 1.0)) and np.isinf(gears.wave_generator_life(1.0, 0.0, 1.0, 1.0))
    with pytest.raises(ValueError, match="positions must differ"):
        bearing_pair.radial_reactions(np.zeros((1, 3)), np.zeros((1, 3)), np.array([0.0, 0, 1]), 0.1, 0.1)
