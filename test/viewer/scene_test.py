"""The scene: closed forms of a planar arm, surfaces of links, meshes and where they are found."""

import base64
import json
import math
import warnings
from pathlib import Path

import ksl
import numpy as np
import pytest
from ksl.load_cases.case_files.case_file import cases_of_text
from ksl.robot_files.mesh_files import find_mesh
from ksl.load_cases.results_table import read_results
from ksl.viewer.results_scene import scene_of_motion, scene_of_results
from ksl.viewer.scene import ELEMENT, make_scene, resting_position, thinned
from ksl.viewer.scene_tree import Shown, Stage, legend
from ksl.viewer.shapes import Shape, arrows, box, cylinder, ellipsoid, simplified
from ksl.viewer.still import still
from ksl.viewer.viser_server import start_server, stop_server
from ksl.viewer.visuals import appearance, inertia_ellipsoid
from text_that_is_none import damaged_text

G = 9.81


def test_wrenches_of_the_arm_held_level(arm):
    """Both links level: the shoulder carries 3 kg, and holds 2 kg at 0.5 m and 1 kg at 1.3 m."""
    scene = make_scene(arm, [0.0, 0.0])
    shoulder, elbow = (scene.joint_index(name) for name in ("shoulder", "elbow"))
    np.testing.assert_allclose(scene.constraint[0, shoulder], [0, 0, 3 * G, 0, 0, 0], atol=1e-12)
    np.testing.assert_allclose(scene.actuation[0, shoulder], [0, 0, 0, 0, -G * 2.3, 0], atol=1e-12)
    np.testing.assert_allclose(scene.effort[0, [shoulder, elbow]], [G * 2.3, G * 0.3], rtol=1e-14)
    np.testing.assert_allclose(scene.utilisation[0, [shoulder, elbow]], [G * 2.3 / 50, G * 0.3 / 10], rtol=1e-14)
    assert np.isnan(scene.utilisation[0, scene.joint_index("wrist")])
    np.testing.assert_allclose(scene.origins[0, [shoulder, elbow, scene.joint_index("wrist")]], [[0, 0, 0], [1, 0, 0], [1.6, 0, 0]], atol=1e-15)
    np.testing.assert_allclose(scene.centre_of_mass[0], [2.3 / 3, 0, 0], atol=1e-15)


def test_springs_between_points_are_lines_that_follow_the_links(arm):
    b = ksl.Builder("sprung").add_link("ground").add_link("upper", 1.0, (0, 0, 0), np.eye(3)).add_link("lower", 1.0, (0, 0, 0), np.eye(3))
    b.add_joint("shoulder", "revolute", "ground", "upper", axis=(0, -1, 0)).add_joint("elbow", "revolute", "upper", "lower", xyz=(1, 0, 0), axis=(0, -1, 0))
    m = b.add_force_element("spring", "ground", (0.5, 0, 2), "lower", (0.3, 0, 0.1), stiffness=100.0).build()
    scene = make_scene(m, [[0.0, 0.0], [math.pi / 2, -math.pi / 2]], time=[0.0, 1.0])
    np.testing.assert_allclose(scene.force_elements(0), [[[0.5, 0, 2], [1.3, 0, 0.1]]], atol=1e-12)
    np.testing.assert_allclose(scene.force_elements(1), [[[0.5, 0, 2], [0.3, 0, 1.1]]], atol=1e-12)
    assert scene.bounds(0)[1][2] == 2, "a camera sees them"
    assert [text for colour, text in legend(scene) if colour == ELEMENT] == [
        "springs, dampers and cylinders between points, which don't act: physics doesn't name force elements"
    ]
    acting = make_scene(m.with_physics("force elements"), [0.0, 0.0])
    assert (ELEMENT, "springs, dampers and cylinders between points") in legend(acting) and not make_scene(arm, [0.0, 0.0]).force_elements(0).size
    drawn = np.frombuffer(base64.b64decode(still(scene, 0)["data"][0]["z"]["bdata"]), "<f4")
    assert drawn.max() == pytest.approx(2, abs=0.02), "nothing else is so high"
    server, _ = start_server(None, "arm")
    try:
        stage = Stage(server, scene, Shown())
        stage.show(scene, 1)
        np.testing.assert_allclose(stage._elements.points, scene.force_elements(1), atol=1e-6)
    finally:
        stop_server(server)


