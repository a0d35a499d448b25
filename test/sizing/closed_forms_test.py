"""Whole sheets against hand calculations: a pendulum held level, a shaft with an overhung load, a flange with an offset mass, a screw."""

import json
import math
from pathlib import Path

import ksl
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from ksl.load_cases.case_files.case_file import cases_of_text
from ksl.sizing.results import Results
from results_tables import results_table

G = 9.81

PENDULUM = """
<robot name="pendulum">
  <link name="ground_link"/>
  <joint name="pivot" type="revolute"><parent link="ground_link"/><child link="arm"/><axis xyz="0 1 0"/>
    <limit lower="-3" upper="3" effort="100" velocity="5"/></joint>
  <link name="arm"><inertial><origin xyz="0.5 0 0"/><mass value="2"/>
    <inertia ixx="0.01" iyy="0.04" izz="0.04" ixy="0" ixz="0" iyz="0"/></inertial></link>
</robot>"""

SHAFT = """
<robot name="shaft">
  <link name="housing"/>
  <joint name="spindle" type="continuous"><parent link="housing"/><child link="rotor"/><axis xyz="1 0 0"/></joint>
  <link name="rotor"><inertial><origin xyz="0.1 0 0"/><mass value="10"/>
    <inertia ixx="0.02" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>
</robot>"""

BRACKET = """
<robot name="bracket">
  <link name="plate"><inertial><origin xyz="0.3 0 0.1"/><mass value="8"/>
    <inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
</robot>"""

SLIDER = """
<robot name="slider">
  <link name="rail"/>
  <joint name="lift" type="prismatic"><parent link="rail"/><child link="cart"/><axis xyz="0 0 1"/>
    <limit lower="0" upper="1" effort="500" velocity="1"/></joint>
  <link name="cart"><inertial><mass value="5"/><inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
</robot>"""


def component(joint: str, kind: str, **values) -> dict:
    return {"component": [{"joint": joint, "kind": kind, **values}]}


def figures(sizing) -> dict:
    return {f.figure: f for f in sizing.figures}


def held(model, q: float, seconds: float = 2.0):
    t = np.linspace(0, seconds, 9)
    return t, np.full((9, 1), q), np.zeros((9, 1)), np.zeros((9, 1))


def steady(speed: float, seconds: float = 3.0, n: int = 31):
    t = np.linspace(0, seconds, n)
    return t, speed * t[:, None], np.full((n, 1), speed), np.zeros((n, 1))


def test_brakes_load_the_gear_and_not_the_motor(robot, tmp_path):
    """Held level by its brake, and stopped by it: what drives have is zero there, and the brake's effort is in a column of its own."""
    m = robot(PENDULUM)
    stop = "simulate = { until = 0.2, velocity = { pivot = 1.0 }, brake_at = 0.0, brake = 40.0 }"
    cases = cases_of_text(m, f"[cases.hold]\nhold = {{ pose = {{ pivot = 0.0 }} }}\n[cases.stop]\n{stop}\n")
    ksl.compute_loads(m, cases=cases).write(tmp_path / "out")
    motor = component("pivot", "motor", gear_ratio=50, rotor_inertia=1e-4, rated_torque=0.5, peak_torque=1.0, brake_torque=0.25)
    gear = component("pivot", "planetary gear", ratio=50, efficiency=0.9, acceleration_torque=60, emergency_torque=120)
    shaft = component("pivot", "fatigue", stress={"effort": 1e6})
    f = figures(ksl.size(tmp_path / "out", {"component": [*motor["component"], *gear["component"], *shaft["component"]]}))
    assert f["holding torque"].value == pytest.approx(2 * G * 0.5 / 50, rel=1e-12) and f["peak torque"].value == f["rms torque"].value == 0.0
    assert f["emergency torque"].value == f["acceleration torque"].value == pytest.approx(40.0, rel=1e-9)
    assert abs(f["largest stress"].value) == pytest.approx(40e6, rel=1e-9)


