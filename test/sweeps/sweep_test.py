"""ksl.sweep: the cases are what the description says, each equals a load case of its own, and nothing that is complete is lost."""

import errno
import io
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pyarrow.parquet as parquet
import pytest
from linkages import FOURBAR
from scipy.spatial.transform import Rotation

import ksl
from ksl.load_cases.curves import Curves
from ksl.load_cases.load_case import LoadCase
from ksl.load_cases.quantities import summarise
from ksl.mechanism.lengths import extent
from ksl.motions.reading import read_motion
from ksl.sweeps import local, on_ray
from ksl.sweeps.compute_sweep import _plan, again_of
from ksl.sweeps.description import described as parameters_described
from ksl.sweeps.description import sweep_from
from ksl.sweeps.evaluate import Evaluator, Plan
from ksl.sweeps.joint_summaries import Peaks
from ksl.sweeps.sampling import sample
from ksl.sweeps.variants import Variants, shifted
from ksl_command import run_ksl
from text_that_is_none import damaged_text

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
PANDA, PICK = str(EXAMPLES / "robots" / "panda.urdf"), str(EXAMPLES / "motions" / "panda_pick.csv")
TOOL = "panda_flange"
HERE = pytest.mark.usefixtures("sweeps_here")
PAYLOAD = {"kind": "payload", "link": TOOL, "center": [0.02, -0.03, 0.1], "values": [0, 1.5, 3]}
SPEED = {"kind": "speed", "values": [0.5, 1.0]}


def described(*vary, **head) -> dict:
    return {"sweep": head, "base": {"motion": PICK}, "vary": list(vary)}


def variants(*vary) -> Variants:
    return Variants(PANDA, sweep_from(described(*vary)))


def efforts(case) -> np.ndarray:
    model, motion = case
    return model.inverse_dynamics(motion.q, motion.v, motion.a)


def contents(folder: Path) -> dict[str, bytes]:
    return {f.name: f.read_bytes() for f in sorted((folder / "cases").iterdir())}


# ------------------------------------------------------------------------------------------------------------ the cases


def test_a_grid_has_each_value_with_each():
    cases = sample(sweep_from(described(PAYLOAD, SPEED)))
    assert cases["speed"].tolist() == [0.5, 1.0] * 3
    assert cases[f"payload_{TOOL}"].tolist() == [0, 0, 1.5, 1.5, 3, 3]


