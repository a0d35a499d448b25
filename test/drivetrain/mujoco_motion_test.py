"""A second witness in motion: MuJoCo, with stiff equality constraints, follows a motion by the efforts of the map alone."""

import numpy as np
import pytest

import ksl
from examples import leg

pytestmark = pytest.mark.filterwarnings("ignore::ksl.DescriptionWarning")  # spherical is no kind of URDF's
TIME = 0.3


def off(mujoco, mj, a, size, step, efforts):
    """How far the joints are at most from size (1 − cos ω t) / 2, driven by motors alone."""
    mj.opt.timestep = step
    mj.eq_solref[:], mj.eq_solimp[:] = (2 * step, 1), (0.9999, 0.9999, 0.001, 0.5, 2)
    t, w = np.arange(round(TIME / step)) * step, 2 * np.pi / TIME
    q, v, acceleration = (size * x[:, None] / 2 for x in (1 - np.cos(w * (t + step / 2)), w * np.sin(w * (t + step / 2)), w**2 * np.cos(w * (t + step / 2))))
    tau, d = efforts(q, v, acceleration), mujoco.MjData(mj)
    d.qpos[:] = a.state(np.zeros(len(size)))[0]
    places, most = [mj.jnt_qposadr[mj.joint(name).id] for name in a.joints], 0.0
    for row, now in zip(tau, t + step):
        d.ctrl[[mj.actuator(name).id for name in a.motors]] = row
        mujoco.mj_step(mj, d)
        most = max(most, np.abs(d.qpos[places] - size * (1 - np.cos(w * now)) / 2).max())
    return most


@pytest.mark.parametrize(("name", "size"), [("two_rod_ankle", [0.2, -0.15]), ("four_bar_knee", [0.6])])
def test_efforts_move_mujoco_along_the_motion(name, size, tmp_path):
    """What is left is of the first order in the step; by the static map of the tree without rods it is a large part of the motion."""
    mujoco = pytest.importorskip("mujoco")
    a, size = leg(name, "rotor", "armature", "damping"), np.array(size)
    ksl.mjcf.write(a.model, tmp_path / "closed.xml")
    mj = mujoco.MjModel.from_xml_path(str(tmp_path / "closed.xml"))
    mj.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_LIMIT | mujoco.mjtDisableBit.mjDSBL_CONTACT
    for joint in a.model.joints:
        if joint.nv and joint.name not in (*a.joints, *a.motors, *a.followers):
            mj.dof_armature[mj.jnt_dofadr[mj.joint(joint.name).id]] = 1e9  # what carries the mechanism stands still
    coarse, fine = (off(mujoco, mj, a, size, step, a.motor_efforts) for step in (4e-4, 2e-4))
    assert fine < 3e-3 * np.abs(size).max() and 0.4 < fine / coarse < 0.6
    static = lambda q, v, acceleration: a.static_motor_efforts(q, a.serial_efforts(q, v, acceleration))
    assert off(mujoco, mj, a, size, 4e-4, static) > 50 * coarse
