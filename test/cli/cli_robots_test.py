"""Robots that the command reads: mimic joints, masses that are missing or impossible, floating bases, and what `ksl info` says."""

import os

import pytest

import ksl
from loads_runs import SLIDE, refused, run, summary

MIMIC = """<robot name="hand"><link name="palm"/><link name="a"/><link name="b"/>
<joint name="finger1" type="prismatic"><parent link="palm"/><child link="a"/>
  <limit lower="0" upper="1" effort="1" velocity="1"/></joint>
<joint name="finger2" type="prismatic"><parent link="palm"/><child link="b"/>
  <limit lower="0" upper="1" effort="1" velocity="1"/><mimic joint="finger1"/></joint></robot>"""
IMPOSSIBLE = """<robot name="odd"><link name="stone"><inertial><mass value="1"/>
<inertia ixx="1" iyy="1" izz="9" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>"""


def test_floating_base(tmp_path):
    (tmp_path / "stone.urdf").write_text(IMPOSSIBLE.replace('izz="9"', 'izz="1"'))
    rows = "".join(f"{k / 10},{k},0,{-k},0,0,0,1\n" for k in range(8))
    (tmp_path / "fly.csv").write_text("time," + ",".join(f"floating_base.{c}" for c in ("x", "y", "z", "qx", "qy", "qz", "qw")) + "\n" + rows)
    p = run("loads", tmp_path / "stone.urdf", tmp_path / "fly.csv", "-o", tmp_path / "o", "--floating-base")
    assert p.returncode == 0, p.stderr
    assert float(summary(tmp_path / "o")["floating_base"]["force_peak"]) == pytest.approx(9.81)
    assert "power balance" in p.stdout


def test_mimic_joints(tmp_path):
    (tmp_path / "hand.urdf").write_text(MIMIC)
    p = run("info", tmp_path / "hand.urdf")
    assert p.returncode == 0 and "moving joints 1, mimic joints 1" in p.stdout and "1 × finger1" in p.stdout, p.stderr
    (tmp_path / "lost.urdf").write_text(MIMIC.replace('mimic joint="finger1"', 'mimic joint="thumb"'))
    refused(tmp_path, run("info", tmp_path / "lost.urdf"), "finger2", "thumb", "--mimic independent")
    p = run("info", tmp_path / "hand.urdf", "--mimic", "independent")
    assert p.returncode == 0 and "moving joints 2" in p.stdout, p.stderr


def test_impossible_inertia_is_a_warning_or_with_strict_an_error(tmp_path):
    (tmp_path / "odd.urdf").write_text(IMPOSSIBLE)
    p = run("info", tmp_path / "odd.urdf")
    assert p.returncode == 0 and p.stderr.startswith("ksl: warning: link stone") and "stone" in p.stdout
    refused(tmp_path, run("info", tmp_path / "odd.urdf", "--strict"), "link stone")


def test_a_robot_without_masses(two, tmp_path):
    """Zeros and a power balance without a fault would look like an answer."""
    robot, motion = two
    shape = '<visual><geometry><box size="1 1 1"/></geometry></visual>'
    inertial = SLIDE[SLIDE.index("<inertial>") : SLIDE.index("</inertial>") + len("</inertial>")]
    robot.write_text(SLIDE.replace(inertial, shape))
    refused(tmp_path, run("loads", robot, motion, "-o", tmp_path / "q"), "two.urdf: none of the links that move (cart) has a mass")
    p = run("info", robot)
    assert p.returncode == 0 and p.stderr.startswith("ksl: warning: none of the links that move (cart) has a mass") and "cart" in p.stdout
    refused(tmp_path, run("info", robot, "--strict"), "none of the links that move (cart) has a mass")
    paid = run("loads", robot, motion, "-o", tmp_path / "o", "--payload", "2", "--on-link", "cart")
    assert paid.returncode == 0 and paid.stderr == ""
    refused(tmp_path, run("loads", robot, motion, "-o", tmp_path / "q", "--payload", "2", "--on-link", "hand"), "none of the links")


