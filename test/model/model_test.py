"""ksl.Model: names, shapes, keywords, and what is said when an argument doesn't fit."""

import copy
import multiprocessing
import os
import pickle
import subprocess
import sys
import warnings

import numpy as np
import pytest

import ksl

INERTIAL = '<inertial><origin xyz="0.1 0 0.2"/><mass value="2"/><inertia ixx="0.2" iyy="0.3" izz="0.4" ixy="0.01" ixz="0.02" iyz="0.03"/></inertial>'

ARM = f"""<robot name="arm">
  <link name="root">{INERTIAL}</link><link name="upper">{INERTIAL}</link><link name="lower">{INERTIAL}</link><link name="tool">{INERTIAL}</link>
  <joint name="shoulder" type="revolute"><origin xyz="0 0 0.3" rpy="0.1 0.2 0.3"/><parent link="root"/><child link="upper"/><axis xyz="0 1 0"/>
    <limit lower="-1" upper="2" effort="30" velocity="4"/><dynamics damping="0.5" friction="0.25"/></joint>
  <joint name="slide" type="prismatic"><origin xyz="0 0 0.4"/><parent link="upper"/><child link="lower"/><axis xyz="1 1 0"/>
    <limit lower="-0.5" upper="0.5" effort="100" velocity="1"/></joint>
  <joint name="flange" type="fixed"><origin xyz="0 0 0.1" rpy="0 1.5707963267948966 0"/><parent link="lower"/><child link="tool"/></joint>
</robot>"""


@pytest.fixture
def arm(robot) -> ksl.Model:
    return robot(ARM)


@pytest.fixture
def flying(robot) -> ksl.Model:
    return robot(ARM, floating_base=True)


def states(m: ksl.Model, *leading: int, seed: int = 0):
    rng = np.random.default_rng(seed)
    q, v, a = (rng.normal(size=(*leading, n)) for n in (m.nq, m.nv, m.nv))
    if m.nq > m.nv:
        q[..., 3:7] /= np.linalg.norm(q[..., 3:7], axis=-1, keepdims=True)
    return q, v, a


# names and sizes


def test_names_and_sizes(arm):
    assert (arm.name, arm.nq, arm.nv) == ("arm", 2, 2)
    assert arm.joint_names == ["shoulder", "slide"]
    assert arm.fixed_joint_names == ["flange", "base"]
    assert [j.name for j in arm.joints] == ["shoulder", "slide", "flange", "base"]
    assert arm.link_names == ["root", "upper", "lower", "tool"]
    assert arm.file.endswith("robot.urdf")
    assert repr(arm) == "<ksl.Model 'arm': 2 moving joints, 4 links, nq=2, nv=2>"


def test_floating_base_is_the_first_joint(flying):
    assert flying.joint_names == ["floating_base", "shoulder", "slide"] and flying.fixed_joint_names == ["flange"]
    assert (flying.nq, flying.nv) == (9, 8)
    base = flying.joint("floating_base")
    assert (base.kind, base.parent, base.child, base.nq, base.nv, base.q_index, base.v_index) == ("floating", None, "root", 7, 6, 0, 0)


def test_joints_as_the_file_has_them(arm):
    shoulder, slide, flange, base = arm.joints
    assert (shoulder.kind, shoulder.parent, shoulder.child) == ("revolute", "root", "upper")
    assert (shoulder.lower, shoulder.upper, shoulder.effort, shoulder.velocity, shoulder.damping, shoulder.friction) == (-1, 2, 30, 4, 0.5, 0.25)
    assert shoulder.axis == (0, 1, 0) and shoulder.has_axis
    assert slide.axis == pytest.approx((np.sqrt(0.5), np.sqrt(0.5), 0), abs=1e-15)
    assert (flange.nv, flange.lower, flange.effort, flange.has_axis) == (0, None, None, False)
    assert (base.kind, base.parent, base.child) == ("fixed", None, "root")


def test_links_carry_their_inertia_about_the_origin(arm):
    link = arm.links[1]
    assert link.mass == 2
    assert link.first_moment == pytest.approx((0.2, 0, 0.4), abs=1e-15)
    # parallel axes: + m (c·c 1 − c cᵀ) with c = (0.1, 0, 0.2)
    assert link.inertia == pytest.approx((0.2 + 2 * 0.04, 0.3 + 2 * 0.05, 0.4 + 2 * 0.01, 0.01, 0.03, 0.02 - 2 * 0.02), abs=1e-15)


