"""Every figure of every kind of component, of loads at random: from the inputs that stand beside it, and from all samples by its formula."""

import math
import re
from itertools import pairwise

import numpy as np
import pyarrow as pa
import pytest
import rainflow
from results_tables import AXIS, made_table

import ksl
from ksl.base.errors import SizingError
from ksl.sizing.figures import Figure, significant

K = np.array(AXIS)
RPM = 60 / (2 * math.pi)
J, N, ETA, RATED = 2e-4, 50.0, 0.7, {"rated_torque": 30.0, "rated_input_rpm": 2000.0, "rated_life_h": 7000.0}
DP, AT, BOLTS = 0.1, (0.1, -0.2, 0.05), [[0.1, 0.08], [-0.1, 0.1], [-0.12, -0.1], [0.1, -0.1], [0.0, 0.2]]
LINE = {"k": 4.0, "knee_amplitude": 30.0, "knee_cycles": 2e6}
STRESS = {"fx": 1.0, "tz": -2.0, "effort": 0.5}
PHI, ROW = 0.2, {"type": "deep groove", "C": 9e4, "C0": 8e4, "f0": 13.0}
TORQUES = {"average_torque": 50.0, "repeated_peak_torque": 40.0, "momentary_peak_torque": 90.0, "max_average_input_rpm": 900.0, "max_input_rpm": 2000.0}
PARTS = [
    {"kind": "motor", "rotor_inertia": J, "gear_ratio": N, "gear_efficiency": ETA, "rated_torque": 1.0, "peak_torque": 2.0, "max_speed_rpm": 3000.0, "brake_torque": 1.0,
     "max_power": 90.0, "regenerated_energy": 9.0, "torque_speed": [[0, 1.5], [400, 1.2], [900, 0.2]], "continuous_torque_speed": [[0, 1.0], [900, 0.3]]},
    {"kind": "strain wave gear", "ratio": N, **RATED, **TORQUES, "required_life_h": 5000.0},
    {"kind": "planetary gear", "ratio": 20.0, "torque_exponent": 5.0, "nominal_torque": 30.0, "acceleration_torque": 50.0, "emergency_torque": 80.0},
    {"kind": "crossed roller bearing", "position": 0.05, "pitch_diameter": DP, "C": 9e4, "C0": 8e4, "load_factor": 1.3, "reliability": 95.0},
    {"kind": "bearing pair", "locating": ROW | {"position": -0.1}, "floating": ROW | {"position": 0.2}},
    {"kind": "opposed angular contact bearings", "arrangement": "back-to-back", "contact_angle_deg": 25, "a": {"position": 0.1, "C": 9e4, "C0": 8e4},
     "b": {"position": -0.2, "C": 7e4, "C0": 6e4}},
    {"kind": "bolted flange", "points": BOLTS, "normal": list(AXIS), "x_axis": [0, 1, 0], "at": list(AT), "load_factor": PHI, "preload": 5000.0, "tightening_factor": 1.4,
     "yield_force": 9000.0, "amplitude_limit": 20.0, "embedding_loss": 300.0, "required_clamp": 700.0, "friction": 0.12, "interfaces": 2.0},
    {"kind": "fatigue", "stress": STRESS, "at": list(AT), **LINE, "below_knee": "haibach", "required_repetitions": 1e3},
    {"kind": "limits", "at": list(AT), "axial_force": 90.0, "radial_force": 90.0, "bending_moment": 90.0, "torque": 90.0, "speed_rpm": 40.0},
]  # fmt: skip


def loads(seed: int) -> dict[str, dict[str, np.ndarray]]:
    """Three cases, each with sizes, a length and a beginning of its own, in which the joint stands now and then; and an emergency.

    With odd seeds larger loads last shorter and are slower, so that no case outweighs the others: of T² Δt, or of T³ |n| Δt.
    """
    rng, cases, n = np.random.default_rng(seed), {}, 40
    for name in ("a", "b", "c", "emergency"):
        size, near = 10 ** rng.uniform(0, 1), lambda spread: 10 ** rng.uniform(-spread, spread)
        lasts, turns = (near(0.05) / size**2, near(0.05) / size) if seed % 2 else (near(1), near(1) / 3)
        time = rng.uniform(0, 90) + np.cumsum(rng.uniform(0.2, 1, n)) * lasts
        columns = {c: 2 * size * near(0.3) * rng.normal(size=n) for c in ("fx", "fy", "fz", "tx", "ty", "tz")}
        speed = turns * rng.normal(size=n)
        speed[rng.random(n) < 0.2] = 0.0
        effort, rotor = (60.0 if name == "emergency" else 8 * size) * rng.normal(size=n), rng.normal(size=n)
        cases[name] = {
            "time": time,
            **columns,
            "position": 0.1 * rng.normal(size=n),
            "speed": speed,
            "acceleration": 9 * rng.normal(size=n),
            "effort": effort,
            "rotor": rotor,
        }
    return cases


