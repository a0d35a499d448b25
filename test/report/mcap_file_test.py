"""wrenches.mcap, read by the package of ROS 2's messages: numbers of the table, poses of the model, times; read again as a motion."""

import numpy as np
import pytest

import ksl
from ksl.load_cases.load_case import LoadCase
from ksl.report import mcap_file

pytest.importorskip("mcap_ros2")
CHAIN = """<robot name="chain"><link name="world"/>
<link name="a"><inertial><origin xyz="0.2 0 0.1"/><mass value="2"/><inertia ixx="0.01" iyy="0.03" izz="0.03" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="b"><inertial><origin xyz="0.1 0.1 0"/><mass value="1"/><inertia ixx="0.01" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="j 1" type="continuous"><parent link="world"/><child link="a"/><origin xyz="0 0 1" rpy="0.3 0.2 0"/><axis xyz="0 1 0"/></joint>
<joint name="j-1" type="prismatic"><parent link="a"/><child link="b"/><origin xyz="0.4 0 0"/><axis xyz="0 0.6 0.8"/><limit lower="-4" upper="4" effort="50" velocity="9"/></joint></robot>"""
TIME = np.linspace(0.5, 3.5, 61)


def messages(path):
    from mcap_ros2.reader import read_ros2_messages

    found = {}
    for each in read_ros2_messages(str(path)):
        found.setdefault(each.channel.topic, []).append((each.log_time_ns, each.ros_msg))
    return found


def run(shift=0.0):
    m = ksl.load_string(CHAIN)
    q = np.column_stack([2.5 * np.sin(1.3 * TIME) * TIME, 0.3 * np.cos(TIME)])
    return m, q, ksl.compute_loads(m, (TIME + shift, q), axes="world", on="parent")


def test_messages_are_the_numbers_of_the_table(tmp_path):
    m, q, done = run()
    assert "wrenches.mcap" in done.write(tmp_path, mcap=True)
    found = messages(tmp_path / "wrenches.mcap")
    assert list(found) == ["/case", "/wrench/j_1", "/wrench/j_1_2", "/wrench/base", "/joint_states", "/tf"], "two names that topics can't tell apart"
    table = m.wrench_table(TIME, q)
    for topic, joint, frame in (("/wrench/j_1", "j 1", "a"), ("/wrench/j_1_2", "j-1", "b"), ("/wrench/base", "base", "world")):
        rows = np.array(table["joint"].to_pylist()) == joint
        wrench = np.column_stack([table[c].to_numpy()[rows] for c in ("fx", "fy", "fz", "tx", "ty", "tz")])
        sent = [(x.wrench.force, x.wrench.torque) for _, x in found[topic]]
        assert np.array_equal([[getattr(part, c) for part in pair for c in "xyz"] for pair in sent], wrench)
        assert {x.header.frame_id for _, x in found[topic]} == {frame}
        assert (
            [x.header.stamp.sec * 10**9 + x.header.stamp.nanosec for _, x in found[topic]] == [ns for ns, _ in found[topic]] == [round(t * 1e9) for t in TIME]
        )
    state = found["/joint_states"][7][1]
    moves = np.array(table["joint"].to_pylist()) == "j-1"
    assert state.name == ["j 1", "j-1"] and [state.position[1], state.velocity[1], state.effort[1]] == [
        table[c].to_numpy()[moves][7] for c in ("position", "speed", "effort")
    ]


def test_poses_are_those_of_the_model(tmp_path):
    """The link that is called world has a frame beside `world_`; quaternions don't jump."""
    m, q, done = run()
    done.write(tmp_path, mcap=True)
    sent = [x.transforms for _, x in messages(tmp_path / "wrenches.mcap")["/tf"]]
    poses = m.frame_poses(q, m.link_names)
    for k, name in enumerate(m.link_names):
        assert {(x[k].header.frame_id, x[k].child_frame_id) for x in sent} == {("world_", name)}
        p, r = (
            np.array([[getattr(getattr(x[k].transform, part), c) for c in axes] for x in sent]) for part, axes in (("translation", "xyz"), ("rotation", "xyzw"))
        )
        assert np.array_equal(p, poses[:, k, :3, 3]) and (np.einsum("ij,ij->i", r[1:], r[:-1]) > 0).all()
        u, w = r[:, :3], r[:, 3:]
        for axis in np.eye(3):  # R v = v + 2 u × (u × v + w v)
            assert np.allclose(axis + 2 * np.cross(u, np.cross(u, axis) + w * axis), poses[:, k, :3, :3] @ axis, atol=1e-14)


