"""Free bodies: their balance, a pendulum by hand, payloads, external wrenches, force elements, welds, loops and axes of parts."""

import numpy as np
import pytest
from linkages import FOURBAR, four_bar

import ksl


def balanced(bodies, limit=1e-12):
    """The sum of all that acts, from the entries alone."""
    for body in bodies.values():
        total = body.gravity + body.inertia
        for w in body.wrenches:
            total = total + np.r_[w.wrench[:3], w.wrench[3:] + np.cross(w.point, w.wrench[:3])]
        scale = max([1.0, *body.largest])
        assert np.abs(total).max() <= limit * scale and np.abs(body.residual).max() <= limit * scale, body.link
    return bodies


def entry(body, name, kind="joint"):
    return next(w for w in body.wrenches if (w.name, w.kind) == (name, kind))


def random_tree(rng, joints=7):
    b = ksl.Builder("tree", gravity=rng.normal(size=3) * 6).add_link("l0", 2.0, (0.1, 0, 0), 0.1 * np.eye(3))
    for i in range(1, joints):
        b.add_link(f"l{i}", rng.uniform(0.1, 3), rng.normal(size=3) * 0.2, np.diag([3, 4, 5]) * rng.uniform(0.01, 0.1))
        pose = ksl.Pose.from_rpy(rng.normal(size=3) * 0.4, rpy=rng.normal(size=3)).array_in()
        kind = rng.choice(["revolute", "prismatic", "fixed", "spherical", "floating"], p=[0.4, 0.2, 0.2, 0.1, 0.1])
        axis = {"axis": rng.normal(size=3)} if kind in ("revolute", "prismatic") else {}
        b.add_joint(f"j{i}", kind, f"l{rng.integers(i)}", f"l{i}", pose=pose, **axis)
    return b.build()


def test_every_body_of_random_trees_is_in_balance():
    rng = np.random.default_rng(1)
    for _ in range(30):
        m = random_tree(rng)
        link = f"l{rng.integers(1, 7)}"
        m = m.with_payload(link, 1.5, rng.normal(size=3), np.diag([0.1, 0.2, 0.25]))
        q, v, a = m.random(rng), rng.normal(size=m.nv), rng.normal(size=m.nv) * 5
        for welded in ("together", "apart"):
            bodies = balanced(m.free_bodies(q, v, a, {"l3": rng.normal(size=6) * 9}, welded=welded))
            assert sorted(link for body in bodies.values() for link in body.links) == sorted(m.link_names)
            assert sum(len([w for w in body.wrenches if w.kind in ("joint", "loop")]) for body in bodies.values()) % 2 == 1, (
                "each joint on two bodies, base on one"
            )


def test_every_body_of_a_closed_mechanism_is_in_balance_and_open_components_are_marked():
    m = ksl.load_string(FOURBAR, drives=["A"])
    q = m.close(np.array([0.4, 0.3, 0.6]), hold=["A"]).q
    v = m.consistent_velocity(q, np.array([2.0, 0, 0]), ["A"])
    a = m.consistent_acceleration(q, v, np.array([3.0, 0, 0]), ["A"])
    bodies = balanced(m.free_bodies(q, v, a, {"coupler": np.arange(6.0)}))
    assert [(w.kind, w.name) for w in bodies["rocker"].wrenches] == [("joint", "D"), ("loop", "C")] and not bodies["rocker"].complete
    pin, on_rocker = (entry(bodies[link], "C", "loop") for link in ("coupler", "rocker"))
    unique = m.reactions_unique(q, ["C"])[0]
    assert np.array_equal(on_rocker.undetermined, ~unique), "the loop's frame and the rocker's are parallel"
    R = m.relative_pose(q, "rocker", "coupler")[:3, :3]
    np.testing.assert_allclose(np.r_[R @ on_rocker.wrench[:3], R @ on_rocker.wrench[3:]], -pin.wrench, atol=1e-12)
    planar = four_bar().with_stiffness({name: {"axial": 1e8, "radial": 1e9, "tilting": 1e7} for name in "ABCD"})
    q = planar.close(np.array([0.4, 0.3, 0.6]), hold=["A"]).q
    assert all(body.complete for body in balanced(planar.free_bodies(q, 0 * q, 0 * q)).values()), "stiffnesses decide"


