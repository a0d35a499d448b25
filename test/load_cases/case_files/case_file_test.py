"""Load cases from a file: payloads, wrenches over time, gravity, mounting, brakes, emergency stops."""

import json
from pathlib import Path

import numpy as np
import pyarrow.compute as pc
import pyarrow.parquet as pq
import pytest

from scipy.spatial.transform import Rotation

import ksl
from ksl.load_cases.case_files.case_file import read_cases
from ksl.load_cases.case_files.case_values import OF_MOUNTING
from ksl.load_cases.case_files.stops import Stop
from ksl.motions.motion import Motion
from ksl_command import run_ksl

MASS, LENGTH, G = 2.0, 0.5, 9.81
WEIGHT = MASS * G

PENDULUM = f"""<robot name="arm"><link name="wall"/>
<link name="rod"><inertial><origin xyz="{LENGTH} 0 0"/><mass value="{MASS}"/><inertia ixx="0" iyy="0" izz="0" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="tip"/>
<joint name="pin" type="revolute"><parent link="wall"/><child link="rod"/><axis xyz="0 1 0"/>
<limit lower="-3" upper="3" effort="18" velocity="4"/><dynamics damping="0.7"/></joint>
<joint name="end" type="fixed"><parent link="rod"/><child link="tip"/><origin xyz="{LENGTH} 0 0" rpy="0 1.5707963267948966 0"/></joint></robot>"""


@pytest.fixture
def arm(tmp_path):
    """Held level for 0.9 s, and the folder for case files."""
    (tmp_path / "arm.urdf").write_text(PENDULUM)
    (tmp_path / "m.csv").write_text("time,pin,pin.v,pin.a\n" + "".join(f"{k / 10},0,0,0\n" for k in range(10)))
    return ksl.load(tmp_path / "arm.urdf"), tmp_path


def cases(arm, text: str):
    m, folder = arm
    (folder / "cases.toml").write_text(text)
    return {case.name: case for case in read_cases(m, folder / "cases.toml")[0]}


def rows(arm, text: str, joint: str = "pin") -> dict[str, dict[str, np.ndarray]]:
    """{case: {column: values}} of a joint."""
    m, folder = arm
    (folder / "cases.toml").write_text(text)
    table = ksl.compute_loads(m, cases=folder / "cases.toml").wrenches
    of = lambda name: table.filter(pc.and_(pc.equal(table["joint"], joint), pc.equal(table["case"], name)))
    return {
        name: {c: of(name)[c].to_numpy() for c in table.column_names if c not in ("case", "joint", "on", "at", "axes")}
        for name in table["case"].unique().to_pylist()
    }


def test_payload_gravity_and_mounting(arm):
    """The drive holds minus the weight's moment about y; hanging from the ceiling, or turned about x by 90°, gravity changes sides."""
    found = rows(arm, """
[defaults]
motion = "m.csv"
[cases.bare]
[cases.paid]
payloads = [{ link = "tip", mass = 1.5, center = [0, 0, 0.1], inertia = [0.1, 0.2, 0.3, 0, 0, 0] }]
[cases.moon]
gravity = [0, 0, -1.62]
[cases.ceiling]
mounting = { rpy_degrees = [180, 0, 0] }
[cases.upside]
mounting = { quaternion = [1, 0, 0, 0] }
[cases.wall]
mounting = { rpy = [1.5707963267948966, 0, 0] }
""")  # fmt: skip
    effort = {name: columns["effort"][3] for name, columns in found.items()}
    assert effort["bare"] == pytest.approx(-WEIGHT * LENGTH)
    assert effort["paid"] == pytest.approx(-WEIGHT * LENGTH - 1.5 * G * (LENGTH + 0.1)), "z of the tip is forward"
    assert effort["moon"] == pytest.approx(-MASS * 1.62 * LENGTH)
    assert effort["ceiling"] == pytest.approx(WEIGHT * LENGTH) == effort["upside"]
    assert effort["wall"] == pytest.approx(0, abs=1e-12) and abs(found["wall"]["fy"][3]) == pytest.approx(WEIGHT)


