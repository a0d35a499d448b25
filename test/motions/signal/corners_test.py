"""ksl.motions.signal.corners: jumps of acceleration are found where they are, and nowhere else; splines through the rest don't overshoot."""

import numpy as np
import pytest
from scipy.interpolate import make_interp_spline

import ksl
from ksl.load_cases.curves import Curves
from ksl.load_cases.load_case import LoadCase
from ksl.motions.motion import complete
from ksl.motions.reading import read_motion
from ksl.motions.signal.corners import Jumps, find_jumps, jumps_at
from ksl.motions.signal.rates import derivative, rates_beside_corners
from ksl.motions.signal.resampling import resampled

CORNERS = np.array([0.1, 0.35, 0.65, 0.9])
INERTIA, ACCELERATION = 0.52, 10.0

DISK = f"""<robot name="disk"><link name="ground"/><link name="disk"><inertial><mass value="2"/>
<inertia ixx="1" iyy="1" izz="{INERTIA}" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="j" type="revolute"><parent link="ground"/><child link="disk"/><axis xyz="0 0 1"/>
<limit lower="-9" upper="9" effort="9" velocity="9"/></joint></robot>"""


def trapezoid(t, order=0):
    """A trapezoid of velocity and its derivatives, in closed form; to the right of the corners where they jump."""
    power = lambda u: np.where(u >= 0, u ** (2 - order), 0.0)
    signs = ACCELERATION * np.array([1, -1, -1, 1]) / (2 if order == 0 else 1)
    return sum(s * power(t - c) for s, c in zip(signs, CORNERS))


def times(step, start=0.0):
    return np.arange(round(1.1 / step)) * step + start


@pytest.fixture
def disk(robot) -> ksl.Model:
    return robot(DISK)


@pytest.mark.parametrize("start", [0.0, 0.00123])
@pytest.mark.parametrize("step", [1e-4, 1e-3, 0.0037, 4e-3, 0.00931, 0.01, 0.02])
def test_a_trapezoid_of_velocity_has_the_torque_of_the_closed_form(disk, step, start):
    """0.52 kg m² · 10 rad/s² = 5.20 N m at any step, whether samples are at the corners or not: the plain spline gives up to 5.7."""
    t = times(step, start)
    m = complete(disk, t, trapezoid(t)[:, None], [[None, None]])
    assert m.corner_times == pytest.approx(CORNERS, abs=1e-6 * step)
    away = np.abs(t[:, None] - CORNERS).min(axis=1) > 1e-6 * step
    assert m.v[:, 0] == pytest.approx(trapezoid(t, 1), abs=1e-9)
    assert m.a[away, 0] == pytest.approx(trapezoid(t, 2)[away], abs=1e-5)
    torque = disk.inverse_dynamics(m.q, m.v, m.a)
    assert np.abs(torque).max() == pytest.approx(5.20, rel=1e-6)
    assert np.abs(make_interp_spline(t, trapezoid(t), k=5)(t, nu=2)).max() > 1.02 * ACCELERATION  # what it was
    assert any("jump 4 times, first at 0.1 s" in line for line in m.differentiated) and m.doubts == []


@pytest.mark.parametrize("digits", [6, 9])
def test_a_trapezoid_that_was_rounded(disk, digits):
    t = times(4e-3, 0.00123)
    m = complete(disk, t, np.round(trapezoid(t), digits)[:, None], [[None, None]])
    assert len(m.corner_times) == 4
    assert np.abs(m.a).max() == pytest.approx(ACCELERATION, rel=0.02 if digits == 6 else 1e-4)


def test_power_is_balanced_across_corners(disk):
    """The energy's rate jumps with the acceleration: its spline is split at the same times."""
    t = times(0.0037)
    case = LoadCase(disk, complete(disk, t, trapezoid(t)[:, None], [[None, None]]))
    curves = Curves(case)
    for block in case.blocks():
        curves.add(block)
    balance = curves.power_balance()
    exact = INERTIA * trapezoid(t, 1) * trapezoid(t, 2)
    away = np.abs(t[:, None] - CORNERS).min(axis=1) > 1e-9
    assert balance.energy_rate[away] == pytest.approx(exact[away], abs=1e-6)
    assert balance.relative_residual < 1e-8


