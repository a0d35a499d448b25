"""ksl.sweep: the cases are what the description says, and each equals a load case of its own."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import ksl
from described_sweeps import HERE, PANDA, PAYLOAD, PICK, SPEED, TOOL, described, efforts, variants
from ksl.load_cases.curves import Curves
from ksl.load_cases.load_case import LoadCase
from ksl.load_cases.quantities import summarise
from ksl.mechanism.lengths import extent
from ksl.motions.reading import read_motion
from ksl.sweeps.compute_sweep import _plan, again_of
from ksl.sweeps.description import described as parameters_described
from ksl.sweeps.description import sweep_from
from ksl.sweeps.evaluate import Plan
from ksl.sweeps.joint_summaries import Peaks
from ksl.sweeps.sampling import sample
from ksl.sweeps.variants import Variants, shifted


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
    heavy = sweep_from({"base": {"motion": PICK}, "vary": [{"kind": "payload", "link": "panda_flange", "values": [0.0, 1500.0]}]})
    assert "the payload has up to 1500 kg" in (line := Variants(PANDA, heavy).doubts()[0]) and "in grams?" in line


def test_doubts_of_the_motions_are_those_of_the_sweep(tmp_path):
    """Noise, gaps and units that `ksl loads` doubts; and what a simulated motion lacks."""
    rows = np.genfromtxt(PICK, delimiter=",", names=True)
    np.savetxt(tmp_path / "noisy.csv", np.array(rows.tolist()), delimiter=",", header=",".join(rows.dtype.names), comments="", fmt="%.3f")
    with pytest.warns(ksl.DescriptionWarning, match=r"noisy\.csv: positions of panda_joint\d are rounded to 0\.001 rad"):
        ksl.sweep(PANDA, {"base": {"motion": str(tmp_path / "noisy.csv")}, "vary": [SPEED]}, tmp_path / "out", workers=1)
