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


def points(rng, n: int, size: float) -> np.ndarray:
    """A tensor of equal masses at n places: of a point, a rod, a plate, or a body."""
    at = size * rng.normal(size=(n, 3))
    return sum(x @ x * np.eye(3) - np.outer(x, x) for x in at - at.mean(axis=0))


@pytest.mark.parametrize("size", [1e-5, 1.0, 30.0])
def test_bodies_of_any_shape_have_their_inertia(size):
    """Of few points, whose moments are rounded, and smaller than the tolerance of MuJoCo's search for principal axes, beside a link without mass."""
    rng = np.random.default_rng(7)
    for n in (1, 2, 3, 4) * 5:
        tensor, centre = points(rng, n, size), size * rng.normal(size=3)
        b = ksl.Builder("two").add_link("base").add_link("light").add_link("arm", mass=n, center_of_mass=centre, inertia=tensor)
        m = b.add_joint("a", "revolute", "base", "light", axis=(0, 0, 1)).add_joint("b", "spherical", "light", "arm").build()
        body = mujoco.MjModel.from_xml_string(ksl.mjcf.text(m)).body("arm")
        R = np.zeros(9)
        mujoco.mju_quat2Mat(R, body.iquat)
        R = R.reshape(3, 3)
        assert body.mass == n and np.allclose(body.ipos, centre, rtol=1e-13, atol=1e-14 * size)
        assert np.abs((R * body.inertia) @ R.T - tensor).max() < 2e-9 * np.abs(tensor).max() + 2e-12 * size**2 + 2e-14


def test_free_bodies_are_on_the_ground_and_keep_their_damping():
    b = ksl.Builder("two").add_link("base", mass=1.0).add_link("ball", mass=1.0, inertia=np.eye(3))
    m = b.add_joint("free", "floating", "base", "ball", xyz=(1, 2, 3), damping=0.3, friction=0.2).build()
    mj = mujoco.MjModel.from_xml_string(ksl.mjcf.text(m))
    assert mj.dof_damping.tolist() == [0.3] * 6 and mj.dof_frictionloss.tolist() == [0.2] * 6 and mj.qpos0[:3].tolist() == [1, 2, 3]
    b = ksl.Builder("three").add_link("base").add_link("arm", mass=1.0).add_link("ball", mass=1.0)
    m = b.add_joint("hinge", "revolute", "base", "arm", axis=(0, 0, 1)).add_joint("free", "floating", "arm", "ball").build()
    with pytest.raises(ValueError, match="joint free: it floats on arm, which moves"):
        ksl.mjcf.text(m)


def test_moments_of_no_body_are_refused():
    b = (
        ksl.Builder("one")
        .add_link("base")
        .add_link("arm", mass=1.0, inertia=np.diag([1.0, 1.0, 3.0]))
        .add_joint("a", "revolute", "base", "arm", axis=(0, 0, 1))
    )
    with pytest.warns(ksl.DescriptionWarning), pytest.raises(ValueError, match="link arm: its moments 1, 1, 3 are those of no body"):
        ksl.mjcf.text(b.build())


def test_limits_that_leave_no_way_are_refused():
    with pytest.raises(ValueError, match="joint tip_joint: its limits leave it no way, from 0.1 to 0.1.*with_frozen_joints"):
        ksl.mjcf.text(chain(limits=(0.1, 0.1)).build())
