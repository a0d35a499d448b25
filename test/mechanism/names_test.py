"""Names of links and joints, whatever they are called: every call that takes one says which it means, or is refused with the way to say it."""

import re
import warnings

import numpy as np
import pytest
from ksl_command import run_ksl

from linkages import FOURBAR

import ksl
from ksl.robot_files.stiffness_file import stiff_by
from ksl.simulation import PD, Brake

LINK_ORIGIN = [0.1, 0.2, 0.3]
EXTERNAL = np.array([1.0, 2, 3, 4, 5, 6])


@pytest.fixture(scope="module")
def robot():
    """Names as legged robots have them: joint `hip` carries link `thigh`, and link `hip` is welded to the body.  Links `base` and `world` hang somewhere."""
    b = ksl.Builder("named")
    b.add_link("base_link")
    for name in ("base", "hip", "thigh", "shank", "world"):
        b.add_link(name, 1.0, (0.1, 0.0, 0.02), np.diag([0.1, 0.2, 0.25]))
    b.add_joint("weld", "fixed", "base_link", "base")
    b.add_joint("housing", "fixed", "base", "hip", _pose(LINK_ORIGIN))
    b.add_joint("hip", "revolute", "base", "thigh", _pose([0.5, 0, 0]), axis=(1, 0, 0))
    b.add_joint("knee", "revolute", "thigh", "shank", _pose([0, 0, -0.4]), axis=(0, 1, 0))
    b.add_joint("ankle", "revolute", "shank", "world", _pose([0, 0, -0.4]), axis=(0, 1, 0))
    return b.build()


def _pose(t):
    pose = np.eye(4)
    pose[:3, 3] = t
    return pose


@pytest.fixture(scope="module")
def state(robot):
    rng = np.random.default_rng(3)
    return robot.random(rng), rng.normal(size=robot.nv), rng.normal(size=robot.nv), rng.normal(size=robot.nv)


STIFF = {"hip": 1e4, "knee": [1e6] * 6}
FRAMES = {
    "frame_pose": lambda m, s, name: m.frame_pose(s[0], name),
    "frame_poses": lambda m, s, name: m.frame_poses(s[0], [name]),
    "frame_velocity": lambda m, s, name: m.frame_velocity(s[0], s[1], name),
    "frame_velocities": lambda m, s, name: m.frame_velocities(s[0], s[1], name),
    "frame_acceleration": lambda m, s, name: m.frame_acceleration(s[0], s[1], s[2], name),
    "frame_accelerations": lambda m, s, name: m.frame_accelerations(s[0], s[1], s[2], [name]),
    "frame_velocity_derivatives": lambda m, s, name: m.frame_velocity_derivatives(s[0], s[1], name),
    "frame_velocities_derivatives": lambda m, s, name: m.frame_velocities_derivatives(s[0], s[1], [name]),
    "frame_acceleration_derivatives": lambda m, s, name: m.frame_acceleration_derivatives(s[0], s[1], s[2], name),
    "frame_accelerations_derivatives": lambda m, s, name: m.frame_accelerations_derivatives(s[0], s[1], s[2], [name]),
    "relative_pose": lambda m, s, name: m.relative_pose(s[0], name, "shank"),
    "relative_pose, seen from": lambda m, s, name: m.relative_pose(s[0], "shank", name),
    "relative_velocity": lambda m, s, name: m.relative_velocity(s[0], s[1], name, "shank"),
    "relative_jacobian": lambda m, s, name: m.relative_jacobian(s[0], name, "shank"),
    "jacobian": lambda m, s, name: m.jacobian(s[0], name),
    "jacobian_rate": lambda m, s, name: m.jacobian_rate(s[0], s[1], name),
    "point_velocity": lambda m, s, name: m.point_velocity(s[0], s[1], name, (0.1, 0, 0)),
    "point_acceleration": lambda m, s, name: m.point_acceleration(s[0], s[1], s[2], name, (0.1, 0, 0)),
    "operational_space_inertia_inverse": lambda m, s, name: m.operational_space_inertia_inverse(s[0], [name]),
    "operational_space_inertia": lambda m, s, name: m.operational_space_inertia(s[0], [name])[0],
    "operational_space": lambda m, s, name: m.operational_space(s[0], s[1], names=[name])[0],
    "inverse_kinematics": lambda m, s, name: m.inverse_kinematics(name, np.eye(4), starts=1).q,
    "compliance": lambda m, s, name: m.compliance(s[0], name, stiffness=STIFF),
    "deflection": lambda m, s, name: m.deflection(*s[:3], name, stiffness=STIFF),
    "subtree_links": lambda m, s, name: np.array([len(m.subtree_links(name))]),
    "subtree_mass": lambda m, s, name: np.array([m.subtree_mass(name)]),
}
"""Calls that take a link, or a joint for the link that it carries."""

