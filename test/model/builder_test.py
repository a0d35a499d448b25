"""ksl.Builder, and models made from models: arguments, names, refusals, files and pickles."""

import copy
import os
import pickle
import re

import numpy as np
import pytest

import ksl


def pendulum(**options) -> ksl.Builder:
    b = ksl.Builder("pendulum", **options)
    b.add_link("ceiling")
    b.add_link("rod", mass=2.0, center_of_mass=(0, 0, -0.5), inertia=np.diag([0.1, 0.1, 0.01]))
    return b.add_joint("hinge", "revolute", "ceiling", "rod", axis=(0, 1, 0), limits=(-1, None), effort=5, damping=0.5)


@pytest.fixture
def ur5(examples) -> ksl.Model:
    return ksl.load(examples / "robots/ur5.urdf")


def turn(axis: str, angle: float) -> np.ndarray:
    T, (c, s) = np.eye(4), (np.cos(angle), np.sin(angle))
    i, j = {"x": (1, 2), "z": (0, 1)}[axis]
    T[i, i] = T[j, j] = c
    T[i, j], T[j, i] = -s, s
    return T


def shift(axis: str, by: float) -> np.ndarray:
    T = np.eye(4)
    T["xyz".index(axis), 3] = by
    return T


# the builder


def test_a_pendulum():
    m = pendulum().build()
    assert (m.name, m.file, m.nv, m.root, m.mass) == ("pendulum", "", 1, "ceiling", 2.0)
    j = m.joint("hinge")
    assert (j.kind, j.lower, j.upper, j.effort, j.velocity, j.damping) == ("revolute", -1, None, 5, None, 0.5)
    q = np.array([0.3])
    assert m.gravity_torque(q) == pytest.approx(2 * 9.81 * 0.5 * np.sin(0.3), rel=1e-14)
    assert m.mass_matrix(q) == pytest.approx(np.array([[2 * 0.25 + 0.1]]))


def test_options_are_those_of_load():
    b = pendulum(gravity=(0, 0, -1.62))
    assert b.build().gravity.tolist() == [0, 0, -1.62]
    m = b.build(floating_base=True, gravity=(1, 2, 3), payloads={"rod": (1, (0, 0, -1))})
    assert (m.nv, m.gravity.tolist(), m.mass) == (7, [1, 2, 3], 3)
    b.add_link("shell")
    with pytest.raises(ksl.DescriptionError, match="shell.*one root"):
        b.build()
    bare = ksl.Builder("bare").add_link("a").add_link("b").add_joint("j", "prismatic", "a", "b", axis=[1, 0, 0])
    with pytest.raises(ksl.DescriptionError, match="has a mass"):
        bare.build()
    with pytest.warns(ksl.DescriptionWarning, match="has a mass"):
        assert bare.build(masses="optional").nv == 1


