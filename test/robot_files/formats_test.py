"""ksl.load reads a file as what its root element says."""

import pickle
from pathlib import Path

import numpy as np
import pytest

import ksl

SDF = """<sdf version="1.10"><world name="w"><gravity>0 0 -1.62</gravity>
  <model name="ground"><static>true</static><link name="g"/></model>
  <model name="{}">
    <link name="base"><inertial><mass>5</mass><inertia><ixx>1</ixx><iyy>1</iyy><izz>1</izz></inertia></inertial></link>
    <link name="arm"><pose relative_to="base">0 0 1 0 0 0</pose><inertial><mass>2</mass><inertia><ixx>1</ixx><iyy>1</iyy><izz>1</izz></inertia></inertial></link>
    <joint name="shoulder" type="revolute"><parent>base</parent><child>arm</child><axis><xyz>0 1 0</xyz></axis></joint>
  </model>{}</world></sdf>"""


@pytest.fixture
def lander(tmp_path) -> Path:
    path = tmp_path / "lander.robot"  # the name of the file says nothing
    path.write_text(SDF.format("lander", ""))
    return path


def test_an_sdf_file(lander):
    m = ksl.load(lander)
    assert (m.name, m.root, m.joint_names) == ("lander", "world", ["floating_base", "shoulder"])
    assert list(m.gravity) == [0, 0, -1.62]
    assert list(ksl.load(lander, gravity=(0, 0, -9.81)).gravity) == [0, 0, -9.81]
    assert m.frame_pose(np.array([0, 0, 0, 0, 0, 0, 1, 0.0]), "arm")[2, 3] == 1
    assert pickle.loads(pickle.dumps(m)).joints == m.joints
    assert m.unused == ("model ground, static (1)",)


GEARS = """<sdf version="1.10"><model name="bevel gears">
    <link name="box"/>
    <link name="shaft"><inertial><mass>2</mass><inertia><ixx>1</ixx><iyy>1</iyy><izz>0.01</izz></inertia></inertial></link>
    <link name="wheel"><pose>0.3 0 0 0 1.5707963267948966 0</pose>
      <inertial><pose>0 0.1 0 0 0 0</pose><mass>3</mass><inertia><ixx>4</ixx><iyy>4</iyy><izz>5</izz></inertia></inertial></link>
    <joint name="ground" type="fixed"><parent>world</parent><child>box</child></joint>
    <joint name="fast" type="revolute"><parent>box</parent><child>shaft</child><axis><xyz>0 0 1</xyz></axis></joint>
    <joint name="slow" type="revolute"><parent>box</parent><child>wheel</child><axis><xyz>0 0 1</xyz></axis></joint>
    <joint name="gearbox" type="gearbox"><pose relative_to="box"/><parent>shaft</parent><child>wheel</child>
      <gearbox_reference_body>box</gearbox_reference_body><gearbox_ratio>0.04</gearbox_ratio>
      <axis><xyz>0 0 1</xyz></axis><axis2><xyz>1 0 0</xyz></axis2></joint></model></sdf>"""


@pytest.mark.filterwarnings("ignore:link box")
def test_a_gearbox_couples_two_joints(tmp_path):
    """Speeds are in the ratio, backwards, and so the energy; the wheel's weight acts on the shaft by the same ratio."""
    path = tmp_path / "gears.sdf"
    path.write_text(GEARS)
    m = ksl.load(path)
    assert m.nv == 1
    assert m.mass_matrix([0.3])[0, 0] == pytest.approx(0.01 + 0.04**2 * (5 + 3 * 0.1**2), rel=1e-12)
    turn = -0.04 * 0.3  # of the wheel about x; its centre is on y at zero
    assert m.gravity_torque([0.3])[0] == pytest.approx(-0.04 * 3 * 9.81 * 0.1 * np.cos(turn), rel=1e-9, abs=0)
    assert ksl.load(path, mimic="independent").nv == 2


def test_which_model(tmp_path):
    path = tmp_path / "two.sdf"
    path.write_text(SDF.format("one", '<model name="two"><link name="x"/></model>'))
    with pytest.raises(ksl.DescriptionError, match='several models, one, two; say which: .*model="NAME"'):
        ksl.load(path)
    assert ksl.load(path, model="one").nv == 7
    with pytest.warns(ksl.DescriptionWarning, match="link x: no <inertial>, which means 1 kg"):
        assert ksl.load(path, model="two").mass == 1


def test_an_sdf_file_is_written_as_urdf(lander, tmp_path):
    m = ksl.load(lander)
    m.to_urdf(tmp_path / "lander.urdf")
    again = ksl.load(tmp_path / "lander.urdf")
    assert (again.joints, again.links) == (m.joints, m.links)