def test_a_range_on_a_grid_is_evenly_spaced_and_as_long_as_a_sweep_may_be():
    steps = 10_000_000
    sweep = sweep_from(described({"kind": "speed", "from": 0.5, "to": 1.5, "steps": steps}))
    values = sweep.parameters[0].values
    assert (len(values), values[0], values[-1], sweep.cases) == (steps, 0.5, 1.5, steps)
    assert np.array_equal(sample(sweep)["speed"][:: steps // 10], [0.5 + i / (steps - 1) for i in range(0, steps, steps // 10)])
    few = sweep_from(described({"kind": "speed", "from": 0.5, "to": 1.5, "steps": 5}))
    assert list(few.parameters[0].values) == [0.5, 0.75, 1.0, 1.25, 1.5]
    assert parameters_described(few)[0]["values"] == [0.5, 0.75, 1.0, 1.25, 1.5]
    assert list(sweep_from(described({"kind": "speed", "from": 0.5, "to": 1.5, "steps": 1})).parameters[0].values) == [0.5]
    random = sweep_from(described({"kind": "speed", "from": 0.5, "to": 1.5}, sampling="latin hypercube", cases=2))
    assert [(p["lower"], p["upper"]) for of in (sweep_from(described(SPEED)), few, random) for p in parameters_described(of)] == [(0, 0), (0, 0), (0.5, 1.5)]


def test_a_latin_hypercube_uses_each_part_of_a_range_once():
    vary = ({"kind": "speed", "from": 0.5, "to": 1.5}, {"kind": "mass", "from": 0.9, "to": 1.1}, PAYLOAD)
    cases = sample(sweep_from(described(*vary, sampling="latin hypercube", cases=30, seed=7)))
    for name, lower, upper in (("speed", 0.5, 1.5), ("mass", 0.9, 1.1)):
        assert sorted(((cases[name] - lower) / (upper - lower) * 30).astype(int)) == list(range(30))
    assert [int((cases[f"payload_{TOOL}"] == m).sum()) for m in (0, 1.5, 3)] == [10, 10, 10]
    again = sample(sweep_from(described(*vary, sampling="latin hypercube", cases=30, seed=7)))
    other = sample(sweep_from(described(*vary, sampling="latin hypercube", cases=30, seed=8)))
    assert (again["speed"] == cases["speed"]).all() and (other["speed"] != cases["speed"]).any()


def test_speed_leaves_the_path_and_scales_what_motion_adds_with_its_square():
    v = variants({"kind": "speed", "values": [1.0, 2.0]})
    slow, fast = v.case({"speed": 1.0}), v.case({"speed": 2.0})
    assert (fast[1].q == slow[1].q).all() and (fast[1].time == slow[1].time / 2).all()
    held = slow[0].gravity_torque(slow[1].q)
    np.testing.assert_allclose(efforts(fast) - held, 4 * (efforts(slow) - held), atol=1e-11)
    for factor in (0.5, 0.9, 1.1):
        moved = v.case({"speed": factor})[1]
        assert (
            np.array_equal(moved.time, slow[1].time / factor)
            and moved.v == pytest.approx(slow[1].v * factor)
            and moved.a == pytest.approx(slow[1].a * factor**2)
        )
    assert fast[1].resolution == pytest.approx(2 * slow[1].resolution, rel=1e-15)
    by_spline = np.gradient(fast[1].q[:, 1], fast[1].time, edge_order=2)
    np.testing.assert_allclose(fast[1].v[:, 1], by_spline, atol=2e-3)


def test_a_payload_is_that_of_with_payload():
    _, motion = variants(PAYLOAD).case({f"payload_{TOOL}": 1.5})
    found = efforts(variants(PAYLOAD).case({f"payload_{TOOL}": 1.5}))
    expected = ksl.load(PANDA).with_payload(TOOL, 1.5, PAYLOAD["center"]).inverse_dynamics(motion.q, motion.v, motion.a)
    np.testing.assert_allclose(found, expected, atol=1e-12)


def test_a_tilt_is_gravity_seen_from_the_turned_base():
    case = variants({"kind": "tilt", "axis": [1, 0, 0], "values": [90]}).case({"tilt": 90})
    # the base turned by +90° about x: its z axis points along −y of the room, and gravity (room −z) along its −y
    expected = ksl.load(PANDA, gravity=[0, -9.81, 0])
    np.testing.assert_allclose(efforts(case), expected.inverse_dynamics(case[1].q, case[1].v, case[1].a), atol=1e-12)


@pytest.mark.parametrize("axis", [[0, 3, 0], [1, -2, 0.5]])
def test_gravity_is_turned_about_any_axis(axis):
    """Back by the angle of the mounting; the length of the axis counts for nothing."""
    expected = Rotation.from_rotvec(-np.radians(37) * np.array(axis) / np.linalg.norm(axis)).apply([0.0, 0.0, -9.81])
    assert variants({"kind": "tilt", "axis": axis, "values": [37]}).case({"tilt": 37})[0].gravity == pytest.approx(expected)


def test_a_factor_of_all_masses_is_one_of_all_efforts():
    v = variants({"kind": "mass", "values": [1.0, 1.25]})
    np.testing.assert_allclose(efforts(v.case({"mass": 1.25})), 1.25 * efforts(v.case({"mass": 1.0})), rtol=1e-12, atol=1e-12)


def test_a_shifted_centre_keeps_the_inertia_about_itself():
    model = ksl.load(PANDA)
    link = model.link("panda_link3")
    found = shifted(np.array(link.parameters), np.array([0.01, -0.02, 0.03]))
    m, c = link.mass, np.array(link.first_moment) / link.mass
    xx, yy, zz, xy, yz, zx = link.inertia
    about_origin = np.array([[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]])
    about_center = about_origin - m * (c @ c * np.eye(3) - np.outer(c, c))
    moved = model.with_parameters({link.name: (m, c + [0.01, -0.02, 0.03], about_center)}).link(link.name)
    np.testing.assert_allclose(found, moved.parameters, rtol=1e-12, atol=1e-14)


def test_centres_and_masses_of_a_link_together():
    """Moved along the axis by the value, whatever the length of the axis; the factor of the mass comes after."""
    link = ksl.load(PANDA).link("panda_link3")
    moved = variants({"kind": "center", "link": link.name, "axis": [0, 3, 4], "values": [0.05]}, {"kind": "mass", "link": link.name, "values": [2.0]})
    found, other = (moved.case({f"center_{link.name}": 0.05, f"mass_{link.name}": 2.0})[0].link(name) for name in (link.name, "panda_link4"))
    assert found.mass == 2 * link.mass and np.array(found.first_moment) / found.mass == pytest.approx(np.array(link.first_moment) / link.mass + [0, 0.03, 0.04])
    assert np.array_equal(other.parameters, ksl.load(PANDA).link("panda_link4").parameters)


@HERE
def test_motions_of_cases_are_simulated():
    how = {"until": 0.2, "pose": {"panda_joint2": 0.5, "panda_joint4": -1.5}}
    simulated = Variants(PANDA, sweep_from({"base": {"simulate": how}, "vary": [PAYLOAD]}))
    loaded = ksl.load(PANDA).with_payload(TOOL, 3.0, PAYLOAD["center"])
    model, motion = simulated.case({"payload_panda_flange": 3})
    q, v = motion.q[0], motion.v[0]
    assert np.allclose(motion.q, loaded.simulate(q, v, motion.time).q, atol=1e-8) and simulated.most_samples == len(motion.time) == 51
    with pytest.raises(ksl.SweepError, match="a simulated motion has the speed that its drives give it"):
        sweep_from({"base": {"simulate": how}, "vary": [PAYLOAD, SPEED]})
    with pytest.raises(ksl.SweepError, match=r"\[base\] simulate: unknown key 'untill'; did you mean 'until'"):
        sweep_from({"base": {"simulate": {"untill": 1.0}}, "vary": [PAYLOAD]})


@HERE
def test_rows_are_those_of_the_summary_to_the_bit(tmp_path):
    """Of a robot with mimic, fixed and sliding joints, with physics of joints: every number is that of `ksl loads`."""
    robot = tmp_path / "robot.urdf"
    robot.write_text(GRIPPER)
    motion = tmp_path / "close.csv"
    t = np.linspace(0, 1, 50)
    rows = np.column_stack([t, np.sin(3 * t), 0.02 * np.cos(5 * t)])
    motion.write_text("time,swing,finger\n" + "\n".join(",".join(map(repr, map(float, row))) for row in rows))
    tables = {"base": {"motion": str(motion), "physics": ["damping", "friction"]}, "vary": [{"kind": "speed", "values": [1.0, 1.7]}]}
    results = ksl.sweep(robot, tables, tmp_path / "out", workers=1)
    table = results.cases.to_table()
    assert table.num_rows == 2 * 5
    for number, factor in enumerate((1.0, 1.7)):
        model, moved = Variants(str(robot), sweep_from(tables)).case({"speed": factor})
        curves = Curves(LoadCase(model, moved))
        for block in curves.case.blocks():
            curves.add(block)
        found = [row for row in table.to_pylist() if row["case"] == number]
        for loads, row in zip(curves.loads, found, strict=True):
            expected = summarise(moved.time, loads)
            assert {name: row[name] for name in expected} == expected
            absent = {name for name, value in row.items() if value is None}
            assert not absent & expected.keys() and all(row[n] is not None for n in ("case", "speed", "joint", "kind"))


GRIPPER = """<robot name="gripper"><link name="base_link"/>
<link name="arm"><inertial><origin xyz="0.3 0 0.1"/><mass value="2"/><inertia ixx="0.01" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="left"><inertial><mass value="0.2"/><inertia ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="right"><inertial><mass value="0.2"/><inertia ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="pad"><inertial><mass value="0.1"/><inertia ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="swing" type="revolute"><parent link="base_link"/><child link="arm"/><axis xyz="0 0.6 0.8"/><dynamics damping="0.3" friction="0.5"/>
  <limit lower="-2" upper="1" effort="40" velocity="3"/></joint>
<joint name="finger" type="prismatic"><parent link="arm"/><child link="left"/><origin xyz="0.5 0 0"/><axis xyz="0 1 0"/>
  <limit lower="0" upper="0.04" effort="0" velocity="0.2"/></joint>
<joint name="follower" type="prismatic"><parent link="arm"/><child link="right"/><origin xyz="0.5 0 0"/><axis xyz="0 -1 0"/><mimic joint="finger" multiplier="0.8"/>
  <limit lower="0" upper="0.04" effort="10" velocity="0.2"/></joint>
<joint name="glue" type="fixed"><parent link="left"/><child link="pad"/><origin xyz="0.05 0 0"/></joint>
</robot>"""


@HERE
def test_shares_of_limits(tmp_path):
    """A limit of 0 is one that the file doesn't give."""
    robot = tmp_path / "robot.urdf"
    robot.write_text(GRIPPER)
    motion = tmp_path / "still.csv"
    motion.write_text("time,swing,finger\n" + "".join(f"{0.1 * i},-1.5,0.03\n" for i in range(8)))
    table = ksl.sweep(robot, {"base": {"motion": str(motion)}, "vary": [{"kind": "mass", "values": [1.0]}]}, tmp_path / "out", workers=1).cases.to_table()
    swing, finger = table.to_pylist()[:2]
    assert swing["position_share"] == pytest.approx(1.0 / 1.5) and finger["position_share"] == pytest.approx(0.5)
    assert swing["effort_share"] == swing["effort_peak"] / 40 and finger["effort_share"] is None


@pytest.mark.parametrize(
    ("lower", "upper", "at", "share"),
    [
        (None, 2.0, (-9.0, 1.0), 0.5), (None, 2.0, (0.0, 3.0), 1.5), (None, 0.5, (0.0, 0.75), 1.25), (None, -4.0, (-8.0, -2.0), 1.5), (-2.0, None, (-1.0, 9.0), 0.5), (-2.0, None, (-5.0, 0.0), 2.5),
        (0.25, None, (0.0, 1.0), 1.25), (5.0, None, (4.0, 9.0), 1.2), (-1.0, 3.0, (0.0, 2.5), 0.75), (-1.0, 3.0, (-2.0, 0.0), 1.5), (None, None, (-9.0, 9.0), None),
    ],
)  # fmt: skip
def test_shares_of_ranges(lower, upper, at, share):
    """Of a range, the way from its middle; of one bound, 1 and the distance from it in units of its size, or of 1 rad where it is smaller."""
    model = ksl.load_string(GRIPPER.replace('type="revolute"', 'type="continuous"').replace('lower="-2" upper="1" ', ""))
    joint = replace(model.joint("swing"), lower=lower, upper=upper, has_limits=True)
    rows = {"speed_peak": np.array([0.6]), "effort_peak": np.array([10.0])}
    peaks = Peaks(SimpleNamespace(joints=(joint,), joint_names=("swing",), loops=(), physics=(), drives=None, follower_names=()))
    peaks._add_shares(rows, np.array([[at[0], at[1], at[0]]]))
    assert {name: rows[name].tolist() for name in ("speed_share", "effort_share")} == {
        "speed_share": [pytest.approx(0.2)],
        "effort_share": [pytest.approx(0.25)],
    }
    assert rows["position_share"] == pytest.approx([np.nan if share is None else share], nan_ok=True)


def test_partitions_hold_all_cases_once():
    """About 5,000 rows each, and with wrenches 400,000 of these at most, unless the sweep says how many cases."""
    for cases, size in ((10, 4), (8, 4), (3, 4), (1, 1)):
        plan = Plan(PANDA, sweep_from(described({**SPEED, "values": [1.0 + k for k in range(cases)]})), size)
        assert [case for p in range(plan.partitions) for case in plan.cases(p)] == list(range(cases)) and all(
            0 < len(plan.cases(p)) <= size for p in range(plan.partitions)
        )
    joints, samples = len(ksl.load(PANDA).joints), len(read_motion(ksl.load(PANDA), PICK).time)
    plain, small = sweep_from(described(SPEED)), sweep_from(described(SPEED, partition=7))
    assert [_plan(PANDA, given, wrenches)[0].size for given in (plain, small) for wrenches in (False, True)] == [
        5000 // joints,
        400_000 // (joints * samples),
        7,
        7,
    ]
    assert (again_of(0), again_of(1), again_of(2)) == (
        "",
        *(f", {words} again, since files had other contents when they were computed" for words in ("1 partition", "2 partitions")),
    )


def test_lengths_in_millimetres_are_doubted():
    """Payloads and shifts beyond twice the robot's extent, wherever the value stands."""
    reach = variants(SPEED).extent
    assert reach == pytest.approx(extent(ksl.load(PANDA)))
    for share, doubted in ((1.99, False), (2.01, True)):
        x = share * reach
        sweeps = [
            described({**PAYLOAD, "center": [0, 0.6 * x, -0.8 * x]}), described({"kind": "center", "link": TOOL, "axis": [0, 0, 1], "values": [0, -x, 0.1]}),
            described({"kind": "center", "link": TOOL, "axis": [0, 0, 1], "from": -x, "to": 0.1, "steps": 3}), described({"kind": "center", "link": TOOL, "axis": [0, 0, 1], "from": 0, "to": x, "steps": 3}),
            described({"kind": "center", "link": TOOL, "axis": [0, 0, 1], "from": -x, "to": 0.1}, sampling="latin hypercube", cases=3),
        ]  # fmt: skip
        for tables in sweeps:
            found = Variants(PANDA, sweep_from(tables)).doubts()
            assert [f"parameter {sweep_from(tables).parameters[0].name}:" in line and "are these millimetres?" in line for line in found] == [True] * doubted
    assert "m/s²" in Variants(PANDA, sweep_from({"base": {"motion": PICK, "gravity": [0, 0, -9810.0]}, "vary": [SPEED]})).doubts()[0]


# ------------------------------------------------------------------------------------------ engines, resuming, lost workers


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory) -> dict[str, bytes]:
    folder = tmp_path_factory.mktemp("undisturbed")
    ksl.sweep(PANDA, many(), folder, workers=2)
    return contents(folder)


def many(steps: int = 8, partition: int = 4) -> dict:
    return described({**PAYLOAD, "values": [0.0, 0.5, 1.0, 1.5, 2.0]}, {"kind": "speed", "from": 0.5, "to": 1.2, "steps": steps}, partition=partition)


def workers(words: str) -> list[int]:
    """Processes whose command line has these words, and this test's own mark in their environment: nobody else's."""
    found = []
    for entry in Path("/proc").iterdir():
        try:
            if words in (entry / "cmdline").read_text().replace("\0", " ") and mark() in (entry / "environ").read_bytes().decode(errors="replace"):
                found.append(int(entry.name))
        except (OSError, ValueError):  # it has ended, or is no process
            continue
    return found


def mark() -> str:
    """Of this process: copies of it may run the same tests."""
    return f"KSL_TEST_OF={os.getpid()}."


@pytest.fixture(autouse=True)
def marked(monkeypatch):
    monkeypatch.setenv(*mark().split("="))


def killing(words: str):
    """A progress that kills one worker at work, after the first partition.  It waits for one; the deadline ends a wait in vain."""
    killed = []

    def progress(done: int, cases: int) -> None:
        until = time.monotonic() + 60
        while done and not killed:
            assert time.monotonic() < until, f"no process of {words}"
            if found := workers(words):
                os.kill(found[0], signal.SIGKILL)
                killed.append(found[0])

    return progress, killed


def test_one_worker_more_or_less_changes_no_bit(tmp_path, undisturbed, monkeypatch):
    """Nor does a robot that is given as a model; and no pipe of a worker is left to the garbage collector, which would warn of it."""
    started, popen = [], subprocess.Popen
    monkeypatch.setattr(local.subprocess, "Popen", lambda *a, **how: started.append(popen(*a, **how)) or started[-1])
    results = ksl.sweep(ksl.load(PANDA), many(), tmp_path, workers=1)
    assert results.computed == 40 and len(undisturbed) == 10
    for name, content in undisturbed.items():  # their metadata say from what they were computed: here a model, there a file
        assert parquet.read_table(tmp_path / "cases" / name).equals(parquet.read_table(io.BytesIO(content)))
    assert len(started) == 1 and started[0].stdin.closed and started[0].stdout.closed and started[0].returncode is not None


def test_a_worker_that_dies_costs_its_partition_only(tmp_path, undisturbed):
    progress, killed = killing("ksl.sweeps.worker")
    results = ksl.sweep(PANDA, many(), tmp_path, workers=2, progress=progress)
    assert killed and results.computed == 40 and contents(tmp_path) == undisturbed
    assert not workers("ksl.sweeps.worker")


def test_on_ray_the_bits_are_the_same_and_a_lost_worker_costs_its_partition_only(tmp_path):
    pytest.importorskip("ray")
    tables = many(steps=80, partition=50)
    ksl.sweep(PANDA, tables, tmp_path / "local", workers=2)
    kill, killed = killing("ray::evaluate")
    handlers = [signal.getsignal(signal.SIGTERM)]

    def progress(done: int, cases: int) -> None:
        handlers.append(signal.getsignal(signal.SIGTERM))
        kill(done, cases)

    results = ksl.sweep(PANDA, tables, tmp_path / "ray", workers=2, engine="ray", progress=progress)
    assert len(handlers) > 1 and len(set(handlers)) == 1  # so that `ksl sweep` ends by its own
    assert killed and results.computed == 400 and contents(tmp_path / "ray") == contents(tmp_path / "local")


@dataclass(eq=False)
class Task:
    function: Callable
    plan: Plan
    partition: int


class Cluster:
    """What `ray` is for ksl.sweeps.on_ray, in this process: a task is computed when it is waited for, the last one first."""

    exceptions = SimpleNamespace(**{name: type(name, (Exception,), {}) for name in ("WorkerCrashedError", "OutOfMemoryError", "RayError")})

    def __init__(self, cpus, fault=None):
        self.cpus, self.fault, self.most, self.ended, self.options = cpus, fault, 0, 0, None

    def is_initialized(self):
        return False

    def init(self, **options):
        self.options = options

    def shutdown(self):
        self.ended += 1

    def remote(self, **options):
        self.options |= options
        return lambda function: SimpleNamespace(remote=lambda plan, partition: Task(function, plan, partition))

    def put(self, x):
        return x

    def cluster_resources(self):
        return {"CPU": self.cpus}

    def wait(self, running, num_returns):
        self.most = max(self.most, len(running))
        return running[-num_returns:], running[:-num_returns]

    def get(self, task):
        if self.fault is not None and task.partition == 3:
            raise self.fault
        return task.function(task.plan, task.partition)


@pytest.mark.parametrize(("cpus", "workers", "at_once"), [(1, 1, 2), (1, 2, 4), (3, 2, 6), (16, 1, 10)])
def test_a_cluster_computes_all_partitions(monkeypatch, cpus, workers, at_once):
    """Twice as many at once as there are processors, or workers; each partition once, and the cluster that was begun is ended."""
    cluster = Cluster(cpus)
    monkeypatch.setitem(sys.modules, "ray", cluster)
    plan = Plan(PANDA, sweep_from(many()), 4)
    results = list(on_ray.compute(plan, range(10), workers, None))
    assert sorted(r.partition for r in results) == list(range(10)) and cluster.most == at_once and cluster.ended == 1
    assert cluster.options["num_cpus"] == 1 and cluster.options["max_retries"] == 2 and cluster.options["address"] == "local"
    here = Evaluator(plan)
    assert all(r.files == here.partition(r.partition).files for r in results[:2])


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        ("WorkerCrashedError", "the worker of cases 12 to 15 has died 3 times"),
        ("OutOfMemoryError", "the worker of cases 12 to 15 has died"),
        ("RayError", "cases 12 to 15: the Ray cluster answers: of the cluster; check that KSL"),
    ],
)
def test_faults_of_a_cluster_are_said(monkeypatch, fault, words):
    cluster = Cluster(1, getattr(Cluster.exceptions, fault)("first line\nof the cluster"))
    monkeypatch.setitem(sys.modules, "ray", cluster)
    with pytest.raises(ksl.SweepError, match=words):
        list(on_ray.compute(Plan(PANDA, sweep_from(many()), 4), range(10), 1, None))
    assert cluster.ended == 1


