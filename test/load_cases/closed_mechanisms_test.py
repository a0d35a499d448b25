"""Load cases of closed mechanisms: motions of the drives alone, loop joints among the others, and what rigid bodies leave open."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from linkages import FOURBAR, SLIDERCRANK

import ksl
from ksl.base.errors import MotionError
from ksl.load_cases.loop_motion import joint_motions
from ksl.motions.generate import Waypoints, minimum_jerk, write_motion
from ksl.motions.generate.generated import limits_of
from ksl.motions.generate.waypoints import read_waypoints
from ksl_command import run_ksl

sys.path.insert(0, str(Path(__file__).parents[1] / "laws"))
from closed_mechanisms import random_case
from closed_test import Motion, determined_case

TIME = np.linspace(0, 2, 201)
TURN = 2 * np.pi * (TIME / 2 - np.sin(np.pi * TIME) / (2 * np.pi))
"""A whole turn of the crank, from rest to rest."""


@pytest.fixture
def fourbar(robot):
    return robot(FOURBAR, drives=["A"])


def of_drive(model, name, positions):
    """Arrays in which all other joints are left open."""
    q = np.full((len(TIME), model.nq), np.nan)
    q[:, model.joint(name).q_index] = positions
    return TIME, q


def row_of(run, joint):
    return next(row for row in run.rows if row["joint"] == joint)


def test_a_motion_of_the_drive_closes_the_mechanism(fourbar):
    run = ksl.compute_loads(fourbar, of_drive(fourbar, "A", TURN))
    case, result = run.cases[0], run.results[0]
    motion = case.motion
    assert motion.closing.held == ("A",) and motion.closing.error < 1e-10
    assert np.abs(fourbar.loop_error(motion.q)).max() < 1e-10
    rates = [np.gradient(x, TIME, axis=0, edge_order=2)[5:-5] for x in (motion.q, motion.v)]
    assert np.abs(rates[0] - motion.v[5:-5]).max() < 5e-2 and np.abs(rates[1] - motion.a[5:-5]).max() < 5e-1  # one branch, without jumps
    assert motion.q[-1] - motion.q[0] == pytest.approx([2 * np.pi, -2 * np.pi, 0], abs=1e-9)
    assert result.balance.relative_residual < 1e-6
    assert "effort_peak" in row_of(run, "A") and not {"effort_peak", "power_peak"} & set(row_of(run, "B"))
    expected = fourbar.reactions(motion.q, motion.v, motion.a, joints=["C"])[:, 0]
    table = run.wrenches.to_pylist()
    found = np.array([[row[c] for c in ("fx", "fy", "fz", "tx", "ty", "tz")] for row in table if row["joint"] == "C"])
    assert found == pytest.approx(expected, abs=1e-12)
    assert {row["undetermined"] for row in table if row["joint"] == "C"} == {"fy tx tz"}
    assert {row["undetermined"] for row in table if row["joint"] == "base"} == {""}


def test_columns_of_joints_that_follow_are_compared(fourbar, tmp_path):
    closed = ksl.compute_loads(fourbar, of_drive(fourbar, "A", TURN)).cases[0].motion
    off = closed.q + 0.3 * np.sin(TIME)[:, None] * [0, 1, 0] + [0, 0, 2 * np.pi]
    moved = ksl.compute_loads(fourbar, (TIME, off)).cases[0].motion
    assert moved.q == pytest.approx(closed.q + [0, 0, 2 * np.pi], abs=1e-9)  # the branch is that of the first sample
    assert any(line.startswith("positions of B in the motion differ from those that follow by up to 0.3 rad, at 1.57 s") for line in moved.contradictions)
    assert any(line.startswith("positions of D in the motion are those that follow, within") for line in moved.closing.compared)


@pytest.mark.parametrize(("kind", "seed"), [("revolute", 2), ("prismatic", 2), ("helical", 1), ("spherical", 1), ("fixed", 2)])
def test_a_loop_joint_takes_part_like_a_joint_of_the_tree(kind, seed):
    """The same mechanism with that joint in the tree, closed by a weld."""
    case = random_case(kind, seed)
    runs = []
    for model, start in ((case.model, case.q), (case.welded, case.q_welded)):
        moved = np.zeros((len(TIME), model.nv))
        for k, name in enumerate(case.drives):
            joint = model.joint(name)
            moved[:, joint.v_index : joint.v_index + joint.nv] = 0.03 * (np.sin(TIME + k) - np.sin(k))[:, None]
        runs.append(ksl.compute_loads(model, (TIME, model.integrate(np.tile(start, (len(TIME), 1)), moved))))
    loop, tree = (row_of(run, "L") for run in runs)
    unsure = loop["undetermined"].split()
    assert unsure == tree["undetermined"].split()
    judged = [k for k in tree if k not in ("case", "joint", "kind", "undetermined") and not k.endswith("time") and not k.startswith(tuple(unsure))]
    assert len(judged) > 1 and {k: loop[k] for k in judged} == pytest.approx({k: tree[k] for k in judged}, rel=1e-6, abs=1e-9)
    assert {"speed_peak", "position_lowest"} <= set(loop) or kind in ("spherical", "fixed")


def test_joints_that_a_file_of_stiffnesses_leaves_out_are_named(fourbar):
    from ksl.robot_files.stiffness_file import joints_without

    assert sorted(joints_without(fourbar, ["A", "C"])) == ["B", "D"] and joints_without(fourbar, "ABCD") == []


@pytest.mark.parametrize(
    "placement", [{}, {"axes": "world", "at": "world"}, {"axes": "rocker", "on": "parent"}, {"at": "rocker"}, {"at": {"C": (0.1, 0.2, -0.1)}}]
)
def test_what_is_open_is_what_stiffnesses_change(fourbar, placement):
    """No stiffness changes a component that is said to be determined, and each of the others is changed by some."""
    motion, rng = of_drive(fourbar, "A", TURN), np.random.default_rng(1)
    plain = ksl.compute_loads(fourbar, motion, **placement)
    said = plain.cases[0].undetermined.components
    joints = [j.name for j in plain.cases[0].joints]
    rigid = np.concatenate([b.total for b in plain.cases[0].blocks()])
    changed = np.zeros(rigid.shape[1:])
    for _ in range(3):
        stiff = fourbar.with_stiffness({name: rng.uniform(1e6, 1e8, 6) for name in "ABCD"})
        run = ksl.compute_loads(stiff, motion, **placement)
        assert run.cases[0].undetermined.components == {}
        changed = np.maximum(changed, np.abs(np.concatenate([b.total for b in run.cases[0].blocks()]) - rigid).max(axis=0))
    found = {
        name: tuple(c for c, x in zip(("fx", "fy", "fz", "tx", "ty", "tz"), row, strict=True) if x > 1e-6) for name, row in zip(joints, changed, strict=True)
    }
    assert {name: components for name, components in found.items() if components} == said


def test_stops_and_held_poses_follow_the_drive(fourbar, tmp_path):
    np.savetxt(tmp_path / "crank.csv", np.column_stack([TIME, TURN]), delimiter=",", header="time,A", comments="")
    (tmp_path / "cases.toml").write_text(
        '[defaults]\nmotion = "crank.csv"\n[cases.stop]\nstop = {time = 0.2, from = 1.0}\n[cases.worst]\nstop = {time = 0.2, by = "brakes"}\n'
        "[cases.held]\nhold = true\n[cases.pose]\nhold = {pose = {A = 1.0}}\n"
    )
    run = ksl.compute_loads(fourbar, cases=tmp_path / "cases.toml")
    for case, result in zip(run.cases, run.results, strict=True):
        assert np.abs(fourbar.loop_error(case.motion.q)).max() < 1e-10, case.name
        assert case.static or result.balance.relative_residual < 1e-5, case.name
    assert run.cases[3].motion.q[0, 0] == 1.0 and run.cases[0].motion.v[-1] == pytest.approx(0, abs=1e-12)


STIFF = "{" + ", ".join(f"{name} = {{ axial = 2e7, radial = 1e8, tilting = 1e5 }}" for name in "ABCD") + "}"


def test_cases_name_loops_drives_and_stiffnesses(robot, tmp_path):
    """As the options of the command do: a tree whose loop is in a file, driven by one joint or another, rigid or not."""
    tree = robot(FOURBAR, loops="cut")
    np.savetxt(tmp_path / "crank.csv", np.column_stack([TIME, TURN]), delimiter=",", header="time,A", comments="", fmt="%.17g")
    np.savetxt(tmp_path / "rocker.csv", np.column_stack([TIME, -1.8 + 0.1 * np.sin(TIME)]), delimiter=",", header="time,D", comments="", fmt="%.17g")
    both = ksl.compute_loads(robot(FOURBAR, drives=["A"]), tmp_path / "crank.csv").cases[0].motion.q[:, [0, 2]]
    np.savetxt(tmp_path / "both.csv", np.column_stack([TIME, both]), delimiter=",", header="time,A,D", comments="", fmt="%.17g")
    (tmp_path / "loops.toml").write_text(
        '[[loop]]\nname = "C"\nkind = "continuous"\npredecessor = "coupler"\nsuccessor = "rocker"\n'
        "predecessor_xyz = [0.32, 0.03, 0]\nsuccessor_xyz = [0.25, 0.02, 0]\naxis = [0, -1, 0]\n"
    )
    (tmp_path / "bearings.toml").write_text("\n".join(f"[{name}]\naxial = 2e7\nradial = 1e8\ntilting = 1e5" for name in "ABCD"))
    (tmp_path / "cases.toml").write_text(
        f'[defaults]\nloops = "loops.toml"\ndrives = ["A"]\nmotion = "crank.csv"\n[cases.rigid]\n[cases.stiff]\nstiffness = {STIFF}\n'
        '[cases.file]\nstiffness = "bearings.toml"\n[cases.some]\nstiffness = { A = [1e6, 1e6, 1e6, 1e6, 1e6, 1e6] }\n[cases.rocker]\ndrives = "D"\nmotion = "rocker.csv"\n'
        '[cases.shared]\ndrives = { A = 1.0, D = 4.0 }\nmotion = "both.csv"\n'
    )
    run = ksl.compute_loads(tree, cases=tmp_path / "cases.toml")
    closed = robot(FOURBAR, drives=["A"])
    stiff = closed.with_stiffness({name: {"axial": 2e7, "radial": 1e8, "tilting": 1e5} for name in "ABCD"})
    for case, model in zip(run.cases, (closed, stiff, stiff), strict=False):
        alone = ksl.compute_loads(model, tmp_path / "crank.csv").cases[0]
        assert next(case.blocks()).total == pytest.approx(next(alone.blocks()).total, rel=1e-9, abs=1e-9), case.name
    assert run.cases[0].undetermined.components and not run.cases[1].undetermined.components
    assert run.cases[4].motion.closing.held == ("D",) and run.cases[4].model.drives == ("D",)
    shared = run.cases[5]
    assert shared.model.drive_weights == (1.0, 4.0) and shared.motion.closing.held == ("A",)
    tau, alone = (next(case.blocks()).tau for case in (shared, run.cases[0]))
    _, ratio = closed.consistent_velocity(shared.motion.q, np.tile([1.0, 0, 0], (len(TIME), 1)), given=["A"])[:, [0, 2]].T  # of the rocker to the crank
    assert tau[:, 0] == pytest.approx(alone[:, 0] / (1 + ratio**2 / 4), abs=1e-9) and tau[:, 2] == pytest.approx(tau[:, 0] * ratio / 4, abs=1e-9)
    assert any(line.startswith("some: ") and "without stiffness, and therefore rigid" in line for line in run.notes), run.notes
    assert {"loops.toml", "bearings.toml"} <= {Path(file.file).name for file in run.provenance.inputs}


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ("drives = 3", "case x: drives is 3; expected names of joints"),
        ('drives = ["Z"]', "case x: .*drive .Z.: there is no such joint"),
        ('loops = "none.toml"', "case x: .*none.toml"),
        ('loops = "cut"\ndrives = ["A"]', "case x: drives are given, but fourbar has no loops"),
        ("stiffness = 3", "case x: stiffness is 3; expected the name of a file"),
        ("stiffness = { A = { axal = 1.0 } }", "case x: stiffness of joint A has key='axal'; did you mean"),
        ('stiffness = "none.toml"', "case x: .*none.toml"),
        ('loops = "cut"\nstiffness = { A = [1, 1, 1, 1, 1, 1] }', "case x: fourbar has no loops, so that no result depends on stiffnesses"),
        ('drivs = ["A"]', "unknown key 'drivs'; did you mean 'drives'"),
    ],
)
def test_bad_keys_of_mechanisms(fourbar, tmp_path, keys, said):
    (tmp_path / "cases.toml").write_text(f"[cases.x]\nhold = {{pose = {{A = 1.0}}}}\n{keys}\n")
    with pytest.raises(ksl.base.errors.CaseError, match=said):
        ksl.compute_loads(fourbar, cases=tmp_path / "cases.toml")


def test_cases_with_other_joints_are_refused(fourbar, tmp_path):
    (tmp_path / "cases.toml").write_text('[cases.closed]\nhold = {pose = {A = 1.0}}\n[cases.open]\nhold = {pose = {A = 1.0}}\nloops = "cut"\n')
    with pytest.raises(ksl.base.errors.CaseError, match=r"case open and case closed differ in their joints \(C\), and cases of one run have the same"):
        ksl.compute_loads(fourbar, cases=tmp_path / "cases.toml")


@pytest.mark.parametrize(("kind", "seed"), [("revolute", 2), ("prismatic", 2), ("spherical", 1)])
def test_efforts_of_joints_without_a_motor_are_zero(kind, seed):
    """Exactly, about axes in any direction; the other components are those of Model.reactions."""
    case = random_case(kind, seed)
    model = case.model
    moved = np.zeros((len(TIME), model.nv))
    for k, name in enumerate(case.drives):
        joint = model.joint(name)
        moved[:, joint.v_index : joint.v_index + joint.nv] = 0.03 * (np.sin(TIME + k) - np.sin(k))[:, None]
    run = ksl.compute_loads(model, (TIME, model.integrate(np.tile(case.q, (len(TIME), 1)), moved)))
    block, joints, idle = next(run.cases[0].blocks()), run.cases[0].joints, 0
    for joint in joints:
        if joint.one_coordinate and joint.name not in case.drives and joint.kind != "helical" and (joint.nv or joint.name in model.loop_names):
            assert row_of(run, joint.name)["axial_moment_peak" if joint.has_angle else "axial_force_peak"] == 0.0, joint.name
            idle += 1
    assert idle
    expected = model.reactions(block.q, block.v, block.a, joints=[j.name for j in joints])
    assert block.total == pytest.approx(expected, rel=1e-9, abs=1e-9 * np.abs(expected).max())


def test_components_along_the_motion_that_are_not_zero(robot, fourbar):
    """Of joints with damping, and about points off the axis."""
    motion = ksl.compute_loads(fourbar, of_drive(fourbar, "A", TURN)).cases[0].motion
    damped = robot(FOURBAR.replace('<axis xyz="0 -1 0"/>', '<axis xyz="0 -1 0"/><dynamics damping="0.1"/>'), drives=["A"], physics="damping")
    assert row_of(ksl.compute_loads(damped, motion), "B")["axial_moment_peak"] > 0.1
    for at, is_zero in (({"B": (0, -0.1, 0)}, True), ({"B": (0.1, 0, 0)}, False), ("world", False)):
        run = ksl.compute_loads(fourbar, motion, at=at, axes="rocker")
        assert (row_of(run, "B")["axial_moment_peak"] == 0.0) is is_zero


def test_the_worst_pose_is_the_worst_of_a_scan(robot):
    model = robot(SLIDERCRANK, drives=["A"])
    angle = np.linspace(-np.pi, np.pi, 2001)
    q = np.zeros((len(angle), model.nq))
    start = model.close(model.neutral(), hold=["A"]).q
    for k, x in enumerate(angle[1000:]):  # in small steps, on one branch, forwards and backwards
        for row, sign in ((1000 + k, 1), (1000 - k, -1)):
            q[row] = q[row - sign] if k else start
            q[row, 0] = sign * x
            q[row] = model.close(q[row], hold=["A"]).q
    still = np.zeros((len(q), model.nv))
    expected = np.linalg.norm(model.reactions(q, still, still, joints=["C"])[:, 0][:, [0, 2]], axis=1).max()  # in the plane: determined
    run = ksl.hold(model, worst="C", quantity="radial_force")
    assert row_of(run, "C")["radial_force_peak"] == pytest.approx(expected, rel=1e-5)
    with pytest.raises(MotionError, match="S is given 0.9 m, but with A = 0.5 rad the loops put it at 0.3"):
        ksl.hold(model, {"A": 0.5, "S": 0.9})
    with pytest.raises(MotionError, match="with S = 0.9 m no closed position was found: loop joint C stays open by 0.5"):
        ksl.hold(model, {"S": 0.9})
    with pytest.raises(MotionError, match="the mechanism has 1 freedom, and no drives leave 1 of it open; name more: --drives"):
        ksl.compute_loads(robot(SLIDERCRANK, drives=[]), (TIME, np.full((len(TIME), 3), np.nan)))


def test_more_drives_than_freedoms_are_a_doubt(robot):
    run = ksl.compute_loads(
        robot(FOURBAR, drives=["A", "D"]), ksl.compute_loads(robot(FOURBAR, drives=["A"]), of_drive(robot(FOURBAR), "A", TURN)).cases[0].motion
    )
    assert "A, D: 2 drives move 1 freedom: efforts are those of least norm" in " ".join(run.verdict.reasons)
    brace = '<constraint name="F" type="fixed"><parent link="frame"/><child link="crank"/></constraint></robot>'
    rigid = ksl.compute_loads(robot(FOURBAR.replace("</robot>", brace), drives=["A"]), (TIME, np.zeros((len(TIME), 3))))
    assert "A: the mechanism is rigid, and drives move nothing: " in " ".join(rigid.verdict.reasons)
    assert "the mechanism is rigid: no joint moves, whatever the motion says" in rigid.cases[0].motion.differentiated


def test_joints_that_close_loops_are_known_where_they_can_not_be_given(robot, tmp_path):
    """Their names stand in the tables: sentences about them say what to give instead."""
    model = robot(FOURBAR, drives=["A"])
    with pytest.raises(MotionError, match="joint C closes a loop, and its position follows from those of other joints; give some of A, B, D"):
        ksl.hold(model, {"C": 0.1})
    for name in ("B", "C"):
        with pytest.raises(ValueError, match=f"joint {name} has no motor, and so no effort; say what is largest, --of"):
            ksl.hold(model, worst=name)
        (tmp_path / "points.csv").write_text(f"A,{name}\n0,0\n1,1\n")
        with pytest.raises(MotionError, match=f"joint {name} follows the drives; give positions of A"):
            read_waypoints(model, limits_of(model), tmp_path / "points.csv")


def test_components_on_what_is_open_get_no_verdict(fourbar):
    run = ksl.compute_loads(fourbar, of_drive(fourbar, "A", TURN))
    pin = {"kind": "limits", "joint": "C", "radial_force": 100.0, "bending_moment": 1e-9, "speed_rpm": 100.0}
    bearing = {"kind": "crossed roller bearing", "joint": "C", "pitch_diameter": 0.1, "C": 9000, "C0": 9000, "load_factor": 1, "required_static_safety": 2}
    for model, judged in ((fourbar, False), (fourbar.with_stiffness({n: np.full(6, 1e7) for n in "ABCD"}), True)):
        sizing = ksl.size(ksl.compute_loads(model, run.cases[0].motion).wrenches, {"component": [pin, bearing], "required_life_h": 1000})
        verdicts = {f.figure: f.verdict for f in sizing.figures}
        assert verdicts["radial force"] == verdicts["speed"] == "within"
        assert (verdicts["bending moment"], verdicts["static safety"] != "") == (("over", True) if judged else ("", False))
        why = [str(x) for x in sizing.left_out if "not judged: needs stiffnesses" in str(x)]
        assert bool(why) is not judged
    assert "position_lowest" in row_of(run, "C")


def test_a_sweep_with_stiffnesses(fourbar, tmp_path):
    np.savetxt(tmp_path / "crank.csv", np.column_stack([TIME, TURN]), delimiter=",", header="time,A", comments="", fmt="%.17g")
    (tmp_path / "fourbar.urdf").write_text(FOURBAR)
    (tmp_path / "bearings.toml").write_text("\n".join(f"[{name}]\naxial = 2e7\nradial = 1e8\ntilting = 1e5" for name in "ABCD"))
    bearing = {"axial": 2e7, "radial": 1e8, "tilting": 1e5}
    expected = {row["joint"]: row for row in ksl.compute_loads(fourbar.with_stiffness(dict.fromkeys("ABCD", bearing)), tmp_path / "crank.csv").rows}
    vary = [{"kind": "speed", "values": [1.0]}]
    for i, (robot_given, base) in enumerate(
        [(fourbar, {"stiffness": dict.fromkeys("ABCD", bearing)}), (tmp_path / "fourbar.urdf", {"drives": ["A"], "stiffness": str(tmp_path / "bearings.toml")})]
    ):
        swept = ksl.sweep(robot_given, {"base": {"motion": str(tmp_path / "crank.csv"), **base}, "vary": vary}, tmp_path / f"swept{i}", workers=1)
        rows = {row["joint"]: row for row in swept.cases.to_table().to_pylist()}
        assert rows["C"]["undetermined"] == "" and rows["C"]["bending_moment_peak"] == pytest.approx(expected["C"]["bending_moment_peak"], rel=1e-9)
    for stiffness, said in ((3, "stiffness = 3; expected the name of a file"), ({"Z": [1.0] * 6}, "no joint named .Z"), ("none.toml", "none.toml")):
        with pytest.raises(ksl.base.errors.SweepError, match=said):
            ksl.sweep(fourbar, {"base": {"motion": str(tmp_path / "crank.csv"), "stiffness": stiffness}, "vary": vary}, tmp_path / "bad", workers=1)


def test_the_columns_of_the_drives_alone(fourbar, tmp_path):
    made = minimum_jerk(fourbar, Waypoints(np.array([[0.0], [2 * np.pi]])))
    for name, joints in (("all.csv", "all"), ("drives.csv", "drives")):
        write_motion(fourbar, made, tmp_path / name, joints)
    assert (tmp_path / "drives.csv").read_text().splitlines()[0] == "time,A,A.v,A.a"
    both = [ksl.compute_loads(fourbar, tmp_path / name) for name in ("all.csv", "drives.csv")]
    assert next(both[0].cases[0].blocks()).total == pytest.approx(next(both[1].cases[0].blocks()).total, rel=1e-6, abs=1e-6)
    with pytest.raises(MotionError, match="fourbar has no loops, so that no joint follows its drives"):
        write_motion(fourbar.without_loops(), made, tmp_path / "x.csv", "drives")
    with pytest.raises(ValueError, match="joints='drive'; did you mean"):
        write_motion(fourbar, made, tmp_path / "x.csv", "drive")
    (tmp_path / "fourbar.urdf").write_text(FOURBAR)
    done = run_ksl("motion", "fourbar.urdf", "--drives", "A", "--kind", "trapezoid", "--drives-only", "-o", "m.csv", cwd=tmp_path)
    assert done.returncode == 0 and done.stdout.rstrip().endswith("s, 1 joint") and (tmp_path / "m.csv").read_text().startswith("time,A,A.v,A.a\n"), done.stderr
    tree = run_ksl("motion", "fourbar.urdf", "--loops", "cut", "--kind", "trapezoid", "--drives-only", "-o", "m2.csv", cwd=tmp_path)
    assert tree.returncode == 2 and "has no loops" in tree.stderr and not (tmp_path / "m2.csv").exists()


def test_commands(tmp_path):
    (tmp_path / "fourbar.urdf").write_text(FOURBAR)
    made = run_ksl("motion", "fourbar.urdf", "--drives", "A", "--kind", "template", "-o", "t.csv", cwd=tmp_path)
    assert made.returncode == 0 and (tmp_path / "t.csv").read_text().startswith("time,A\n")
    np.savetxt(tmp_path / "crank.csv", np.column_stack([TIME, TURN]), delimiter=",", header="time,A", comments="")
    unknown = run_ksl("loads", "fourbar.urdf", "crank.csv", cwd=tmp_path)
    assert unknown.returncode == 2 and "name them: --drives (drives= in Python), from among A, B, D" in unknown.stderr
    done = run_ksl("loads", "fourbar.urdf", "crank.csv", "--drives", "A", "--json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "* not determined by rigid bodies" in done.stdout and "Joints without a motor" in done.stdout
    said = json.loads((tmp_path / "loads" / "report.json").read_text(encoding="utf-8"))
    assert said["closed_mechanism"]["loops"] == ["C, continuous, coupler → rocker"] and said["closed_mechanism"]["redundant"] == ["C: 3 of 5"]
    assert "<h2>Closed mechanism</h2>" in (tmp_path / "loads" / "report.html").read_text(encoding="utf-8")
    info = run_ksl("info", "fourbar.urdf", cwd=tmp_path)
    assert "mobility: 1 freedom at the closed position" in info.stdout and "drives: not known; name them with --drives, candidates: A, B, D" in info.stdout
    cut = run_ksl("loads", "fourbar.urdf", "crank.csv", "--loops", "cut", cwd=tmp_path)
    assert cut.returncode == 2 and "no column 'B' for joint B; add its positions" in cut.stderr


@pytest.mark.parametrize("kind", ["revolute", "continuous", "prismatic", "helical"])
@pytest.mark.parametrize("seed", range(3))
def test_motions_of_loop_joints_are_derivatives_of_their_positions(kind, seed):
    """Between two links that both move."""
    x = Motion(kind, seed, determined_case)
    m, drives, h = x.case.model, x.case.drives, 1e-4
    along = [m.close(m.integrate(x.case.q, s * x.v + s * s / 2 * x.a), hold=drives).q for s in (-h, 0, h)]
    before, now, after = joint_motions(m, np.array(along), np.array([x.v] * 3), np.array([x.a] * 3)).of_loops["L"].position
    of = joint_motions(m, x.case.q[None], x.v[None], x.a[None]).of_loops["L"]
    assert of.speed[0] == pytest.approx((after - before) / (2 * h), abs=1e-5 * (1 + np.abs(x.v).max()))
    assert of.acceleration[0] == pytest.approx((after - 2 * now + before) / h**2, abs=1e-4 * (1 + np.abs(x.a).max() + np.abs(x.v).max() ** 2))
