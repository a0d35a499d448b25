"""ksl.motions.signal.noise, quality and smoothing: noise is measured, its effect predicted, and smoothing at the proposed frequency mends it."""

import tracemalloc
from collections.abc import Callable

import numpy as np
import pytest
from scipy.interpolate import make_interp_spline

import ksl
from growth import work
from ksl.base.errors import MotionError
from ksl.motions.motion import complete
from ksl.motions.reading import read_motion
from ksl.motions.signal.noise import first_derivative_noise, second_derivative_noise, step_of, white_noise
from ksl.motions.signal.quality import Samples, doubts_about_noise, noise_of
from ksl.motions.signal.smoothing import smoothed


@pytest.fixture(scope="module", params=["ur5", "panda"])
def pick(request, examples):
    """A model, the samples of its motion, and the efforts of the motion as it was before anything was added to it."""
    model = ksl.load(examples / f"robots/{request.param}.urdf")
    m = read_motion(model, examples / f"motions/{request.param}_pick.csv")
    return model, m.time, m.q, model.inverse_dynamics(m.q, m.v, m.a)


def with_q(pick, q, **options):
    model, t, _, _ = pick
    return complete(model, t, q, [[None, None]] * model.nv, **options)


def efforts(model, m):
    return model.inverse_dynamics(m.q, m.resolved_v, m.resolved_a)


NOISY = {
    "3 decimals": lambda q, rng: np.round(q, 3),
    "4 decimals": lambda q, rng: np.round(q, 4),
    "0.2 mrad": lambda q, rng: q + 2e-4 * rng.normal(size=q.shape),
    "14 bits": lambda q, rng: np.round(q / (2 * np.pi) * 2**14) * (2 * np.pi) / 2**14,
}


@pytest.mark.parametrize("kind", NOISY)
def test_smoothing_at_the_proposed_frequency_gives_the_peaks_back(pick, kind):
    """The pick motion of the UR5 rounded to 3 decimals makes 500 N m of 52; smoothed at what is proposed, it makes 52."""
    model, _, q, exact = pick
    given = NOISY[kind](q, np.random.default_rng(0))
    m = with_q(pick, given)
    (doubt,) = m.doubts
    peak = np.abs(exact).max(axis=0)
    assert np.abs(efforts(model, m) - exact).max() > 0.4 * peak.max()
    proposed = float(doubt.rpartition("--smooth ")[2])
    mended = with_q(pick, given, smooth=proposed)
    assert np.abs(efforts(model, mended)).max(axis=0) == pytest.approx(peak, rel=0.02, abs=1e-3)
    assert np.abs(efforts(model, mended) - exact).max() < 0.02 * peak.max()
    assert mended.doubts == [] and mended.smooth == proposed and np.array_equal(mended.raw_q, given)
    assert mended.differentiated[0].startswith(f"positions and given rates smoothed at {proposed:g} Hz, without delay")


def test_what_is_said(pick):
    model, t, q, _ = pick
    (rounded,) = with_q(pick, np.round(q, 3)).doubts
    assert "are rounded to 0.001 rad: differentiated, that makes errors of ±" in rounded and "peaks are noise. Smooth the positions: --smooth " in rounded
    (noisy,) = with_q(pick, q + 2e-4 * np.random.default_rng(1).normal(size=q.shape)).doubts
    assert "have noise of 0.0002" in noisy and "rad (standard deviation)" in noisy
    (coarse,) = with_q(pick, np.round(q + 2e-4 * np.random.default_rng(1).normal(size=q.shape), 4)).doubts
    assert "have noise of 0.0002" in coarse, "which is more than it is rounded to"
    (still,) = with_q(pick, np.round(q, 3), smooth=60.0).doubts
    assert "also after smoothing at 60 Hz" in still and "Smooth the positions more: --smooth " in still