def test_accelerations_given_velocities(disk):
    """The first derivative of the velocity jumps."""
    t = times(0.0037, 0.0005)
    m = complete(disk, t, trapezoid(t)[:, None], [[trapezoid(t, 1)[:, None], None]])
    assert m.corner_times == pytest.approx(CORNERS, abs=1e-8)
    assert m.a[:, 0] == pytest.approx(trapezoid(t, 2), abs=1e-6)


def test_a_jump_within_a_curved_motion():
    """sin t, and 4 rad/s² more from 1.003 s on: the jump is found to the order of the step, and converges."""
    for step, bound in ((0.01, 0.03), (0.0025, 0.001)):
        t = np.arange(0, 3, step)
        x = np.sin(t) + np.where(t > 1.003, 2 * (t - 1.003) ** 2, 0)
        (found,) = find_jumps(t, x[:, None])
        assert found.jumps.times == pytest.approx([1.003], abs=1e-3 * step / 0.01) and found.jumps.sizes == pytest.approx([4], rel=bound)


SMOOTH = {
    "sines": lambda t, T, k: np.sin(2 * np.pi * k * t / T) + 0.3 * np.sin(2 * np.pi * 2.3 * k * t / T + 1),
    "minimum jerk": lambda t, T, k: (lambda u: 10 * u**3 - 15 * u**4 + 6 * u**5)(np.clip((t - 0.2 * T) / (0.15 * k * T), 0, 1)),
    "bell": lambda t, T, k: np.exp(-(((t - T / 2) / (0.06 * k * T)) ** 2)),
    "ramp that is smooth": lambda t, T, k: np.tanh((t - T / 2) / (0.06 * k * T)),
}


@pytest.mark.parametrize("kind", SMOOTH)
@pytest.mark.parametrize("n", [120, 500, 4000])
def test_no_corners_in_smooth_motions(kind, n):
    """Also rounded, noisy, or at uneven times.  Where none is found, derivatives have the bits of the plain spline."""
    rng = np.random.default_rng(n)
    for step in (1e-4, 1e-3, 0.004, 0.05):
        t = np.arange(n) * step
        x = np.column_stack([SMOOTH[kind](t, t[-1], k) for k in (1.0, 2.0, 3.5)])
        uneven = t + rng.uniform(-0.2, 0.2, n) * step
        y = np.column_stack([SMOOTH[kind](uneven, t[-1], k) for k in (1.0, 2.0, 3.5)])
        variants = {"as it is": (t, x), "uneven": (uneven, y), "noisy": (t, x + 1e-5 * rng.normal(size=x.shape)), "9 digits": (t, np.round(x, 9))}
        for name, (at, z) in variants.items():
            found = find_jumps(at, z, 2, np.full(3, 1e-9 if name == "9 digits" else 0.0))
            assert not any(len(f.jumps.times) or f.impossible for f in found), (kind, name, step)


def test_bits_of_smooth_motions_are_those_of_the_plain_spline(examples):
    model = ksl.load(examples / "robots/ur5.urdf")
    t = np.arange(400) * 0.004
    q = 0.5 * np.sin(t[:, None] * np.arange(1, 7))
    m = complete(model, t, q, [[None, None]] * 6)
    spline = make_interp_spline(t, q, k=5)
    assert np.array_equal(m.v, spline(t, nu=1)) and np.array_equal(m.a, spline(t, nu=2)) and not len(m.corner_times)


def doubts(disk, t, x):
    return complete(disk, t, x[:, None], [[None, None]]).doubts


