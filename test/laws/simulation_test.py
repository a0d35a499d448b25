"""Laws of mechanisms in motion: orders of methods, energy and momentum that are kept, work, impacts and dry friction in closed form."""

import warnings
from pathlib import Path

import numpy as np
import pytest

import ksl
from closed_mechanisms import random_case
from ksl.simulation import PD, Brake, ComputedTorque, GravityCompensation, Reference
from linkages import four_bar

FIXED = ("semi_implicit_euler", "rk4", "rkmk4", "sdirk4", "variational")
ORDER = {"semi_implicit_euler": 1, "rk4": 4, "rkmk4": 4, "sdirk4": 4, "variational": 2}
G = 9.81
ROBOTS = Path(__file__).parents[2] / "examples/robots"


def pendulum(gravity=(0, 0, -G)):
    b = ksl.Builder("pendulum", gravity=gravity).add_link("base")
    for name, parent in (("upper", "base"), ("lower", "upper")):
        pose = np.eye(4)
        pose[2, 3] = -0.4 * (parent != "base")
        b.add_link(name, mass=2.0, center_of_mass=(0.01, 0, -0.2), inertia=np.diag([0.03, 0.03, 0.004]))
        b.add_joint(f"to_{name}", "revolute", parent, name, pose=pose, axis=(0, 1, 0), limits=(-2.0, 2.0))
    return b.build()


def body(kind, gravity=(0, 0, 0)):
    b = ksl.Builder("body", gravity=gravity).add_link("world")
    b.add_link("body", mass=1.0, center_of_mass=[0.01, 0.02, 0.1], inertia=np.diag([0.01, 0.02, 0.025]))
    return b.add_joint("joint", kind, "world", "body").build()


def chain():
    b = ksl.Builder("chain").add_link("world")
    for k, (parent, kind) in enumerate([("world", "continuous"), ("rod0", "universal"), ("rod1", "planar"), ("rod2", "cylindrical")]):
        pose = np.eye(4)
        pose[:3, 3] = [0.1 * k, 0, -0.4 * (k > 0)]
        b.add_link(f"rod{k}", mass=1.0 + k, center_of_mass=[0.02, 0, -0.2], inertia=np.diag([0.05, 0.04, 0.02]))
        more = {"axis": [0, 1, 0]} if kind != "universal" else {"axis": [0, 1, 0], "axis2": [1, 0, 0]}
        b.add_joint(f"j{k}", kind, parent, f"rod{k}", pose=pose, **more)
    return b.build()


def slider(axis, limits=None, mass=2.0, **options):
    b = ksl.Builder("slider").add_link("world").add_link("block", mass=mass, inertia=np.diag([0.1] * 3))
    return b.add_joint("slide", "prismatic", "world", "block", axis=axis, limits=limits, **options).build()


def closed(m, near, speed):
    q = m.close(near).q
    K = m.loop_jacobian(q)
    return m, q, speed * (np.eye(m.nv) - np.linalg.pinv(K) @ K) @ np.ones(m.nv)


MOVING = {
    "spherical": (body("spherical", (0, 0, -G)), [0.3, 0, 0, np.sqrt(0.91)], [1, 2, 20.0]),
    "floating": (body("floating"), [0, 0, 0, 0, 0, 0, 1.0], [0.1, 0.2, 0.3, 1, 5, 0.2]),
    "chain": (chain(), chain().random(4), np.linspace(-1, 1, chain().nv)),
    "four-bar": closed(four_bar(), [-1.0, 0.4, -1.5], 3.0),
    "loop": closed(*(lambda case: (case.model, case.q))(random_case("universal", 2)), 0.5),
}
STEPS = {"spherical": (2e-3, 1e-3), "floating": (4e-3, 2e-3), "chain": (2e-3, 1e-3), "four-bar": (4e-3, 2e-3), "loop": (4e-3, 2e-3)}


def error(m, run, exact):
    return np.abs(m.difference(exact.q[-1], run.q[-1])).max() + np.abs(run.v[-1] - exact.v[-1]).max()


@pytest.mark.parametrize("method", FIXED)
@pytest.mark.parametrize("name", MOVING)
def test_methods_have_their_order(name, method):
    m, q, v = MOVING[name]
    exact = m.simulate(q, v, [0, 0.3], rtol=1e-13, atol=1e-13)
    coarse, fine = (error(m, m.simulate(q, v, [0, 0.3], method=method, step=h), exact) for h in STEPS[name])
    if fine > 1e-12:  # below, rounding
        assert ORDER[method] - 0.35 < np.log2(coarse / fine)