def test_poses_and_wrenches_of_a_motion_are_those_of_single_calls(arm, swing):
    t, q, v, a = swing
    scene = make_scene(arm, q, v, a, t)
    for k in (0, 77, 200):
        for i, name in enumerate(arm.link_names):
            np.testing.assert_allclose(scene.poses[k, i], arm.frame_pose(q[k], name), atol=1e-14)
        total = arm.reactions(q[k], v[k], a[k], axes="world", joints=[j.name for j in arm.joints])
        np.testing.assert_allclose(scene.constraint[k] + scene.actuation[k], total, atol=1e-12)
    assert scene.worst_sample("elbow") == int(np.argmax(np.abs(arm.inverse_dynamics(q, v, a)[:, 1])))


def test_the_joint_that_is_selected_is_the_one_nearest_to_its_limit(arm):
    """Level: shoulder 45 %, elbow 29 %.  With the upper arm upright the shoulder holds 1 kg at 0.3 m, 6 %, and the elbow the same, 29 %."""
    assert make_scene(arm, [0.0, 0.0]).worst_joint() == "shoulder"
    assert make_scene(arm, [math.pi / 2, -math.pi / 2]).worst_joint() == "elbow"


def test_screw_axis(arm):
    """The lower link turns about the shoulder when only that moves; when both turn oppositely it is displaced without a turn."""
    scene = make_scene(arm, [0.0, 0.0], [2.0, 0.0], [0.0, 0.0])
    point, angular, pitch = scene.screw_axis(0, "elbow")
    np.testing.assert_allclose(point, [0, 0, 0], atol=1e-14)
    np.testing.assert_allclose(angular, [0, -2, 0], atol=1e-14)
    assert pitch == pytest.approx(0, abs=1e-15)
    assert make_scene(arm, [0.0, 0.0], [2.0, -2.0], [0.0, 0.0]).screw_axis(0, "elbow") is None


def test_scale_is_a_round_number_for_the_largest_wrench(arm):
    scene = make_scene(arm, [0.0, 0.0])
    for largest, per_metre in ((3 * G, 1 / scene.scale.force), (2.3 * G, 1 / scene.scale.moment)):
        digits = per_metre / 10 ** math.floor(math.log10(per_metre) + 1e-9)
        assert digits == pytest.approx(round(digits)) and round(digits) in (1, 2, 5)
        assert 0.4 / 2.6 < largest / per_metre / scene.size <= 0.4


def test_external_wrenches_are_placed_in_the_world(arm):
    scene = make_scene(arm, [0.5, 0.0], external={"hand": [1.0, 0, 0, 0, 0, 2.0]})
    np.testing.assert_allclose(scene.placed["hand"][0], [math.cos(0.5), 0, math.sin(0.5), -2 * math.sin(0.5), 0, 2 * math.cos(0.5)], atol=1e-14)


def test_the_position_at_rest_is_within_limits(robot):
    m = robot(
        '<robot name="r"><link name="a"/><link name="b"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>'
        '<joint name="j" type="revolute"><parent link="a"/><child link="b"/><limit lower="-3" upper="-1" effort="1" velocity="1"/></joint></robot>'
    )
    assert resting_position(m) == [-2.0]


def test_thinned_samples_keep_the_peaks():
    x = np.zeros((100_000, 3))
    x[12_345, 0], x[7, 2] = -5, 3
    kept = thinned(x, 1000)
    assert 1000 <= len(kept) <= 1003 and {0, 7, 12_345, 99_999} <= set(kept)
    assert (thinned(x[:10]) == np.arange(10)).all()