MOUNTINGS = {
    "quaternion": lambda x: Rotation.from_quat(x),
    "rpy": lambda x: Rotation.from_euler("xyz", x),
    "rpy_degrees": lambda x: Rotation.from_euler("xyz", x, degrees=True),
}


@pytest.mark.parametrize("key", OF_MOUNTING)
def test_every_way_to_mount_a_base(arm, key):
    """Gravity of random mountings in the base's axes, by SciPy's rotations; and a level arm that leans by 30° about its hinge carries cos 30°."""
    for numbers in np.random.default_rng(3).normal(size=(8, 4)):
        given = 1.009 * numbers / np.linalg.norm(numbers) if key == "quaternion" else numbers[:3]  # a length with an error within the tolerance
        text = f'[cases.a]\nmotion = "m.csv"\ngravity = [1, 2, -9]\nmounting = {{ {key} = {given.tolist()} }}\n'
        assert cases(arm, text)["a"].model.gravity == pytest.approx(MOUNTINGS[key](given).inv().apply([1, 2, -9]), rel=1e-12)


def test_the_inertia_of_a_payload(arm):
    """m r² + Iyy of the tip's frame, which the payload's inertia is in; its y axis is the hinge's."""
    m, folder = arm
    (folder / "m.csv").write_text("time,pin,pin.v,pin.a\n" + "".join(f"{k / 10},0,0,1\n" for k in range(3)))
    found = rows(arm, """
[cases.turn]
motion = "m.csv"
gravity = [0, 0, 0]
payloads = [{ link = "tip", mass = 1.5, center = [0, 0, 0.1], inertia = [0.1, 0.2, 0.25, 0, 0, 0] }]
""")  # fmt: skip
    assert found["turn"]["effort"] == pytest.approx([MASS * LENGTH**2 + 1.5 * 0.6**2 + 0.2] * 3)


def test_wrenches_over_time(arm):
    """On the tip, 0.5 m from the hinge: z of the tip is forward, x is down."""
    m, folder = arm
    (folder / "push.csv").write_text("time,fz\n0,0\n0.8,80\n")
    found = rows(arm, """
[defaults]
motion = "m.csv"
gravity = [0, 0, 0]
[cases.constant]
external = [{ link = "tip", wrench = [0, 0, 0, 0, 3, 0] }]
[cases.ang_lin]
external = [{ link = "tip", wrench = [0, 3, 0, 0, 0, 0], order = "ang_lin" }]
[cases.world]
external = [{ link = "tip", wrench = [0, 0, 10, 0, 0, 0], axes = "world" }]
[cases.frame]
external = [{ link = "end", wrench = [0, 0, 10, 0, 0, 0], axes = "rod" }]
[cases.point]
external = [{ link = "tip", wrench = [0, 0, 10, 0, 0, 0], axes = "world", point = [0, 0, 0.2] }]
[cases.steps]
external = [{ link = "tip", axes = "world", steps = [[0, 0, 0, 0, 0, 0, 0], [0.3, 0, 0, 10, 0, 0, 0], [0.6, 0, 0, 20, 0, 0, 0]] }]
[cases.file]
external = [{ link = "tip", file = "push.csv" }, { link = "tip", file = "push.csv" }]
""")  # fmt: skip
    effort = {name: columns["effort"] for name, columns in found.items()}
    assert effort["constant"] == pytest.approx([-3] * 10) and np.array_equal(effort["constant"], effort["ang_lin"])
    assert effort["world"] == pytest.approx([LENGTH * 10] * 10) and effort["frame"] == pytest.approx(effort["world"])
    assert effort["point"] == pytest.approx([(LENGTH + 0.2) * 10] * 10)
    assert effort["steps"] == pytest.approx([0] * 3 + [LENGTH * 10] * 3 + [LENGTH * 20] * 4)
    time = np.arange(10) / 10
    assert found["file"]["constraint_fx"] == pytest.approx(-2 * np.minimum(100 * time, 80)), "linear between lines, held after the last"