def test_a_joint_called_base_leaves_the_ground_another_name(robot):
    m = robot(ARM.replace('name="flange"', 'name="base"'))
    assert m.fixed_joint_names == ["base", "ground"]
    assert m.joint("base").child == "tool" and m.joint("ground").child == "root"
    zero = np.zeros(2)
    assert m.reactions(zero, zero, zero, joints=["ground"], axes="world")[0, 2] == pytest.approx(8 * 9.81)


def test_joints_called_base_and_ground_leave_names_unique(robot):
    m = robot(ARM.replace('name="flange"', 'name="base"').replace('name="slide"', 'name="ground"'))
    names = [j.name for j in m.joints]
    assert len(set(names)) == len(names) == 4, f"names are not unique: {names}"


def test_a_fixed_joint_called_floating_base_leaves_its_name_to_no_other(robot, flying):
    text = ARM.replace('name="flange"', 'name="floating_base"')
    assert robot(text).fixed_joint_names == ["floating_base", "base"]
    with pytest.warns(ksl.DescriptionWarning, match="joint floating_base of the file .* is called floating_root"):
        m = robot(text, floating_base=True)
    assert m.joint_names == ["floating_root", *flying.joint_names[1:]] and m.fixed_joint_names == ["floating_base"]
    assert m.joint("floating_root").parent is None and m.joint("floating_base").kind == "fixed"
    q, v, a = states(m, 3)
    assert np.array_equal(m.inverse_dynamics(q, v, a), flying.inverse_dynamics(q, v, a))


# masses

LIGHT = ARM.replace(INERTIAL, '<visual><geometry><box size="1 1 1"/></geometry></visual>')


def test_a_moving_link_with_geometry_and_no_mass_is_a_warning(robot):
    upper = ARM.replace(f'<link name="upper">{INERTIAL}', '<link name="upper"><collision><geometry><box size="1 1 1"/></geometry></collision>')
    assert upper != ARM
    with pytest.warns(ksl.DescriptionWarning, match=r"link upper \(line \d+\): moves and has geometry, but no mass"):
        m = robot(upper)
    assert len(m.warnings) == 1
    with pytest.raises(ksl.DescriptionError, match="link upper .*add <inertial> to these links, or read the file without strict"):
        robot(upper, strict=True)


def test_a_robot_without_mass_is_refused_but_for_its_kinematics(robot, arm):
    with pytest.raises(ksl.DescriptionError, match=r'robot.urdf: none of the links that move \(.*\) has a mass: .*masses="optional"'):
        robot(LIGHT)
    with pytest.warns(ksl.DescriptionWarning, match="none of the links that move"):
        light = robot(LIGHT, masses="optional")
    q = np.array([0.3, -0.2])
    assert np.array_equal(light.frame_poses(q), arm.frame_poses(q))
    assert not light.reactions(q, 0 * q, 0 * q).any()
    with pytest.raises(ksl.DescriptionError, match="none of the links that move"):
        robot(LIGHT, masses="optional", strict=True)
    with pytest.raises(ValueError, match="masses='none'; expected one of 'optional'"):
        robot(LIGHT, masses="none")
    fixed = LIGHT.replace('type="revolute"', 'type="fixed"').replace('type="prismatic"', 'type="fixed"')
    assert robot(fixed).nv == 0, "nothing moves: no mass is missing"


def test_a_payload_is_a_mass(robot):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ksl.DescriptionWarning)
        m = robot(LIGHT, payloads={"upper": (2.0, [0, 0, 0])})
    assert not any("upper" in line for line in m.warnings)
    with pytest.raises(ksl.DescriptionError, match="none of the links that move"):
        robot(LIGHT, payloads={"upper": (0.0, [0, 0, 0])})


# shapes


