"""Gears in classes of torque: slopes, twists, and what calls make of them."""

import numpy as np
import pytest

import ksl
from ksl.mechanism.gear_classes import along_motion

GEAR = {"stiffness": [1e4, 2e4, 4e4], "effort": [10.0, 30.0]}


def test_slopes_and_twists_by_hand():
    assert [along_motion("", GEAR, T, "slope") for T in (0.0, -9.0, 10.0, 20.0, -31.0)] == [1e4, 1e4, 1e4, 2e4, 4e4]
    for T, twist in ((0.5, 0.5e-4), (-20.0, 10 / 1e4 + 10 / 2e4), (50.0, 10 / 1e4 + 20 / 2e4 + 20 / 4e4)):
        np.testing.assert_allclose(along_motion("", GEAR, T, "twist"), abs(T) / twist, rtol=1e-15)
    assert along_motion("", 5.0, 99.0, "twist") == 5.0


def test_calls_take_them_at_their_loads():
    b = ksl.Builder("rod").add_link("wall").add_link("rod", 4.0, (0.5, 0, 0), np.diag([0.01, 0.3, 0.3]))
    m = b.add_joint("hinge", "revolute", "wall", "rod", axis=(0, 1, 0)).build()
    given, torque = {"hinge": {"motion": GEAR}}, 4 * 9.81 * 0.5  # 19.62 N m: the second class
    np.testing.assert_allclose(m.modes([0.0], stiffness=given).frequencies, np.sqrt(2e4 / (0.3 + 4 * 0.25)) / (2 * np.pi), rtol=1e-12)
    np.testing.assert_allclose(m.modes([0.0], stiffness=given, gravity=False).frequencies, np.sqrt(1e4 / 1.3) / (2 * np.pi), rtol=1e-12)
    np.testing.assert_allclose(m.compliance([0.0], "rod", stiffness=given)[4, 4], 1 / 2e4, rtol=1e-12)
    off = m.deflection(np.zeros((2, 1)), np.zeros((2, 1)), [[0.0], [20.0]], "rod", stiffness=given)
    lifted = torque - 20.0 * 1.3  # turning down eases the load: −6.38 N m
    np.testing.assert_allclose(off[:, 4], [10 / 1e4 + (torque - 10) / 2e4, lifted / 1e4], rtol=1e-12)
    np.testing.assert_allclose(m.with_stiffness(given).compliance([0.0], "rod")[4, 4], 1e-4, rtol=1e-12)


@pytest.mark.parametrize(
    "gear", [{"stiffness": [1.0, 2.0], "effort": []}, {"stiffness": [1.0, 0.0], "effort": [3.0]}, {"stiffness": [1, 2, 3], "effort": [3, 2]}, {"effort": [1.0]}]
)
def test_classes_that_do_not_fit(gear):
    with pytest.raises(ValueError, match="^J: motion has stiffness .* and effort .*; expected stiffness = "):
        along_motion("J", gear, 0.0, "slope")
    with pytest.raises(ValueError, match="J: motion has key='torque'; expected one of"):
        along_motion("J", {"torque": [1.0]}, 0.0, "slope")