@pytest.mark.parametrize("given", ["positions", "velocities"])
def test_errors_of_accelerations_are_those_of_the_noise_over_the_step(leg, given):
    """By the amplification of the spline; of velocities once over the step of 4 ms, of positions twice.  A joint that only noise moves has none."""
    t, x = np.arange(1000) * 0.004, np.random.default_rng(3).normal(size=1000)
    swing, none = 0.3 * np.sin(3 * t), np.zeros((1000, 1))
    noise = 1e-4 if given == "positions" else 1e-3
    v = None if given == "positions" else (3 * 0.3 * np.cos(3 * t) + noise * x)[:, None]
    hip = swing + noise * x if given == "positions" else swing
    (doubt,) = complete(leg, t, np.column_stack([hip, 0 * t]), [[v, None], [none, none]]).doubts
    said = float(doubt.partition("errors of ±")[2].partition(" rad/s²")[0])
    factor = second_derivative_noise() / 0.004**2 if given == "positions" else first_derivative_noise() / 0.004
    assert f"{given} of hip have noise of" in doubt and said == pytest.approx(factor * noise, rel=0.15)
    assert complete(leg, t, np.column_stack([1e-5 * x, swing]), [[None, None]] * 2).doubts == []


def test_noise_of_quaternions_is_that_of_the_angle(flying):
    """Twice that of their vector part."""
    t, x = np.arange(1000) * 0.004, 1e-4 * np.random.default_rng(3).normal(size=(1000, 6))
    q = np.column_stack([x[:, :3], x[:, 3:] / 2, np.ones(1000)])
    noise = noise_of(flying.joints[:1], Samples(t, q, [[None, None]]), {})
    assert noise.deviation == pytest.approx(1e-4 * np.ones(6), rel=0.15) and noise.curves == pytest.approx(x)


@pytest.mark.parametrize("which", range(3))
def test_numbers_beyond_all_robots_have_no_noise(leg, which):
    """Their squares would be none."""
    t, x = np.arange(100) * 0.004, np.random.default_rng(3).normal(size=(100, 2))
    motion = [x.copy(), x.copy(), x.copy()]
    motion[which][50, 0] = 1e200
    samples = Samples(t, x, [[None, None]] * 2)
    said = lambda parts: doubts_about_noise(leg, leg.joints[:2], samples, {}, tuple(parts), None, np.zeros(2, dtype=bool))
    assert len(said([x, x, x])) == 1 and said(motion) == []


def test_motions_as_exact_as_their_files_are_not_doubted(pick):
    model, t, q, exact = pick
    for digits in (6, 7, 9):
        m = with_q(pick, np.round(q, digits))
        assert m.doubts == []
        assert efforts(model, m) == pytest.approx(exact, abs=0.02 * np.abs(exact).max())


@pytest.mark.parametrize("start", [-3.0, 1024.0])
def test_smoothing_is_the_same_at_any_time(start):
    """In binary fractions of a second, of which none is lost."""
    t = np.arange(256) / 256
    x = np.sin(9 * t)[:, None]
    assert np.array_equal(smoothed(t + start, x, 20.0), smoothed(t, x, 20.0))
    with pytest.raises(MotionError, match="256 samples a second hold frequencies up to 128 Hz"):
        smoothed(t + start, x, 128.0)


def test_noise_of_derivatives_is_that_of_the_spline():
    rng = np.random.default_rng(5)
    t = np.arange(20000.0)
    spline = make_interp_spline(t, rng.normal(size=len(t)), k=5)
    inner = slice(50, -50)
    assert first_derivative_noise() == pytest.approx(np.std(spline(t, nu=1)[inner]), rel=0.02)
    assert second_derivative_noise() == pytest.approx(np.std(spline(t, nu=2)[inner]), rel=0.02)
    impulse = make_interp_spline(np.arange(301.0), np.arange(301) == 150, k=5)  # what white noise makes of a sample is the norm of these
    norms = [np.linalg.norm(impulse(np.arange(301.0), nu=order)) for order in (1, 2)]
    assert [first_derivative_noise(), second_derivative_noise()] == pytest.approx(norms, rel=1e-3)


