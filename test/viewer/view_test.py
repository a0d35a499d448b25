"""`ksl view` and `Model.show`: what they print, and the sentences for bad input."""

import socket
import sys
import urllib.request

import numpy as np
import pytest
from ksl.commands.app import app
from typer.testing import CliRunner

import ksl
import ksl.viewer.live
from ksl_command import run_ksl

pytest.importorskip("viser", reason="the package viser is not installed")


def run(*arguments):
    import ksl.commands  # noqa: F401  the commands

    return CliRunner().invoke(app, ["view", *map(str, arguments)])


def refused(*arguments) -> str:
    done = run(*arguments)
    assert done.exit_code == 2, done.output
    noted, said = done.output.strip().split("ksl: ", 1)
    assert noted in ("", "note: in the file and not used: material (1)\n")  # what the robot's file holds besides is printed first
    return said


@pytest.fixture(scope="module")
def motion(arm, swing, tmp_path_factory):
    t, q, _, _ = swing
    path = tmp_path_factory.mktemp("motion") / "swing.csv"
    np.savetxt(path, np.column_stack([t, q]), delimiter=",", header="time,shoulder,elbow", comments="")
    return path


def test_export(arm, motion, tmp_path):
    file = tmp_path / "arm.html"
    done = run(arm.file, motion, "--export", file, "--joint", "elbow")
    assert done.exit_code == 0 and done.stdout.startswith(f"written: {file} (")
    html = file.read_text(encoding="utf-8")
    assert "swing.csv" in html and "what the structure carries" in html and 'src="http' not in html
    assert sorted(p.name for p in tmp_path.iterdir()) == ["arm.html"]


def test_doubts_about_the_motion_are_said(examples, tmp_path):
    """Noise makes the arrows: what `ksl loads` doubts, the viewer doubts."""
    robot, pick = examples / "robots" / "ur5.urdf", np.genfromtxt(examples / "motions" / "ur5_pick.csv", delimiter=",", names=True)
    np.savetxt(tmp_path / "m.csv", np.array(pick.tolist()), delimiter=",", header=",".join(pick.dtype.names), comments="", fmt="%.3f")
    done = run_ksl("view", robot, tmp_path / "m.csv", "--export", tmp_path / "page.html")
    assert done.returncode == 0 and "ksl: note: positions of shoulder_pan are rounded to 0.001 rad" in done.stderr, done.stderr


def test_a_robot_at_rest_is_exported_too(arm, tmp_path):
    assert run(arm.file, "--export", tmp_path / "arm.html").exit_code == 0


def test_bad_input(arm, motion, tmp_path):
    assert (
        refused(arm.file, "--export", tmp_path / "no" / "a.html")
        == f"{tmp_path}/no/a.html: there is no folder {tmp_path}/no; make it, or give a file in a folder that exists"
    )
    assert refused(arm.file, "--joint", "ellbow").startswith("arm: no joint named 'ellbow'; did you mean 'elbow'")
    assert refused(arm.file, "--package-path", tmp_path / "no") == f"--package-path {tmp_path}/no: no such folder"
    assert refused(arm.file, motion, "--case", "pick").startswith("--case pick: only results of `ksl loads` have load cases")
    assert refused(arm.file, tmp_path / "absent.csv").startswith(f"{tmp_path}/absent.csv: can't be read")
    absent = refused(tmp_path / "absent.urdf")
    assert absent.startswith(f"{tmp_path}/absent.urdf: ") and "\n" not in absent.strip()  # said once
    assert refused(arm.file, "--external", motion).startswith(f"--external {motion}: needs a motion")
    assert "expected a number from 1 to 65535" in refused(arm.file, "--port", "70000", "--no-browser")


def test_a_port_in_use(arm):
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        s.listen()
        port = s.getsockname()[1]
        assert refused(arm.file, "--port", port, "--no-browser") == f"port {port} is in use; give another one, or none, and a free one is taken"


def test_the_extra_is_missing(arm, monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "viser", None)
    assert refused(arm.file, "--no-browser") == "the viewer needs the extra ksl[view]: pip install 'ksl[view]'"
    assert refused(arm.file, "--export", tmp_path / "a.html") == "the viewer needs the extra ksl[view]: pip install 'ksl[view]'"
    assert not list(tmp_path.iterdir())


def test_meshes_without_trimesh(arm, monkeypatch, robot, tmp_path):
    from ksl.viewer.visuals import appearance

    monkeypatch.setitem(sys.modules, "trimesh", None)
    (tmp_path / "t.stl").write_text("solid t")
    look = appearance(robot(open(arm.file).read().replace('<box size="1 0.1 0.1"/>', '<mesh filename="t.stl"/>')))
    assert look.notes == ["meshes are not drawn: reading them needs the extra ksl[view] (pip install 'ksl[view]')"]
    assert look.ellipsoids == {"upper"}


