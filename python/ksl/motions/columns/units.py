"""Units of columns: what a row of units, a name like `hip [deg]` or a map of columns says, converted to s, rad and m."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ksl.base.errors import MotionError, near_names

DEGREE = math.pi / 180
TURN = 2 * math.pi


@dataclass(frozen=True)
class Unit:
    """A unit of a quantity: "time", "angle", "length" or "plain" (quaternions), of a rate if per_time is 1 or 2."""

    quantity: str
    per_time: int
    factor: float
    """How many s, rad, m (per s, per s²) it is."""


_TIMES = {"s": 1.0, "sec": 1.0, "secs": 1.0, "second": 1.0, "seconds": 1.0, "min": 60.0, "h": 3600.0}
_TIMES |= {"ms": 1e-3, "msec": 1e-3, "us": 1e-6, "µs": 1e-6, "μs": 1e-6, "ns": 1e-9, "nsec": 1e-9}
_ANGLES = {"rad": 1.0, "rads": 1.0, "radian": 1.0, "radians": 1.0, "mrad": 1e-3, "rev": TURN, "turn": TURN, "turns": TURN}
_ANGLES |= dict.fromkeys(("deg", "degs", "degree", "degrees", "°"), DEGREE)
_LENGTHS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "µm": 1e-6, "μm": 1e-6, "in": 0.0254, "inch": 0.0254}
_RATES = {name: Unit("angle", 1, TURN / 60) for name in ("rpm", "1/min", "u/min", "r/min")}
_PLAIN = ("-", "1", "none", "")
NAMES = ("s", "ms", "us", "ns", "rad", "deg", "rev", "m", "mm", "rad/s", "deg/s", "rpm", "m/s", "mm/s", "rad/s^2", "deg/s^2", "m/s^2", "mm/s^2")
"""The units that messages name, among them all that people write."""


def bare(text: str) -> str:
    """The unit in `[deg]`, `(deg)`, `<deg>` or `deg`."""
    text = text.strip()
    pairs = {"[": "]", "(": ")", "<": ">"}
    return text[1:-1].strip() if len(text) >= 2 and pairs.get(text[0]) == text[-1] else text


def unit_of(text: str) -> Unit | None:
    """The unit that a text names, or None."""
    name = bare(text).lower().replace(" ", "").replace("**", "^")
    if name in _PLAIN:
        return Unit("plain", 0, 1.0)
    if name in _RATES:
        return _RATES[name]
    for end, order in (("/s²", 2), ("/s^2", 2), ("/s2", 2), ("/(s^2)", 2), ("s^-2", 2), ("/s/s", 2), ("/sec^2", 2), ("/sec", 1), ("/s", 1), ("s^-1", 1)):
        if name.endswith(end):
            name, per_time = name[: -len(end)].rstrip("·*."), order
            break
    else:
        per_time = 0
    if name in _ANGLES:
        return Unit("angle", per_time, _ANGLES[name])
    if name in _LENGTHS:
        return Unit("length", per_time, _LENGTHS[name])
    if name in _TIMES and not per_time:
        return Unit("time", 0, _TIMES[name])
    return None


def si(quantity: str, per_time: int) -> str:
    """How messages call the unit that KSL computes in."""
    return {"time": "s", "angle": "rad", "length": "m", "plain": "no unit"}[quantity] + ("", "/s", "/s²")[per_time]


def factor(where: str, column: str, text: str, quantity: str, per_time: int, rate_of_position: bool = False) -> float:
    """What to multiply the values of a column by.  Raises MotionError where the unit is unknown or of another quantity.

    rate_of_position: a rate may be given in the unit of its position, "deg" for deg/s, as maps of columns do.
    """
    unit = unit_of(text)
    if unit is None:
        known = f"{near_names(bare(text), NAMES)}known: {', '.join(NAMES)}"
        raise MotionError(f"{where}: column {column!r} is in {bare(text)!r}, which is no unit that KSL knows; {known}")
    if unit.quantity == "plain" and not text.strip("-1 []()<>"):
        return 1.0  # "-" says that nothing is said, or that it is a quaternion
    if unit.quantity != quantity or (unit.per_time != per_time and not (rate_of_position and unit.per_time == 0)):
        raise MotionError(f"{where}: column {column!r} is in {bare(text)!r}, but expected {si(quantity, per_time)}, or a unit that can be converted to it")
    return unit.factor
