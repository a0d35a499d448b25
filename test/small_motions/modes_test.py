"""Natural frequencies against closed forms, mass matrices of the same joints drawn out as six, and energies of closed positions."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import ksl
from ksl.mechanism import stiffness as stiffnesses
from linkages import FOURBAR, FREE_COUPLER, SLIDERCRANK, at, four_bar

GIVES = {"axial": 3e5, "radial": 8e5, "tilting": 900.0, "motion": 150.0}


def hertz(k, m):
    return math.sqrt(k / m) / (2 * math.pi)


def beam(pieces, length=1.2, EI=340.0, density=1.6):
    """A cantilever along x as rigid pieces, hinged in their middles: half a piece bends at the root."""
    h = length / pieces
    b, q = ksl.Builder("beam").add_link("wall"), {}
    for k in range(pieces):
        inertia = np.diag([1e-9, density * h**3 / 12, density * h**3 / 12])
        b.add_link(f"l{k}", mass=density * h, center_of_mass=(h / 2, 0, 0), inertia=inertia)
        b.add_joint(f"b{k}", "revolute", f"l{k - 1}" if k else "wall", f"l{k}", pose=at([h if k else 0, 0, 0]), axis=(0, 1, 0))
        q[f"b{k}"] = (1 if k else 2) * EI / h
    return b.build(), q


def test_a_chain_bends_as_a_beam_does_and_errs_as_the_square_of_its_pieces():
    exact = np.array([1.8751040687, 4.6940911330, 7.8547574382]) ** 2 * math.sqrt(340.0 / 1.6) / 1.2**2 / (2 * math.pi)
    errors = []
    for pieces in (10, 20):
        m, stiffness = beam(pieces)
        errors.append(1 - m.modes(np.zeros(pieces), stiffness=stiffness, gravity=False).frequencies[:3] / exact)
    assert (errors[1] > 0.001).all() and (errors[1] < 0.007).all(), errors
    np.testing.assert_allclose(errors[0] / errors[1], 4, rtol=0.05)


def test_rotors_turn_with_their_gears_and_armatures_as_they_are():
    """√(k / (I + armature + J N²)) / 2π, and of these what physics name."""
    b = ksl.Builder("wheel").add_link("ground").add_link("wheel", 1.0, (0, 0, 0), np.eye(3) * 0.3)
    b.add_joint("turn", "revolute", "ground", "wheel", axis=(0, 0, 1), armature=0.05, rotor_inertia=1e-3, gear_ratio=20.0)
    for physics, inertia in (([], 0.3), (["armature"], 0.35), (["rotor"], 0.7), (["armature", "rotor"], 0.75)):
        assert b.build(physics=physics).modes([0.4], stiffness={"turn": 900.0}).frequencies == pytest.approx([hertz(900.0, inertia)], rel=1e-12)


def arm():
    """Three joints with oblique axes, of three kinds, and a welded tool."""
    b = ksl.Builder("arm").add_link("ground")
    rng, parent = np.random.default_rng(5), "ground"
    for k, kind in enumerate(("revolute", "prismatic", "continuous")):
        b.add_link(f"l{k}", mass=1 + k, center_of_mass=rng.normal(size=3) * 0.1, inertia=np.diag([0.02, 0.03, 0.04]) * (k + 1))
        b.add_joint(f"j{k}", kind, parent, f"l{k}", xyz=rng.normal(size=3) * 0.4, rpy=rng.normal(size=3), axis=rng.normal(size=3), armature=0.01)
        parent = f"l{k}"
    b.add_link("tool", mass=0.5, center_of_mass=(0, 0.1, 0), inertia=np.eye(3) * 1e-3).add_joint("weld", "fixed", "l2", "tool", xyz=(0.2, 0, 0.1))
    return b


def drawn_out(m, q, gives):
    """The same arm about q: each joint, and the weld, as three slides and three hinges between massless links, with the six stiffnesses of these."""
    b, k, start = ksl.Builder("drawn out").add_link("ground"), [], "ground"
    poses = {name: np.asarray(m.frame_pose(q, f"link:{name}")) for name in m.link_names}
    for joint in (*m.joints[:3], m.joint("weld")):
        pose = np.linalg.inv(poses[joint.parent]) @ poses[joint.child]
        z = np.array(joint.axis) if any(joint.axis) else np.array([0, 0, 1.0])
        x = np.cross(z, [0.3, 0.5, 0.8])
        axes = [v / np.linalg.norm(v) for v in (x, np.cross(z, x), z)]
        slides = [gives["radial"]] * 2 + [gives["motion" if joint.kind == "prismatic" else "axial"]]
        turns = [gives["tilting"]] * 2 + [gives["motion"] if joint.kind in ("revolute", "continuous") else np.inf]
        above = start
        for i, (stiffness, axis) in enumerate(zip([*slides, *turns], [*axes, *axes])):
            last = i == 5
            name = joint.child if last else f"{joint.name}_{i}"
            link = m.link(joint.child)
            b.add_link(name, link.mass, np.array(link.first_moment) / link.mass, central(link)) if last else b.add_link(name)
            kind = "fixed" if stiffness == np.inf else "prismatic" if i < 3 else "continuous"
            b.add_joint(f"{joint.name}_{i}", kind, above, name, pose=np.eye(4) if i else pose, axis=None if kind == "fixed" else axis)
            k += [] if stiffness == np.inf else [stiffness]
            above = name
        start = above
    return b.build(), np.array(k)


def central(link):
    xx, yy, zz, xy, yz, zx = link.inertia
    c = np.array(link.first_moment) / link.mass
    return np.array([[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]]) - link.mass * (c @ c * np.eye(3) - np.outer(c, c))


def test_six_compliances_in_every_joint_and_a_weld_are_those_of_the_mechanism_that_is_drawn_out():
    m = arm().build()
    q = m.random(2)
    weld = [8e5, 8e5, 3e5, 900.0, 900.0, np.inf]
    modes = m.modes(q, stiffness={"j0": GIVES, "j1": {key: k for key, k in GIVES.items() if key != "axial"}, "j2": GIVES, "weld": weld}, gravity=False)
    other, k = drawn_out(m, q, GIVES)
    M = other.mass_matrix(np.zeros(other.nq))
    half = np.linalg.cholesky(M)
    squares, x = np.linalg.eigh(np.linalg.solve(half, np.linalg.solve(half, np.diag(k)).T))
    np.testing.assert_allclose(modes.frequencies, np.sqrt(squares) / (2 * np.pi), rtol=1e-9)
    energies = k[:, None] * np.linalg.solve(half.T, x) ** 2 / squares
    np.testing.assert_allclose(modes.strain.T, np.add.reduceat(energies, [0, 6, 11, 17]), atol=1e-9)  # six of each, but for turns about a slide and the weld
    moved = m.mass - m.link("ground").mass
    six = m.modes(q, stiffness={"j0": [1e6] * 6, "j1": 1e4, "j2": 1e3}, gravity=False)
    np.testing.assert_allclose(six.effective_mass.sum(axis=0)[:3], moved, rtol=1e-9)  # the ground's translations are motions of the first joint


def test_armature_counts_as_in_mass_matrices_and_mimic_joints_follow():
    b = arm().add_link("hand", mass=0.3, center_of_mass=(0.1, 0, 0), inertia=np.eye(3) * 1e-3)
    m = b.add_joint("follows", "revolute", "tool", "hand", xyz=(0, 0, 0.1), axis=(0, 1, 0), mimic=("j2", -2.0, 0.1)).build(physics="armature")
    q, k = m.random(1), np.array([200.0, 3e4, 50.0])
    found = m.modes(q, stiffness=dict(zip(m.joint_names, k)), gravity=False)
    squares = np.linalg.eigvals(np.linalg.solve(m.mass_matrix(q), np.diag(k)))
    np.testing.assert_allclose(found.frequencies, np.sqrt(np.sort(squares.real)) / (2 * np.pi), rtol=1e-10)


def foot_on_a_plane():
    """Two hinges and a universal joint carry it: the plane holds it by moments, too."""
    b = ksl.Builder("foot").add_link("ground").add_link("crank", 0.6, (0.05, 0.01, 0.02), np.eye(3) * 0.01)
    b.add_link("rod", 1.1, (0.1, -0.02, 0.05), np.eye(3) * 0.02).add_link("foot", 0.9, (0.02, 0.05, -0.1), np.diag([0.01, 0.02, 0.015]))
    b.add_joint("A", "continuous", "ground", "crank", axis=(0, -1, 0)).add_joint("B", "continuous", "crank", "rod", xyz=(0.1, 0.03, 0), axis=(0.6, 0, 0.8))
    b.add_joint("U", "universal", "rod", "foot", xyz=(0.2, 0.1, -0.1), axis=(1, 0, 0), axis2=(0, 0.8, 0.6))
    return b.add_loop("C", "planar", "foot", "ground", at([0, 0, 0]), at([0.3, 0.13, -0.1]), axis=(0.48, 0.6, 0.64)).build(drives=["A"])


@pytest.mark.parametrize("text", [FOURBAR, FREE_COUPLER, SLIDERCRANK, "foot"])
def test_gravity_along_closed_mechanisms_is_the_second_difference_of_the_energies_of_closed_positions(text):
    """The multipliers' curvature of the loops is in it.  A coupler that floats, with both of its pins in loops, is the same mechanism."""
    m = foot_on_a_plane() if text == "foot" else ksl.load_string(text, drives=["A"])
    start = m.close(m.neutral()).q
    q = m.close(m.integrate(start, m.consistent_velocity(start, 0.4 * np.eye(m.nv)[0], ["A"])), hold=["A"]).q
    unit, h = m.consistent_velocity(q, np.eye(m.nv)[0], ["A"]), 1e-2

    def potential(angle):
        return float(m.energy(m.close(m.integrate(q, angle * unit), hold=["A"]).q, np.zeros(m.nv))[1])

    U = [potential(k * h) for k in range(-3, 4)]
    second = (2 * U[0] - 27 * U[1] + 270 * U[2] - 490 * U[3] + 270 * U[4] - 27 * U[5] + 2 * U[6]) / (180 * h * h)
    mass = 2 * float(m.energy(q, unit)[0])
    found = m.modes(q, stiffness={"A": 0.5})
    assert len(found.frequencies) == 1 and abs(second) > 0.05
    np.testing.assert_allclose((2 * np.pi) ** 2 * found.frequencies[0] * abs(found.frequencies[0]), (0.5 + second) / mass, rtol=1e-7)
    np.testing.assert_allclose(abs(found.shapes[0, m.link_names.index("crank"), 4]), 1 / math.sqrt(mass), rtol=1e-9)