def test_jumps_that_no_force_can_cause_are_said(disk):
    t = np.arange(750) * 0.004
    (ramp,) = doubts(disk, t, np.clip(t - 0.9, 0, 1) * 0.5)
    assert ramp.startswith("the rate of j jumps by 0.5 at 0.9 s (2 such jumps), which no force can do")
    (step,) = doubts(disk, t, (t > 1.5) * 0.2 + 0.1 * np.sin(t))
    assert step.startswith("j jumps by 0.2 at 1.502 s, which no force can do")
    (off,) = doubts(disk, t, np.sin(t) + 0.01 * (np.arange(750) == 300))
    assert off.startswith("the sample of j at 1.2 s is 0.01 off those around it")
    turning = 3 * np.sin(t) + 1.5
    (wrapped,) = doubts(disk, t, (turning + np.pi) % (2 * np.pi) - np.pi)
    assert "a full turn. Unwrap the angle" in wrapped
    triangle = np.where(np.clip(t - 0.9, 0, 1) < 0.5, 2 * np.clip(t - 0.9, 0, 1) ** 2, 1 - 2 * (1 - np.clip(t - 0.9, 0, 1)) ** 2)
    assert doubts(disk, t, triangle) == []  # its acceleration jumps, and that can be


def test_jumps_as_polynomials():
    """Σ J (t − τ)²/2 and its derivatives, against the sum."""
    rng = np.random.default_rng(0)
    t, tau, J = np.linspace(0, 5, 400), np.sort(rng.uniform(0, 5, 9)), rng.normal(size=9)
    since = np.maximum(t[:, None] - tau, 0)
    for order in (0, 1, 2):
        for nu in range(order + 1):
            power = order - nu
            expected = (J * (since**power if power else (t[:, None] >= tau)) / max(power, 1)).sum(axis=1)
            assert Jumps(order, tau, J)(t, nu) == pytest.approx(expected, abs=1e-12)


def test_derivative_of_a_curve_that_is_split_at_known_times():
    t = np.linspace(0, 2, 201)
    x = np.cos(t) + np.where(t > 0.7031, 3 * (t - 0.7031) - (t - 0.7031) ** 2, 0)
    exact = -np.sin(t) + np.where(t > 0.7031, 3 - 2 * (t - 0.7031), 0)
    before, after = rates_beside_corners(t, x, np.array([0.7031]))
    assert before == pytest.approx(exact, abs=1e-5) and np.array_equal(before, after)
    at_sample = np.cos(t) + np.where(t > t[70], 3 * (t - t[70]), 0)
    before, after = rates_beside_corners(t, at_sample, t[70:71])
    assert (after - before)[70] == pytest.approx(3, abs=1e-5) and after[70] == pytest.approx(3 - np.sin(t[70]), abs=1e-5)
    assert np.abs(derivative(t, x) - exact).max() > 0.1
    slope, curvature = jumps_at(t, x, np.array([0.7031]))
    assert slope.sizes == pytest.approx([3], abs=1e-5) and curvature.sizes == pytest.approx([-2], abs=1e-3)


def test_derivative_of_a_curve_that_jumps():
    """A sample at a jump is before it; of five samples between two jumps nothing is told."""
    t = np.linspace(0, 2, 201)
    x = np.cos(t) + 2.0 * (t > t[70]) - np.where(t > 1.5005, 1 + 3 * (t - 1.5005), 0) + (t > 1.5451)
    before, after = rates_beside_corners(t, x, np.array([0.3]), np.array([t[70], 1.5005, 1.5451]))
    exact = np.where(t > 1.5005, -3 - np.sin(t), -np.sin(t))
    assert np.flatnonzero(np.isnan(after)).tolist() == [151, 152, 153, 154]
    assert np.nanmax(np.abs(after - exact)) < 1e-5 and np.nanmax(np.abs(before - exact)) < 1e-5


@pytest.mark.parametrize("corners", [[0.405, 0.4051, 0.42], np.arange(0.1, 1.9, 0.0703)], ids=["close", "many"])
def test_corners_that_are_close_or_many_end_splines(corners):
    """What lies between two of them is told where it has six samples; a sample at a corner is on both sides."""
    t = np.linspace(0, 2, 401)
    corners = np.where(np.isin(corners, 0.42), t[84], corners)
    x = np.cos(t) + sum(3 * np.maximum(t - c, 0) for c in corners)
    exact = lambda at: -np.sin(t) + 3 * sum(at(c) for c in corners)
    before, after = rates_beside_corners(t, x, corners)
    told = np.isfinite(after) & np.isfinite(before)
    assert np.flatnonzero(~told).tolist() == ([81, 82, 83, 84] if len(corners) == 3 else [])
    assert np.abs(before - exact(lambda c: t > c))[told].max() < 1e-6 and np.abs(after - exact(lambda c: t >= c))[told].max() < 1e-6