def test_a_long_motion_is_thinned_with_its_peaks(arm):
    t = np.linspace(0, 20, 20_001)
    q = np.column_stack([np.sin(t), np.cos(2 * t)])
    v, a = np.column_stack([np.cos(t), -2 * np.sin(2 * t)]), np.column_stack([-np.sin(t), -4 * np.cos(2 * t)])
    scene = scene_of_motion(arm, t, q, v, a, {})
    tau = arm.inverse_dynamics(q, v, a)
    assert len(scene.time) < 1510
    np.testing.assert_allclose(np.nanmax(np.abs(scene.effort[:, :2]), axis=0), np.abs(tau).max(axis=0), rtol=1e-14)
    np.testing.assert_array_equal(scene.time, t[scene.samples])


# ------------------------------------------------------------------------------------------------------------- surfaces


def volume(shape: Shape) -> float:
    """By the divergence theorem; positive where triangles are counter-clockwise seen from outside."""
    a, b, c = np.moveaxis(shape.vertices[shape.faces], 1, 0)
    return float(np.sum(a * np.cross(b, c)) / 6)


def test_volumes_of_primitives():
    assert volume(box(np.array([1, 2, 3.0]))) == pytest.approx(6, rel=1e-14)
    n = 24
    assert volume(cylinder(0.5, 2.0)) == pytest.approx(2 * 0.25 * n / 2 * math.sin(2 * math.pi / n), rel=1e-12)
    assert volume(ellipsoid(np.array([1, 2, 3.0]), 200)) == pytest.approx(4 / 3 * math.pi * 6, rel=1e-3)


def test_an_arrow_ends_at_its_tip():
    for heads in (1, 2):
        shape = arrows(np.array([[1.0, 2, 3]]), np.array([[0.0, 0.3, -0.4]]), 0.01, heads)
        assert volume(shape) > 0
        along = (shape.vertices - [1, 2, 3]) @ [0, 0.6, -0.8]
        assert along.min() == pytest.approx(0, abs=1e-15) and along.max() == pytest.approx(0.5, rel=1e-14)
    assert not len(arrows(np.zeros((1, 3)), np.zeros((1, 3)), 0.01).faces)


def test_simplified_surfaces_keep_their_extent():
    fine = ellipsoid(np.array([1.0, 0.5, 0.25]), 200)
    coarse = simplified(fine, 600)
    assert 200 < len(coarse.faces) <= 600 < len(fine.faces)
    np.testing.assert_allclose(np.ptp(coarse.vertices, axis=0), [2, 1, 0.5], rtol=0.15)
    assert simplified(coarse, 600) is coarse


def test_the_ellipsoid_of_inertia_of_an_ellipsoid_is_itself():
    """Mass 2, semi-axes 0.3, 0.2, 0.1 m, turned and moved: I = m/5 (b² + c²), moved by Steiner's theorem."""
    m, axes, centre = 2.0, np.array([0.3, 0.2, 0.1]), np.array([0.4, -0.1, 0.2])
    turn, _ = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))
    about_centre = turn @ np.diag(m / 5 * (np.sum(axes**2) - axes**2)) @ turn.T
    about_origin = about_centre + m * (centre @ centre * np.eye(3) - np.outer(centre, centre))
    xx, xy, xz, _, yy, yz, _, _, zz = about_origin.ravel()
    shape = inertia_ellipsoid(ksl.Link("link", m, tuple(m * centre), (xx, yy, zz, xy, yz, xz)))
    on = (shape.vertices - centre) @ turn / axes
    np.testing.assert_allclose(np.linalg.norm(on, axis=1), 1, rtol=1e-9)
    assert volume(shape) > 0


