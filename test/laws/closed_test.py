"""Mechanisms with loops: a loop closed by a joint is one closed by a weld, the joint then being in the tree; and the laws of their motion."""

import ksl
import numpy as np
import pytest
from closed_mechanisms import KINDS, body, pose, random_case
from linkages import FOURBAR

SEEDS = range(3)
CASES = [(kind, seed) for kind in KINDS for seed in SEEDS]


def close_to(x, y, limit):
    x, y = np.asarray(x), np.asarray(y)
    assert x.shape == y.shape and np.isfinite(x).all()
    assert np.abs(x - y).max(initial=0) <= limit * max(1, np.abs(y).max(initial=0))


def determined_case(kind, seed):
    """A case whose drives are as many as the freedoms: drives with several coordinates may be more."""
    for number in range(100 * seed, 100 * seed + 100):
        c = random_case(kind, number)
        if 0 < c.model.mobility(c.q).mobility == sum(c.model.joint(name).nv for name in c.drives):
            return c
    raise AssertionError("no such case")


class Motion:
    """A closed mechanism in motion, in both forms."""

    def __init__(self, kind, seed, make=random_case):
        self.case = c = make(kind, seed)
        rng = np.random.default_rng(seed + 1000)
        m, w = c.model, c.welded
        with pytest.warns(UserWarning) if m.mobility(c.q).mobility else _no_warning():
            self.v = m.consistent_velocity(c.q, rng.normal(size=m.nv), given=[])
            self.a = m.consistent_acceleration(c.q, self.v, rng.normal(size=m.nv), given=[])
        self.vw = w.consistent_velocity(c.q_welded, c.in_welded(self.v), given=m.joint_names)
        self.aw = w.consistent_acceleration(c.q_welded, self.vw, c.in_welded(self.a), given=m.joint_names)
        self.external = {"a0": rng.normal(size=6), "b1": rng.normal(size=6)}
        self.tau = rng.normal(size=m.nv)


class _no_warning:
    def __enter__(self):
        return self

    def __exit__(self, *_):
        return False


@pytest.mark.parametrize("kind, seed", CASES)
def test_a_joint_closes_a_loop_as_a_weld_to_its_child_in_the_tree_does(kind, seed):
    x = Motion(kind, seed)
    c, m, w = x.case, x.case.model, x.case.welded
    assert m.mobility(c.q).mobility == w.mobility(c.q_welded).mobility
    own = c.in_welded(np.ones(m.nv)) == 1  # coordinates that both have
    external = x.external
    close_to(c.in_welded(m.inverse_dynamics(c.q, x.v, x.a, external)), w.inverse_dynamics(c.q_welded, x.vw, x.aw, external), 1e-12)
    if sum(m.joint(name).nv for name in c.drives) == m.mobility(c.q).mobility:  # the drives' accelerations are those that are zero
        close_to(c.in_welded(m.bias(c.q, x.v, external)), w.bias(c.q_welded, x.vw, external), 1e-9)
    close_to(c.in_welded(m.gravity_torque(c.q, external)), w.gravity_torque(c.q_welded, external), 1e-12)
    a, aw = m.forward_dynamics(c.q, x.v, x.tau, external), w.forward_dynamics(c.q_welded, x.vw, c.in_welded(x.tau), external)
    close_to(c.in_welded(a), np.where(own, aw, 0), 1e-9)
    close_to(c.in_welded(m.velocity_jump(c.q, external)), np.where(own, w.velocity_jump(c.q_welded, external), 0), 1e-9)
    names = [*m.joint_names, "L"]
    both = m.reactions_unique(c.q, names) & w.reactions_unique(c.q_welded, names)
    for how in ({}, {"axes": "world", "at": "world"}, {"on": "parent", "order": "ang_lin", "at": (0.1, 0.2, 0.3)}):
        if how and not both.all():
            continue
        mine, other = (n.reactions(*state, external, joints=names, **how) for n, state in ((m, (c.q, x.v, x.a)), (w, (c.q_welded, x.vw, x.aw))))
        close_to(np.where(both, mine, 0) if not how else mine, np.where(both, other, 0) if not how else other, 1e-11)