def test_leading_shapes_are_broadcast(arm):
    q, v, a = states(arm, 4)
    grid = arm.inverse_dynamics(q[:, None], v[None, :], a[0])
    assert grid.shape == (4, 4, 2)
    for i in range(4):
        for k in range(4):
            assert np.array_equal(grid[i, k], arm.inverse_dynamics(q[i], v[k], a[0]))
    external = {"tool": np.arange(18.0).reshape(3, 1, 6), "upper": np.ones(6)}
    assert np.array_equal(arm.reactions(q, v, a, external)[2, 1], arm.reactions(q[1], v[1], a[1], {"tool": external["tool"][2, 0], "upper": np.ones(6)}))


def test_no_joints_asked_for_are_no_reactions(arm):
    assert arm.reactions(*states(arm, 3), joints=[]).shape == (3, 0, 6)


def test_one_joint_by_name_is_a_list_of_one(arm):
    q, v, a = states(arm, 3)
    assert np.array_equal(arm.reactions(q, v, a, joints="slide"), arm.reactions(q, v, a, joints=["slide"]))


def test_a_joint_asked_for_twice_comes_twice(arm):
    r = arm.reactions(*states(arm, 3), joints=["slide", "base", "slide"] * 3)
    assert r.shape == (3, 9, 6) and np.array_equal(r[:, 0], r[:, 2])


def test_a_robot_without_moving_joints(robot):
    m = robot(f'<robot name="stone"><link name="stone">{INERTIAL}</link></robot>')
    assert (m.nq, m.nv, m.joint_names) == (0, 0, [])
    for leading in ((), (3,), (0,), (2, 2)):
        none = np.empty((*leading, 0))
        assert m.inverse_dynamics(none, none, none).shape == (*leading, 0)
        held = m.reactions(none, none, none, joints=["base"])
        assert held.shape == (*leading, 1, 6)
        assert held == pytest.approx(np.broadcast_to([0, 0, 2 * 9.81, 0, -0.1 * 2 * 9.81, 0], held.shape))
        assert m.frame_pose(none, "stone").shape == (*leading, 4, 4)
        assert np.array_equal(m.frame_poses(none), np.broadcast_to(np.eye(4), (*leading, 1, 4, 4)))
        assert np.array_equal(m.energy(none, none)[0], np.zeros(leading))


def test_reactions_don_t_depend_on_what_else_is_asked(arm):
    """Fixed joints take another path through the library; what they share must be the same bits."""
    q, v, a = states(arm, 5)
    everything = arm.reactions(q, v, a, joints=["shoulder", "flange", "slide", "base"])
    assert np.array_equal(everything[:, [0, 2]], arm.reactions(q, v, a))


def test_arguments_are_not_changed_and_results_are_fresh(flying):
    q, v, a = states(flying, 3)
    external = {"tool": np.ones((3, 6))}
    for x in (q, v, a, external["tool"]):
        x.flags.writeable = False
    first = flying.inverse_dynamics(q, v, a, external)
    kept = first.copy()
    first[:] = 0
    assert np.array_equal(flying.inverse_dynamics(q, v, a, external), kept)


# one that doesn't change


def test_a_model_is_read_only(arm):
    expected = arm.gravity_torque(np.ones(2))
    with pytest.raises(ValueError, match="read-only"):
        arm.gravity[2] = 0
    for name in ("gravity", "joints", "nq", "name", "colour"):
        with pytest.raises(AttributeError, match=f"{name} of a model can't be set"):
            setattr(arm, name, 1)
    with pytest.raises(AttributeError, match="nq of a model can't be deleted"):
        del arm.nq
    assert np.array_equal(arm.gravity_torque(np.ones(2)), expected) and arm.gravity[2] == -9.81


def test_a_copy_is_the_model_itself(arm):
    assert copy.copy(arm) is arm and copy.deepcopy({"m": arm})["m"] is arm


def efforts(m: ksl.Model) -> np.ndarray:
    return m.inverse_dynamics(*states(m, 3))


def test_a_pickle_is_loaded_with_the_same_options(robot):
    text = ARM.replace('izz="0.4"', 'izz="4"', 1)  # an inertia that is warned of, once
    with pytest.warns(ksl.DescriptionWarning):
        m = robot(text, floating_base=True, gravity=(1, 2, 3), payloads={"tool": (2, (0, 0, 1))})
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        again = pickle.loads(pickle.dumps(m))
    assert again is not m and (again.joints, again.links, again.warnings) == (m.joints, m.links, m.warnings)
    assert np.array_equal(again.gravity, m.gravity) and np.array_equal(efforts(again), efforts(m))
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        assert np.array_equal(pool.map(efforts, [m])[0], efforts(m))


