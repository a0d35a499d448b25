"""ksl.motions.signal.smoothing and resampling: what a filter leaves, the cutoff that it proposes, and samples at other times, in closed form."""

import numpy as np
import pytest
import scipy.signal
from scipy.fft import dst
from scipy.integrate import quad
from scipy.interpolate import CubicSpline

import ksl
from chains import SLIDE
from ksl.base.errors import MotionError
from ksl.motions.signal.resampling import on_spline, resampled
from ksl.motions.signal.smoothing import attenuation, noise_after, smoothed, suitable_cutoff


@pytest.mark.parametrize(("rate", "ok"), [(0.0999, False), (0.1001, True), (2.0, True), (2.001e6, False), (0.0, False), (np.inf, False)])
def test_rates_of_resampling(rate, ok):
    time = np.linspace(3, 13, 11)
    make = lambda: resampled("f", [SLIDE], time, (time**2)[:, None], [[None, None]], rate, str)
    if not ok:
        with pytest.raises(MotionError, match="--resample"):
            make()
        return
    at, q, _, note = make()
    assert at == pytest.approx(3 + np.arange(int(10 * rate + 1e-9) + 1) / rate) and q[:, 0] == pytest.approx(at**2)
    few = lambda n: resampled("f", [SLIDE], time[:n], (time[:n] ** 2)[:, None], [[None, None]], 1.0, str)
    assert len(few(6)[0]) == 6
    with pytest.raises(MotionError, match="f: 5 samples, but resampling needs at least 6"):
        few(5)
    for n, degree in ((2, 1), (3, 1), (4, 3), (5, 3), (6, 5), (9, 5)):
        x = np.arange(n + 0.0) ** np.arange(degree + 1)[:, None]
        between = np.linspace(0, n - 1, 17)
        assert on_spline(np.arange(n + 0.0), x.T, between) == pytest.approx((between ** np.arange(degree + 1)[:, None]).T, abs=1e-8)
        bent = on_spline(np.arange(n + 0.0), np.arange(n + 0.0)[:, None] ** (degree + 1), np.array([0.5]))
        assert n == 2 or abs(bent[0, 0] - 0.5 ** (degree + 1)) > 1e-3, "no higher degree"
    b = (
        ksl.Builder("arm")
        .add_link("a")
        .add_link("b", 1.0, (0, 0, 0), np.eye(3))
        .add_link("c", 1.0, (0, 0, 0), np.eye(3))
        .add_link("d", 1.0, (0, 0, 0), np.eye(3))
    )
    b.add_joint("one", "continuous", "a", "b", axis=(0, 0, 1)).add_joint("ball", "spherical", "b", "c").add_joint("two", "continuous", "c", "d", axis=(0, 0, 1))
    exact = lambda t: np.column_stack([9 + t, np.outer(np.sin(t / 4), [1 / 3, 2 / 3, 2 / 3]), np.cos(t / 4), 7 - t])
    joints, sign = b.build().joints[:3], np.array([1, -1, -1, 1, 1, -1, 1, 1, 1, 1, -1])[:, None]  # quaternions of either sign
    signs = np.hstack([np.ones((11, 1)), np.repeat(sign, 4, axis=1), np.ones((11, 1))])
    now, states, *_ = resampled("f", joints, time, exact(time) * signs, [[None, None]] * 3, 2.0, str)
    assert states == pytest.approx(exact(now), abs=1e-5) and np.linalg.norm(states[:, 1:5], axis=1) == pytest.approx(1, abs=1e-14)
    for off, count in ((-0.4e-6, 11), (-0.6e-6, 10), (0.0, 11), (0.4e-6, 11)):  # a last sample that is missing by less than half a millionth of a step
        assert len(resampled("f", [SLIDE], time, (time**2)[:, None], [[None, None]], 1 + off / 10, str)[0]) == count
    assert note.startswith(f"resampled to {rate:g} Hz ({len(at)} samples) from 11 samples with a median step of 1 s")