@pytest.mark.parametrize("kind, seed", CASES)
def test_derivatives_along_the_mechanism(kind, seed):
    """By a second way to close the loop, and those of forward dynamics by those of inverse dynamics."""
    x = Motion(kind, seed, determined_case)
    c, m, w = x.case, x.case.model, x.case.welded
    free = m.independent(c.q)
    mine = m.inverse_dynamics_derivatives(c.q, x.v, x.a, x.external)
    other = w.inverse_dynamics_derivatives(c.q_welded, x.vw, x.aw, x.external)
    in_other = np.array([int(np.flatnonzero(c.in_welded(np.eye(m.nv)[i]))[0]) for i in free], dtype=int)
    assert list(w.independent(c.q_welded)) == sorted(in_other)
    for D, E in zip(mine, other):
        close_to(np.array([c.in_welded(column) for column in D[:, np.argsort(in_other)].T]).reshape(len(free), w.nv).T, E, 1e-10)
    tau = m.inverse_dynamics(c.q, x.v, x.a, x.external)
    by_q, by_v, by_tau = m.forward_dynamics_derivatives(c.q, x.v, tau, x.external)
    H = mine[2][free]  # efforts of the drives by their accelerations
    close_to(H @ by_q[free] + mine[0][free], np.zeros((len(free), len(free))), 1e-8)
    close_to(H @ by_v[free] + mine[1][free], np.zeros((len(free), len(free))), 1e-8)
    close_to(H @ by_tau[np.ix_(free, free)], np.eye(len(free)), 1e-8)
    speeds = np.array([[1.0], [0.0], [-2.0]])  # states of a batch have the bits that they have alone
    for call, last in ((m.inverse_dynamics_derivatives, speeds**2 * x.a), (m.forward_dynamics_derivatives, np.tile(tau, (3, 1)))):
        several = call(np.tile(c.q, (3, 1)), speeds * x.v, last, x.external)
        for k in range(3):
            assert all(np.array_equal(D[k], E) for D, E in zip(several, call(c.q, speeds[k] * x.v, last[k], x.external)))


@pytest.mark.parametrize("kind", KINDS)
def test_derivatives_without_drives_are_found_another_way(kind):
    """By other independent coordinates and pivots: those by efforts are the same, and those by velocities follow from each other."""
    x = Motion(kind, 2, determined_case)
    c, m, undriven = x.case, x.case.model, x.case.model.with_drives([])
    _, by_v, by_tau = m.forward_dynamics_derivatives(c.q, x.v, x.tau, x.external)
    _, other_by_v, other_by_tau = undriven.forward_dynamics_derivatives(c.q, x.v, x.tau, x.external)
    free, J = undriven.independent(c.q), m.loop_jacobian(c.q)
    rest = np.setdiff1d(np.arange(m.nv), free)
    G = np.eye(m.nv)[:, free]
    G[rest] = -np.linalg.lstsq(J[:, rest], J[:, free], rcond=1e-9)[0]
    close_to(other_by_v, by_v @ G[m.independent(c.q)], 1e-8)
    close_to(other_by_tau, by_tau, 1e-8)


@pytest.mark.parametrize("kind, seed", CASES)
def test_loops_do_no_work_and_stay_closed(kind, seed):
    x = Motion(kind, seed)
    c, m = x.case, x.case.model
    J = m.loop_jacobian(c.q)
    close_to(J @ x.v, np.zeros(len(J)), 1e-12)
    close_to(m.loop_acceleration(c.q, x.v, x.a), np.zeros(len(J)), 1e-9)
    h, direction = 1e-6, np.random.default_rng(seed).normal(size=m.nv)
    rate = (m.loop_error(m.integrate(c.q, h * direction)) - m.loop_error(m.integrate(c.q, -h * direction))) / (2 * h)
    close_to(rate, J @ direction, 1e-7)
    for q in (c.q, m.integrate(c.q, direction)):  # rates of J v, open loops and velocities that open them among them
        a, step = direction[::-1], 10 * h * direction
        rate = (m.loop_jacobian(m.integrate(q, step)) - m.loop_jacobian(m.integrate(q, -step))) @ direction / (20 * h)
        close_to(m.loop_acceleration(q, direction, a), rate + m.loop_jacobian(q) @ a, 1e-7)
    tree = m.without_loops()
    tau = m.inverse_dynamics(c.q, x.v, x.a, x.external)
    close_to(tau @ x.v, tree.inverse_dynamics(c.q, x.v, x.a, x.external) @ x.v, 1e-11)  # power of motors; constraints have none
    close_to(m.forward_dynamics(c.q, x.v, tau, x.external), x.a, 1e-8)
    parts = m.effort_parts(c.q, x.v, x.a, x.external)
    close_to(parts.sum(axis=0), tau, 1e-12)
    # where loops are not redundant, the wrenches of the joints balance the tree's efforts
    opened = m.integrate(c.q, 0.02 * direction)
    near = m.close(opened)
    if near.converged:
        close_to(m.loop_error(near.q), np.zeros(len(J)), 1e-11)
        along = np.linalg.svd(m.loop_jacobian(near.q))[2][np.linalg.matrix_rank(m.loop_jacobian(near.q), tol=1e-9) :]
        close_to(along @ m.difference(opened, near.q), np.zeros(len(along)), 1e-6)  # nearest: the way there is across all closed motions