def test_a_pickle_finds_its_file_from_another_folder(robot, tmp_path, monkeypatch):
    robot(ARM)
    monkeypatch.chdir(tmp_path)
    kept = pickle.dumps(ksl.load("robot.urdf"))
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    assert pickle.loads(kept).nq == 2


def test_a_pickle_of_a_file_that_has_changed_is_refused(robot):
    kept = pickle.dumps(robot(ARM))
    robot(ARM.replace('value="2"', 'value="3"', 1))
    refused(lambda: pickle.loads(kept), "robot.urdf", "changed since the model was pickled")


# poses, gravity, payload


def test_frame_pose_by_link_or_joint(arm):
    q = np.array([0.3, -0.2])
    for joint, link in (("shoulder", "upper"), ("slide", "lower"), ("flange", "tool"), ("base", "root")):
        assert np.array_equal(arm.frame_pose(q, joint), arm.frame_pose(q, link))
    assert np.array_equal(arm.frame_pose(q, "root"), np.eye(4))
    tool = np.linalg.inv(arm.frame_pose(q, "lower")) @ arm.frame_pose(q, "tool")
    assert tool[:3, 3] == pytest.approx([0, 0, 0.1], abs=1e-15) and tool[:3, 0] == pytest.approx([0, 0, -1], abs=1e-15)


@pytest.mark.parametrize("angle", [1e-300, 1e-8, 0.5, np.pi / 2, 3.0, -100.0, 12345.678, 1e6, -1e6])
def test_angles_of_many_turns(robot, angle):
    m = robot(
        f'<robot name="r"><link name="a"/><link name="b">{INERTIAL}</link><joint name="j" type="continuous">'
        '<parent link="a"/><child link="b"/><axis xyz="0 0 1"/></joint></robot>'
    )
    T = m.frame_pose(np.array([angle]), "b")
    assert [T[0, 0], T[1, 0]] == pytest.approx([np.cos(angle), np.sin(angle)], rel=1e-15, abs=1e-16)


def test_where_link_and_joint_share_a_name_one_says_which(robot):
    m = robot(ARM.replace('"upper"', '"slide"'))  # the link that the joint `slide` hangs on
    q = np.array([0.3, -0.2])
    assert np.array_equal(m.frame_pose(q, "link:slide"), m.frame_pose(q, "shoulder"))


def test_gravity_is_an_argument(robot):
    zero = np.zeros(2)
    for g in ((0, 0, -9.81), (1, 2, 3), (0, 0, 0)):
        m = robot(ARM, gravity=g)
        assert m.gravity == pytest.approx(g)
        assert m.reactions(zero, zero, zero, joints=["base"])[0, :3] == pytest.approx(-8 * np.array(g), abs=1e-12)
    assert robot(ARM).gravity == pytest.approx((0, 0, -9.81))


def test_payload_is_a_link_with_a_point_mass(robot):
    """A point mass given as payload, and the same mass as a link of its own on a fixed joint."""
    with_link = ARM.replace(
        "</robot>",
        '<link name="load"><inertial><mass value="3"/><inertia ixx="0" iyy="0" izz="0" ixy="0" ixz="0" iyz="0"/></inertial></link>'
        '<joint name="grip" type="fixed"><origin xyz="0.1 0.2 0.3"/><parent link="tool"/><child link="load"/></joint></robot>',
    )
    loaded, linked = robot(ARM, payloads={"tool": (3, (0.1, 0.2, 0.3))}), robot(with_link)
    q, v, a = states(loaded, 5)
    names = ["shoulder", "slide", "flange", "base"]
    assert loaded.reactions(q, v, a, joints=names) == pytest.approx(linked.reactions(q, v, a, joints=names), rel=1e-12, abs=1e-12)
    assert loaded.links[3].mass == 5
    assert np.abs(loaded.inverse_dynamics(q, v, a) - robot(ARM).inverse_dynamics(q, v, a)).min() > 1e-3