@pytest.mark.parametrize("method", [*FIXED, "dop853"])
def test_free_bodies_keep_momentum(method):
    q, v = [0, 0, 0, 0, 0, 0, 1.0], [0.1, 0.2, 0.3, 1, 5, 0.2]
    options = {} if method == "dop853" else {"step": 1e-3}
    allowed = {"semi_implicit_euler": 1e-1, "variational": 1e-5, "dop853": 1e-8}.get(method, 1e-9)
    for gravity in (0, -G):
        m = body("floating", (0, 0, gravity))
        run = m.simulate(q, v, np.linspace(0, 1, 11), method=method, **options)
        assert np.abs(run.drift.momentum).max() < allowed
        if method == "variational" and gravity == 0:  # keeps it exactly, about the origin of the world
            momentum = m.centroidal_momentum(run.q, run.v)
            about_origin = momentum[:, 3:] + np.cross(m.center_of_mass(run.q), momentum[:, :3])
            assert np.abs(about_origin - about_origin[0]).max() < 1e-13 and np.abs(run.drift.momentum[:, :3]).max() < 1e-13


def free_tree(kind="floating", gravity=0.0, loop=False):
    """A body with an arm, that nothing holds; with a four-bar on it instead."""
    b = ksl.Builder("free tree", gravity=(0, 0, gravity)).add_link("world")
    b.add_link("body", mass=1.0, center_of_mass=[0.01, 0.02, 0.1], inertia=np.diag([0.01, 0.02, 0.025])).add_joint("base", kind, "world", "body")
    joints = [("body", "crank", 0.1, "revolute"), ("crank", "rod", 0.2, "revolute"), ("body", "rocker", 0.5, "revolute")]
    for k, (parent, name, x, of) in enumerate(joints if loop else [*joints[:2], ("rod", "hand", 0.2, "spherical"), ("hand", "slide", 0.1, "prismatic")]):
        pose = np.eye(4)
        pose[:3, 3] = x, 0.0 if loop else 0.03 * k, 0.2
        b.add_link(name, mass=0.5 + 0.3 * k, center_of_mass=[0.1, 0.02, -0.1], inertia=np.diag([0.01, 0.012, 0.009]))
        b.add_joint(name, of, parent, name, pose=pose, **({} if of == "spherical" else {"axis": (0, 1, 0), "limits": (-9, 9)}))
    if loop:
        ends = [np.eye(4), np.eye(4)]
        ends[0][:3, 3], ends[1][:3, 3] = (0.4, 0, 0), (0.3, 0, -0.1)
        b.add_loop("closes", "revolute", "rod", "rocker", *ends, axis=(0, 1, 0))
    return b.build(drives=["crank"] if loop else None)


FREE = {
    "body": body("floating"),
    "tree": free_tree(),
    "tree that falls": free_tree(gravity=-G),
    "tree in a plane": free_tree("planar"),
    "four-bar": free_tree(loop=True),
}


@pytest.mark.parametrize("name", FREE)
def test_the_variational_method_is_the_same_in_all_frames_that_move_along(name):
    """A constant velocity that is added changes nothing else, momenta are kept about the centre of mass as about the origin, and the order is 2."""
    m, times = FREE[name], np.linspace(0, 1, 11)
    q = m.close(m.random(3)).q
    v = np.random.default_rng(1).normal(size=m.nv)
    v = m.consistent_velocity(q, v, given=["base", "crank"]) if m.loops else v
    spatial = 2 + (m.joints[0].nv == 6)
    axes = m.frame_pose(q, "body")[:spatial, :spatial]
    runs = []
    for speed in (0.0, 1.0, 100.0, 1e4):
        along = speed * np.array([1.0, -0.5, 0.3])[: len(axes)]
        run = m.simulate(q, v + np.r_[axes.T @ along, np.zeros(m.nv - len(axes))], times, method="variational", step=0.01)
        runs.append(run)
        momentum, scale = m.centroidal_momentum(run.q, run.v), 1 + speed
        about_origin = momentum[:, 3:] + np.cross(m.center_of_mass(run.q), momentum[:, :3])
        if m.gravity[2] == 0 and spatial == 3:
            assert np.abs(momentum[:, :3] - momentum[0, :3]).max() < 1e-12 * scale and np.abs(momentum[:, 3:] - momentum[0, 3:]).max() < 1e-12 * scale
            assert np.abs(about_origin - about_origin[0]).max() < 1e-12 * scale**2  # arm times momentum, each of which grows with the speed
        moved = run.q - np.pad(np.outer(times, along), ((0, 0), (0, m.nq - len(along))))
        assert run.complete and np.abs(moved - runs[0].q).max() < 1e-11 * scale
        assert np.abs(run.v - runs[0].v)[:, len(axes) :].max() < 1e-11 * scale
    exact = m.simulate(q, v, times, rtol=1e-12, atol=1e-12)
    coarse, fine = (np.abs(run.q - exact.q).max() for run in (runs[0], m.simulate(q, v, times, method="variational", step=0.005)))
    assert 1.7 < np.log2(coarse / fine) < 2.3


