"""`ksl.compare` with the libraries themselves: MuJoCo, which the tests bring, and Pinocchio and Drake where they are installed."""

import re

import pytest
from ksl_command import run_ksl

import ksl
from ksl.comparison.body_changes import changed_links
from ksl.comparison.libraries import LIBRARIES
from ksl.comparison.other_robot import File

FREE = """<mujoco model="free"><option gravity="0 0.3 -9"/><worldbody>
  <body name="base" pos="0.1 0.2 0.3" quat="0.9 0.1 0.2 0.3"><freejoint name="root"/><inertial pos="0 0 0.1" mass="2" diaginertia="0.1 0.2 0.25"/>
    <body name="arm" pos="0 0 0.2"><joint name="shoulder" axis="0 1 0" pos="0 0 0.05" ref="0.3" armature="0.05" damping="0.2"/>
      <inertial pos="0.1 0 0" mass="1" diaginertia="0.01 0.02 0.02"/>
      <body name="ball" pos="0.2 0 0"><joint name="wrist" type="ball"/><inertial pos="0.1 0 0" mass="0.5" diaginertia="0.01 0.02 0.02"/>
        <body name="tool" pos="0.1 0 0"><inertial pos="0 0 0" mass="0.3" diaginertia="0.001 0.001 0.001"/><site name="grip"/></body></body></body></body>
  <site name="hook" pos="0 0 3"/></worldbody>
  <tendon><spatial name="balancer" stiffness="30" damping="2" springlength="1"><site site="hook"/><site site="grip"/></spatial></tendon></mujoco>"""
SDF = """<sdf version="1.10"><model name="mixer"><link name="stand"><inertial><mass>9</mass><inertia><ixx>1</ixx><iyy>1</iyy><izz>1</izz></inertia></inertial></link>
  <link name="head"><pose relative_to="stand">0 0 0.4 0 0 0</pose><inertial><pose>0.1 0 0 0 0 0</pose><mass>2</mass><inertia><ixx>.01</ixx><iyy>.01</iyy><izz>.01</izz></inertia></inertial></link>
  <joint name="feet" type="fixed"><parent>world</parent><child>stand</child></joint>
  <joint name="tilt" type="revolute"><parent>stand</parent><child>head</child><axis><xyz>1 0 0</xyz></axis></joint></model></sdf>"""


@pytest.fixture(params=["mujoco", "pinocchio", "drake"])
def library(request):
    pytest.importorskip({"drake": "pydrake"}.get(request.param, request.param))
    return request.param


FINGER = """<link name="{0}"><inertial><origin xyz="0 0 0.02"/><mass value="0.1"/><inertia ixx="1e-4" iyy="2e-4" izz="1.5e-4" ixy="0" iyz="0" ixz="0"/></inertial></link>
<joint name="{0}_joint" type="prismatic"><parent link="panda_flange"/><child link="{0}"/><axis xyz="0 {1} 0"/><limit lower="0" upper="0.04" effort="9" velocity="1"/>{2}</joint>"""


@pytest.fixture
def panda(examples, tmp_path):
    """With fingers, and its joints damped."""
    fingers = FINGER.format("left", 1, "") + FINGER.format("right", -1, '<mimic joint="left_joint"/>')
    text = (examples / "robots/panda.urdf").read_text().replace("</robot>", f"{fingers}</robot>")
    (tmp_path / "panda.urdf").write_text(re.sub(r"(<joint name=\"[^\"]*\" type=\"(?:revolute|prismatic)\">)", r'\1<dynamics damping="0.3"/>', text))
    return tmp_path / "panda.urdf"


@pytest.mark.parametrize("floating", [False, True], ids=["fixed", "floating"])
def test_panda(panda, library, floating):
    """They agree but for damping, which MuJoCo and Drake read from <dynamics>; once KSL applies it, too, all numbers agree but Pinocchio's."""
    found = ksl.compare(panda, library, floating_base=floating, states=3)[library]
    assert not found.failed and found.unexplained == []
    assert [r.topic for r in found.reasons] == ([] if library == "pinocchio" else ["damping"])
    damped = ksl.compare(panda, library, floating_base=floating, states=3, physics="damping")[library]
    assert [r.topic for r in damped.reasons] == (["damping"] if library == "pinocchio" else [])
    topics = {c.topic for c in found.conventions}
    assert "mimic" in topics and ("lumped links" in topics or library == "drake") and ("base" in topics or not floating)


