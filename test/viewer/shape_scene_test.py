"""Shapes of modes as scenes: links sway about the pose along their twists."""

import threading

import numpy as np
import pytest
from typer.testing import CliRunner
from scipy.spatial.transform import Rotation

import ksl
from ksl_command import run_ksl

pytest.importorskip("viser")
from ksl.commands.app import app
from ksl.viewer.live import Viewer
from ksl.viewer.shape_scene import PERIOD, SWAY, scene_of_shape


def arm():
    b = ksl.Builder("arm").add_link("wall").add_link("rod", 2.0, (0.5, 0, 0), np.diag([0.01, 0.2, 0.2])).add_link("tip")
    b.add_joint("hinge", "revolute", "wall", "rod", axis=(0, 1, 0))
    return b.add_joint("end", "fixed", "rod", "tip", xyz=(1, 0, 0)).build()


def test_a_hinge_sways_as_a_motion_does():
    m = arm()
    q = np.array([0.4])
    shape = m.modes(q, stiffness={"hinge": 50.0}).shapes[0]
    scene = scene_of_shape(m, q, shape, "mode 1")
    turn = scene.poses[:, 1, :3, :3]
    angles = Rotation.from_matrix(turn[0].T @ turn).as_rotvec()[:, 1]
    np.testing.assert_allclose(np.abs(angles).max(), SWAY * scene.size / max(1.0, scene.size), rtol=1e-6)
    np.testing.assert_allclose(np.abs(angles), np.abs(np.sin(2 * np.pi * scene.time / PERIOD)) * np.abs(angles).max(), atol=1e-9)
    np.testing.assert_allclose(scene.poses[:, 1], m.frame_poses(q + angles[:, None], ["rod"])[:, 0], atol=1e-12)
    off = scene.poses[:, 2, :3, 3] - m.frame_poses(q + angles[:, None], ["tip"])[:, 0, :3, 3]
    assert np.abs(off).max() < np.abs(angles).max() ** 2, "a tip moves along its twist, which is that of the first order"
    assert not scene.constraint.any() and scene.unloaded == "mode 1"
    assert np.isfinite(scene_of_shape(m, q, np.zeros((3, 6)), "nothing").poses).all()


def test_a_page_plays_the_mode_that_is_chosen_again_and_again():
    m, q = arm(), np.array([0.4])
    found = m.modes(q, stiffness={"hinge": {"motion": 50.0, "axial": 3e4}})
    with m.show(q, modes=found, browser=False) as page:
        assert page.playing and list(page.scenes) == [f"mode {k}, {f:.4g} Hz" for k, f in enumerate(found.frequencies, 1)]
        page.choose(list(page.scenes)[1])
        assert page.scene is page.scenes[list(page.scenes)[1]] and page.scene.unloaded.startswith("mode 2, ")
        page.play(8)
        soon(lambda: page.sample > 40)
        soon(lambda: page.sample < 40)
        assert page.playing, "it begins again"
    for options, said in (({"q": q, "v": [0.0]}, "v and modes: shapes"), ({}, "modes without q")):
        with pytest.raises(ValueError, match=said):
            m.show(**options, modes=found, browser=False)
    other = ksl.load_string('<robot name="other"><link name="a"/></robot>')
    for robot, pose, given, said in ((m, q, 3, "modes is int; expected"), (other, [], found, "modes: have shapes of 3 links, and other has 1")):
        with pytest.raises(ValueError, match=said):
            robot.show(pose, modes=given, browser=False)
    with pytest.raises(ValueError, match="modes: there is none"):
        m.show(q, modes=m.modes(q, stiffness={}), browser=False)


def soon(seen):
    while not seen():
        threading.Event().wait(0.01)


def test_the_command_shows_a_page(tmp_path, monkeypatch):
    import ksl.commands  # noqa: F401  the commands

    (tmp_path / "arm.urdf").write_text(arm().to_urdf())
    (tmp_path / "s.toml").write_text("hinge = 50.0\n")
    seen = []
    monkeypatch.setattr(Viewer, "wait", lambda page: seen.append(list(page.scenes)))
    monkeypatch.setattr(Viewer, "open", lambda page: True)
    done = CliRunner().invoke(app, ["modes", str(tmp_path / "arm.urdf"), "--stiffness", str(tmp_path / "s.toml"), "--show"])
    assert done.exit_code == 0 and "shows arm; Ctrl-C ends" in done.output and len(seen) == 1 and seen[0][0].startswith("mode 1, 1.3")


def test_the_command_writes_a_page(tmp_path):
    (tmp_path / "arm.urdf").write_text(arm().to_urdf())
    (tmp_path / "s.toml").write_text("hinge = 50.0\n")
    done = run_ksl("modes", "arm.urdf", "--stiffness", "s.toml", "--export", "mode.html", cwd=tmp_path)
    assert done.returncode == 0 and "mode 1, 1.3" in (tmp_path / "mode.html").read_text(encoding="utf-8"), done.stderr
    assert "--mode 2: the pose has 1 mode" in run_ksl("modes", "arm.urdf", "--stiffness", "s.toml", "--export", "x.html", "--mode", "2", cwd=tmp_path).stderr