def test_a_torque_free_body_keeps_its_energy_over_many_steps_of_rk4():
    m = body("floating")
    period = 2 * np.pi / 5.0
    run = m.simulate([0, 0, 0, 0, 0, 0, 1.0], [0, 0, 0, 1, 5, 0.2], [0, 2e4 * 1e-4 * period], method="rk4", step=1e-4 * period)
    assert run.steps == 20_000 and abs(run.drift.energy[-1]) < 1e-12 * run.kinetic[0]


@pytest.mark.parametrize("name", ["spherical", "four-bar"])
def test_the_variational_method_has_no_trend(name):
    m, q, v = MOVING[name]
    run = m.simulate(q, np.multiply(0.25, v), np.linspace(0, 40, 401), method="variational", step=4e-3)
    lost = run.drift.energy
    first, last = np.abs(lost[1:101]).max(), np.abs(lost[-100:]).max()
    assert last < 3 * first and abs(np.polyfit(run.times, lost, 1)[0]) * 40 < first


@pytest.mark.parametrize("method", [*FIXED, "dop853"])
def test_work_balances_energy(method):
    m = chain().with_physics(None)
    times = np.linspace(0, 0.5, 6)
    efforts = np.outer(np.cos(3 * times), np.linspace(1, 2, m.nv))
    external = {"rod3": [0.3, 0.1, 2.0, 0.01, 0.2, 0.1]}
    options = {} if method == "dop853" else {"step": 5e-4}
    run = m.simulate(m.random(2), np.zeros(m.nv), times, efforts=efforts, method=method, external=external, **options)
    assert np.abs(run.work).max() > 0.05
    assert np.abs(run.drift.energy).max() < {"semi_implicit_euler": 1.0, "variational": 1e-3}.get(method, 1e-7)
    assert np.allclose(run.efforts, efforts)


def test_efforts_from_outside_balance_energy_of_closed_mechanisms():
    _, q, v = MOVING["four-bar"]
    m = four_bar(damping=0.1, spring_stiffness=3.0, armature=0.01).with_physics("all")
    outside = {"external": {"rocker": [0, 0, 5.0, 0, 0.3, 0]}, "efforts": [0.5, 0, 0]}
    runs = [m.simulate(q, v, [0, 0.3], method="variational", step=h, **outside) for h in (1e-3, 5e-4)]
    exact = m.simulate(q, v, [0, 0.3], rtol=1e-12, atol=1e-12, **outside)
    coarse, fine = (error(m, run, exact) for run in runs)
    assert 1.9 < np.log2(coarse / fine) < 2.1 and abs(exact.work[-1]) > 0.1
    assert abs(runs[1].work[-1] - exact.work[-1]) < 1e-4 and abs(runs[1].drift.energy[-1]) < 1e-4


@pytest.mark.parametrize("method", ["dop853", "sdirk4", "variational", "rk4"])
def test_damping_and_springs_balance_energy(method):
    m = slider([1, 0, 0], damping=3.0, spring_stiffness=200.0, friction=0.5).with_physics("all")
    options = {"rtol": 1e-10, "atol": 1e-10} if method == "dop853" else {"step": 1e-4}
    run = m.simulate([0.1], [0.0], [0, 0.05, 0.1], method=method, **options)
    assert run.work[-1] < -0.05 and np.abs(run.drift.energy).max() < 1e-4 * abs(run.work[-1])


def test_stiff_gains_need_no_small_steps():
    m = slider([1, 0, 0])
    hold = PD([0.0], stiffness=2e8, damping=4e6)
    run = m.simulate([0.1], [0.0], [0.0, 1.0], efforts=hold, method="sdirk4", step=0.05)
    assert run.complete and run.steps == 20 and abs(run.q[-1, 0]) < 1e-6
    with np.errstate(all="ignore"), pytest.warns(RuntimeWarning, match="not finite"):
        assert not m.simulate([0.1], [0.0], [0.0, 10.0], efforts=hold, method="rk4", step=0.05).complete