@pytest.mark.parametrize("floating", [False, True], ids=["fixed", "floating"])
def test_bodies_are_those_of_the_file(panda, tmp_path, library, floating):
    """Links that are welded together are one, in the frame of the link that moves."""
    files = [(panda, "urdf")]
    (tmp_path / "free.xml").write_text(FREE)
    (tmp_path / "mixer.sdf").write_text(SDF)
    if not floating:
        files += [(tmp_path / "mixer.sdf", "sdf")] if library == "drake" else [(tmp_path / "free.xml", "mjcf")]
    for path, format_ in files:
        m = ksl.load(path, floating_base=floating, mimic="independent")
        bodies = LIBRARIES[library].load(File(str(path), path.read_bytes(), format_, m, floating)).bodies()
        assert len(bodies) >= len(m.joint_names) - (format_ == "mjcf")  # KSL has a link of its own where a joint of MJCF is not at its body's frame
        assert changed_links(m, {link: P for link, P in bodies.items() if link in m.link_names}) == "", path.name


def test_ur5(examples, library):
    found = ksl.compare(examples / "robots/ur5.urdf", library, states=2)[library]
    assert not found.failed and found.unexplained == [] and len(found.quantities) == 6 and not {"mimic", "quaternion"} & {c.topic for c in found.conventions}


@pytest.mark.parametrize(("axis", "status"), [("0 0 1", 0), ("1 0 0", 2)])
def test_planes(tmp_path, library, axis, status):
    """Those across z agree, but in MuJoCo, which reads none; across others, numbers are of other axes."""
    links = "".join(
        f'<link name="{n}"><inertial><origin xyz="0.1 0 0.2"/><mass value="2"/><inertia ixx="0.3" iyy="0.4" izz="0.2" ixy="0.02" iyz="0.01" ixz="0.03"/></inertial></link>'
        for n in "ab"
    )
    joints = "".join(
        f'<joint name="{kind}" type="{kind}"><parent link="{p}"/><child link="{c}"/><axis xyz="{axis}"/></joint>'
        for kind, p, c in (("planar", "w", "a"), ("continuous", "a", "b"))
    )
    (tmp_path / "r.urdf").write_text(f'<robot name="r"><link name="w"/>{links}{joints}</robot>')
    found = ksl.compare(tmp_path / "r.urdf", library, states=2)[library]
    assert found.status == (2 if library == "mujoco" else status) and ("no such joint as planar (planar)" in found.failed) == (
        found.status == 2 and library != "drake"
    )
    topics = {c.topic for c in found.conventions}
    assert ("quaternion" in topics) == (library == "pinocchio" and not found.failed) and (library == "mujoco" or "lumped links" not in topics)


def test_mjcf_with_all_that_mujoco_has_otherwise(tmp_path):
    pytest.importorskip("mujoco")
    (tmp_path / "free.xml").write_text(FREE)
    found = ksl.compare(tmp_path / "free.xml", "mujoco")["mujoco"]
    assert {r.topic for r in found.reasons} == {"armature", "damping", "force elements"} and found.unexplained == []
    assert {"quaternion", "base", "frame"} <= {c.topic for c in found.conventions}
    assert ksl.compare(tmp_path / "free.xml", "mujoco", physics=["armature", "damping", "force elements"])["mujoco"].status == 0


def test_sdf(tmp_path, library):
    (tmp_path / "mixer.sdf").write_text(SDF)
    found = ksl.compare(tmp_path / "mixer.sdf", library)[library]
    if library == "drake":
        assert found.status == 0, found
    else:
        assert found.status == 2 and "SDF" in found.failed


