"""Sweeps of frequency."""

from __future__ import annotations

import numpy as np

from ksl.base.errors import MotionError
from ksl.model.model import Model
from ksl.motions.generate.generated import SHARE, Generated, effort_stretch, limits_of, sample_times, whole_motion, worst_use
from ksl.motions.signal.rates import derivatives

RAMP = 0.05
"""Share of the time in which amplitudes grow at the start, and shrink at the end."""

SPREAD = 0.07
"""Each joint sweeps faster than the one before by this share, so that they don't move together."""


def chirp(model: Model, duration: float = 20.0, low: float = 0.1, high: float = 2.0, rate: float = 250.0, acceleration: float | None = None) -> Generated:
    """All joints about the middle of their range, with a frequency that rises in proportion to time, Hz, at rest at both ends.

    Amplitudes are 80 % of the range, or what the limits of speed and of `acceleration` leave at each frequency; they are reduced until
    efforts are within their limits.  Raises MotionError.
    """
    limits = limits_of(model, acceleration)
    m = len(limits.joints)
    if not 0 < low < high < 0.1 * rate:
        raise MotionError(f"chirp from {low:g} to {high:g} Hz at {rate:g} samples a second: expected rising frequencies, and ten samples a period or more")
    t = sample_times(duration, rate)
    faster = 1 + SPREAD * np.arange(m) / max(1, m - 1)
    phase = 2 * np.pi * (low * t + (high - low) * t**2 / (2 * duration))[:, None] * faster
    omega = 2 * np.pi * (low + (high - low) * t / duration)[:, None] * faster
    x = np.clip(np.minimum(t, duration - t) / (RAMP * duration), 0, 1)
    envelope = (x**3 * (10 - 15 * x + 6 * x**2))[:, None]
    # the smallest of three amplitudes, rounded off where they meet
    amplitude = ((1 / limits.half) ** 4 + (omega / limits.velocity) ** 4 + (omega**2 / limits.acceleration) ** 4) ** -0.25
    swing, notes, factor = envelope * amplitude * np.sin(phase), limits.said(), SHARE
    for _ in range(40):
        q = limits.middle + factor * swing
        v, a = derivatives(t, q, 2)
        motion = whole_motion(model, limits, t, q, v, a)
        stretch, heavy = effort_stretch(model, limits, motion, SHARE)
        share = worst_use(limits, q, v, a).share
        if share <= SHARE * (1 + 1e-9) and stretch <= 1:
            break
        factor *= SHARE / share if share > SHARE else 0.95
    else:
        raise MotionError("chirp: efforts are beyond their limits even at small amplitudes; lower the frequencies, or the payload")
    return Generated(motion, [*notes, *heavy], {"kind": "chirp", "duration": duration, "rate": rate, "low": low, "high": high, "share": factor})