def test_an_impossible_inertia_is_a_warning_or_an_error_if_strict():
    b = ksl.Builder("plate").add_link("plate", 1.0, inertia=np.diag([1.0, 1.0, 3.0]))
    with pytest.warns(ksl.DescriptionWarning, match="link plate.*exceeds the sum"):
        b.build()
    with pytest.raises(ksl.DescriptionError, match="link plate"):
        b.build(strict=True)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda b: b.add_link("rod"), "a second link is named"),
        (lambda b: b.add_link("x", mass="heavy"), "link x: its mass is 'heavy'"),
        (lambda b: b.add_link("x", 1, center_of_mass=(1, 2)), "link x: its centre of mass needs three"),
        (lambda b: b.add_link("x", 1, inertia=np.eye(2)), r"link x: its inertia has shape \(2, 2\)"),
        (lambda b: b.add_joint("hinge", "fixed", "rod", "ceiling"), "a second joint is named"),
        (lambda b: b.add_joint("x", "rotary", "rod", "ceiling"), "joint kind .rotary. is unknown"),
        (lambda b: b.add_joint("x", "fixed", "rod", "ceiling", pose=np.eye(3)), r"joint x: its pose has shape \(3, 3\)"),
        (lambda b: b.add_joint("x", "fixed", "rod", "ceiling", pose=np.ones((4, 4))), "joint x: its pose: its last row"),
        (lambda b: b.add_joint("x", "fixed", "rod", "ceiling", pose=np.diag([2, 1, 1, 1])), "joint x: its pose is not rigid"),
        (lambda b: b.add_joint("x", "revolute", "rod", "ceiling"), "needs an axis"),
        (lambda b: b.add_joint("x", "revolute", "rod", "ceiling", axis=(0, 0, 1), limits=3), "joint x: its limits are 3"),
        (lambda b: b.add_dh_chain("rod", [(1, 2, 3)]), "row 1 of the table"),
        (lambda b: b.add_dh_chain("rod", [{"r": 1}]), "row 1 of the table has key='r'"),
        (lambda b: b.add_dh_chain("rod", [], convention="craig"), "convention='craig'"),
        (lambda b: b.build(masses="maybe"), "masses='maybe'"),
        (lambda b: b.build(floating_base="yes"), "floating_base='yes'; expected True or False"),
        (lambda b: b.build(physics=3), "physics=3: expected names"),
        (lambda b: b.add_link(3), "the name of the link is 3; expected a name"),
        (lambda b: b.add_joint("x", None, "rod", "ceiling"), "joint x: its kind is None; expected a name"),
        (lambda b: b.add_dh_chain("rod", [5]), "row 1 of the table is 5"),
        (lambda b: ksl.Builder(3), "name is 3; expected a name"),
        (lambda b: ksl.Builder("\ud800"), "name is .*; expected a name"),
        (lambda b: ksl.Builder("a\0b"), "robot .*: its name has a control character"),
        (lambda b: b.add_joint("x", "revolute", "rod", "ceiling", axis=(0, 0, 1), velocity=-1), "joint x: its effort or velocity limit is -1"),
        (lambda b: b.add_joint("x", "revolute", "rod", "ceiling", axis=(0, 0, 1), effort=-0.5), "joint x: its effort or velocity limit is -0.5"),
        (
            lambda b: b.add_joint("x", "revolute", "rod", "ceiling", axis=(0, 0, 1), limits=(np.inf, np.inf)),
            "joint x: limits from inf to inf leave no position",
        ),
        (lambda b: b.add_joint("x", "revolute", "rod", "ceiling", axis=(0, 0, 1), limits=(None, -np.inf)), "limits from -inf to -inf leave no position"),
        (lambda b: b.add_joint("x", "revolute", "rod", "ceiling", axis=(0, 0, 1), mimic=(3, 1, 0)), "joint x: its mimic is"),
        (lambda b: b.build(payloads={5: (1, (0, 0, 0))}), "the link of a payload is 5; expected a name"),
        (lambda b: b.build(physics="\ud800"), "physics=.*: expected names"),
        (lambda b: b.add_dh_chain("rod", [(0, 0, 1, 0)], prefix=5), "prefix is 5; expected a name"),
        (lambda b: b.add_dh_chain(7, [(0, 0, 1, 0)]), "parent is 7; expected a name"),
        (lambda b: b.add_dh_chain("rod", [(0, 0, 1, 0, 5)]), "row 1 of the table: kind is 5; expected a name"),
        (lambda b: b.add_dh_chain("rod", 5), "rows is 5; expected the rows of a table"),
        (lambda b: b.build().with_frozen_joints({1: 0}), "a joint is 1; expected a name"),
        (lambda b: b.build().merged(b.build(), "rod", prefix="\0"), "prefix .* has a control character"),
        (lambda b: b.build().merged(b.build(), "rod", prefix="\x1b[31m"), "prefix .* has a control character"),
    ],
)
def test_what_is_refused_says_where_and_why(call, words):
    with pytest.raises(ValueError, match=words):
        call(pendulum())


# tables of Denavit and Hartenberg

PUMA = [  # a, alpha, d, theta of Unimation's Puma 560, standard (Corke and Armstrong-Hélouvry, 1994)
    (0, np.pi / 2, 0, 0),
    (0.4318, 0, 0, 0),
    (0.0203, -np.pi / 2, 0.15005, 0),
    (0, np.pi / 2, 0.4318, 0),
    (0, -np.pi / 2, 0, 0),
    (0, 0, 0, 0),
]
STANFORD = [  # the third joint slides
    (0, -np.pi / 2, 0.412, 0),
    (0, np.pi / 2, 0.154, 0),
    (0, 0, 0.1, -np.pi / 2, "prismatic"),
    (0, -np.pi / 2, 0, 0),
    (0, np.pi / 2, 0, 0),
    (0, 0, 0.263, 0, "continuous"),
]