def test_springs_of_joints_at_a_pose_at_rest_are_those_of_linear_models():
    """By the derivatives of the compiled dynamics: a tree, and a closed mechanism about its equilibrium."""
    text = FOURBAR.replace('<axis xyz="0 -1 0"/><limit', '<axis xyz="0 -1 0"/><dynamics damping="0" spring_stiffness="6" spring_reference="0.2"/><limit')
    m = ksl.load_string(text, drives=["A"], physics="spring")
    rest = m.equilibrium(m.close(m.neutral()).q)
    poles = np.linalg.eigvals(m.linearise(rest.q).A)
    assert rest.converged and rest.stable
    np.testing.assert_allclose(m.modes(rest.q, stiffness={"A": 0.0}).frequencies, poles.imag.max() / (2 * np.pi), rtol=1e-9)
    b = arm()
    for name, ends, how in (
        ("pull", ("ground", (0.3, 0.2, 0), "l2", (0, 0.1, 0.1)), {"stiffness": 150.0, "free_length": 0.1}),
        ("short", ("ground", (0, 0.4, 0), "l1", (0.1, 0, 0)), {"stiffness": 20.0, "limits": (9.0, None), "stop_stiffness": 500.0}),
        ("long", ("l0", (0, 0, 0), "tool", (0, 0, 0.1)), {"limits": (None, 0.01), "stop_stiffness": 500.0}),
    ):
        b.add_force_element(name, *ends, **how)
    m = b.build(physics="force elements")
    q = m.random(3)
    squares = np.sort(np.linalg.eigvals(np.linalg.solve(m.mass_matrix(q), m.stiffness(q) + np.diag([0, 1e3, 0]))).real)
    found = m.modes(q, stiffness={"j0": 0.0, "j1": 1e3, "j2": 0.0}).frequencies
    np.testing.assert_allclose(np.sign(found) * (2 * np.pi * found) ** 2, squares, rtol=1e-9)


