"""Load cases whose motion is simulated, and `ksl simulate`."""

import re
from dataclasses import replace
from inspect import signature
from pathlib import Path

import numpy as np
import pytest

import ksl
from ksl.commands.loads import loads
from ksl.commands.simulate import simulate
from ksl.load_cases.case_files.case_file import cases_of_text
from ksl.load_cases.computed_cases import ComputedCases
from ksl.load_cases.provenance import provenance_of
from ksl.load_cases.case_files.simulated import Simulated, simulated_motion
from ksl.motions.motion import Motion
from ksl_command import run_ksl

ROOT = Path(__file__).parents[3]
PANDA = ROOT / "examples/robots/panda.urdf"
PICK = ROOT / "examples/motions/panda_pick.csv"


@pytest.fixture(scope="module")
def panda():
    return ksl.load(PANDA)


def case_of(model, keys, name="c"):
    (case,) = cases_of_text(model, f"[cases.{name}]\nsimulate = {{ {keys} }}\n")
    return case


def test_a_fall_has_no_efforts_and_its_power_balance_closes(panda):
    case = case_of(panda, "until = 0.5, pose = { panda_joint2 = 0.4 }, velocity = { panda_joint1 = 0.5 }")
    run = ComputedCases([case], provenance_of([case], [], {}))
    (result,) = run.results
    assert case.kind == "simulated without drives" and len(case.motion.time) == 126
    assert case.motion.v[0, 0] == 0.5 and case.motion.q[0, 1] == 0.4
    assert max(np.abs(x.effort).max() for x in result.loads if x.effort is not None and len(x.effort)) < 1e-6
    assert result.balance.relative_residual < 1e-10 and not result.balance.doubtful


def test_the_power_balance_of_stiff_motions_closes_however_far_apart_samples_are(panda):
    """Splines through samples every 4 ms can't follow springs that settle within one: the residual was 0.93 of the largest power, and the verdict amber."""
    governor = ksl.load(PANDA.parent / "governor.urdf", physics="force elements")
    case = case_of(governor, "until = 2.0, pose = { to_left = 0.5236, to_right = 0.5236, slide = 0.866 }, velocity = { turn = 6.2832 }, rate = 250.0")
    balance = ComputedCases([case], provenance_of([case], [], {})).results[0].balance
    assert balance.relative_residual < 1e-10 and balance.untold is None
    case = case_of(panda, "controller = 'pd', stiffness = 1e4, damping = 1e2, until = 1.0, pose = {}, velocity = { panda_joint7 = 2.0, panda_joint5 = -1.0 }")
    result = ComputedCases([case], provenance_of([case], [], {})).results[0]
    assert result.balance.relative_residual < 1e-10 and np.array_equal(result.balance.untold.change, np.diff(result.balance.energy[:2])[0])
    assert any(re.match(r"samples are too far apart: between 0 s and 0\.004 s energy changes by -", doubt) for doubt in result.doubts)


def test_computed_torque_follows_the_motion_of_the_case(panda):
    text = f'[cases.c]\nmotion = "{PICK}"\nsimulate = {{ controller = "computed torque", stiffness = 400.0, damping = 40.0 }}\n'
    (case,) = cases_of_text(panda, text)
    asked = ksl.read_motion(panda, PICK)
    reached = [np.interp(case.motion.time, asked.time, x) for x in asked.q.T]
    assert np.abs(case.motion.q - np.column_stack(reached)).max() < 2e-3


@pytest.mark.parametrize("gains", ["stiffness = 1e3, damping = 1e2", "stiffness = 1e5, damping = 1e3"])
def test_joints_that_a_controller_holds_stand(panda, gains):
    """The error of the integration gave rates of either sign, and gears helped or hindered by them: efforts of motors were 6 % off, peaks 39 %."""
    pose = {"panda_joint2": 0.7, "panda_joint4": -1.2}
    keys = ", ".join(f"{name} = {x}" for name, x in pose.items())
    case = case_of(panda, f'controller = "pd", {gains}, until = 2.0, pose = {{ {keys} }}')
    assert case.motion.v.any() and not case.motion.resolved_v.any() and not case.motion.resolved_a[10:-10].any(), "at its ends a joint may begin to move"
    assert (case.motion.resolution < 1e-6).all()
    q = np.zeros(panda.nq)
    q[[panda.joint(name).q_index for name in pose]] = list(pose.values())
    result = ComputedCases([case], provenance_of([case], [], {})).results[0]
    rows = {row["joint"]: row for row in result.rows}
    for joint, effort in zip(panda.joint_names, panda.gravity_torque(q), strict=True):
        assert rows[joint]["effort_rms"] == pytest.approx(abs(effort), rel=1e-6, abs=1e-4)
        assert rows[joint]["power_peak"] == rows[joint]["work_negative"] == rows[joint]["speed_peak"] == 0
    moving = case_of(panda, 'controller = "pd", stiffness = 100.0, damping = 1.0, until = 1.0, pose = {}, velocity = { panda_joint1 = 0.3 }')
    assert not moving.motion.stands[:, 0].any()


