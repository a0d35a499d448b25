"""Compliances and deflections against energies of reactions, Jacobians, and beams by hand."""

import numpy as np
import pytest

import ksl
from linkages import FOURBAR, at, four_bar

PIN = {"axial": 2e5, "radial": 4e5, "tilting": 300.0}


def arm():
    b = ksl.Builder("arm").add_link("ground")
    rng, parent = np.random.default_rng(3), "ground"
    for k, kind in enumerate(("revolute", "prismatic", "continuous")):
        b.add_link(f"l{k}", mass=1 + k, center_of_mass=rng.normal(size=3) * 0.1, inertia=np.diag([0.02, 0.03, 0.04]))
        b.add_joint(f"j{k}", kind, parent, f"l{k}", xyz=rng.normal(size=3) * 0.4, rpy=rng.normal(size=3), axis=rng.normal(size=3))
        parent = f"l{k}"
    return b.build()


def four_bar_with_pins():
    m = ksl.load_string(FOURBAR, drives=["A"])
    return m, m.close(m.neutral()).q, {"A": {**PIN, "motion": 900.0}, "B": PIN, "C": PIN, "D": PIN}


def test_drives_alone_give_way_by_the_jacobian():
    m = arm()
    q = m.random(1)
    k = np.array([2e3, 5e4, 700.0])
    stiffness = dict(zip(m.joint_names, k))
    for axes in ("frame", "world"):
        J = m.jacobian(q, "l2", axes=axes)
        wanted = J @ np.diag(1 / k) @ J.T
        np.testing.assert_allclose(m.compliance(q, "l2", stiffness=stiffness, axes=axes), wanted, atol=1e-14)
        np.testing.assert_allclose(m.with_stiffness(stiffness).compliance(q, "l2", axes=axes), wanted, atol=1e-14)


def test_a_cantilever_and_a_bearing_by_hand():
    b = ksl.Builder("cantilever").add_link("wall").add_link("root").add_link("tip", 1.0, (0, 0, 0), np.eye(3) * 1e-3)
    m = b.add_joint("clamp", "fixed", "wall", "root").add_joint("end", "fixed", "root", "tip", xyz=(0.5, 0, 0)).build()
    kx, ky, kt = 1e6, 2e5, 4e3
    C = m.compliance([], "tip", stiffness={"clamp": [kx, ky, ky, kt, kt, kt]})
    np.testing.assert_allclose(np.diag(C), [1 / kx, 1 / ky + 0.25 / kt, 1 / ky + 0.25 / kt, 1 / kt, 1 / kt, 1 / kt], rtol=1e-13)
    np.testing.assert_allclose([C[1, 5], C[2, 4]], [0.5 / kt, -0.5 / kt], rtol=1e-13)
    off = m.deflection([], [], [], "tip", stiffness={"clamp": [kx, ky, ky, kt, kt, kt]})
    np.testing.assert_allclose(off, C[:, 2] * -9.81, atol=1e-16)


def test_a_closed_mechanism_by_castigliano():
    """The energy of its reactions of least energy, and of the drive, is ½ f C f."""
    m, q, stiffness = four_bar_with_pins()
    m = m.with_gravity((0, 0, 0)).with_stiffness(stiffness)
    names, rest = [*m.joint_names, "C"], np.zeros(m.nv)
    compliances = [np.diag(x) for x in (_pin(900.0), _pin(None), _pin(None), _pin(None))]

    def energy(f):
        through = m.reactions(q, rest, rest, external={"coupler": f}, joints=names)
        return sum(w @ C @ w for w, C in zip(through, compliances)) / 2

    each = np.eye(6)
    wanted = np.array([[energy(x + y) - energy(x) - energy(y) for x in each] for y in each])
    np.testing.assert_allclose(m.compliance(q, "coupler"), wanted, rtol=1e-8, atol=1e-9 * np.abs(wanted).max())
    push = np.array([3.0, -2.0, 5.0, 0.1, 0.2, -0.3])
    np.testing.assert_allclose(m.deflection(q, rest, rest, "coupler", external={"coupler": push}), wanted @ push, rtol=1e-8, atol=1e-12)


def _pin(motion):
    """Compliances along the axes of a pin's frame, whose axis is y."""
    return [1 / PIN["radial"], 1 / PIN["axial"], 1 / PIN["radial"], 1 / PIN["tilting"], 1 / motion if motion else 0.0, 1 / PIN["tilting"]]


