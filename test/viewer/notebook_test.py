"""What a notebook shows of a model."""

import math
import re
from xml.etree import ElementTree

import ksl
import numpy as np
import pytest


def drawing(m):
    """(lines, circles) of the picture; the whole is well-formed, without script and without references."""
    html = m._repr_html_()
    assert not re.search(r"<script|href=|src=|url\(", html)
    root = ElementTree.fromstring(html)
    return root, list(root.iter("line")), list(root.iter("circle"))


def test_table_and_picture(examples):
    m = ksl.load(examples / "robots/panda.urdf")
    root, lines, circles = drawing(m)
    cells = ["".join(cell.itertext()) for cell in root.iter("td")]
    for joint in m.joints:
        assert joint.name in cells
    assert "2.8973" in cells and "87" in cells, "limits"
    assert [circle.find("title").text for circle in circles] == m.joint_names
    bones = sum(j.parent is not None for j in m.joints)
    assert len(lines) == bones + len(m.joint_names), "a line for each bone and for each axis"


def test_the_picture_is_to_scale():
    """Two bones at a right angle in the plane of the screen's vertical: 3 m up, then 4 m along x, seen under the eye's direction."""
    b = ksl.Builder("<arm>").add_link("base")
    b.add_link("column", 1.0).add_link("boom", 1.0)
    up, along = np.eye(4), np.eye(4)
    up[2, 3], along[0, 3] = 3, 4
    b.add_joint("a", "fixed", "base", "column", pose=up).add_joint("b&c", "fixed", "column", "boom", pose=along)
    root, lines, circles = drawing(b.build())
    assert "<arm>" in "".join(root.itertext()) and not circles
    lengths = sorted(math.hypot(float(e.get("x2")) - float(e.get("x1")), float(e.get("y2")) - float(e.get("y1"))) for e in lines)
    eye = np.array([2.0, -3.0, 1.2]) / np.linalg.norm([2.0, -3.0, 1.2])
    projected = sorted(n * math.sqrt(1 - eye[i] ** 2) for n, i in ((3, 2), (4, 0)))  # what a parallel projection leaves
    assert lengths[1] / lengths[0] == pytest.approx(projected[1] / projected[0], rel=2e-3)


def test_one_link_and_many():
    html = ksl.Builder("stone").add_link("stone", 1.0).build()._repr_html_()
    assert "0 degrees of freedom, 1 link, 1 kg" in html
    b = ksl.Builder("chain").add_link("l0")
    for i in range(1, 100):
        b.add_link(f"l{i}", 1.0).add_joint(f"j{i}", "revolute", f"l{i - 1}", f"l{i}", axis=(0, 1, 0))
    html = b.build()._repr_html_()
    assert "… and 40 more joints" in html and len(html) < 500_000


def test_surfaces(tmp_path):
    """A unit cube is drawn by the two triangles of each of the three sides that the eye sees."""
    path = tmp_path / "cube.urdf"
    path.write_text(
        '<robot name="r"><link name="cube"><visual><geometry><box size="1 1 1"/></geometry><material name="m"><color rgba="1 0 0 1"/></material></visual></link></robot>'
    )
    _, lines, circles = drawing(ksl.load(path))
    surfaces = re.findall(r'points="([^"]*)" fill="#(......)"', ksl.load(path)._repr_html_())
    assert len(surfaces) == 6 and not lines and not circles
    assert all(colour[2:] == "0000" and colour[:2] > "60" for _, colour in surfaces), "red, lighter or darker with the light"
    x, y = np.array([[float(c) for c in point.split(",")] for points, _ in surfaces for point in points.split()]).T
    eye = np.array([2.0, -3.0, 1.2]) / np.linalg.norm([2.0, -3.0, 1.2])
    across = np.array([3.0, 2.0, 0]) / math.hypot(3, 2)
    wide, high = np.abs(across).sum(), np.abs(np.cross(eye, across)).sum()  # of the unit cube's projection
    assert np.ptp(y) / np.ptp(x) == pytest.approx(high / wide, rel=2e-3)


def test_motions_and_verdicts_are_shown_in_short(examples):
    """Not as arrays and lists of all limits."""
    pytest.importorskip("scipy")
    run = ksl.compute_loads(examples / "robots/panda.urdf", examples / "motions/panda_pick.csv")
    assert repr(run.verdict).startswith("<ksl verdict green: panda_joint2 uses 66.1 % of its speed limit") and "not green" not in repr(run.verdict)
    motion = ksl.read_motion(ksl.load(examples / "robots/panda.urdf"), examples / "motions/panda_pick.csv")
    first, *more = repr(motion).splitlines()
    assert first.endswith("panda_pick.csv: 1021 samples, 7 degrees of freedom, 0 s to 4.08 s>") and "differentiated" in more[0]