SPECTRA = {"cases": {"a": 3.0, "c": 0.5, "emergency": 0.0}, "shares": {"a": 0.3, "c": 0.25}}
"""How often cases occur, once where they are not named; or shares of the time, none where they are not named."""


@pytest.fixture(scope="module", params=[(how, seed) for how in SPECTRA for seed in range(4)], ids=str)
def sized(request):
    """Loads, {case: how often it occurs} and the sizing of all parts."""
    how, seed = request.param
    cases, said = loads(seed), SPECTRA[how]
    parts = {"component": [{"joint": "j", **part} for part in PARTS], how: said, "required_life_h": 2000.0}
    times = {name: said.get(name, 1.0) if how == "cases" else said.get(name, 0.0) / np.ptp(x["time"]) for name, x in cases.items()}
    return cases, times, ksl.size(made_table(cases), parts)


def wrench(x, at=(0.0, 0.0, 0.0)):
    """Force and moment about a point, each (n, 3)."""
    force, moment = (np.column_stack([x[f"{letter}{c}"] for c in "xyz"]) for letter in "ft")
    return force, moment - np.cross(at, force)


def across(x):
    return np.linalg.norm(np.cross(x, K), axis=1)


# from the inputs beside it


def inputs_of(figure: Figure) -> dict[str, float]:
    """The numbers among its inputs by their names."""
    named = re.findall(r"(?:^|, )([^=]+?) = (.*?)(?=, [^=,]+ = |$)", figure.inputs)
    return {name: float(text.split()[0].removesuffix("·10⁶")) for name, text in named if re.match(r"-?[\d.]", text) and name != "p"}


def motor_torque(x):
    power = x["T_load"] * x["ω"]
    return J * x["N"] * x["α"] + x["T_load"] / x["N"] * (1 / x["η"] if power > 0 else x["η"] if power < 0 else 1)


