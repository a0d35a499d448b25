"""Where meshes are looked for, what is known of them from their first bytes, and how large they are."""

import io
import zipfile

import numpy as np
import pytest
from files import hinge, link, more, stl

import ksl
from ksl.robot_files.mesh_files import find_mesh, mesh_bounds, mesh_fault, path_of_uri


def robot_with(*meshes):
    visuals = "".join(f'<visual><geometry><mesh filename="{mesh}"/></geometry></visual>' for mesh in meshes)
    return more(f'<link name="x">{visuals}</link>', hinge("j", "fore", "x", kind="fixed"))


@pytest.fixture
def workspace(tmp_path):
    """Two packages, one of which has the robot, in a folder of another name."""
    for folder in ("src/arm-main/urdf", "src/arm-main/meshes", "elsewhere/gripper/meshes", "install/share/tool/meshes"):
        (tmp_path / folder).mkdir(parents=True)
    (tmp_path / "src/arm-main/package.xml").write_text("<package><name>arm_description</name></package>")
    for folder in ("src/arm-main/meshes", "elsewhere/gripper/meshes", "install/share/tool/meshes"):
        (tmp_path / folder / "part.stl").write_bytes(stl())
    return tmp_path


def test_packages_are_found_as_ros_finds_them(workspace, monkeypatch):
    robot = workspace / "src/arm-main/urdf/arm.urdf"
    robot.write_text(
        robot_with("package://arm_description/meshes/part.stl", "package://gripper/meshes/part.stl", "package://tool/meshes/part.stl", "../meshes/part.stl")
    )
    findings = ksl.check(robot)
    assert findings.rules == {"package-missing": 2} and "gripper" in findings[0].found
    assert ksl.check(robot, package_paths=[workspace / "elsewhere", workspace / "install"]).status == 0
    assert ksl.check(robot, package_paths=[workspace / "elsewhere/gripper", workspace / "install"]).status == 0
    assert ksl.check(robot, package_paths=[workspace / "src"]).rules == {"package-missing": 2}  # a folder without them
    monkeypatch.setenv("ROS_PACKAGE_PATH", f"/nowhere:{workspace / 'elsewhere'}")
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(workspace / "install"))
    assert ksl.check(robot).status == 0


def test_a_folder_that_is_given_for_any_package(workspace):
    """It is that of a package if it has its name, or a mesh of it."""
    robot = workspace / "src/arm-main/urdf/arm.urdf"
    for mesh, folder, rule in (
        ("gripper/meshes/none.stl", "elsewhere/gripper", "mesh-missing"), ("tool/meshes/none.stl", "elsewhere/gripper", "package-missing"), ("tool/meshes/part.stl", "elsewhere/gripper", None),
        ("gripper/meshes/none.stl", "elsewhere", "mesh-missing"),
    ):  # fmt: skip
        robot.write_text(robot_with(f"package://{mesh}"))
        assert ksl.check(robot, package_paths=[workspace / folder]).rules == ({rule: 1} if rule else {}), mesh


def test_a_slash_too_many_is_told_and_the_mesh_is_found(workspace):
    robot = workspace / "src/arm-main/urdf/arm.urdf"
    robot.write_text(robot_with("package:///arm_description/meshes/part.stl", "package:///arm_description/meshes/part.stl"))
    (finding,) = ksl.check(robot)
    assert (finding.rule, finding.value, finding.repair) == ("mesh-uri", 2, "Write package://arm_description/meshes/part.stl.") and finding.fixable


def test_other_ways_to_name_a_file(tmp_path):
    mesh = tmp_path / "a part.stl"
    mesh.write_bytes(stl())
    robot = tmp_path / "robot.urdf"
    for uri in ("a part.stl", "./a part.stl", str(mesh), f"file://{mesh}", f"file://{str(mesh).replace(' ', '%20')}"):
        assert find_mesh(uri, robot) == mesh or find_mesh(uri, robot).samefile(mesh), uri
    assert find_mesh("part.stl", robot, [tmp_path]) is None
    assert [path_of_uri(f"file://{path}", True) for path in ("/C:/a.stl", "/a/b.stl", "host/a", "")] == ["C:/a.stl", "/a/b.stl", "host/a", ""]
    assert path_of_uri("file:///C:/a.stl", False) == "/C:/a.stl"
    assert find_mesh("x" * 5000, robot) is None and find_mesh("a\0b", robot) is None


