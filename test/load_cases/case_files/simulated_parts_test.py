"""What a simulated load case is made of: beginning, controller, brakes and corners, each way it may be given."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from linkages import FOURBAR, SLIDERCRANK

import ksl
from ksl.base.errors import MotionError
from ksl.load_cases.load_case import LoadCase
from ksl.load_cases.case_files.simulated import Simulated, _brake, _controller, brakes_from, samples_of, simulated_motion
from ksl.simulation.drives import PD, Brake, ComputedTorque, GravityCompensation, Reference
from ksl.motions.motion import Motion

ROBOTS = Path(__file__).parents[3] / "examples/robots"
BODY = '<link name="{}"><inertial><origin xyz="0.5 0 0"/><mass value="2"/><inertia ixx="0" iyy="0" izz="0" ixy="0" ixz="0" iyz="0"/></inertial></link>'
HINGE = '<joint name="{}" type="{}"><parent link="{}"/><child link="{}"/><axis xyz="0 0 1"/>{}</joint>'
ROD = f'<robot name="r"><link name="wall"/>{BODY.format("rod")}{HINGE.format("pin", "continuous", "wall", "rod", "")}</robot>'
FOLLOWED = Motion(np.array([1.0, 1.5, 2.0]), *(np.arange(3.0)[:, None] * x for x in (0.1, 2.0, 3.0)))


@pytest.mark.parametrize(("at", "braked"), [(None, False), (0.9, True), (1.0, True), (1.1, False)])
def test_brakes_that_are_engaged_from_the_beginning(at, braked):
    case = LoadCase(SimpleNamespace(), FOLLOWED, brakes_from=brakes_from(Simulated(brake_at=at)))
    assert case.brake == braked and case.braked.tolist() == [at is not None and t >= at for t in (1.0, 1.5, 2.0)]
    assert samples_of(Simulated(brake_at=at), FOLLOWED) == 251


LIMIT = '<limit lower="-1" upper="1" effort="{}" velocity="9"/>'


def test_what_brakes_hold_where_nothing_is_said(robot):
    """The effort limits of joints with one coordinate; of closed mechanisms those of its drives."""
    hinges = HINGE.format("p", "revolute", "wall", "b", LIMIT.format(7)) + HINGE.format("q", "revolute", "b", "c", LIMIT.format(0))
    free = '<joint name="free" type="floating"><parent link="wall"/><child link="d"/><limit effort="5"/></joint>'
    m = robot(f'<robot name="r"><link name="wall"/>{BODY.format("b")}{BODY.format("c")}{BODY.format("d")}{hinges}{free}</robot>')
    assert _brake(m, Simulated()) is None and _brake(m, Simulated(brake=3.0)) is None
    assert _brake(m, Simulated(brake_at=2.0)) == Brake({"p": 7.0}, 2.0) and _brake(m, Simulated(brake_at=2.0, brake={"q": 3.0})) == Brake({"q": 3.0}, 2.0)
    assert _brake(robot(SLIDERCRANK, drives=["S"]), Simulated(brake_at=0.0)) == Brake({"S": 500.0}, 0.0)
    for without in (robot(SLIDERCRANK, drives=["A"]), robot(ROD)):
        with pytest.raises(MotionError, match="brake_at: no joint has an effort limit"):
            _brake(without, Simulated(brake_at=0.0))


@pytest.mark.parametrize(
    ("pose", "followed", "follows"),
    [(None, FOLLOWED, True), ({}, FOLLOWED, False), (None, None, False), (None, Motion(np.array([1.0]), *np.zeros((3, 1, 1))), False)],
)
def test_a_controller_follows_the_motion_or_holds_the_pose(robot, pose, followed, follows):
    m, q = robot(ROD), np.array([0.25])
    make = lambda name: _controller(m, Simulated(controller=name, pose=pose, stiffness=5.0, damping={"pin": 3.0}), followed, q, np.arange(2.0))
    assert make("none") is None and make("gravity") == GravityCompensation({"pin": 3.0})
    for name, kind in (("pd", PD), ("computed torque", ComputedTorque)):
        made = make(name)
        assert type(made) is kind and (made.stiffness, made.damping) == (5.0, {"pin": 3.0}) and getattr(made, "gravity", True)
        if not follows:
            assert made.reference is q
            continue
        assert isinstance(made.reference, Reference)
        assert [x.tolist() for x in (made.reference.times, made.reference.q, made.reference.v, made.reference.a)] == [
            x.tolist() for x in (FOLLOWED.time, FOLLOWED.q, FOLLOWED.v, FOLLOWED.a)
        ]


@pytest.mark.parametrize(
    ("how", "begin", "q", "v"),
    [
        ({}, 1.0, 0.0, 0.0), ({"start": 1.0}, 1.0, 0.0, 0.0), ({"start": 1.7}, 1.5, 0.1, 2.0), ({"start": 1.9, "velocity": {"pin": 9.0}}, 2.0, 0.2, 9.0), ({"pose": {"pin": 0.7}}, 1.0, 0.7, 0.0),
        ({"pose": {"pin": 0.7}, "start": 0.5, "velocity": {"pin": -1.0}}, 0.5, 0.7, -1.0), ({"start": 0.99}, None, None, None), ({"start": 2.01}, None, None, None),
    ],
)  # fmt: skip
def test_where_a_simulation_begins(robot, how, begin, q, v):
    """In the state of a sample of the motion, or in a pose at rest; with the velocities that are given."""
    how = Simulated(until=3.0, rate=4.0, **how)
    if begin is None:
        with pytest.raises(MotionError, match=f"from {how.start:g} s: the motion is from 1 s to 2 s"):
            simulated_motion(robot(ROD), how, FOLLOWED, [])
        return
    motion, _ = simulated_motion(robot(ROD), how, FOLLOWED, [])
    assert (motion.time[0], motion.q[0, 0], motion.v[0, 0]) == pytest.approx((begin, q, v)) and motion.time[-1] == 3.0
    assert motion.source.step == pytest.approx((3.0 - begin) / round((3.0 - begin) * 4))


def test_velocities_of_joints_that_follow(robot):
    """In a closed mechanism they are those of the closed motion; of joints with several coordinates none can be given."""
    m = robot(FOURBAR, drives=["A"])
    motion, _ = simulated_motion(m, Simulated(until=0.01, pose={"A": 0.3}, velocity={"A": 2.0}), None, [])
    assert motion.v[0] == pytest.approx(m.consistent_velocity(motion.q[0], np.array([2.0, 0, 0]), given=["A"])) and motion.v[0, 1] != 0
    floating = robot(f'<robot name="f">{BODY.format("b")}</robot>', floating_base=True)
    with pytest.raises(MotionError, match="velocity: joint floating_base has 6 coordinates; those with one can be given"):
        simulated_motion(floating, Simulated(until=1.0, pose={}, velocity={"floating_base": 1.0}), None, [])


def stopped(monkeypatch, model, reached=11, events=(), told=()):
    """`Model.simulate` that ends with these events after so many of eleven samples."""
    whole = model.simulate

    def ends(_, *arguments, progress, **how):
        run, done = whole(*arguments, **how), {"events": list(events), "reason": "it stopped", "ended": 3.0}
        for t in told if progress else ():
            progress(t)
        q = np.where(np.arange(11)[:, None] < reached, run.q, np.nan)
        return SimpleNamespace(q=q, **done, **{name: getattr(run, name) for name in ("v", "a", "energy", "drift", "steps")})

    monkeypatch.setattr(type(model), "simulate", ends)


SOME = Simulated(start=2.0, until=4.0, pose={}, velocity={"pin": 1.0}, rate=5.0)


@pytest.mark.parametrize("reached", [0, 1, 2, 3, 11])
def test_simulations_that_end_early(robot, monkeypatch, reached):
    """Two samples are a motion.  What was done is told from the beginning on."""
    m, told = robot(ROD), []
    stopped(monkeypatch, m, reached, told=(2.0, 2.5, 4.0))
    if reached < 2:
        with pytest.raises(MotionError, match="simulation: it stopped at its beginning, 3 s; check the start, gains and units"):
            simulated_motion(m, SOME, None, [])
        return
    motion, _ = simulated_motion(m, SOME, None, [], lambda done, of: told.append((done, of)))
    assert motion.time == pytest.approx(2 + 0.2 * np.arange(reached)) and motion.source.samples == reached
    assert told == [(0.0, 2.0), (0.5, 2.0), (2.0, 2.0)]


def test_accelerations_jump_at_events(robot, monkeypatch):
    """Within the run, of joints that stick or slip, and of brakes; velocities at impacts."""
    at = lambda time, what: SimpleNamespace(time=time, what=what, joint="pin")
    inside = [2 + k / 30 for k in range(1, 25)]
    others = [at(2.0, "sticks"), at(3.0, "slips"), at(2.9, "upper limit"), at(2.5, "rest"), at(2.95, "brakes"), at(inside[0], "slips")]
    m, events = robot(ROD), [*(at(t, "sticks") for t in reversed(inside)), *others]
    stopped(monkeypatch, m, events=events)
    motion, _ = simulated_motion(m, SOME, None, [])
    assert motion.corner_times.tolist() == sorted([*inside, 2.95]) and motion.break_times.tolist() == [2.5, 2.9]
    assert motion.source.notes[-1].startswith("impacts on limits are shorter than any sample")
    resting = "pin rests on a limit of position, first at 2.5 s: the effort there is that of drive and stop together, and neither a motor's load nor one for its effort limit"
    assert resting in motion.doubts
    events[:] = [at(2.5, "sticks")]
    motion = simulated_motion(m, SOME, None, [])[0]
    assert not any("impacts" in note for note in motion.source.notes) and not any("rests on" in doubt for doubt in motion.doubts)


def test_joints_that_loops_move_do_not_stand():
    """Andrews's mechanism at its beginning: all move, some by less than the integration resolves; what is taken for a stand must not open loops."""
    m = ksl.load(ROBOTS / "andrews.urdf", physics="force elements")
    motion, _ = simulated_motion(m, Simulated(until=0.01, pose={"beta": -0.0617}, rate=2000), None, [])
    K = m.loop_jacobian(motion.q)
    opened, terms = np.einsum("nij,nj->ni", K, motion.resolved_v), np.einsum("nij,nj->ni", np.abs(K), np.abs(motion.v))
    assert (np.abs(opened) <= 1e-9 * terms + 1e-15).all() and motion.stands[0].all()
    m.inverse_dynamics(motion.q, motion.resolved_v, motion.resolved_a)
    braked, _ = simulated_motion(
        m, Simulated(until=0.05, pose={"beta": -0.0617}, velocity={"beta": 1.0}, brake_at=0.0, brake={"beta": 0.5}, rate=2000), None, []
    )
    assert braked.stands[-1].all() and braked.held[-1].all(), "a mechanism that stands does so with all joints"


