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