@pytest.mark.parametrize("kind", KINDS)
def test_batches_and_single_precision(kind):
    x = Motion(kind, 1)
    c, m = x.case, x.case.model
    if m.mobility(c.q).smallest < 0.02:
        pytest.skip("nearly singular")
    three = lambda y: np.tile(y, (3, 1))
    more = m.with_drives([j.name for j in m.joints if j.nv])
    for call, *last in ((m.inverse_dynamics, x.a), (more.inverse_dynamics, x.a), (m.effort_parts, x.a), (m.bias,), (m.forward_dynamics, x.tau)):
        one = call(c.q, x.v, *last, x.external)
        assert np.array_equal(call(three(c.q), three(x.v), *map(three, last), x.external), np.stack([one] * 3))
        single = call(*(y.astype(np.float32) for y in (c.q, x.v, *last)), {k: w.astype(np.float32) for k, w in x.external.items()})
        assert single.dtype == np.float32
        close_to(single, one, 1e-3)
    names = [*m.joint_names, "L"]
    one = m.reactions(c.q, x.v, x.a, x.external, joints=names)
    assert np.array_equal(m.reactions(three(c.q), three(x.v), three(x.a), x.external, joints=names)[2], one)


def test_refusals_say_what_to_do():
    c = random_case("revolute", 1)
    m, q = c.model, c.q
    zero = np.zeros(m.nv)
    with pytest.raises(ksl.ResultError, match="loop joint L is open at this position by .*close"):
        m.inverse_dynamics(m.integrate(q, np.full(m.nv, 0.1)), zero, zero)
    with pytest.raises(ksl.ResultError, match="these velocities open it .*consistent_velocity"):
        m.forward_dynamics(q, zero + 1, zero)
    with pytest.raises(ksl.ResultError, match="these accelerations open it .*consistent_acceleration"):
        m.inverse_dynamics(q, zero, zero + 1)
    with pytest.raises(ksl.ResultError, match="state 1: loop joint L"):
        m.inverse_dynamics(np.stack([q, m.integrate(q, zero + 0.1)]), zero, zero)
    with pytest.raises(ksl.ResultError, match="the drives leave a freedom"):
        m.with_drives([]).inverse_dynamics(q, zero, zero)
    unknown = ksl.Builder("b").add_link("g").add_link("a", mass=1.0, inertia=np.eye(3)).add_joint("j", "revolute", "g", "a", axis=(0, 0, 1))
    unknown.add_link("c", mass=1.0, inertia=np.eye(3)).add_joint("k", "revolute", "g", "c", axis=(0, 0, 1)).add_loop(
        "l", "cylindrical", "a", "c", axis=(0, 0, 1)
    )
    two = unknown.build()
    with pytest.raises(ksl.ResultError, match="joints that have motors are not known, and the mechanism has 2 freedoms; .* j, k"):
        two.inverse_dynamics([0, 0], [0, 0], [0, 0])
    assert np.allclose(two.forward_dynamics([0, 0], [0, 0], [0, 0]), 0)
    up = np.eye(4)
    up[0, 3] = 0.5  # the length of this mechanism is 1 m, which must not make angles of lengths
    straight = ksl.Builder("s").add_link("g").add_link("a", mass=1.0, inertia=np.eye(3)).add_joint("j", "revolute", "g", "a", axis=(1, 0, 0))
    straight.add_loop("l", "prismatic", "g", "a", up, up, axis=(1, 0, 0))
    with pytest.raises(ksl.ResultError, match=r"these velocities open it by .* rad/s"):
        straight.build(drives=["j"]).inverse_dynamics([0], [1e-3], [0])
    with pytest.raises(ValueError, match="mass_matrix is not available for mechanisms with loops"):
        m.mass_matrix(q)
    with pytest.raises(ValueError, match="no motion of the closed mechanism has these velocities"):
        m.consistent_velocity(q, zero + 1, given=m.joint_names)
    flat = ksl.load_string(
        FOURBAR.replace("0.1 0.03 0", "0.1 0 0").replace("0.35 0.04 0.04", "0.32 0 0").replace("0.32 0.03 0", "0.32 0 0").replace("0.25 0.02 0", "0.1 0 0"),
        drives=["A"],
    )
    assert flat.mobility(np.zeros(3)).mobility == 2  # all links of this parallelogram lie on one line
    with pytest.warns(UserWarning, match="they leave freedoms"):
        v = flat.consistent_velocity(np.zeros(3), [1.0, -1.0, -3.0], given=[])
    with pytest.raises(ValueError, match="no accelerations keep the loops closed at these velocities: the equations lose rank at this position"):
        flat.consistent_acceleration(np.zeros(3), v, np.zeros(3), given=[])