def test_external_wrench_is_in_the_links_axes_at_its_origin(arm):
    """A force on the tool is held by the flange alone, in the tool's own axes."""
    q, v, a = states(arm, 3)
    w = np.array([1.0, 2, 3, 4, 5, 6])
    with_it, without = (arm.reactions(q, v, a, e, joints=["flange"])[:, 0] for e in ({"tool": w}, None))
    assert with_it - without == pytest.approx(np.tile(-w, (3, 1)), abs=1e-12)


def test_both_signs_of_a_quaternion_are_one_rotation(flying):
    q, v, a = states(flying, 4)
    negative = q.copy()
    negative[:, 3:7] *= -1
    assert flying.inverse_dynamics(negative, v, a) == pytest.approx(flying.inverse_dynamics(q, v, a), rel=1e-12, abs=1e-12)


# errors


def refused(call, *words: str) -> None:
    """The call raises a ValueError of one line that has all the words."""
    with pytest.raises(ValueError) as e:
        call()
    text = str(e.value)
    assert "\n" not in text and all(w in text for w in words), text


def test_wrong_shapes_are_said(arm):
    q, v, a = states(arm, 3)
    refused(lambda: arm.inverse_dynamics(q[:, :1], v, a), "q has shape (3, 1)", "(…, 2)", "nq")
    refused(lambda: arm.inverse_dynamics(q, v.T, a), "v has shape (2, 3)", "(…, 2)", "nv")
    refused(lambda: arm.inverse_dynamics(q, v, [1.0]), "a has shape (1,)")
    refused(lambda: arm.inverse_dynamics(q, v[:2], a), "don't broadcast", "q (3, 2)", "v (2, 2)")
    refused(lambda: arm.inverse_dynamics(q, v, a, {"tool": np.zeros((3, 5))}), "external['tool'] has shape (3, 5)", "(…, 6)")
    refused(lambda: arm.inverse_dynamics(q, v, a, {"tool": np.zeros((2, 6))}), "don't broadcast", "tool (2, 6)")
    refused(lambda: arm.energy(q, v[:, :1]), "v has shape (3, 1)")
    refused(lambda: arm.frame_pose(q[:, :1], "tool"), "q has shape (3, 1)")


def test_unknown_names_are_said_with_the_known_ones(arm):
    state = states(arm, 3)
    refused(lambda: arm.joint("elbow"), "no joint named 'elbow'", "shoulder, slide, flange, base")
    refused(lambda: arm.reactions(*state, joints=["elbow"]), "no joint named 'elbow'", "flange")
    refused(lambda: arm.frame_pose(state[0], "hand"), "named 'hand'", "tool")
    refused(lambda: arm.inverse_dynamics(*state, {"hand": np.zeros(6)}), "no link named 'hand'", "tool")
    refused(lambda: arm.reactions(*state, at="hand"), "at='hand': expected 'joint', 'world' or a link of arm: root, upper", "tool")
    refused(lambda: arm.reactions(*state, axes="hand"), "axes='hand': expected 'joint', 'world' or a link of arm: root, upper", "tool")
    refused(lambda: arm.reactions(*state, axes=[0, 0, 1]), "axes=[0, 0, 1]: expected 'joint', 'world' or a link")


def test_what_is_no_name_is_said(arm):
    q, v, a = states(arm, 3)
    refused(lambda: arm.jacobian(q, ["tool"]), "no link or joint named ['tool']", "flange")
    refused(lambda: arm.frame_pose(q, ["tool"]), "no link or joint named ['tool']", "flange")
    refused(lambda: arm.frame_poses(q, [["tool"]]), "no link or joint named ['tool']", "flange")
    refused(lambda: arm.reactions(q, v, a, joints=[["flange"]]), "no joint named ['flange']", "slide")
    refused(lambda: arm.joint(["flange"]), "no joint named ['flange']", "slide")
    refused(lambda: arm.frame_poses(q, 5), "names=5; expected a list of names")
    refused(lambda: arm.reactions(q, v, a, joints=5), "joints=5; expected a list of names")


def test_external_wrenches_that_are_no_mapping_are_said(arm):
    q, v, a = states(arm, 7)
    time = np.linspace(0, 1, 7)
    for external in ([np.zeros(6)], np.zeros((7, 6)), "tool", []):
        sentence = f"external is {type(external).__name__}; expected a mapping {{link name: (…, 6)}}"
        refused(lambda: arm.inverse_dynamics(q, v, a, external), sentence)
        refused(lambda: arm.reactions(q, v, a, external), sentence)
        refused(lambda: arm.external_power(q, v, external), sentence)
        refused(lambda: arm.wrench_table(time, q, v, a, external=external), sentence)


