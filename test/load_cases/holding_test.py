"""One pose at rest, and the worst pose within limits: closed forms of a planar two-link arm."""

import math

import numpy as np
import pyarrow.parquet as pq
import pytest

import ksl
from hinged_rods import ROD, joint_of
from ksl.load_cases import holding
from ksl.load_cases.holding import WorstPose, _nearest, _range, worst_pose
from ksl.load_cases.placement import Placement
from ksl_command import run_ksl

M1, M2, L1, L2, G = 3.0, 1.5, 0.6, 0.4, 9.81
"""Masses at the ends of the links."""


def link(name, mass, length):
    inertia = '<inertia ixx="0" iyy="0" izz="0" ixy="0" ixz="0" iyz="0"/>'
    return f'<link name="{name}"><inertial><origin xyz="{length} 0 0"/><mass value="{mass}"/>{inertia}</inertial></link>'


ARM = f"""<robot name="arm"><link name="wall"/>{link("upper", M1, L1)}{link("lower", M2, L2)}
<joint name="shoulder" type="revolute"><parent link="wall"/><child link="upper"/><axis xyz="0 1 0"/>
<limit lower="0.5" upper="2.5" effort="40" velocity="1"/></joint>
<joint name="elbow" type="revolute"><parent link="upper"/><child link="lower"/><origin xyz="{L1} 0 0"/><axis xyz="0 1 0"/>
<limit lower="-1" upper="1" effort="10" velocity="1"/></joint></robot>"""


def shoulder_effort(q1, q2):
    """Turning about +y moves the links down from x; the drive holds minus the moment of the weights."""
    return -G * (M1 * L1 * np.cos(q1) + M2 * (L1 * np.cos(q1) + L2 * np.cos(q1 + q2)))


def elbow_effort(q1, q2):
    return -G * M2 * L2 * np.cos(q1 + q2)


@pytest.fixture
def arm(robot):
    return robot(ARM)


def efforts(run):
    return {row["joint"]: row["effort"] for row in run.wrenches.to_pylist()}


@pytest.mark.parametrize("pose", [{"shoulder": 0.7, "elbow": -0.4}, [0.7, -0.4]], ids=["names", "numbers"])
def test_a_two_link_arm_at_rest(arm, pose):
    found = efforts(ksl.hold(arm, pose))
    assert found["shoulder"] == pytest.approx(shoulder_effort(0.7, -0.4), rel=1e-12)
    assert found["elbow"] == pytest.approx(elbow_effort(0.7, -0.4), rel=1e-12)


def test_joints_without_a_position_are_near_zero_within_limits(arm):
    run = ksl.hold(arm, {"elbow": 0.3})
    assert run.cases[0].motion.q[0] == pytest.approx([0.5, 0.3])


def test_the_worst_pose_is_the_best_of_a_fine_grid(arm):
    q1, q2 = np.meshgrid(np.linspace(0.5, 2.5, 801), np.linspace(-1, 1, 801))
    for joint, effort in (("shoulder", shoulder_effort), ("elbow", elbow_effort)):
        run = ksl.hold(arm, worst=joint)
        largest = np.abs(effort(q1, q2)).max()
        assert abs(efforts(run)[joint]) >= largest * (1 - 1e-9) and abs(efforts(run)[joint]) == pytest.approx(largest, rel=1e-5)
        assert efforts(run)[joint] == pytest.approx(effort(*run.cases[0].motion.q[0]), rel=1e-12)


def test_the_search_is_reproducible_and_keeps_named_joints(arm):
    first, again = (ksl.hold(arm, {"shoulder": 2.0}, worst="elbow").cases[0].motion.q[0] for _ in range(2))
    assert np.array_equal(first, again) and first[0] == 2.0 and first[1] == pytest.approx(1.0)


@pytest.mark.parametrize("size", [1e-9, 1e-3, 1e9])
def test_the_worst_pose_does_not_depend_on_units_of_mass(arm, size):
    """Forces of an arm in other units are so many times the same, in the same pose; a maximum within the limits, which is smooth."""
    of = lambda gravity: worst_pose(arm.with_gravity((0.0, 0.0, gravity)), "shoulder", "fx", Placement(), np.zeros(2), set())
    usual, other = of(-G), of(-G * size)
    assert usual.value == pytest.approx((M1 + M2) * G, rel=1e-9) and other.value == pytest.approx(size * usual.value, rel=1e-9)
    for found in (usual, other):
        assert found.q[0] == pytest.approx(np.pi / 2, abs=1e-4) and found.converged and found.agree == found.ended == found.refined > 1