def test_visuals_of_a_urdf_file(arm):
    look = appearance(arm)
    assert set(look.shapes) == {"upper", "lower"} and not look.ellipsoids and not look.notes
    upper, lower = look.shapes["upper"][0], look.shapes["lower"][0]
    assert upper.colour == (1, 0, 0)
    np.testing.assert_allclose([upper.vertices.min(axis=0), upper.vertices.max(axis=0)], [[0, -0.05, -0.05], [1, 0.05, 0.05]], atol=1e-15)
    np.testing.assert_allclose([lower.vertices[:, 0].min(), lower.vertices[:, 0].max()], [0, 0.6], atol=1e-15)


MESHED = """<robot name="m"><link name="a"/><link name="b">
<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
<visual><origin xyz="0 0 1"/><geometry><mesh filename="{}" scale="0.001 0.001 0.002"/></geometry></visual></link>
<joint name="j" type="continuous"><parent link="a"/><child link="b"/></joint></robot>"""


def write_stl(path: Path) -> None:
    """A tetrahedron with edges of 100 along the axes, as text."""
    corners = np.array([[0, 0, 0], [100, 0, 0], [0, 100, 0], [0, 0, 100]])
    facets = "".join(
        "facet normal 0 0 0\nouter loop\n" + "".join(f"vertex {x} {y} {z}\n" for x, y, z in corners[list(face)]) + "endloop\nendfacet\n"
        for face in ((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3))
    )
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f"solid t\n{facets}endsolid t\n")


def test_a_mesh_is_found_scaled_and_moved(robot, tmp_path):
    pytest.importorskip("trimesh")
    write_stl(tmp_path / "parts" / "meshes" / "t.stl")
    for name in ("package://parts/meshes/t.stl", "parts/meshes/t.stl", f"file://{tmp_path}/parts/meshes/t.stl"):
        look = appearance(robot(MESHED.format(name)))
        assert not look.notes
        vertices = look.shapes["b"][0].vertices
        np.testing.assert_allclose([vertices.min(axis=0), vertices.max(axis=0)], [[0, 0, 1], [0.1, 0.1, 1.2]], atol=1e-9)


def test_pictures_of_materials_are_bounded(robot, tmp_path, monkeypatch):
    """Only colours of materials are drawn; half a megabyte of PNG may be a gigabyte of points."""
    pytest.importorskip("trimesh")
    Image, bounds = pytest.importorskip("PIL.Image"), []
    before, opened = Image.MAX_IMAGE_PIXELS, Image.open
    Image.new("RGB", (100, 100)).save(tmp_path / "t.png")
    (tmp_path / "m.mtl").write_text("newmtl a\nKd 1 0 0\nmap_Kd t.png\n")
    (tmp_path / "t.obj").write_text("mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl a\nf 1/1 2/2 3/3\n")

    def watched(*given, **options):
        bounds.append(Image.MAX_IMAGE_PIXELS)
        return opened(*given, **options)

    monkeypatch.setattr(Image, "open", watched)
    monkeypatch.setattr("ksl.viewer.visuals.PICTURE", 5000)
    look = appearance(robot(MESHED.format("t.obj")))
    assert not look.notes and look.shapes["b"][0].colour == (1.0, 0.0, 0.0)
    assert set(bounds) == {2500} and before == Image.MAX_IMAGE_PIXELS


def test_what_cannot_be_drawn_is_said_and_becomes_an_ellipsoid(robot, tmp_path):
    look = appearance(robot(MESHED.format("package://parts/meshes/t.stl")))
    assert look.ellipsoids == {"b"}
    assert look.notes == ["mesh package://parts/meshes/t.stl is not found: --package-path DIR names a folder that has the package"]
    pytest.importorskip("trimesh")
    (tmp_path / "bad.stl").write_text("solid nothing")
    assert "bad.stl" in appearance(robot(MESHED.format("bad.stl"))).notes[0]


