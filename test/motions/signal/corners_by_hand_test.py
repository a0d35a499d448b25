"""ksl.motions.signal.corners against a second program: sample by sample and gap by gap, with NumPy's fits of polynomials, as the docstrings describe it."""

from math import factorial

import numpy as np
import pytest
from numpy.polynomial import polynomial

from ksl.motions.signal.corners import _candidates, _off_at_the_ends, _tested, find_jumps, noise_of_jumps

NOISE = {3: np.sqrt([167 / 16, 28, 12]), 4: np.sqrt([729 / 32, 8525 / 72, 162, 40])}
"""Of jumps of derivatives 0 … between polynomials through three or four samples on each side, for white noise of 1 and steps of 1."""


def side(t, x, samples, at):
    """Derivatives at a time of the polynomial through these samples."""
    scale = t[samples[-1]] - t[samples[0]]
    c = polynomial.polyfit((t[samples] - at) / scale, x[samples], len(samples) - 1)
    return np.array([factorial(k) * c[k] / scale**k for k in range(len(c))])


def taylor(d, s):
    return sum(d[k] * s**k / factorial(k) for k in range(len(d)))


def candidates(t, x, step):
    """Gaps around which fourth differences stand out, {gap: the noise there}, and the step of rounding."""
    n = len(t)
    even = np.abs(np.diff(t) - (t[-1] - t[0]) / (n - 1)).max() <= 1e-3 * (t[-1] - t[0]) / (n - 1)
    size = []
    for m in range(n - 4):
        w = np.array([1.0, -4, 6, -4, 1]) if even else np.array([1 / np.prod([t[m + j] - t[m + i] for i in range(5) if i != j]) for j in range(5)])
        size.append(abs(w @ x[m : m + 5]) / np.linalg.norm(w))
    size, block = np.array(size), min(32, max(8, (n - 4) // 2), n - 4)
    blocks = max(1, (n - 4) // block)
    level = [np.sort(size[k * block : (k + 1) * block])[block // 4] / 0.3186 for k in range(blocks)]
    every = max(1, (n - 4) // 2000)
    moves = [m for m in range(0, n - 4, every) if x[m + 4] != x[m]]
    rounded = step if sum(size[m] > 0.1 * step for m in moves) > 0.25 * len(moves) else 0.0
    least = max(sorted(level)[blocks // 4], 4 * np.finfo(float).eps * np.abs(x).max(), rounded / np.sqrt(12))
    wide = [max(least, *level[max(k - 1, 0) : k + 2]) for k in range(blocks)]
    of = lambda m: wide[min(max(m, 0) // block, blocks - 1)]
    gaps = sorted({m + k for m in range(n - 4) if size[m] > 3 * of(m) for k in range(4)})
    return {g: of(g - 2) for g in gaps}, rounded, (of(0), of(n - 4))


def at_the_ends(t, x, noise):
    inside = x[4:-4]
    if len(inside) < 3:
        return []
    bends, longest, found = 3 * np.abs(np.diff(inside, 2)).max(), 1.5 * np.abs(np.diff(inside)).max(), []
    for of_end, samples in zip(noise, (np.arange(8), len(t) - 1 - np.arange(8)), strict=True):
        y, off = x.copy(), {}
        for k in (3, 2, 1, 0):
            size = y[samples[k]] - side(t, y, samples[k + 1 : k + 5], t[samples[k]])[0]
            if abs(size) > max(bends, 20 * np.sqrt(70) * of_end):
                y[samples[k]] -= size
                off[k] = size
        sizes = [abs(s) for s in off.values()]
        whole = len(off) > 1 and sorted(off) == list(range(len(off)))
        if not off or max(sizes) <= longest or (whole and min(np.diff(sizes)) > 0.1 * sizes[0]):
            continue
        if whole and max(sizes) - min(sizes) < 0.1 * sizes[0]:
            last, sign = len(off) - 1, 1 if samples[0] == 0 else -1
            found.append((0, (t[samples[last]] + t[samples[last + 1]]) / 2, -sign * off[last]))
        else:
            found += [(-1, t[samples[k]], size) for k, size in off.items()]
    return found


def best(gaps, costs):
    """The cheapest of those within three gaps of each other."""
    chosen = []
    for g in sorted((g for g in gaps if np.isfinite(costs[g])), key=lambda g: costs[g]):
        if all(abs(g - other) > 3 for other in chosen):
            chosen.append(g)
    return sorted(chosen)


def jumps_among(t, x, order, noise, step, rounded):
    """(jumps, what is impossible) among candidates {gap: noise}."""
    slopes = np.diff(x) / np.diff(t)
    h_of = {g: t[g + 1] - t[g] for g in noise}
    largest = np.abs(slopes if order == 1 else np.diff(x, 2) / np.diff(t)[1:] / np.median(list(h_of.values()))).max()
    jumps, costs, roughs, fines = {}, {}, {}, {}
    for g, sigma in noise.items():
        mid, h = (t[g] + t[g + 1]) / 2, h_of[g]
        left, right = side(t, x, np.arange(g - 3, g + 1), mid), side(t, x, np.arange(g + 1, g + 5), mid)
        fine, rough = right - left, side(t, x, np.arange(g + 1, g + 4), mid) - side(t, x, np.arange(g - 2, g + 1), mid)
        roughs[g], fines[g] = rough, fine
        apart, rough_noise, fine_noise = abs(fine[order] - rough[order]), sigma * NOISE[3][order] / h**order, sigma * NOISE[4][order] / h**order
        use = rough if apart < 3 * fine_noise else fine
        J, s = use[order], -use[order - 1] / use[order]
        for _ in range(2):
            s -= taylor(use[order - 1 :], s) / taylor(use[order:], s)
        off = abs(taylor(use, s)) / (abs(J) * h**2) if order == 2 else 0.0
        slope = max(abs(left[order + 1]), abs(right[order + 1])) * h
        good = abs(s) <= 0.55 * h and apart <= max(0.1 * abs(J), 3 * fine_noise) and abs(J) > max(10 * rough_noise, 0.02 * largest)
        good &= off < min(max(12 * sigma / (abs(J) * h**2), 0.03), 0.2)
        good &= slope < max(0.1 * abs(J), 3 * NOISE[4][order + 1] / np.sqrt(2) * sigma / h**order)
        jumps[g], costs[g] = (mid + s, J, max(1e-3, 3 * rough_noise / abs(J))), off + 1e-6 * abs(s) / h if good else np.inf
    chosen, found = best(list(noise), costs), []
    for g in chosen:
        tau, J, near = jumps[g]
        near = min(near, 0.2) * h_of[g]
        found.append((next((t[k] for k in (g, g + 1) if abs(tau - t[k]) < near), tau), J))
    return found, impossible(t, x, order, noise, roughs, fines, (step, rounded), chosen)


def impossible(t, x, order, noise, roughs, fines, steps, chosen):
    found = []
    for k in noise:
        if 4 <= k < len(x) - 4:
            size = np.diff(x[k - 4 : k + 5], 4) / [1, -4, 6, -4, 1]
            off = np.abs(size - size[2])
            if off.max() < 0.5 * abs(size[2]) and off[1:4].max() < 0.1 * abs(size[2]) and abs(size[2]) > 20 * noise[k]:
                found.append((-1, t[k], size[2], k))
    taken = [*chosen, *(k - i for *_, k in found for i in (0, 1))]
    free = {g for g in noise if all(abs(g - k) > 4 for k in taken)}
    found = [f[:3] for f in found]
    for r in range(order - 1, -1, -1):
        costs = {}
        for g in noise:
            J, h = roughs[g][r], t[g + 1] - t[g]
            s = -roughs[g][r - 1] / J if r else 0.0
            good = g in free and abs(J) > 20 * noise[g] * NOISE[3][r] / h**r and abs(fines[g][r] - J) <= 0.1 * abs(J) and abs(s) <= 0.6 * h
            good &= abs(J) * h**r > 3 * steps[r] and abs(J) > 5 * abs(roughs[g][r + 1]) * h
            costs[g] = abs(s) / h if good else np.inf
        for g in best(list(noise), costs):
            found.append((r, (t[g] + t[g + 1]) / 2 - (roughs[g][r - 1] / roughs[g][r] if r else 0.0), roughs[g][r]))
            free = {other for other in free if abs(other - g) > 4}
    return found


def by_hand(t, x, order, step):
    """What find_jumps finds: (times and sizes of jumps, [(order, time, size)] of what is impossible)."""
    if len(t) < 10:
        return [], []
    noise, rounded, of_ends = candidates(t, x, step)
    if not noise:
        return [], []
    inner, ends = {g: s for g, s in noise.items() if 3 <= g < len(t) - 4}, at_the_ends(t, x, of_ends)
    jumps, wrong = jumps_among(t, x, order, inner, step, rounded) if 0 < len(inner) <= max(64, len(t) // 8) else ([], [])
    near = 4 * np.median(np.diff(t))
    return jumps, sorted([*ends, *(f for f in wrong if all(abs(f[1] - e[1]) > near for e in ends))], key=lambda f: f[1])


def motion(rng, order):
    """Sines with a few jumps of all orders, single samples that are off, noise and rounding, at even or uneven times."""
    n, h = int(rng.choice([9, 10, 11, 12, 14, 16, 24, 40, 70, 90, 300])), 10.0 ** rng.uniform(-3, 0)
    t = np.cumsum(h * (1 + rng.choice([0.0, 0.0, 3e-4, 0.3]) * rng.uniform(-1, 1, n)))
    u = (t - t[0]) / h  # in steps
    x = rng.uniform(0, 1) * np.sin(u * 10.0 ** rng.uniform(-3, -0.3)) + 1e-3 * rng.normal() * u
    for _ in range(rng.integers(0, 6)):
        at = u[rng.integers(0, n)] + rng.choice([0.0, 0.5, rng.uniform(-1, 1), 1e-3 * rng.normal()])
        size = 10.0 ** rng.uniform(-5, 0) * rng.choice([-1, 1])
        x = x + size * np.where(u > at, (u - at) ** rng.choice([0, 1, 2, 2, 3]), 0.0)
    for k in rng.choice(n, rng.integers(0, 3)):
        x[k] += 10.0 ** rng.uniform(-4, 0)
    if rng.random() < 0.3:  # at an end, in steps of all sizes
        k = int(rng.integers(1, 5))
        x[slice(k) if rng.random() < 0.5 else slice(-k, None)] += (
            10.0 ** rng.uniform(-3, 0) * rng.choice([np.ones(k), 1 + 0.2 * rng.random(k), np.arange(k) + 1.0, rng.normal(size=k)])[:k]
        )
    x = x + 10.0 ** rng.uniform(-9, -3) * rng.normal(size=n) * rng.choice([0, 1])
    step = rng.choice([0.0, 0.0, 10.0 ** rng.uniform(-6, -2)])
    return t, np.round(x / step) * step if step and rng.random() < 0.8 else x, float(step)


def nearly(rng, order):
    """Two jumps of the derivative of this order, of which each may be none: the sides don't quite meet, or turn, it is small beside the other, or noisy."""
    n = 40
    u, x = np.arange(float(n)), np.zeros(n)
    for at in (rng.uniform(9, 12), rng.uniform(26, 29)):
        size = 10.0 ** rng.uniform(-2.2, 0)
        after = np.maximum(u - at, 0)
        spoiled = np.zeros(4)
        spoiled[rng.integers(0, 4)] = 10.0 ** rng.uniform(-2.2, -0.3) * rng.choice([-1, 0, 1])
        x = x + size * (
            after**order / order
            + (u > at) * sum(c * after**k for k, c in enumerate(spoiled))
            + 0.1 * spoiled[3] * rng.choice([-1, 0]) * np.minimum(u - at, 0) ** 3
        )
    x = x + rng.choice([0.0, 10.0 ** rng.uniform(-5, -2)]) * rng.normal(size=n)
    return 0.01 * u, x, 0.0


@pytest.mark.parametrize("order", [2, 1])
@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("of", [nearly, motion])
def test_both_programs_find_the_same(of, order, seed):
    rng, said = np.random.default_rng([seed, order]), 0
    for _ in range(24):
        t, x, step = of(rng, order)
        with np.errstate(all="ignore"):
            jumps, wrong = by_hand(t, x, order, step)
        (found,) = find_jumps(t, x[:, None], order, np.array([step]))
        assert list(zip(found.jumps.times, found.jumps.sizes, strict=True)) == [pytest.approx(j, rel=1e-6, abs=1e-12) for j in jumps]
        assert [f[0] for f in found.impossible] == [f[0] for f in wrong]
        assert [f[1:] for f in found.impossible] == [pytest.approx(f[1:], rel=1e-6, abs=1e-12) for f in wrong]
        (other,) = find_jumps(t * 1024 - 7, x[:, None] / 512, order, np.array([step / 512]))  # in other units, and from another time on
        assert other.jumps.times + 7 == pytest.approx(found.jumps.times * 1024, rel=1e-6, abs=1e-9)
        assert other.jumps.sizes == pytest.approx(found.jumps.sizes / 512 / 1024**order, rel=1e-4)
        assert [f[0] for f in other.impossible] == [f[0] for f in wrong]
        said += bool(jumps) + bool(wrong)
    assert said > 3


@pytest.mark.parametrize("seed", range(4))
def test_which_differences_stand_out(seed):
    """Of those around them, block by block; of noise that is larger in one part, and of long motions."""
    rng, said = np.random.default_rng([7, seed]), 0
    for k in range(30):
        t, x, step = motion(rng, 2)
        if k % 10 == 9:
            n = int(rng.integers(2000, 6100))
            t, x = 0.01 * np.arange(n), np.sin(0.1 * np.arange(n)) + 1e-3 * rng.normal(size=n)
        x = x + rng.choice([0.0, 1e-4, 1e-2]) * rng.normal(size=len(t)) * (np.arange(len(t)) > rng.integers(0, len(t)))
        scale = 10.0 ** rng.integers(-4, 5)
        x, step = (x * scale, step * scale) if k % 3 else (scale * (1 + 3 * np.arange(len(t))), 0.0)  # straight, but for rounding in memory
        if len(t) < 10:
            continue
        (noise, _, of_ends), (stand_out, background) = candidates(t, x, step), _candidates(t, x[:, None], np.array([step]))
        assert np.flatnonzero(stand_out[:, 0]).tolist() == list(noise) and stand_out.shape == background.shape == (len(t) - 1, 1)
        assert background[[*noise, 0, -1], 0] == pytest.approx([*noise.values(), *of_ends], rel=1e-3)
        said += len(noise) > 0
    assert said > 9


@pytest.mark.parametrize(("spikes", "size", "rounded"), [(20, 1.0, False), (21, 1.0, True), (21, 0.88, True), (21, 0.8, False), (40, 0.8, True)])
def test_numbers_that_are_multiples_of_a_step_by_chance(spikes, size, rounded):
    """A ramp whose 401 fourth differences are none but for five at each spike, the least of them 1/√70 of it: where a quarter of all are larger than a tenth of the
    step, x has been rounded to it.  Of smaller spikes three are."""
    x = 1024.0 * np.arange(405)
    x[6 + 9 * np.arange(spikes)] += size
    _, background = _candidates(np.arange(405.0), x[:, None], np.ones(1))
    assert background[-1, 0] == pytest.approx(1 / np.sqrt(12) if rounded else 4 * np.finfo(float).eps * x.max())


@pytest.mark.parametrize("order", [2, 1])
@pytest.mark.parametrize("seed", range(4))
def test_which_candidates_are_jumps(seed, order):
    """Of six gaps side by side, with noise of all sizes."""
    rng, said = np.random.default_rng([9, seed]), 0
    for _ in range(60):
        t, x, _ = nearly(rng, order)
        gaps = np.arange(9, 15) if rng.random() < 0.8 else np.array([3, 10, 11, 27, 35])
        noise, step = 10.0 ** (rng.uniform(-6, -2) + rng.uniform(-0.3, 0.3, len(gaps))), float(rng.choice([0.0, 1e-3]))
        with np.errstate(all="ignore"):
            jumps, wrong = jumps_among(t, x, order, dict(zip(gaps.tolist(), noise, strict=True)), step, 0.0)
        found = _tested(t, x, order, gaps, noise, step)
        assert list(zip(found.jumps.times, found.jumps.sizes, strict=True)) == [pytest.approx(j, rel=1e-6, abs=1e-12) for j in jumps]
        assert found.impossible == [pytest.approx(f, rel=1e-6, abs=1e-12) for f in sorted(wrong, key=lambda f: f[1])]
        said += bool(jumps) + bool(wrong)
    assert said > 3


JUST = {  # what a jump of 1 between samples 10 and 11 may still be, and what is too much
    "sides that are apart": ({"apart": 0.029}, {"apart": 0.031}),
    "by twelve times the noise": ({"apart": 0.1, "noise": 0.103 / 12}, {"apart": 0.1, "noise": 0.097 / 12}),
    "by a fifth, in more noise": ({"apart": 0.195, "noise": 0.0185}, {"apart": 0.205, "noise": 0.0185}),
    "not between its samples": ({"at": 0.535}, {"at": 0.565}),
    "polynomials that disagree by a tenth": ({"one_side": 0.097 / 9}, {"one_side": 0.103 / 9}),
    "by three times the noise": (
        {"one_side": 0.0145, "noise": 0.0145 * 9 / 3 / 162**0.5 * 1.03},
        {"one_side": 0.0145, "noise": 0.0145 * 9 / 3 / 162**0.5 * 0.97},
    ),
    "steep": ({"both": 0.097 / 6}, {"both": 0.103 / 6}),
    "steep in noise": ({"both": 0.97 * 0.268 / 6, "noise": 0.268 / 3 / 20**0.5}, {"both": 1.03 * 0.268 / 6, "noise": 0.268 / 3 / 20**0.5}),
    "irrelevant": ({"bend": 49.0}, {"bend": 51.0}),
    "noise": ({"noise": 0.97 / 10 / 12**0.5}, {"noise": 1.03 / 10 / 12**0.5}),
}


def of_a_jump(at=0.0, apart=0.0, both=0.0, one_side=0.0, bend=0.0, noise=0.0):
    """What is found of a jump of 1 that is `at` steps from the middle of samples 10 and 11: sides apart, cubics on both or on one, a bend further on."""
    k = np.arange(24.0)
    u, right = k - 10.5, k >= 11
    x = right * ((u - at) ** 2 / 2 + apart + one_side * u**3) + both * np.abs(u) ** 3 + bend * np.maximum(k - 20, 0)
    return _tested(k, x, 2, np.array([10]), np.array([noise]), 0.0).jumps


@pytest.mark.parametrize("what", JUST)
def test_what_a_jump_may_just_be(what):
    good, bad = JUST[what]
    assert len(of_a_jump(**good).times) == 1 and len(of_a_jump(**bad).times) == 0


CUBIC = np.array([0, 5.75, -4.5, 1])  # quadratics through three of its samples on a side are 1.875, at the middle
IMPOSSIBLE = {  # polynomials behind the middle of samples 10 and 11, the order of the jump, the noise and the step, as they may be and not
    "a step in noise": (0, [1.0], (0.97 / 20 / NOISE[3][0], 0.0), [1.0], (1.03 / 20 / NOISE[3][0], 0.0)),
    "a step of roundings": (0, [1.0], (0.0, 0.97 / 3), [1.0], (0.0, 1.03 / 3)),
    "a step of which cubics say else": (0, [1.0, 0, 0, 0] + 0.97 / 9 / 1.875 * CUBIC, (0.0, 0.0), [1.0, 0, 0, 0] + 1.03 / 9 / 1.875 * CUBIC, (0.0, 0.0)),
    "a step with a bend": (0, [1.0, 0.194], (0.0, 0.0), [1.0, 0.206], (0.0, 0.0)),
    "a bend in noise": (1, [0.0, 1.0], (0.97 / 20 / NOISE[3][1], 0.0), [0.0, 1.0], (1.03 / 20 / NOISE[3][1], 0.0)),
    "a bend beside its samples": (1, [-0.58, 1.0], (0.0, 0.0), [-0.62, 1.0], (0.0, 0.0)),
    "a bend with a curve": (1, [0.0, 1.0, 0.097], (0.0, 0.0), [0.0, 1.0, 0.103], (0.0, 0.0)),
}


@pytest.mark.parametrize("what", IMPOSSIBLE)
def test_what_an_impossible_jump_may_just_be(what):
    """Of 1, of the position or of its rate, behind a rest."""
    order, good, given, bad, other = IMPOSSIBLE[what]
    k = np.arange(24.0)
    found = [
        _tested(k, (k >= 11) * polynomial.polyval(k - 10.5, c), 2, np.array([10]), np.array([noise]), step)
        for c, (noise, step) in ((good, given), (bad, other))
    ]
    assert [f[0] for f in found[0].impossible] == [order] and found[0].impossible[0][2] == pytest.approx(1.0, rel=0.15)
    assert found[1].impossible == []


@pytest.mark.parametrize(("noise", "near"), [(0.0, 1e-3), (0.005, 0.015 * 12**0.5), (0.025, 0.2)])
def test_times_near_a_sample_are_at_it(noise, near):
    """To a thousandth of a step, or by the noise, to a fifth."""
    for side, sample in ((1, 11.0), (-1, 10.0)):
        assert of_a_jump(at=side * (0.5 - 0.97 * near), noise=noise).times.tolist() == [sample]
        assert of_a_jump(at=side * (0.5 - 1.03 * near), noise=noise).times == pytest.approx([sample - side * 1.03 * near], rel=1e-9)


@pytest.mark.parametrize("end", [slice(None), slice(None, None, -1)])
@pytest.mark.parametrize("seed", range(3))
def test_which_samples_at_an_end_are_off(seed, end):
    rng, said = np.random.default_rng([8, seed]), {0: 0, -1: 0}
    for _ in range(60):
        n, k = int(rng.integers(10, 20)), int(rng.integers(1, 5))
        t, noise = np.cumsum(rng.uniform(0.8, 1.2, n)), 10.0 ** rng.uniform(-6, -3, 2)
        x = 0.1 * np.sin(0.3 * t + rng.uniform(0, 6)) * rng.choice([0.1, 1.0])
        x[end][:k] += (
            10.0 ** rng.uniform(-2, 0) * (1 + rng.choice([0.0, 0.1, 0.3]) * rng.uniform(-1, 1, k)) * (1 if rng.random() < 0.7 else rng.uniform(0, 1, k))
        )
        found = _off_at_the_ends(t, x, noise)
        assert found == [pytest.approx(f, rel=1e-6) for f in at_the_ends(t, x, noise)]
        for f in found:
            said[f[0]] += 1
    assert said[0] > 3 and said[-1] > 3


@pytest.mark.parametrize("count", [3, 4])
def test_what_noise_makes_of_jumps(count):
    """By the weights of the polynomials through samples at 1/2, 3/2, …"""
    unit = [side(np.arange(count) + 0.5, row, np.arange(count), 0.0) for row in np.eye(count)]
    assert noise_of_jumps(count) == pytest.approx(np.sqrt(2 * np.sum(np.square(unit), axis=0))) and noise_of_jumps(count) == pytest.approx(NOISE[count])


@pytest.mark.parametrize(("n", "between", "at_samples", "found"), [(400, 4, 6, True), (400, 5, 5, False), (900, 16, 0, True), (900, 11, 6, False)])
def test_a_motion_with_corners_everywhere_has_none(n, between, at_samples, found):
    """More than 64 candidates, and than an eighth of the samples: a corner between samples makes seven, one at a sample six."""
    t = np.arange(n) * 0.01
    at = np.arange(between + at_samples) * 12 + 20 + 0.5 * (np.arange(between + at_samples) < between)
    x = sum((-1) ** k * np.maximum(t - 0.01 * c, 0) ** 2 for k, c in enumerate(at))
    assert len(candidates(t, x, 0.0)[0]) == 7 * between + 6 * at_samples
    assert find_jumps(t, x[:, None])[0].jumps.times == pytest.approx(0.01 * at if found else [])