ALL = pytest.mark.parametrize("how", [{}, {"method": "rk4", "step": 0.04}, {"method": "rkmk4", "step": 0.3}, {"method": "sdirk4", "step": 0.04}], ids=str)
"""Methods that are exact where accelerations are lines in time."""


@ALL
def test_a_ball_bounces_and_comes_to_rest(how):
    m = slider([0, 0, 1], (0.0, 10.0))
    run = m.simulate([1.0], [0.0], np.linspace(0, 2, 21), restitution=0.5, **how)
    falls, speed = np.sqrt(2 / G), np.sqrt(2 * G)
    first, second = run.events[:2]
    assert first.what == second.what == "lower limit" and first.joint == "slide"
    assert first.time == pytest.approx(falls, abs=1e-12) and first.speed == pytest.approx(speed / 2, abs=1e-11)
    assert second.time == pytest.approx(falls + speed / G, abs=1e-11)
    assert run.events[-1].what == "rest" and run.events[-1].time == pytest.approx(falls + 2 * speed / G, abs=1e-7)
    assert run.q[-1] == 0 and run.v[-1] == 0 and np.abs(run.drift.energy).max() < 1e-8


@ALL
def test_a_joint_that_rests_on_its_limit_lifts(how):
    m, times = slider([0, 0, 1], (0.0, 10.0)), np.linspace(0, 2, 21)
    run = m.simulate([0.0], [0.0], times, efforts=(20 * times)[:, np.newaxis], restitution=0.0, **how)
    assert [event.what for event in run.events] == ["rest", "lifts"]
    assert run.events[1].time == pytest.approx(2 * G / 20, abs=1e-9) and run.q[-1, 0] > 0


@ALL
def test_friction_holds_beside_the_limit_that_a_joint_rests_on(how):
    """It lifts where the push is its weight and its friction, which goes on."""
    m, times, F = slider([0, 0, 1], (0.0, 100.0)), np.linspace(0, 3, 31), 4.0
    run = m.simulate([0.0], [0.0], times, efforts=(20 * times)[:, np.newaxis], restitution=0.0, friction=F, **how)
    lifts = (2 * G + F) / 20
    assert [event.what for event in run.events] == ["rest", "lifts"] and run.events[1].time == pytest.approx(lifts, abs=1e-9)
    assert run.q[-1, 0] == pytest.approx(20 * (3 - lifts) ** 3 / 6 / 2, abs=1e-8)


def test_every_joint_obeys_the_law_of_dry_friction():
    """Of 300 random arms two reach an instant at which a joint that has been let go must be held again, since another one was let go."""
    m, rng, F = ksl.load(ROBOTS / "panda.urdf"), np.random.default_rng(0), 1.0
    q, v = m.random(rng, size=300), 0.1 * rng.normal(size=(300, m.nv))
    runs = m.simulate(q, v, np.linspace(0, 0.05, 6), friction=F, method="rk4", step=1e-3)
    held = m.inverse_dynamics(runs.q, runs.v, runs.a)  # what friction adds to the drives, which have none
    goes = np.where(runs.v == 0, np.sign(runs.a), np.sign(runs.v))
    assert runs.complete.all() and np.abs(held).max() < F * (1 + 1e-10)
    assert np.abs(held + goes * F)[goes != 0].max() < 1e-10 * F and np.count_nonzero(goes == 0) > 500


@ALL
def test_dry_friction_sticks_and_slips(how):
    m, times = slider([1, 0, 0]), np.linspace(0, 3, 31)
    run = m.simulate([5.0], [2.0], times, friction=4.0, **how)
    assert [event.what for event in run.events] == ["sticks"] and run.events[0].time == pytest.approx(1.0, abs=1e-10)
    assert run.q[-1, 0] == pytest.approx(6.0, abs=1e-10) and run.v[-1, 0] == 0
    pushed = m.simulate([5.0], [0.0], times, efforts=(3 * times)[:, np.newaxis], friction=4.0, **how)
    slips, whole = 4 / 3, 3.0
    way = (3 * (whole**3 - slips**3) / 6 - 4 * (whole - slips) ** 2 / 2 - 3 * slips**2 / 2 * (whole - slips)) / 2
    assert [event.what for event in pushed.events] == ["slips"] and pushed.events[0].time == pytest.approx(slips, abs=1e-9)
    assert pushed.q[-1, 0] - 5 == pytest.approx(way, abs=1e-8)