def test_where_packages_are_looked_for(tmp_path, monkeypatch):
    robot_file = tmp_path / "elsewhere" / "robot.urdf"
    for variable, folder in (("ROS_PACKAGE_PATH", "ros"), ("AMENT_PREFIX_PATH", "ament/share")):
        mesh = tmp_path / folder / f"of_{variable}" / "t.stl"
        write_stl(mesh)
        assert find_mesh(f"package://of_{variable}/t.stl", robot_file) is None
        monkeypatch.setenv(variable, f"/nowhere:{tmp_path / folder.partition('/')[0]}")
        assert find_mesh(f"package://of_{variable}/t.stl", robot_file) == mesh
    mesh = tmp_path / "given" / "parts" / "t.stl"
    write_stl(mesh)
    for folder in (tmp_path / "given", tmp_path / "given" / "parts"):
        assert find_mesh("package://parts/t.stl", robot_file, [folder]) == mesh


# -------------------------------------------------------------------------------------------------------------- results


def results_table(arm, swing, payload: float = 0.0):
    """A small table as `ksl loads` writes it."""
    import pyarrow as pa

    t, q, v, a = swing
    m = arm.with_payload("hand", payload) if payload else arm
    tau = m.inverse_dynamics(q, v, a)
    names = [j.name for j in arm.joints]
    wrenches = np.concatenate([m.reactions(q, v, a, part=part, joints=names) for part in ("total", "constraint")], axis=2)
    columns = {"case": pa.array(["swing"] * len(t) * len(names)).dictionary_encode(), "time": np.repeat(t, len(names))}
    columns["joint"] = pa.array(names * len(t)).dictionary_encode()
    for name, x in (("position", q), ("speed", v), ("acceleration", a), ("effort", tau)):
        values = np.full((len(t), len(names)), np.nan)
        values[:, :2] = x
        columns[name] = pa.array(values.ravel(), from_pandas=True)
    components = ("fx", "fy", "fz", "tx", "ty", "tz")
    columns |= {name: pa.array(wrenches[..., k].ravel()) for k, name in enumerate((*components, *(f"constraint_{c}" for c in components)))}
    columns |= {name: pa.array([word] * len(t) * len(names)).dictionary_encode() for name, word in (("on", "child"), ("at", "joint"), ("axes", "joint"))}
    made = {"robot": "arm", "cases": [{"name": "swing", "gravity": [0, 0, -9.81], "payloads": [], "physics": [], "external": []}]}
    return pa.table(columns).replace_schema_metadata({"ksl": json.dumps(made)})


def test_results_become_the_scene_of_their_motion(arm, swing, tmp_path):
    from pyarrow import parquet

    parquet.write_table(results_table(arm, swing), tmp_path / "wrenches.parquet")
    results = read_results(tmp_path)
    scene, notes = scene_of_results(arm, results)
    assert notes == [] and results.case == "swing"
    for given, found in zip(swing, (scene.time, scene.q, scene.v, scene.a), strict=True):
        np.testing.assert_array_equal(given, found)
    with pytest.raises(ksl.MotionError, match="no load case named 'swang'; did you mean 'swing'"):
        read_results(tmp_path, "swang")


@pytest.mark.parametrize("of", ["held", "simulated under brakes"])
def test_efforts_that_brakes_supply_are_those_of_the_results(tmp_path, examples, of):
    """Beside a case that drives carry: the table has both columns."""
    m = ksl.load(examples / "robots/panda.urdf")
    pose = "pose = { panda_joint4 = -1.5 }"
    braked = {"held": f"hold = {{ {pose} }}", "simulated under brakes": f"simulate = {{ until = 0.02, brake_at = 0.0, {pose} }}"}[of]
    driven = f'simulate = {{ until = 0.02, controller = "gravity", {pose} }}'
    ksl.compute_loads(m, cases=cases_of_text(m, f"[cases.drives]\n{driven}\n[cases.brakes]\n{braked}\n")).write(tmp_path / "out")
    for case in ("drives", "brakes"):
        _, notes = scene_of_results(m, read_results(tmp_path / "out", case))
        assert notes == []


