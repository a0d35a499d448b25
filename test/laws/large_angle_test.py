"""Angles of any size: a pendulum, whose effort is the cosine of its angle times a constant."""

import mpmath
import numpy as np
import pytest

from random_tree import load_text

GRAVITY, MASS, LENGTH = 9.81, 1.0, 1.0
ANGLES = [1e16, -1e16, 2.5e15, 3e15 + 1, 1.7e16, 1e22, 5.319372648326541e255, 1.7976931348623157e308, 0.5, 262144.5]
"""Among them the double that lies nearest to a multiple of π/2."""

PENDULUM = f"""<robot name="pendulum"><link name="ceiling"/>
  <link name="rod"><inertial><origin xyz="{LENGTH} 0 0"/><mass value="{MASS}"/><inertia ixx="0" iyy="0" izz="0" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="pivot" type="continuous"><parent link="ceiling"/><child link="rod"/><axis xyz="0 1 0"/></joint></robot>"""


def exact_effort(angle) -> float:
    """The effort that holds the rod: −m g l cos q about y, which points it down."""
    with mpmath.workprec(1300):
        return float(-mpmath.mpf(MASS) * mpmath.mpf(GRAVITY) * LENGTH * mpmath.cos(mpmath.mpf(float(angle))))


def test_the_witness_by_hand():
    assert exact_effort(0) == -9.81
    assert exact_effort(1e16) == pytest.approx(6.1427, abs=5e-5)


@pytest.mark.parametrize("angle", ANGLES)
def test_one_state(angle):
    m = load_text(PENDULUM)
    assert m.inverse_dynamics([angle], [0.0], [0.0]) == pytest.approx([exact_effort(angle)], rel=1e-14, abs=2e-15)


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_a_batch(dtype):
    m = load_text(PENDULUM)
    with np.errstate(over="ignore"):
        q = np.array(ANGLES, dtype)
    q = q[np.isfinite(q), None]
    eps = np.finfo(dtype).eps
    zero = np.zeros_like(q)
    expected = [[exact_effort(angle)] for (angle,) in q]
    np.testing.assert_allclose(m.inverse_dynamics(q, zero, zero), expected, rtol=10 * eps, atol=10 * eps)


def test_a_prismatic_joint_far_out_is_no_angle():
    """Positions of prismatic joints pass through the same lanes as angles."""
    slider = PENDULUM.replace(
        "</robot>",
        '<link name="weight"><inertial><mass value="2"/><inertia ixx="0" iyy="0" izz="0" ixy="0" ixz="0" iyz="0"/></inertial></link>'
        '<joint name="slide" type="prismatic"><parent link="ceiling"/><child link="weight"/><axis xyz="0 0 1"/>'
        '<limit effort="1" velocity="1"/></joint></robot>',
    )
    m = load_text(slider)
    pivot, slide = m.joint_names.index("pivot"), m.joint_names.index("slide")
    for position in (1e20, -1e300, 3e5):
        q, zero = np.zeros(2), np.zeros(2)
        q[[pivot, slide]] = 0.5, position
        tau = m.inverse_dynamics(q, zero, zero)
        assert tau[pivot] == pytest.approx(exact_effort(0.5), rel=1e-15) and tau[slide] == pytest.approx(2 * GRAVITY, rel=1e-15)