def test_physics_on_and_off(arm):
    m, folder = arm
    (folder / "m.csv").write_text("time,pin,pin.v,pin.a\n" + "".join(f"{k / 10},0,2,0\n" for k in range(3)))
    found = rows(arm, '[defaults]\nmotion = "m.csv"\ngravity = [0, 0, 0]\n[cases.off]\n[cases.on]\nphysics = ["damping"]\n')
    assert found["off"]["effort"] == pytest.approx([0] * 3, abs=1e-12) and np.isnan(found["off"]["damping"]).all()
    assert found["on"]["effort"] == pytest.approx([1.4] * 3) == found["on"]["damping"]


def test_brakes_hold_what_drives_don_t(arm):
    found = rows(arm, """
[defaults]
motion = "m.csv"
[cases.driven]
[cases.held]
hold = true
[cases.damped]
hold = true
physics = ["damping"]
[cases.parked]
hold = { pose = { pin = 1.0 } }
""")  # fmt: skip
    assert found["driven"]["effort"] == pytest.approx([-WEIGHT * LENGTH] * 10) and np.isnan(found["driven"]["brake"]).all()
    assert not found["held"]["effort"].any() and not found["held"]["power"].any()
    assert found["held"]["brake"] == pytest.approx([-WEIGHT * LENGTH] * 10)
    assert found["held"]["fz"] == pytest.approx([WEIGHT] * 10), "the wrench is the same"
    assert (
        found["damped"]["brake"] == pytest.approx([-WEIGHT * LENGTH] * 10)
        and not found["damped"]["effort"].any()
        and np.isnan(found["damped"]["damping"]).all()
    )
    assert found["parked"]["brake"] == pytest.approx([-WEIGHT * LENGTH * np.cos(1)]), "one sample"
    assert found["parked"]["position"] == pytest.approx([1])


def test_a_moving_arm_is_held_at_rest_at_every_sample(arm):
    m, folder = arm
    t = np.arange(60) / 50
    np.savetxt(folder / "m.csv", np.column_stack([t, np.sin(3 * t)]), "%.17g", ",", header="time,pin", comments="")
    (folder / "cases.toml").write_text('[cases.held]\nmotion = "m.csv"\nhold = true\n')
    r = ksl.compute_loads(m, cases=folder / "cases.toml")
    assert r.wrenches["brake"].drop_null().to_numpy() == pytest.approx(-WEIGHT * LENGTH * np.cos(np.sin(3 * t)))
    assert r.verdict.level == "green" and r.results[0].balance.at_rest, "the energies of positions at rest are no motion's"


# emergency stops

SPIN = f"""<robot name="spin"><link name="post"/>
<link name="beam"><inertial><origin xyz="{LENGTH} 0 0"/><mass value="{MASS}"/>
<inertia ixx="0" iyy="{MASS * 1.0 / 12}" izz="{MASS * 1.0 / 12}" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="spin" type="continuous"><parent link="post"/><child link="beam"/><axis xyz="0 0 1"/><limit effort="50" velocity="9"/></joint></robot>"""
INERTIA = MASS * (2 * LENGTH) ** 2 / 3
"""Of a beam of length 1 m about its end."""


@pytest.fixture
def spinning(tmp_path):
    """A beam that spins faster and slower about a vertical axis: ω = 3 + sin 2t."""
    (tmp_path / "spin.urdf").write_text(SPIN)
    t = np.linspace(0, 3, 301)
    motion = np.column_stack([t, 3 * t - np.cos(2 * t) / 2, 3 + np.sin(2 * t), 2 * np.cos(2 * t)])
    np.savetxt(tmp_path / "m.csv", motion, "%.17g", ",", header="time,spin,spin.v,spin.a", comments="")
    return ksl.load(tmp_path / "spin.urdf"), tmp_path


