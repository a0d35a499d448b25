"""Files are hashed as they are read, with all that they include, and a file that changes meanwhile is refused."""

import hashlib
import os
import threading

import numpy as np
import pytest

import ksl
from ksl.base import files_read
from ksl.base.files_read import being_read, recorded
from ksl.load_cases.case_files.case_file import read_cases
from ksl.load_cases.holding import read_pose
from ksl.motions.reading import read_motion, read_wrenches
from ksl.sizing.catalogue.components import read_components
from ksl.sizing.catalogue.example import example_file


def sha256(path):
    return hashlib.sha256(path.read_bytes()).hexdigest()


def replaced(path, text):
    other = path.with_name("other")
    other.write_text(text)
    os.replace(other, path)


@pytest.fixture(scope="module")
def ur5(examples):
    return ksl.load(examples / "robots/ur5.urdf")


def wrench(ur5, path, columns):
    path.write_text(f"time,{columns}\n0,1\n0.1,1\n")
    return np.array([0, 0.1])


def mapped(ur5, path, examples):
    path.write_text('[columns]\nelbow = "elbow"\n')
    return lambda: read_motion(ur5, examples / "motions/ur5_pick.csv", map=path)


def external(ur5, path, examples):
    time = wrench(ur5, path, "tool0.fx")
    return lambda: read_wrenches(ur5, path, time)


def cases(ur5, path, examples):
    path.write_text(f'[cases.a]\nmotion = "{examples / "motions/ur5_pick.csv"}"\n')
    return lambda: read_cases(ur5, path)


def components(ur5, path, examples):
    path.write_text(example_file("shoulder_pan_joint", "ur5"))
    return lambda: read_components(path)


def pose(ur5, path, examples):
    path.write_text("elbow = 1.0\n")
    return lambda: read_pose(ur5, path)


def motion(ur5, path, examples):
    path.write_bytes((examples / "motions/ur5_pick.csv").read_bytes())
    return lambda: read_motion(ur5, path)


def robot(ur5, path, examples):
    path.write_bytes((examples / "robots/ur5.urdf").read_bytes())
    return lambda: ksl.load(path)


READERS = {"map": mapped, "external": external, "cases": cases, "components": components, "pose": pose, "motion": motion, "robot": robot}
"""{role: makes such a file, and reads it}.  results: below, and in test/sizing."""


@pytest.mark.parametrize("role", READERS)
def test_each_reader_enters_its_files(role, ur5, tmp_path, examples):
    path = tmp_path / (f"{role}.toml" if role not in ("external", "motion", "robot") else f"{role}.csv")
    read = READERS[role](ur5, path, examples)
    read()  # without a ledger
    with recorded() as ledger:
        read()
    assert [(f.role, f.sha256) for f in ledger.files if f.file == str(path)] == [(role, sha256(path))]


def test_a_file_that_changes_while_it_is_read_is_refused(tmp_path):
    path = tmp_path / "m.csv"
    path.write_text("a")
    for change in (lambda: replaced(path, "b"), lambda: path.write_text("longer"), path.unlink):
        with pytest.raises(ValueError, match="has changed while it was read; wait until it is complete"), recorded(), being_read("motion", path, ValueError):
            change()
    path.write_text("a")
    with pytest.raises(ValueError, match="since it was read first"), recorded():
        for text in ("b", "c"):
            with being_read("motion", path, ValueError):
                pass
            replaced(path, text)


def test_large_files_are_hashed_by_a_thread(tmp_path, monkeypatch):
    monkeypatch.setattr(files_read, "SMALL", 10)
    path = tmp_path / "m.csv"
    path.write_text("a" * 100)
    with recorded() as ledger, being_read("motion", path, ValueError):
        pass
    assert ledger.files[0].sha256 == sha256(path)


def test_the_hash_of_a_file_that_is_refused_is_given_up(tmp_path, monkeypatch):
    given_up = []
    monkeypatch.setattr(files_read, "SMALL", 10)
    monkeypatch.setattr(files_read, "sha256_of", lambda _, stop: given_up.append(stop.wait(60)))
    path = tmp_path / "m.csv"
    path.write_text("a" * 100)
    with pytest.raises(ValueError, match="refused"), recorded(), being_read("motion", path, ValueError):
        raise ValueError("refused")
    assert given_up == [True]
    monkeypatch.undo()
    stop = threading.Event()
    stop.set()
    assert files_read.sha256_of(files_read.state_of(str(path)), stop) is None