@pytest.mark.parametrize(("n", "corner"), [(6, 2.5), (7, 3.0), (5, 2.5)])
def test_quadratics_on_both_sides_of_a_corner(n, corner):
    """Six samples are enough, three on each side; one at the corner is on both."""
    t = np.arange(n) * 1.0
    x = 0.5 * t + np.maximum(t - corner, 0) + np.maximum(t - corner, 0) ** 2
    before, after = rates_beside_corners(t, x, np.array([corner]))
    if n == 5:
        assert np.isnan(before).all() and np.isnan(after).all()
        return
    rate = lambda on: 0.5 + np.where(on, 1 + 2 * (t - corner), 0)
    assert before == pytest.approx(rate(t > corner)) and after == pytest.approx(rate(t >= corner))


@pytest.mark.parametrize("second", [10.0, 9.0])
def test_six_samples_between_corners_that_are_close(second):
    """Both ends count, which are at corners; of five nothing is told."""
    t = np.arange(16.0)
    before, after = rates_beside_corners(t, np.abs(t - 5) + 3 * np.abs(t - second), np.array([5.0, second]))
    expected = [np.where(t > 5, 1.0, -1.0) + np.where(t > second, 3.0, -3.0), np.where(t >= 5, 1.0, -1.0) + np.where(t >= second, 3.0, -3.0)]
    if second == 9.0:
        expected[0][6:10] = expected[1][5:9] = np.nan
    assert before == pytest.approx(expected[0], nan_ok=True) and after == pytest.approx(expected[1], nan_ok=True)


def test_resampling_keeps_corners(disk, tmp_path):
    """From 10 ms to 3 ms: positions are those of the closed form, and so is the acceleration."""
    t = times(0.01, 0.0021)
    path = tmp_path / "motion.csv"
    np.savetxt(path, np.column_stack([t, trapezoid(t)]), delimiter=",", header="time,j", comments="", fmt="%.15g")
    m = read_motion(disk, path, resample=1 / 0.003)
    assert m.q[:, 0] == pytest.approx(trapezoid(m.time), abs=1e-9)
    assert np.abs(m.a).max() == pytest.approx(ACCELERATION, rel=1e-4)


def test_resampling_keeps_corners_of_velocities(disk):
    """Those that are given; accelerations are as they are between samples."""
    t, tau = np.arange(200) * 0.01, 0.7033
    v, a = np.maximum(t - tau, 0)[:, None], np.sin(t)[:, None]
    at, _, ((found_v, found_a),), _ = resampled("m", disk.joints[:1], t, v**2 / 2, [[v, a]], 300.0, str)
    assert found_v[:, 0] == pytest.approx(np.maximum(at - tau, 0), abs=1e-9) and found_a[:, 0] == pytest.approx(np.sin(at), abs=1e-9)


def test_noise_is_looked_for_before_resampling(examples, tmp_path):
    model = ksl.load(examples / "robots/ur5.urdf")
    lines = (examples / "motions/ur5_pick.csv").read_text().splitlines()
    rounded = [line.split(",")[:1] + [f"{float(x):.3f}" for x in line.split(",")[1:]] for line in lines[1:]]
    path = tmp_path / "pick.csv"
    path.write_text("\n".join([lines[0], *map(",".join, rounded)]) + "\n")
    (doubt,) = [d for d in read_motion(model, path, resample=1000).doubts if "rounded" in d]
    assert "rounded to 0.001 rad" in doubt and "--smooth 4" in doubt
    assert read_motion(model, path, resample=1000, smooth=4.5).doubts == []
