"""wrenches.rrd, read by Rerun's own reader: numbers of the table, arrows and poses of the model, times, names."""

import importlib.util
import re

import numpy as np
import pytest

import ksl
from ksl.load_cases.load_case import LoadCase
from ksl.output import OutputError
from ksl.report import rrd_file

CHAIN = """<robot name="chain"><link name="ground"/>
<link name="a/b c"><inertial><origin xyz="0.2 0 0.1"/><mass value="2"/><inertia ixx="0.01" iyy="0.03" izz="0.03" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="j 1" type="continuous"><parent link="ground"/><child link="a/b c"/><origin xyz="0 0 1" rpy="0.3 0.2 0"/><axis xyz="0 1 0"/></joint></robot>"""
TIME = np.linspace(-0.5, 2.5, 31)
WRENCH = ("fx", "fy", "fz", "tx", "ty", "tz")


def columns(path):
    """{entity: {component: rows}}, with `time` in s among them."""
    chunk = pytest.importorskip("rerun.chunk")
    found = {}
    for each in chunk.RrdReader(path).stream():
        batch = each.to_record_batch()
        for field in batch.schema:
            if field.name.startswith("rerun."):
                continue
            values = batch.column(field.name)
            rows = values.cast("int64").to_numpy() / 1e9 if field.name == "time" else np.array([row[0] for row in values.to_pylist()])
            found.setdefault(each.entity_path, {})[field.name.partition(":")[2] or field.name] = rows
    return found


def run():
    m = ksl.load_string(CHAIN)
    return m, ksl.compute_loads(m, (TIME, 2.5 * np.sin(1.3 * TIME)[:, None]), axes="world", on="parent")


def test_numbers_are_those_of_the_table(tmp_path):
    pytest.importorskip("rerun")
    m, done = run()
    assert "wrenches.rrd" in done.write(tmp_path, rrd=True)
    found = columns(tmp_path / "wrenches.rrd")
    motion = done.cases[0].motion
    wrenches = m.reactions(motion.q, motion.resolved_v, motion.resolved_a)[:, 0]
    sent = [found[rf"/wrench/j\ 1/{c}"] for c in WRENCH]
    assert np.array_equal(np.column_stack([x["scalars"] for x in sent]), wrenches)
    assert all(np.allclose(x["time"], TIME, atol=1e-9) for x in sent)
    assert np.array_equal(found[r"/joints/j\ 1/position"]["scalars"], motion.q[:, 0])
    assert np.array_equal(found[r"/joints/j\ 1/effort"]["scalars"], m.inverse_dynamics(motion.q, motion.resolved_v, motion.resolved_a)[:, 0])
    (scale,) = next(x["text"] for name, x in found.items() if name.startswith("/scale/"))
    for k, what in enumerate(("force", "torque")):
        arrows = found[rf"/world/a\/b\ c/j\ 1/{what}"]["vectors"]
        part = wrenches[:, 3 * k : 3 * k + 3]
        of_a_metre = float(re.findall(r"([\d.e+-]+) N", scale)[k])
        assert np.allclose(arrows * of_a_metre, part, atol=1e-5 * np.abs(part).max()) and 0.05 < np.linalg.norm(arrows, axis=1).max() < 0.6  # of a robot of 1 m
    poses = m.frame_poses(motion.q, ["a/b c"])[:, 0]
    pose = found[r"/world/a\/b\ c"]
    (u, w), v = np.split(pose["quaternion"], [3], axis=1), np.array([0.3, -0.5, 0.8])
    assert np.allclose(pose["translation"], poses[:, :3, 3], atol=1e-6) and np.allclose(
        v + 2 * np.cross(u, np.cross(u, v) + w * v), poses[:, :3, :3] @ v, atol=1e-6
    )


def test_cases_follow_each_other_and_joints_of_loops_have_frames(tmp_path, examples):
    pytest.importorskip("rerun")
    import pyarrow as pa

    t = np.arange(6.0)
    done = ksl.compute_loads(
        examples / "robots/excavator.urdf", pa.table({"time": t} | {f"{name}_cylinder": 0.5 + 0.01 * t for name in ("boom", "stick", "bucket")})
    )
    m, motion = done.cases[0].model, done.cases[0].motion
    rrd_file.write_rrd(tmp_path / "two.rrd", [LoadCase(m, motion, name=name) for name in ("one", "tw\udcffo")], done.provenance)
    found = columns(tmp_path / "two.rrd")
    assert found["/case"]["time"][-1] == 6.0 and found["/case"]["text"][-1] == "tw?o", "the second begins a second after the first has ended"
    (loop,) = [loop for loop in m.loops if loop.name == "boom_rod_eye"]
    pose = m.frame_poses(motion.q, [f"link:{loop.successor}"])[0, 0] @ np.reshape(loop.successor_pose, (4, 4))
    assert np.allclose(found["/world/boom_rod_eye"]["translation"][0], pose[:3, 3], atol=1e-6) and "/world/boom_rod_eye/boom_rod_eye/force" in found
    assert "/joints/boom_cylinder/effort" in found and "/joints/boom_foot/effort" not in found, "where no drive is, no effort is"


def test_without_the_package(tmp_path, monkeypatch):
    find = importlib.util.find_spec
    monkeypatch.setattr(rrd_file, "find_spec", lambda name: None if name == "rerun" else find(name))
    with pytest.raises(OutputError, match=r"wrenches.rrd: is written by the package rerun-sdk; install it: pip install 'ksl\[rerun\]'"):
        run()[1].write(tmp_path, rrd=True)
    assert not list(tmp_path.iterdir())