CUBE = (
    "".join(f"v {x} {y} {z}\n" for x in (0, 1) for y in (0, 1) for z in (0, 1))
    + "f 1 2 4\nf 1 4 3\nf 5 7 8\nf 5 8 6\nf 1 5 6\nf 1 6 2\nf 3 4 8\nf 3 8 7\nf 1 3 7\nf 1 7 5\nf 2 6 8\nf 2 8 4\n"
)


def test_mjcf_is_hashed_with_what_it_includes_and_with_meshes(tmp_path):
    """Whatever changes the mass changes a hash."""
    pytest.importorskip("mujoco")
    (tmp_path / "meshes").mkdir()
    (tmp_path / "meshes/cube.obj").write_text(CUBE)
    (tmp_path / "arm.xml").write_text('<mujoco><include file="deeper.xml"/></mujoco>')
    deeper = '<mujoco><worldbody><body name="b"><joint name="j"/><geom type="sphere" size="0.1" mass="{}"/><geom type="mesh" mesh="cube" density="1"/></body></worldbody></mujoco>'
    (tmp_path / "deeper.xml").write_text(deeper.format(20))
    main = tmp_path / "robot.xml"
    main.write_text('<mujoco><compiler meshdir="meshes"/><asset><mesh name="cube" file="cube.obj"/></asset><include file="arm.xml"/></mujoco>')
    first = ksl.load(main)
    assert {(f.role, os.path.basename(f.file), f.sha256) for f in first.inputs} == {
        (role, name, sha256(tmp_path / folder / name))
        for role, folder, name in (("robot", "", "robot.xml"), ("included", "", "arm.xml"), ("included", "", "deeper.xml"), ("mesh", "meshes", "cube.obj"))
    }
    (tmp_path / "deeper.xml").write_text(deeper.format(2))
    second = ksl.load(main)
    assert second.link("b").mass == pytest.approx(first.link("b").mass - 18) and set(first.inputs) ^ set(second.inputs)
    (tmp_path / "meshes/cube.obj").write_text(CUBE.replace("v 1", "v 2"))
    assert ksl.load(main).link("b").mass == pytest.approx(second.link("b").mass + 1) and set(ksl.load(main).inputs) ^ set(second.inputs)
    assert ksl.load_string(
        main.read_text().replace("arm.xml", str(tmp_path / "arm.xml")).replace('meshdir="meshes"', f'meshdir="{tmp_path / "meshes"}"')
    ).inputs


def test_models_from_models_keep_the_files(ur5, examples, tmp_path):
    gripper = tmp_path / "gripper.urdf"
    gripper.write_text(
        '<robot name="g"><link name="palm"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>'
    )
    one = ur5.inputs
    for made in (
        ur5.with_payload("tool0", 1),
        ur5.with_gravity([0, 0, 0]),
        ur5.with_parameters({"tool0": np.eye(10)[0]}),
        ur5.with_physics("all"),
        ur5.subtree("upper_arm_link"),
    ):
        assert made.inputs == one
    assert ur5.merged(ksl.load(gripper), "tool0", prefix="g_").inputs == (*one, ksl.load(gripper).inputs[0])


def test_what_runs_say_is_what_was_read(ur5, examples, tmp_path):
    """Also where the files are others by then."""
    path, moved = tmp_path / "ur5.urdf", tmp_path / "pick.csv"
    path.write_bytes((examples / "robots/ur5.urdf").read_bytes())
    moved.write_bytes((examples / "motions/ur5_pick.csv").read_bytes())
    expected = {"robot": sha256(path), "motion": sha256(moved)}
    model = ksl.load(path)
    replaced(path, "<robot/>")
    run = ksl.compute_loads(model, moved)
    assert {f.role: f.sha256 for f in run.provenance.inputs} == expected
    assert {f.role: f.sha256 for f in ksl.hold(model).provenance.inputs} == {"robot": expected["robot"]}