def test_what_was_interrupted_goes_on(tmp_path, undisturbed):
    def interrupt(done: int, cases: int) -> None:
        if done >= 8:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        ksl.sweep(PANDA, many(), tmp_path, workers=2, progress=interrupt)
    complete = contents(tmp_path)
    assert len(complete) == 2 and not (tmp_path / "worst.csv").exists() and not workers("ksl.sweeps.worker")
    (tmp_path / "cases" / ".part-000009.parquet.part").write_bytes(b"of a run that was killed")
    results = ksl.sweep(PANDA, many(), tmp_path, workers=1)
    assert results.computed == 32 and contents(tmp_path) == undisturbed


@HERE
def test_the_worst_cases_are_those_of_the_table(tmp_path):
    """Of all joints and quantities, from ten partitions: the largest value, and the first case that has it."""
    results = ksl.sweep(PANDA, many(), tmp_path, workers=1)
    table = sorted(results.cases.to_table().to_pylist(), key=lambda row: row["case"])
    rows = {(row["joint"], row["quantity"]): row for row in results.worst}
    quantities = [name for name in table[0] if name.endswith(("_peak", "_rms", "_share")) and not name.endswith("_at_peak")]  # of the peak, not the largest
    assert len(results.worst) == len(rows) > 100 and 0 < results.share_of_dynamics < 1
    for joint in {row["joint"] for row in table}:
        for quantity in quantities:
            there = [row for row in table if row["joint"] == joint and row[quantity] is not None]
            assert ((joint, quantity) in rows) == bool(there)
            if there:
                worst, found = max(there, key=lambda row: row[quantity]), rows[joint, quantity]
                assert (found["value"], found["case"], found["speed"], found["payload_panda_flange"]) == (
                    worst[quantity],
                    worst["case"],
                    worst["speed"],
                    worst["payload_panda_flange"],
                )
    assert (tmp_path / "worst.csv").read_text().startswith("joint,quantity,value,unit,case,payload_panda_flange,speed\n")


