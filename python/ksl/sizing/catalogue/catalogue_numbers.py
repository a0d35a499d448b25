"""Checks of single values of the components file: their form, and whether a catalogue can have such a number."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any

from ksl.sizing.catalogue.catalogue import Key

COMPONENTS_OF_STRESS = ("fx", "fy", "fz", "tx", "ty", "tz", "effort")
LARGEST = 1e30
"""Magnitudes beyond this one, or below its inverse, are no catalogue numbers, and their powers would overflow."""
LARGEST_DIAMETER, FARTHEST = 3.0, 10.0
"""Metres.  What is larger was most likely meant in millimetres, as catalogues have it."""

FORMS = {
    "number": "a number",
    "count": "a whole number",
    "vector": "three numbers [x, y, z]",
    "points": "pairs of numbers [[x, y], …]",
    "curve": "pairs [[speed, torque], …] with increasing speeds, 0 or more",
    "numbers by name": "factors { tx = 1.0, … }",
}
"""What is expected, in words, by the shape of the key."""


def numbers_in(key: Key, x: Any) -> list[float] | None:
    """All numbers in a value; None if it has another form than its key."""
    found: Sequence[Any] | None = None
    if key.shape == "numbers by name":
        found = list(x.values()) if isinstance(x, Mapping) and x else None
    elif key.shape in ("points", "curve"):
        pairs = isinstance(x, list) and x and all(isinstance(p, list) and len(p) == 2 for p in x)
        found = [v for p in x for v in p] if pairs else None
    elif key.shape == "vector":
        found = x if isinstance(x, list) and len(x) == 3 else None
    elif key.shape == "number" or isinstance(x, int):
        found = [x]
    if found is None or not all(is_number(v) for v in found):
        return None
    return None if key.shape == "curve" and not _is_curve(x) else [float(v) for v in found]


def fault_of(key: Key, numbers: Sequence[float]) -> str:
    """Why a catalogue can't have these numbers, as what follows the value in a sentence; empty if it can."""
    if not all(math.isfinite(v) for v in numbers):
        return "must be finite"
    if key.sign == "positive" and key.shape != "curve" and any(v <= 0 for v in numbers):
        return "must be positive"
    if key.sign == "not negative" and any(v < 0 for v in numbers):
        return "must be 0 or more"
    if key.largest is not None and any(v > key.largest for v in numbers):
        return f"must be at most {key.largest:g}"
    if key.one_of and any(v not in key.one_of for v in numbers):
        return f"must be one of {', '.join(f'{v:g}' for v in key.one_of)}"
    if any(v != 0 and not 1 / LARGEST <= abs(v) <= LARGEST for v in numbers):
        return f"is out of range: magnitudes are between {1 / LARGEST:g} and {LARGEST:g}"
    return ""


def in_millimetres(key: Key, numbers: Sequence[float]) -> str:
    """Says that a length was most likely meant in millimetres; empty if not."""
    largest = max((abs(v) for v in numbers if math.isfinite(v)), default=0.0)
    if key.unit != "m" or largest < (LARGEST_DIAMETER if "diameter" in key.name else FARTHEST):
        return ""
    return f"lengths are in metres; {largest:g} mm are {largest / 1000:g}"


def lengths_of(keys: Iterable[Key], values: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, float]]:
    """The lengths, m, that a component gives: the name of the key, and the largest magnitude of its numbers."""
    for key in keys:
        value = values.get(key.name)
        if key.shape == "table" and isinstance(value, Mapping):
            yield from lengths_of(key.keys, value, f"{before}{key.name}.")
        elif key.unit == "m" and value is not None:
            numbers = numbers_in(key, value) or []
            yield before + key.name, max(map(abs, numbers), default=0.0)


def is_number(x: object) -> bool:
    """Whether it is a number: an integer only if it fits a float; NaN and infinities are some."""
    return isinstance(x, float) or (isinstance(x, int) and not isinstance(x, bool) and abs(x) < 1e300)


def as_toml(x: Any) -> Any:
    """Tuples and NumPy's arrays and numbers as a TOML file would have them."""
    if isinstance(x, Mapping):
        return {k: as_toml(v) for k, v in x.items()}
    if isinstance(x, (list, tuple)):
        return [as_toml(v) for v in x]
    return x.tolist() if hasattr(x, "tolist") else x


def _is_curve(pairs: list[list[float]]) -> bool:
    """Whether speeds increase from 0 or more, and torques are not negative."""
    speeds = [p[0] for p in pairs]
    return speeds[0] >= 0 and all(a < b for a, b in pairwise(speeds)) and all(p[1] >= 0 for p in pairs)