def test_the_closed_door_hangs_on_both_hinges_by_their_stiffness():
    """Two hinges a metre apart carry the moment of the weight, 10 kg half a metre away: 49.05 N each way, as for bearings that give way alike."""
    b = ksl.Builder("door").add_link("wall").add_link("leaf", mass=10.0, center_of_mass=(0.5, 0, 0.5), inertia=np.diag([1.0, 1.0, 1.0]))
    b.add_joint("lower", "revolute", "wall", "leaf", axis=(0, 0, 1))
    up = np.eye(4)
    up[2, 3] = 1.0
    m = b.add_loop("upper", "revolute", "wall", "leaf", up, up, axis=(0, 0, 1)).build(drives=[])
    hinges = ["lower", "upper"]
    assert m.mobility([0.0]).redundant == 5 and not m.reactions_unique([0.0], hinges)[:, :5].any()
    m = m.with_drives(["lower"])
    soft = {name: {"axial": 1e7, "radial": 1e8} for name in hinges}
    wrenches = m.reactions([0.0], [0.0], [0.0], joints=hinges, stiffness={**soft, "upper": [1e8, 1e8, 1e7, 1e-3, 1e-3, 1e-3]})
    assert np.isfinite(wrenches).all()
    weight = 10 * 9.81
    bearings = {name: [1e8, 1e8, 1e7, 1e-2, 1e-2, 1e9] for name in hinges}  # they carry no moments to speak of
    assert m.with_stiffness(bearings).reactions_unique([0.0], hinges).all()
    wrenches = m.reactions([0.0], [0.0], [0.0], joints=hinges, stiffness=bearings)
    close_to(wrenches[:, 0], [-weight / 2, weight / 2] if wrenches[0, 0] < 0 else [weight / 2, -weight / 2], 1e-6)
    close_to(wrenches[:, 2], [weight / 2, weight / 2], 1e-9)
    with pytest.raises(ksl.DescriptionError, match="no joint named"):
        m.with_stiffness({"middle": np.ones(6)})
    with pytest.raises(ValueError, match="every stiffness is positive"):
        m.with_stiffness({"upper": -np.ones(6)})