KINDS = {
    "sines": lambda t, T: np.sin(2 * np.pi * t / T) + 0.3 * np.sin(2 * np.pi * 2.3 * t / T + 1),
    "minimum jerk": lambda t, T: (lambda u: 10 * u**3 - 15 * u**4 + 6 * u**5)(np.clip((t - 0.2 * T) / (0.5 * T), 0, 1)),
    "trapezoid": lambda t, T: (lambda u: np.where(u < 1 / 3, 2.25 * u * u, np.where(u < 2 / 3, 1.5 * u - 0.25, 1 - 2.25 * (1 - u) ** 2)))(
        np.clip((t - 0.1937 * T) / (0.6 * T), 0, 1)
    ),
    "at rest": lambda t, T: 0 * t,
    "steady": lambda t, T: t / T,
}


@pytest.mark.parametrize("kind", KINDS)
def test_doubts_are_those_of_efforts_that_are_wrong(examples, kind):
    """Steps from 0.1 ms to 50 ms, as they are, rounded and noisy: doubted if efforts are off by a sixth of their peak, and not if by a hundredth."""
    model = ksl.load(examples / "robots/ur5.urdf")
    rng = np.random.default_rng(6)
    size = np.array([0.5, 0.3, 0.4, 0.6, 0.3, 0.5])
    alarms = 0
    for step in (1e-4, 1e-3, 4e-3, 0.01, 0.05):
        t = np.arange(2000 if step < 0.004 else 300) * step
        exact = np.column_stack([s * KINDS[kind](t, t[-1]) for s in size])
        plain = complete(model, t, exact, [[None, None]] * 6)
        assert plain.doubts == [], (kind, step)
        tau = efforts(model, plain)
        scale = np.maximum(np.abs(tau).max(axis=0), 0.01 * np.array([model.joint(j).effort for j in model.joint_names]))
        changed = {f"{d} digits": np.round(exact, d) for d in (9, 6, 4, 3)}
        changed |= {f"noise of {sigma:g}": exact + sigma * rng.normal(size=exact.shape) for sigma in (1e-7, 1e-5, 1e-3)}
        for name, q in changed.items():
            m = complete(model, t, q, [[None, None]] * 6)
            off = (np.sqrt(np.mean((efforts(model, m) - tau)[5:-5] ** 2, axis=0)) / scale).max()
            if off > 0.055 or off < 0.003:
                assert bool(m.doubts) == (off > 0.05), (kind, step, name, off, m.doubts)
            alarms += bool(m.doubts)
    assert alarms > 5 or kind in ("at rest", "steady")


def test_orientations_are_smoothed_and_stay_unit_quaternions(robot):
    body = (
        '<robot name="stone"><link name="stone"><inertial><mass value="2"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>'
    )
    model = robot(body, floating_base=True)
    t = np.arange(800) * 0.005
    half = 0.4 * np.sin(2 * t)
    q = np.column_stack([0.3 * np.sin(t), 0 * t, t, 0 * t, 0 * t, np.sin(half), np.cos(half)])
    noisy = q + 1e-4 * np.random.default_rng(9).normal(size=q.shape)
    exact = complete(model, t, q, [[None, None]])
    raw = complete(model, t, noisy, [[None, None]])
    assert raw.doubts and exact.doubts == []
    m = complete(model, t, noisy, [[None, None]], smooth=4.0)
    assert np.linalg.norm(m.q[:, 3:], axis=1) == pytest.approx(1, abs=1e-12)
    assert m.a[100:-100] == pytest.approx(exact.a[100:-100], abs=0.1)
    assert np.abs(raw.a - exact.a).max() > 5


def test_frequencies_that_samples_do_not_hold_are_refused(pick):
    for bad in (0.0, -3.0, float("nan")):
        with pytest.raises(MotionError, match=r"--smooth .* expected a frequency in Hz, a positive number"):
            with_q(pick, pick[2], smooth=bad)
    for bad in (125.0,):
        with pytest.raises(MotionError, match=r"--smooth .* Hz, but 250 samples a second hold frequencies up to 125 Hz"):
            with_q(pick, pick[2], smooth=bad)