def test_show_returns_a_handle(arm, swing, monkeypatch):
    opened = []
    monkeypatch.setattr("webbrowser.open", lambda url: opened.append(url) or False)
    t, q, v, a = swing
    with arm.show(q, v, a, t, joint="elbow") as handle:
        assert opened == [handle.url] and handle.url.startswith("http://127.0.0.1:")
        assert urllib.request.urlopen(handle.url, timeout=60).status == 200
        handle.update([0.3, 0.4])
        np.testing.assert_allclose(handle.stage._links[3].position, arm.frame_pose([0.3, 0.4], "hand")[:3, 3], atol=1e-14)
        assert "<iframe" in handle._repr_html_() and handle.url in repr(handle)
        text = handle.controls._readout.content
        assert "at rest in this pose" in text and f"{9.81:.4g}" in text  # the elbow carries 1 kg
    with pytest.raises(ValueError, match="did you mean 'elbow'"):
        arm.show(joint="ellbow", browser=False)
    with pytest.raises(ksl.MotionError, match="time has shape"):
        arm.show(q, time=t[:5], browser=False)


def test_what_is_shown_on_demand(arm):
    """Lengths of arrows are those of the wrenches in the scale of the scene; colours and places are those of closed forms."""
    from ksl.viewer.scene import SCREW, make_scene
    from ksl.viewer.scene_tree import legend

    scene = make_scene(arm, [0.0, 0.0], [2.0, 0.0], [0.0, 0.0], external={"hand": [0, 0, -20.0, 0, 3.0, 0]})
    with ksl.viewer.live.Viewer(scene, joint="elbow") as viewer:
        stage, shown = viewer.stage, viewer.shown
        shafts, heads = (node.batched_scales for node in stage._external._nodes)
        assert shafts[0, 2] + heads[0, 2] == pytest.approx(20 * scene.scale.force, rel=1e-6)
        assert shafts[1, 2] + heads[1, 2] + heads[2, 2] == pytest.approx(3 * scene.scale.moment, rel=1e-6)
        assert not stage._centre.visible and not stage._screw_line.visible and not stage._links[1].show_axes
        shown.centre_of_mass = shown.screw_axis = shown.frames = shown.utilisation = True
        shown.external = False
        viewer.show(0)
        np.testing.assert_allclose(stage._centre.position, [2.3 / 3, 0, 0], atol=1e-14)
        line = stage._screw_line.points[0]
        np.testing.assert_allclose(line[:, [0, 2]], 0, atol=1e-6)  # along y through the shoulder
        assert stage._screw_line.visible and tuple(stage._screw_line.colors.ravel()[:3]) == SCREW
        assert stage._links[1].show_axes and stage._surfaces["lower"][0][0].color[0] > 200, "beyond the limit: red"
        assert not stage._external._nodes[0].batched_scales[:, 2].any()
        assert [text for colour, text in legend(scene) if colour][-1] == "external wrenches"


def test_the_readout_follows_axes_point_side_and_part(arm):
    """Level arm: about the shoulder the elbow's force of 1 g has the arm 1 m, and on the parent's side all signs change."""
    from ksl.viewer.readout import Choice, wrench_at
    from ksl.viewer.scene import make_scene

    scene = make_scene(arm, [0.0, 0.0])
    g = 9.81
    np.testing.assert_allclose(wrench_at(scene, 0, "elbow", Choice()), [0, 0, g, 0, -0.3 * g, 0], atol=1e-12)
    np.testing.assert_allclose(wrench_at(scene, 0, "elbow", Choice("parent", "world", "world")), [0, 0, -g, 0, 1.3 * g, 0], atol=1e-12)
    np.testing.assert_allclose(wrench_at(scene, 0, "elbow", Choice(at=(0.3, 0, 0), part="total")), [0, 0, g, 0, 0, 0], atol=1e-12)
    np.testing.assert_allclose(wrench_at(scene, 0, "elbow", Choice(part="actuation")), [0, 0, 0, 0, -0.3 * g, 0], atol=1e-12)


def test_what_is_wrong_is_said_once(examples):
    p = run_ksl("view", examples / "robots/ur5.urdf", "--gravity", "1")
    assert (p.returncode, p.stderr) == (2, "ksl: --gravity 1: expected 3 finite numbers separated by commas\n")


def test_white_links_stand_out(arm, monkeypatch):
    """The background was white, as many robots are, and the light from all sides as strong as viser has it."""
    import viser

    from ksl.viewer.scene import make_scene

    seen = {}
    monkeypatch.setattr(viser.SceneApi, "set_background_image", lambda self, image: seen.update(background=image))
    monkeypatch.setattr(viser.SceneApi, "configure_environment_map", lambda self, hdri, environment_intensity: seen.update(light=environment_intensity))
    with ksl.viewer.live.Viewer(make_scene(arm)):
        assert 200 < seen["background"].min() and seen["background"].max() < 245 and seen["light"] < 0.7