def test_springs_of_joints_that_follow_load_the_loops_by_what_they_are_stretched():
    """At rest under its springs alone, the drive's with them, a four-bar sways as the compiled dynamics say."""
    m = four_bar(spring_stiffness=20.0, spring_rest=0.3).with_physics("spring")
    rest = m.equilibrium(m.close([-1.0, 0.4, -1.5]).q)
    poles = np.linalg.eigvals(m.linearise(rest.q).A)
    assert rest.converged and rest.stable and abs(m.inverse_dynamics(rest.q, np.zeros(3), np.zeros(3))[0]) < 1e-9
    np.testing.assert_allclose(m.modes(rest.q, stiffness={"A": 0.0}).frequencies, poles.imag.max() / (2 * np.pi), rtol=1e-9)


def test_a_drive_without_stiffness_holds_by_its_torque():
    """It is the limit of soft ones: what holds the pose is not what the loops must hold."""
    m = four_bar()
    q = m.close([-1.0, 0.4, -1.5]).q
    none, soft = (m.modes(q, stiffness={"A": k}).frequencies for k in (0.0, 1e-9))
    np.testing.assert_allclose(none, soft, rtol=1e-8)


def rotor():
    """A shaft along x on two bearings 0.4 m apart; its centroid is 0.14 m from the first."""
    b = ksl.Builder("rotor").add_link("ground").add_link("shaft", 12.0, (0.14, 0, 0), np.diag([0.05, 0.09, 0.09]))
    b.add_joint("A", "continuous", "ground", "shaft", xyz=(0, 0, 0.5), axis=(1, 0, 0))
    return b.add_loop("B", "cylindrical", "ground", "shaft", at([0.4, 0, 0.5]), at([0.4, 0, 0]), axis=(1, 0, 0)).build(drives=["A"])


