"""MJCF that is written: MuJoCo's machine is the one that was written, whatever its root is called and wherever its joints are at zero."""

import mujoco
import numpy as np
import pytest

import ksl


def chain(root: str = "world", link: str = "rod", **joint) -> ksl.Builder:
    b = ksl.Builder("chain").add_link(root)
    for name, parent in ((link, root), ("tip", link)):
        b.add_link(name, mass=2.0, center_of_mass=(0.1, 0.2, 0.3), inertia=np.diag([0.3, 0.2, 0.4]))
        kind = "prismatic" if name == "tip" else "revolute"
        b.add_joint(f"{name}_joint", kind, parent, name, xyz=(0.3, 0, 0.1), rpy=(0.3, 0.2, 0.1), axis=(0, 0.6, 0.8), **(joint if name == "tip" else {}))
    return b


@pytest.mark.parametrize(
    "builder", [chain(), chain("base"), chain("base", "world"), chain(mimic=("rod_joint", -0.7, 0.3))], ids=["world", "base", "inner", "mimic"]
)
def test_mujoco_has_the_machine_that_was_written(builder):
    m = builder.build()
    mj = mujoco.MjModel.from_xml_string(ksl.mjcf.text(m))
    d = mujoco.MjData(mj)
    q = np.array([0.4, -0.3])[: m.nq]
    d.qpos[:] = [m.position_of(m.joint_above(link.name), q) for link in m.links[1:]]
    mujoco.mj_forward(mj, d)
    assert np.allclose(d.body("tip").xpos, m.frame_pose(q, "tip")[:3, 3], atol=1e-14)
    assert np.allclose(d.efc_pos[: d.ne], 0, atol=1e-14) and d.ne == 2 - m.nq
    assert ksl.load_string(ksl.mjcf.text(m)).nv == m.nv


@pytest.mark.parametrize(("limits", "range_of_mujoco"), [((-0.2, None), (-0.2, 1e10)), ((None, 0.3), (-1e10, 0.3)), ((-0.2, 0.3), (-0.2, 0.3))])
def test_limits_on_one_side(limits, range_of_mujoco):
    given = "".join(f"<{tag}>{x}</{tag}>" for tag, x in zip(("lower", "upper"), limits) if x is not None)
    inertial = "<inertial><mass>1</mass><inertia><ixx>1</ixx><iyy>1</iyy><izz>1</izz></inertia></inertial>"
    m = ksl.load_string(
        f"""<sdf version="1.10"><model name="m"><link name="a">{inertial}</link><joint name="j" type="revolute"><parent>world</parent><child>a</child>
        <axis><xyz>0 0 1</xyz><limit>{given}</limit></axis></joint></model></sdf>"""
    )
    assert m.joint("j").limits == (limits,)
    mj = mujoco.MjModel.from_xml_string(ksl.mjcf.text(m))
    assert mj.jnt_limited.tolist() == [1] and tuple(mj.jnt_range[0]) == range_of_mujoco


def test_limits_that_leave_no_way_are_refused():
    with pytest.raises(ValueError, match="joint tip_joint: its limits leave it no way, from 0.1 to 0.1.*with_frozen_joints"):
        ksl.mjcf.text(chain(limits=(0.1, 0.1)).build())