BY_INPUTS = {
    ("motor", "peak speed"): lambda x: abs(x["N"] * x["ω"]) * RPM,
    ("motor", "holding torque"): lambda x: abs(x["T_load"]) / x["N"],
    ("motor", "rms torque, S1 curve"): lambda x: x["T_rms"] / x["T_S1(n_m)"],
    ("motor", "peak torque"): lambda x: abs(motor_torque(x)),
    ("motor", "peak power"): lambda x: abs(x["T"] * x["N"] * x["ω"]),
    ("motor", "reflected rotor inertia"): lambda x: x["J"] * x["N"] ** 2,
    ("motor", "torque–speed envelope"): lambda x: max(abs(x["T"]) / x["T_max(n)"], abs(x["n"]) / 900),
    ("strain wave gear", "average input speed"): lambda x: x["N"] * x["n_m"],
    ("planetary gear", "average input speed"): lambda x: x["N"] * x["n_m"],
    ("strain wave gear", "peak input speed"): lambda x: x["N"] * x["n"],
    ("planetary gear", "peak input speed"): lambda x: x["N"] * x["n"],
    ("strain wave gear", "repeated peak torque"): lambda x: abs(x["T"]),
    ("strain wave gear", "momentary peak torque"): lambda x: abs(x["T"]),
    ("strain wave gear", "wave generator L10h"): lambda x: x["rated_life_h"] * (x["rated_torque"] / x["T_av"]) ** 3 * x["rated_input_rpm"] / x["n_av"],
    ("strain wave gear", "allowed occurrences of emergency"): lambda x: 1e4 / (2 * x["n_in"] / 60 * x["t"]),
    ("planetary gear", "acceleration torque"): lambda x: abs(x["T"]),
    ("planetary gear", "emergency torque"): lambda x: abs(x["T"]),
    ("crossed roller bearing", "L10"): lambda x: 0.64 * (x["C"] / (1.3 * x["Pm"])) ** (10 / 3),
    ("crossed roller bearing", "L10h"): lambda x: x["L10"] * 1e6 / (60 * x["n_m"]),
    ("crossed roller bearing", "static safety"): lambda x: 8e4 / (x["Fr"] + 2 * x["M"] / DP + 0.44 * x["Fa"]),
    **{("bearing pair", f"{which}: L10"): lambda x: (x["C"] / x["Pm"]) ** 3 for which in ("locating", "floating")},
    **{("bearing pair", f"{which}: L10h"): lambda x: x["L10"] * 1e6 / (60 * x["n_m"]) for which in ("locating", "floating")},
    **{("bearing pair", f"{which}: static safety"): lambda x: x["C0"] / max(x["Fr"], 0.6 * x["Fr"] + 0.5 * x["Fa"]) for which in ("locating", "floating")},
    **{("opposed angular contact bearings", f"{row}: L10"): lambda x: (x["C"] / x["Pm"]) ** 3 for row in "ab"},
    **{("opposed angular contact bearings", f"{row}: L10h"): lambda x: x["L10"] * 1e6 / (60 * x["n_m"]) for row in "ab"},
    **{("opposed angular contact bearings", f"{row}: static safety"): lambda x: x["C0"] / max(x["Fr"], 0.5 * x["Fr"] + 0.38 * x["Fa"]) for row in "ab"},
    ("bolted flange", "bolt force"): lambda x: x["tightening_factor"] * x["preload"] + x["Φ"] * x["F_A"],
    ("bolted flange", "residual clamp force"): lambda x: x["preload"] - x["embedding_loss"] - (1 - x["Φ"]) * x["F_A"],
    ("bolted flange", "slip"): lambda x: x["F_Q"] / (x["interfaces"] * x["friction"]) / x["F_KR"],
    ("bolted flange", "required preload"): lambda x: max(x["F_Q"] / (x["interfaces"] * x["friction"]), 700) + (1 - x["Φ"]) * x["F_A"] + 300,
    ("fatigue", "fatigue life"): lambda x: x["Σ Δt"] / (3600 * x["D"]),
}  # fmt: skip
"""{(kind, figure): its formula of numbers among the inputs}."""


def figure_of(sized, kind, name) -> Figure:
    (found,) = [f for f in sized[2].in_order if (f.kind, f.figure.replace("one hour", "one pass")) == (kind, name)]
    return found


def test_figures_follow_from_the_inputs_beside_them(sized):
    """As far as their four digits go."""
    for (kind, name), formula in BY_INPUTS.items():
        figure = figure_of(sized, kind, name)
        assert figure.value == pytest.approx(formula(inputs_of(figure)), rel=6e-3), (kind, name, figure.inputs)
        if figure.limit is not None and name != "residual clamp force":
            use = figure.limit / figure.value if figure.bound == "≥" else figure.value / figure.limit
            assert figure.utilisation == pytest.approx(use, rel=1e-12), (kind, name)


AT_THE_SAMPLE = {
    "T_load": lambda x: torque(x), "ω": lambda x: x["speed"], "α": lambda x: x["acceleration"], "Fa": lambda x: abs(wrench(x)[0] @ K), "Fr": lambda x: across(wrench(x)[0]),
    "M": lambda x: across(wrench(x, 0.05 * K)[1]), "axial_force": lambda x: abs(wrench(x)[0] @ K), "radial_force": lambda x: across(wrench(x)[0]),
    "bending_moment": lambda x: across(wrench(x, AT)[1]), "torque": lambda x: abs(wrench(x, AT)[1] @ K), "F_A": lambda x: bolts(x)[0], "F_Q": lambda x: bolts(x)[1],
}  # fmt: skip
"""{an input: its curve, for each bolt where there are several}, of bearings that stand alone."""


def test_inputs_are_those_of_the_sample_that_governs(sized):
    """Of the bolt that is named."""
    seen = set()
    for f in sized[2].in_order:
        if f.time is None or f.kind in ("bearing pair", "opposed angular contact bearings") or f.figure == "force amplitude of a bolt":
            continue
        x, bolt = sized[0][f.case], re.search(r"bolt = (\d) at \((\S+), (\S+)\) m", f.inputs)
        if bolt:
            assert BOLTS[int(bolt[1]) - 1] == [float(bolt[2]), float(bolt[3])], f.figure
        for name in inputs_of(f).keys() & AT_THE_SAMPLE.keys():
            found = AT_THE_SAMPLE[name](x)[list(x["time"]).index(f.time)]
            assert inputs_of(f)[name] == pytest.approx(found[int(bolt[1]) - 1] if bolt else found, rel=6e-4, abs=1e-9), (f.figure, name)
            seen.add(name)
    assert seen == AT_THE_SAMPLE.keys()


