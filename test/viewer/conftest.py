"""The robot of the tests of the viewer."""

import math

import numpy as np
import pytest

ARM = """<robot name="arm">
  <material name="red"><color rgba="1 0 0 1"/></material>
  <link name="ground"/>
  <link name="upper">
    <inertial><origin xyz="0.5 0 0"/><mass value="2"/><inertia ixx="0.01" iyy="0.2" izz="0.2" ixy="0" ixz="0" iyz="0"/></inertial>
    <visual><origin xyz="0.5 0 0"/><geometry><box size="1 0.1 0.1"/></geometry><material name="red"/></visual>
  </link>
  <link name="lower">
    <inertial><origin xyz="0.3 0 0"/><mass value="1"/><inertia ixx="0.01" iyy="0.05" izz="0.05" ixy="0" ixz="0" iyz="0"/></inertial>
    <visual><origin xyz="0.3 0 0" rpy="0 1.5707963267948966 0"/><geometry><cylinder radius="0.04" length="0.6"/></geometry></visual>
  </link>
  <link name="hand"/>
  <joint name="shoulder" type="revolute"><parent link="ground"/><child link="upper"/><axis xyz="0 -1 0"/><limit lower="-2" upper="2" effort="50" velocity="5"/></joint>
  <joint name="elbow" type="revolute">
    <parent link="upper"/><child link="lower"/><origin xyz="1 0 0"/><axis xyz="0 -1 0"/><limit lower="-2.5" upper="2.5" effort="10" velocity="5"/>
  </joint>
  <joint name="wrist" type="fixed"><parent link="lower"/><child link="hand"/><origin xyz="0.6 0 0"/></joint>
</robot>
"""
"""Two links in a vertical plane, 1 m and 0.6 m long, 2 kg and 1 kg with centroids at their middles; positive angles lift."""


@pytest.fixture(scope="session")
def arm(tmp_path_factory):
    import ksl

    path = tmp_path_factory.mktemp("arm") / "arm.urdf"
    path.write_text(ARM)
    return ksl.load(path)


@pytest.fixture(scope="session")
def swing():
    """A motion of the arm: time (n), q, v, a (n, 2)."""
    t = np.linspace(0.0, 2.0, 201)
    phase = math.pi * t[:, None] + [0.0, 1.0]
    size = np.array([0.8, 0.5])
    return t, size * np.sin(phase), size * math.pi * np.cos(phase), -size * math.pi**2 * np.sin(phase)
