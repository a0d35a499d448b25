"""Stiffnesses of components: springs beside each other by levers, classes of gears, interfaces, and what does not fit."""

import numpy as np
import pytest

import ksl
from ksl.mechanism.stiffness import flexibility_of
from ksl.sizing.catalogue.component_stiffness import component_stiffnesses
from ksl.sizing.catalogue.example import example_file

PAIR = """[[component]]
joint = "hinge"
kind = "bearing pair"
[component.locating]
type = "deep groove"
position = {a}
axial_stiffness = 4e7
radial_stiffness = {ka}
[component.floating]
type = "deep groove"
position = {b}
{floating}
"""
GEAR = '[[component]]\njoint = "hinge"\nkind = "strain wave gear"\nK1 = 1e4\nT1 = 10\nK2 = 2e4\n'
FLANGE = """[[component]]
joint = "base"
kind = "bolted flange"
points = [[0.05, 0], [-0.05, 0.05], [-0.05, -0.05]]
at = [0.1, 0.07, 0.2]
normal = [0, 3, 4]
axial_stiffness = 2e9
radial_stiffness = 1e9
tilting_stiffness = 4e6
torsional_stiffness = 3e6
"""


def rod():
    b = ksl.Builder("rod").add_link("wall").add_link("rod", 4.0, (0.5, 0, 0), np.diag([0.01, 0.3, 0.3]))
    return b.add_joint("hinge", "revolute", "wall", "rod", axis=(0, 1, 0)).build()


def written(folder, text):
    (folder / "components.toml").write_text(text)
    return folder / "components.toml"


def test_bearings_that_are_rigid_across_the_axis(tmp_path):
    """At one place they tilt against both stiffnesses; at two places not at all."""
    one = '[[component]]\njoint = "hinge"\nkind = "crossed roller bearing"\nposition = {}\naxial_stiffness = 1e7\ntilting_stiffness = 9e4\n'
    for other, wanted in ((0.02, {"axial": 2e7, "tilting": 1.8e5, "position": 0.02}), (0.05, {"axial": 2e7})):
        assert component_stiffnesses(written(tmp_path, one.format(0.02) + one.format(other)))["hinge"] == wanted


def test_a_pair_of_bearings_by_levers(tmp_path):
    """A force on a beam at x between and beyond two supports: each takes its share by levers, and the beam follows both."""
    m, (a, b, ka, kb) = rod(), (0.02, -0.05, 6e7, 3e7)
    file = written(tmp_path, PAIR.format(a=a, b=b, ka=ka, floating=f"radial_stiffness = {kb}") + GEAR)
    for x in (0.0, 0.3, -0.1):
        tip = np.eye(4)
        tip[1, 3] = x
        C = m.with_frame("tip", "rod", tip).compliance([0.0], "tip", stiffness=file)
        share = (x - b) / (a - b)  # of the force that a carries
        moved = share / ka, (1 - share) / kb  # of the beam at a and b under 1 N
        np.testing.assert_allclose(C[0, 0], moved[1] + (moved[0] - moved[1]) * share, rtol=1e-12)
        np.testing.assert_allclose(abs(C[5, 0]), abs(moved[0] - moved[1]) / (a - b), rtol=1e-12, atol=1e-22)
        np.testing.assert_allclose(C[1, 1], 1 / 4e7, rtol=1e-12)
    weight = 4 * 9.81 * 0.5  # 19.6 N m: the gear's second class
    np.testing.assert_allclose(m.compliance([0.0], "rod", stiffness=file)[4, 4], 1 / 2e4, rtol=1e-12)
    off = m.deflection([0.0], [0.0], [0.0], "rod", stiffness=file)
    np.testing.assert_allclose(off[4], 10 / 1e4 + (weight - 10) / 2e4, rtol=1e-12)


