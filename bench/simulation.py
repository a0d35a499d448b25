#!/usr/bin/env python3
"""Motion over time: steps a second beside the forward dynamics that they call, and what accuracy costs, beside MuJoCo, Exudyn and Drake.

    python bench/simulation.py

Needs ksl; of mujoco, exudyn and drake what is there.  One core.  Motions are a Panda's (runs in lanes), a double pendulum's for 5 s, whose error is against a run
with tolerance 1e-13 that agrees with 40-digit values to 1e-11, a simple pendulum after 1000 of its periods, and two closed mechanisms that are benchmarks of the field: a four-bar of equal rods,
which passes singular positions, and Bricard's, which has a redundant equation.  Of these the energy lost in 10 s is the measure.  Andrews's squeezing
mechanism is held against the published end at 0.03 s, and a flyball governor with stiff springs, as that of problem A05 of the IFToMM benchmarks, against a run with
tolerance 1e-12.
"""

import time
from functools import partial
from pathlib import Path

import ksl
import numpy as np
import other_simulators

ROBOTS = Path(__file__).parents[1] / "examples/robots"
RUNS = 4096


def best(call, rounds=7):
    times = []
    for _ in range(rounds):
        begin = time.perf_counter()
        call()
        times.append(time.perf_counter() - begin)
    return min(times)


def at(p, R=None):
    return np.vstack([np.column_stack([np.eye(3) if R is None else R, p]), [0, 0, 0, 1]])


def double_pendulum():
    b = ksl.Builder("double pendulum").add_link("world")
    for k, parent in enumerate(["world", "rod0"]):
        b.add_link(f"rod{k}", mass=1.0, center_of_mass=[0, 0, -0.5], inertia=np.diag([1, 1, 1e-3]) / 12)
        b.add_joint(f"j{k}", "continuous", parent, f"rod{k}", pose=at([0, 0, -1.0 * k]), axis=[0, -1, 0])
    return b.build()


def equal_rods():
    up = np.array([[0, 0, -1], [0, 1, 0], [1, 0, 0.0]])
    b = ksl.Builder("four-bar of equal rods").add_link("ground")
    for name in ("left", "right", "coupler"):
        b.add_link(name, mass=1.0, center_of_mass=(0.5, 0, 0), inertia=np.diag([0, 1, 1]) / 12)
    for name, parent, pose in (("left", "ground", at([0, 0, 0], up)), ("right", "ground", at([1, 0, 0], up)), ("coupler", "left", at([1, 0, 0], up.T))):
        b.add_joint(f"to_{name}", "continuous", parent, name, pose=pose, axis=(0, 1, 0))
    m = b.add_loop("last", "revolute", "coupler", "right", at([1, 0, 0]), at([1, 0, 0]), axis=(0, 1, 0)).build()
    return m, m.consistent_velocity(m.neutral(), [1.0, 0, 0], given=["to_left"])


def bricard():
    """Five rods of 1 m and 1 kg, 0.1 m square, along the edges of a cube from corner to corner; each hinge is square to both its rods."""
    corner = np.array([[0, 0, 0], [1, 0, 0], [1, -1, 0], [1, -1, 1], [0, -1, 1], [0, 0, 1.0]])
    axis = [np.cross(corner[i] - corner[i - 1], corner[(i + 1) % 6] - corner[i]) for i in range(6)]
    b, parent = ksl.Builder("Bricard's mechanism").add_link("ground"), "ground"
    for i in range(5):
        e = corner[i + 1] - corner[i]
        inertia = ((1 + 0.01) * (np.eye(3) - np.outer(e, e)) + 0.02 * np.outer(e, e)) / 12
        b.add_link(f"rod{i}", mass=1.0, center_of_mass=e / 2, inertia=inertia)
        b.add_joint(f"hinge{i}", "continuous", parent, f"rod{i}", pose=at(corner[0] if i == 0 else corner[i] - corner[i - 1]), axis=axis[i])
        parent = f"rod{i}"
    m = b.add_loop("last", "revolute", "rod4", "ground", at(corner[5] - corner[4]), at(corner[5]), axis=axis[5]).build()
    return m, np.zeros(m.nv)


def simple_pendulum():
    """Problem A01 of the IFToMM benchmarks: a point of 1 kg on a rod of 1 m, released from the horizontal.  And its period, by Gauss's mean."""
    b = ksl.Builder("simple pendulum").add_link("world").add_link("bob", mass=1.0, center_of_mass=(0, 0, -1))
    m = b.add_joint("pin", "continuous", "world", "bob", axis=(0, -1, 0)).build()
    x, y = 1.0, np.sqrt(0.5)
    while x - y > 1e-15:
        x, y = (x + y) / 2, np.sqrt(x * y)
    return m, 2 * np.pi / np.sqrt(-m.gravity[2]) / x


def lanes():
    m, rng = ksl.load(ROBOTS / "panda.urdf"), np.random.default_rng(1)
    q, v, tau = m.random(rng, size=RUNS), 0.1 * rng.normal(size=(RUNS, m.nv)), rng.normal(size=(RUNS, m.nv))
    forward = best(lambda: m.forward_dynamics(q, v, tau, threads=1)) / RUNS
    print(f"Panda, {RUNS} runs, forward dynamics {1e9 * forward:.0f} ns")
    for method, calls in (("semi_implicit_euler", 1), ("rk4", 4), ("rkmk4", 4)):
        step = best(partial(m.simulate, q, v, [0, 0.1], method=method, step=1e-3, threads=1), 3) / RUNS / 100
        print(f"  {method:22}{1e9 * step:8.0f} ns a step, {1e-6 / step:6.2f} million steps/s, {100 * calls * forward / step:4.0f} % of it forward dynamics")
    one = best(lambda: m.simulate(q[0], v[0], [0, 1.0]))
    run = m.simulate(q[0], v[0], [0, 1.0])
    print(f"  dop853, one run of 1 s{1e6 * one:8.0f} µs, {int(run.steps)} steps, {int(run.evaluations)} evaluations")