@pytest.mark.parametrize("table", [PUMA, STANFORD])
@pytest.mark.parametrize("convention", ["standard", "modified"])
def test_frames_are_products_of_elementary_transformations(table, convention):
    rng = np.random.default_rng(0)
    rows = [{**dict(zip(("a", "alpha", "d", "theta", "kind"), row)), "mass": 1.0, "center_of_mass": rng.normal(size=3)} for row in table]
    m = ksl.Builder.from_dh(rows, convention, name="arm").build()
    assert m.joint_names == [f"joint{i}" for i in range(1, 7)]
    q, T, potential = rng.normal(size=6), np.eye(4), 0.0
    for i, row in enumerate(rows):
        slides = row.get("kind") == "prismatic"
        along_z = turn("z", row["theta"] + (0 if slides else q[i])) @ shift("z", row["d"] + (q[i] if slides else 0))
        along_x = shift("x", row["a"]) @ turn("x", row["alpha"])
        T = T @ (along_z @ along_x if convention == "standard" else along_x @ along_z)
        assert np.abs(m.frame_pose(q, f"link{i + 1}") - T).max() < 1e-14
        potential += 9.81 * (T @ [*row["center_of_mass"], 1.0])[2]
    assert m.energy(q, np.zeros(6))[1] == pytest.approx(potential, abs=1e-12)  # masses are in the rows' frames


def test_a_planar_arm_of_two_links():
    """Mass matrix in closed form (Siciliano and others, Robotics, 7.3.2), point masses at the ends."""
    m = ksl.Builder.from_dh([{"a": 0.7, "mass": 2.0}, {"a": 0.4, "mass": 1.5}]).build()
    q = np.array([0.3, -1.1])
    c = np.cos(q[1])
    cross = 1.5 * (0.4**2 + 0.7 * 0.4 * c)
    M = [[2.0 * 0.7**2 + 1.5 * (0.7**2 + 0.4**2 + 2 * 0.7 * 0.4 * c), cross], [cross, 1.5 * 0.4**2]]
    assert m.mass_matrix(q) == pytest.approx(np.array(M), abs=1e-14)


# models from models


def test_models_are_not_changed_and_keep_what_they_were_loaded_with(examples):
    m = ksl.load(examples / "robots/ur5.urdf", floating_base=True, gravity=(1, 2, 3), payloads={"tool0": (2.0, (0, 0, 0.1))})
    before = m.to_urdf()
    frozen = {"elbow": 0.3}
    for other in (m.with_root("tool0"), m.with_frozen_joints(frozen), m.with_payload("tool0", 1.0), m.with_frame("tip", "tool0")):
        assert other.gravity.tolist() == [1, 2, 3] and other.joint_names[0] == "floating_base" and other.mass >= m.mass
        assert type(other) is ksl.Model
    assert m.to_urdf() == before


def test_surgery_by_name(ur5):
    m = ur5.with_frozen_joints({"elbow": 0.3, "wrist_1": [0.1]})
    assert m.nv == 4 and m.joint("elbow").kind == "fixed"
    with pytest.raises(ksl.DescriptionError, match="did you mean .elbow."):
        ur5.with_frozen_joints({"elbov": 0.3})
    with pytest.raises(ksl.DescriptionError, match="has 1 in q"):
        ur5.with_frozen_joints({"elbow": [0.3, 0.1]})
    two = ur5.merged(ur5, "tool0", prefix="b_")
    assert two.nv == 12 and two.children("tool0") == ["b_base_link"]
    with pytest.raises(ksl.DescriptionError, match="give a prefix"):
        ur5.merged(ur5, "tool0")
    with pytest.raises(ksl.DescriptionError, match="no link"):
        ur5.subtree("nothing")
    assert ur5.subtree("forearm_link").joint_names == ["wrist_1", "wrist_2", "wrist_3"]