def test_bearings_beside_each_other_are_their_springs_summed(tmp_path):
    crossed = (
        '[[component]]\njoint = "hinge"\nkind = "crossed roller bearing"\nposition = {}\naxial_stiffness = 1e7\nradial_stiffness = {}\ntilting_stiffness = {}\n'
    )
    file = written(tmp_path, "".join(crossed.format(*x) for x in ((0.01, 5e7, 2e4), (-0.03, 2e7, 7e3), (0.06, 1e7, 0.0))))
    K = np.zeros((2, 2))  # of the displacement along z and the rotation about x: the axis is y
    for p, k, tilting in ((0.01, 5e7, 2e4), (-0.03, 2e7, 7e3), (0.06, 1e7, 0.0)):
        K += k * np.outer([1, p], [1, p]) + np.diag([0, tilting])
    C = flexibility_of(rod().joint("hinge"), component_stiffnesses(file)["hinge"]).compliance
    np.testing.assert_allclose(C[np.ix_([2, 3], [2, 3])], np.linalg.inv(K), rtol=1e-12)
    np.testing.assert_allclose(C[1, 1], 1 / 3e7, rtol=1e-12)
    assert not C[4].any(), "the gear's direction"


def test_an_interface_and_the_further_table(tmp_path):
    file = written(tmp_path, FLANGE + "[stiffness.hinge]\nmotion = 5e3\n")
    m = rod()
    C = m.compliance([0.0], "wall", stiffness=file)
    n, at = np.array([0, 0.6, 0.8]), np.array([0.1, 0.07, 0.2])
    force, moment = np.array([3.0, -2.0, 5.0]), np.array([0.3, 0.1, -0.2])
    about = moment - np.cross(at, force)  # at the interface's middle
    turned = n * (n @ about) / 3e6 + (about - n * (n @ about)) / 4e6
    moved = n * (n @ force) / 2e9 + (force - n * (n @ force)) / 1e9 + np.cross(at, turned)
    np.testing.assert_allclose(C @ [*force, *moment], [*moved, *turned], rtol=1e-11, atol=1e-22)
    assert set(m.modes([0.0], file).joints) == {"base", "hinge"}
    np.testing.assert_array_equal(m.with_stiffness(file).modes([0.0]).frequencies, m.modes([0.0], file).frequencies)
    np.testing.assert_array_equal(ksl.frequencies(m, stiffness=file, count=3).frequencies[0], m.modes([0.0], file).frequencies[:3])


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (GEAR.replace("K2", "K3"), "its stiffness has K1; or K1, T1 and K2"),
        (GEAR.replace("T1 = 10\n", ""), "its stiffness has K1; or K1, T1 and K2"),
        (GEAR.replace("1e4", "-1e4"), "components.toml:4: K1 = -10000.0 must be positive"),
        (GEAR * 2, "joint hinge: motion: two components give a stiffness there; give it in a table"),
        (PAIR.format(a=0.1, b=0, ka=1e7, floating=""), "radial stiffnesses are given of some bearings of joint hinge, and not of others"),
        (
            PAIR.format(a=0.1, b=0, ka=1e7, floating="radial_stiffness = 1e7\naxial_stiffness = 1e7"),
            "axial_stiffness of the floating bearing, which moves along the axis",
        ),
        (GEAR + "[stiffness.hinge]\nmotion = 3.0\n", "is given by a component and in"),
        (GEAR + "[stiffness]\nhinge = 3.0\n", "is given by a component and in"),
        ('[[component]]\njoint = "hinge"\nkind = "planetary gear"\nratio = 3\n', "no component in it has a stiffness"),
        (FLANGE + 'on = "parent"\n', "stiffnesses are those on the child's side"),
        (FLANGE.replace('"base"', '"hinge"'), "stiffness of joint hinge: axis is for joints without an axis, and hinge has one; give position"),
        ("[stiffness.hing]\nmotion = 3.0\n", "'hing'"),
        ("stiffness = 3\n[[component]]\n", "stiffness must be a table"),
    ],
)
def test_what_does_not_fit(tmp_path, text, said):
    file = written(tmp_path, text)
    with pytest.raises(ValueError, match=r"components.toml") as caught:
        rod().modes([0.0], file)
    assert said in str(caught.value)


def test_the_example_has_them_commented_out(tmp_path):
    text = example_file("hinge")
    assert "# K1 = 1.2e4" in text and "# axial_stiffness = 4e7" in text
    with pytest.raises(ksl.SizingError, match="no component in it has a stiffness"):
        component_stiffnesses(written(tmp_path, text))
    assert component_stiffnesses(written(tmp_path, text.replace("# K1 = ", "K1 = ")))["hinge"] == {"motion": 1.2e4}
