"""MJCF read through MuJoCo, held against MuJoCo's own dynamics."""

import pickle
import re
import subprocess
import sys
import warnings
from pathlib import Path

import mujoco
import numpy as np
import pytest

import ksl
from ksl import mjcf
from ksl.base import own_process
from ksl.robot_files import mjcf_compiler

HERE = Path(__file__).parent
CHAINS = HERE / "chains.xml"
FILES = {"chains": CHAINS, "every kind": HERE.parent / "reference/read_mjcf.xml"}
BODY = '<geom type="box" size="0.1 0.2 0.3"/>'


def in_file(tmp_path: Path, inside: str, outside: str = "") -> Path:
    path = tmp_path / "robot.xml"
    path.write_text(f'<mujoco model="robot"><worldbody>{inside}</worldbody>{outside}</mujoco>')
    return path


@pytest.fixture(params=FILES.values(), ids=FILES)
def pair(request) -> tuple[ksl.Model, mujoco.MjModel]:
    return ksl.load(request.param), mujoco.MjModel.from_xml_path(str(request.param))


@pytest.fixture
def independent(pair) -> tuple[ksl.Model, mujoco.MjModel]:
    """With a coordinate for each of MuJoCo's."""
    return ksl.load(pair[0].file, mimic="independent"), pair[1]