@pytest.mark.parametrize("kind, speed", [("f4", 1.0), ("f4", 100.0), ("f8", 1.0), ("f8", 1e4)])
def test_rounding_of_a_body_that_keeps_its_axes_is_no_contradiction(kind, speed):
    """Two spherical joints whose accelerations cancel in the second body: what the loop sees are rounding errors of large terms.  A motion that opens it is refused."""
    b = ksl.Builder("two balls").add_link("ground")
    for name, parent in (("first", "ground"), ("second", "first")):
        b.add_link(name, mass=2.0, center_of_mass=(0.2, 0.1, -0.1), inertia=np.diag([0.2, 0.3, 0.4])).add_joint(
            name + " ball", "spherical", parent, name, xyz=(0.1, 0.2, 0.3)
        )
    m = b.add_loop("slides", "translation", "second", "ground").build(drives=["first ball"])
    q = m.close([*np.array([0.1, 0.5, -0.2, 0.8]) / np.linalg.norm([0.1, 0.5, -0.2, 0.8]), 0, 0, 0, 1], hold=m.drives).q
    v = m.consistent_velocity(q, speed * np.array([1, -2, 3, 0, 0, 0]), m.drives)
    a = m.consistent_acceleration(q, v, speed**2 * np.array([3, 1, -2, 0, 0, 0]), m.drives)
    expected = m.inverse_dynamics(q, v / speed, a / speed**2) - m.gravity_torque(q)  # forces of inertia grow with the square
    found = m.inverse_dynamics(*(x.astype(kind) for x in (q, v, a))) - m.gravity_torque(q)
    close_to(found / speed**2, expected, 1e-4 if kind == "f4" else 1e-9)
    _, by_v, by_a = m.inverse_dynamics_derivatives(q, v, a)
    slow = m.inverse_dynamics_derivatives(q, v / speed, a / speed**2)
    close_to(by_v / speed, slow[1], 1e-9)
    close_to(by_a, slow[2], 1e-9)
    with pytest.raises(ksl.ResultError, match="loop joint slides: these accelerations open it by"):
        m.inverse_dynamics(*(x.astype(kind) for x in (q, v, a + 0.1 * speed**2)))


@pytest.mark.parametrize("size", [1e-9, 1e-6, 1e-3, 1e6])
def test_stiffnesses_decide_alike_in_small_and_large_mechanisms(size):
    """A door and its hinges, all lengths times `size` and stiffnesses about axes times its square, have the same forces: stiffnesses in N/m beside N m/rad are no
    measure of each other.  In a micromechanism those along axes counted as rigid."""

    def forces(s):
        b = (
            ksl.Builder("door")
            .add_link("wall")
            .add_link("leaf", mass=10.0, center_of_mass=(0.5 * s, 0.1 * s, 0.3 * s), inertia=np.diag([1.0, 1.0, 1.0]) * s**2)
        )
        b.add_joint("lower", "revolute", "wall", "leaf", axis=(0, 0, 1))
        up = np.eye(4)
        up[2, 3] = s
        m = b.add_loop("upper", "revolute", "wall", "leaf", up, up, axis=(0, 0, 1)).build(drives=["lower"])
        turning = np.array([1, 1, 1, s * s, s * s, s * s])
        stiffness = {"lower": np.array([2e6, 1e6, 3e6, 3e3, 1e3, 1e3]) * turning, "upper": np.array([1e6, 4e6, 1e6, 1e3, 2e3, 1e3]) * turning}
        m = m.with_stiffness(stiffness)
        assert m.reactions_unique([0.0], ["lower", "upper"]).all()
        return m.reactions([0.0], [0.0], [0.0], joints=["lower", "upper"]) / [1, 1, 1, s, s, s]

    close_to(forces(size), forces(1.0), 1e-9)


def test_stiffnesses_go_where_their_joints_go():
    c = random_case("revolute", 1)
    names = [*c.model.joint_names, "L"]
    stiff = c.model.with_stiffness({name: np.full(6, 1e6) for name in names})
    pair = stiff.merged(ksl.Builder("mast").add_link("mast", mass=1.0).build(gravity=tuple(stiff.gravity), masses="optional"), stiff.root, prefix="x_")
    assert pair.loop_names == ["L"] and pair.nv == stiff.nv
    assert c.model.mobility(c.q).redundant or np.allclose(
        pair.reactions(c.q, np.zeros(pair.nv), np.zeros(pair.nv), joints=["L"]), stiff.reactions(c.q, np.zeros(pair.nv), np.zeros(pair.nv), joints=["L"])
    )
    assert stiff.without_loops().loop_names == []
    part = stiff.subtree("a0", loops="drop")
    assert part.loop_names == [] and set(part.joint_names) < set(names)


