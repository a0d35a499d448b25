#!/usr/bin/env python3
"""Times of closed mechanisms, KSL beside Pinocchio's constraintDynamics, both called from Python in one run.

    python bench/loops.py

Needs ksl and pin.  The mechanisms are a four-bar and a Stewart platform of 24 coordinates, whose 18 equations close six spherical joints.
Pinocchio closes points and rigid frames, and no hinge: its four-bar is closed at a point.  The best of several rounds counts.
"""

import time

import ksl
import numpy as np
import pinocchio as pin

STATES = 1000


def best(call, rounds=15, least=0.02):
    """The time of one call, µs."""
    call()
    begin = time.perf_counter()
    call()
    repeats = max(1, int(least / max(time.perf_counter() - begin, 1e-7)))
    times = []
    for _ in range(rounds):
        begin = time.perf_counter()
        for _ in range(repeats):
            call()
        times.append((time.perf_counter() - begin) / repeats)
    return 1e6 * min(times)


def at(x=0.0, y=0.0, z=0.0):
    pose = np.eye(4)
    pose[:3, 3] = x, y, z
    return pose


def four_bar():
    """KSL's model, Pinocchio's with its constraints, and a closed position."""
    rods = (("crank", 1.0, 0.2, "ground", 0.0), ("coupler", 2.0, 0.6, "crank", 0.2), ("rocker", 1.5, 0.5, "ground", 0.6))
    b, m, joints = ksl.Builder("four-bar").add_link("ground"), pin.Model(), {"ground": 0}
    for name, mass, length, parent, x in rods:
        inertia = np.diag([0.0, 1.0, 1.0]) * mass * length**2 / 12
        b.add_link(name, mass=mass, center_of_mass=(length / 2, 0, 0), inertia=inertia)
        b.add_joint(f"to {name}", "continuous", parent, name, pose=at(x), axis=(0, 1, 0))
        joints[name] = m.addJoint(joints[parent], pin.JointModelRY(), pin.SE3(np.eye(3), np.array([x, 0, 0])), name)
        m.appendBodyToJoint(joints[name], pin.Inertia(mass, np.array([length / 2, 0, 0]), inertia), pin.SE3.Identity())
    model = b.add_loop("closure", "revolute", "coupler", "rocker", at(0.6), at(0.5), axis=(0, 1, 0)).build(drives=["to crank"])
    ends = [(joints["coupler"], np.array([0.6, 0, 0]), joints["rocker"], np.array([0.5, 0, 0]))]
    return model, m, ends, model.close([-1.0, 0.4, -1.5]).q, ["to crank"]


