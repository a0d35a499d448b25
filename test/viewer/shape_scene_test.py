"""Shapes of modes as scenes: links sway about the pose along their twists."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import ksl
from ksl_command import run_ksl

pytest.importorskip("viser")
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


def test_the_command_writes_a_page(tmp_path):
    (tmp_path / "arm.urdf").write_text(arm().to_urdf())
    (tmp_path / "s.toml").write_text("hinge = 50.0\n")
    done = run_ksl("modes", "arm.urdf", "--stiffness", "s.toml", "--export", "mode.html", cwd=tmp_path)
    assert done.returncode == 0 and "mode 1, 1.3" in (tmp_path / "mode.html").read_text(encoding="utf-8"), done.stderr
    assert "--mode 2: the pose has 1 mode" in run_ksl("modes", "arm.urdf", "--stiffness", "s.toml", "--export", "x.html", "--mode", "2", cwd=tmp_path).stderr