@pytest.mark.parametrize("physics", [(), ("armature",)])
@pytest.mark.parametrize("file", [False, True])
def test_a_brake_relieves_the_motor_from_its_time_on(robot, tmp_path, file, physics):
    """Held level by its controller for 0.3 s, and by its brake for 0.7 s more: a sample each 10 ms stands for so long, and the first one for half of that.  The torque
    of gravity is that of the motor before, and that of the brake after; gear and structure have it throughout."""
    m = robot(PENDULUM)
    hold = "simulate = { until = 1.0, pose = { pivot = 0.0 }, controller = 'gravity', brake_at = 0.3, brake = 40.0, rate = 100 }"
    cases = cases_of_text(m, f"[cases.hold]\nphysics = {list(physics)}\n{hold}\n")
    run = ksl.compute_loads(m, cases=cases)
    run.write(tmp_path / "out")
    level, before = 2 * G * 0.5, math.sqrt(0.295)
    row = next(row for row in run.summary.to_pylist() if row["joint"] == "pivot" and row["case"] == "hold")
    assert row["effort_peak"] == pytest.approx(level, rel=1e-9) and row["brake_peak"] == pytest.approx(level, rel=1e-9)
    assert (row["effort_peak_time"], row["brake_peak_time"]) == (0.0, pytest.approx(0.3))
    motor = component("pivot", "motor", gear_ratio=50, rotor_inertia=1e-4, rated_torque=0.5, peak_torque=1.0, brake_torque=0.25)
    gear = component("pivot", "planetary gear", ratio=50, acceleration_torque=60)
    f = figures(ksl.size(tmp_path / "out" if file else run, {"component": [*motor["component"], *gear["component"]]}))
    assert f["rms torque"].value == pytest.approx(level / 50 * before, rel=1e-9)
    assert f["peak torque"].value == f["holding torque"].value == pytest.approx(level / 50, rel=1e-9)
    assert f["acceleration torque"].value == pytest.approx(level, rel=1e-9)
    rows = [row for row in pq.read_table(next((tmp_path / "out").glob("*.parquet"))).to_pylist() if row["joint"] == "pivot"]
    assert len(rows) == 101
    for row in rows:
        braked = row["time"] >= 0.3
        assert (row["effort"], row["brake"]) == ((0.0, pytest.approx(-level)) if braked else (pytest.approx(-level), None))
        assert not physics or row["transmitted"] == (None if braked else pytest.approx(-level))


def test_a_pendulum_held_level(robot):
    """2 kg at 0.5 m: torque 9.81 N m against the brake and the motor, force 19.62 N across the axis."""
    m = robot(PENDULUM)
    table = results_table(m, {"hold": held(m, 0.0)})
    motor = component(
        "pivot", "motor", gear_ratio=50, gear_efficiency=0.8, rotor_inertia=1e-4, rated_torque=0.5, peak_torque=1.0, brake_torque=0.25, max_speed_rpm=3000
    )
    f = figures(ksl.size(table, motor))
    torque = 2 * G * 0.5 / 50
    assert f["rms torque"].value == pytest.approx(torque, rel=1e-12)  # at rest the efficiency neither helps nor hinders
    assert f["rms torque"].utilisation == pytest.approx(torque / 0.5, rel=1e-12)
    assert f["holding torque"].value == pytest.approx(torque, rel=1e-12) and f["holding torque"].case == "hold"
    assert f["holding torque"].utilisation == pytest.approx(torque / 0.25, rel=1e-12)
    assert f["peak speed"].value == 0 and f["regenerated energy"].value == 0
    assert f["reflected rotor inertia"].value == pytest.approx(0.25)
    plain = figures(ksl.size(table, component("pivot", "limits", radial_force=40.0, torque=9.81, axial_force=1.0, at=[0.0, 0.2, 0.0], bending_moment=10.0)))
    assert plain["radial force"].utilisation == pytest.approx(2 * G / 40, rel=1e-12)
    assert plain["torque"].utilisation == pytest.approx(1.0, rel=1e-12) and plain["axial force"].value == pytest.approx(0, abs=1e-12)
    assert plain["bending moment"].value == pytest.approx(0.2 * 2 * G, rel=1e-12)  # the point lies 0.2 m along the axis