def test_a_pendulum_by_hand():
    """A rod of 2 kg, 0.3 m to its centre, that turns about z at 4 rad/s and 5 rad/s², gravity along −y: the pin's force is m (a_c − g), its moment I α + c × m (a_c − g)."""
    b = ksl.Builder("pendulum", gravity=(0, -9.81, 0)).add_link("wall").add_link("rod", 2.0, (0.3, 0, 0), np.diag([0, 0.06, 0.06]))
    m = b.add_joint("pin", "revolute", "wall", "rod", axis=(0, 0, 1)).build()
    angle = 0.7
    bodies = balanced(m.free_bodies([angle], [4.0], [5.0]))
    rod, g = bodies["rod"], -9.81 * np.array([np.sin(angle), np.cos(angle), 0])
    force = 2.0 * (np.array([-0.3 * 16, 0.3 * 5, 0]) - g)
    np.testing.assert_allclose(entry(rod, "pin").wrench, [*force, 0, 0, 0.06 * 5 + 0.3 * force[1]], atol=1e-14)
    np.testing.assert_allclose(rod.gravity, [*(2 * g), 0, 0, 0.6 * g[1]], atol=1e-14)
    np.testing.assert_allclose(rod.inertia, [2 * 0.3 * 16, -2 * 0.3 * 5, 0, 0, 0, -(0.06 + 2 * 0.09) * 5], atol=1e-14)
    assert (
        np.array_equal(rod.acceleration, [0, 0, 0]) and np.array_equal(rod.angular_velocity, [0, 0, 4]) and np.array_equal(rod.angular_acceleration, [0, 0, 5])
    )
    wall = bodies["wall"]
    c, s = np.cos(angle), np.sin(angle)
    np.testing.assert_allclose(entry(wall, "pin").wrench[:2], -np.array([[c, -s], [s, c]]) @ force[:2], atol=1e-14)
    np.testing.assert_allclose(entry(wall, "base").wrench, -entry(wall, "pin").wrench, atol=1e-14)


def test_a_payload_is_an_entry_of_its_own_and_the_link_is_without_it():
    plain = random_tree(np.random.default_rng(3))
    link = plain.link_names[-1]
    q, v, a = plain.random(0), np.ones(plain.nv), np.ones(plain.nv)
    once = plain.with_payload(link, 1.0, (0.1, 0.2, 0.3), np.diag([0.1, 0.2, 0.2]))
    twice = once.with_payload(link, 2.0, (0, 0, 0.5))
    before, after = plain.free_bodies(q, v, a, welded="apart")[link], balanced(twice.free_bodies(q, v, a, welded="apart"))[link]
    for name in ("gravity", "inertia", "mass", "center_of_mass"):
        np.testing.assert_allclose(getattr(after, name), getattr(before, name), atol=1e-13)
    first, second = entry(after, link, "payload"), entry(after, f"{link} (2)", "payload")
    assert np.array_equal(first.point, [0.1, 0.2, 0.3]) and np.array_equal(second.point, [0, 0, 0.5])
    alone = entry(once.free_bodies(q, v, a, welded="apart")[link], link, "payload")
    np.testing.assert_allclose(first.wrench, alone.wrench, atol=1e-14)
    point = twice.with_frame("there", link, ksl.Pose.from_rpy((0, 0, 0.5)).array_in())
    moved = point.frame_acceleration(q, v, a, "there", kind="classical")[:3]
    np.testing.assert_allclose(second.wrench, [*(2.0 * (after.gravity_field - moved)), 0, 0, 0], atol=1e-13)