JOINTS = {
    "hybrid_dynamics": lambda m, s, name: m.hybrid_dynamics(*s, names=[name])[0],
    "reactions": lambda m, s, name: m.reactions(*s[:3], joints=[name]),
    "reactions_null_basis": lambda m, s, name: m.reactions_null_basis(s[0], joints=[name]),
    "reactions_unique": lambda m, s, name: m.reactions_unique(s[0], joints=[name]),
    "reactions_derivatives": lambda m, s, name: m.reactions_derivatives(*s[:3], joints=[name])[0],
    "reactions_external_derivatives": lambda m, s, name: m.reactions_external_derivatives(s[0], joints=[name]),
    "reactions_regressor": lambda m, s, name: m.reactions_regressor(*s[:3], joints=[name]),
    "simulate, friction": lambda m, s, name: m.simulate(np.zeros(3), np.zeros(3), [0, 0.01], friction={name: 0.5}).q,
    "simulate, restitution": lambda m, s, name: m.simulate(np.zeros(3), np.zeros(3), [0, 0.01], restitution={name: 0.5}).q,
    "simulate, brake": lambda m, s, name: m.simulate(np.zeros(3), np.zeros(3), [0, 0.01], brake=Brake({name: 0.5}, at=0.0)).q,
    "simulate, stiffness of gains": lambda m, s, name: m.simulate(np.zeros(3), np.zeros(3), [0, 0.01], efforts=PD(np.zeros(3), {name: 9.0}, 1.0)).q,
    "with_stiffness": lambda m, s, name: np.array([m.with_stiffness({name: np.full(6, 1e6)}).nq]),
    "modes": lambda m, s, name: m.modes(s[0], stiffness={name: 1e4}),
    "linearise": lambda m, s, name: m.linearise(s[0], inputs=[name]),
    "joint": lambda m, s, name: np.array([m.joint(name).q_index]),
    "with_frozen_joints": lambda m, s, name: np.array([m.with_frozen_joints({name: 0.3}).nq]),
    "placement of loads": lambda m, s, name: ksl.compute_loads(
        m, (np.arange(2.0), np.zeros((2, m.nq)), np.zeros((2, m.nv)), np.zeros((2, m.nv))), joints=[name]
    ),
}
"""Calls that take joints.  Links are refused, with the joint that carries them."""