@pytest.mark.parametrize("noise", [0.0, 1e-16, 1e-7, 1e-5])
def test_a_joint_that_is_held_is_sized_as_one_with_zero_velocities(robot, noise):
    """Positions alone, or with noise, say no direction of power: efficiency, revolutions, lives and cycles are those of a stand."""
    m = robot(PENDULUM)
    t = np.linspace(0, 4, 1001)
    q = 0.3 + noise * np.random.default_rng(5).standard_normal((1001, 1))
    parts = [
        {
            "kind": "motor",
            "rotor_inertia": 1e-6,
            "rated_torque": 0.25,
            "peak_torque": 0.25,
            "brake_torque": 0.25,
            "max_speed_rpm": 3000,
            "regenerated_energy": 1,
        },
        {"kind": "strain wave gear", "ratio": 50, "efficiency": 0.7, "average_torque": 10, "rated_torque": 10, "required_life_h": 1000},
        {"kind": "planetary gear", "ratio": 50, "nominal_torque": 10},
        {"kind": "crossed roller bearing", "pitch_diameter": 0.1, "C": 1e4, "C0": 1e4},
        {"kind": "fatigue", "stress": {"ty": 1e6}, "k": 5, "knee_amplitude": 60e6, "knee_cycles": 2e6},
        {"kind": "limits", "speed_rpm": 25},
    ]
    parts = [part for part in parts if noise < 1e-6 or part["kind"] != "fatigue"]  # whose stress follows the noise of the position
    file = {"component": [{"joint": "pivot", **part} for part in parts]}
    found, wanted = (ksl.size(m.wrench_table(t, *motion), file) for motion in ((q,), (np.full_like(q, 0.3), 0 * q, 0 * q)))
    assert [str(x) for x in found.left_out] == [str(x) for x in wanted.left_out]
    assert "crossed roller bearing: life is left out: the joint does not turn" in str([str(x) for x in wanted.left_out])
    tolerance = max(1e-9, 10 * noise)  # positions are noisy, and what holds them is, too
    for f, g in zip(found.in_order, wanted.in_order, strict=True):
        assert f.figure == g.figure
        assert f.value == pytest.approx(g.value, rel=tolerance, abs=1e-9), f.figure
    torque = 2 * G * 0.5 * math.cos(0.3) / 50
    by_name = figures(found)
    assert by_name["peak torque"].value == pytest.approx(torque, rel=tolerance), "with η = 0.7 it would be 43 % more, or 30 % less"
    for name in ("peak torque", "holding torque"):
        assert by_name[name].note.endswith("held without help of friction") and "rad/s, what its positions resolve" in by_name[name].note
    assert "at a stand = 4 s, held without help of friction" in by_name["rms torque"].inputs


def test_speeds_of_rounding_in_a_table_are_none(robot):
    """The same of a table whose speeds were differentiated elsewhere: ksl size knows what rounding makes of a position."""
    m = robot(PENDULUM)
    t, q, v, a = held(m, 0.3)
    v[:] = np.where(np.arange(9) % 2, 4e-15, -4e-15)[:, None]
    s = Results(with_speeds(results_table(m, {"hold": (t, q, 0 * v, a)}), v[:, 0])).joint("pivot")
    assert s.stands.all() and 4e-15 < s.resolution < 1e-13
    moving = Results(with_speeds(results_table(m, {"hold": (t, q, 0 * v, a)}), 1e9 * v[:, 0])).joint("pivot")
    assert not moving.stands.any()


def with_speeds(table, speeds):
    rows = [j == "pivot" for j in table["joint"].to_pylist()]
    column = np.array([x or 0.0 for x in table["speed"].to_pylist()])
    column[np.array(rows)] = speeds
    return table.set_column(table.column_names.index("speed"), "speed", pa.array(column))