def test_a_missing_argument_is_said(arm):
    q, v, a = states(arm, 3)
    refused(lambda: arm.inverse_dynamics(q, None, a), "v is None; expected (…, 2): nv numbers for each state")
    refused(lambda: arm.inverse_dynamics(None, v, a), "q is None; expected (…, 2): nq numbers for each state")
    refused(lambda: arm.forward_dynamics(q, v, None), "tau is None; expected (…, 2)")
    refused(lambda: arm.inverse_dynamics(q, v, a, {"tool": None}), "external['tool'] is None; expected (…, 6): force, then moment")


def test_bad_arguments_of_load_are_said(robot, tmp_path):
    refused(lambda: robot(ARM, mimic="yes"), "mimic='yes'", "'independent'")
    refused(lambda: robot(ARM, gravity=(0, 0)), "gravity needs three finite numbers")
    refused(lambda: robot(ARM, gravity=(0, 0, np.inf)), "gravity needs three finite numbers")
    refused(lambda: robot(ARM, payloads={"tool": (-1, (0, 0, 0))}), "payload on tool", "-1", "not negative")
    refused(lambda: robot(ARM, payloads={"tool": (np.nan, (0, 0, 0))}), "payload on tool", "nan")
    refused(lambda: robot(ARM, payloads={"tool": (1, (0, 0))}), "payload point needs three finite numbers")
    refused(lambda: robot(ARM, gravity="down"), "gravity needs three finite numbers, found 'down'")
    for load in (1.0, "heavy", (1,), (1, (0, 0, 0), 2), (None, (0, 0, 0))):
        refused(lambda: robot(ARM, payloads={"tool": load}), f"payload on tool: found {load!r}", "(mass in kg, (x, y, z)")
    with pytest.raises(ksl.DescriptionError, match="hand"):
        robot(ARM, payloads={"hand": (1, (0, 0, 0))})
    with pytest.raises(ksl.DescriptionError, match="absent.urdf"):
        ksl.load(tmp_path / "absent.urdf")
    assert issubclass(ksl.DescriptionError, ValueError) and issubclass(ksl.MotionError, ValueError)


def test_an_impossible_inertia_is_a_warning_or_with_strict_an_error(robot):
    text = ARM.replace('izz="0.4"', 'izz="4"', 1)
    with pytest.warns(ksl.DescriptionWarning, match="link root") as said:
        m = robot(text)
    assert len(said) == 1 and len(m.warnings) == 1
    assert said[0].filename.endswith("conftest.py"), "the warning points at the caller of load"
    with pytest.raises(ksl.DescriptionError, match="link root"):
        robot(text, strict=True)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert robot(ARM, strict=True).warnings == ()


def test_a_path_may_be_bytes(robot):
    m = robot(ARM)
    assert ksl.load(os.fsencode(m.file)).joints == m.joints
    with pytest.raises(ksl.DescriptionError, match="absent.urdf"):
        ksl.load(b"absent.urdf")


def test_import_needs_numpy_only():
    code = "import sys, ksl; ksl.load; print(*{m.partition('.')[0] for m in sys.modules})"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert "numpy" in loaded and "ksl" in loaded
    assert not {"scipy", "pyarrow", "typer", "plotly", "rich", "click", "pandas"} & set(loaded)


def test_messages_show_control_characters_of_names_and_are_short():
    links = '<link name="a&#10;b"/><link name="c&#8238;d"/>'
    joint = '<joint name="j" type="fixed"><parent link="a&#10;b"/><child link="c&#8238;d"/></joint>'
    m = ksl.load_string(f'<robot name="r">{links}{joint}</robot>', masses="optional")
    for call in (
        lambda: m.frame_pose([], "zz"),
        lambda: m.link("zz"),
        lambda: m.reactions([], [], [], at="zz"),
        lambda: m.inverse_dynamics([], [], [], external={"zz": np.zeros(6)}),
    ):
        with pytest.raises(ValueError, match="zz") as found:
            call()
        assert r"a\x0ab" in str(found.value) and r"c\u202ed" in str(found.value) and str(found.value).isprintable()
    with pytest.raises(ValueError, match="no link or joint named") as found:
        m.frame_pose([], "z" * 1_000_000)
    assert len(str(found.value)) < 5000