def test_a_frozen_floating_base_stands_where_it_was(examples):
    m = ksl.load(examples / "robots/ur5.urdf", floating_base=True)
    q = np.array([1, 2, 3, 0, 0, 0.6, 0.8, *np.linspace(-1, 1, 6)])
    stands = m.with_frozen_joints({"floating_base": q[:7]})
    assert stands.root == "world" and stands.nv == 6
    assert np.abs(stands.frame_pose(q[7:], "tool0") - m.frame_pose(q, "tool0")).max() < 1e-14


def test_parameters_in_two_forms(ur5):
    c, I = np.array([0.1, 0.2, 0.3]), np.array([[0.3, 0.01, 0.02], [0.01, 0.4, 0.03], [0.02, 0.03, 0.5]])
    by_center = ur5.with_parameters({"tool0": (2.0, c, I)})
    about_origin = I + 2.0 * (c @ c * np.eye(3) - np.outer(c, c))
    ten = [2.0, *(2.0 * c), *(about_origin[i, j] for i, j in ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2)))]
    by_ten = ur5.with_parameters({"tool0": ten})
    q = np.linspace(-1, 1, 6)
    assert np.abs(by_center.mass_matrix(q) - by_ten.mass_matrix(q)).max() < 1e-14
    assert by_ten.link("tool0").mass == 2.0 and ur5.link("tool0").mass == 0.0
    assert np.abs(by_center.mass_matrix(q) - ur5.with_payload("tool0", 2.0, c, I).mass_matrix(q)).max() < 1e-14
    assert by_ten.mass_matrix(q.astype(np.float32)) == pytest.approx(by_ten.mass_matrix(q), rel=1e-5, abs=1e-5)
    for wrong, words in (({"tool": ten}, "no link named 'tool'"), ({"tool0": ten[:9]}, r"tool0.*shape \(9,\)"), ({"tool0": [-1.0] * 10}, "tool0.*negative")):
        with pytest.raises(ValueError, match=words):
            ur5.with_parameters(wrong)


# queries


def test_queries(ur5):
    assert ur5.mass == pytest.approx(sum(l.mass for l in ur5.links))
    assert ur5.support("forearm_link") == ["shoulder_pan", "shoulder_lift", "elbow"]
    assert ur5.support("base_link") == [] and ur5.parent("base_link") is None
    assert ur5.subtree_links("wrist_2") == ["wrist_2_link", "wrist_3_link", "tool0"]
    assert ur5.subtree_mass("wrist_2") == sum(ur5.link(name).mass for name in ur5.subtree_links("wrist_2"))
    assert ur5.parent("tool0") == "wrist_3_link" and ur5.children("wrist_3_link") == ["tool0"]
    assert ur5.joint_above("forearm_link").name == "elbow"
    assert set(ur5.frames) == {*ur5.link_names, *(j.name for j in ur5.joints)}
    with pytest.raises(ValueError, match="no link named 'x'"):
        ur5.support("x")


# files and pickles


def test_the_file_is_written_completely_or_not_at_all(ur5, tmp_path):
    path = tmp_path / "robot.urdf"
    assert ur5.to_urdf(path) == path.read_text() == ur5.to_urdf()
    assert ksl.load(path).joints == ur5.joints
    with pytest.raises(OSError, match="there is no folder .*nowhere; make it, or give a file in a folder that exists"):
        ur5.to_urdf(tmp_path / "nowhere" / "robot.urdf")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["robot.urdf"]
    assert os.stat(path).st_mode & 0o400


def test_pickles_of_other_versions_are_refused(ur5):
    from ksl.model.model import _rebuilt

    state = ur5.with_payload("tool0", 1.0).__reduce__()[1][0]
    link = state[2][0]
    for other in ([], state[:8], [*state, 0], [*state[:2], [link[:-1]], *state[3:]], [*state[:2], [[*link, None]], *state[3:]]):
        with pytest.raises(ValueError, match="pickled by another version of KSL; load its robot file again"):
            _rebuilt(other)