def test_a_shaft_with_an_overhung_load(robot):
    """10 kg at 0.1 m, bearings at −0.02 and −0.12 m: by moments about each, 2.2 times the weight in front, 1.2 times behind."""
    m = robot(SHAFT)
    speed, W = 100 * 2 * math.pi / 60, 10 * G
    table = results_table(m, {"run": steady(speed)})
    front, rear = (
        {"type": "deep groove", "position": -0.02, "C": 14000.0, "C0": 6700.0, "f0": 13.0},
        {"type": "deep groove", "position": -0.12, "C": 9000.0, "C0": 4500.0},
    )
    f = figures(ksl.size(table, {"reliability": 95, **component("spindle", "bearing pair", locating=front, floating=rear, required_life_h=20000)}))
    assert f["locating: mean load"].value == pytest.approx(2.2 * W, rel=1e-12)
    assert f["floating: mean load"].value == pytest.approx(1.2 * W, rel=1e-12)
    assert f["locating: L10"].value == pytest.approx(0.64 * (14000 / (2.2 * W)) ** 3, rel=1e-12)
    assert f["locating: L10h"].value == pytest.approx(0.64 * (14000 / (2.2 * W)) ** 3 * 1e6 / (60 * 100), rel=1e-9)
    assert "position = -0.02 m, position of the other = -0.12 m" in f["locating: mean load"].inputs
    assert "position = -0.12 m, position of the other = -0.02 m" in f["floating: mean load"].inputs
    assert f["floating: L10h"].utilisation == pytest.approx(20000 / f["floating: L10h"].value, rel=1e-12)
    assert f["locating: static safety"].value == pytest.approx(6700 / (2.2 * W), rel=1e-12)
    assert not f["locating: L10h"].note  # five whole revolutions
    assert "95 %, ISO 281:2007" in f["locating: L10"].inputs


def test_axial_force_goes_to_the_locating_bearing(robot):
    """The same shaft, upright, so that the weight acts along it."""
    m = robot(SHAFT.replace('xyz="1 0 0"/></joint>', 'xyz="1 0 0"/><origin rpy="0 -1.5707963267948966 0"/></joint>'))
    W = 10 * G
    table = results_table(m, {"run": steady(10.0)})
    row = {"type": "deep groove", "C": 14000.0, "C0": 6700.0, "f0": 13.0}
    f = figures(ksl.size(table, component("spindle", "bearing pair", locating={**row, "position": 0.0}, floating={**row, "position": 0.1})))
    relative = 13 * W / 6700
    Y = 2.30 + (relative - 0.172) / (0.345 - 0.172) * (1.99 - 2.30)
    assert 0.172 < relative < 0.345
    assert f["locating: mean load"].value == pytest.approx(Y * W, rel=1e-9)
    assert f["floating: mean load"].value == pytest.approx(0, abs=1e-9) and math.isinf(f["floating: L10h"].value)
    pair = {"type": "angular contact pair", "contact_angle_deg": 40, "C": 20000.0, "C0": 15000.0}
    f = figures(ksl.size(table, component("spindle", "bearing pair", locating={**pair, "position": 0.0}, floating={**row, "position": 0.1})))
    assert f["locating: mean load"].value == pytest.approx(0.93 * W, rel=1e-9)  # X2 Fr + Y2 Fa with Fr = 0


@pytest.mark.parametrize(
    "arrangement, shaft, carries",
    [("face-to-face", "child", "a"), ("back-to-back", "child", "b"), ("face-to-face", "parent", "b"), ("back-to-back", "parent", "a")],
)
def test_which_of_two_opposed_rows_carries_the_weight(robot, arrangement, shaft, carries):
    """An upright shaft whose weight presses it down, against its axis: face to face the lower bearing's shoulder holds it.
    With a housing that hangs on a standing shaft, the same weight presses the shaft up against the housing."""
    m = robot(SHAFT.replace('xyz="1 0 0"/></joint>', 'xyz="1 0 0"/><origin rpy="0 -1.5707963267948966 0"/></joint>'))
    W = 10 * G
    rows = {"a": {"position": 0.0, "C": 20000.0, "C0": 15000.0}, "b": {"position": 0.1, "C": 20000.0, "C0": 15000.0}}
    f = figures(
        ksl.size(
            results_table(m, {"run": steady(10.0)}), component("spindle", "opposed angular contact bearings", arrangement=arrangement, shaft=shaft, **rows)
        )
    )
    other = {"a": "b", "b": "a"}[carries]
    assert f[f"{carries}: mean load"].value == pytest.approx(0.57 * W, rel=1e-9)  # Fa/Fr > e: 0.35 Fr + 0.57 Fa
    assert f[f"{other}: mean load"].value == pytest.approx(0, abs=1e-9)