@pytest.mark.parametrize("push", ["wrench = [0, 0, 50, 0, 0, 0]", "steps = [[0.0, 0, 0, 50, 0, 0, 0], [0.01, 0, 0, 0, 0, 0, 0]]"])
def test_external_wrenches_that_stand_in_the_load_case(tmp_path, examples, push):
    """Constant ones are shown.  Of others nothing but that is said: the robot's wrenches without them differ from those of the results, and no file has changed."""
    m = ksl.load(examples / "robots/panda.urdf")
    external = f'external = [{{ link = "panda_link7", {push} }}]'
    moving = 'simulate = { until = 0.02, controller = "gravity", pose = { panda_joint4 = -1.5 } }'
    ksl.compute_loads(m, cases=cases_of_text(m, f"[cases.push]\n{external}\n{moving}\n")).write(tmp_path / "out")
    scene, notes = scene_of_results(m, read_results(tmp_path / "out"))
    left_out = ["external wrenches of the load case are not shown, since results don't hold those that load cases or programs give as they change"]
    assert (notes, list(scene.external)) == (([], ["panda_link7"]) if "wrench" in push else (left_out, []))


def test_results_of_another_robot_are_refused_or_noticed(arm, swing, tmp_path, robot, examples):
    from pyarrow import parquet

    table = results_table(arm, swing)
    efforts = table.column("effort").to_numpy() * 1.1
    parquet.write_table(table.set_column(table.schema.get_field_index("effort"), "effort", [efforts]), tmp_path / "wrenches.parquet")
    _, notes = scene_of_results(arm, read_results(tmp_path))
    assert len(notes) == 1 and notes[0].startswith("wrenches of the results, which are shown, differ from those that this robot would have")
    with pytest.raises(ksl.MotionError, match="they are those of arm, and not of panda"):
        scene_of_results(ksl.load(examples / "robots/panda.urdf"), read_results(tmp_path))
    parquet.write_table(table.drop_columns(["position"]), tmp_path / "wrenches.parquet")
    with pytest.raises(ksl.MotionError, match="no column 'position'"):
        read_results(tmp_path)


def with_number(table, name, number):
    values = table.column(name).to_pylist()
    values[3] = number
    return with_column(table, name, values)


def with_column(table, name, values):
    return table.set_column(table.schema.get_field_index(name), name, [values])


def with_metadata(table, **entries):
    return table.replace_schema_metadata({"ksl": json.dumps(json.loads(table.schema.metadata[b"ksl"]) | entries)})


ALTERED = {
    "metadata": (lambda t: t.replace_schema_metadata({"ksl": "[]"}), "its metadata `ksl` is no JSON object"),
    "cases": (lambda t: with_metadata(t, cases=[3]), "`cases` in its metadata is no list of objects"),
    "inputs": (lambda t: with_metadata(t, inputs=3), "`inputs` in its metadata is no list of objects"),
    "an input": (lambda t: with_metadata(t, inputs=[{}]), "an input in its metadata has no file or role"),
    "a case": (lambda t: with_metadata(t, cases=[{}]), "a case in its metadata has no name"),
    "gravity": (lambda t: with_metadata(t, cases=[{"name": "swing", "gravity": 3}]), "gravity, physics, payloads or drives of case swing in its metadata"),
    "payloads": (lambda t: with_metadata(t, cases=[{"name": "swing", "payloads": [3]}]), "gravity, physics, payloads or drives of case swing in its metadata"),
    "motion": (lambda t: with_metadata(t, cases=[{"name": "swing", "motion": 3}]), "the motion of case swing in its metadata is no name of a file"),
    "options": (lambda t: with_metadata(t, options=3), "`options` or `directory` in its metadata is not as"),
    "NaN time": (lambda t: with_number(t, "time", np.nan), "column 'time' is missing or not a number at sample"),
    "infinite time": (lambda t: with_number(t, "time", np.inf), "column 'time' is infinite at sample"),
    "no time": (lambda t: with_number(t, "time", None), "column 'time' is missing or not a number at sample"),
    "equal times": (lambda t: with_column(t, "time", [0.0] * len(t)), "column 'time' doesn't increase at sample 2"),
    "another time": (lambda t: with_number(t, "time", 0.001), "column 'joint' doesn't name the same joints at every time"),
    "text": (lambda t: with_column(t, "effort", ["a"] * len(t)), "column 'effort' holds string; expected numbers"),
    "numbers as names": (lambda t: with_column(t, "joint", [3] * len(t)), "column 'joint' holds int64; expected names"),
    "a row less": (lambda t: t.slice(0, len(t) - 1), "column 'joint' doesn't name the same joints at every time"),
    "position": (lambda t: with_column(t, "position", [np.nan] * len(t)), "column 'position' is missing or not finite of"),
}