LINKS = {
    "link": lambda m, s, name: m.link(name),
    "joint_above": lambda m, s, name: m.joint_above(name),
    "support": lambda m, s, name: m.support(name),
    "children": lambda m, s, name: m.children(name),
    "external": lambda m, s, name: m.inverse_dynamics(*s[:3], {name: EXTERNAL}),
    "simulate, external": lambda m, s, name: m.simulate(np.zeros(3), np.zeros(3), [0, 0.01], external={name: EXTERNAL}).q,
    "with_payload": lambda m, s, name: m.with_payload(name, 1.0),
    "with_root": lambda m, s, name: m.with_root(name),
    "subtree": lambda m, s, name: m.subtree(name),
    "with_frame": lambda m, s, name: m.with_frame("new", name),
    "with_parameters": lambda m, s, name: m.with_parameters({name: np.arange(1.0, 11)}),
    "merged": lambda m, s, name: m.merged(m, name, prefix="other_"),
    "inverse_dynamics_regressor": lambda m, s, name: m.inverse_dynamics_regressor(s[0], s[1], s[2], [name]),
    "gravity_torque_regressor": lambda m, s, name: m.gravity_torque_regressor(s[0], name),
    "momentum_regressor": lambda m, s, name: m.momentum_regressor(s[0], s[1], [name]),
    "energy_regressor": lambda m, s, name: m.energy_regressor(s[0], s[1], [name])[0],
    "section_wrench": lambda m, s, name: m.section_wrench(*s[:3], name, (0, 0, 0), (1, 0, 0)),
}
"""Calls that take links.  Joints are refused."""

NAMES_OF = re.compile(
    r"\b(names|joints|name|link|links|joint|seen_from|beyond|parent_link|parameters|external|weights|hold|given|stiffness|friction|restitution|brake|efforts)\b(?=:|,|\)|=)"
)


def test_every_method_that_takes_names_is_in_a_table():
    """A new one must be entered above, or here with the reason."""
    import inspect

    others = {
        "reaction_request": "what reactions makes", "inverse_kinematics": "FRAMES", "parent": "joint_above", "builder": "no name of the model", "loads": "at, axes",
        "show": "viewer: joint()", "position_of": "takes a Joint", "velocity_of": "takes a Joint", "joint_index": "joint", "frame_link": "FRAMES",
        "inverse_dynamics_with_reactions": "requests", "stiffness": "no argument of that name",
        "inverse_dynamics_gradient": "weights of efforts, in the order of v",
    }  # fmt: skip
    entered = {name.split(",")[0] for table in (FRAMES, JOINTS, LINKS, CLOSED, WITH_LOOPS) for name in table}
    takes_external = {name for name, f in inspect.getmembers(ksl.Model, inspect.isfunction) if "external" in inspect.signature(f).parameters}
    for name, f in inspect.getmembers(ksl.Model, inspect.isfunction):
        takes = [p for p in inspect.signature(f).parameters if NAMES_OF.search(p + ":") and p != "external"]
        if not name.startswith("_") and takes and name not in takes_external - {"section_wrench", "hybrid_dynamics", "reactions", "operational_space"}:
            assert name in entered or name in others, f"{name} takes {takes}: enter it in FRAMES, JOINTS or LINKS"


@pytest.mark.parametrize("call", FRAMES.values(), ids=FRAMES)
def test_a_name_of_a_link_and_of_another_links_joint_is_refused(robot, state, call):
    with pytest.raises(ValueError, match=r"'hip' names a link and also a joint, which carries another link, 'thigh'; say 'link:hip' or 'joint:hip'"):
        call(robot, state, "hip")
    assert np.array_equal(call(robot, state, "joint:hip"), call(robot, state, "thigh"))
    assert np.array_equal(call(robot, state, "link:hip"), call(robot, state, "housing"))
    assert np.array_equal(call(robot, state, "joint:knee"), call(robot, state, "knee"))  # may be said where it needn't