def test_radial_loads_of_opposed_rows_induce_axial_ones(robot):
    """Horizontal shaft without axial force: the larger induced force e Fr acts on both rows."""
    m = robot(SHAFT)
    W = 10 * G
    rows = {"a": {"position": -0.02, "C": 20000.0, "C0": 15000.0}, "b": {"position": -0.12, "C": 20000.0, "C0": 15000.0}}
    f = figures(ksl.size(results_table(m, {"run": steady(10.0)}), component("spindle", "opposed angular contact bearings", arrangement="back-to-back", **rows)))
    assert f["a: mean load"].value == pytest.approx(2.2 * W, rel=1e-12)  # Fa/Fr = e: the row carries Fr
    induced = 1.14 * 2.2 * W
    assert f["b: mean load"].value == pytest.approx(0.35 * 1.2 * W + 0.57 * induced, rel=1e-12)


def test_a_crossed_roller_bearing_with_an_offset_load(robot):
    """The tilting moment is about the pitch plane: weight × its distance from the mass."""
    m = robot(SHAFT)
    W, speed = 10 * G, 20.0
    f = figures(
        ksl.size(
            results_table(m, {"run": steady(speed)}),
            component("spindle", "crossed roller bearing", position=-0.05, pitch_diameter=0.1, C=30000.0, C0=45000.0, load_factor=1.2),
        )
    )
    P = W + 2 * 0.15 * W / 0.1
    assert f["mean load"].value == pytest.approx(P, rel=1e-12)
    assert f["L10"].value == pytest.approx((30000 / (1.2 * P)) ** (10 / 3), rel=1e-12)
    assert f["static safety"].value == pytest.approx(45000 / P, rel=1e-12) and f["static safety"].limit == 2


def test_a_flange_with_an_offset_mass(robot):
    """8 kg 0.3 m off the centre of four bolts in a square of side 0.2 m, on the ground: by moments about the middle."""
    m = robot(BRACKET, masses="optional")
    t = np.array([0.0, 1.0])
    empty = np.zeros((2, 0))
    table = results_table(m, {"stand": (t, empty, empty, empty)})
    points = [[0.1, 0.1], [-0.1, 0.1], [-0.1, -0.1], [0.1, -0.1]]
    flange = component(
        "base", "bolted flange", points=points, preload=1000.0, tightening_factor=1.5, load_factor=0.1, yield_force=2000.0, friction=0.1, embedding_loss=50.0
    )
    f = figures(ksl.size(table, flange))
    W = 8 * G
    axial = -W / 4 + W * 0.3 / (4 * 0.1)  # the bolts behind hold the plate down, those in front are relieved
    assert f["axial load of a bolt"].value == pytest.approx(axial, rel=1e-12) and "-0.1" in f["axial load of a bolt"].inputs
    assert f["shear load of a bolt"].value == pytest.approx(0, abs=1e-12)
    assert f["bolt force"].value == pytest.approx(1500 + 0.1 * axial, rel=1e-12)
    assert f["residual clamp force"].value == pytest.approx(1000 - 50 - 0.9 * axial, rel=1e-12)
    assert f["residual clamp force"].utilisation == pytest.approx((0.9 * axial + 50) / 1000, rel=1e-12)
    assert not f["residual clamp force"].note
    loose = figures(ksl.size(table, {"component": [flange["component"][0] | {"preload": 0.8 * (50 + 0.9 * axial)}]}))["residual clamp force"]
    assert loose.value == pytest.approx(-0.2 * (50 + 0.9 * axial), rel=1e-12) and "the joint opens at this bolt" in loose.note
    hanging = robot(BRACKET, masses="optional", gravity=(0.0, 0.0, G))  # from the ceiling: the weight pulls at the bolts
    f = figures(ksl.size(results_table(hanging, {"hang": (t, empty, empty, empty)}), flange))
    assert f["axial load of a bolt"].value == pytest.approx(W / 4 + W * 0.3 / 0.4, rel=1e-12)
    on_the_wall = robot(BRACKET, masses="optional", gravity=(0.0, -G, 0.0))  # shear, and a torque about the bolts' direction
    f = figures(ksl.size(results_table(on_the_wall, {"hang": (t, empty, empty, empty)}), flange))
    around = W * 0.3 / (4 * 0.1 * math.sqrt(2))  # on each bolt, across its arm of 0.1 √2
    shear = math.hypot(around / math.sqrt(2), W / 4 + around / math.sqrt(2))
    axial = 0.1 * W / (4 * 0.1)  # the mass lies 0.1 m in front of the wall
    assert f["shear load of a bolt"].value == pytest.approx(shear, rel=1e-12)
    assert f["axial load of a bolt"].value == pytest.approx(axial, rel=1e-12)