@pytest.mark.parametrize("altered", ALTERED)
def test_results_that_somebody_has_altered(arm, swing, tmp_path, altered):
    from pyarrow import parquet

    change, words = ALTERED[altered]
    parquet.write_table(change(results_table(arm, swing)), tmp_path / "wrenches.parquet")
    with pytest.raises(ksl.MotionError) as caught:
        scene_of_results(arm, read_results(tmp_path))
    assert words in str(caught.value) and str(caught.value).endswith("run `ksl loads` again")
    assert str(caught.value).startswith((f"{tmp_path}/wrenches.parquet: ", "the results: "))


def test_results_with_text_that_is_none(arm, swing, tmp_path):
    from pyarrow import parquet

    table = results_table(arm, swing)
    parquet.write_table(with_column(table, "joint", damaged_text(table.column("joint").to_pylist())), tmp_path / "wrenches.parquet")
    with pytest.raises(ksl.MotionError, match=r"can't be read \(column 'joint' holds text that is no UTF-8\); give the folder"):
        read_results(tmp_path)


def test_arrows_start_where_the_moments_are_about(examples):
    """Moments about the joint's origin, moved to the world's by f × (−r), are those that `at="world"` gives, for every kind of joint and format."""
    reference = examples.parent / "test"
    for file in ("engine/every_kind.urdf", "reference/read_sdf.sdf"):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            m = ksl.load(reference / file)
        rng = np.random.default_rng(3)
        q, v, a = m.random(rng), rng.normal(size=m.nv), rng.normal(size=m.nv)
        scene = make_scene(m, q, v, a)
        total = scene.constraint[0] + scene.actuation[0]
        about_world = m.reactions(q, v, a, at="world", axes="world", joints=[j.name for j in m.joints])
        np.testing.assert_allclose(total[:, 3:] + np.cross(scene.origins[0], total[:, :3]), about_world[:, 3:], atol=1e-10)


def test_the_camera_sees_the_whole_motion(arm, swing):
    """The box about all states holds every link in each of them."""
    t, q, v, a = swing
    scene = make_scene(arm, q, v, a, t)
    low, high = scene.reach
    for k in range(0, len(t), max(1, len(t) // 23)):
        assert (scene.bounds(k)[0] >= low - 0.05 * scene.size).all() and (scene.bounds(k)[1] <= high + 0.05 * scene.size).all()
    assert (low <= scene.bounds(0)[0]).all() and (high >= scene.bounds(len(t) - 1)[1]).all()


def test_wrenches_whose_squares_are_infinite(examples):
    """A link of 1e160 kg ended in "float division by zero"."""
    m = ksl.load(examples / "robots/ur5.urdf").with_parameters({"wrist_3_link": (1e160, (0, 0, 0.1), 1e160 * np.eye(3))})
    scene = make_scene(m, np.zeros(6))
    assert 0 < scene.scale.force < 1e-150 and 0 < scene.scale.moment < 1e-150