def test_one_link_without_mass_is_a_warning_or_with_strict_an_error(two, tmp_path):
    robot, motion = two
    tool = '<link name="tool"><collision><geometry><box size="1 1 1"/></geometry></collision></link>'
    weld = '<joint name="weld" type="fixed"><parent link="cart"/><child link="tool"/></joint>'
    robot.write_text(SLIDE.replace("</robot>", f"{tool}{weld}</robot>"))
    sentence = "link tool (line 4): moves and has geometry, but no mass: its weight and inertia are missing"
    p = run("loads", robot, motion, "-o", tmp_path / "o")
    assert (p.returncode, p.stderr) == (0, f"ksl: warning: {sentence}\n") and f"  not green: {sentence}" in p.stdout
    assert "moves and has geometry, but no mass" in (tmp_path / "o" / "report.html").read_text(encoding="utf-8")
    refused(tmp_path, run("loads", robot, motion, "-o", tmp_path / "q", "--strict"), sentence, "add <inertial> to these links")


def test_an_instruction_set_that_does_not_exist(ur5, tmp_path):
    refused(tmp_path, run("loads", *ur5, "-o", tmp_path / "q", KSL_ISA="nonsense"), "KSL_ISA=nonsense", "known: ")
    refused(tmp_path, run("info", "--cpu", KSL_ISA="nonsense"), "KSL_ISA=nonsense", "unset it")


def test_info(ur5):
    p = run("info", ur5[0])
    assert p.returncode == 0, p.stderr
    m = ksl.load(ur5[0])
    for words in (
        "ur5",
        "degrees of freedom 6 (nq 6)",
        "moving joints 6",
        "fixed joints 2",
        "links 8",
        "gravity (0, 0, -9.81)",
        f"{sum(l.mass for l in m.links):.6g} kg",
    ):
        assert words in p.stdout, words
    for name in [*(j.name for j in m.joints), *m.link_names, "ground"]:
        assert name in p.stdout, name
    assert "3.14" in p.stdout and "150" in p.stdout, "limits"


def test_info_says_what_is_not_used(tmp_path):
    (tmp_path / "r.urdf").write_text('<robot name="r"><link name="l"><visual><geometry><box size="1 1 1"/></geometry></visual></link><gazebo/></robot>')
    p = run("info", tmp_path / "r.urdf")
    assert p.returncode == 0 and "not used" in p.stdout and "visual" in p.stdout and "gazebo" in p.stdout


def test_info_of_sdf_and_mjcf(tmp_path):
    body = "<link name='l'><inertial><mass>3</mass><inertia><ixx>1</ixx><iyy>1</iyy><izz>1</izz></inertia></inertial></link>"
    models = "".join(f"<model name='{name}'>{body}</model>" for name in ("one", "two"))
    (tmp_path / "two.sdf").write_text(f"<sdf version='1.9'><world name='w'><gravity>0 0 -2</gravity>{models}</world></sdf>")
    p = run("info", tmp_path / "two.sdf")
    assert p.returncode == 2 and "--model NAME" in p.stderr
    p = run("info", tmp_path / "two.sdf", "--model", "two")
    assert p.returncode == 0 and "gravity (0, 0, -2)" in p.stdout and "floating_base, floating" in p.stdout
    (tmp_path / "pole.xml").write_text("<mujoco><worldbody><body name='p'><joint name='hinge'/><geom size='0.1'/></body></worldbody></mujoco>")
    p = run("info", tmp_path / "pole.xml")
    assert p.returncode == 0 and "hinge, revolute" in p.stdout and "geom (1)" in p.stdout, p.stderr


@pytest.mark.parametrize("isa", ["", "x86-64-v2"])
def test_info_of_the_processor(isa):
    if isa and os.uname().machine != "x86_64":
        isa = "neon" if os.uname().machine == "aarch64" else "generic"
    p = run("info", "--cpu", KSL_ISA=isa)
    assert p.returncode == 0 and p.stdout.startswith("kernels: ") and (not isa or p.stdout == f"kernels: {isa}\n")


def test_nothing_asked_of_info(tmp_path):
    refused(tmp_path, run("info"), "robot file")