def random_states(mj: mujoco.MjModel, n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng, start = np.random.default_rng(1), mujoco.MjData(mj).qpos
    positions = []
    for _ in range(n):
        positions.append(start.copy())
        mujoco.mj_integratePos(mj, positions[-1], rng.normal(size=mj.nv), 1.0)
    return np.array(positions), *rng.normal(size=(2, n, mj.nv))


def check(found, expected, tolerance=1e-13) -> None:
    assert found.shape == expected.shape
    assert np.abs(found - expected).max() < tolerance * max(1.0, np.abs(expected).max())


def test_states_in_both_layouts(independent):
    m, mj = independent
    states = random_states(mj, 7)
    back = mjcf.to_mujoco(m, *mjcf.from_mujoco(m, *states)[:3])
    for found, expected in zip(back, states):
        check(found, expected)
    alone = mjcf.from_mujoco(m, states[0][0])
    assert alone.q.shape == (m.nq,) and alone.v is alone.a is alone.tau is None


def test_efforts_and_poses_are_those_of_mujoco(independent):
    m, mj = independent
    mj.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT | mujoco.mjtDisableBit.mjDSBL_SPRING | mujoco.mjtDisableBit.mjDSBL_DAMPER
    d = mujoco.MjData(mj)
    for qpos, qvel, qacc in zip(*random_states(mj, 5)):
        d.qpos, d.qvel, d.qacc = qpos, qvel, qacc
        mujoco.mj_inverse(mj, d)
        q, v, a, _ = mjcf.from_mujoco(m, qpos, qvel, qacc)
        ours = mjcf.to_mujoco(m, q, v, a, m.inverse_dynamics(q, v, a))
        check(ours.tau + mj.dof_armature * qacc, d.qfrc_inverse)
        names = [mj.body(i).name for i in range(mj.nbody) if mj.body(i).name]
        poses = m.frame_poses(q, names)
        check(poses[:, :3, 3], np.array([d.body(name).xpos for name in names]))
        check(poses[:, :3, :3].reshape(-1, 9), np.array([d.body(name).xmat for name in names]))
        for i in range(mj.nsite):
            check(m.frame_pose(q, mj.site(i).name)[:3, 3], d.site_xpos[i])


def test_mass_matrix_of_mujoco(independent):
    """qvelᵀ M qvel, since M is in other coordinates where a joint is free or planar."""
    m, mj = independent
    d = mujoco.MjData(mj)
    for qpos, qvel, _ in zip(*random_states(mj, 3)):
        d.qpos, d.qvel = qpos, qvel
        mujoco.mj_forward(mj, d)
        full = np.empty((mj.nv, mj.nv))
        mujoco.mj_fullM(mj, d, full)
        q, v, *_ = mjcf.from_mujoco(m, qpos, qvel)
        check(v @ m.mass_matrix(q) @ v, qvel @ (full - np.diag(mj.dof_armature)) @ qvel)


def test_a_linear_coupling_is_a_mimic_joint(tmp_path):
    m = ksl.load(CHAINS)
    follower = m.joint("hip_x")
    assert (follower.leader, follower.multiplier, follower.offset) == ("pole", 0.5, 0.1)
    mj = mujoco.MjModel.from_xml_path(str(CHAINS))
    qpos, qvel, qacc = random_states(mj, 1)
    q, v, a, _ = mjcf.from_mujoco(m, qpos[0], qvel[0], qacc[0])
    theirs = mjcf.to_mujoco(m, q, v, a, m.inverse_dynamics(q, v, a))
    of = {name: int(mj.joint(name).dofadr[0]) for name in ("hip_x", "pole")}
    assert theirs.v[of["hip_x"]] == 0.5 * theirs.v[of["pole"]] and theirs.tau[of["hip_x"]] == 0
    # the leader's effort does the work of both
    free = ksl.load(CHAINS, mimic="independent")
    q, v, a, _ = mjcf.from_mujoco(free, theirs.q, theirs.v, theirs.a)
    each = mjcf.to_mujoco(free, q, v, a, free.inverse_dynamics(q, v, a)).tau
    each[of["pole"]] += 0.5 * each[of["hip_x"]]
    each[of["hip_x"]] = 0
    check(theirs.tau, each)


def test_couplings_in_a_circle(tmp_path):
    bodies = "".join(f'<body name="{n}"><joint name="{n}"/>{BODY}</body>' for n in "abc")
    circle = "".join(f'<joint joint1="{y}" joint2="{x}"/>' for y, x in ("ab", "bc", "ca"))
    m = ksl.load(in_file(tmp_path, bodies, f"<equality>{circle}</equality>"))
    assert m.follower_names == ["a", "b"] and "equality joint (1)" in m.unused  # what it says follows from the others
    for said, why in (
        ('<joint joint1="c" joint2="a" polycoef="0 1 1 0 0"/>', "constraint <joint> 4 couples joint c to joint a by a polynomial"),
        ('<joint joint1="c" joint2="a" polycoef="0 2 0 0 0"/>', "couples joint c to itself over joint a"),
        ('<joint joint1="a" joint2="c"/>', "couples joint a, which follows joint b already"),
        ('<joint name="k" joint1="a"/>', "constraint k holds joint a, which follows joint b already"),
    ):
        path = in_file(tmp_path, bodies, f"<equality>{circle}{said}</equality>")
        with pytest.raises(ksl.DescriptionError, match=why):
            ksl.load(path)
        assert "equality joint (4)" in ksl.load(path, mimic="independent").unused
    for offset, factor in (0.0875, -0.125), (0.0885, -0.125), (0.0875, -0.126):  # a = 0.1 + 2 b and b = 0.3 − 4 c give c = 0.0875 − 0.125 a
        turned = "".join(
            f'<joint joint1="{y}" joint2="{x}" polycoef="{p} 0 0 0"/>'
            for y, x, p in (("a", "b", "0.1 2"), ("b", "c", "0.3 -4"), ("c", "a", f"{offset} {factor}"))
        )
        path = in_file(tmp_path, bodies, f"<equality>{turned}</equality>")
        if (offset, factor) == (0.0875, -0.125):
            assert ksl.load(path).follower_names == ["a", "b"]
        else:
            with pytest.raises(ksl.DescriptionError, match="couples joint c to itself over joint a"):
                ksl.load(path)
    inactive = circle.replace("/>", ' active="false"/>')
    m = ksl.load(in_file(tmp_path, bodies, f"<equality>{inactive}</equality>"))
    assert not m.follower_names and "equality joint, not active (3)" in m.unused


@pytest.mark.parametrize(
    "equality, followers, drives",
    [
        ('<tendon tendon1="ab" polycoef="0.3 0 0 0 0"/>', ["b"], ()),
        ('<tendon tendon1="ab"/><tendon tendon1="bc"/>', ["b", "c"], ()),
        ('<tendon tendon1="bc"/><tendon tendon1="ab"/>', ["b", "c"], ()),
        ('<tendon tendon1="ab"/>', ["a"], ("b",)),  # the one with a motor leads
        ('<tendon tendon1="aa" tendon2="cc" polycoef="0.1 -2 0 0 0"/>', ["c"], ()),
        ('<tendon tendon1="ab" tendon2="bc" polycoef="0 0.5 0 0 0"/>', ["c"], ()),  # b goes
    ],
)
def test_a_coupling_by_fixed_tendons_is_a_mimic_joint(tmp_path, equality, followers, drives):
    """At a position of these mimic joints MuJoCo's own constraints have no error."""
    terms = {"ab": {"a": 1, "b": 1.5}, "bc": {"b": 3, "c": -1}, "aa": {"a": 2}, "cc": {"c": 0.5}}
    tendons = "".join(f'<fixed name="{n}">' + "".join(f'<joint joint="{j}" coef="{c}"/>' for j, c in of.items()) + "</fixed>" for n, of in terms.items())
    bodies = "".join(f'<body name="{n}"><joint name="{n}" type="{kind}" ref="0.2"/>{BODY}</body>' for n, kind in zip("abc", ("hinge", "slide", "hinge")))
    motors = "".join(f'<motor joint="{j}"/>' for j in drives)
    path = in_file(tmp_path, bodies, f"<tendon>{tendons}</tendon><equality>{equality}</equality><actuator>{motors}</actuator>")
    m, mj = ksl.load(path), mujoco.MjModel.from_xml_path(str(path))
    assert sorted(m.follower_names) == followers and not any(line.startswith("equality") for line in m.unused)
    d = mujoco.MjData(mj)
    d.qpos = mjcf.to_mujoco(m, np.random.default_rng(1).uniform(-1, 1, m.nq)).q
    mujoco.mj_forward(mj, d)
    errors = d.efc_pos[d.efc_type == mujoco.mjtConstraint.mjCNSTR_EQUALITY]
    assert len(errors) == mj.neq and np.abs(errors).max() < 1e-14 and np.abs(d.qpos).max() > 0.1


@pytest.mark.parametrize(
    ("equality", "fixed"),
    [
        ('<joint joint1="b" polycoef="0.4 0 0 0 0"/>', ["b"]),
        ('<joint joint1="b"/>', ["b"]),
        ('<joint joint1="c" joint2="b" polycoef="0.1 2 0 0 0"/><joint joint1="b" polycoef="-0.3 0 0 0 0"/>', ["b", "c"]),  # what follows it is held, too
        (
            '<joint joint1="c" joint2="b" polycoef="0 -1 0 0 0"/><joint joint1="a" joint2="c" polycoef="0.2 0.5 0 0 0"/><joint joint1="b" polycoef="0.3 0 0 0 0"/>',
            ["a", "b", "c"],
        ),
        (
            '<joint joint1="a" joint2="c" polycoef="0.2 0.5 0 0 0"/><joint joint1="c" joint2="b" polycoef="0 -1 0 0 0"/><joint joint1="b" polycoef="0.3 0 0 0 0"/>',
            ["a", "b", "c"],
        ),
        ('<tendon tendon1="cc" polycoef="0.5 0 0 0 0"/>', ["c"]),
    ],
)
def test_a_joint_that_is_held_is_fixed_there(tmp_path, equality, fixed):
    """MuJoCo's own constraints have no error at the states of the model, whose links stand where MuJoCo has them."""
    inner = f'<body name="c" pos="0 0.3 0.1"><joint name="c" axis="0 1 1" ref="0.2"/>{BODY}</body>'
    chain = f'<body name="a"><joint name="a" axis="0 0 1"/>{BODY}<body name="b" pos="0.4 0 0"><joint name="b" type="slide" axis="1 0 0" ref="0.1"/>{BODY}{inner}</body></body>'
    chain += f'<body name="d"><joint name="d"/>{BODY}</body>'
    path = in_file(
        tmp_path,
        chain,
        f'<tendon><fixed name="cc"><joint joint="c" coef="-2"/></fixed></tendon><equality>{equality}</equality><actuator><motor joint="b"/></actuator>',
    )
    m, mj = ksl.load(path), mujoco.MjModel.from_xml_path(str(path))
    assert [name for name in "abc" if m.joint(name).kind == "fixed"] == fixed and any("held at" in line for line in m.unused)
    d, q = mujoco.MjData(mj), np.random.default_rng(1).uniform(-1, 1, m.nq)
    d.qpos = mjcf.to_mujoco(m, q).q
    mujoco.mj_forward(mj, d)
    assert np.abs(d.efc_pos[d.efc_type == mujoco.mjtConstraint.mjCNSTR_EQUALITY]).max() < 1e-15
    for name in "abc":
        check(m.frame_pose(q, name)[:3, 3], d.body(name).xpos)
        check(m.frame_pose(q, name)[:3, :3], d.body(name).xmat.reshape(3, 3))
    back = mjcf.from_mujoco(m, d.qpos, d.qvel, d.qacc)
    check(back.q, q)
    assert not mjcf.to_mujoco(m, q, np.ones(m.nv)).v[[mj.joint(name).dofadr[0] for name in fixed]].any()
    assert ksl.load(path, mimic="independent").nv == 4


def test_couplings_by_tendons_that_are_no_mimic_joints(tmp_path):
    bodies = "".join(f'<body name="{n}"><joint name="{n}"/><site name="at_{n}"/>{BODY}</body>' for n in "abc")
    tendons = '<fixed name="abc"><joint joint="a" coef="1"/><joint joint="b" coef="1"/><joint joint="c" coef="1"/></fixed><fixed name="aa"><joint joint="a" coef="1"/></fixed>'
    tendons += '<fixed name="cc"><joint joint="c" coef="1"/></fixed><spatial name="rope"><site site="at_a"/><site site="at_b"/></spatial>'
    for said, why in (
        ('<tendon name="k" tendon1="abc"/>', "constraint k couples 3 joints by tendon abc; couplings of two are read"),
        ('<tendon tendon1="aa" tendon2="cc" polycoef="0 1 1 0 0"/>', "couples tendons aa and cc by a polynomial that isn't linear"),
        ('<tendon tendon1="rope"/>', "is about the length of tendon rope, which is no sum of joint positions"),
    ):
        path = in_file(tmp_path, bodies, f"<tendon>{tendons}</tendon><equality>{said}</equality>")
        with pytest.raises(ksl.DescriptionError, match=why):
            ksl.load(path)
        assert "equality tendon (1)" in ksl.load(path, mimic="independent").unused


def test_joints_of_a_stack():
    m = ksl.load(CHAINS, mimic="independent")
    kinds = {name: m.joint(name).kind for name in m.joint_names}
    assert kinds == {
        "root": "floating", "hip_x": "revolute", "hip_y": "revolute", "hip_z": "revolute", "knee": "spherical", "foot_joint": "prismatic",
        "foot_joint_": "revolute", "a1+b2": "universal", "cart": "planar", "pole": "revolute",
    }  # fmt: skip
    assert (m.joint("hip_x").lower, m.joint("hip_x").upper) == pytest.approx(np.radians([-30, 40]))
    assert m.joint("hip_x").damping == 0.2 and m.joint("pole").friction == 0.1
    assert list(m.gravity) == [0.3, -1.2, -9.3]
    assert m.parent("toe") == "foot" and m.link("toe").mass == 0


def test_warnings_of_the_compiler(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    same = '<joint axis="1 0 0"/>'
    with pytest.warns(ksl.DescriptionWarning, match="MuJoCo's compiler says: Inertia matrix is too close to singular"):
        ksl.load(in_file(tmp_path, f'<body name="b">{same}{same}{BODY}</body>'))
    assert [path.name for path in tmp_path.iterdir()] == ["robot.xml"]  # no log


def test_a_compiler_in_a_process_of_its_own_gives_the_same_robot(tmp_path, monkeypatch):
    """As commands run it.  What ends that process is a sentence."""
    here = ksl.load(CHAINS)
    same = '<joint axis="1 0 0"/>'
    doubtful, wrong = in_file(tmp_path, f'<body name="b">{same}{same}{BODY}</body>'), tmp_path / "wrong.xml"
    wrong.write_text("<mujoco><x/></mujoco>")
    monkeypatch.setattr(own_process, "_is_wanted", True)
    apart = ksl.load(CHAINS)
    assert apart.links == here.links and apart.joints == here.joints and apart.unused == here.unused and apart.warnings == here.warnings
    with pytest.warns(ksl.DescriptionWarning, match="MuJoCo's compiler says: Inertia matrix is too close to singular"):
        ksl.load(doubtful)
    with pytest.raises(ksl.DescriptionError, match="wrong.xml: MuJoCo's compiler refuses the file: .*unrecognized element.*; correct it there"):
        ksl.load(wrong)
    monkeypatch.setattr(mjcf_compiler, "COMPILE", "os.kill(os.getpid(), 9)")
    with pytest.raises(ksl.DescriptionError, match="most likely since memory ran out"):
        ksl.load(CHAINS)


def test_what_asks_for_too_much_memory_is_refused_with_a_sentence(monkeypatch, tmp_path):
    """A height field of 5 GB in a hundred characters; and MuJoCo's bindings where an allocation fails."""
    import mujoco

    field = '<mujoco><asset><hfield name="ground\\" nrow="{}" ncol="{}" size="1 1 1 1"/></asset><worldbody><body name="b"><joint/><geom size="1"/></body></worldbody></mujoco>'
    (tmp_path / "part.xml").write_text(field.format(45000, 30000))
    for text in (field.format(45000, 30000), field.format(2**13, 2**13 + 1), f'<mujoco><include file="{tmp_path}/part.xml"/></mujoco>'):
        with pytest.raises(ksl.DescriptionError, match=r"the height field ground\\.* × .* numbers, and 67,108,864 are the most that are read; make it coarser"):
            ksl.load_string(text)
    assert ksl.load_string(field.format(3, 4)).nv == 1
    with pytest.raises(ksl.DescriptionError, match="MuJoCo's compiler refuses the file"):
        ksl.load_string(field.format("many", 4))

    (tmp_path / "big.png").write_bytes(b"\x89PNG\r\n\x1a\n" + bytes([0, 0, 0, 13]) + b"IHDR" + (30000).to_bytes(4, "big") + (45000).to_bytes(4, "big"))
    with pytest.raises(ksl.DescriptionError, match=r"ground\\.* has 45,000 × 30,000 numbers, and"):
        ksl.load_string(field.replace("nrow", f'file="{tmp_path}/big.png" nrow').format(0, 0))

    body = '<worldbody><body name="b"><joint/><geom size="1"/></body>{}</worldbody>'
    checker = '<asset><texture name="{}" type="{}" builtin="checker" width="{}" height="{}"/>{}</asset>' + body.format("")
    copies = '<replicate count="{}" offset="1 0 0"><replicate count="{}" offset="0 1 0"><geom size="1"/>{}</replicate></replicate>'
    for text, said in (
        (checker.format("t", "2d", 20000, 20000, ""), "the texture t has 20,000 × 20,000 points, and 67,108,864 are"),
        (checker.format("t", "skybox", 9000, 1, ""), "the texture t has 6 × 9,000 × 9,000 points, and"),
        (
            checker.format("t", "2d", 8000, 8000, '<texture name="u" type="2d" builtin="flat" width="2000" height="2000"/>'),
            "the texture u has with those before it 68,000,000 points, and",
        ),
        (checker.replace("builtin", f'file="{tmp_path}/big.png" title').format("t", "2d", 1, 1, ""), "the texture t has 45,000 × 30,000 points, and"),
        (body.format(copies.format(1000, 101, "")), "the replicate has 101,000 elements, and 100,000 are"),
        (body.format(copies.format(500, 101, '<geom size="1"/>')), "the replicate has with those before it 101,500 elements, and"),
        (
            body.format('<flexcomp name="cloth" type="grid" count="1000 1000 1" spacing="1 1 1" mass="1"/>'),
            "the grid flexcomp cloth has 1,000 × 1,000 × 1 points, and",
        ),
        ('<size nuser_geom="100000000"/>' + body.format(""), "the size nuser_geom has 100,000,000 × 6 user's numbers, and"),
    ):
        with pytest.raises(ksl.DescriptionError, match=re.escape(said)):
            ksl.load_string(f"<mujoco>{text}</mujoco>")
    assert ksl.load_string(f"<mujoco>{body.format(copies.format(3, 2, ''))}</mujoco>").nv == 1
    for error, said in (
        (RuntimeError("Caught an unknown exception!"), "there is not enough memory for it"), (MemoryError(), "there is not enough memory for it"), (RuntimeError("no decoder"), "no decoder"),
    ):  # fmt: skip

        def fails(*_, error=error):
            raise error

        monkeypatch.setattr(mujoco.MjModel, "from_xml_string", fails)
        with pytest.raises(ksl.DescriptionError, match=f"compiler refuses the file: {said}; correct it"):
            ksl.load_string(field.format(3, 4))


def stack(tmp_path, *joints: str) -> list[str]:
    m = ksl.load(in_file(tmp_path, f'<body name="b">{"".join(joints).replace("{}", "")}{BODY}</body>'))
    return [m.joint(name).kind for name in m.joint_names]


def test_a_kind_is_read_only_where_it_carries_everything(tmp_path):
    hinge, slide = '<joint name="a" type="hinge" axis="1 0 0" {}/>', '<joint name="b" type="slide" axis="1 0 0" {}/>'
    other = '<joint name="c" type="hinge" axis="0 1 0" {}/>'
    assert stack(tmp_path, hinge, slide) == stack(tmp_path, slide, hinge) == ["cylindrical"]
    assert stack(tmp_path, hinge, other) == ["universal"]
    for said in ('range="-1 1"', 'stiffness="2"', 'damping="1"', 'pos="0.1 0 0"', 'ref="20"', 'actuatorfrcrange="-3 3"'):
        assert stack(tmp_path, hinge.format(said), other) == ["revolute", "revolute"]
    assert stack(tmp_path, hinge.format('damping="1"'), other.format('damping="1"')) == ["universal"]
    assert stack(tmp_path, hinge.format('damping="1"'), slide.format('damping="1"')) == ["revolute", "prismatic"]
    with pytest.warns(ksl.DescriptionWarning, match="singular"):
        assert stack(tmp_path, hinge, hinge.replace('"a"', '"d"')) == ["revolute", "revolute"]
    x, y, z = (f'<joint type="slide" name="{n}" axis="{n == "x":d} {n == "y":d} {n == "z":d}"/>' for n in "xyz")
    assert stack(tmp_path, x, y, z) == ["translation"]
    assert stack(tmp_path, y, x, z) == ["prismatic"] * 3
    assert stack(tmp_path, x, y, '<joint axis="0 0 1"/>') == ["planar"]


def test_physics_of_joints_is_carried():
    text = ksl.load(CHAINS).to_urdf()
    hip, pole = (text[text.index(f'joint name="{name}"') :].partition("</joint>")[0] for name in ("hip_z", "pole"))
    assert 'damping="0.2"' in hip and 'armature="0.01"' in hip and 'spring_stiffness="3"' in hip and f'spring_reference="{float(np.radians(10))!r}"' in hip
    assert 'friction="0.1"' in pole and "spring" not in pole


def test_what_is_not_carried_is_listed():
    said = "\n".join(ksl.load(CHAINS).unused)
    for words in ("geom (9)", "actuator (1)"):
        assert words in said
    assert "equality" not in said


HANDLED = """<body name="hand" pos="0 0 1"><freejoint name="free"/><geom size="0.1"/><site name="grip"/></body>
<body name="handle" mocap="true" pos="0 0 1"><geom size="0.05" contype="0"/><site name="held"/><body name="knob" pos="0 0 0.1"><geom size="0.01"/></body></body>"""


@pytest.mark.parametrize(
    "tie", ['<weld name="w" body1="handle" body2="hand"/>', '<connect name="w" site1="grip" site2="held"/>', '<weld name="w" body1="hand" body2="knob"/>']
)
def test_a_handle_of_a_simulator_is_no_part_of_the_robot(tmp_path, tie):
    path = in_file(tmp_path, HANDLED, f"<equality>{tie}</equality>")
    with pytest.warns(
        ksl.DescriptionWarning, match="mocap body handle, knob: a handle by which a simulator moves the robot.*left out, with equality constraint w"
    ):
        m = ksl.load(path)
    alone = ksl.load(in_file(tmp_path, HANDLED.partition('<body name="handle')[0]))
    assert (m.nv, m.loops, m.mass) == (6, (), alone.mass) and "handle" not in m.link_names and "held" not in m.link_names
    assert any(line.startswith("equality") and "to a mocap body (1)" in line for line in m.unused)


def test_a_mocap_body_that_carries_joints_is_the_base(tmp_path):
    m = ksl.load(in_file(tmp_path, f'<body name="base" mocap="true" pos="0 0 2">{BODY}<body name="arm"><joint name="j"/>{BODY}</body></body>'))
    assert m.nv == 1 and m.frame_pose([0.0], "arm")[2, 3] == 2 and "mocap bodies (1; welded where the file has them)" in m.unused


@pytest.mark.parametrize(("count", "dim", "dof", "bodies"), [("3 3 1", 2, "full", 9), ("3 3 3", 3, "trilinear", 8)])
def test_what_joins_bodies_and_is_not_known_is_refused(tmp_path, count, dim, dof, bodies):
    cloth = f'<flexcomp name="cloth" type="grid" count="{count}" spacing="0.1 0.1 0.1" radius="0.01" dim="{dim}" dof="{dof}" mass="1"/>'
    path = in_file(tmp_path, f'<body name="b"><joint/>{BODY}</body>{cloth}')
    with pytest.raises(ksl.DescriptionError, match=f'flex cloth is a soft body that joins {bodies} bodies.*loops="cut"'):
        ksl.load(path)
    assert any(line.startswith("flex") for line in ksl.load(path, loops="cut").unused)
    mj = mujoco.MjModel.from_xml_string(
        f'<mujoco><worldbody><body name="b"><joint name="j"/>{BODY}</body></worldbody><equality><joint joint1="j"/></equality></mujoco>'
    )
    mj.body_plugin[1] = 0
    with pytest.warns(ksl.DescriptionWarning, match="a plugin acts on body b, with forces that KSL doesn't read"):
        mjcf.model_of(mj)
    mj.eq_type[0] = 7
    with pytest.raises(ksl.DescriptionError, match="equality constraint 1 is of kind 7, which KSL doesn't know"):
        mjcf.model_of(mj)


def test_tendons_that_couple_joints_and_are_not_read_are_named(tmp_path):
    bodies = "".join(f'<body name="{n}"><joint name="{n}"/>{BODY}</body>' for n in "ab")
    fixed = '<tendon><fixed name="band" {}><joint joint="a" coef="1"/><joint joint="b" coef="1"/></fixed></tendon>'
    with pytest.warns(ksl.DescriptionWarning, match="tendon band couples joints a, b by its stiffness, damping, which KSL doesn't read"):
        ksl.load(in_file(tmp_path, bodies, fixed.format('stiffness="3" damping="1"')))
    assert not ksl.load(in_file(tmp_path, bodies, fixed.format(""))).warnings
    spatial = '<tendon><spatial name="band" range="{}"><site site="s"/><site site="t"/></spatial></tendon>'
    sites = f'<site name="t" pos="0 0 1"/><body name="c"><joint/>{BODY}<site name="s" pos="1 0 0"/></body>'
    with pytest.warns(ksl.DescriptionWarning, match="tendon band couples joints a, b by its narrow limits"):
        ksl.load(in_file(tmp_path, bodies, fixed.format('range="-1e-4 1e-4"')))
    with pytest.warns(ksl.DescriptionWarning, match="tendon band couples sites and surfaces by its narrow limits"):
        ksl.load(in_file(tmp_path, sites, spatial.format("1.414 1.4143")))
    damped = spatial.format('1.414 1.4143" damping="1')
    with pytest.warns(ksl.DescriptionWarning, match="by its narrow limits"):
        assert ksl.load(in_file(tmp_path, sites, damped)).force_elements
    with pytest.warns(ksl.DescriptionWarning, match="by its damping"):  # to a handle
        ksl.load(in_file(tmp_path, sites.replace('<site name="t"', '<body mocap="true"><site name="t"', 1).replace('"/>', '"/></body>', 1), damped))
    assert not ksl.load(in_file(tmp_path, sites, spatial.format("0.5 1.5"))).warnings


def test_options(tmp_path):
    path = in_file(tmp_path, f'<body name="b"><joint/>{BODY}</body>')
    assert list(ksl.load(path, gravity=(0, 0, -1)).gravity) == [0, 0, -1]
    assert ksl.load(path, payloads={"b": (2.0, (0, 0, 0))}).mass == pytest.approx(ksl.load(path).mass + 2)
    with pytest.raises(ksl.DescriptionError, match="robot.xml: a floating base is asked for, but no body has a <freejoint>"):
        ksl.load(path, floating_base=True)
    compiled = mujoco.MjModel.from_xml_path(str(path))
    assert mjcf.model_of(compiled).nv == 1
    with pytest.raises(ValueError, match="mimic='loose'; expected one of 'coupled', 'independent'"):
        mjcf.model_of(compiled, mimic="loose")
    with pytest.raises(ValueError, match="mj is str; expected a mujoco.MjModel"):
        mjcf.model_of(str(path))


def test_files_that_are_wrong(tmp_path):
    with pytest.raises(ksl.DescriptionError, match="robot.xml: MuJoCo's compiler refuses the file: .*joint.*correct it there"):
        ksl.load(in_file(tmp_path, f'<body><joint type="bell"/>{BODY}</body>'))
    m = ksl.load(HERE.parent.parent / "examples/robots/ur5.urdf")
    with pytest.raises(ValueError, match="no layout of MuJoCo"):
        mjcf.to_mujoco(m, np.zeros(6))
    m = ksl.load(CHAINS)
    with pytest.raises(ValueError, match=r"q has shape \(3,\); expected \(…, 21\)"):
        mjcf.to_mujoco(m, np.zeros(3))
    with pytest.raises(ValueError, match="a is given without v"):
        mjcf.from_mujoco(m, np.zeros(m.nq + 1), a=np.zeros(m.nv + 1))


def test_a_pickle_keeps_the_layout():
    m = ksl.load(CHAINS)
    again, qpos = pickle.loads(pickle.dumps(m)), random_states(mujoco.MjModel.from_xml_path(str(CHAINS)), 1)[0]
    assert (mjcf.from_mujoco(again, qpos).q == mjcf.from_mujoco(m, qpos).q).all()
    assert again.joints == m.joints


def test_without_the_package(tmp_path):
    script = f"import sys; sys.modules['mujoco'] = None\nimport ksl\ntry:\n    ksl.load({str(CHAINS)!r})\nexcept ksl.DescriptionError as e:\n    print(e)"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=60)
    assert "chains.xml: this is MJCF" in done.stdout and "pip install 'ksl[mjcf]'" in done.stdout, done.stderr


def test_no_warnings_that_the_file_does_not_deserve():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        ksl.load(CHAINS)


def test_options_that_other_formats_have(tmp_path):
    path = in_file(tmp_path, f"<body><joint name='hinge'/>{BODY}</body>")
    with pytest.raises(ksl.DescriptionError, match='model "x" is asked for, but only SDF files hold several'):
        ksl.load(path, model="x")
    assert ksl.load(path, friction_width=0.5).friction_width == 0.5
    with pytest.raises(ksl.DescriptionError, match="friction_width is -1"):
        ksl.load(path, friction_width=-1)


@pytest.mark.filterwarnings("error::RuntimeWarning")
@pytest.mark.parametrize(
    "inside, said",
    [
        ('<body name="\xe9"><joint/><geom size="1"/></body>', "a name in it is not UTF-8"),
        ('<body name="a" pos="inf 0 0"><joint name="h" ref="nan"/><geom size=".1"/></body>', "joint h: its pose"),
        ('<body name="a"><body pos="1e308 0 0"><joint name="h" pos="1e308 0 0"/><geom size="1"/></body></body>', "joint h: its pose"),
        ('<body name="a"><joint name="h&#27;"/><geom size="1"/></body>', "control character"),
    ],
)  # fmt: skip
def test_names_and_numbers_that_mujoco_takes_are_refused_with_the_file(tmp_path, inside, said):
    path = tmp_path / "robot.xml"
    path.write_bytes(f'<mujoco model="m"><worldbody>{inside}</worldbody></mujoco>'.encode("latin-1"))
    with pytest.raises(ksl.DescriptionError, match=said) as refusal:
        ksl.load(path)
    assert str(refusal.value).startswith(f"{path}: ")


def test_what_a_default_class_gives_a_free_joint_is_listed():
    """Models of robots that walk have an armature in the default class of all joints, the free one among them."""
    default = '<default><joint armature="1" damping="0.1" stiffness="2"/></default>'
    m = ksl.load_string(f'<mujoco>{default}<worldbody><body name="b"><joint name="j" type="free"/><geom size="0.1"/></body></worldbody></mujoco>')
    assert m.joints[0].kind == "floating" and {"joint j: armature of a free joint (not used)", "joint j: stiffness (not used)"} <= set(m.unused)