@ALL
def test_zeros_that_lie_in_one_step_are_found(how):
    """A speed, and a distance from a limit, that are below zero for 0.02 s, between two steps that begin and end above."""
    at, short, F = 1.02, 0.01, 4.0
    m, times = slider([1, 0, 0], (0.0, 10.0)), np.linspace(0, 2, 3)
    push = lambda t: F + 2 * 2.0 * (t - at)  # v = v₀ + (t − at)² − at², which is −short² at its lowest
    q, v = [[5.0], [5.0]], [[at**2 - short**2]] * 2
    runs = m.simulate(q, v, times, efforts=push(times)[:, np.newaxis], friction=F, **how)
    for k in (0, 1):
        assert [(e.what, pytest.approx(e.time, abs=1e-9)) for e in runs.events if e.run == k] == [("sticks", at - short), ("slips", at)]
        assert runs.v[k, -1, 0] == pytest.approx((2 - at) ** 2, abs=1e-9)
    q, v = [[at**2 - short**2]] * 2, [[-2 * at]] * 2
    runs = m.simulate(q, v, times, efforts=[2 * 2.0], restitution=0.5, **how)
    for k in (0, 1):
        assert [(e.what, pytest.approx(e.time, abs=1e-9)) for e in runs.events if e.run == k] == [("lower limit", at - short)]
    if "method" not in how:
        run = m.simulate(q[0], v[0], times, efforts=[2 * 2.0], events=[lambda t, q, v: q[0], lambda t, q, v: -q[0]])
        assert [(e.coordinate, pytest.approx(e.time, abs=1e-9)) for e in run.events] == [(0, at - short), (1, at - short), (0, at + short), (1, at + short)]


def test_exact_friction_of_the_model_is_that_of_the_run():
    m = slider([1, 0, 0], friction=4.0).with_physics("exact friction")
    run = m.simulate([5.0], [2.0], [0.0, 3.0])
    assert run.q[-1, 0] == pytest.approx(6.0, abs=1e-10) and [event.what for event in run.events] == ["sticks"]


@ALL
def test_brakes_engage_and_cut_the_drives(how):
    m = slider([1, 0, 0])
    run = m.simulate([0.0], [2.0], np.linspace(0, 3, 31), efforts=[1.0], brake=Brake(8.0, at=1.0), **how)
    assert [event.what for event in run.events] == ["brakes", "sticks"]
    assert run.events[1].time == pytest.approx(1 + 2.5 / 4, abs=1e-10)
    assert run.efforts[11:].max() == 0 and run.efforts[:10].min() == 1


@ALL
@pytest.mark.parametrize("apart", [1.0, 0.3, 0.1, 0.03, 0.01, 1e-4, 1e-6])
def test_both_directions_are_the_union_of_each(how, apart):
    """A throw passes a height up and down.  A step of equal length sees what is longer apart than it is."""
    if apart <= how.get("step", 0):
        return
    m, top = slider([0, 0, 1]), 10.0 / G
    height = 10.0 * top / 2 - G * (apart / 2) ** 2 / 2

    def times_of(direction, scale=1.0, events=1):
        passes = lambda t, q, v: scale * (q[0] - height)
        passes.direction = direction
        return [event.time for event in m.simulate([0.0], [10.0], [0.0, 2.0], events=[passes] * events, **how).events]

    up, down = times_of(1), times_of(-1)
    within = 1e-9 + 1e-13 / (G * apart / 2)  # positions of 5 m are off by rounding, 1e-13 m at most, and it passes the height slowly
    assert up == pytest.approx([top - apart / 2], abs=within) and down == pytest.approx([top + apart / 2], abs=within)
    assert all(found == pytest.approx(up + down, abs=within) for found in (times_of(0), times_of(0, -3.0), times_of(0, events=2)[::2]))


@ALL
def test_events_where_limits_throw_back(how):
    """The height is zero at each impact of a ball that bounces, from the first step on and in the last one."""
    m = slider([0, 0, 1], limits=(0.0, 9.0))
    run = m.simulate([0.0], [2.0], [0.0, 3.999 / G, 9.99 / G], restitution=0.5, events=lambda t, q, v: q[0], **how)
    assert [event.what for event in run.events if event.time < 6.999 / G] == ["event", "lower limit"] * 2
    assert [event.time for event in run.events][:4] == pytest.approx([4 / G, 4 / G, 6 / G, 6 / G], abs=1e-9)