def test_a_lead_screw(robot):
    """A sliding joint: the ratio is in rad/m.  Lifting and lowering 5 kg at 0.2 m/s with 80 % efficiency."""
    m = robot(SLIDER)
    ratio = 2 * math.pi / 0.01
    t = np.linspace(0, 1, 11)
    up = (t, 0.2 * t[:, None], np.full((11, 1), 0.2), np.zeros((11, 1)))
    down = (t, 0.2 - 0.2 * t[:, None], np.full((11, 1), -0.2), np.zeros((11, 1)))
    f = figures(
        ksl.size(
            results_table(m, {"up": up, "down": down}),
            component("lift", "motor", gear_ratio=ratio, gear_efficiency=0.8, rotor_inertia=1e-5, rated_torque=0.1, regenerated_energy=10.0),
        )
    )
    T = 5 * G / ratio
    assert f["rms torque"].value == pytest.approx(math.sqrt(((T / 0.8) ** 2 + (T * 0.8) ** 2) / 2), rel=1e-12)
    assert f["peak torque"].value == pytest.approx(T / 0.8, rel=1e-12) and f["peak torque"].case == "up"
    assert f["regenerated energy"].value == pytest.approx(0.8 * 5 * G * 0.2, rel=1e-12) and f["regenerated energy"].case == "down"


def test_shares_of_the_time_say_nothing_of_passes(robot):
    """What a drive takes up in one pass, and repetitions of it, are not compared with what one hour brings."""
    m, t = robot(SLIDER), np.linspace(0, 1, 11)
    table = results_table(m, {"down": (t, 0.2 - 0.2 * t[:, None], np.full((11, 1), -0.2), np.zeros((11, 1)))})
    motor = component("lift", "motor", gear_ratio=600, gear_efficiency=0.8, rotor_inertia=1e-5, rated_torque=0.1, regenerated_energy=10.0)
    eye = component("lift", "fatigue", stress={"fz": 1.0}, k=5.0, knee_amplitude=100.0, knee_cycles=1e6, required_repetitions=1e9)
    for components, name, limit in ((motor, "regenerated energy", "regenerated_energy"), (eye, "damage of one hour", "required_repetitions")):
        of_pass, of_share = ksl.size(table, components), ksl.size(table, components | {"shares": {"down": 1.0}})
        assert figures(of_pass)[name.replace("hour", "pass")].utilisation is not None and figures(of_share)[name].utilisation is None
        assert f"{limit} is of one pass through all cases, and [shares] don't say how long that is" in "\n".join(map(str, of_share.left_out))


def test_a_swing_fatigues_what_carries_its_weight(robot):
    """A pendulum that swings slowly: one range of its torque in each pass, at half amplitude about a mean."""
    m = robot(PENDULUM)
    t = np.linspace(0, 1000, 2001)
    angle = 0.5 * np.sin(2 * np.pi * t / 1000)
    table = results_table(m, {"swing": (t, angle[:, None], np.zeros((2001, 1)), np.zeros((2001, 1)))})
    line = dict(stress={"fx": 1.0}, k=5.0, knee_amplitude=100.0, knee_cycles=1e6, residue="repeating", required_repetitions=1e9)
    f = figures(ksl.size(table, component("pivot", "fatigue", **line)))
    amplitude = 2 * G * math.sin(0.5)  # of the force along the arm, whose sign changes
    damage = (amplitude / 100) ** 5 / 1e6
    assert f["damage of one pass"].value == pytest.approx(damage, rel=1e-9)
    assert f["damage of one pass"].utilisation == pytest.approx(1e9 * damage, rel=1e-9)
    assert f["fatigue life"].value == pytest.approx(1000 / damage / 3600, rel=1e-9)
    assert f["damage of one pass"].limit == pytest.approx(1e-9, rel=1e-12)
    for wanted in ({"required_repetitions": 1e9}, {"required_life_h": 100.0}, {"required_repetitions": 1e9, "required_life_h": 100.0}, {}):
        part = {**{k: x for k, x in line.items() if k != "required_repetitions"}, **wanted}
        assert [x.figure for x in ksl.size(table, component("pivot", "fatigue", **part)).left_out] == ["the limit of “fatigue life”"] * (not wanted)
    for cycles, how in ((1, {}), (4, {"cases": {"swing": 4}}), (3.6, {"shares": {"swing": 1.0}})):  # of one pass, or of an hour of 3.6 swings
        counted = figures(ksl.size(table, component("pivot", "fatigue", **line) | how))
        assert counted["equivalent amplitude"].value == pytest.approx(amplitude * (cycles / 1e6) ** (1 / 5), rel=1e-9)
        assert counted["damage of one hour" if "shares" in how else "damage of one pass"].value == pytest.approx(cycles * damage, rel=1e-9)


