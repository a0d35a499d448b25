"""Two planar linkages in space, about axes that lie across the plane: a four-bar and an offset slider-crank; centres of mass are off the plane.

`four_bar` is another one, in its plane."""

import re

import numpy as np

import ksl

INERTIA = '<inertia ixx="0.001" iyy="0.0085" izz="0.008" ixy="0.0002" iyz="-0.0001" izx="0" ixz="0"/>'


def link(name, mass, x):
    return f'<link name="{name}"><inertial><origin xyz="{x} 0.01 0.02"/><mass value="{mass}"/>{INERTIA}</inertial></link>'


def joint(name, parent, child, xyz, kind="continuous", axis="0 -1 0", limit=""):
    return f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/><origin xyz="{xyz}"/><axis xyz="{axis}"/>{limit}</joint>'


def loop(name, parent, at_parent, child, at_child):
    ends = f'<parent link="{parent}"/><parent_origin xyz="{at_parent}"/><parent_axis xyz="0 -1 0"/>'
    return f'<constraint name="{name}" type="continuous">{ends}<child link="{child}"/><child_origin xyz="{at_child}"/><child_axis xyz="0 -1 0"/></constraint>'


LIMIT = '<limit effort="5" velocity="10"/>'
FOURBAR = f"""<robot name="fourbar"><link name="frame"/>{link("crank", 0.6, 0.05)}{link("coupler", 1.1, 0.16)}{link("rocker", 0.9, 0.13)}
{joint("A", "frame", "crank", "0 0 0", limit=LIMIT)}{joint("B", "crank", "coupler", "0.1 0.03 0")}{joint("D", "frame", "rocker", "0.35 0.04 0.04")}
{loop("C", "coupler", "0.32 0.03 0", "rocker", "0.25 0.02 0")}</robot>"""

PIN = '<parent link="crank"/><parent_origin xyz="0.1 0.03 0"/><parent_axis xyz="0 -1 0"/><child link="coupler"/><child_axis xyz="0 -1 0"/>'
FREE = '<joint name="B" type="floating"><parent link="frame"/><child link="coupler"/><origin xyz="0.1 0.03 0"/></joint>'
FREE_COUPLER = re.sub('<joint name="B".*?</joint>', FREE, FOURBAR).replace("</robot>", f'<constraint name="P" type="continuous">{PIN}</constraint></robot>')
"""The same four-bar with a coupler that floats, and a loop joint at either end."""


def smaller(text, factor):
    """A robot file with other lengths."""
    return re.sub('xyz="(?!0 -1 0)([^"]*)"', lambda xyz: f'xyz="{" ".join(str(factor * float(x)) for x in xyz[1].split())}"', text)


SLIDE = '<limit lower="0" upper="1" effort="500" velocity="2"/>'
SLIDERCRANK = f"""<robot name="slidercrank"><link name="frame"/>{link("crank", 0.6, 0.05)}{link("rod", 1.1, 0.12)}{link("slider", 0.9, 0.0)}
{joint("A", "frame", "crank", "0 0 0")}{joint("B", "crank", "rod", "0.1 0.03 0")}{joint("S", "frame", "slider", "0 0.05 0.02", "prismatic", "1 0 0", SLIDE)}
{loop("C", "rod", "0.25 0.03 0", "slider", "0 0.01 0")}</robot>"""


def four_bar(**options):
    at = lambda x: np.array([[1, 0, 0, x], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]])
    b = ksl.Builder("four-bar").add_link("ground")
    for name, mass, length in (("crank", 1.0, 0.2), ("coupler", 2.0, 0.6), ("rocker", 1.5, 0.5)):
        b.add_link(name, mass=mass, center_of_mass=(length / 2, 0, 0), inertia=np.diag([0, 1, 1]) * mass * length**2 / 12)
    for name, parent, child, x in (("A", "ground", "crank", 0), ("B", "crank", "coupler", 0.2), ("D", "ground", "rocker", 0.6)):
        b.add_joint(name, "continuous", parent, child, pose=at(x), axis=(0, 1, 0), **options)
    return b.add_loop("C", "revolute", "coupler", "rocker", at(0.6), at(0.5), axis=(0, 1, 0)).build(drives=["A"])


def at(p, R=None):
    """A pose."""
    return np.vstack([np.column_stack([np.eye(3) if R is None else R, p]), [0, 0, 0, 1]])


def equal_four_bars(loops):
    """Upright rods of 1 m and 1 kg, 1 m apart, joined by others at their ends: equations lose rank where all are on one line."""
    up, rod = np.array([[0, 0, -1], [0, 1, 0], [1, 0, 0.0]]), {"mass": 1.0, "center_of_mass": (0.5, 0, 0), "inertia": np.diag([0, 1, 1]) / 12}
    b = ksl.Builder(f"{loops} four-bars of equal rods").add_link("ground")
    for k in range(loops + 1):
        b.add_link(f"rod{k}", **rod).add_joint(f"rod_{k}", "continuous", "ground", f"rod{k}", pose=at([k, 0, 0], up), axis=(0, 1, 0))
    for k in range(loops):
        b.add_link(f"bar{k}", **rod).add_joint(f"bar_{k}", "continuous", f"rod{k}", f"bar{k}", pose=at([1, 0, 0], up.T), axis=(0, 1, 0))
        b.add_loop(f"end_{k}", "revolute", f"bar{k}", f"rod{k + 1}", at([1, 0, 0]), at([1, 0, 0]), axis=(0, 1, 0))
    return b.build()


def bricard(**options):
    """Five rods of 1 m and 1 kg, 0.1 m square, along the edges of a cube from corner to corner; each hinge is square to both its rods."""
    corner = np.array([[0, 0, 0], [1, 0, 0], [1, -1, 0], [1, -1, 1], [0, -1, 1], [0, 0, 1.0]])
    axis = [np.cross(corner[i] - corner[i - 1], corner[(i + 1) % 6] - corner[i]) for i in range(6)]
    b, parent = ksl.Builder("A04").add_link("ground"), "ground"
    for i in range(5):
        e = corner[i + 1] - corner[i]
        b.add_link(f"rod{i}", mass=1.0, center_of_mass=e / 2, inertia=(1.01 * (np.eye(3) - np.outer(e, e)) + 0.02 * np.outer(e, e)) / 12)
        b.add_joint(f"hinge{i}", "continuous", parent, f"rod{i}", pose=at(corner[0] if i == 0 else corner[i] - corner[i - 1]), axis=axis[i])
        parent = f"rod{i}"
    return b.add_loop("last", "revolute", "rod4", "ground", at(corner[5] - corner[4]), at(corner[5]), axis=axis[5]).build(**options)