def test_a_shaft_on_bearings_that_tilt_freely_is_a_body_on_two_springs():
    k1, k2, axial = 1.2e8, 9e7, 8e7
    given = {"A": {"axial": axial, "radial": k1, "tilting": 0.0}, "B": {"radial": k2, "tilting": 0.0}}
    M, K = np.diag([12.0, 0.09]), np.array([[k1 + k2, -k1 * 0.14 + k2 * 0.26], [-k1 * 0.14 + k2 * 0.26, k1 * 0.14**2 + k2 * 0.26**2]])
    pair = np.sqrt(np.sort(np.linalg.eigvals(np.linalg.solve(M, K)).real)) / (2 * np.pi)
    found = rotor().modes([0.4], stiffness=given, gravity=False)
    np.testing.assert_allclose(found.frequencies, np.sort([hertz(axial, 12.0), *pair, *pair]), rtol=1e-12)
    free = rotor().with_drives([]).modes([0.4], stiffness=given, gravity=False)
    assert free.frequencies[0] == 0 and free.zero == (("A",),)
    np.testing.assert_allclose(free.frequencies[1:], found.frequencies, rtol=1e-12)


def test_compliant_pins_of_a_four_bar():
    """Frequencies by bodies with six coordinates each, joints as springs between them (80 digits)."""
    body = lambda mass, c, I: {"mass": mass, "center_of_mass": c, "inertia": np.diag(I)}
    b = ksl.Builder("fourbar").add_link("ground").add_link("crank", **body(2.0, (0.1, 0.012, 0.01), (0.002, 0.013, 0.012)))
    b.add_link("coupler", **body(3.0, (0.3, -0.02, 0.04), (0.006, 0.11, 0.108))).add_link("rocker", **body(2.5, (0.22, 0.01, -0.015), (0.004, 0.055, 0.053)))
    b.add_link("plate", **body(0.8, (0.02, 0.01, 0.03), (0.001, 0.0015, 0.0012)))
    for name, parent, child, xyz in (("A", "ground", "crank", (0, 0, 0)), ("B", "crank", "coupler", (0.25, 0, 0)), ("D", "ground", "rocker", (0.7, 0, 0.1))):
        b.add_joint(name, "continuous", parent, child, xyz=xyz, axis=(0, 1, 0))
    b.add_joint("weld", "fixed", "coupler", "plate", xyz=(0.3, 0.05, 0.1), rpy=(0.3, -0.4, 0.2))
    m = b.add_loop("C", "revolute", "coupler", "rocker", at([0.65, 0, 0]), at([0.5, 0, 0]), axis=(0, 1, 0)).build(drives=["A"])
    q = np.array([-2.2, 1.6965183328377886, -2.1598447878220197])
    pin = {"axial": 2e7, "radial": 4e7, "tilting": 2e4}
    found = m.modes(q, stiffness={"A": {"axial": 2e7, "radial": 5e7, "tilting": 3e4, "motion": 900.0}, "B": pin, "C": pin, "D": pin}, gravity=False).frequencies
    np.testing.assert_allclose(found[[0, 1, 2, 17]], [8.50140599688634, 36.88078975117732, 104.9593444699946, 1805.2542332509329], rtol=1e-9)
    np.testing.assert_allclose(m.modes(q, stiffness={"A": 900.0}).frequencies, [8.464464731203337], rtol=1e-9)
    assert m.modes(q, stiffness={"B": pin}).frequencies.shape == (2,), "six of B and one of D, of which five equations hold; the drive is locked"