def test_what_a_filter_leaves():
    assert attenuation(np.array([0.0, 1, 2, 4]), 2.0) == pytest.approx([1, 1 / (1 + 0.5**8), 0.5, 1 / 257])
    t = np.arange(2001) / 100
    for cutoff, ok in ((49.99, True), (50.0, False), (1.01e-4, True), (0.99e-4, False), (0.0, False)):
        if ok:
            assert np.isfinite(smoothed(t, np.sin(t)[:, None], cutoff)).all()
            continue
        with pytest.raises(MotionError, match="--smooth"):
            smoothed(t, np.sin(t)[:, None], cutoff)
    waves = np.sin(2 * np.pi * t[:, None] * [1, 3])
    assert smoothed(t, waves, 3.0)[200:-200] == pytest.approx(waves[200:-200] * attenuation(np.array([1.0, 3]), 3.0), abs=2e-4)


@pytest.mark.parametrize(("off", "even"), [(0.99e-5, True), (1.01e-5, False)])
def test_steps_that_a_filter_takes_as_even(off, even):
    """To 1e-5 of the mean: others are interpolated first, and back."""
    t = np.arange(200) * 0.01
    t[100:] += off / (1 - off / 199) * 0.01
    x = np.sin(7 * t) + np.cos(61 * t)
    plain = scipy.signal.sosfiltfilt(scipy.signal.butter(4, 9.0, fs=199 / t[-1], output="sos"), x, padtype="odd", padlen=int(np.ceil(3 * 199 / t[-1] / 9.0)))
    assert np.array_equal(smoothed(t, x[:, None], 9.0)[:, 0], plain) == even
    far = 0.01 * np.arange(200) * (1 + np.arange(200) / 500)  # by not-a-knot cubics
    regular = np.linspace(0, far[-1], 200)
    y = scipy.signal.sosfiltfilt(
        scipy.signal.butter(4, 9.0, fs=199 / far[-1], output="sos"), CubicSpline(far, x)(regular), padtype="odd", padlen=int(np.ceil(3 * 199 / far[-1] / 9.0))
    )
    assert smoothed(far, x[:, None], 9.0)[:, 0] == pytest.approx(CubicSpline(regular, y)(far), abs=1e-9)


@pytest.mark.parametrize("derivative", [0, 1, 2])
@pytest.mark.parametrize("cutoff", [3.0, 40.0, 49.0])
def test_noise_behind_a_filter_is_an_integral(cutoff, derivative):
    """Of the spectrum up to half the sampling rate, 100 Hz."""
    power = lambda f: (2 * np.pi * f) ** (2 * derivative) / (1 + (f / cutoff) ** 8) ** 2
    assert noise_after(cutoff, 0.01, derivative) == pytest.approx(np.sqrt(0.02 * quad(power, 0, 50)[0]), rel=1e-5)


@pytest.mark.parametrize("seed", range(27))
def test_a_suitable_cutoff_is_that_of_the_least_error(seed):
    """By a sine transform of its own, and 60 candidates that are tried one by one."""
    rng = np.random.default_rng(seed)
    n, h, noise, weight = (
        400 + 37 * seed if seed < 6 else 9001 if seed < 7 else 9 + seed,
        0.004,
        np.array([1e-4, 3e-5]) * 10.0 ** rng.uniform(-1, 1, 2),
        np.array([2.0, 0.5]),
    )
    t = h * np.arange(n)
    x = np.column_stack([np.sin(2 * np.pi * (1 + seed) * t), 0.3 * np.cos(9 * t)]) * (1 if seed < 7 else 1e-3) + noise * rng.normal(size=(n, 2))
    rest = x - x[0] - np.linspace(0, 1, n)[:, None] * (x[-1] - x[0])
    power = dst(rest[1:-1], type=1, axis=0) ** 2 / (2 * (n - 1))
    power = np.vstack([power, np.zeros((1, 2))])  # the last is zero for any odd continuation
    mean = np.array([power[max(0, k - 4) : k + 5].mean(axis=0) for k in range(len(power))])
    signal = np.where(mean > 3 * noise**2, np.maximum(power - noise**2, 0), 0)
    f = np.arange(1, len(power) + 1) / (2 * t[-1])
    cost = lambda H: np.sum(((1 - H) ** 2)[:, None] * signal * weight**2 * f[:, None] ** 4) + np.sum((H**2 * f**4)[:, None] * noise**2 * weight**2)
    tried = np.geomspace(max(2 * f[0], f[-1] / 1000), 0.8 * f[-1], 60)
    best = tried[np.argmin([cost(1 / (1 + (f / c) ** 8)) for c in tried])]
    assert suitable_cutoff(t, x, noise, weight) == suitable_cutoff(t + 64, x, noise, weight) == float(f"{best:.2g}")
