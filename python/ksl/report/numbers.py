"""Numbers, times and links as the report shows them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from ksl.base.markup import html as escape

import numpy as np

from ksl.model.states import Array

ROUND_OFF = 1e-9
"""Loads, speeds and powers below it, in SI units, are shown as zero."""
FAR_START = 1000
"""If times begin later than this many durations (times of a clock), they are shown relative to the first sample."""


def format_number(x: float | str | None, digits: int = 4) -> str:
    """Formats with significant digits: plain from 0.001 up to 100,000, elsewhere with an exponent that is a multiple of three."""
    if x is None or isinstance(x, str) or not math.isfinite(x):
        return "–" if not isinstance(x, str) else x
    if abs(x) < ROUND_OFF:
        return "0"
    exponent = int(f"{x:.{digits - 1}e}".partition("e")[2])
    shift = 0 if -3 <= exponent < 5 else 3 * (exponent // 3)
    decimals = digits - 1 - (exponent - shift)
    mantissa = f"{round(x / 10.0**shift, decimals):.{max(0, decimals)}f}"
    return f"{mantissa}e{shift}" if shift else mantissa


def format_share(x: float) -> str:
    """Two digits: 1.2e-6."""
    if not math.isfinite(x):
        return "–"
    mantissa, _, exponent = f"{x:.1e}".partition("e")
    return f"{mantissa}e{int(exponent)}" if x else "0"


def peak(x: Array) -> float:
    return float(np.max(np.abs(x)))


def quiet(x: Array) -> Array:
    """Replaces pure rounding errors by zero."""
    return np.zeros_like(x) if peak(x) < ROUND_OFF else x


@dataclass(frozen=True)
class Clock:
    """Times as the page shows them."""

    origin: float
    """Subtracted from every time, s; zero unless the times are those of a clock."""
    decimals: int

    @staticmethod
    def of(time: Array) -> Clock:
        """For samples at `time` (n), s."""
        start, duration = float(time[0]), float(time[-1] - time[0])
        origin = start if abs(start) > FAR_START * duration else 0.0
        return Clock(origin, max(3, 3 - math.floor(math.log10(duration))) if duration > 0 else 3)

    def text(self, t: float) -> str:
        return f"{t - self.origin:.{self.decimals}f}"


PLAIN_CLOCK = Clock(0.0, 3)


def link(anchor: str | None, text: str) -> str:
    """A link to a section of the page; the text alone where there is no such section."""
    return escape(text) if anchor is None else f'<a href="#{anchor}">{escape(text)}</a>'