def test_the_stiffest_pins_are_rigid_ones():
    """Frequencies of the rest rise with the root of the stiffness."""
    m = four_bar()
    q = m.close([0.9, 0, 0]).q
    pins = ({}, *({"B": [k, k, k, k / 100, 0.0, k / 100]} for k in (1e8, 1e11)))
    rigid, soft, stiff = (m.modes(q, stiffness={"A": 20.0, **pin}).frequencies for pin in pins)
    np.testing.assert_allclose(stiff, [*rigid, *soft[1:] * np.sqrt(1e3)], rtol=2e-6)


def test_the_ground_turns_about_the_origin_of_the_world():
    """A mass of 2 kg that slides along x: of turns it has m (ω × c)ₓ."""
    b = ksl.Builder("slide").add_link("ground").add_link("sled", 2.0, (0, 0, 0.3), np.eye(3))
    m = b.add_joint("x", "prismatic", "ground", "sled", xyz=(0.1, 0.2, 0.5), axis=(1, 0, 0)).build()
    found = m.modes([0.7], stiffness={"x": 10.0}, gravity=False).participation[0]
    np.testing.assert_allclose(found * np.sign(found[0]), np.sqrt(2) * np.array([1, 0, 0, 0, 0.8, -0.2]), atol=1e-14)


def test_what_moves_without_resistance_is_named_and_a_pose_that_falls_has_negative_frequencies():
    b = ksl.Builder("pendulum").add_link("ground").add_link("rod", 2.0, (0.5, 0, 0), np.diag([0, 1, 1]) * 2 / 12)
    m = b.add_joint("hinge", "continuous", "ground", "rod", axis=(0, 1, 0)).build()
    up, down = (m.modes([angle], stiffness={"hinge": 0.0}) for angle in (-np.pi / 2, np.pi / 2))
    np.testing.assert_allclose([down.frequencies[0], up.frequencies[0]], [hertz(2 * 9.81 * 0.5, 2 / 3), -hertz(2 * 9.81 * 0.5, 2 / 3)], rtol=1e-12)
    assert m.modes([0.0]).frequencies.shape == (0,), "all is rigid"
    loose = m.modes([0.0], stiffness={"hinge": 0.0}, gravity=False)
    assert loose.frequencies.tolist() == [0.0] and loose.zero == (("hinge",),) and repr(loose) == "<ksl modes: 0 Hz>"
    plate = four_bar().with_drives([])
    assert plate.modes(plate.close([0.9, 0, 0]).q, stiffness={}, gravity=False).zero == (("A", "B", "D"),)