def test_a_missing_mesh_is_told_once_with_the_place_looked_at(check, tmp_path):
    findings = check(robot_with("none.stl", "none.stl"))
    assert findings.rules == {"mesh-missing": 1} and str(tmp_path / "none.stl") in findings[0].found


def zipped(size):
    """An archive of one file of zeros, whose directory says its size."""
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("a.stl", bytes(100))
    data, wrong = bytearray(packed.getvalue()), size.to_bytes(4, "little")
    directory = data.index(b"PK\1\2")
    data[directory + 24 : directory + 28] = wrong
    return bytes(data)


@pytest.mark.parametrize(
    "name, data, fault",
    [
        ("a.stl", stl(), None),
        ("a.stl", stl(declared=90), "cut short"),
        ("a.stl", b"solid x\n facet normal 0 0 1\n outer loop\n vertex 0 0 0\n", None),
        ("a.stl", b"solid by CAD".ljust(80) + stl()[80:], None),
        ("a.stl", b"", "empty"),
        ("a.stl", b"hello", "84"),
        ("a.dae", b"version https://git-lfs.github.com/spec/v1\noid sha256:4\n", "git lfs pull"),
        ("a.dae", b'<?xml version="1.0"?><COLLADA/>', None),
        ("a.dae", b"PK\3\4", "broken archive"),
        ("a.zip", zipped(1 << 20), None),
        ("a.3mf", zipped(1 << 29), "archive of 512 MB, and 256 MB are the most"),
        ("a.stl.gz", b"\x1f\x8b\x08", "compressed; unpack it"),
        ("a.obj", b"v 1 2 3\n", None),
        ("a.obj", b"\0\1\2", "OBJ"),
        ("a.glb", b"glTF\2\0\0\0", None),
        ("a.glb", b"JSON", "glTF"),
    ],
)
def test_faults_from_the_first_bytes(tmp_path, name, data, fault):
    path = tmp_path / name
    path.write_bytes(data)
    found = mesh_fault(path)
    assert found is None if fault is None else fault in found


def test_extents(tmp_path):
    """A cube of 0.1 m as three kinds of files, and a large text file that is read in windows."""
    (tmp_path / "a.stl").write_bytes(stl(size=0.1))
    corners = "\n".join(f"{{}} {x} {y} {z}" for x in (-0.05, 0.05) for y in (-0.05, 0.05) for z in (0, 0.05))
    (tmp_path / "b.stl").write_text("solid\n facet\n" + corners.replace("{}", "  vertex"))
    (tmp_path / "c.obj").write_text("o cube\n" + corners.replace("{}", "v") + "\nvn 9 9 9\nf 1 2 3\n")
    (tmp_path / "d.obj").write_text((corners.replace("{}", "v") + "\n") * 20_000)
    for name in ("a.stl", "b.stl", "c.obj", "d.obj"):
        bounds = mesh_bounds(tmp_path / name)
        assert np.allclose(bounds[0][:2], -0.05) and np.allclose(bounds[1], 0.05), name
    (tmp_path / "e.obj").write_text("no vertices")
    assert mesh_bounds(tmp_path / "e.obj") is None and mesh_bounds(tmp_path / "f.dae") is None


def test_a_mesh_stands_for_a_box_of_its_size(check, tmp_path):
    """2000 kg in a cube of 0.1 m, and the same drawn with a scale of 10."""
    (tmp_path / "cube.stl").write_bytes(stl())
    for scale, rules in (("1 1 1", {"mass-units"}), ("10 10 10", set())):
        mesh = f'<visual><geometry><mesh filename="cube.stl" scale="{scale}"/></geometry></visual>'
        text = more(link("x", 2000, mesh, 'ixx="150" iyy="150" izz="150"'), hinge("j", "fore", "x"))
        assert set(check(text).rules) - {"inertia-too-large", "inertia-units"} == rules
