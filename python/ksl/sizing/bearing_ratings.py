"""Load ratings of radial deep-groove ball bearings from their dimensions, for bearings of which no catalogue has numbers.

Constants are those that publications quote of the standards; the printed standards were not at hand.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

F_C = {
    0.05: 46.7, 0.06: 49.1, 0.07: 51.1, 0.08: 52.8, 0.09: 54.3, 0.10: 55.5, 0.12: 57.5, 0.14: 58.8,
    0.16: 59.6, 0.18: 59.9, 0.20: 59.9, 0.22: 59.6, 0.24: 59.0, 0.26: 58.2, 0.28: 57.1, 0.30: 56.0,
}  # fmt: skip
"""f_c of single-row radial contact groove ball bearings, by Dw cos α/Dpw; ISO 281:2007, Table 2."""
B_M = 1.3
"""Factor of contemporary steel and manufacture, ISO 281:2007, Table 1."""
LARGE_BALL = 25.4
"""mm, from which on the exponent of the ball's diameter is 1.4."""
F_0 = (
    14.7, 14.9, 15.1, 15.3, 15.5, 15.7, 15.9, 16.1, 16.3, 16.5, 16.4, 16.1, 15.9, 15.6, 15.4, 15.2, 14.9, 14.7, 14.4, 14.2, 14.0,
    13.7, 13.5, 13.2, 13.0, 12.8, 12.5, 12.3, 12.1, 11.8, 11.6,
)  # fmt: skip
"""f0 of radial contact and angular contact groove ball bearings for Dw cos α/Dpw = 0, 0.01 … 0.3, ISO 76:2006, Table 1."""


class Ratings(NamedTuple):
    """Basic dynamic and static load ratings, N, and the factor f0 of the relative axial load."""

    C: float
    C0: float
    f0: float


def deep_groove_ratings(balls: int, ball_diameter: float, pitch_diameter: float) -> Ratings:
    """Ratings of a single-row deep-groove ball bearing.

    balls Z; ball_diameter Dw, pitch_diameter Dpw: m.  C = b_m f_c Z^(2/3) Dw^1.8 (from 25.4 mm on 3.647 Dw^1.4), C0 = f0 Z Dw², in N and mm.
    Tables are interpolated.  Raises ValueError where Dw/Dpw is not between 0.05 and 0.3.  Source: ISO 281:2007, 5.1; ISO 76:2006, 5.1.
    """
    D, gamma = 1000.0 * ball_diameter, ball_diameter / pitch_diameter
    if not min(F_C) <= gamma <= max(F_C) or balls < 1:
        raise ValueError(
            f"{balls} balls of {ball_diameter:g} m on {pitch_diameter:g} m: expected a ball at least, with a diameter of 0.05 to 0.3 of the pitch diameter"
        )
    f_c = float(np.interp(gamma, list(F_C), list(F_C.values())))
    f0 = float(np.interp(gamma, 0.01 * np.arange(len(F_0)), F_0))
    size = D**1.8 if D <= LARGE_BALL else 3.647 * D**1.4
    return Ratings(B_M * f_c * balls ** (2.0 / 3.0) * size, f0 * balls * D**2, f0)