def test_the_beam_pulls_at_its_hinge(spinning):
    """A spinning beam: m ω² L / 2 along it, I α about the axis."""
    found = rows(spinning, '[cases.spin]\nmotion = "m.csv"\n', "spin")["spin"]
    assert found["fx"] == pytest.approx(-MASS * found["speed"] ** 2 * LENGTH, rel=1e-12)
    assert found["effort"] == pytest.approx(INERTIA * found["acceleration"], rel=1e-12, abs=1e-12)


@pytest.mark.parametrize(("law", "largest"), [("cubic", 1.5), ("linear", 1.0)])
def test_an_emergency_stop(spinning, law, largest):
    """From the fastest sample: ω falls from 4 to 0 in 0.25 s; the largest torque is 1.5 I ω / T or I ω / T; the way is ω T / 2."""
    found = rows(spinning, f'[cases.stop]\nmotion = "m.csv"\nstop = {{ time = 0.25, from = "worst", law = "{law}" }}\n', "spin")["stop"]
    t = found["time"]
    start = np.pi / 4
    assert t[0] == pytest.approx(start, abs=0.006) and t[-1] - t[0] == pytest.approx(0.25) and len(t) == 101, "as docs/cases.md says"
    assert found["speed"][0] == pytest.approx(4, abs=1e-3) and abs(found["speed"][-1]) < 1e-12
    assert np.abs(found["effort"]).max() == pytest.approx(largest * INERTIA * found["speed"][0] / 0.25, rel=1e-12)
    assert found["position"][-1] - found["position"][0] == pytest.approx(found["speed"][0] * 0.25 / 2, rel=1e-12)


def test_rates_of_a_stop_belong_to_its_positions(spinning):
    m, _ = spinning
    t = np.linspace(0, 1, 5)
    motion = Motion(t, np.sin(t)[:, None], np.cos(t)[:, None], -np.sin(t)[:, None])
    for law in ("cubic", "linear"):
        stop = Stop(0.3, law).motion(m, motion, 2, 4001)
        for x, rate in ((stop.q, stop.v), (stop.v, stop.a)):
            assert np.gradient(x[:, 0], stop.time)[1:-1] == pytest.approx(rate[1:-1, 0], abs=1e-4)


def test_the_worst_start_is_the_worst_of_all(spinning):
    text = '[defaults]\nmotion = "m.csv"\n[cases.worst]\nstop = { time = 0.25, step = 0.05 }\n[cases.each]\nstop = { time = 0.25, from = "all", step = 0.05 }\n'
    found = cases(spinning, text)
    each = [case for name, case in found.items() if name != "worst"]
    assert len(each) == 61 and each[0].name == "each 0 s" and "worst of 61 starts" in found["worst"].kind
    largest = [np.abs(case.motion.v).max() for case in each]
    assert found["worst"].motion.time[0] == each[int(np.argmax(largest))].motion.time[0]


def test_numbers_beyond_the_range_are_a_sentence_that_names_the_case(spinning):
    """Each number is finite, and the efforts of a stop under them are not."""
    text = (
        '[cases.far]\nmotion = "m.csv"\ngravity = [1e308, 1e308, 0]\npayloads = [{ link = "beam", mass = 2, center = [2.5, 0, 0.1] }]\nstop = { time = 1.5 }\n'
    )
    with pytest.raises(ksl.CaseError, match=r"case far: the stop from 0 s: .*too large.*; check the units of positions"):
        cases(spinning, text)


def test_brakes_may_stop_it_and_external_wrenches_are_those_of_the_start(spinning):
    text = """
[cases.brake]
motion = "m.csv"
external = [{ link = "beam", steps = [[0, 0, 0, 0, 0, 0, 7], [1.1, 0, 0, 0, 0, 0, 9]] }]
stop = { time = 0.25, from = 1.0, law = "linear", by = "brakes" }
"""
    found = rows(spinning, text, "spin")["brake"]
    assert not found["effort"].any() and found["brake"] == pytest.approx(-INERTIA * found["speed"][0] / 0.25 - 7)