def test_force_elements_and_external_wrenches_act_at_their_points():
    b = ksl.Builder("lid").add_link("box").add_link("lid", 3.0, (0.2, 0, 0), 0.1 * np.eye(3)).add_joint("hinge", "revolute", "box", "lid", axis=(0, -1, 0))
    m = b.add_force_element("strut", "box", (0.3, 0, -0.2), "lid", (0.25, 0, 0), stiffness=900.0, free_length=0.4).build(physics=["force elements"])
    bodies = balanced(m.free_bodies([0.5], [1.0], [2.0], {"lid": [1.0, 2, 3, 4, 5, 6]}))
    ends = entry(bodies["box"], "strut", "force element"), entry(bodies["lid"], "strut", "force element")
    np.testing.assert_allclose(ends[1].point, [0.25, 0, 0], atol=1e-15)
    np.testing.assert_allclose(ends[0].point, [0.3, 0, -0.2], atol=1e-15)
    reached = m.frame_pose([0.5], "lid")[:3] @ [0.25, 0, 0, 1]
    apart = reached - [0.3, 0, -0.2]
    length = np.linalg.norm(apart)
    np.testing.assert_allclose(ends[0].wrench, [*(900 * (length - 0.4) * apart / length), 0, 0, 0], atol=1e-12)
    assert np.array_equal(entry(bodies["lid"], "lid", "external").wrench, [1, 2, 3, 4, 5, 6])
    in_world = m.free_bodies([0.5], [0], [0], {"lid": [0, 0, 7.0, 0, 0, 0]}, external_axes="world")
    np.testing.assert_allclose(entry(in_world["lid"], "lid", "external").wrench[:3], m.frame_pose([0.5], "lid")[:3, :3].T @ [0, 0, 7], atol=1e-15)


def test_in_the_frame_of_a_part_all_is_the_same():
    """Power of every wrench under the body's motion doesn't depend on axes or origin."""
    rng = np.random.default_rng(4)
    m = random_tree(rng)
    q, v, a = m.random(rng), rng.normal(size=m.nv), rng.normal(size=m.nv)
    body = list(m.free_bodies(q, v, a, {"l2": rng.normal(size=6)}).values())[-1]
    pose = ksl.Pose.from_rpy((0.3, -0.2, 0.5), rpy=(0.3, 1.0, -0.4)).array_in()
    part = body.in_frame(pose)
    balanced({"part": part})
    R, p = pose[:3, :3], pose[:3, 3]
    np.testing.assert_allclose(part.center_of_mass, R.T @ (body.center_of_mass - p), atol=1e-15)
    there = m.with_frame("part", body.link, pose)
    moved = there.frame_acceleration(q, v, a, "part", kind="classical")
    np.testing.assert_allclose(
        [part.acceleration, part.angular_acceleration, part.angular_velocity], [moved[:3], moved[3:], there.frame_velocity(q, v, "part")[3:]], atol=1e-12
    )
    assert np.linalg.norm(part.acceleration) > 0.1 and part.mass == body.mass and part.frame == "part"
    slip, turn = rng.normal(size=(2, 3))  # a virtual motion of the body, in its own axes
    there = R.T @ (slip + np.cross(turn, p)), R.T @ turn
    pairs = [
        *zip((w.about_origin() for w in part.wrenches), (w.about_origin() for w in body.wrenches), strict=True),
        (part.gravity, body.gravity),
        (part.inertia, body.inertia),
    ]
    for mine, theirs in pairs:
        np.testing.assert_allclose(mine[:3] @ there[0] + mine[3:] @ there[1], theirs[:3] @ slip + theirs[3:] @ turn, atol=1e-12)
    with pytest.raises(ValueError, match=r"frame of l6 has shape \(3, 3\)"):
        body.in_frame(np.eye(3))


def test_models_remember_payloads():
    m = random_tree(np.random.default_rng(5)).with_payload("l2", 1.0, (0, 0, 0.1))
    import pickle

    other = ksl.Builder("tool", gravity=m.gravity).add_link("cup", 0.1).build().with_payload("cup", 0.2)
    for made in (m.with_gravity((0, 0, 0)), m.with_physics("all"), m.with_frame("tip", "l2"), pickle.loads(pickle.dumps(m)), m.with_frozen_joints({})):
        assert [p.link for p in made.payloads] == ["l2"]
    assert [p.link for p in m.merged(other, "l2", prefix="a_").payloads] == ["l2", "a_cup"]
    assert m.with_parameters({"l2": np.zeros(10)}).payloads == () == m.subtree("l6").payloads
    assert m.with_parameters({"l3": np.zeros(10)}).payloads == m.payloads


def test_one_state_is_asked_for():
    m = random_tree(np.random.default_rng(6))
    with pytest.raises(ValueError, match=r"q has shape .*free bodies are those of one state"):
        m.free_bodies(m.random(0, size=2), np.zeros(m.nv), np.zeros(m.nv))
    with pytest.raises(ValueError, match="welded='alone'"):
        m.free_bodies(m.random(0), np.zeros(m.nv), np.zeros(m.nv), welded="alone")