@HERE
def test_a_sweep_of_a_closed_mechanism_says_the_same_as_one_run(tmp_path):
    """With what rigid bodies leave open, in rows and worst cases."""
    fourbar, time = ksl.load_string(FOURBAR, drives=["A"]), np.linspace(0, 2, 201)
    np.savetxt(
        tmp_path / "crank.csv", np.column_stack([time, np.pi * (time - np.sin(np.pi * time) / np.pi)]), delimiter=",", header="time,A", comments="", fmt="%.17g"
    )
    sweep = {"base": {"motion": str(tmp_path / "crank.csv")}, "vary": [{"kind": "payload", "link": "rocker", "values": [0.0, 1.0]}]}
    results = ksl.sweep(fourbar, sweep, tmp_path / "swept", workers=1)
    run = ksl.compute_loads(fourbar, tmp_path / "crank.csv", payloads={"rocker": (1.0, (0, 0, 0))})
    swept = {row["joint"]: row for row in results.cases.to_table().to_pylist() if row["case"] == 1}
    assert list(swept) == ["A", "B", "D", "base", "C"]
    for row in run.rows:
        same = {k: x for k, x in row.items() if k not in ("case", "joint", "kind", "undetermined")}
        assert all(swept[row["joint"]][k] == row[k] for k in ("kind", "undetermined"))
        assert {k: swept[row["joint"]][k] for k in same} == pytest.approx(same, rel=1e-12), row["joint"]
    for row in results.worst:
        words = swept[row["joint"]]["undetermined"].split()
        assert row["undetermined"] == ("yes" if row["quantity"].rpartition("_")[0] in words else "no")
    assert {row["undetermined"] for row in results.worst} == {"yes", "no"}