# from all samples


def bolts(x):
    """Axial and shear loads (n, bolts): the shares of equal bolts in a rigid flange are linear, and their sums are the wrench on it."""
    axes, p = np.array([[0.0, 1, 0], np.cross(K, [0.0, 1, 0]), K]), np.array(BOLTS)
    F, M = (-v @ axes.T for v in wrench(x, AT))
    linear = np.column_stack([np.ones(len(p)), p])
    axial = np.linalg.solve(np.array([np.ones(len(p)), p[:, 1], -p[:, 0]]) @ linear, np.column_stack([F[:, 2], M[:, 0], M[:, 1]]).T).T @ linear.T
    x0, y0 = middle = p.mean(axis=0)
    turn = (p - middle) @ [[0, 1], [-1, 0]]  # each bolt's way, of a turn about the middle
    about_middle = M[:, 2] - (x0 * F[:, 1] - y0 * F[:, 0])
    shear = F[:, None, :2] / len(p) + (about_middle / (turn**2).sum())[:, None, None] * turn
    return axial, np.linalg.norm(shear, axis=2)


def rotor(x):
    load = x["effort"] - x["rotor"]
    return np.array([motor_torque({"T_load": T, "ω": w, "α": a, "N": N, "η": ETA}) for T, w, a in zip(load, x["speed"], x["acceleration"], strict=True)])


def crossed(x):
    F, about = wrench(x, 0.05 * K)
    Fr, Fa = across(F) + 2 * across(about) / DP, abs(F @ K)
    return np.where(Fa <= 1.5 * Fr, Fr + 0.45 * Fa, 0.67 * (Fr + Fa))


def reactions(x, a, b):
    """Radial forces on bearings at a and b along the axis: by moments about the other one."""
    return [across(np.cross(wrench(x, other * K)[1], K)) / abs(a - b) for other in (b, a)]


def locating(x):
    Fr, Fa = reactions(x, -0.1, 0.2)[0], abs(wrench(x)[0] @ K)
    relative = 13 * Fa / 8e4
    e, Y = 0.19, 2.30  # below the first row of the table
    assert relative.max() < 0.172
    return np.where(Fa <= e * Fr, Fr, 0.56 * Fr + Y * Fa)


def opposed(x):
    """Back to back with a further along the axis: the force of the shaft along it, which is that of the parent turned round, loads b."""
    Fr = reactions(x, 0.1, -0.2)
    S, push = [0.68 * r for r in Fr], wrench(x)[0] @ K
    Fa = np.maximum(S[0], S[1] + push), np.maximum(S[1], S[0] - push)
    return [np.where(a <= 0.68 * r, r, 0.41 * r + 0.87 * a) for r, a in zip(Fr, Fa, strict=True)]


def stress(x):
    return x["fx"] - 2 * wrench(x, AT)[1][:, 2] + 0.5 * x["effort"]


def cycles(x):
    """Amplitudes and counts."""
    return np.array([(size / 2, count) for size, _, count, _, _ in rainflow.extract_cycles(stress(x))]).T


def damage(x):
    S, count = cycles(x)
    return np.sum(count / (2e6 * np.where(S < 30, (30 / S) ** 7, (30 / S) ** 4)))


def returned(x):
    """Energy of a power that is linear between samples, where it is negative."""
    power, energy = rotor(x) * N * x["speed"], 0.0
    for (t0, p0), (t1, p1) in pairwise(zip(x["time"], power, strict=True)):
        below = min(p0, 0) + min(p1, 0)
        energy -= below / 2 * (t1 - t0) * (abs(below / (p1 - p0)) if p0 * p1 < 0 else 1)
    return energy


def over_time(f, weight=lambda x: 1.0 + 0 * x["speed"]):
    return lambda x: np.trapezoid(f(x) * weight(x), x["time"])


def speed(x):
    return abs(x["speed"])


def power_mean(f, p):
    """A mean over turns: what it is a sum of, and the mean of the sums."""
    return over_time(lambda x: abs(f(x)) ** p, speed), lambda total, of: (total / of(over_time(speed))) ** (1 / p)