IN_ORDER = {
    "frame_poses": lambda m, s, names: m.frame_poses(s[0], names),
    "frame_velocities": lambda m, s, names: m.frame_velocities(s[0], s[1], names),
    "operational_space_inertia": lambda m, s, names: m.operational_space_inertia(s[0], names),
    "inverse_kinematics": lambda m, s, names: m.inverse_kinematics(names, np.eye(4)[None], starts=1),
    "hybrid_dynamics": lambda m, s, names: m.hybrid_dynamics(*s, names=names),
    "reactions": lambda m, s, names: m.reactions(*s[:3], joints=names),
    "reactions_unique": lambda m, s, names: m.reactions_unique(s[0], joints=names),
    "inverse_dynamics_regressor": lambda m, s, names: m.inverse_dynamics_regressor(*s[:3], names),
    "identify": lambda m, s, names: ksl.identification.identify(m, *(np.tile(x, (50, 1)) for x in s), links=names),
    "base_parameters": lambda m, s, names: ksl.base_parameters.structural(m, names),
    "compute_loads": lambda m, s, names: ksl.compute_loads(m, (np.arange(2.0), np.zeros((2, m.nq))), joints=names),
    "size": lambda m, s, names: ksl.size(m.wrench_table(np.arange(9.0), np.zeros((9, m.nq))), joints=names),
}
"""Calls whose results follow the order of names."""


@pytest.mark.parametrize("call", IN_ORDER.values(), ids=IN_ORDER)
def test_names_without_an_order_are_refused(robot, state, call):
    """Rows came in the order of hashes, another one in each process."""
    for names in ({"knee"}, frozenset(("shank",))):
        with pytest.raises(ValueError, match="expected a list of names, since a set has no order"):
            call(robot, state, names)
    with pytest.raises(ValueError, match="names?"):
        call(robot, state, 5)


ONCE = {
    "links": (IN_ORDER["identify"], IN_ORDER["base_parameters"]),
    "names": (IN_ORDER["hybrid_dynamics"],),
    "hold": (lambda m, s, names: m.close(s[0], hold=names), lambda m, s, names: m.branches(s[0], hold=names)),
    "given": (lambda m, s, names: m.consistent_velocity(*s[:2], given=names), lambda m, s, names: m.consistent_acceleration(*s[:3], given=names)),
    "beyond": (lambda m, s, names: m.section_wrench(*s[:3], "thigh", (0, 0, 0), (1, 0, 0), beyond=names),),
}
"""Arguments that choose, and whose order doesn't matter."""


@pytest.mark.parametrize("argument", ONCE)
def test_what_is_chosen_twice_is_refused(robot, state, argument):
    one, twice = ("shank", ["thigh", "shank", "link:shank"]) if argument == "links" else ("knee", ["hip", "knee", "knee"])
    for call in ONCE[argument]:
        with pytest.raises(ValueError, match=f"{argument}: '{one}' is named more than once; name each once"):
            call(robot, state, twice)


def test_coordinates_are_chosen_by_name_and_by_index():
    """`independent` gives indices, which `given=` refused."""
    m = ksl.load_string(FOURBAR, drives=["A"])
    start = np.array([-0.3, 0.0, 0.0])
    q = m.close(start, hold=["A"]).q
    (free,) = m.independent(q)
    name, v = m.joint_names[free], np.array([1.0, 2.0, 3.0])
    for one in ([free], np.array([free]), m.independent(q), (int(free),), free):
        assert np.array_equal(m.close(start, hold=one).q, m.close(start, hold=[name]).q)
        assert np.array_equal(m.branches(start, hold=one, starts=4), m.branches(start, hold=[name], starts=4))
        by_index = m.consistent_velocity(q, v, given=one)
        assert np.array_equal(by_index, m.consistent_velocity(q, v, given=[name])) and by_index[free] == v[free]
        assert np.array_equal(m.consistent_acceleration(q, by_index, v, given=one), m.consistent_acceleration(q, by_index, v, given=name))
    for wrong, said in (([3], "given: 3 is no index into v; expected 0 to 2"), ([-1], "given: -1 is no index"), ([True], "one of given is True"), (1.5, "given=1.5; expected a list of names of joints"),
                        ([free, name], f"given: '{name}' is named more than once"), (np.array([0.5]), "one of given is .*0.5")):  # fmt: skip
        with pytest.raises(ValueError, match=said):
            m.consistent_velocity(q, v, given=wrong)
    ball = ksl.Builder("ball").add_link("ground").add_link("body", 1.0, (0.1, 0, 0), np.eye(3)).add_joint("socket", "spherical", "ground", "body")
    ball = ball.add_loop("rod", "spherical", "body", "ground", _pose([0.5, 0, 0]), _pose([0.5, 0, 0])).build(drives=[])
    assert ball.close(ball.neutral(), hold=[0, 1, 2]).converged and len(ball.branches(ball.neutral(), hold="socket", starts=3)) == 1
    with pytest.raises(ValueError, match="hold: 1 is one of the coordinates of joint 'socket', whose position has a quaternion; name the joint"):
        ball.close(ball.neutral(), hold=[1])