def test_stiffnesses_of_joints_that_are_reversed():
    """A four-bar with a post that is welded to its frame and bends, under wrenches in balance: whichever link is the root, joints carry the same."""
    at = lambda x, z=0.0: np.block([[np.eye(3), np.array([[x], [0], [z]])], [np.zeros((1, 3)), 1]])
    b = ksl.Builder("four-bar").add_link("frame", mass=1.0, inertia=np.eye(3))
    for name in ("crank", "coupler", "post", "rocker"):
        b.add_link(name, mass=1.0, center_of_mass=(0.1, 0, 0), inertia=np.eye(3) * 0.1)
    b.add_joint("A", "continuous", "frame", "crank", axis=(0, 1, 0)).add_joint("B", "continuous", "crank", "coupler", pose=at(0.2), axis=(0, 1, 0))
    b.add_joint("W", "fixed", "frame", "post", pose=at(0.5, -0.3)).add_joint("D", "continuous", "post", "rocker", pose=at(0.1, 0.3), axis=(0, 1, 0))
    m = b.add_loop("C", "revolute", "coupler", "rocker", at(0.6), at(0.5), axis=(0, 1, 0)).build(drives=["A"], gravity=(0, 0, 0))
    L = np.random.default_rng(1).normal(size=(6, 6))
    stiffness = {name: {"axial": 2e7, "radial": 1e8, "tilting": 1e5} for name in "ABCD"} | {"W": 1e6 * (L @ L.T + np.eye(6))}
    stiff = m.with_stiffness(stiffness)
    start = m.neutral()
    start[[m.joint("A").q_index, m.joint("B").q_index, m.joint("D").q_index]] = -1.0, 0.4, -1.5
    q, still = m.close(start, hold=["A"]).q, np.zeros(m.nv)
    force, moment = np.array([30.0, 50.0, -20.0]), np.array([5.0, -3.0, 8.0])
    one, two = (m.frame_pose(q, link) for link in ("coupler", "rocker"))
    at_world = np.r_[-force, -moment - np.cross(one[:3, 3], force)]  # of the second wrench
    push = {
        link: np.r_[T[:3, :3].T @ f[:3], T[:3, :3].T @ (f[3:] - np.cross(T[:3, 3], f[:3]))]
        for link, T, f in (("coupler", one, -at_world), ("rocker", two, at_world))
    }
    names = ["A", "B", "C", "D", "W"]
    how = {"joints": names, "axes": "frame", "at": "frame"}
    expected = stiff.reactions(q, still, still, push, **how)
    assert np.abs(expected - m.reactions(q, still, still, push, **how)).max() > 1  # stiffnesses decide something
    for link in ("crank", "coupler", "post", "rocker"):
        r = stiff.with_root(link)
        q_new = r.neutral()
        for name in ("A", "B", "D"):
            q_new[r.joint(name).q_index] = q[m.joint(name).q_index]
        signs = np.array([-1.0 if name in m.support(link) else 1.0 for name in names])
        close_to(signs[:, None] * r.reactions(q_new, still, still, push, **how), expected, 1e-8)
    turning = m.with_stiffness({"A": [1e6, 2e6, 1e6, 1e5, 1e5, 1e5], "B": [1e6, 2e6, 3e6, 1e5, 1e5, 1e5]})
    with pytest.raises(
        ksl.DescriptionError, match="joint B would have to be reversed to make link coupler the root, and its stiffness, which moves with its child"
    ):
        turning.with_root("coupler")
    assert turning.with_root("crank").root == "crank"  # the same all round the axis


def bench_of_bars(welds, seed=0):
    """Two planar four-bars on one crank, of which all loops are redundant, in a random plane; joints lie anywhere along their axes.  With welds in the ways of the loops."""
    rng = np.random.default_rng(seed)
    at = lambda x, z=0.0: np.block([[np.eye(3), np.array([[x], [rng.uniform(-0.1, 0.1)], [z]])], [np.zeros((1, 3)), 1]])
    b = ksl.Builder("bars", gravity=(1.0, -2.0, 9.0)).add_link("ground")
    for name in ("crank", "coupler", "rocker", "rod", "slider"):
        b.add_link(name, **body(rng))
    last, tail, about = "coupler", "rod", {"axis": (0, 1, 0)}
    b.add_joint("A", "continuous", "ground", "crank", pose=pose(rng), **about).add_joint("B", "continuous", "crank", "coupler", pose=at(0.2), **about)
    if welds:
        b.add_link("tip", **body(rng)).add_link("post", **body(rng)).add_link("end")
        b.add_joint("W1", "fixed", "coupler", "tip", pose=at(0.2, 0.1)).add_joint("W2", "fixed", "crank", "post", pose=at(0.05))
        last = "tip"
    b.add_joint("E", "continuous", "post" if welds else "crank", "rod", pose=at(0.1, 0.1), **about)
    if welds:
        b.add_joint("W3", "fixed", "rod", "end", pose=at(0.1))
        tail = "end"
    b.add_joint("C", "continuous", last, "rocker", pose=at(0.4), **about)
    b.add_joint("F", "prismatic", "rocker", "slider", pose=at(0.1), axis=(1, 0, 0))
    tree = b.build()
    q = tree.neutral()
    for name, x in zip("ABECF", (-1.0, 0.4, 0.9, 1.4, 0.05)):
        q[tree.joint(name).q_index] = x
    world = {name: tree.frame_pose(q, name) for name in tree.link_names}
    to = lambda link, target: np.linalg.inv(world[link]) @ world[target]
    on_rocker, on_rod = at(0.3), at(0.2, 0.05)
    b.add_loop("D", "revolute", "rocker", "ground", on_rocker, to("ground", "rocker") @ on_rocker, **about)
    b.add_loop("G", "revolute", tail, "slider", on_rod, to("slider", tail) @ on_rod, **about)
    return b.build(drives=["A"]), q