@pytest.mark.parametrize(("less", "agree"), [(0.015, False), (1.05e-3, False), (0.95e-3, True)])
def test_searches_agree_within_a_thousandth(robot, monkeypatch, less, agree):
    """Of a weight that hangs at a hinge all poses are refined: some end where sin q = 1, and others at the lower limit, where the magnitude is so much less."""
    lower = -float(np.arcsin(1 - less))
    monkeypatch.setattr(holding, "TRIED", 12)
    hinge = ARM.replace('lower="0.5" upper="2.5"', f'lower="{lower!r}" upper="2.5"').replace('lower="-1" upper="1"', 'lower="0" upper="0"')
    found = worst_pose(robot(hinge), "shoulder", "fx", Placement(), np.zeros(2), {"elbow"})
    assert (found.tried, found.refined, found.ended) == (12, 12, 12) and found.value == pytest.approx((M1 + M2) * G, rel=1e-9)
    assert found.agree == 12 if agree else 0 < found.agree < 12


@pytest.mark.parametrize("how", [{}, {"on": "parent"}, {"at": (0.1, -0.2, 0.3)}, {"axes": "world", "at": "world"}], ids=str)
def test_the_size_of_every_quantity(examples, how):
    """Of random poses at rest: components in the axes that are chosen, magnitudes, efforts, and what the axis makes of a wrench."""
    m = ksl.load(examples / "robots/ur5.urdf")
    q, still = np.random.default_rng(5).normal(size=(9, 6)), np.zeros((9, 6))
    elbow, placement = m.joint("elbow"), Placement(**how)
    w, own = (m.reactions(q, still, still, joints=["elbow"], **given)[:, 0] for given in (how, how | {"axes": "joint"}))
    axis, tau = np.array(elbow.axis), m.gravity_torque(q)[:, elbow.v_index]
    force, moment = own[:, :3], own[:, 3:]
    expected = dict(zip(holding.COMPONENTS, w.T, strict=True)) | {
        "force": np.linalg.norm(force, axis=1), "moment": np.linalg.norm(moment, axis=1), "effort": tau, "axial_force": force @ axis, "axial_moment": moment @ axis,
        "radial_force": np.linalg.norm(np.cross(force, axis), axis=1), "bending_moment": np.linalg.norm(np.cross(moment, axis), axis=1),
    }  # fmt: skip
    for quantity, x in expected.items():
        assert holding._size(m, elbow, quantity, placement)(q) == pytest.approx(np.abs(x), rel=1e-9, abs=1e-9), quantity


def test_the_worst_of_a_component(arm):
    """The shoulder carries the weight across or along its x axis: all of it where sin q = 1, within limits."""
    run = ksl.hold(arm, worst="shoulder", quantity="fx")
    assert abs(run.wrenches["fx"][0].as_py()) == pytest.approx((M1 + M2) * G, rel=1e-9)
    assert run.cases[0].motion.q[0][0] == pytest.approx(np.pi / 2, abs=1e-4)
    assert abs(ksl.hold(arm, worst="base", quantity="moment").wrenches["ty"].to_pylist()[-1]) > 0


def test_what_hold_refuses(arm):
    for arguments, sentence in (
        ({"pose": {"elbw": 1}}, "pose: no joint or column 'elbw'; did you mean 'elbow'"),
        ({"pose": {"elbow": "x"}}, "pose: elbow is 'x'; expected a number"),
        ({"pose": [1.0]}, r"pose has shape \(1,\); expected \(2\)"),
        ({"worst": "elbw"}, "no joint named 'elbw'; did you mean 'elbow'"),
        ({"worst": "elbow", "quantity": "efort"}, "joint elbow: no quantity named 'efort'; did you mean 'effort'"),
        ({"worst": "base"}, "joint base has no motor, and so no effort; say what is largest, --of"),
    ):
        with pytest.raises(ValueError, match=sentence):
            ksl.hold(arm, **arguments)


def run(*arguments):
    return run_ksl("hold", *arguments)