def test_each_joint_gives_way_by_its_compliance_times_what_it_transmits():
    m = arm()
    rng = np.random.default_rng(0)
    q, v, a = m.random(1, size=4), rng.normal(size=(4, 3)), rng.normal(size=(4, 3))
    stiffness = {name: [1e5, 2e5, 3e5, 400.0, 500.0, 600.0] for name in m.joint_names} | {"j1": {"motion": 2e4}}
    shares = m.deflection(q, v, a, "l2", stiffness=stiffness, by="joint")
    assert shares.shape == (4, len(m.joints), 2, 6)
    np.testing.assert_allclose(m.deflection(q, v, a, "l2", stiffness=stiffness), shares.sum(axis=(1, 2)), atol=1e-15)
    f = m.reactions(q, v, a)
    for k in range(4):  # the last joint: the frame is its own
        np.testing.assert_allclose(shares[k, 2].sum(axis=0), -f[k, 2] / np.array(stiffness["j2"]), rtol=1e-10)
    along = np.einsum("ni,ki->kn", [[*m.joints[1].axis, 0, 0, 0]], f[:, 1])[:, 0] / -2e4
    slide = np.array([m.jacobian(x, "l2")[:, 1] for x in q])
    np.testing.assert_allclose(shares[:, 1, 0], slide * along[:, None], rtol=1e-10)
    assert not shares[:, 1, 1].any()


def test_what_nothing_resists_is_named():
    b = ksl.Builder("rotor").add_link("ground").add_link("shaft", 12.0, (0.14, 0, 0), np.diag([0.05, 0.09, 0.09]))
    b.add_joint("A", "continuous", "ground", "shaft", axis=(1, 0, 0))
    m = b.add_loop("B", "cylindrical", "ground", "shaft", at([0.4, 0, 0]), at([0.4, 0, 0]), axis=(1, 0, 0)).build(drives=[])
    pins = {"A": {"axial": 8e7, "radial": 1e8, "tilting": 0.0}, "B": {"radial": 1e8, "tilting": 0.0}}
    with pytest.raises(
        ValueError, match="A: the stiffnesses leave a motion that nothing resists, under a load; give one of these joints a stiffness along its motion"
    ):
        m.compliance([0.1], "shaft", stiffness=pins)
    np.testing.assert_allclose(np.diag(m.with_drives(["A"]).compliance([0.0], "shaft", stiffness=pins))[:4], [1 / 8e7, 1e-8, 1e-8, 0], rtol=1e-12, atol=1e-24)
    with pytest.raises(ValueError, match="hinge: the stiffnesses leave"):
        lid = (
            ksl.Builder("lid").add_link("box").add_link("lid", 1.0, (0.1, 0, 0), np.eye(3)).add_joint("hinge", "revolute", "box", "lid", axis=(0, 1, 0)).build()
        )
        lid.deflection([0.0], [0.0], [0.0], "lid", stiffness={"hinge": 0.0})
    with pytest.raises(ValueError, match="A: the stiffnesses leave a motion that nothing resists"):
        m.with_stiffness(pins).compliance([0.1], "shaft")
    with pytest.raises(ValueError, match="hinge: the stiffnesses leave"):  # however small the load is
        lid.with_gravity((0, 0, -1e-15)).deflection([0.0], [0.0], [0.0], "lid", stiffness={"hinge": 0.0})
    for bad in ({"axes": "joint"}, {"by": "link"}):
        with pytest.raises(ValueError, match=next(iter(bad))):
            m.deflection([0.0], [0.0], [0.0], "shaft", stiffness=pins, **bad)


@pytest.mark.parametrize("own", [None, 500.0])
@pytest.mark.parametrize("ratio", [0.5, -2.0])
def test_springs_of_mimic_joints_count(ratio, own):
    """A follower is stretched by what its leader does, and by its own gear's twist: 1/2 K x² + 1/2 G y² + 1/2 k (r x + y)²."""
    b = ksl.Builder("pair").add_link("ground").add_link("near", 2.0, (0.5, 0, 0), np.eye(3) * 0.2).add_link("far", 1.0, (0.5, 0, 0), np.eye(3) * 0.1)
    b.add_joint("leads", "revolute", "ground", "near", axis=(0, 1, 0), spring_stiffness=700.0)
    b.add_joint("follows", "revolute", "near", "far", axis=(0, 1, 0), xyz=(0.7, 0, 0), spring_stiffness=1000.0, mimic=("leads", ratio, 0.1))
    m = b.build(physics="spring")
    given = {"leads": 3000.0} | ({"follows": own} if own else {})
    stretch, J = np.array([[ratio, 1.0], [1 + ratio, 1.0]])[:, None, : len(given)]
    K = np.diag([3700.0, 500.0][: len(given)]) + 1000.0 * stretch.T @ stretch
    assert m.compliance([0.2], "far", stiffness=given)[4, 4] == pytest.approx(float((J @ np.linalg.solve(K, J.T))[0, 0]), rel=1e-12)
    found = m.modes([0.2], stiffness=given, gravity=False)
    if own:
        assert found.strain.sum(axis=1) == pytest.approx([1, 1], rel=1e-12) and found.joints == ("leads", "follows")
    else:
        assert (2 * np.pi * found.frequencies) ** 2 * m.mass_matrix([0.2])[0, 0] == pytest.approx([K[0, 0]], rel=1e-12)
        assert found.strain[0] == pytest.approx([3700 / K[0, 0], 1000 * ratio**2 / K[0, 0]], rel=1e-12)


