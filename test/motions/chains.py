"""Chains of joints with limits, for tests of motions."""

import numpy as np

import ksl
from ksl.mechanism.mechanism import Joint

SLIDE = Joint("slide", "prismatic", "a", "b", 1, 1, 0, 0, (0.0, 0.0, 1.0), has_axis=True, has_angle=False)
MASS = '<inertial><origin xyz="0.3 0 0"/><mass value="2"/><inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial>'


def robot_of(robot, *joints):
    """A chain of joints: (name, kind, limits)."""
    links = "".join(f'<link name="l{k}">{MASS}</link>' for k in range(1, len(joints) + 1))
    moved = "".join(
        f'<joint name="{name}" type="{kind}"><parent link="l{k}"/><child link="l{k + 1}"/><origin xyz="0.5 0 0"/><axis xyz="0 0 1"/>{limits}</joint>'
        for k, (name, kind, limits) in enumerate(joints)
    )
    return robot(f'<robot name="r"><link name="l0"/>{links}{moved}</robot>')


def limit(lower, upper, velocity=2, effort=100):
    return f'<limit lower="{lower}" upper="{upper}" velocity="{velocity}" effort="{effort}"/>'


def one_sided_joints():
    for both in ((-1, None), (None, 1)):
        b = ksl.Builder("a").add_link("l0").add_link("l1", 1.0, (0, 0, 0.1), 0.1 * np.eye(3))
        yield b.add_joint("p", "revolute", "l0", "l1", axis=(1, 0, 0), limits=both).build()