def torque(x):
    return x["effort"] - x["rotor"]


BY_SAMPLES = {
    ("motor", "rms torque"): (over_time(lambda x: rotor(x) ** 2), lambda total, of: math.sqrt(total / of(over_time(lambda x: 1.0)))),
    ("motor", "regenerated energy"): (returned, lambda total, of: total * of(None)),
    ("strain wave gear", "average torque"): power_mean(torque, 3),
    ("planetary gear", "mean torque"): power_mean(torque, 5),
    ("strain wave gear", "average input speed"): (over_time(speed), lambda total, of: N * RPM * total / of(over_time(lambda x: 1.0))),
    ("planetary gear", "average input speed"): (over_time(speed), lambda total, of: 20 * RPM * total / of(over_time(lambda x: 1.0))),
    ("crossed roller bearing", "mean load"): power_mean(crossed, 10 / 3),
    ("bearing pair", "locating: mean load"): power_mean(locating, 3),
    ("bearing pair", "floating: mean load"): power_mean(lambda x: reactions(x, -0.1, 0.2)[1], 3),
    ("opposed angular contact bearings", "a: mean load"): power_mean(lambda x: opposed(x)[0], 3),
    ("opposed angular contact bearings", "b: mean load"): power_mean(lambda x: opposed(x)[1], 3),
    ("fatigue", "damage of one pass"): (damage, lambda total, of: total * of(None)),
    ("fatigue", "fatigue life"): (damage, lambda total, of: of(over_time(lambda x: 1.0)) / total / 3600),
    ("fatigue", "equivalent amplitude"): (damage, lambda total, of: (of(lambda x: np.sum(cycles(x)[1] * cycles(x)[0] ** 4)) * of(None) / 2e6) ** (1 / 4)),
}
"""{(kind, figure): what it is a sum of over cases; and the figure of the sum, with other sums by of(…), and of(None), which makes one pass or one hour of them}."""


def test_sums_over_all_samples_and_the_cases_that_govern_them(sized):
    cases, times, _ = sized
    by_share = times["b"] == 0
    hour = 3600 / sum(times[case] * np.ptp(x["time"]) for case, x in cases.items()) if by_share else 1.0
    of = lambda f: hour if f is None else sum(times[case] * float(f(x)) for case, x in cases.items() if times[case])
    for (kind, name), (parts, whole) in BY_SAMPLES.items():
        figure, by_case = figure_of(sized, kind, name), {case: times[case] * float(parts(x)) for case, x in cases.items() if times[case]}
        assert figure.value == pytest.approx(whole(sum(by_case.values()), of), rel=1e-9), (kind, name)
        assert figure.case == max(by_case, key=by_case.get), (kind, name)
        assert name != "damage of one pass" or figure.figure == ("damage of one hour" if by_share else name)


BY_PEAKS = {
    ("motor", "peak torque"): lambda x: abs(rotor(x)),
    ("motor", "peak power"): lambda x: abs(rotor(x) * N * x["speed"]),
    ("motor", "peak speed"): lambda x: N * RPM * speed(x),
    ("motor", "holding torque"): lambda x: np.where(x["speed"] == 0, abs(torque(x)) / N, 0),
    ("motor", "torque–speed envelope"): lambda x: envelope(x),
    ("strain wave gear", "momentary peak torque"): lambda x: abs(torque(x)),
    ("planetary gear", "emergency torque"): lambda x: abs(torque(x)),
    ("planetary gear", "peak input speed"): lambda x: 20 * RPM * speed(x),
    ("crossed roller bearing", "static safety"): lambda x: (across(wrench(x)[0]) + 2 * across(wrench(x, 0.05 * K)[1]) / DP + 0.44 * abs(wrench(x)[0] @ K)) / 8e4,
    ("bearing pair", "floating: static safety"): lambda x: reactions(x, -0.1, 0.2)[1] / 8e4,
    ("bolted flange", "axial load of a bolt"): lambda x: bolts(x)[0].max(axis=1),
    ("bolted flange", "shear load of a bolt"): lambda x: bolts(x)[1].max(axis=1),
    ("bolted flange", "bolt force"): lambda x: 1.4 * 5000 + PHI * bolts(x)[0].max(axis=1),
    ("bolted flange", "slip"): lambda x: (bolts(x)[1] / 0.24 / (4700 - (1 - PHI) * bolts(x)[0])).max(axis=1),
    ("bolted flange", "required preload"): lambda x: (np.maximum(bolts(x)[1] / 0.24, 700) + (1 - PHI) * bolts(x)[0]).max(axis=1) + 300,
    ("limits", "axial force"): lambda x: abs(wrench(x)[0] @ K),
    ("limits", "radial force"): lambda x: across(wrench(x)[0]),
    ("limits", "bending moment"): lambda x: across(wrench(x, AT)[1]),
    ("limits", "torque"): lambda x: abs(wrench(x, AT)[1] @ K),
    ("limits", "speed"): lambda x: RPM * speed(x),
    ("fatigue", "largest stress"): lambda x: abs(stress(x)),
}  # fmt: skip
"""{(kind, figure): the curve whose largest value over all cases, exceptional ones too, it is}."""
REPEATED = {("strain wave gear", "repeated peak torque"): lambda x: abs(torque(x)), ("planetary gear", "acceleration torque"): lambda x: abs(torque(x))}
"""The same over the cases of the cycle."""