@pytest.mark.parametrize("stiff", [None, "all", "some"])
@pytest.mark.parametrize("welds", [False, True])
def test_redundant_mechanisms_in_lanes(welds, stiff):
    """Whatever a batch has beside a state.  The wrenches balance as external ones of the tree, and no pattern that may be added makes them smaller, or lowers their
    energy."""
    m, q = bench_of_bars(welds)
    assert m.mobility(q).mobility == 1 and m.mobility(q).redundant == 6
    rng = np.random.default_rng(1)
    names = [*(j.name for j in m.joints if j.name != "base"), "D", "G"]
    C = np.stack([np.eye(6)] * len(names))
    if stiff:
        L = rng.normal(size=(len(names), 6, 6))
        K = L @ L.transpose(0, 2, 1) + np.eye(6)
        C = np.linalg.inv(K)
        rigid = m
        m = m.with_stiffness({name: 1e5 * k for name, k in zip(names, K) if stiff == "all" or name in "BDG"})
    Q = np.array([m.close(q + x * (np.arange(m.nq) == m.joint("A").q_index), hold=["A"]).q for x in np.linspace(-0.3, 0.3, 11)])
    V = np.array([m.consistent_velocity(p, rng.normal(size=m.nv), given=["A"]) for p in Q])
    A = np.array([m.consistent_acceleration(p, v, rng.normal(size=m.nv), given=["A"]) for p, v in zip(Q, V)])
    external = {"coupler": rng.normal(size=6), "slider": rng.normal(size=(11, 6))}
    tau = m.inverse_dynamics(Q, V, A, external)
    assert np.abs(tau[:, [m.joint(n).v_index for n in "BECF"]]).max() == 0
    for axes in ("link", "world"):
        pushed = dict(external_axes=axes)
        found = m.reactions(Q, V, A, external, joints=names, **pushed)
        for k in (0, 7):
            here = {"coupler": external["coupler"], "slider": external["slider"][k]}
            assert np.array_equal(m.reactions(Q[k], V[k], A[k], here, joints=names, **pushed), found[k])
        ends = {}
        for loop in m.loops:
            for link, side in ((loop.successor, "child"), (loop.predecessor, "parent")):
                frame = {"link": {"at": link, "axes": link}, "world": {"at": link, "axes": "world"}}[axes]
                ends[link] = ends.get(link, 0) + m.reactions(Q, V, A, external, joints=[loop.name], on=side, **frame, **pushed)[:, 0] + external.get(link, 0)
        balanced = m.without_loops().reactions(Q, V, A, {**external, **ends}, joints=names[:-2], **pushed)
        close_to(found[:, :-2], balanced, 1e-11)
        for p, f in zip(Q, found):
            patterns = (rigid if stiff else m).reactions_null_basis(p, names)
            assert len(patterns) == 6
            if stiff != "some":
                close_to(np.einsum("kji,jil,jl->k", patterns, C, f) / np.abs(np.einsum("jil,jl->ji", C, f)).max(), np.zeros(6), 1e-9)
    single = m.reactions(*(x.astype(np.float32) for x in (Q, V, A)), {k: np.float32(w) for k, w in external.items()}, joints=names, external_axes="world")
    close_to(single, found, 2e-3)