def test_an_emergency_stop_under_brakes(panda):
    text = f'[cases.c]\nmotion = "{PICK}"\nsimulate = {{ from = 1.0, until = 2.0, brake_at = 1.0 }}\n'
    (case,) = cases_of_text(panda, text)
    assert case.motion.time[0] == pytest.approx(1.0, abs=0.01) and np.abs(case.motion.v[-1]).max() < 1e-12
    assert any("brakes engage at 1 s" in note and "sticks" in note for note in case.motion.source.notes)
    rubbed = case_of(panda, "until = 0.1, friction = 1.0")
    assert any("drives, brakes and dry friction together" in note for note in rubbed.motion.source.notes) and not any(
        "together" in note for note in case.motion.source.notes
    )


REFUSED = {
    "until = 1.0, untill = 2.0": "unknown key 'untill'; did you mean 'until'?",
    "until = -1.0": "until -1 s is not after its beginning, 0 s",
    "rate = 10.0": "no end; give until, s",
    "until = 1.0, controller = 'pid'": "controller 'pid'; did you mean 'pd'? expected one of none, gravity, pd, computed torque",
    "until = 1.0, pose = { elbow = 1.0 }": "no joint or column 'elbow'",
    "until = 1.0, velocity = 3.0": "velocity is 3.0; expected a table",
    "until = 1.0, stiffness = 'stiff'": "stiffness is 'stiff'; expected a number",
    "until = 1.0, method = 'rk4'": "the method rk4 has steps of the same length; give step, s",
    "until = 1e9": "samples; give a lower rate",
    "until = 1.0, rate = 1e300": "1e+300 samples; give a lower rate",
    "until = 1.0, method = 'rk4', step = 1e-300": "more steps than 10,000,000; take longer ones, or an earlier end",
    "until = 1.0, brake = 3.0": "brake: brakes engage at a time; give brake_at, s",
    "until = 1.0, controller = 'pd'": "controller 'pd' needs stiffness and damping",
    "until = 1.0, damping = 3.0": "damping is that of a controller; give controller",
    "until = 1.0, controller = 'gravity', stiffness = 3.0": "stiffness is that of a controller; give controller",
}


@pytest.mark.parametrize("keys", REFUSED)
def test_what_is_refused(panda, keys):
    with pytest.raises(ksl.CaseError, match=re.escape(REFUSED[keys])):
        case_of(panda, keys)


def test_a_case_is_held_stopped_or_simulated(panda):
    with pytest.raises(ksl.CaseError, match="hold and simulate; give one of them"):
        cases_of_text(panda, "[cases.c]\nhold = { pose = {} }\nsimulate = { until = 1.0 }\n")