def envelope(x):
    n, T = N * RPM * speed(x), abs(rotor(x))
    allowed = np.where(n < 400, 1.5 - 0.3 * n / 400, np.where(n < 900, 1.2 - (n - 400) / 500, 0.2))
    return np.where(n > 900, np.maximum(T / allowed, n / 900), T / allowed)


def test_peaks_with_their_cases_and_times(sized):
    cases, times, _ = sized
    for (kind, name), curve in (BY_PEAKS | REPEATED).items():
        peaks = {case: curve(x) for case, x in cases.items() if times[case] or (kind, name) in BY_PEAKS}
        case, figure = max(peaks, key=lambda case: peaks[case].max()), figure_of(sized, kind, name)
        value = 1 / figure.value if "static" in name else abs(figure.value)
        assert value == pytest.approx(peaks[case].max(), rel=1e-9), (kind, name)
        assert (figure.case, figure.time) == (case, cases[case]["time"][peaks[case].argmax()]), (kind, name)


def test_amplitudes_envelopes_stands_and_emergencies(sized):
    """Φ (max − min)/2 of the bolt that swings most; samples outside of a curve; time at a stand; how often exceptional cases may occur."""
    cases, times, sizing = sized
    swings = np.ptp(np.concatenate([bolts(x)[0] for x in cases.values()]), axis=0)
    amplitude = figure_of(sized, "bolted flange", "force amplitude of a bolt")
    assert amplitude.value == pytest.approx(PHI * swings.max() / 2, rel=1e-9) and f"bolt = {swings.argmax() + 1} at" in amplitude.inputs
    low, high = re.search(r"F_A = (\S+) to (\S+) N", amplitude.inputs).groups()
    assert PHI * (float(high) - float(low)) / 2 == pytest.approx(amplitude.value, rel=2e-3)
    (cloud,) = sizing.clouds
    assert cloud.rpm == pytest.approx(N * RPM * np.concatenate([x["speed"] for x in cases.values()]), rel=1e-12)
    assert cloud.torque == pytest.approx(np.concatenate([rotor(x) for x in cases.values()]), rel=1e-9)
    assert (cloud.curve, cloud.continuous) == (PARTS[0]["torque_speed"], PARTS[0]["continuous_torque_speed"])
    outside = sum(np.count_nonzero(envelope(x) > 1) for x in cases.values())
    assert figure_of(sized, "motor", "torque–speed envelope").note == (f"{outside} of 160 samples are outside the envelope" if outside else "")
    half = {case: np.append(np.diff(x["time"]), 0) / 2 + np.append(0, np.diff(x["time"])) / 2 for case, x in cases.items()}
    stand = sum(times[case] * half[case][x["speed"] == 0].sum() for case, x in cases.items())
    assert inputs_of(figure_of(sized, "motor", "rms torque"))["at a stand"] == pytest.approx(stand, rel=6e-4)
    allowed = {f.figure.removeprefix("allowed occurrences of "): f.value for f in sizing.in_order if f.figure.startswith("allowed")}
    above = {case: abs(torque(x)) > 40 for case, x in cases.items() if not times[case]}
    assert allowed == {
        case: pytest.approx(1e4 / (2 * N * speed(cases[case])[rows].max() / (2 * math.pi) * half[case][rows].sum()), rel=1e-9)
        for case, rows in above.items() if (speed(cases[case])[rows] > 0).any()
    }  # fmt: skip


