"""Noise, stands and contradictions against second programs, sample by sample, as the docstrings describe them."""

import re
from itertools import groupby
from math import comb
from types import SimpleNamespace

import numpy as np
import pytest

import ksl
from ksl.motions.motion import _largest_contradiction
from ksl.motions.signal import noise
from ksl.motions.signal.noise import effort_errors, white_noise
from ksl.motions.signal.standing import _at, _drifts, _in_runs, _inside, _keeps_within, _runs, with_means

SEEDS = pytest.mark.parametrize("seed", range(6))


def runs(chosen):
    """[(first, one behind the last)] of chosen samples in a row."""
    found, k = [], 0
    for value, same in groupby(chosen):
        n = len(list(same))
        found += [(k, k + n)] if value else []
        k += n
    return found


def walk(rng, n):
    """Stands and slow motions after each other, with noise."""
    return np.cumsum(np.repeat(rng.choice([0.0, 0.0, 0.3, -0.05], n // 20 + 1), 20)[:n]) + rng.choice([0.0, 0.2, 0.5]) * rng.normal(size=n)


@SEEDS
def test_samples_that_keep_within_a_width_and_runs_that_drift(seed):
    rng = np.random.default_rng(seed)
    for _ in range(20):
        n = int(rng.integers(8, 120))
        x, width, window = walk(rng, n), 10.0 ** rng.uniform(-1.5, 1), int(rng.integers(2, 9))
        keeps = _keeps_within(x, width, window)
        assert keeps.tolist() == [any(np.ptp(x[j : j + window]) <= width for j in range(max(0, k - window + 1), min(k, n - window) + 1)) for k in range(n)]
        assert [list(pair) for pair in zip(*(edge.tolist() for edge in _runs(keeps)), strict=True)] == [list(pair) for pair in runs(keeps)]
        far = np.zeros(n, dtype=bool)
        for first, last in runs(keeps):
            quarter = (last - first) // 4
            far[first:last] = np.ptp(x[first + quarter : last - quarter]) > width / 2
        assert _drifts(x, keeps, width / 2).tolist() == far.tolist()
        assert _in_runs(*_runs(keeps), n).tolist() == keeps.tolist()


@SEEDS
def test_samples_inside_of_runs(seed):
    """Eight samples, and what a filter blurs, from the ends; but for the ends of the motion itself."""
    rng = np.random.default_rng(seed)
    for _ in range(20):
        n = int(rng.integers(8, 150))
        time, chosen = np.cumsum(rng.uniform(0.5, 1.5, n)), np.repeat(rng.random(n // 10 + 1) < 0.7, 10)[:n]
        blur, inside = float(rng.choice([0.0, 3.3])), np.zeros(n, dtype=bool)
        for first, last in runs(chosen):
            begin = time[min(first + 8, n - 1)] + blur if first else -np.inf
            end = time[max(last - 8, 0)] - blur if last < n else np.inf
            inside[first:last] = (time[first:last] >= begin) & (time[first:last] < end)
        assert _inside(time, chosen, blur).tolist() == inside.tolist()
        at = np.concatenate([time[: n // 2], rng.uniform(time[0] - 1, time[-1] + 1, 30)])
        both = [bool(chosen[max(np.flatnonzero(time <= t), default=0)] and chosen[min(np.flatnonzero(time >= t), default=n - 1)]) for t in at]
        assert _at(at, time, chosen).tolist() == both


def test_means_of_stands():
    """Of a joint of two coordinates behind a body that floats, and of one behind it; the first run begins with the samples, and the last one ends with them."""
    rng = np.random.default_rng(0)
    q, held = rng.normal(size=(60, 10)) + 5.0, np.repeat(rng.random((6, 9)) < 0.5, 10, axis=0)
    held[:, :6], held[:10, 6], held[50:, 7] = False, True, True
    expected = q.copy()
    for c in (6, 7, 8):
        for first, last in runs(held[:, c]):
            expected[first:last, c + 1] = q[first:last, c + 1].mean()
    joints = [SimpleNamespace(q_index=0, v_index=0, nv=6), SimpleNamespace(q_index=7, v_index=6, nv=2), SimpleNamespace(q_index=9, v_index=8, nv=1)]
    assert with_means(q, held, joints) == pytest.approx(expected, rel=1e-13)


def noise_by_hand(t, x, step):
    n = len(t) - 10
    if n < 16:
        return 0.0
    block, found = min(64, n), []
    for start in sorted({int(s) for s in np.linspace(0, n - block, min(200, n // block))}):
        part = slice(start, start + block + 10)
        y = {}
        for order in (8, 10):
            weights = []
            for m in range(block + 10 - order):
                times = t[part][m : m + order + 1]
                w = (
                    np.array([(-1.0) ** k * comb(order, k) for k in range(order + 1)])
                    if np.ptp(np.diff(t[part])) < 1e-9
                    else np.array([1 / np.prod(times[k] - np.delete(times, k)) for k in range(order + 1)])
                )
                weights.append(w / np.linalg.norm(w) @ x[part][m : m + order + 1])
            y[order] = np.abs(weights)
        found.append(
            (
                np.median(y[8]) / 0.6745,
                np.median(y[10]) / 0.6745,
                np.sqrt(np.mean(y[10] ** 2)),
                np.ptp(x[part]) > 0,
                20 * np.finfo(float).eps * np.abs(x[part]).max(),
            )
        )
    flat = [high for low, high, _, moves, rounding in found if high > 0.8 * low and high > rounding and moves]
    moving = sorted(spread for *_, spread, moves, _ in found if moves)
    deviation = np.median(flat) if moving and len(moving) <= 4 * len(flat) else 0.0
    rounded = min(moving[3 * len(moving) // 4], step / np.sqrt(12)) if moving else 0.0
    deviation = max(deviation, rounded if rounded > 0.1 * step else 0.0)
    return deviation if deviation > 20 * np.finfo(float).eps * np.abs(x).max() else 0.0


@SEEDS
def test_white_noise(seed):
    """Of motions that are coarse, noisy in parts, rounded, at even and uneven times."""
    rng = np.random.default_rng(seed)
    for _ in range(12):
        n = int(rng.choice([20, 25, 26, 30, 90, 200, 500]))
        t = np.cumsum(0.01 + rng.choice([0.0, 0.003]) * rng.uniform(-1, 1, n))
        x = np.sin(10.0 ** rng.uniform(-1, 2.3) * t) * rng.choice([0.0, 1.0, 1.0]) + 10.0 ** rng.uniform(-8, -2) * rng.normal(size=n) * (
            np.arange(n) >= rng.choice([0, n // 2, 4 * n // 5])
        )
        step = float(rng.choice([0.0, 10.0 ** rng.uniform(-6, -1)]))
        x = np.round(x / step) * step if step else x
        if rng.random() < 0.3:
            x = np.where(np.arange(n) < 0.7 * n, x[0], x)
        assert white_noise(t, x[:, None], np.array([step])) == pytest.approx([noise_by_hand(t, x, step)], rel=1e-4, abs=1e-30)


@pytest.mark.parametrize(("n", "blocks"), [(20_000, 200), (12_000, 187)])
def test_how_much_of_a_long_motion_is_looked_at_for_noise(monkeypatch, n, blocks):
    """Blocks of 64 samples, 200 at most, from one end to the other."""
    looked = []
    of = noise.normalised_differences
    monkeypatch.setattr(noise, "normalised_differences", lambda time, x, order: (looked.append((time[0], time[-1])), of(time, x, order))[1])
    white_noise(np.arange(n) * 1.0, np.sin(np.arange(n) * 0.1)[:, None], np.zeros(1))
    assert len(looked) == 2 * blocks and {last - first for first, last in looked} == {73} and (looked[0][0], looked[-1][1]) == (0, n - 1)


@pytest.mark.parametrize(("share", "told"), [(0.97, False), (1.03, True)])
def test_what_is_smaller_than_rounding_in_memory_is_no_noise(share, told):
    """Than 20 units in the last place of the largest number, here a single one."""
    x = np.random.default_rng(5).normal(size=2000)
    x[1000] = 1e3
    found = lambda: white_noise(np.arange(2000.0), x[:, None], np.zeros(1))[0]
    x[1000] = found() / (share * 20 * np.finfo(float).eps)
    assert (found() > 0) == told


@SEEDS
def test_contradictions_of_rates(seed):
    """Means over windows, as shares of the largest rate of the vector, from a twentieth on; what is below the floor is none."""
    rng = np.random.default_rng(seed)
    for _ in range(30):
        n, metres = int(rng.choice([6, 9, 24, 300])), np.array([True, True, False, False]) if rng.random() < 0.5 else np.zeros(4, dtype=bool)
        time, found = np.cumsum(rng.uniform(0.5, 1.5, n)), rng.normal(size=(n, 4)) * rng.choice([0.0, 1.0, 5.0], 4)
        found = found * 10.0 ** rng.uniform(-3, 0)
        given = found + 10.0 ** rng.uniform(-3, 0) * rng.normal(size=(n, 4)) + 10.0 ** rng.uniform(-3, 0, 4) * rng.choice([0, 0, 1], 4)
        floor, width = 10.0 ** rng.uniform(-3, 0.5), min(50, max(5, n // 4))
        scale = np.maximum(np.abs(given), np.abs(found)).max(axis=0)
        for vector in (metres, ~metres):
            scale[vector] = scale[vector].max(initial=0.0)
        shares = {}
        for k in range(n - width):
            for c in range(4):
                integral = abs(np.trapezoid((given - found)[k : k + width + 1, c], time[k : k + width + 1]))
                shares[k, c] = integral / (time[k + width] - time[k]) / scale[c] if integral > floor and scale[c] > 0 else 0.0
        (start, c), most = max(shares.items(), key=lambda item: item[1])
        expected = (start + int(np.argmax(np.abs((given - found)[start : start + width + 1, c]))), c) if most > 0.05 else None
        assert _largest_contradiction(time, given, found, metres, floor) == expected


@pytest.mark.parametrize("scale", [1.0, 1e-4])
@pytest.mark.parametrize("weak", [False, True])
def test_errors_of_efforts(examples, scale, weak):
    """Through the mass matrix, at the worst sample; of peaks that are a hundredth of the limit, or a thousandth of the largest, at least."""
    text = (examples / "robots/ur5.urdf").read_text()
    model = ksl.load_string(re.sub(r'effort="[^"]*"', 'effort="0.001"', text) if weak else text)
    rng = np.random.default_rng(2)
    q, v, a = rng.normal(size=(40, 6)), 0.01 * rng.normal(size=(40, 6)), 0.01 * rng.normal(size=(40, 6))
    q, v, a = (x * scale for x in (q, v, a))
    deviation = 10.0 ** rng.uniform(-2, 1, 6) * [1, 0, 1, 1, 0, 1] * scale
    found = effort_errors(model, q, v, a, deviation)
    tau = np.abs(model.inverse_dynamics(q, v, a)).max(axis=0)
    for i, joint in enumerate(model.joints[:6]):
        parts = np.abs(model.mass_matrix(q)[:, i]) * deviation
        sizes = np.sqrt((parts**2).sum(axis=1))
        peak = max(tau[i], 0.01 * joint.effort, sizes.max())
        largest = max(max(tau[j], 0.01 * model.joints[j].effort) for j in range(6))
        assert found.deviation[i] == pytest.approx(sizes.max()) and found.cause[i] == int(np.argmax(parts[np.argmax(sizes)]))
        assert found.peak[i] == pytest.approx(max(peak, 1e-3 * largest)) and found.share[i] == pytest.approx(3 * sizes.max() / max(peak, 1e-3 * largest))