@pytest.mark.parametrize(
    ("drive", "how", "said"),
    [
        ("A", {"friction": 0.1}, "dry friction at B, dry friction at S, which has no drive"),
        ("A", {"friction": {"S": 0.1, "A": 0.2, "B": 0.0}}, "dry friction at S, which has no drive"),
        ("A", {"friction": {"A": 0.1}}, None),
        ("A", {"brake_at": 2.5, "brake": {"S": 3.0}}, "brake at S, which has no drive"),
        ("S", {"brake_at": 2.5}, None),
        ("A", {"restitution": 0.0}, "stop at S, which has no drive"),
        ("S", {"restitution": 0.0}, "S rests on a limit of position"),
    ],
)
def test_what_acts_at_joints_of_loops_without_a_drive(robot, monkeypatch, drive, how, said):
    """The drives are told to have its effort, as inverse dynamics knows no other: no wrench is that of the run then."""
    m = robot(SLIDERCRANK, drives=[drive])
    q = m.close(np.array([0.3, 0.2, 0.3])).q
    if "restitution" in how:
        stopped(monkeypatch, m, events=[SimpleNamespace(time=2.5, what="rest", joint="S")])
    pose = {name: float(x) for name, x in zip(m.joint_names, q)}
    doubts = simulated_motion(m, Simulated(start=2.0, until=3.0, pose=pose, rate=10.0, **how), None, [])[0].doubts
    about = [line for line in doubts if "no drive" in line or "rests on" in line]
    assert [line[: len(said or "")] for line in about] == ([said] if said else [])