def test_the_command(arm, tmp_path):
    (tmp_path / "m.csv").write_text("time,shoulder,elbow\n" + "".join(f"{k / 10},{1 + k / 10},0\n" for k in range(8)))
    (tmp_path / "pose.toml").write_text("elbow = 0.25\n")
    robot = tmp_path / "robot.urdf"
    p = run(robot, "--pose", "shoulder=90deg", "--pose", tmp_path / "pose.toml", "-o", tmp_path / "out")
    assert p.returncode == 0, p.stderr
    assert p.stdout.splitlines()[-1].startswith("verdict: GREEN: ") and "1.5708 rad" in p.stdout and f"{elbow_effort(np.pi / 2, 0.25):.4g} N m" in p.stdout
    assert pq.read_table(tmp_path / "out/wrenches.parquet").num_rows == 3 and (tmp_path / "out/report.html").exists()
    assert max(map(len, p.stdout[p.stdout.index("Pose") : p.stdout.index("written")].splitlines())) <= 80
    p = run(robot, "--pose", tmp_path / "m.csv", "--time", "0.31")
    assert "1.3000 rad" in p.stdout, p.stderr
    p = run(robot, "--worst", "shoulder")
    assert p.returncode == 0 and "in the pose with the largest effort of shoulder" in p.stdout


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["--pose", "elbow=a"], "ksl: --pose elbow=a: expected NAME=VALUE with a number"),
        (["--pose", "elbw=1"], "ksl: pose: no joint or column 'elbw'; did you mean 'elbow'"),
        (["--pose", "none.toml"], "ksl: none.toml: can't be read"),
        (["--pose", "elbow"], "ksl: --pose elbow: a joint, without its position; give elbow=VALUE"),
        (["--pose", "elbow=1", "--pose", "elbow=2"], "ksl: --pose elbow=…: is given twice"),
        (["--time", "3"], "ksl: --time 3: chooses a sample of a motion"),
        (["--of", "tz"], "ksl: --of tz: what is searched with --worst JOINT"),
        (["--worst", "elbow", "--seed", "-1"], "ksl: --seed -1: expected 0 or more"),
        (["--worst", "elbw"], "ksl: arm: no joint named 'elbw'"),
    ],
)
def test_the_command_refuses(arm, tmp_path, arguments, sentence):
    p = run(tmp_path / "robot.urdf", *arguments)
    assert p.returncode == 2 and p.stderr.startswith(sentence) and p.stderr.count("\n") == 1 and p.stdout == ""


def test_a_pose_has_no_time(arm):
    assert ksl.hold(arm).verdict.worst.time is None and " s" not in ksl.hold(arm).verdict.headline


def test_a_pose_in_degrees_is_suspected(tmp_path, examples):
    p = run(examples / "robots/ur5.urdf", "--pose", "elbow=90")
    assert p.stdout.splitlines()[-1].startswith("verdict: RED") and "are these degrees?" in p.stdout.splitlines()[-2] and "90deg" in p.stdout.splitlines()[-2]


def test_efforts_that_overflow_and_payloads_that_are_none(arm):
    with pytest.raises(ksl.MotionError, match=r"pose: sample 1 .*tau\[\d\] is .*check the units of .* gravity"):
        ksl.hold(arm.with_gravity((1e308, 0, -1e308)), {"shoulder": 2.0})
    with pytest.raises(ValueError, match="payloads only describe what the model carries already"):
        ksl.hold(arm, payloads={"lower": (1.0, (0, 0, 0))})


def test_a_pose_in_a_file_that_is_not_there(arm, tmp_path):
    from ksl.load_cases.holding import read_pose

    with pytest.raises(ksl.MotionError, match="pose: there is no such file; give a TOML file of positions by names, or a motion"):
        read_pose(arm, tmp_path / "pose")


def test_a_structure_holds_itself(robot, tmp_path):
    """Without drives and freedoms nothing is held by drives; what rigid bodies leave open of its reactions is said."""
    beam = '<inertial><origin xyz="0.5 0 0"/><mass value="2"/><inertia ixx="0.01" iyy="0.1" izz="0.1" ixy="0" iyz="0" ixz="0"/></inertial>'
    weld = '<joint name="foot" type="fixed"><parent link="wall"/><child link="beam"/></joint>'
    text = f'<robot name="frame"><gazebo/><link name="wall"/><link name="beam">{beam}</link>{weld}</robot>'
    run = ksl.hold(robot(text))
    assert run.cases[0].kind == "held at rest by the structure itself: it has no drives and no freedoms"
    assert next(row["fz"] for row in run.wrenches.to_pylist() if row["joint"] == "foot") == pytest.approx(2 * 9.81)
    prop = '<constraint name="prop" type="fixed"><parent link="beam"/><parent_origin xyz="1 0 0"/><child link="wall"/><child_origin xyz="1 0 0"/></constraint></robot>'
    (tmp_path / "frame.urdf").write_text(text.replace("</robot>", prop))
    said = run_ksl("hold", tmp_path / "frame.urdf")
    assert "held at rest by the structure itself" in said.stdout and "not determined by rigid bodies" in said.stdout, said.stdout + said.stderr
    assert "note: in the file and not used: " in said.stdout and "by the drives" not in said.stdout