def test_pickles_of_models_that_no_file_gives(ur5):
    q = np.linspace(-1, 1, 6)
    for m in (ur5.with_payload("tool0", 1.0), ur5.with_parameters({"tool0": [1.0] + [0.0] * 9}), ur5.with_frame("tip", "tool0")):
        again = pickle.loads(pickle.dumps(m))
        assert again.links == m.links and again.joints == m.joints and again.warnings == m.warnings
        assert (again.mass_matrix(q) == m.mass_matrix(q)).all()
        assert again.to_urdf() == m.to_urdf()
    flying = pickle.loads(pickle.dumps(pendulum(gravity=(1, 2, 3)).build(floating_base=True)))
    assert flying.joint_names == ["floating_base", "hinge"] and flying.gravity.tolist() == [1, 2, 3]
    assert flying.joint("hinge").damping == 0.5
    assert copy.deepcopy(flying) is flying


def test_the_joint_that_mounts_a_robot_takes_no_name_of_either():
    one = ksl.Builder("one").add_link("base").add_link("arm", 1.0).add_joint("mount", "revolute", "base", "arm", axis=(0, 0, 1)).build()
    both = one.merged(one, "arm", prefix="second_")
    assert both.joint_names == ["mount", "second_mount"]
    assert "second_mount_" in {joint.name for joint in both.joints}


def test_poses_in_other_forms(ur5):
    """Angles as URDF has them, a quaternion, a matrix and a typed pose: the same robot; and typed poses wherever a model takes one."""
    xyz, rpy = (0.1, -0.2, 0.3), (0.4, -0.5, 0.6)
    text = """<robot name="r"><link name="a"/><link name="b"><inertial><mass value="1"/><origin xyz="1 2 3"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0"
    iyz="0"/></inertial></link><joint name="j" type="revolute"><parent link="a"/><child link="b"/><origin xyz="0.1 -0.2 0.3" rpy="0.4 -0.5 0.6"/>
    <axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>"""
    expected = ksl.load_string(text).frame_pose([0.7], "b")
    X = ksl.Pose.from_rpy(xyz, rpy)
    q = pytest.importorskip("scipy.spatial.transform").Rotation.from_euler("xyz", rpy).as_quat()

    def built(**how):
        b = ksl.Builder("r").add_link("a").add_link("b", 1.0, (1, 2, 3))
        return b.add_joint("j", "revolute", "a", "b", axis=(0, 0, 1), **how).build()

    for how in ({"xyz": xyz, "rpy": rpy}, {"xyz": xyz, "quaternion": q}, {"pose": X}, {"pose": X.named("a", "j")}, {"pose": X.matrix}):
        np.testing.assert_allclose(built(**how).frame_pose([0.7], "b"), expected, atol=1e-15)
    np.testing.assert_allclose(built(xyz=xyz).frame_pose([0.0], "b")[:3, 3], xyz, atol=0)
    for how, words in (
        ({"pose": X, "rpy": rpy}, "joint j: its pose is given twice: pose and rpy"),
        ({"rpy": rpy, "quaternion": q}, "joint j: its pose is given twice: rpy and quaternion"),
        ({"quaternion": (1, 1, 1, 1)}, "joint j: its pose: a quaternion has length 2"),
        ({"rpy": (0, 0)}, "joint j: its pose: rpy"),
        ({"pose": X.named("world", "j")}, "is given in frame 'world'; expected it in frame 'a'"),
    ):
        with pytest.raises(ValueError, match=words):
            built(**how)
    assert ur5.with_frame("f", "tool0", X).to_urdf() == ur5.with_frame("f", "tool0", X.matrix).to_urdf()
    target = ksl.Pose(ur5.frame_pose(np.full(6, 0.5), "tool0"), to="world", of="tool0")
    found = ur5.inverse_kinematics("tool0", target)
    assert found.converged and repr(found).startswith("<ksl inverse kinematics: converged, error ") and "\n" not in repr(found)
    many = ur5.inverse_kinematics("tool0", np.stack([target.matrix, np.diag([1.0, 1, 1, 1]) + 90 * np.eye(4, k=3)]))
    assert re.fullmatch(r"<ksl inverse kinematics of 2 targets: 1 converged, 1 \w+; largest error .* m, .* rad>", repr(many))