def test_a_floating_base_is_free():
    b = ksl.Builder("two").add_link("hull", 4.0, (0, 0, 0), np.eye(3)).add_link("arm", 1.0, (0.5, 0, 0), np.eye(3) * 0.1)
    m = b.add_joint("hinge", "revolute", "hull", "arm", axis=(0, 0, 1)).build(floating_base=True)
    with pytest.raises(ValueError, match="floating_base holds nothing, so that no pose is at rest under weight: gravity=False"):
        m.modes(m.neutral(), stiffness={"hinge": 50.0})
    found = m.modes(m.neutral(), stiffness={"hinge": 50.0}, gravity=False)
    assert (found.frequencies[:6] == 0).all() and found.zero[0] == ("floating_base",)
    arm = 0.1 + 1.0 * 0.25
    M = np.array([[1.0 + arm, arm, 0.5], [arm, arm, 0.5], [0.5, 0.5, 5.0]])  # hull's turn, hinge, along y
    np.testing.assert_allclose(found.frequencies[6], hertz(50.0, 1 / np.linalg.inv(M)[1, 1]), rtol=1e-12)


@pytest.mark.parametrize(
    "stiffness, said",
    [
        ({"j9": 1.0}, "no joint named 'j9'"),
        ({"j0": -1.0}, "stiffness of joint j0: found \\[-1.0\\]; every stiffness is positive, 0 where nothing resists, or inf"),
        ({"j0": {"torsion": 1.0}}, "stiffness of joint j0 has key"),
        ({"weld": {"axial": 1.0}}, "stiffness of joint weld: the joint has no axis; give axis = \\[x, y, z\\] beside"),
        ({"weld": 5.0}, "stiffness of joint weld: the joint has no axis"),
        ({"weld": {"axial": 1.0, "axis": [0, 0, 0]}}, "expected a direction and a point, m"),
        ({"weld": {"axial": 1.0, "axis": [0, 0, 1], "at": [0, 30, 40]}}, "it acts 50 m from the joint's origin; lengths are in metres: 50 mm are 0.05"),
        ({"j0": {"axial": 1.0, "position": -20}}, "it acts 20 m from the joint's origin"),
        ({"j0": {"torsional": 1.0}}, "torsional is about the axis, and a revolute joint turns there; give motion"),
        ({"j1": {"axial": 1.0}}, "axial is along the axis, and a prismatic joint slides there; give motion"),
        ({"j0": {"axial": 1.0, "at": [0, 0, 1]}}, "at is for joints without an axis, and j0 has one; give position"),
        ({"j0": np.nan}, "every stiffness is positive"),
        ({"joint:j0": 1.0, "j0": 2.0}, "stiffness of joint j0: it is given twice"),
        ({"j0": np.ones(5)}, "stiffness of joint j0, one number, six, or \\(6, 6\\)"),
    ],
)
def test_stiffnesses_that_do_not_fit(stiffness, said):
    with pytest.raises(ValueError, match=said):
        arm().build().modes(np.zeros(3), stiffness=stiffness)