def test_what_is_looked_for_costs_little():
    """No work in Python for each sample, and less memory than a spline takes, which is computed anyway.  bench/growth.py has the times of both."""
    from ksl.motions.signal.corners import find_jumps

    def look(samples: int) -> Callable[[], object]:
        t = np.arange(samples) * 1e-3
        x = np.sin(t[:, None] * np.arange(1, 8) * 0.3)
        return lambda: (find_jumps(t, x), white_noise(t, x, np.array([step_of(c) for c in x.T])))

    run = look(100_000)
    assert work(run) < 1.1 * work(look(35_000))
    tracemalloc.start()
    run()
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert most < 4 * 8 * 7 * 100_000, "bytes: 4 numbers for each sample of each joint; 2.5 are usual, 5.5 those of a spline"


def test_numbers_of_the_page(examples):
    """docs/motions.md: 4.8 σ/h², and the sentence about the pick motion."""
    page = " ".join((examples.parent / "docs/motions.md").read_text().split())
    assert f"{second_derivative_noise():.1f} σ/h²" in page
    model = ksl.load(examples / "robots/ur5.urdf")
    m = read_motion(model, examples / "motions/ur5_pick.csv")
    (doubt,) = complete(model, m.time, np.round(m.q, 3), [[None, None]] * 6).doubts
    assert doubt in page


@pytest.mark.parametrize(
    ("x", "step"),
    [
        ([0.123, 1.5, -7.001], 1e-3), (np.zeros(9), 1.0), ([1.0, 5.0], 1.0), ([0.1, 0.25], 0.01), (0.0123 * np.arange(7) ** 2 + 1 / 3, 0.0123), (np.full(5, 1 / 3), 0.0),
        (np.array([0, 1, 2.0009, 5]) * 0.017 + 1 / 3, 0.017), (np.array([0, 1, 2.0011, 5]) * 0.017 + 1 / 3, 0.0), (np.sqrt(np.arange(9)), 0.0), ([0.123456789, 0.1], 1e-9), ([0.1234567891, 0.1], 0.0234567891),
    ],
)  # fmt: skip
def test_the_step_of_which_numbers_are_multiples(x, step):
    assert step_of(np.asarray(x, dtype=float)) == pytest.approx(step, rel=1e-9)


def test_multiples_are_such_to_rounding():
    """Of decimals to 1e-12; counts of an encoder that are a billionth of the largest number apart are one."""
    assert step_of(np.array([5.0, 1 + 0.95e-12])) == 1 and step_of(np.array([5.0, 1 + 1.05e-12])) == pytest.approx(4)
    assert [step_of(2.0**30 * np.array([0, 1 + k * np.finfo(float).eps])) == 1 for k in (8, 9)] == [True, False], "of large ones to eight of their last digits"
    for scale in (1.0, 2.0**-36):
        counts = np.sqrt(2) * scale * np.arange(7.0)
        near = lambda off: np.append(counts, counts[1] + off * counts[-1])
        assert step_of(near(0.95e-9)) == pytest.approx(counts[1]) and step_of(near(1.05e-9)) == 0


@pytest.mark.parametrize("n", [25, 26, 2000])
def test_noise_that_can_be_told(n):
    """Sixteen differences of the tenth order at least; a sine without noise has none."""
    rng = np.random.default_rng(1)
    t = np.arange(n) * 0.01
    x = np.column_stack([np.sin(t), np.sin(t) + 1e-3 * rng.normal(size=n), np.zeros(n)])
    found = white_noise(t, x, np.zeros(3))
    assert found[[0, 2]].tolist() == [0, 0] and (found[1] > 0) == (n > 25) and (n < 2000 or found[1] == pytest.approx(1e-3, rel=0.1))