def test_joints_to_be_sized_once(robot, state):
    table = robot.wrench_table(np.arange(9.0), np.zeros((9, robot.nq)))
    assert len(ksl.size(table, joints=["knee", "joint:knee"]).peaks) == len(ksl.size(table, joints="knee").peaks) > 0
    with pytest.raises(ValueError, match=r"at=\['knee'\]; expected {joint: \(x, y, z\)}, m"):
        ksl.size(table, at=["knee"])


def test_the_ways_are_among_the_frames(robot, state):
    assert {"link:hip", "joint:hip"} < set(robot.frames) and "hip" not in robot.frames
    assert len(robot.frame_poses(state[0], robot.frames)) == len(robot.frames)
    assert len(robot.frame_poses(state[0])) == len(robot.frame_velocities(*state[:2])) == len(robot.links)
    assert np.array_equal(robot.frame_pose(np.zeros(3), "link:hip")[:3, 3], LINK_ORIGIN)


@pytest.mark.parametrize("call", JOINTS.values(), ids=JOINTS)
def test_joints_are_meant_where_joints_are_taken(robot, state, call):
    call(robot, state, "hip"), call(robot, state, "joint:hip")
    with pytest.raises(ValueError, match="no joint named 'thigh'; it is a link, which joint 'hip' carries"):
        call(robot, state, "thigh")


@pytest.mark.parametrize("call", LINKS.values(), ids=LINKS)
def test_links_are_meant_where_links_are_taken(robot, state, call):
    call(robot, state, "hip"), call(robot, state, "link:hip")
    with pytest.raises(ValueError, match="no link named 'knee'; it is a joint, which carries link 'shank'"):
        call(robot, state, "knee")


CLOSED = {
    "actuation": lambda m, q, name: m.actuation([name]),
    "close": lambda m, q, name: m.close(q, hold=[name]),
    "branches": lambda m, q, name: m.branches(q, hold=[name], starts=1),
    "consistent_velocity": lambda m, q, name: m.consistent_velocity(q, np.zeros(3), given=[name]),
    "consistent_acceleration": lambda m, q, name: m.consistent_acceleration(q, np.zeros(3), np.zeros(3), given=[name]),
    "with_drives": lambda m, q, name: m.with_drives([name]),
    "load_string, drives": lambda m, q, name: ksl.load_string(LINKAGE, drives={name: 2.0}),
    "with_frozen_joints": lambda m, q, name: m.with_frozen_joints({name: q[0]}),
    "simulate, friction": lambda m, q, name: m.simulate(q, np.zeros(3), [0, 0.01], friction={name: 0.5}),
}
"""Calls of mechanisms with loops that take joints of the tree."""
WITH_LOOPS = {
    "reactions": lambda m, q, name: m.reactions(q, np.zeros(3), np.zeros(3), joints=[name]),
    "reactions_unique": lambda m, q, name: m.reactions_unique(q, joints=[name]),
    "reactions_null_basis": lambda m, q, name: m.reactions_null_basis(q, joints=[name]),
    "with_stiffness": lambda m, q, name: m.with_stiffness({name: np.full(6, 1e6)}),
    "reactions, stiffness": lambda m, q, name: m.reactions(q, np.zeros(3), np.zeros(3), stiffness={name: np.full(6, 1e6)}),
}
"""Those that take joints which close loops, too."""