WHEEL = """
<robot name="wheel">
  <link name="frame"/>
  <joint name="spin" type="continuous"><parent link="frame"/><child link="wheel"/><axis xyz="0 0 1"/></joint>
  <link name="wheel"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
</robot>"""


def test_the_catalogues_selection_of_a_strain_wave_gear(robot):
    """Its cycle as load cases: a wheel of 1 kg m² needs the torque of its acceleration.  Printed: 319 N m, 1440 r/min, 1190 events."""
    e = json.loads((Path(__file__).resolve().parents[1] / "reference/sizing/strain_wave_gear.json").read_text())
    i, o = e["inputs"], e["outputs"]

    def case(torque, rpm, seconds):
        t, speed = np.linspace(0, seconds, 101), rpm * 2 * math.pi / 60
        return t, speed * t[:, None], np.full((101, 1), speed), np.full((101, 1), float(torque))

    steps = {f"step {k}": case(*row) for k, row in enumerate(zip(i["torque_Nm"], i["n_out_rpm"], i["t_s"], strict=True))}
    emergency = i["emergency"]
    table = results_table(robot(WHEEL), steps | {"emergency": case(emergency["T"], emergency["n_out_rpm"], emergency["t"])})
    limits = {
        "average_torque": i["limits"]["average"],
        "repeated_peak_torque": 450,
        "momentary_peak_torque": i["limits"]["momentary"],
        "max_input_rpm": i["limits"]["max_input_rpm"],
    }
    gear = component(
        "spin",
        "strain wave gear",
        ratio=i["ratio"],
        rated_torque=i["rated_torque"],
        rated_input_rpm=i["rated_input_rpm"],
        rated_life_h=i["L10_rated"],
        required_life_h=7000,
        **limits,
    )
    f = figures(ksl.size(table, {"cases": {"emergency": 0}, **gear}))
    assert f["average torque"].value == pytest.approx(o["T_average"], rel=1e-12) and f["average torque"].case == "step 1"
    assert f["average input speed"].value == pytest.approx(o["n_in_average_rpm"], rel=1e-12)
    assert f["peak input speed"].value == pytest.approx(o["n_in_max_rpm"], rel=1e-12)
    assert f["wave generator L10h"].value == pytest.approx(o["L10h"], rel=1e-12)
    assert f["wave generator L10h"].utilisation == pytest.approx(7000 / o["L10h"], rel=1e-12)
    assert (f["repeated peak torque"].value, f["momentary peak torque"].value) == (pytest.approx(400), pytest.approx(500))
    assert f["momentary peak torque"].case == "emergency"
    assert f["allowed occurrences of emergency"].value == pytest.approx(o["allowed_momentary_events"], rel=1e-12)


def test_slow_oscillation_is_said(robot):
    m = robot(PENDULUM)
    t = np.linspace(0, 1, 101)
    swing = (t, np.sin(2 * np.pi * t)[:, None], 2 * np.pi * np.cos(2 * np.pi * t)[:, None], np.zeros((101, 1)))
    f = figures(ksl.size(results_table(m, {"swing": swing}), component("pivot", "crossed roller bearing", pitch_diameter=0.1, C=1e4, C0=1e4)))
    assert "indication only" in f["L10h"].note and "ISO 281" in f["L10h"].note