def test_positions_and_velocities_of_a_joint(robot):
    """Of a joint with numbers of its own, and of one that follows it: multiplier × that of the leader + offset, and the derivatives of that."""
    text = ARM.replace('<axis xyz="1 1 0"/>', '<axis xyz="1 1 0"/><mimic joint="shoulder" multiplier="0.2" offset="0.1"/>')
    m = robot(text)
    q, v = np.array([[0.5], [-0.25]]), np.array([3.0])
    shoulder, slide = m.joint("shoulder"), m.joint("slide")
    assert slide.leader == "shoulder" and np.array_equal(m.position_of(shoulder, q), q[:, 0]) and m.velocity_of(shoulder, v) == 3.0
    assert np.array_equal(m.position_of(slide, q), 0.2 * q[:, 0] + 0.1) and m.velocity_of(slide, v) == 0.2 * 3.0
    assert m.position_of("slide", [0.5]) == 0.2 * 0.5 + 0.1 and m.velocity_of("shoulder", [3.0]) == 3.0
    with pytest.raises(ValueError, match="joint base has no coordinates; expected one with one"):
        m.position_of("base", q)


def test_where_a_joint_is(arm):
    assert [arm.joint_index(joint.name) for joint in arm.joints] == list(range(len(arm.joints)))
    with pytest.raises(ValueError, match="no joint named 'slyde'; did you mean 'slide'"):
        arm.joint_index("slyde")


def test_ranges_of_random_positions(robot, flying):
    lower, upper = flying.position_ranges
    assert lower.tolist()[7:] == [-1, -0.5] and upper.tolist()[7:] == [2, 0.5]  # those of the file
    assert lower.tolist()[:3] == [-1, -1, -1] and upper.tolist()[:3] == [1, 1, 1]
    assert robot(ARM.replace("revolute", "continuous")).position_ranges[1][0] == np.pi
    for x in (lower, upper):
        with pytest.raises(ValueError, match="read-only"):
            x[0] = 5


@pytest.mark.parametrize("leading", [(), (4,), (2, 3)])
def test_efforts_and_reactions_in_one_pass(arm, leading):
    q, v, a = states(arm, *leading)
    external = {"tool": np.array([1.0, 2, 3, 4, 5, 6])}
    keywords = [{}, {"on": "parent", "at": "world", "axes": "world", "order": "ang_lin", "part": "constraint", "joints": ["flange", "shoulder"]}]
    for axes in ("link", "world"):
        tau, *found = arm.inverse_dynamics_with_reactions(q, v, a, [arm.reaction_request(**k) for k in keywords], external, external_axes=axes)
        assert np.array_equal(tau, arm.inverse_dynamics(q, v, a, external, external_axes=axes))
        for k, wrenches in zip(keywords, found, strict=True):
            assert np.array_equal(wrenches, arm.reactions(q, v, a, external, external_axes=axes, **k))


def test_a_request_for_what_there_is_not_is_refused(arm):
    for keywords, said in [
        ({"on": "chlid"}, "on='chlid'; did you mean 'child'"),
        ({"at": "tol"}, "at='tol': did you mean 'tool'"),
        ({"axes": "wolrd"}, "axes='wolrd': did you mean 'world'"),
        ({"order": "lin"}, "order='lin'"),
        ({"part": "totl"}, "part='totl'; did you mean 'total'"),
        ({"joints": ["slyde"]}, "no joint named 'slyde'"),
    ]:
        with pytest.raises(ValueError, match=said):
            arm.reaction_request(**keywords)


def test_arguments_as_calls_take_them(arm):
    table = {"slide": [0.25, 0.5], "shoulder": [1.0, 2.0]}
    assert arm.as_array(table, "q").tolist() == arm.in_order(table, "q").tolist() == [[1.0, 0.25], [2.0, 0.5]]
    assert arm.as_array(3, "v").tolist() == [3, 3] and arm.in_order(3, "v") == 3
    with pytest.raises(ValueError, match="there is none for shoulder"):
        arm.as_array({"slide": 1.0}, "q")