LINKAGE = FOURBAR.replace('"coupler"', '"A"').replace('name="C"', 'name="rocker"')


@pytest.fixture(scope="module")
def four_bar():
    """A linkage whose joint `A` carries `crank`, where link `A` is another one; the joint that closes it has the name of the link `rocker`."""
    m = ksl.load_string(LINKAGE).with_drives(["A"])
    return m, m.close(np.zeros(3), hold=["A"]).q


@pytest.mark.parametrize("call", [*CLOSED.values(), *WITH_LOOPS.values()], ids=[*CLOSED, *WITH_LOOPS])
def test_names_in_mechanisms_with_loops(four_bar, call):
    call(*four_bar, "A"), call(*four_bar, "joint:A")
    with pytest.raises(ValueError, match="no joint named 'crank'; it is a link, which joint 'A' carries"):
        call(*four_bar, "crank")
    for name in ("rocker", "joint:rocker"):
        if call in WITH_LOOPS.values():
            call(*four_bar, name)
        else:
            with pytest.raises(ValueError, match="closes a loop"):
                call(*four_bar, name)


def test_files_of_stiffnesses_that_say_nothing_are_refused(tmp_path):
    arm = '<link name="arm"/><joint name="aside" type="revolute"><parent link="frame"/><child link="arm"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>'
    m = ksl.load_string(FOURBAR.replace("</robot>", arm), drives=["A", "aside"])
    m.with_stiffness({"A": np.full(6, 1e6), "aside": np.full(6, 1e6)})  # small motions depend on it
    (tmp_path / "none.toml").write_text("# nothing\n")
    with pytest.raises(ksl.DescriptionError, match="none.toml: no joint in it; write a table"):
        stiff_by(m, tmp_path / "none.toml")
    assert stiff_by(m, {f"joint:{name}": np.full(6, 1e6) for name in "ABCD"})[1] == []
    assert stiff_by(m, {"joint:A": np.full(6, 1e6), "C": np.full(6, 1e6)})[1][0].startswith(("B, D: ", "D, B: "))


def test_hybrid_dynamics_hold_the_joint_and_refuse_what_holds_nothing(robot, state):
    q, v, a, tau = state
    held, efforts = robot.hybrid_dynamics(q, v, a, tau, names=["hip"])
    assert held[0] == a[0] and held[1] != a[1] and np.array_equal(efforts[1:], tau[1:])
    assert np.allclose(robot.inverse_dynamics(q, v, held), efforts, atol=1e-9)
    with pytest.raises(ValueError, match="'weld' is a fixed joint, which has no acceleration to be given"):
        robot.hybrid_dynamics(q, v, a, tau, names=["weld"])
    with pytest.raises(ValueError, match="no joint named 'base_link'; it is a link, which joint 'ground' carries"):
        robot.hybrid_dynamics(q, v, a, tau, names=["base_link"])
    with pytest.raises(ValueError, match="joint weld is fixed already; leave it out"):
        robot.with_frozen_joints({"weld": []})


def test_the_joint_to_the_ground_is_not_called_as_another_link(robot, state):
    q, v, a, _ = state
    assert robot.fixed_joint_names[-1] == "ground"
    with pytest.raises(ValueError, match="no joint named 'base'; it is a link, which joint 'weld' carries"):
        robot.reactions(q, v, a, joints=["base"])
    rooted = robot.with_root("base")  # the link that the joint carries has its name
    assert rooted.fixed_joint_names[-1] == "base"