def test_a_stop_of_a_floating_robot_keeps_its_direction(robot):
    """Along a screw: the twist of the body only becomes smaller."""
    m = robot(
        '<robot name="s"><link name="s"><inertial><mass value="2"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>',
        floating_base=True,
    )
    twist = np.array([1.0, 0.2, -0.3, 0.5, -0.4, 2.0])
    motion = Motion(np.zeros(1), np.array([[0, 0, 0, 0, 0, 0, 1.0]]), twist[None], np.zeros((1, 6)))
    stop = Stop(0.5).motion(m, motion, 0, 11)
    end = m.integrate(motion.q[0], twist * 0.25)
    assert stop.q[-1] == pytest.approx(end, abs=1e-12) and stop.v[5] == pytest.approx(twist / 2)


# what is refused

BAD = {
    "no cases": ("", "no load cases; give a table [cases.NAME] for each"),
    "not TOML": ("[cases", "is not TOML"),
    "unknown table": ("[case.a]", "unknown key 'case'; did you mean 'cases'? known: defaults, cases"),
    "listed": ("[[cases]]", "cases is a list of tables, [[…]]; expected a table, as [cases.NAME]"),
    "unknown key": ("[cases.a]\npayload = []", "case a: unknown key 'payload'; did you mean 'payloads'? known: motion, payloads"),
    "unknown default": ("[defaults]\nmoton = 'x'\n[cases.a]", "defaults: unknown key 'moton'; did you mean 'motion'?"),
    "no motion": ("[cases.a]", "case a: no motion; give motion ="),
    "motion that is absent": ("[cases.a]\nmotion = 'n.csv'", "n.csv"),
    "motion that is no name": ("[cases.a]\nmotion = 3", "case a: motion is 3; expected the name of a file"),
    "link": ("[cases.a]\nmotion = 'm.csv'\npayloads = [{ link = 'tipp', mass = 1 }]", "case a: payload 1: no link 'tipp'; did you mean 'tip'?"),
    "mass": ("[cases.a]\nmotion = 'm.csv'\npayloads = [{ link = 'tip' }]", "case a: payload 1: mass is missing; expected a number"),
    "negative mass": ("[cases.a]\nmotion = 'm.csv'\npayloads = [{ link = 'tip', mass = -1 }]", "case a: payload 1:"),
    "key of a payload": ("[cases.a]\nmotion = 'm.csv'\npayloads = [{ link = 'tip', mas = 1 }]", "unknown key 'mas'; did you mean 'mass'?"),
    "centre": ("[cases.a]\nmotion = 'm.csv'\npayloads = [{ link = 'tip', mass = 1, center = [1, 2] }]", "center is [1, 2]; expected 3 numbers"),
    "inertia": (
        "[cases.a]\nmotion = 'm.csv'\npayloads = [{ link = 'tip', mass = 1, inertia = [1, 1, 5, 0, 0, 0] }]",
        "payload 1: inertia: principal moments 1, 1 and 5 kg m², which no body can have",
    ),
    "gravity": ("[cases.a]\nmotion = 'm.csv'\ngravity = 9.81", "case a: gravity is 9.81; expected 3 numbers"),
    "physics": ("[cases.a]\nmotion = 'm.csv'\nphysics = ['dampin']", "case a: "),
    "two ways": ("[cases.a]\nmotion = 'm.csv'\nexternal = [{ link = 'tip', wrench = [0,0,0,0,0,0], file = 'x' }]", "wrench and file; give one of"),
    "wrench": ("[cases.a]\nmotion = 'm.csv'\nexternal = [{ link = 'tip', wrench = [0, 0, 1] }]", "external wrench 1: wrench is [0, 0, 1]; expected 6 numbers"),
    "axes": ("[cases.a]\nmotion = 'm.csv'\nexternal = [{ link = 'tip', wrench = [0,0,0,0,0,0], axes = 'wrld' }]", "no axes 'wrld'; did you mean 'world'"),
    "steps": ("[cases.a]\nmotion = 'm.csv'\nexternal = [{ link = 'tip', steps = [[1,0,0,0,0,0,0],[0,0,0,0,0,0,0]] }]", "steps need increasing times"),
    "hold and stop": ("[cases.a]\nmotion = 'm.csv'\nhold = true\nstop = { time = 1 }", "hold and stop; give one of them"),
    "pose": ("[cases.a]\nhold = { pose = { pinn = 1 } }", "case a: pose: no joint or column 'pinn'; did you mean 'pin'?"),
    "stop without time": ("[cases.a]\nmotion = 'm.csv'\nstop = { from = 'all' }", "case a: stop: time is missing"),
    "stop from elsewhere": ("[cases.a]\nmotion = 'm.csv'\nstop = { time = 1, from = 7 }", "from 7 s; the motion is from 0 s to 0.9 s"),
    "law": ("[cases.a]\nmotion = 'm.csv'\nstop = { time = 1, law = 'square' }", "law 'square'; expected cubic or linear"),
    "mounting": ("[cases.a]\nmotion = 'm.csv'\nmounting = { rpy = [0,0,0], quaternion = [0,0,0,1] }", "give one of rpy, rpy_degrees, quaternion"),
    "name": ("[cases.'all cases']\nmotion = 'm.csv'", "can't be called 'all cases'"),
}