@HERE
def test_what_a_sweep_says_of_its_time(tmp_path, monkeypatch):
    """By a clock that goes on by a second whenever it is looked at: twice for each case, and twice for each partition."""
    clock = SimpleNamespace(perf_counter=map(float, range(10**6)).__next__)
    monkeypatch.setattr("ksl.sweeps.evaluate.time", clock)
    monkeypatch.setattr("ksl.sweeps.compute_sweep.time", SimpleNamespace(perf_counter=iter([100.0, 107.5, 200.0, 201.0]).__next__))
    results = ksl.sweep(PANDA, many(steps=2, partition=3), tmp_path, workers=1)
    assert (results.seconds, results.share_of_dynamics) == (7.5, pytest.approx(10 / (2 * 10 + 4)))
    again = ksl.sweep(PANDA, many(steps=2, partition=3), tmp_path, workers=1)
    assert (again.seconds, again.share_of_dynamics, again.computed) == (1.0, 0.0, 0)


@HERE
def test_wrenches_on_request(tmp_path):
    results = ksl.sweep(PANDA, described(SPEED), tmp_path, workers=1, wrenches=True)
    table = parquet.read_table(tmp_path / "wrenches" / "part-000000.parquet")
    samples = len(read_motion(ksl.load(PANDA), PICK).time)
    assert table.num_rows == 2 * samples * len(ksl.load(PANDA).joints) and results.computed == 2
    rows = zip(table["effort"].to_pylist(), table["joint"].to_pylist(), table["case"].to_pylist())
    effort = np.array([e for e, joint, case in rows if joint == "panda_joint4" and case == 0])
    assert np.abs(effort).max() == results.cases.to_table().to_pylist()[3]["effort_peak"]


@HERE
def test_utilisations_are_those_of_sizing_each_case(tmp_path):
    components = str(EXAMPLES / "components" / "panda.toml")
    tables = {"base": {"motion": PICK, "components": components}, "vary": [PAYLOAD]}
    results = ksl.sweep(PANDA, tables, tmp_path, workers=1)
    rows = results.cases.to_table().to_pylist()
    for case, mass in enumerate(PAYLOAD["values"]):
        sizing = ksl.size(ksl.compute_loads(PANDA, PICK, payloads={TOOL: (mass, PAYLOAD["center"])}), components)
        for row in (r for r in rows if r["case"] == case):
            found = [f for f in sizing.figures if f.joint == row["joint"] and f.utilisation is not None]
            assert (row["utilisation"], row["utilisation_of"]) == (
                (None, None) if not found else (pytest.approx(found[0].utilisation, rel=1e-9), f"{found[0].component}: {found[0].figure}")
            )
    worst = max((row for row in rows if row["utilisation"]), key=lambda row: row["utilisation"])
    assert max(r["value"] for r in results.worst if r["quantity"] == "utilisation") == worst["utilisation"]
    assert "sha256" in (tmp_path / "sweep.json").read_text() and "panda.toml" in (tmp_path / "sweep.json").read_text()


@HERE
@pytest.mark.parametrize("spectrum", ["[cases]\npick = 3\nidle = 0", "[shares]\npick = 0.7\nidle = 0.3"])
def test_one_file_of_components_serves_a_motion_and_a_sweep(tmp_path, spectrum):
    """Its spectrum is that of load cases, and is left out with a note."""
    (tmp_path / "c.toml").write_text(f'{spectrum}\n[[component]]\njoint = "panda_joint2"\nkind = "limits"\ntorque = 80\n')
    tables = {"base": {"motion": PICK, "components": str(tmp_path / "c.toml")}, "vary": [{"kind": "speed", "values": [1.0]}]}
    which, named = spectrum[: spectrum.index("]") + 1].replace("[", r"\[").replace("]", r"\]"), "it names pick, idle, and these are results of"
    with pytest.warns(ksl.DescriptionWarning, match=rf"{which} is left out: {named} a sweep"):
        swept = ksl.sweep(PANDA, tables, tmp_path / "out", workers=1)
    sizing = ksl.size(ksl.compute_loads(PANDA, PICK), tmp_path / "c.toml")
    assert any(f"is left out: {named} one case, panda_pick" in note for note in sizing.notes)
    assert [row["utilisation"] for row in swept.cases.to_table().to_pylist() if row["joint"] == "panda_joint2"] == pytest.approx(
        [sizing.worst.utilisation], rel=1e-9
    )