@pytest.mark.parametrize("keyword", ["at", "axes"])
def test_the_world_beside_a_link_of_that_name(robot, state, keyword):
    q, v, a, _ = state
    with pytest.raises(ValueError, match=f"{keyword}='world': the world and also a link of named, which is elsewhere; say 'link:world' or 'ksl:world'"):
        robot.reactions(q, v, a, **{keyword: "world"})
    other = ksl.Builder("other").add_link("world").add_link("arm", 1.0, (0.3, 0, 0), np.eye(3)).add_joint("j", "revolute", "world", "arm", axis=(0, 1, 0))
    same = other.build()  # a root is where the world is
    wrenches = [same.reactions([0.3], [0.1], [0.2], **{keyword: word}) for word in ("world", "ksl:world", "link:world")]
    assert np.array_equal(wrenches[0], wrenches[1]) and np.allclose(wrenches[0], wrenches[2], atol=1e-14)
    assert not np.allclose(robot.reactions(q, v, a, **{keyword: "link:world"}), robot.reactions(q, v, a, **{keyword: "ksl:world"}))
    with pytest.raises(ValueError, match="'knee' is a joint, which carries link 'shank'"):
        robot.reactions(q, v, a, **{keyword: "knee"})


WITH_FILES = {
    "load, payloads": lambda m, f, joint, link: ksl.load(f / "named.urdf", payloads={link: (2.0, (0.0, 0.3, 0.0))}).link("hip").parameters,
    "hold, pose": lambda m, f, joint, link: ksl.hold(m, {joint: 0.3}).cases[0].motion.q,
    "hold, worst": lambda m, f, joint, link: ksl.hold(m, worst=joint).cases[0].motion.q,
    "compute_loads, joints": lambda m, f, joint, link: [row["joint"] for row in ksl.compute_loads(m, f / "motion.csv", joints=[joint]).rows],
    "compute_loads, at": lambda m, f, joint, link: ksl.compute_loads(m, f / "motion.csv", at={joint: (0, 0, 0.1)}).rows[0],
    "size, joints and at": lambda m, f, joint, link: [
        p["joint"] for p in ksl.size(ksl.compute_loads(m, f / "motion.csv"), joints=joint, at={joint: (0, 0, 0.1)}).peaks
    ],
    "size, components": lambda m, f, joint, link: [
        x.joint for x in ksl.size(ksl.compute_loads(m, f / "motion.csv"), {"component": [LIMIT | {"joint": joint}]}).figures
    ],
    "read_motion, map": lambda m, f, joint, link: ksl.read_motion(m, f / "motion.csv", map={"hip": {"to": joint, "sign": -1}}).q,
    "read_motion, constants": lambda m, f, joint, link: (
        ksl.read_motion(m, f / "motion.csv", map={"columns": {}, "ignore": ["hip"], "constants": {joint: 0.7}}).q
    ),
    "read_efforts, map": lambda m, f, joint, link: ksl.read_efforts(
        m, f / "motion.csv", map={"columns": {"knee": {"to": f"{joint}.effort", "unit": "permille"}}, "rated": {joint: 3}}
    ).tau[:, 0],
}
"""Calls, and keys of files, that take a joint or a link by its name."""
LIMIT = {"kind": "limits", "name": "pin", "radial_force": 100.0}


@pytest.fixture(scope="module")
def folder(robot, tmp_path_factory):
    folder = tmp_path_factory.mktemp("named")
    (folder / "named.urdf").write_text(robot.to_urdf())
    (folder / "motion.csv").write_text("time,hip,knee,ankle\n" + "".join(f"{0.1 * k},{0.01 * k},0.1,0.2\n" for k in range(12)))
    return folder


@pytest.mark.parametrize("call", WITH_FILES.values(), ids=WITH_FILES)
def test_calls_with_files_take_names_as_others_do(robot, folder, call):
    assert np.array_equal(call(robot, folder, "hip", "hip"), call(robot, folder, "joint:hip", "link:hip"))


def test_options_take_names_as_calls_do(folder):
    given = ["loads", folder / "named.urdf", folder / "motion.csv", "--force", "--output", folder / "out", "--payload", "1"]
    summaries = []
    for joint, link in (("hip", "hip"), ("joint:hip", "link:hip")):
        done = run_ksl(*given, "--on-link", link, "--joints", joint, "--at", f"{joint}=0,0,0.1")
        assert done.returncode == 0, done.stderr
        summaries.append([line for line in (folder / "out" / "summary.csv").read_text().splitlines() if not line.startswith("#")])
    assert summaries[0] == summaries[1]