def stewart():
    b, m = ksl.Builder("Stewart platform").add_link("ground"), pin.Model()
    bodies = {
        "platform": (20.0, (0, 0, 0.05), (0.5, 0.6, 1.0)),
        "cylinder": (2.0, (0, 0, 0.3), (0.06, 0.06, 0.003)),
        "rod": (1.0, (0, 0, -0.2), (0.03, 0.03, 0.001)),
    }

    def add(joint, name, kind):
        mass, center, moments = bodies[kind]
        b.add_link(name, mass=mass, center_of_mass=center, inertia=np.diag(moments))
        m.appendBodyToJoint(joint, pin.Inertia(mass, np.array(center), np.diag(moments)), pin.SE3.Identity())

    platform = m.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "free")
    add(platform, "platform", "platform")
    b.add_joint("free", "floating", "ground", "platform")
    ends = []
    for k in range(6):
        below, above = (np.deg2rad(120 * (k // 2) + (turn if k % 2 else -turn)) for turn in (15, 45))
        foot, head = 0.8 * np.array([np.cos(below), np.sin(below), 0]), 0.5 * np.array([np.cos(above), np.sin(above), 0])
        leg = m.addJoint(0, pin.JointModelRX(), pin.SE3(np.eye(3), foot), f"x{k}")
        leg = m.addJoint(leg, pin.JointModelRY(), pin.SE3.Identity(), f"y{k}")
        add(leg, f"cylinder{k}", "cylinder")
        leg = m.addJoint(leg, pin.JointModelPZ(), pin.SE3.Identity(), f"p{k}")
        add(leg, f"rod{k}", "rod")
        b.add_joint(f"U{k}", "universal", "ground", f"cylinder{k}", pose=at(*foot), axis=(1, 0, 0), axis2=(0, 1, 0))
        b.add_joint(f"P{k}", "prismatic", f"cylinder{k}", f"rod{k}", axis=(0, 0, 1))
        b.add_loop(f"S{k}", "spherical", f"rod{k}", "platform", at(), at(*head))
        ends.append((leg, np.zeros(3), platform, head))
    model = b.build(drives=[f"P{k}" for k in range(6)])
    q = model.neutral()
    q[2] = 0.9
    for k in range(6):
        q[model.joint(f"P{k}").q_index] = 1.0
    return model, m, ends, model.close(q, hold=["free"]).q, ["free"]


def pinocchio_call(m, ends, q, v, tau):
    data = m.createData()
    models, datas = pin.StdVec_RigidConstraintModel(), pin.StdVec_RigidConstraintData()
    for joint, point, other, other_point in ends:
        models.append(pin.RigidConstraintModel(pin.ContactType.CONTACT_3D, m, joint, pin.SE3(np.eye(3), point), other, pin.SE3(np.eye(3), other_point)))
    for model in models:
        datas.append(model.createData())
    pin.initConstraintDynamics(m, data, models, datas)
    settings = pin.ProximalSettings(1e-12, 1e-8, 5)
    forward = lambda: pin.constraintDynamics(m, data, q, v, tau, models, datas, settings)
    forward()
    return forward, lambda: pin.computeConstraintDynamicsDerivatives(m, data, models, datas, settings)


def compare(make):
    m, other, ends, q, given = make()
    v = m.consistent_velocity(q, np.random.default_rng(1).normal(size=m.nv), given=given)
    tau = np.random.default_rng(2).normal(size=m.nv)
    a = m.forward_dynamics(q, v, tau)
    forward, derivatives = pinocchio_call(other, ends, q, v, tau)
    assert np.abs(forward() - a).max() < 1e-5 * np.abs(a).max()
    tile = lambda x: np.tile(x, (STATES, 1))
    Q, V, A, T = map(tile, (q, v, a, tau))
    one, batch, peer = best(lambda: m.forward_dynamics(q, v, tau)), best(lambda: m.forward_dynamics(Q, V, T, threads=1)) / STATES, best(forward)
    print(f"{m.name}: {m.nv} coordinates")
    print(f"{'  forward':18}{one:10.2f}{batch:10.3f}{peer:11.2f}   {peer / one:.1f}, batch {peer / batch:.1f}")
    one, batch, peer = (
        best(lambda: m.forward_dynamics_derivatives(q, v, tau)),
        best(lambda: m.forward_dynamics_derivatives(Q, V, T)) / STATES,
        peer + best(derivatives),
    )
    print(f"{'  derivatives':18}{one:10.2f}{batch:10.3f}{peer:11.2f}   {peer / one:.1f}, batch {peer / batch:.1f}")
    tree, joints = m.without_loops(), [*m.joint_names, *m.loop_names]
    one, batch = best(lambda: m.reactions(q, v, a, joints=joints)), best(lambda: m.reactions(Q, V, A, joints=joints, threads=1)) / STATES
    of_tree, batch_of_tree = best(lambda: tree.reactions(q, v, a)), best(lambda: tree.reactions(Q, V, A, threads=1)) / STATES
    print(f"{'  reactions':18}{one:10.2f}{batch:10.3f}{'':11}   {one / of_tree:.1f} times the time of the open tree's, batch {batch / batch_of_tree:.1f}")
    moved = m.integrate(q, np.full(m.nv, 0.01))
    print(f"{'  close':18}{best(lambda: m.close(moved, hold=m.drives)):10.2f}")


def main():
    print(f"{'':18}{'KSL':>10}{'batch':>10}{'Pinocchio':>11}   µs a state, and how many times as fast")
    for make in (four_bar, stewart):
        compare(make)


if __name__ == "__main__":
    main()