@HERE
def test_metadata_say_units_and_parameters(tmp_path):
    results = ksl.sweep(PANDA, described({**PAYLOAD, "values": np.array([0.0, 2.0])}), tmp_path, workers=1)
    said = json.loads(results.cases.to_table().schema.metadata[b"ksl"])
    assert said["robot"] == "panda" and said["parameters"][0]["unit"] == "kg" and "N m" in said["units"] and "first sample" in said["conventions"]
    units = {row["quantity"]: row["unit"] for row in results.worst if row["joint"] == "panda_joint2"}
    assert (units["effort_peak"], units["power_peak"], units["speed_share"]) == ("N m", "W", "")
    assert repr(results).startswith("<ksl sweep in ") and "of a limit" in repr(results) and len(repr(results)) < 250


@HERE
def test_motions_are_read_as_the_base_says(tmp_path, monkeypatch):
    """Degrees and a map, by names relative to the description, from wherever the sweep is started."""
    motion = ksl.read_motion(ksl.load(PANDA), PICK)
    names = [f"j{i}" for i in range(1, 8)]
    rows = np.column_stack([motion.time, np.degrees(motion.q)])
    (tmp_path / "in").mkdir()
    np.savetxt(tmp_path / "in" / "pick.csv", rows, delimiter=",", header=",".join(["time", *names]), comments="", fmt="%.17g")
    (tmp_path / "in" / "map.toml").write_text("[columns]\n" + "".join(f'j{i} = "panda_joint{i}"\n' for i in range(1, 8)))
    vary = '[[vary]]\nkind = "motion"\nvalues = ["pick.csv"]\n'
    (tmp_path / "in" / "sweep.toml").write_text(f'[base]\nreading = {{ degrees = true, map = "map.toml" }}\n{vary}')
    monkeypatch.chdir(tmp_path)
    row = ksl.sweep(PANDA, Path("in") / "sweep.toml", "out", workers=1).cases.to_table().to_pylist()[1]
    expected = ksl.sweep(PANDA, described({"kind": "speed", "values": [1]}), "other", workers=1).cases.to_table().to_pylist()[1]
    assert row["motion"] == "pick.csv" and row["effort_peak"] == pytest.approx(expected["effort_peak"], rel=1e-6)
    (tmp_path / "in" / "map.toml").write_text((tmp_path / "in" / "map.toml").read_text() + "\n")
    with pytest.raises(ksl.SweepError, match="holds another sweep"):
        ksl.sweep(PANDA, Path("in") / "sweep.toml", "out", workers=1)


# -------------------------------------------------------------------------------------------------------------- mistakes


def test_a_fault_of_a_worker_is_said_at_once(monkeypatch):
    def fault(self, index):
        raise TypeError("of KSL")

    monkeypatch.setattr(Evaluator, "partition", fault)
    answer = on_ray.evaluate(Plan(PANDA, sweep_from(described(SPEED)), 1), 0)
    assert isinstance(answer, ksl.SweepError) and "fault in KSL: TypeError: of KSL (" in str(answer)


@HERE
def test_damaged_and_unknown_partitions(tmp_path):
    ksl.sweep(PANDA, described(SPEED), tmp_path, workers=1)
    part = tmp_path / "cases" / "part-000000.parquet"
    whole = part.read_bytes()
    part.write_bytes(whole[:-100])
    with pytest.raises(ksl.SweepError, match="part-000000.parquet: is damaged; remove it"):
        ksl.sweep(PANDA, described(SPEED), tmp_path, workers=1)
    part.write_bytes(whole)
    table = parquet.read_table(part)
    parquet.write_table(table.set_column(table.schema.get_field_index("joint"), "joint", damaged_text(table.column("joint").to_pylist())), part)
    with pytest.raises(ksl.SweepError, match="part-000000.parquet: is damaged; remove it"):
        ksl.sweep(PANDA, described(SPEED), tmp_path, workers=1)
    part.unlink()
    assert ksl.sweep(PANDA, described(SPEED), tmp_path, workers=1).computed == 2 and part.read_bytes() == whole
    (tmp_path / "sweep.json").unlink()
    for content in ("{}", '["fingerprint"]', "3", "{"):
        (tmp_path / "sweep.json").write_text(content)
        with pytest.raises(ksl.SweepError, match="sweep.json: is not the description of a sweep"):
            ksl.sweep(PANDA, described(SPEED), tmp_path, workers=1)
    (tmp_path / "sweep.json").unlink()
    with pytest.raises(ksl.SweepError, match="sweep.json beside it is missing"):
        ksl.sweep(PANDA, described(PAYLOAD), tmp_path, workers=1)


@pytest.mark.parametrize("workers", [0, -1, "2", 1.5])
def test_a_number_of_processes_that_is_none(tmp_path, workers):
    with pytest.raises(ksl.SweepError, match="expected a number of processes, at least 1"):
        ksl.sweep(PANDA, described(SPEED), tmp_path / "out", workers=workers)


@HERE
def test_a_folder_that_cannot_be_written(tmp_path):
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(OSError, match="file: is no folder, so results can't be written there; move it away"):
        ksl.sweep(PANDA, described(SPEED), tmp_path / "file", workers=1)
    full = OSError(errno.ENOSPC, "No space left on device")
    with pytest.MonkeyPatch.context() as m, pytest.raises(OSError, match=r"can't be written there \(No space left on device\); free some space"):
        m.setattr("ksl.output.parts.flush", lambda *_: (_ for _ in ()).throw(full))
        ksl.sweep(PANDA, described(SPEED), tmp_path / "out", workers=1)
    assert not list((tmp_path / "out").rglob("*.part"))