@pytest.mark.parametrize("what", BAD)
def test_bad_files_are_one_sentence_with_the_case(arm, what):
    text, sentence = BAD[what]
    with pytest.raises(ValueError) as e:
        cases(arm, text)
    assert sentence in str(e.value) and "\n" not in str(e.value)
    assert str(e.value).startswith(str(arm[1] / "cases.toml"))


@pytest.mark.parametrize("rows", ["0,0\n0.8,80\n0.8,90\n", "0.8,0\n0,80\n"])
def test_wrenches_whose_times_do_not_increase(arm, rows):
    (arm[1] / "push.csv").write_text(f"time,fz\n{rows}")
    with pytest.raises(ValueError, match=r"push.csv:\d: time .* after .*; times must increase: sort the samples and remove repeated ones"):
        cases(arm, "[cases.a]\nmotion = 'm.csv'\nexternal = [{ link = 'tip', file = 'push.csv' }]")


@pytest.mark.parametrize("time", ["5e-324", "1.7e308"])
def test_a_stop_at_once_or_without_end(spinning, time):
    with pytest.raises(ValueError, match="stop: time .* s: from 3.99996 rad/s or m/s the deceleration or the way is beyond the range of numbers; give a time"):
        cases(spinning, f"[cases.a]\nmotion = 'm.csv'\nstop = {{ time = {time}, law = 'linear', by = 'brakes' }}")


@pytest.mark.parametrize("step", [5e-324, 1e-300, 1e-9, 0.009, 0.01, 0.0101, 0.05, 1 / 3, 0.7, 2.04, 2.4, 2.6, 5, 1e300])
def test_starts_are_a_step_apart(step):
    """The first sample at or after each multiple of the step, found one by one."""
    time = np.linspace(0, 3, 301)
    motion = Motion(time, *np.zeros((3, 301, 1)))
    multiples = step * np.arange(min(3 / step + 1, 1000)) if step >= 0.01 else time  # samples are 0.01 s apart
    expected = {min(int(np.searchsorted(time, x - 1e-9 * step)), 300) for x in multiples if x <= 3 + step / 2}
    assert Stop(1.0, step=step).starts(motion).tolist() == sorted(expected)


# the command, and the example


def run(*arguments):
    return run_ksl(*arguments)


@pytest.fixture(scope="module")
def example(examples, tmp_path_factory):
    out = tmp_path_factory.mktemp("cases") / "out"
    p = run("loads", examples / "robots/ur5.urdf", "--cases", examples / "cases/ur5_cases.toml", "-o", out)
    assert p.returncode == 0, p.stderr
    return p, out


