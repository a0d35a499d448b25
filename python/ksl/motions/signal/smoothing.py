"""Low-pass filters without delay for measured positions, what they leave of noise, and a frequency that suits a motion."""

from __future__ import annotations

import numpy as np

from ksl.base.errors import MotionError
from ksl.base.extras import require
from ksl.mechanism.states import Array
from ksl.motions.signal.corners import evenly_spaced
from ksl.motions.signal.splines import spline_through

ORDER = 4
"""The order of the Butterworth filter, which runs forwards and backwards: amplitudes are multiplied by 1 / (1 + (f / f_c)^8), half at f_c."""

EVEN = 1e-5
"""Steps that differ by less than this share are even."""

LOWEST = 1e-6
"""The lowest cut-off, as a share of the sampling rate.  From 1e-8 down round-off spoils filters, and from 1e-9 down they can't be computed."""


def attenuation(frequency: Array, cutoff: float) -> Array:
    """What is left of amplitudes at these frequencies, Hz."""
    out: Array = 1 / (1 + (frequency / cutoff) ** (2 * ORDER))
    return out


def smoothed(time: Array, x: Array, cutoff: float, what: str = "motion") -> Array:
    """x (n, c) at increasing times (n), low-passed at `cutoff`, Hz, without delay.

    Raises MotionError if that is not below half the sampling rate, or so low that the filter can't be computed.

    A Butterworth filter of order 4, forwards and backwards.  Uneven samples are first interpolated at even times by cubic splines,
    and back afterwards.  Beyond both ends the motion is continued by its point reflection, which keeps positions and velocities there.
    """
    require("a filter", "scipy")
    from scipy.signal import butter, sosfiltfilt

    steps = len(time) - 1
    rate = steps / (time[-1] - time[0])
    if not cutoff > 0:
        raise MotionError(f"{what}: --smooth (smooth=) is {cutoff:g}; expected a frequency in Hz, a positive number")
    if not cutoff < 0.5 * rate * (1 - 1e-9):
        raise MotionError(f"{what}: --smooth {cutoff:g} Hz, but {rate:.4g} samples a second hold frequencies up to {0.5 * rate:.4g} Hz; give a lower one")
    if cutoff < LOWEST * rate:
        lowest = f"give a higher one, at least {LOWEST * rate:.4g} Hz"
        raise MotionError(f"{what}: --smooth {cutoff:g} Hz is so low that the filter can't be computed for {rate:.4g} samples a second; {lowest}")
    even = evenly_spaced(time, EVEN)
    regular = time if even else np.linspace(time[0], time[-1], len(time))
    y = x if even else spline_through(time, x, 3)(regular)
    pad = min(steps, int(np.ceil(3 * rate / cutoff)))
    y = sosfiltfilt(butter(ORDER, cutoff, fs=rate, output="sos"), y, axis=0, padtype="odd", padlen=pad)
    out: Array = y if even else spline_through(regular, y, 3)(time)
    return out


def noise_after(cutoff: float, step: float, derivative: int) -> float:
    """Standard deviation of a derivative after smoothing, for white noise of 1 in samples `step` apart: ∫ (2π f)^2d H² over all frequencies."""
    f = np.linspace(0, 0.5 / step, 4001)
    power = (2 * np.pi * f) ** (2 * derivative) * attenuation(f, cutoff) ** 2
    return float(np.sqrt(2 * step * np.sum((power[1:] + power[:-1]) / 2) * f[1]))


def suitable_cutoff(time: Array, x: Array, noise: Array, weight: Array) -> float:
    """The frequency, Hz, at which accelerations of the smoothed columns of x (n, c) have the least mean squared error.

    noise (c): standard deviations of their white noise.  weight (c): of the error of each acceleration, the mass that it moves.
    The error has two parts: what the filter removes of the motion, whose spectrum is known where it is above the noise, and the noise that it passes.
    O(n log n).
    """
    n = len(time)
    u = (time - time[0]) / (time[-1] - time[0])
    rest = x - (x[0] + u[:, None] * (x[-1] - x[0]))
    # sines that are zero at both ends: the transform of the odd continuation
    spectrum = np.abs(np.fft.rfft(np.vstack([rest[:-1], -rest[:0:-1]]), axis=0)[1:n]) ** 2 / (2 * (n - 1))
    f = np.arange(1, len(spectrum) + 1) / (2 * (time[-1] - time[0]))
    signal = np.where(_running_mean(spectrum, 9) > 3 * noise**2, np.maximum(spectrum - noise**2, 0.0), 0.0)
    scale = f[:, None] ** 4 * weight**2  # but for a factor
    lost, left = np.sum(scale * signal, axis=1), np.sum(scale * noise**2, axis=1)
    candidates = np.geomspace(max(2 * f[0], 1e-3 * f[-1]), 0.8 * f[-1], 60)
    errors = [float(np.sum((1 - (H := attenuation(f, c))) ** 2 * lost + H**2 * left)) for c in candidates]
    return float(f"{candidates[int(np.argmin(errors))]:.2g}")


def _running_mean(x: Array, width: int) -> Array:
    sums = np.cumsum(np.vstack([np.zeros((1, x.shape[1])), x]), axis=0)
    index = np.arange(len(x))
    low, high = np.maximum(index - width // 2, 0), np.minimum(index + width // 2 + 1, len(x))
    out: Array = (sums[high] - sums[low]) / (high - low)[:, None]
    return out