def test_gears_of_mimic_joints_and_their_leaders_twist_by_what_goes_through_them():
    """A leader's gear has the efforts of its followers, too: of classes, K1 up to 1 N m, then K2."""
    b = ksl.Builder("pair").add_link("ground").add_link("near", 2.0, (0.5, 0, 0), np.eye(3)).add_link("far", 1.0, (0.5, 0, 0), np.eye(3))
    b.add_joint("leads", "revolute", "ground", "near", axis=(0, 1, 0))
    b.add_joint("follows", "revolute", "near", "far", axis=(0, 1, 0), xyz=(0.7, 0, 0), mimic=("leads", -2.0, 0.0))
    m, gear = b.build(), {"motion": {"stiffness": [1000.0, 5000.0], "effort": [1.0]}}
    weight = 9.81 * np.cos([0.2, -0.2]) @ [[1.0 + 0.7, 0.0], [0.5, 0.5]]  # N m about both joints, turned down
    for joint, load, moved in (("leads", weight[0] - 2 * weight[1], 1 - 2.0), ("follows", weight[1], 1.0)):
        twist = np.sign(load) * (1 / 1000 + (abs(load) - 1) / 5000)
        assert abs(load) > 1 and m.deflection([0.2], [0], [0], "far", stiffness={joint: gear})[4] == pytest.approx(moved * twist, rel=1e-12)
        assert m.compliance([0.2], "far", stiffness={joint: gear})[4, 4] == pytest.approx(moved**2 / 5000, rel=1e-12)


def test_what_springs_of_joints_carry_twists_no_gear():
    """A counterbalance takes its share of the weight before anything gives way: k₁ up to 1 N m, then k₂, beside the spring's own stiffness."""
    b = ksl.Builder("arm").add_link("wall").add_link("rod", 4.0, (0.5, 0, 0), np.diag([0, 0.3, 0.3]))
    m = b.add_joint("hinge", "revolute", "wall", "rod", axis=(0, -1, 0), spring_stiffness=30.0, spring_rest=0.9).build(physics="spring")
    for q in (0.3, 0.2):  # less than 1 N m, and more, downwards
        effort = 4 * 9.81 * 0.5 * np.cos(q) + 30 * (q - 0.9)
        twist = np.sign(effort) * (min(abs(effort), 1) / 1000 + max(abs(effort) - 1, 0) / 5000)
        for given, k in ((4000.0, 4000.0), ({"motion": {"stiffness": [1000.0, 5000.0], "effort": [1.0]}}, effort / twist)):
            assert m.deflection([q], [0], [0], "rod", stiffness={"hinge": given})[4] == pytest.approx(effort / (k + 30), rel=1e-12)


def test_springs_and_dampers_where_no_motor_is_are_loads_of_the_drive():
    """u (k r² + K) = τ with r = ω of the rocker over that of the crank: the drive alone gives way by its effort τ, and the spring k resists with it."""
    m = four_bar(spring_stiffness=25.0, spring_rest=0.3, damping=3.0).with_physics(["spring", "damping"])
    q = m.close([-1.0, 0.4, -1.5]).q
    unit = m.consistent_velocity(q, [1.0, 0, 0], given=["A"])
    for speed in (0.0, 2.0):
        v = speed * unit
        a = m.consistent_acceleration(q, v, np.zeros(3), given=["A"])
        effort = m.inverse_dynamics(q, v, a)[0] - 3.0 * v[0]  # less what the damper beside the motor takes
        off = m.deflection(q, v, a, "crank", stiffness={"A": 800.0}, axes="world")
        np.testing.assert_allclose(off[4], -effort / (800 + 25 * unit @ unit), rtol=1e-10)