def test_drives_hold_what_has_some(arm):
    assert ksl.hold(arm).cases[0].kind == "held at rest by the drives"


def test_ranges_that_are_searched():
    """Both limits; a turn beside one of them, or about zero; slides need both."""
    ranges = [_range(joint_of(**x)) for x in ({"lower": -1, "upper": 2}, {"lower": 1}, {"upper": 1}, {})]
    assert ranges == [(-1, 2), (1, pytest.approx(1 + 2 * np.pi)), (pytest.approx(1 - 2 * np.pi), 1), (pytest.approx(-np.pi), pytest.approx(np.pi))]
    assert _range(joint_of(kind="prismatic", angle=False, upper=1)) is None and _range(joint_of(kind="prismatic", angle=False, lower=0, upper=1)) == (0, 1)


@pytest.mark.parametrize(
    ("refined", "ended", "agree", "skipped", "said", "converged"),
    [
        (0, 0, 0, 0, "no joint can move: there was nothing to search", True),
        (0, 0, 0, 50, "no closed position within the limits was found from 50 random poses: this is the pose that was given; give limits of position that fit", True),
        (9, 9, 2, 0, "2 of 9 searches, from the best of 50 random poses, came to this value", True),
        (9, 7, 1, 3, "1 of 9 searches, from the best of 50 random poses, came to this value, 2 ended before a maximum; from 3 of the 50 no closed position was found within the limits, or none that the drives hold; "
                     "there may be a worse pose: try other seeds", False),
    ],
)  # fmt: skip
def test_how_far_a_search_came(refined, ended, agree, skipped, said, converged):
    found = WorstPose(np.zeros(1), 1.0, 50, refined, ended, agree, skipped)
    assert str(found) == said and found.converged == converged


@pytest.mark.parametrize(("quantity", "value"), [("force", 2 * 9.81), ("moment", 9.81), ("fz", 2 * 9.81), ("fx", 0.0), ("axial_moment", 0.0)])
def test_the_worst_of_every_quantity(robot, quantity, value):
    """A rod that turns about the vertical: its weight acts 0.5 m off the axis in any pose."""
    found = worst_pose(robot(ROD), "pin", quantity, Placement(), np.zeros(1), set())
    assert found.value == pytest.approx(value, abs=1e-12) and found.refined > 0 and (value == 0 or found.agree == found.refined)


@pytest.mark.parametrize(
    ("pose", "nearest", "angle", "loses"),
    [
        (7.0, 7 - math.tau, True, 1.0), (13.0, 13 - 2 * math.tau, True, 1.0), (-6.0, math.tau - 6, True, 1.0), (-12.2, 2 * math.tau - 12.2, True, 1.0), (2.0, 2.0, True, 1.0),
        (7.0, 7.0, False, 1.0), (7.0, 0.1, True, 0.9e-9), (7.0, 7 - math.tau, True, 1.1e-9), (19.5, 19.5 - 2 * math.tau, True, 1.0),
    ],
)  # fmt: skip
def test_a_pose_without_needless_turns(pose, nearest, angle, loses):
    """At most two turns less or more, within the bounds; and where the joint is, if that makes no more than a billionth less of the quantity."""
    kind = {} if angle else {"kind": "prismatic", "angle": False}
    size = lambda poses: 5 * np.where(np.abs(np.sin((poses[:, 0] - pose) / 2)) < 1e-9, 1.0, 1 - loses) if angle else 5 * np.where(poses[:, 0] == pose, 1.0, 0.0)
    assert _nearest(np.array([pose]), np.array([0.1]), [(joint_of(**kind), (-20.0, 20.0))], size)[0] == pytest.approx(nearest)
    assert _nearest(np.array([7.0]), np.array([0.1]), [(joint_of(), (5.0, 9.0))], size)[0] == 7, "beyond the bounds"
    if angle and loses == 1:
        nearer = _nearest(np.array([pose]), np.array([-3.0]), [(joint_of(), (-99.0, 99.0))], size)[0]
        assert nearer == pytest.approx(min((pose + k * math.tau for k in (-2, -1, 0, 1, 2)), key=lambda x: abs(x + 3)))
