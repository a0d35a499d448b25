"""Bolts by name, `M8 8.8`: the thread of ISO 68-1, ISO 261 and ISO 724, the strength of ISO 898-1."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

from ksl.base.errors import near_names

PITCHES = {  # mm: the coarse pitch, and the fine ones that ISO 898-1 has stress areas of
    "M3": (0.5,), "M3.5": (0.6,), "M4": (0.7,), "M5": (0.8,), "M6": (1.0,), "M7": (1.0,), "M8": (1.25, 1.0), "M10": (1.5, 1.25, 1.0),
    "M12": (1.75, 1.5, 1.25), "M14": (2.0, 1.5), "M16": (2.0, 1.5), "M18": (2.5, 1.5), "M20": (2.5, 1.5), "M22": (2.5, 1.5), "M24": (3.0, 2.0),
    "M27": (3.0, 2.0), "M30": (3.5, 2.0), "M33": (3.5, 2.0), "M36": (4.0, 3.0), "M39": (4.0, 3.0),
}  # fmt: skip
"""ISO 261, ISO 262; ISO 898-1:2013, Tables 4 to 7."""

YIELD = {"4.6": 240.0, "4.8": 340.0, "5.6": 300.0, "5.8": 420.0, "6.8": 480.0, "8.8": 640.0, "9.8": 720.0, "10.9": 940.0, "12.9": 1100.0}
"""Smallest yield strength ReL, Rpf or Rp0.2, N/mm²: ISO 898-1:2013, Table 3; of 8.8 up to M16."""
YIELD_OF_LARGE_88 = 660.0
"""The yield strength of 8.8 above M16, MPa."""
LARGEST_98 = 16.0
"""mm: there is no 9.8 beyond."""


@dataclass(frozen=True)
class Bolt:
    """A bolt with a metric thread.  Lengths in m, areas in m², stresses in Pa."""

    name: str
    """As it is called: M8 8.8, M10x1.25 10.9."""
    diameter: float
    """d, of the thread."""
    pitch: float
    strength: str
    """The property class of ISO 898-1."""

    @property
    def pitch_diameter(self) -> float:
        """d2 = d − ¾ H, H = √3/2 P: ISO 68-1, ISO 724."""
        return self.diameter - 3 * math.sqrt(3) / 8 * self.pitch

    @property
    def core_diameter(self) -> float:
        """d3 = d − 17/12 H, at the root of the thread: ISO 68-1, ISO 898-1, 9.1.6.1."""
        return self.diameter - 17 * math.sqrt(3) / 24 * self.pitch

    @property
    def stress_diameter(self) -> float:
        """d_S = (d2 + d3)/2."""
        return (self.pitch_diameter + self.core_diameter) / 2

    @property
    def stress_area(self) -> float:
        """A_S = π/4 d_S²: ISO 898-1:2013, 9.1.6.1."""
        return math.pi / 4 * self.stress_diameter**2

    @property
    def yield_strength(self) -> float:
        """The smallest Rp0.2 of the property class, Pa."""
        large = self.strength == "8.8" and self.diameter > 0.016
        return 1e6 * (YIELD_OF_LARGE_88 if large else YIELD[self.strength])


def named_bolt(name: str) -> Bolt:
    """The bolt of a name: thread and property class, `M8 8.8`, `M10x1.25 10.9`.

    Raises ValueError, with what is known, for other names.
    """
    expected = "expected thread and property class, as in 'M8 8.8' or 'M10x1.25 10.9'"
    found = re.fullmatch(r"[Mm](\d{1,3}(?:\.\d{1,2})?)(?:\s*[x×*]\s*(\d{1,2}(?:\.\d{1,3})?))?(?:\s*-\s*|\s+)(\S{1,20})", name.strip())
    if found is None:
        raise ValueError(expected)
    size, pitch, strength = f"M{float(found[1]):g}", found[2], found[3]
    if size not in PITCHES:
        raise ValueError(f"no thread {size}; known are {', '.join(PITCHES)}")
    if strength not in YIELD:
        stainless = "; those of ISO 3506 (stainless steel) are not: give preload, yield_force and load_factor instead of bolt"
        known = f"the property classes of ISO 898-1 are known, {', '.join(YIELD)}{stainless if strength[:1] in 'AaCcFf' else ''}"
        raise ValueError(f"no property class {strength!r}; {near_names(strength, YIELD)}{known}")
    P = PITCHES[size][0] if pitch is None else float(pitch)
    if P not in PITCHES[size]:
        raise ValueError(f"no pitch of {P:g} mm for {size}; known are {', '.join(f'{p:g}' for p in PITCHES[size])}")
    d = float(size[1:])
    if strength == "9.8" and d > LARGEST_98:
        raise ValueError(f"ISO 898-1 has the property class 9.8 up to M{LARGEST_98:g}")
    thread = size if P == PITCHES[size][0] else f"{size}x{P:g}"
    return Bolt(f"{thread} {strength}", d / 1000, P / 1000, strength)