def test_a_joint_that_never_turns_has_no_life_and_a_static_safety(robot):
    m = robot(PENDULUM)
    sizing = ksl.size(results_table(m, {"hold": held(m, 0.0)}), component("pivot", "crossed roller bearing", pitch_diameter=0.1, C=1e4, C0=1e4))
    assert [f.figure for f in sizing.figures] == ["static safety"]
    assert "does not turn in the cycle" in str(sizing.left_out[0])


def test_the_rms_is_that_of_the_summary(examples):
    """A direct drive without inertia: its rms and peak torque are the numbers that `ksl loads` summarises."""
    from ksl.load_cases.quantities import rms

    m = ksl.load(examples / "robots/ur5.urdf")
    t = np.sort(np.random.default_rng(1).uniform(0, 3, 200))
    w = np.arange(1, 7)
    motion = (t, np.sin(np.outer(t, w)), w * np.cos(np.outer(t, w)), -w * w * np.sin(np.outer(t, w)))
    tau = m.inverse_dynamics(*motion[1:])[:, m.joint("elbow").v_index]
    f = figures(ksl.size(m.wrench_table(*motion), component("elbow", "motor", gear_ratio=1.0, rotor_inertia=0.0)))
    assert f["rms torque"].value == pytest.approx(rms(t, tau), rel=1e-13) and f["peak torque"].value == np.abs(tau).max()


def test_the_rotor_that_the_robot_file_gives_is_not_counted_twice(robot):
    m = robot(PENDULUM.replace("</joint>", '<dynamics rotor_inertia="0.0001" gear_ratio="50" friction="0.3"/></joint>'), physics=["rotor", "exact friction"])
    t = np.linspace(0, 1, 11)
    table = m.wrench_table(t, t[:, None] ** 2, 2 * t[:, None], np.full((11, 1), 2.0))
    own = figures(ksl.size(table, component("pivot", "motor", gear_ratio=50, rotor_inertia=1e-4)))
    assert own["peak torque"].value == pytest.approx(np.abs(np.array(table.filter(table["joint"].to_numpy() == "pivot")["effort"])).max() / 50, rel=1e-12)


def test_poses_alone_have_peaks_and_no_cycle(robot):
    m = robot(PENDULUM)
    pose = m.wrench_table(*held(m, 0.0)).slice(0, len(m.joints))
    parts = [
        component("pivot", kind, **numbers)["component"][0]
        for kind, numbers in {
            "motor": dict(gear_ratio=50, rotor_inertia=1e-4, brake_torque=1.0),
            "strain wave gear": dict(ratio=50, momentary_peak_torque=20.0, rated_torque=10.0),
            "planetary gear": dict(ratio=50, emergency_torque=20.0),
            "crossed roller bearing": dict(pitch_diameter=0.1, C=1e4, C0=1e4),
            "fatigue": dict(stress={"fx": 1.0}, k=5, knee_amplitude=1.0, knee_cycles=1e6),
            "bolted flange": dict(bolts=4, circle_diameter=0.1, load_factor=0.1, preload=1e3),
        }.items()
    ]
    sizing = ksl.size(pose, {"component": parts})
    f = figures(sizing)
    assert f["holding torque"].value == pytest.approx(2 * G * 0.5 / 50) and f["momentary peak torque"].value == pytest.approx(2 * G * 0.5)
    assert f["static safety"].value == pytest.approx(1e4 / (2 * G)) and "rms torque" not in f and "fatigue life" not in f
    assert {x.figure for x in sizing.left_out} >= {"rms torque and regenerated energy", "repeated peak torque", "life", "damage and life"}


def test_the_envelope_of_a_drive():
    """Flat, falling to half at the last speed, beyond it by how much the speed is too high; the sign does not matter."""
    from ksl.sizing.motor import envelope_share

    share = envelope_share([1, -2, 1, 0, 3], [0, 1500, -2000, 2200, 3000], [1000, 2000], [2, 1])
    np.testing.assert_allclose(share, [0.5, 2 / 1.5, 1, 1.1, 3])
    assert envelope_share([1.0, 0.0], [10, 10], [0, 10], [1, 0]).tolist() == [np.inf, 0.0]