@ALL
@pytest.mark.filterwarnings("error")
def test_functions_of_the_user_are_events(how):
    m = slider([1, 0, 0])

    def passes(t, q, v):
        return q[0] - 1.0

    passes.terminal, passes.direction = True, 1
    run = m.simulate([0.0], [2.0], [0.0, 0.2, 3.0], events=passes, **how)
    assert run.reason == "an event ended it" and run.ended == pytest.approx(0.5, abs=1e-12)
    assert np.isfinite(run.q[:2]).all() and np.isnan(run.q[2]).all()
    passes.direction = -1
    assert m.simulate([0.0], [2.0], [0.0, 3.0], events=passes, **how).complete


@ALL
def test_functions_that_are_zero_at_the_same_instant_are_all_told(how):
    """Beside each other, and beside an impact; one of them may end the run."""
    m, falls = slider([0, 0, 1], (0.0, 10.0)), np.sqrt(2 / G)

    def low(t, q, v):
        return -2.0 * q[0]

    height = lambda t, q, v: q[0]
    run = m.simulate([1.0], [0.0], [0.0, 0.6], restitution=0.5, events=[height, lambda t, q, v: t - 5.0, low], **how)
    assert [(e.what, e.coordinate) for e in run.events] == [("event", 0), ("event", 2), ("lower limit", 0)]
    assert [e.time for e in run.events] == pytest.approx([falls] * 3, abs=1e-11)
    low.terminal = True
    assert m.simulate([1.0], [0.0], [0.0, 0.6], events=[height, low], **how).ended == pytest.approx(falls, abs=1e-11)


def up(t, q, v):
    return v[1] + 1.0


EVENTS = {
    "limits": (pendulum(), [1.6, 0.2], [4.0, 1.0], {"restitution": 0.2}, (2e-3, 1e-3)),
    "friction": (pendulum(), [0.8, 0.2], [0.0, 0.0], {"friction": 1.0}, (4e-3, 2e-3)),
    "brakes": (pendulum(), [0.8, 0.2], [0.0, 0.0], {"brake": Brake(6.0, at=0.3333), "efforts": [[0, 0], [1, 1]]}, (4e-3, 2e-3)),
    "functions": (pendulum(), [1.8, 0.2], [0.0, 0.0], {"events": [up]}, (2e-3, 1e-3)),
    "a dead centre, then brakes": (*MOVING["four-bar"], {"friction": {"D": 0.3}, "brake": Brake({"A": 20.0}, at=0.3333)}, (2e-3, 1e-3)),
    "functions on loops": (*MOVING["four-bar"], {"events": [up]}, (2e-3, 1e-3)),
}


@pytest.mark.parametrize("method", FIXED)
@pytest.mark.parametrize("name", EVENTS)
def test_events_have_the_order_of_their_method(name, method):
    m, q, v, options, steps = EVENTS[name]
    if method == "variational" and "events" not in options:
        return
    times = [0.0, 1.2]
    exact = m.simulate(q, v, times, rtol=1e-13, atol=1e-13, **options)
    coarse, fine = (m.simulate(q, v, times, method=method, step=h, **options) for h in steps)
    told = [[event.what for event in run.events] for run in (exact, coarse, fine)]
    assert told[0] == told[1] == told[2] and len(told[0]) >= 2
    if m.loops:
        assert max(np.abs(m.loop_error(run.q)).max() for run in (exact, coarse, fine)) < 1e-11
    first, second = (np.abs([x.time - y.time for x, y in zip(run.events, exact.events, strict=True)]) for run in (coarse, fine))
    if second.max() > 1e-11:
        assert ORDER[method] - 0.5 < np.log2(first.max() / second.max())
    if error(m, fine, exact) > 1e-10:
        assert ORDER[method] - 0.5 < np.log2(error(m, coarse, exact) / error(m, fine, exact))


@pytest.mark.parametrize("method", [*FIXED, "dop853"])
@pytest.mark.parametrize("name", ["chain", "four-bar"])
def test_an_event_that_never_happens_changes_no_bit(name, method):
    m, q, v = MOVING[name]
    options = {"method": method, "efforts": lambda t, q, v: -0.1 * v} | ({} if method == "dop853" else {"step": 3e-3})
    run, other = (m.simulate(q, v, [0, 0.013, 0.1], **options, **more) for more in ({}, {"events": lambda t, q, v: 1.0}))
    for of in ("q", "v", "a", "efforts", "work", "energy", "steps"):
        assert np.array_equal(getattr(run, of), getattr(other, of)), of