def print_row(name, call, exact):
    if call is None:
        return print(f"  {name}")
    try:
        print(f"  {name:28}{1e3 * best(call, 3):9.2f} ms {np.abs(call() - exact).max():10.1e} rad")
    except other_simulators.NoResult as e:
        print(f"  {name:28}{e}")


def accuracy():
    m, start = double_pendulum(), ([1.5, 0.5], [0.0, 0.0])
    exact = m.simulate(*start, [0, 5.0], rtol=1e-13, atol=1e-13).q[-1]
    print("double pendulum, 5 s: time and error of the angles")

    row = partial(print_row, exact=exact)
    of_ksl = lambda **options: m.simulate(*start, [0, 5.0], **options).q[-1]
    for tolerance in (1e-6, 1e-9, 1e-12):
        row(f"KSL dop853 {tolerance:g}", partial(of_ksl, rtol=tolerance, atol=tolerance))
    for step in (1e-2, 1e-3):
        row(f"KSL rk4 {step:g}", partial(of_ksl, method="rk4", step=step))
    for name, call in other_simulators.rows(start[0], 5.0):
        row(name, call)


def periods():
    m, period = simple_pendulum()
    print("simple pendulum, 1000 periods: time and error of the angle")
    for tolerance in (1e-6, 1e-9, 1e-12):
        call = partial(m.simulate, [np.pi / 2], [0.0], [0, 1000 * period], rtol=tolerance, atol=tolerance)
        run, seconds = call(), best(call, 3)
        offset = np.hypot(run.q[-1, 0] - np.pi / 2, run.v[-1, 0] / np.sqrt(-m.gravity[2]))  # at the turn the angle alone is flat
        print(f"  KSL dop853 {tolerance:<17g}{1e3 * seconds:9.2f} ms {offset:10.1e} rad")


def closed():
    for make in (equal_rods, bricard):
        m, v = make()
        q = m.neutral()
        for tolerance in (1e-6, 1e-9):
            call = partial(m.simulate, q, v, np.linspace(0, 10, 101), rtol=tolerance, atol=tolerance)
            run, seconds = call(), best(call, 3)
            lost = np.abs(run.drift.energy).max()
            print(f"{m.name}, 10 s, dop853 {tolerance:g}: {1e3 * seconds:.0f} ms, energy lost {lost:.1e} J, loops opened by {run.drift.closure.max():.1e} m")


ANDREWS = {  # joint: its angle at the beginning, and the reference at 0.03 s of the Test Set for Initial Value Problem Solvers
    "beta": (-0.06171389001427642, 15.81077119629904),
    "theta": (0.0, -15.75637105984298),
    "gamma": (0.4552798191630704, 0.04082224013073101),
    "phi": (0.2226683901658859, -0.5347301163226948),
    "delta": (0.48736497954384255, 0.5244099658805304),
    "omega": (-0.2226683901658859, 0.5347301163226948),
    "epsilon": (1.2305474445498212, 1.048080741042263),
}


def with_force_elements():
    m = ksl.load(ROBOTS / "andrews.urdf", physics="force elements", gravity=(0, 0, 0))
    start, end = np.array([ANDREWS[name] for name in m.joint_names]).T
    tau = np.where(np.array(m.joint_names) == "beta", 0.033, 0.0)
    print("Andrews's squeezing mechanism, 0.03 s: time and error of the angles")
    of_ksl = lambda **options: m.simulate(start, np.zeros(7), [0, 0.03], efforts=tau, **options).q[-1]
    for tolerance in (1e-6, 1e-9, 1e-12):
        print_row(f"KSL dop853 {tolerance:g}", partial(of_ksl, rtol=tolerance, atol=tolerance), end)
    for name, call in other_simulators.rows_of(m, start, np.zeros(7), tau, 0.03, (1e-5, 1e-6)):
        print_row(name, call, end)

    m = ksl.load(ROBOTS / "governor.urdf", physics="force elements")
    at_start = {"turn": (0, 2 * np.pi), "to_left": (np.pi / 6, 0), "to_right": (np.pi / 6, 0), "slide": (np.sqrt(0.75), 0)}
    start, v = np.array([at_start[name] for name in m.joint_names]).T
    exact = m.simulate(start, v, [0, 10.0], rtol=1e-12, atol=1e-12).q[-1]
    print("a stiff flyball governor, 10 s: time and error of the coordinates")
    for tolerance in (1e-6, 1e-9):
        print_row(f"KSL dop853 {tolerance:g}", lambda tolerance=tolerance: m.simulate(start, v, [0, 10.0], rtol=tolerance, atol=tolerance).q[-1], exact)
    for step in (1e-2, 1e-3):
        print_row(f"KSL sdirk4 {step:g}", lambda step=step: m.simulate(start, v, [0, 10.0], method="sdirk4", step=step).q[-1], exact)
    for name, call in other_simulators.rows_of(m, start, v, np.zeros(4), 10.0, (1e-3, 1e-4)):
        print_row(name, call, exact)


if __name__ == "__main__":
    lanes()
    accuracy()
    periods()
    closed()
    with_force_elements()