def test_cases_follow_each_other_and_times_are_not_negative(tmp_path):
    m, q, done = run(-2.0)
    mcap_file.write_mcap(tmp_path / "one.mcap", done.cases, done.provenance)
    assert [ns for ns, _ in messages(tmp_path / "one.mcap")["/tf"]] == [round((t - 0.5) * 1e9) for t in TIME]
    both = [LoadCase(m, done.cases[0].motion, name=name) for name in ("one", "two")]
    mcap_file.write_mcap(tmp_path / "two.mcap", both, done.provenance)
    assert [(ns, x.data) for ns, x in messages(tmp_path / "two.mcap")["/case"]] == [(0, "one"), (4 * 10**9, "two")]


def test_the_motion_can_be_read_again(tmp_path):
    m, q, done = run()
    done.write(tmp_path, mcap=True)
    again = ksl.read_motion(m, tmp_path / "wrenches.mcap")
    assert np.array_equal(again.q, q) and np.allclose(again.time, TIME - TIME[0], atol=1e-9), "recordings begin at zero"
    assert np.array_equal(again.v, done.cases[0].motion.resolved_v)


def test_joints_that_close_loops_have_frames(tmp_path, examples):
    import pyarrow as pa

    t = np.arange(8.0)
    motion = pa.table({"time": t} | {f"{name}_cylinder": 0.5 + 0.01 * t for name in ("boom", "stick", "bucket")})
    done = ksl.compute_loads(examples / "robots/excavator.urdf", motion)
    done.write(tmp_path, mcap=True)
    found = messages(tmp_path / "wrenches.mcap")
    assert {x.header.frame_id for _, x in found["/wrench/boom_rod_eye"]} == {"boom_rod_eye"}
    at = {x.child_frame_id: np.array([getattr(x.transform.translation, c) for c in "xyz"]) for x in found["/tf"][3][1].transforms}
    m = ksl.load(examples / "robots/excavator.urdf")
    (loop,) = [loop for loop in m.loops if loop.name == "boom_rod_eye"]
    sides = [at[link] + m.frame_poses(done.cases[0].motion.q[3], [f"link:{link}"])[0, :3, :3] @ np.reshape(pose, (4, 4))[:3, 3]
             for link, pose in ((loop.predecessor, loop.predecessor_pose), (loop.successor, loop.successor_pose))]  # fmt: skip
    assert np.allclose(at["boom_rod_eye"], sides[1], atol=1e-12) and np.allclose(*sides, atol=1e-9), "the loop is closed there"
    state = found["/joint_states"][0][1]
    efforts = dict(zip(state.name, state.effort))
    assert np.isnan(efforts["boom_foot"]) and efforts["boom_cylinder"] != 0 and np.isfinite(dict(zip(state.name, state.position))["boom_rod_eye"])


def test_a_joint_that_closes_a_loop_and_is_called_as_a_link(tmp_path, examples):
    """Its frame has a name of its own, and the link stays where it is."""
    import pyarrow as pa

    t = np.arange(8.0)
    (tmp_path / "robot.urdf").write_text((examples / "robots/excavator.urdf").read_text().replace("boom_rod_eye", "boom"))
    done = ksl.compute_loads(tmp_path / "robot.urdf", pa.table({"time": t} | {f"{name}_cylinder": 0.5 + 0.01 * t for name in ("boom", "stick", "bucket")}))
    done.write(tmp_path / "out", mcap=True)
    found = messages(tmp_path / "out/wrenches.mcap")
    (at,) = [x.transform.translation for x in found["/tf"][3][1].transforms if x.child_frame_id == "boom"]
    assert np.allclose([at.x, at.y, at.z], done.cases[0].model.frame_poses(done.cases[0].motion.q[3], ["link:boom"])[0, :3, 3], atol=1e-12)
    assert {x.header.frame_id for _, x in found["/wrench/boom"]} == {"boom_joint"}