def test_small_loads_at_a_stand_and_in_the_cycle():
    """Those that hold are not those that move, nor those of the cycle those of a pose, however small they are; and a case may lack rows of a joint."""
    table = made_table(
        {
            "a": {"time": [0.0, 1, 2, 3], "speed": [0, 9.0, 9, 0], "effort": [0.3, -5, 6, -0.4], "position": [0, 9, 18, 18]},
            "pose": {"time": [0.0], "effort": 9.0, "speed": 1.0},
        }
    )
    elsewhere = made_table({"b": {"time": [0.0, 1.0], "effort": 99.0}})
    elsewhere = elsewhere.set_column(2, "joint", [["k", "k"]])
    joints = [{"name": name, "kind": "revolute", "axis": list(AXIS)} for name in "jk"]
    whole = pa.concat_tables([table, elsewhere]).replace_schema_metadata(made_table({"a": {"time": [0.0]}}, joints=joints).schema.metadata)
    parts = [
        {"kind": "motor", "gear_ratio": 1, "brake_torque": 1.0, "rotor_inertia": 0},
        {"kind": "strain wave gear"},
        {"kind": "planetary gear"},
        *PARTS[3:4],
        *PARTS[7:8],
    ]
    for given in (table, whole):
        sizing = ksl.size(given, {"component": [{"joint": "j", **part} for part in parts]})
        found = {f.figure: f for f in sizing.in_order}
        assert (found["holding torque"].value, found["holding torque"].time) == (0.4, 3.0)
        assert [found[name].value for name in ("repeated peak torque", "acceleration torque", "momentary peak torque", "emergency torque")] == [6, 6, 9, 9]
        assert not found["L10h"].note and found["rms torque"].case == "a"
    small = made_table({"a": {"time": [0.0, 1.0], "speed": 0.0, "effort": 0.3}, "pose": {"time": [0.0], "effort": 9.0, "speed": 1.0}})
    found = {f.figure: f.value for f in ksl.size(small, {"component": [{"joint": "j", **part} for part in parts]}).in_order}
    assert (found["holding torque"], found["repeated peak torque"], found["acceleration torque"]) == (0.3, 0.3, 0.3)


@pytest.mark.filterwarnings("error::RuntimeWarning")
@pytest.mark.parametrize(
    ("mean", "swing", "damage", "hours"),
    [(50.0, 5.0, (10 / 30) ** 4 / 2e6, 1 / 3600), (100.0, 5.0, math.inf, 0.0), (50.0, 0.0, 0.0, math.inf), (100.0, 0.0, 0.0, math.inf)],
)
def test_means_at_the_ultimate_strength_and_stresses_that_do_not_change(mean, swing, damage, hours):
    """A cycle about S_u can't be borne once, and none lasts forever; an amplitude that does the same damage is said of finite ones alone."""
    table = made_table({"a": {"time": [0.0, 0.25, 0.5, 0.75, 1.0], "fx": mean + swing * np.array([0, 1, 0, -1, 0])}})
    part = {"joint": "j", "kind": "fatigue", "stress": {"fx": 1.0}, **LINE, "mean_stress": "goodman", "ultimate": 100.0, "residue": "repeating"}
    f = {f.figure: f.value for f in ksl.size(table, {"component": [part]}).in_order}
    assert f["damage of one pass"] == pytest.approx(damage, rel=1e-9) and f["fatigue life"] == pytest.approx(
        hours / damage if 0 < damage < math.inf else hours, rel=1e-9
    )
    assert f.get("equivalent amplitude") == (pytest.approx(10 * 2e6**-0.25, rel=1e-9) if 0 < damage < math.inf else None)


def flange(**keys):
    part = {
        "joint": "j",
        "kind": "bolted flange",
        "load_factor": PHI,
        "preload": 5000.0,
        "friction": 0.12,
        "required_clamp": 700.0,
        "amplitude_limit": 9.0,
        "yield_force": 9e3,
    }
    return [f.value for f in ksl.size(made_table(loads(1)), {"component": [part | keys]}).in_order]