@pytest.mark.parametrize(
    "kind, free",
    [
        ("cylindrical", {"axial", "torsional"}),
        ("planar", {"radial", "torsional"}),
        ("helical", {"torsional"}),
        ("universal", set()),
        ("spherical", {"tilting", "torsional"}),
        ("translation", {"axial", "radial"}),
        ("fixed", set()),
    ],
)
def test_a_stiffness_along_what_a_joint_leaves_free_is_refused(kind, free):
    axes = {"pitch": 0.1} if kind == "helical" else {"axis2": (0, 1, 0)} if kind == "universal" else {}
    has_axis = kind in ("cylindrical", "planar", "helical", "universal")
    b = ksl.Builder("one").add_link("ground").add_link("part", 1.0, (0, 0, 0), np.eye(3))
    m = b.add_joint("j", kind, "ground", "part", **({"axis": (0, 0, 1)} | axes if has_axis else {})).build()
    for key in ("axial", "radial", "tilting", "torsional"):
        given = {key: 1.0} if has_axis else {key: 1.0, "axis": [0, 0, 1]}
        if key in free:
            with pytest.raises(ValueError, match=f"{key} is .* the axis, and a {kind} joint (slides|turns) there; (give motion|leave it out)"):
                stiffnesses.flexibilities_of(m, {"j": given})
        else:
            assert np.trace(stiffnesses.flexibilities_of(m, {"j": given})["j"].compliance) > 0.9, key


def test_massless_parts_that_nothing_holds_and_open_loops_are_refused():
    b = ksl.Builder("frame").add_link("ground").add_link("arm", 1.0, (0.1, 0, 0), np.eye(3)).add_link("tip")
    m = b.add_joint("hinge", "revolute", "ground", "arm", axis=(0, 1, 0)).add_joint("wrist", "revolute", "arm", "tip", axis=(0, 0, 1)).build()
    with pytest.raises(ValueError, match="wrist: nothing resists a motion that moves no mass"):
        m.modes([0, 0], stiffness={"hinge": 5.0, "wrist": 0.0})
    held = m.modes([0, 0], stiffness={"hinge": 5.0, "wrist": 3.0}, gravity=False)  # a spring without mass follows
    np.testing.assert_allclose(held.frequencies, [hertz(5.0, 1.01)], rtol=1e-12)
    r, C = np.array([0.3, 0.2, 0.1]), np.diag([1e-5, 2e-5, 3e-5, 1e-3, 2e-3, 3e-3])  # a point mass: turns about the line to it move nothing
    point = ksl.Builder("point").add_link("ground").add_link("ball", 2.0, r, np.zeros((3, 3))).add_joint("weld", "fixed", "ground", "ball").build()
    moved = np.hstack([np.eye(3), -np.cross(np.eye(3), r)])
    wanted = np.sqrt(np.sort(1 / np.linalg.eigvalsh(moved @ C @ moved.T)) / 2.0) / (2 * np.pi)
    np.testing.assert_allclose(point.modes([], stiffness={"weld": 1 / np.diag(C)}, gravity=False).frequencies, wanted, rtol=1e-10)
    with pytest.raises(ValueError, match="q: the loops are open by 0.*m.close"):
        four_bar().modes([0.3, 0, 0], stiffness={"A": 1.0})
    with pytest.raises(ValueError, match="expected one"):
        m.modes(np.zeros((2, 2)), stiffness={"hinge": 5.0})