def test_a_tensor_that_mujoco_refuses_and_drake_replaces(tmp_path, library):
    text = ("<robot name='r'><link name='a'/><link name='b'><inertial><origin xyz='0.1 0 0'/><mass value='2'/><inertia ixx='1' iyy='0.1' izz='0.1' ixy='0' iyz='0' ixz='0'/></inertial></link>"
            "<joint name='j' type='continuous'><parent link='a'/><child link='b'/><axis xyz='0 0 1'/></joint></robot>")  # fmt: skip
    (tmp_path / "r.urdf").write_text(text)
    with pytest.warns(ksl.DescriptionWarning):
        found = ksl.compare(tmp_path / "r.urdf", library)[library]
    if library == "mujoco":
        assert "refuses the file" in found.failed and "inertia" in found.failed and "\\x0a" not in found.failed
    elif library == "drake":
        assert found.status == 1 and "solid sphere" in found.reasons[0].text and found.said
    else:
        assert found.status == 0


def test_the_command(panda):
    pytest.importorskip("mujoco")
    done = run_ksl("compare", panda, "--with", "mujoco", "--states", "2")
    assert done.returncode == 1 and done.stderr == ""
    assert "inverse dynamics, forward dynamics differ, and each difference is explained" in done.stdout and "damping" in done.stdout
    done = run_ksl("compare", panda, "--with", "mujoco", "--physics", "damping")
    assert done.returncode == 0 and "all numbers agree" in done.stdout


EFFECTS = {
    "actuators": '<actuator><position name="servo" joint="one" kp="20"/></actuator>',
    "gravcomp": "",
    "fluid": "",
    "tendons": '<tendon><fixed name="band" stiffness="3" damping="0.5"><joint joint="one" coef="1"/><joint joint="two" coef="-2"/></fixed></tendon>',
}


@pytest.mark.parametrize("topics", [("actuators",), ("gravcomp",), ("fluid",), ("tendons",), ("gravcomp", "fluid", "actuators")])
def test_forces_that_ksl_never_has_are_reasons(tmp_path, topics):
    pytest.importorskip("mujoco")
    option = '<option viscosity="0.3"/>' if topics == ("fluid",) else '<option density="500" viscosity="0.3"/>' if "fluid" in topics else ""
    gravcomp = 'gravcomp="0.7"' if "gravcomp" in topics else ""
    bodies = f'<body name="a" {gravcomp}><joint name="one" axis="0 1 0"/><geom size="0.1" pos="0.2 0 0"/><body name="b" pos="0.4 0 0"><joint name="two" axis="1 0 0"/><geom size="0.1" pos="0 0.2 0"/></body></body>'
    (tmp_path / "r.xml").write_text(f"<mujoco>{option}<worldbody>{bodies}</worldbody>{''.join(EFFECTS[topic] for topic in topics)}</mujoco>")
    found = ksl.compare(tmp_path / "r.xml", "mujoco", states=3)["mujoco"]
    assert not found.failed and found.unexplained == [] and {r.topic for r in found.reasons} == set(topics), found.reasons
    (tmp_path / "u.xml").write_text(re.sub(r' name="(a|b|servo|band)"', "", (tmp_path / "r.xml").read_text()))
    unnamed = ksl.compare(tmp_path / "u.xml", "mujoco", states=3)["mujoco"]
    named = {"actuators": "actuator0 exert", "gravcomp": "gravity of body1 is", "tendons": "tendon0 exert", "fluid": "bodies move"}
    assert all(any(named[topic] in str(r) for r in unnamed.reasons) for topic in topics), unnamed.reasons
    assert {q.name for q in unnamed.quantities} == {q.name for q in found.quantities} and unnamed.unexplained == []


def test_a_joint_that_pinocchio_lacks_has_no_place_and_no_body(panda):
    """Its number there is that of the next one."""
    pin = pytest.importorskip("pinocchio")
    model = ksl.load(panda, mimic="independent")
    there = LIBRARIES["pinocchio"].load(File(str(panda), panda.read_bytes(), "urdf", model, False, None))
    there.p = pin.Model()
    assert there.place(model.joint("left_joint")) is None and there.bodies() == {}