@pytest.mark.parametrize(
    ("normal", "x_axis"), [(None, [0.8, 0, -0.6]), ([0, 0, -2], [3, 0, 0]), ([1, 0, 0], [0, 1, 0]), ([0.91, 0, 0.4], [0, 1, 0]), ([0.89, 0, 0.46], [1, 0, 0])]
)
def test_a_circle_of_bolts_is_its_points(normal, x_axis):
    """Counted from first_angle on.  x is the joint's in the flange's plane; y, where the normal is nearer to x than about 26°."""
    angles = np.radians(20) + 2 * np.pi * np.arange(5) / 5
    places, at = {"normal": normal} if normal else {}, {"at": [0.1, 0.2, 0.3]}
    circle = flange(bolts=5, circle_diameter=0.3, first_angle_deg=20.0, **places, **at)
    points = flange(points=(0.15 * np.column_stack([np.cos(angles), np.sin(angles)])).tolist(), x_axis=x_axis, **places, **at)
    assert circle == pytest.approx(points, rel=1e-9) and len(circle) == 7
    assert flange(bolts=5, circle_diameter=0.3, **places, **at) != pytest.approx(points, rel=1e-6)
    normal = np.array(normal or AXIS) / np.linalg.norm(normal or AXIS)
    for length in (1e-4, 1e4):  # a direction of any length may lean by a millionth, and less is along the normal
        lean = lambda angle: flange(bolts=5, circle_diameter=0.3, x_axis=(length * (normal + angle * np.array([0, 1.0, 0]))).tolist(), **places, **at)
        assert len(lean(1.1e-6)) == 7
        with pytest.raises(SizingError, match="x_axis is zero or along the normal"):
            lean(0.9e-6)


@pytest.mark.parametrize(("turn", "repetitions", "slow"), [(6.2, 1, True), (6.3, 1, False), (6.3, 0, True)])
def test_lives_of_joints_that_turn_less_than_once_are_an_indication(turn, repetitions, slow):
    """In any case of the cycle."""
    move = lambda way: {"time": [0.0, 1, 2], "position": [5 + way, 5, 5 + way / 2], "speed": way, "fx": 9.0}
    part = {"joint": "j", "kind": "crossed roller bearing", "pitch_diameter": 0.1, "C": 1e4}
    table = made_table({"a": move(1.0), "b": move(turn), "pose": {"time": [0.0], "speed": 1.0}})
    f = next(f for f in ksl.size(table, {"component": [part], "cases": {"b": repetitions}}).figures if f.figure == "L10h")
    assert ("indication only" in f.note) == slow


@pytest.mark.parametrize(("own", "of_file", "hours", "a1"), [({}, {}, None, 1.0), ({}, {"required_life_h": 300.0, "reliability": 99.0}, 300.0, 0.25),
                                                         ({"required_life_h": 70.0, "reliability": 95.0}, {"required_life_h": 300.0, "reliability": 99.0}, 70.0, 0.64)])  # fmt: skip
def test_lives_that_are_asked_for(own, of_file, hours, a1):
    """Of a component, or otherwise of the file; the rating life is C/P = 3 to the power of 10/3 times a1."""
    table = made_table({"a": {"time": [0.0, 60.0], "speed": 2 * math.pi, "fx": 3000 * AXIS[2], "fz": -3000 * AXIS[0], "position": [0, 60.0]}})
    part = {"joint": "j", "kind": "crossed roller bearing", "pitch_diameter": 0.1, "load_factor": 1.0, "C": 9000.0}
    sizing = ksl.size(table, {"component": [part | own], **of_file})
    f = next(f for f in sizing.figures if f.figure == "L10h")
    assert f.value == pytest.approx(a1 * 3 ** (10 / 3) * 1e6 / 3600, rel=1e-12) and f.limit == hours
    assert f.utilisation == (None if hours is None else pytest.approx(hours / f.value, rel=1e-12))
    assert any("the limit of “L10h”" in str(x) for x in sizing.left_out) == (hours is None)


@pytest.mark.parametrize(
    ("x", "text"),
    [
        (0.0123, "0.0123"), (12.349, "12.35"), (23456.0, "23456"), (9999.4, "9999"), (9999.6, "10000"), (9.9994e6, "9999400"), (1.2e9, "1.2e+09"), (1e7, "1e+07"),
        (-23456.0, "-23456"), (0.00001234, "1.234e-05"), (0.0, "0"), (math.nan, "–"), (None, "–"), (math.inf, "∞"), (-math.inf, "−∞"),
    ],
)  # fmt: skip
def test_numbers_as_they_are_printed(x, text):
    """Four digits, without an exponent from 1e-4 to 1e7."""
    assert significant(x) == text