@pytest.mark.parametrize("more", [{}, {"events": lambda t, q, v: 1.0}], ids=["lanes", "events"])
@pytest.mark.parametrize("begin", [0.0, 300.0, 1e6])
def test_steps_are_as_many_as_intervals_have_however_late_it_is(begin, more):
    times = begin + 0.02 * np.arange(101)
    assert pendulum().simulate([0.8, 0.2], [0, 0], times, method="rk4", step=2e-3, **more).steps == 1000


@pytest.mark.parametrize("how", [{}, {"method": "rk4", "step": 1e-3}, {"method": "variational", "step": 1e-3}], ids=str)
def test_a_crank_may_have_turned_many_times(how):
    m, q, v = MOVING["four-bar"]
    run, other = (m.simulate(q + 2 * np.pi * turns * np.array([1, -1, 0]), v, [0, 0.1], **how) for turns in (0, 20_000))
    assert other.complete and error(m, other, run) - 2 * np.pi * 20_000 < 1e-7


@ALL
def test_instants_that_meet(how):
    """Functions, brakes, corners of efforts and times of results at the same instant, or but for rounding."""
    m = pendulum()
    for brake in (0.3, 0.1 * 3):
        run = m.simulate([0.8, 0.2], [0, 0], np.arange(0, 1, 0.1), efforts=np.ones((10, 2)), brake=Brake(30.0, at=brake), events=lambda t, q, v: t - 0.3, **how)
        assert run.complete and [event.what for event in run.events] == ["event", "brakes", "sticks", "sticks"]
        assert np.isfinite(run.q).all() and np.abs(run.v[-1]).max() == 0


@ALL
def test_a_push_that_is_the_friction_itself_holds(how):
    m = pendulum(gravity=(0, 0, 0))
    for push in (0.1, 1 / 3, 0.7, 4.0):
        for q in ([0.8, 0.2], [0.1, 1.3], [0.37, -0.9]):
            run = m.simulate(q, [0, 0], [0, 0.1, 0.2], efforts=[push, -push], friction=push, **how)
            assert run.complete and not run.events and np.array_equal(run.q[-1], q)


@pytest.mark.parametrize("laws", [{"D": 0.3}, {"A": 0.3, "B": 0.3, "D": 0.3}], ids=str)
def test_all_joints_of_a_mechanism_with_one_freedom_stop_together(laws):
    """Whichever friction holds: their work is that of all, and the mechanism is at rest where the energy is spent."""
    m, q, v = MOVING["four-bar"]
    run = m.simulate(q, v, [0, 1.0], friction=laws, brake=Brake({"A": 2.0, "D": 5.0}, at=0.0))
    assert [event.what for event in run.events][-1] == "sticks" and sum(event.what == "sticks" for event in run.events) == 1
    assert np.abs(run.v[-1]).max() == 0 and np.abs(run.a[-1]).max() == 0 and np.abs(run.drift.energy).max() < 1e-8


@pytest.mark.parametrize("method", [*FIXED, "dop853"])
def test_runs_of_a_batch_have_the_bits_of_single_ones(method):
    m = chain()
    rng = np.random.default_rng(3)
    q, v, times = m.random(rng, size=(5, 7)), rng.normal(size=(5, 7, m.nv)), [0.0, 0.01, 0.02]
    options = {} if method == "dop853" else {"step": 2e-3}
    hold = PD(m.neutral(), stiffness=3.0, damping=1.0, gravity=True)
    runs = m.simulate(q, v, times, efforts=hold, method=method, threads=2, **options)
    assert runs.q.shape == (5, 7, 3, m.nq) and runs.drift.energy.shape == (5, 7, 3)
    for i, j in ((0, 0), (2, 3), (4, 6)):
        one = m.simulate(q[i, j], v[i, j], times, efforts=hold, method=method, **options)
        for name in ("q", "v", "a", "efforts", "work", "energy"):
            assert np.array_equal(getattr(one, name), getattr(runs, name)[i, j]), name


def falls(t, q, v):
    return v[0] + 0.5


falls.terminal = True
LAWS = {
    "limits": {"restitution": 0.4},
    "friction": {"friction": {"to_upper": 0.6, "to_lower": 0.2}},
    "brakes": {"brake": Brake(6.0, at=0.1234), "friction": 0.1},
    "brakes from the beginning, and limits": {"brake": Brake(1.0, at=0.0, cut=False), "restitution": 0.0},
    "a function that ends runs": {"events": [up, falls]},
    "too few steps": {"friction": 0.5, "most_steps": 61},
}


