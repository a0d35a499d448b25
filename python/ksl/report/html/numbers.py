"""Numbers, times and links as the report shows them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass

import numpy as np

from ksl.base.markup import html as escape
from ksl.load_cases.quantities import round_off_in
from ksl.mechanism.states import Array

ROUND_OFF = 1e-9
"""Loads, speeds and powers below it, in SI units, are shown as zero, unless loads are so small that round-off of theirs is less."""
_least: ContextVar[float] = ContextVar("least", default=ROUND_OFF)
FAR_START = 1000
"""If times begin later than this many durations (times of a clock), they are shown relative to the first sample."""


@contextmanager
def round_off_of_page(rows: Iterable[Mapping[str, object]], weight: float | None) -> Iterator[None]:
    """While a page about these rows is made, what is round-off of its loads is shown as zero, and no more.  weight: the machine's, N, if known."""
    token = _least.set(ROUND_OFF if weight is None else min(ROUND_OFF, round_off_in(rows, weight) or ROUND_OFF))
    try:
        yield
    finally:
        _least.reset(token)


def is_round_off(x: float) -> bool:
    return abs(x) < _least.get()


def format_number(x: float | str | None, digits: int = 4) -> str:
    """Formats with significant digits: plain from 0.001 up to 100,000, elsewhere with an exponent that is a multiple of three."""
    if x is None or isinstance(x, str) or not math.isfinite(x):
        return "–" if not isinstance(x, str) else x
    if is_round_off(x):
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
    return np.zeros_like(x) if is_round_off(peak(x)) else x


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