def test_joints_with_several_coordinates_turn_as_they_do():
    """The potential's second derivatives of the compiled code: the first axis of a universal joint turns the second; a spherical joint's turns enter by their exponential."""
    b, parent = ksl.Builder("tree").add_link("ground"), "ground"
    rng = np.random.default_rng(3)
    for k, (kind, axes) in enumerate(
        {"universal": {"axis": (1, 0, 0), "axis2": (0, 1, 0)}, "spherical": {}, "helical": {"axis": (0.6, 0, 0.8), "pitch": 0.1}}.items()
    ):
        b.add_link(f"l{k}", 1 + 0.2 * k, rng.normal(size=3) * 0.2, np.diag([0.02, 0.03, 0.025]))
        b.add_joint(f"j{k}", kind, parent, f"l{k}", xyz=rng.normal(size=3) * 0.3, rpy=rng.normal(size=3), **axes)
        parent = f"l{k}"
    b.add_link("door", 1.0, (0.1, 0, 0), np.eye(3)).add_joint("lower", "revolute", "ground", "door", axis=(0, 1, 0))  # with a loop joints may have no motors
    m = b.add_loop("upper", "revolute", "ground", "door", axis=(0, 1, 0)).build(drives=[])
    q, tree = m.random(1), m.without_loops()
    K = tree.stiffness(q)
    squares = np.sort(np.linalg.eigvals(np.linalg.solve(tree.mass_matrix(q), (K + K.T) / 2)).real)
    found = m.modes(q, stiffness={}).frequencies
    np.testing.assert_allclose(np.sign(found) * (2 * np.pi * found) ** 2, squares, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("kind", ["revolute", "universal", "spherical", "helical", "cylindrical", "planar"])
@pytest.mark.parametrize("gives", [False, True], ids=["rigid", "compliant"])
def test_a_body_that_floats_and_is_held_by_a_loop_hangs_as_on_the_joint(kind, gives):
    """At rest, where no choice of coordinates matters.  An arm that swings carries the joint, and a spring pulls at the body."""
    axes = (
        {} if kind == "spherical" else {"axis": (0, 0.6, 0.8)} | ({"axis2": (1, 0, 0)} if kind == "universal" else {"pitch": 0.05} if kind == "helical" else {})
    )
    body = {"mass": 3.0, "center_of_mass": (0.1, 0.05, -0.3), "inertia": np.diag([0.1, 0.2, 0.15])}
    frame = at([0.2, 0.1, 0.5], Rotation.from_euler("xyz", [0.3, -0.5, 0.8]).as_matrix())
    gravity = frame[:3, :3] @ {"planar": [0, 6.0, 8.0], "spherical": [1, 2, -9]}.get(kind, [9.0, 0, 0])  # across slides, so that it hangs
    b = ksl.Builder("tree").add_link("ground").add_link("arm", 1.0, (0, 0.2, 0), np.eye(3) * 0.05)
    swing = {"pose": at([0.4, -0.2, 0]), "axis": gravity, "spring_stiffness": 20.0}  # about the weight, which stays as it is in the joint's frame
    physics = ["spring", "force elements"]
    pull = ("pull", "ground", (0.5, 0.8, -0.2), "body", (0.0, 0.1, -0.1), 30.0, 0.2)
    b.add_joint("swing", "revolute", "ground", "arm", **swing).add_link("body", **body).add_joint("joint", kind, "arm", "body", pose=frame, **axes)
    tree = b.add_force_element(*pull).build(physics=[] if gives else physics).with_gravity(gravity)
    start = tree.integrate(tree.neutral(), np.full(tree.nv, 0.1))
    q = start if gives else tree.equilibrium(start).q
    pose = tree.frame_pose(q, "body")
    b = ksl.Builder("loop").add_link("ground").add_link("arm", 1.0, (0, 0.2, 0), np.eye(3) * 0.05).add_joint("swing", "revolute", "ground", "arm", **swing)
    b.add_link("body", **body).add_joint("free", "floating", "ground", "body").add_force_element(*pull)
    closed = b.add_loop("joint", kind, "arm", "body", frame, np.eye(4), **axes).build(drives=[], physics=[] if gives else physics).with_gravity(gravity)
    floating = np.concatenate([q[:1], pose[:3, 3], Rotation.from_matrix(pose[:3, :3]).as_quat()])
    if gives:  # preloads would differ
        stiff = {"joint": [5e5, 7e5, 6e5, 4e3, 3e3, 5e3], "swing": 300.0}
        found, wanted = (m.modes(x, stiffness=stiff, gravity=False).frequencies for m, x in ((closed, floating), (tree, q)))
    else:
        found = closed.modes(floating, stiffness={}).frequencies
        squares = np.sort(np.linalg.eigvals(np.linalg.solve(tree.mass_matrix(q), tree.stiffness(q))).real)
        wanted = np.sign(squares) * np.sqrt(np.abs(squares)) / (2 * np.pi)
    np.testing.assert_allclose(found, wanted, rtol=1e-9, atol=1e-6)
    assert np.abs(found).max() > 0.1