@pytest.mark.parametrize("method", ["semi_implicit_euler", "rk4", "rkmk4"])
@pytest.mark.parametrize("laws", LAWS)
def test_runs_under_laws_have_the_bits_of_single_ones(laws, method):
    """They are in lanes, which they leave for steps with events; more of them than are computed at once, on two threads."""
    m, rng, times = pendulum(), np.random.default_rng(8), [0.0, 0.1, 0.15, 0.3]
    q, v = rng.uniform(-1.9, 1.9, (270, 2)), rng.normal(size=(270, 2)) * [3, 5]
    hold = PD([0.3, 0.1], stiffness=3.0, damping=0.1, feed_forward=[0.5, -0.2])
    options = {"efforts": hold, "external": {"lower": [0.3, 0, 0, 0, 0.1, 0]}, "method": method, "step": 6e-3, **LAWS[laws]}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # of those that end early
        runs = m.simulate(q, v, times, threads=2, **options)
        alone = {i: m.simulate(q[i], v[i], times, **options) for i in (0, 1, 7, 100, 255, 256, 269)}
    assert len(runs.events) > 20 and (runs.complete.all() or 5 < np.count_nonzero(runs.complete) < 265)
    for i, one in alone.items():
        for name in ("q", "v", "a", "efforts", "work", "energy", "steps", "ended", "reason"):
            assert np.array_equal(getattr(one, name), getattr(runs, name)[i], equal_nan=name not in ("steps", "reason")), name
        told = [[(e.time, e.what, e.joint, e.coordinate, e.speed) for e in run.events if e.run == k] for run, k in ((one, 0), (runs, i))]
        assert told[0] == told[1]


def test_controllers():
    m = chain()
    start, times = m.random(5), np.linspace(0, 1, 11)
    rest = np.zeros(m.nv)
    floats = m.simulate(start, rest, times, efforts=GravityCompensation())
    assert np.abs(m.difference(floats.q[0], floats.q[-1])).max() < 1e-8
    wanted = m.integrate(start, 0.1 * np.ones(m.nv))
    reached = m.simulate(start, rest, times, efforts=ComputedTorque(wanted, stiffness=400.0, damping=40.0))
    assert np.abs(m.difference(wanted, reached.q[-1])).max() < 1e-6
    held = m.simulate(start, rest, times, efforts=PD(start, 0.0, 0.0, feed_forward=m.gravity_torque(start)))
    assert np.abs(m.difference(start, held.q[-1])).max() < 1e-6
    weak = m.simulate(start, rest, [0.0, 0.1], efforts=PD(wanted, 1e3, 1.0, limit=0.5))
    assert np.abs(weak.efforts).max() == 0.5


def test_computed_torque_follows_a_motion():
    m = chain()
    start, times = m.random(6), np.linspace(0, 1, 21)
    turn = np.linspace(0.2, 0.5, m.nv)
    way = (1 - np.cos(np.pi * times)) / 2
    q = np.array([m.integrate(start, s * turn) for s in way])
    v = np.outer(np.pi / 2 * np.sin(np.pi * times), turn)
    a = np.outer(np.pi**2 / 2 * np.cos(np.pi * times), turn)
    run = m.simulate(start, np.zeros(m.nv), times, efforts=ComputedTorque(Reference(times, q, v, a), stiffness=900.0, damping=60.0))
    assert max(np.abs(m.difference(x, y)).max() for x, y in zip(q, run.q, strict=True)) < 1e-4


def test_functions_of_python_drive():
    m = chain()
    start, times = m.random(7), [0.0, 0.05]
    function = lambda t, q, v: -0.5 * v + np.sin(t)
    alone = m.simulate(start, np.zeros(m.nv), times, efforts=function, method="rk4", step=1e-3)
    both = m.simulate([start, start], np.zeros(m.nv), times, efforts=function, method="rk4", step=1e-3)
    assert np.array_equal(alone.q, both.q[1])
    adaptive = m.simulate(start, np.zeros(m.nv), times, efforts=function)
    assert np.abs(m.difference(adaptive.q[-1], alone.q[-1])).max() < 1e-8
    ended = m.simulate(start, np.zeros(m.nv), [0.0, 0.1, 0.2], efforts=lambda t, q, v: np.zeros(m.nv) if t < 0.15 else None)
    assert ended.reason == "a function ended it"
