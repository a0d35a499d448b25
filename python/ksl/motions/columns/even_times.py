"""Times that have too few digits: even steps whose times were rounded are even again.

Differentiated twice, a time that is off by δ is an error of some v δ/h² in an acceleration: 300 samples a second whose times are rounded to ms lose everything.
"""

from __future__ import annotations

from itertools import product

import numpy as np

from ksl.mechanism.states import Array

MANY = 32
"""Fewer times than these may be uneven on purpose, and yet lie so near even ones."""
FINE = 1e-9
"""Share of the step by which times may be off without a change."""
SLACK = 1.1
"""The line through rounded times is not quite that through the exact ones."""
DIGITS = range(10)
"""So many decimals of seconds are looked for."""


def even_again(time: Array, spacing: Array) -> tuple[Array, str]:
    """The times at even steps, if all of them lie so near these as their digits can say, and a note; otherwise as they are.

    time (n), s, in any order; some may be missing between others, or stand there twice.  spacing (n): of numbers as the file stores them, s.  O(n log n).
    """
    if not np.isfinite(time).all():
        return time, ""
    given, of_time, inverse = np.unique(time, return_index=True, return_inverse=True)
    if len(given) < MANY:
        return time, ""
    stored = spacing[of_time]
    steps = np.diff(given)
    usual = float(steps[steps < 1.5 * np.median(steps)].mean())
    numbered = [np.append(0.0, np.cumsum(counted)) for counted in (np.ones(len(steps)), np.round(steps / usual))]
    for step, at in product((_above_zero(stored), _above_zero(np.maximum(_decimals(given, stored.max()), stored))), numbered):
        h, start = np.polyfit(at, given, 1, w=1 / step)
        even = start + h * at
        off = (given - even) / step
        beside = abs(h / np.median(step) - round(h / np.median(step))) < 1e-3  # then rounding would hardly have moved any
        if h >= 2 * step.max() and np.ptp(off) < (1 - 1e-3 if beside else SLACK):
            if np.abs(given - even).max() <= FINE * h:
                return time, ""
            note = f"times are rounded to {step.max():.2g} s, and their steps are even within that: {h:.9g} s is taken for each"
            return even[inverse.reshape(-1)], note
    return time, ""


def spacing_of(numbers: Array) -> Array:
    """How far apart the numbers are that a file can hold beside these: in single precision, if all of them are such numbers to nine digits."""
    with np.errstate(over="ignore"):
        single = numbers.astype(np.float32)
    apart = np.abs(np.spacing(single)).astype(float)
    is_single = bool(np.isfinite(single).all()) and bool((np.abs(numbers - single) <= 0.1 * apart).all())
    return apart if is_single else np.abs(np.spacing(numbers))


def _above_zero(step: Array) -> Array:
    return np.asarray(np.maximum(step, 1e-6 * step.max()))


def _decimals(time: Array, spacing: float) -> Array:
    """To which decimals each time is rounded, as those of its size are."""
    sizes = np.floor(np.log10(np.maximum(np.abs(time), 1e-9)))
    found = np.full(len(time), _decimal(time, spacing))
    for size in np.unique(sizes):
        these = sizes == size
        if these.sum() >= MANY / 4:
            found[these] = _decimal(time[these], spacing)
    return found


def _decimal(time: Array, spacing: float) -> float:
    """The largest power of ten of which all these times are multiples, as far as their spacing tells; 0 where none is."""
    for digits in DIGITS:
        step = 10.0**-digits
        slack = 2 * spacing / step
        if slack > 0.02:
            break
        if (np.abs(time / step - np.round(time / step)) <= max(slack, 1e-7)).all():
            return step
    return 0.0