@HERE
def test_results_of_another_sweep_are_kept_unless_forced(tmp_path):
    ksl.sweep(PANDA, described(SPEED), tmp_path, workers=1)
    before = contents(tmp_path)
    with pytest.raises(ksl.SweepError, match=r"holds another sweep \(.*--force to replace"):
        ksl.sweep(PANDA, described(PAYLOAD), tmp_path, workers=1)
    assert contents(tmp_path) == before
    assert ksl.sweep(PANDA, described(PAYLOAD), tmp_path, workers=1, force=True).computed == 3
    assert ksl.sweep(PANDA, described(PAYLOAD, seed=5), tmp_path, workers=1).computed == 0, "a grid has no seed"
    random = {"kind": "speed", "from": 0.5, "to": 1.0}
    ksl.sweep(PANDA, described(random, sampling="latin hypercube", cases=2), tmp_path / "random", workers=1)
    with pytest.raises(ksl.SweepError, match=r"holds another sweep \(with other cases\)"):
        ksl.sweep(PANDA, described(random, sampling="latin hypercube", cases=2, seed=5), tmp_path / "random", workers=1)


@pytest.mark.parametrize(
    ("tables", "words"),
    [
        ({"vary": [SPEED]}, "give the motion once"),
        (described(SPEED, seed=-1), "seed = -1; expected a whole number"),
        (described(SPEED, cases=True, sampling="latin hypercube"), "cases = True; expected a whole number"),
        (described({**SPEED, "values": [True]}), "values has True; expected finite numbers"),
        (described({**SPEED, "values": [np.inf]}), "values has inf; expected finite numbers"),
        (described({"kind": "mass", "values": [-0.1]}), "a mass can't be negative"),
        (described({"kind": "tilt", "axis": [0, 1], "values": [1]}), "expected three finite numbers"),
        (described({"kind": "tilt", "axis": [0, True, 1], "values": [1]}), "expected three finite numbers"),
        (described({"kind": "speed", "from": 1, "to": 2, "steps": 0}), "needs `steps`"),
        (described({"kind": "speed", "from": 1, "to": 2, "steps": 10_000_001}), "at most 10,000,000"),
        (described({"kind": "mass", "values": [1, 2, 3]}, {"kind": "speed", "from": 1, "to": 2, "steps": 3_333_334}), "10,000,002 cases; at most 10,000,000"),
        (described({"kind": "speed", "from": 1, "to": 1}, sampling="latin hypercube", cases=3), "no range"),
        (described({"kind": "speed", "from": 1, "to": 2, "steps": 3}, sampling="latin hypercube", cases=3), "leave `steps` out"),
        (described({**SPEED, "steps": 2}), "has `values` and a range"),
        (described({**SPEED, "values": []}), "expected a list"),
        (described({**SPEED, "name": "joint"}), "expected a name for its column"),
        (described({**SPEED, "name": ""}), "expected a name for its column"),
        ({"base": {"motion": 3}, "vary": [SPEED]}, "motion = 3; expected the name of a file"),
        ({"base": {"motion": PICK, "stiffness": 3}, "vary": [SPEED]}, "stiffness = 3; expected the name of a file"),
        (described(), "nothing to vary"),
        (described({"kind": "sped", "values": [1]}), "did you mean 'speed'"),
        (described({**SPEED, "value": [1]}), "unknown key 'value'; did you mean 'values'"),
        (described({"kind": "speed", "values": [0]}), "speed factor 0"),
        (described({"kind": "speed", "from": 1, "to": 2}), "`steps`"),
        (described({"kind": "speed", "from": 1}), "`to` is missing"),
        (described({"kind": "speed", "from": 2, "to": 1}, sampling="latin hypercube", cases=3), "no range"),
        (described(SPEED, sampling="latin hypercube"), "needs `cases`"),
        (described(SPEED, sampling="random"), "sampling = 'random'"),
        (described(SPEED, SPEED), "two parameters are named 'speed'"),
        (described({"kind": "payload", "values": [1]}), "`link` is missing"),
        (described({"kind": "payload", "link": "panda_flang", "values": [1]}), "did you mean 'panda_flange'"),
        (described({"kind": "payload", "link": TOOL, "values": [-1]}), "can't be negative"),
        (described({"kind": "tilt", "values": [1]}), "`axis` is missing"),
        (described({"kind": "tilt", "axis": [0, 0, 0], "values": [1]}), "no direction"),
        (described({"kind": "mass", "values": ["heavy"]}), "finite numbers"),
        (described({"kind": "speed", "from": 1, "to": 2, "steps": 20_000_000}), "at most 10,000,000"),
        (described({"kind": "motion", "values": ["nowhere.csv"]}), "give the motion once"),
        ({"vary": [{"kind": "motion", "values": ["nowhere.csv"]}]}, "nowhere.csv"),
        (described({"kind": "speed", "values": [1e200]}), "case 0: speed = 1e"),
        ({**described(SPEED), "base": {"motion": PICK, "gravety": [0, 0, 0]}}, "did you mean 'gravity'"),
        ({**described(SPEED), "base": {"motion": PICK, "reading": {"degree": True}}}, "did you mean 'degrees'"),
        ({**described(SPEED), "base": {"motion": PICK, "reading": {"degrees": "yes"}}}, "degrees is 'yes'; expected true or false"),
        ({**described(SPEED), "base": {"motion": PICK, "reading": {"smooth": "20"}}}, "expected a number"),
        ({**described(SPEED), "base": {"motion": PICK, "components": "nowhere.toml"}}, "nowhere.toml: can't be read"),
        (described({**SPEED, "name": "effort_peak"}), "named like a column of the results"),
        ({**described(SPEED), "base": {"motion": PICK, "physics": ["dampin"]}}, r"\[base\]"),
    ],
)
def test_mistakes_are_named_before_anything_is_written(tmp_path, tables, words):
    with pytest.raises(ValueError, match=words):
        ksl.sweep(PANDA, tables, tmp_path / "out", workers=1)
    assert not (tmp_path / "out").exists()


def test_robots_and_descriptions_that_are_none(tmp_path):
    with pytest.raises(ksl.SweepError, match="robot is int; expected a ksl.Model, or the name of a file"):
        ksl.sweep(7, described(SPEED), tmp_path)
    with pytest.raises(ksl.SweepError, match="description is int; expected a TOML file"):
        ksl.sweep(PANDA, 5, tmp_path)