def test_the_command_writes_a_motion_that_loads_reads(tmp_path):
    done = run_ksl("simulate", PANDA, "--pose", "panda_joint4=-90deg", "--until", "0.2", "-o", "fall", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "written to fall: motion.csv, report.html, summary.csv, wrenches.parquet" in done.stdout
    assert "steps of dop853; energy lost by integration" in done.stdout
    again = run_ksl("loads", PANDA, "fall/motion.csv", "-o", "again", cwd=tmp_path)
    assert again.returncode == 0, again.stderr
    read = ksl.read_motion(ksl.load(PANDA), tmp_path / "fall/motion.csv")
    assert read.q[0, 3] == pytest.approx(-np.pi / 2) and not read.differentiated


def test_a_run_begins_in_the_state_of_a_file(tmp_path):
    """As in that of a motion, which without a controller nothing follows; or in a pose, at rest."""
    (tmp_path / "pose.toml").write_text("panda_joint4 = -1.5\n")
    end = ("--until", "1.25", "-o")
    for one, other in ((("--start", PICK, "--from-time", "1.2"), (PICK, "--from-time", "1.2")), (("--start", "pose.toml"), ("--pose", "panda_joint4=-1.5"))):
        for options, folder in ((one, "one"), (other, "other")):
            done = run_ksl("simulate", PANDA, *options, *end, folder, "--force", cwd=tmp_path)
            assert done.returncode == 0, done.stderr
        assert (tmp_path / "one/motion.csv").read_text() == (tmp_path / "other/motion.csv").read_text()


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ((), "--until: the end is missing"),
        ((PICK, "--start", PICK), "--start: MOTION says where it begins; leave one of them out"),
        (("--start", PICK, "--pose", "panda_joint4=1"), "--start: --pose says where it begins"),
        (("--start", PICK, "--from-time", "99", "--until", "100"), "from 99 s: the motion is from 0 s to 4.08 s"),
        (("--until", "1", "--controller", "pd"), "--controller pd: needs --gains STIFFNESS,DAMPING"),
        (("--until", "1", "--controller", "pid"), "--controller pid: expected one of none, gravity, pd, computed-torque"),
        (("--until", "1", "--gains", "1,2"), "--gains: are those of a controller"),
        (("--until", "1", "--brake", "3"), "--brake: brakes engage at a time; give --brake-at S"),
        (("--until", "1", "--velocity", "3"), "--velocity 3: expected NAME=VALUE with a number"),
        (("--until", "1", "--velocity", "panda_joint4=90deg"), "expected NAME=VALUE with a number, rad/s or m/s"),
        (("--until", "0.1", "--brake-at", "0.5"), "brakes at 0.5 s would never engage; it ends at 0.1 s"),
        (("--until", "1", "--brake-at", "0", "--brake", "panda_joint4=90deg"), "expected NAME=VALUE with a number, N m or N"),
        (("--until", "inf"), "until is inf; expected a time, s"),
        (("--until", "1", "--rate", "inf"), "rate inf; expected samples a second, more than 0"),
        (("--until", "1", "--method", "rk4", "--tolerance", "1e-6"), "--tolerance: rk4 controls no error"),
        (("--until", "1", "--tolerance", "0"), "--tolerance 0: expected a number above zero"),
        (("--until", "1", "--method", "rk9"), "--method rk9: expected one of"),
        (("--until", "1", "--pose", "elbow=1"), "no joint or column 'elbow'"),
        (("--cases", "c.toml", "--until", "1", "--brake-at", "2"), "--until, --brake-at: with --cases each load case says so itself"),
    ],
)
def test_the_command_refuses(tmp_path, options, said):
    done = run_ksl("simulate", PANDA, *options, "-o", "out", cwd=tmp_path)
    assert done.returncode == 2 and said in done.stderr and not (tmp_path / "out").exists()


def test_the_command_takes_what_loads_takes_of_files_and_of_the_robot():
    """All but what says how a motion is read, and where wrenches are wanted."""
    of_loads, of_simulate = (set(signature(command).parameters) for command in (loads, simulate))
    of_motions = {"smooth", "map", "degrees", "time_unit", "resample", "stop", "ignore_extra", "topic", "positions_only", "external"}
    assert of_loads - of_simulate == of_motions | {"on", "at", "axes", "order", "joints", "paper", "fail_on", "deflection"}


@pytest.mark.parametrize(("controller", "said"), [("none", "no drive has effort"), ("gravity", "the drives hold the weight alone"), ("pd", "")])
def test_a_motion_that_is_not_followed_is_said(controller, said):
    """Of it the run takes the beginning."""
    b = ksl.Builder("arm").add_link("base").add_link("upper", 2.0, (0, 0, -0.2), np.diag([0.03, 0.03, 0.004]))
    m = b.add_joint("hinge", "revolute", "base", "upper", axis=(0, 1, 0), limits=(-3, 3), effort=50, velocity=9, damping=2.0, friction=0.1).build()
    t = np.linspace(0, 0.2, 21)
    followed = Motion(t, np.sin(t)[:, None], np.cos(t)[:, None], -np.sin(t)[:, None], doubts=["it is noisy"])
    how = Simulated(controller=controller, stiffness=100.0, damping=10.0, start=0.1)
    motion, kind = simulated_motion(m, how, followed, [])
    notes = [note for note in motion.source.notes if "is not followed" in note]
    assert len(notes) == bool(said) and ("which is not followed" in kind) == bool(said)
    assert motion.doubts.count("it is noisy") == 1, "its state is one of the noisy motion at least"
    assert "it is noisy" not in simulated_motion(m, replace(how, controller="none", pose={}), followed, [])[0].doubts
    if said:
        assert f"of it the run takes its state at 0.1 s, where the run begins, and its end; {said}" in notes[0]
    assert [d for d in motion.doubts if "physics of joints is off" in d] == [
        "the simulated motion is without damping and friction of the robot's file: physics of joints is off; turn it on with --physics damping,friction"
    ]
    assert not [d for d in simulated_motion(m.with_physics(["damping", "friction"]), how, followed, [])[0].doubts if "is off" in d]
    assert "without damping of the robot's file" in str(simulated_motion(m, replace(how, friction=0.1), followed, [])[0].doubts)