def test_files_and_commands(robot, folder, tmp_path):
    """Names in TOML and in options are those of Python."""
    file, motion = tmp_path / "named.urdf", tmp_path / "motion.csv"
    for path in (file, motion):
        path.write_bytes((folder / path.name).read_bytes())
    out, given = ["--output", str(tmp_path / "out"), "--force"], [str(file), str(motion)]

    def refused(*options):
        done = run_ksl("loads", *given, *options, *out)
        assert done.returncode
        return " ".join(done.stderr.split())

    assert "say 'link:world' or 'ksl:world'" in refused("--at", "world")
    assert "say 'link:world' or 'ksl:world'" in refused("--axes", "world")
    assert "no joint 'thigh'" in refused("--joints", "thigh")
    assert "a point of a joint that --joints leaves out" in refused("--joints", "hip", "--at", "knee=0,0,1")
    cases = tmp_path / "cases.toml"
    for entry, said in (
        ('link = "hip"', "say 'link:hip' or 'joint:hip'"),
        ('link = "shank", axes = "world"', "say 'link:world' or 'ksl:world'"),
        ('link = "shank", axes = "hip"', "say 'link:hip'"),
    ):
        cases.write_text(f'[cases.c]\nmotion = "motion.csv"\nexternal = [{{ {entry}, wrench = [1, 0, 0, 0, 0, 0] }}]\n')
        done = run_ksl("loads", str(file), "--cases", str(cases), *out)
        assert done.returncode and said in " ".join(done.stderr.split())
    carried = '[cases.c]\nmotion = "motion.csv"\npayloads = [{{ link = "{}", mass = 1 }}]\n'
    for link in ("hip", "link:hip"):
        cases.write_text(carried.format(link))
        assert ksl.compute_loads(file, cases=cases).results[0].case.payloads[0].link == "hip"
    cases.write_text(carried.format("knee"))
    with pytest.raises(ksl.CaseError, match="payload 1: named: no link named 'knee'; it is a joint, which carries link 'shank'"):
        ksl.compute_loads(file, cases=cases)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        ksl.compute_loads(robot, motion, at="link:world", axes="ksl:world", joints=["hip"])
        run = ksl.compute_loads(robot, motion)
    with pytest.raises(ValueError, match="a point of 'knee', which is none of the joints that are wanted: hip"):
        ksl.compute_loads(robot, motion, joints=["hip"], at={"knee": (0, 0, 1)})
    with pytest.raises(ksl.SizingError, match="a point of knee, which is none of the joints that are sized: hip"):
        ksl.size(run, joints=["hip"], at={"knee": (0, 0, 1)})


def test_what_is_no_path_and_no_point(robot, tmp_path):
    """Python's own words say neither which argument it is nor what is expected."""
    table, motion = robot.wrench_table(np.arange(9.0), np.zeros((9, 3))), (np.arange(2.0), np.zeros((2, 3)))
    calls = {
        "path is Model; expected the path of a robot file": (lambda: ksl.load(robot), lambda: ksl.check(robot)),
        "path is Model; expected the path of a file to be written": (lambda: robot.to_urdf(robot),),
        "path is int; expected the path of a motion": (lambda: ksl.read_motion(robot, 5),),
        "path is int; expected the path of a file with efforts": (lambda: ksl.read_efforts(robot, 5),),
        "components is list; expected the path of a components file": (lambda: ksl.size(table, [{"kind": "motor"}]),),
        "at: the point of knee needs three finite numbers": (
            lambda: ksl.size(table, at={"knee": 5}),
            lambda: ksl.compute_loads(robot, motion, at={"knee": ("a", 0, 0)}),
        ),
    }
    for sentence, refused in calls.items():
        for call in refused:
            with pytest.raises(ValueError, match=sentence):
                call()