@HERE
def test_a_model_in_place_of_a_file(tmp_path):
    """What a file and its [base] give, a model gives: gravity, physics; the folder knows it again, and another one too."""
    m = ksl.load(PANDA, payloads={TOOL: (1.0, (0, 0, 0.1))})
    tables = described(PAYLOAD) | {"base": {"motion": PICK, "gravity": [0, 0, -1.62]}}
    results = ksl.sweep(m, tables, tmp_path / "m")
    found = results.cases.to_table()
    same = ksl.sweep(ksl.load(PANDA, payloads={TOOL: (1.0, (0, 0, 0.1))}, gravity=(0, 0, -1.62)), described(PAYLOAD), tmp_path / "n")
    assert found.equals(same.cases.to_table()) and ksl.sweep(m, tables, tmp_path / "m").computed == 0
    with pytest.raises(ksl.SweepError, match="holds another sweep"):
        ksl.sweep(m.with_payload(TOOL, 0.5), tables, tmp_path / "m")
    with pytest.raises(ksl.SweepError, match=r"\[base\] mimic: the robot is a ksl.Model, which has been loaded already"):
        ksl.sweep(m, tables | {"base": {"motion": PICK, "mimic": "coupled"}}, tmp_path / "o")


def command(*arguments) -> subprocess.CompletedProcess:
    return subprocess.run([sys.executable, "-m", "ksl", "sweep", *map(str, arguments)], capture_output=True, text=True, timeout=120)


def test_the_command(tmp_path):
    (tmp_path / "sweep.toml").write_text(f'[base]\nmotion = "{PICK}"\n[[vary]]\nkind = "speed"\nvalues = [0.5, 1.0]\n')
    done = command(PANDA, tmp_path / "sweep.toml", "-o", tmp_path / "out", "--workers", 1)
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert lines[0].split() == ["joint", "limit", "of", "share", "in", "case"] and "2 cases computed" in done.stdout
    assert max(len(line) for line in lines if "written to" not in line) <= 80
    assert "0 cases computed" in run_ksl("sweep", PANDA, tmp_path / "sweep.toml", "-o", tmp_path / "out").stdout
    broken = tmp_path / "broken.toml"
    broken.write_text("[base\n")
    for arguments, words in (
        ((PANDA, broken), "is not TOML"),
        ((PANDA, tmp_path / "none.toml"), "can't be read"),
        ((PANDA, tmp_path / "sweep.toml", "--engine", "slurm"), "local"),
    ):
        done = run_ksl("sweep", *arguments, "-o", tmp_path / "other")
        assert done.returncode == 2 and words in done.stderr and done.stderr.count("\n") == 1 and not (tmp_path / "other").exists()


def test_a_ray_cluster_out_of_reach(tmp_path):
    pytest.importorskip("ray")
    with pytest.raises(ksl.SweepError, match="out of reach"):
        ksl.sweep(PANDA, described(SPEED), tmp_path, workers=1, engine="ray", address="127.0.0.1:1")


# --------------------------------------------------------------------------------------------------- inputs that are replaced


def with_copies(tmp_path):
    """Robot and motion of their own, and a sweep of them in four partitions."""
    robot, motion = tmp_path / "panda.urdf", tmp_path / "pick.csv"
    robot.write_bytes(Path(PANDA).read_bytes())
    motion.write_bytes(Path(PICK).read_bytes())
    tables = {"sweep": {"partition": 1}, "base": {"motion": str(motion)}, "vary": [{"kind": "speed", "values": [0.4, 0.6, 0.8, 1.0]}]}
    return robot, motion, tables


def faster(motion):
    """Another motion at the same path."""
    lines = motion.read_text().splitlines()
    other = motion.with_name("other.csv")
    other.write_text("\n".join([lines[0], *(f"{0.5 * float(line.split(',', 1)[0])},{line.split(',', 1)[1]}" for line in lines[1:])]) + "\n")
    os.replace(other, motion)


@pytest.mark.parametrize("which", ["motion", "robot"])
def test_a_file_that_is_replaced_during_a_sweep_is_refused(tmp_path, monkeypatch, which):
    """A worker that starts after it reads other contents: no partition is computed from them."""
    from ksl.sweeps import local

    robot, motion, tables = with_copies(tmp_path)

    def compute(plan, partitions, workers):
        for k, partition in enumerate(partitions):
            if k == 2:
                faster(motion) if which == "motion" else robot.write_text(robot.read_text().replace('mass value="', 'mass value="1'))
            yield Evaluator(plan).partition(partition)

    monkeypatch.setattr(local, "compute", compute)
    with pytest.raises(ksl.SweepError, match=f"{(motion if which == 'motion' else robot).name}: has changed since the sweep began"):
        ksl.sweep(robot, tables, tmp_path / "out")
    assert len(contents(tmp_path / "out")) == 2
    with pytest.raises(ksl.SweepError, match=f"holds another sweep .of other files: {(motion if which == 'motion' else robot).name} had other contents"):
        ksl.sweep(robot, tables, tmp_path / "out")


@HERE
def test_partitions_carry_the_hashes_they_were_computed_from(tmp_path, capsys):
    """Those of other contents are computed again, and that is said."""
    robot, motion, tables = with_copies(tmp_path)
    ksl.sweep(robot, tables, tmp_path / "old")
    right = contents(tmp_path / "old")
    for file in sorted((tmp_path / "old" / "cases").iterdir()):
        said = json.loads(parquet.read_schema(file).metadata[b"ksl"])["inputs"]
        assert [(f["role"], f["file"]) for f in said] == [("robot", "panda.urdf"), ("motion", "pick.csv")] and all(len(f["sha256"]) == 64 for f in said)
    faster(motion)
    ksl.sweep(robot, tables, tmp_path / "new")
    name = sorted(right)[1]
    (tmp_path / "new" / "cases" / name).write_bytes(right[name])  # a mixture, as an earlier version left it
    again = ksl.sweep(robot, tables, tmp_path / "new")
    assert again.computed == 1 and again.replaced == 1 and "1 partition again, since files had other contents" in repr(again)
    assert (tmp_path / "new" / "cases" / name).read_bytes() != right[name]
    whole = ksl.sweep(robot, tables, tmp_path / "new")
    assert whole.computed == 0 and whole.replaced == 0


@HERE
def test_results_of_other_files_are_not_sized_together(tmp_path):
    from ksl.sizing.results import read_results

    robot, motion, tables = with_copies(tmp_path)
    ksl.sweep(robot, tables, tmp_path / "old", wrenches=True)
    faster(motion)
    ksl.sweep(robot, tables, tmp_path / "new", wrenches=True)
    (tmp_path / "new/wrenches/part-000001.parquet").write_bytes((tmp_path / "old/wrenches/part-000001.parquet").read_bytes())
    with pytest.raises(ksl.SizingError, match=r"part-000001.parquet: was computed from other files than part-000000.parquet"):
        read_results(tmp_path / "new")