def test_the_example(example):
    p, out = example
    table = pq.read_table(out / "wrenches.parquet")
    names = ["empty", "workpiece", "screwing", "milling", "ceiling", "brakes", "parked", "emergency"]
    assert table["case"].unique().to_pylist() == names and table.column_names[0] == "case"
    said = json.loads(table.schema.metadata[b"ksl"])
    assert [c["name"] for c in said["cases"]] == names and {f["role"] for f in said["inputs"]} == {"robot", "cases", "motion", "external"}
    assert all(f["sha256"] for f in said["inputs"]) and "emergency stop from" in said["cases"][-1]["kind"]
    assert all(name in p.stdout for name in names) and p.stdout.splitlines()[-1].startswith("verdict: GREEN: ")
    assert (out / "report.html").stat().st_size < 8e6


def test_other_programs_read_the_data_set(example, examples):
    """The lines of docs/cases.md: pandas, polars, DuckDB."""
    import importlib

    text = (examples.parent / "docs/cases.md").read_text(encoding="utf-8")
    expected = None
    for program in ("pandas", "polars", "duckdb"):
        importlib.import_module(program)
        (line,) = [line for line in text.splitlines() if line.startswith(f"import {program}")]
        names: dict[str, object] = {}
        exec(line.replace("out/ur5/", f"{example[1]}/"), names)
        found = {str(case): float(value) for case, value in names["peaks"].items()} if program == "pandas" else dict(names["peaks"])
        expected = expected or found
        assert found == pytest.approx(expected) and len(found) == 8, program


def test_the_motion_of_the_command_is_that_of_cases_without_one(arm):
    m, folder = arm
    (folder / "cases.toml").write_text("[cases.a]\n[cases.b]\ngravity = [0, 0, 0]\n")
    p = run("loads", folder / "arm.urdf", folder / "m.csv", "--cases", folder / "cases.toml", "-o", folder / "out", "--payload", "1", "--on-link", "tip")
    assert p.returncode == 0, p.stderr
    said = json.loads(pq.read_schema(folder / "out/wrenches.parquet").metadata[b"ksl"])
    assert [c["payloads"][0]["mass"] for c in said["cases"]] == [1, 1]


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ([], "ksl: loads needs a motion: ksl loads ROBOT MOTION, or ksl loads ROBOT --cases FILE.toml"),
        (["--cases", "none.toml"], "ksl: none.toml: can't be read (No such file or directory); give a TOML file that describes load cases"),
        (["--cases", "c.toml", "--external", "e.csv"], "ksl: --external and --cases: external wrenches of load cases are in their file"),
    ],
)
def test_the_command_refuses(arm, arguments, sentence):
    p = run("loads", arm[1] / "arm.urdf", *arguments, "-o", arm[1] / "out")
    assert p.returncode == 2 and p.stderr.startswith(sentence) and p.stderr.count("\n") == 1 and not Path(arm[1] / "out").exists()


def test_the_map_of_a_motion_lies_beside_the_file_and_is_an_input(arm):
    m, folder = arm
    (folder / "counts.csv").write_text("time,axis\n" + "".join(f"{k / 10},0.5\n" for k in range(10)))
    (folder / "map.toml").write_text('[columns]\naxis = "pin"\n')
    (folder / "cases.toml").write_text('[cases.counted]\nmotion = { file = "counts.csv", map = "map.toml" }\n')
    found, inputs = read_cases(m, folder / "cases.toml")
    assert (found[0].motion.q == 0.5).all() and [i.role for i in inputs] == ["cases", "motion", "map"]
    (folder / "cases.toml").write_text('[cases.counted]\nmotion = { file = "counts.csv", degrees = "yes" }\n')
    with pytest.raises(ksl.CaseError, match="case counted: .*degrees is 'yes'; expected true or false"):
        read_cases(m, folder / "cases.toml")
