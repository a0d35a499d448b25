"""Equivalent loads of rolling bearings: deep groove, angular contact, crossed roller; static safety.

Loads are magnitudes in N, moments in N m; arrays of any shape that broadcast.
"""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ksl.mechanism.states import Array
from ksl.sizing.figures import Formula

# Single-row radial contact groove ball bearings, ISO 281:2007, Table 3: e and Y over the relative axial load f0 Fa / C0.
DEEP_GROOVE_AXIAL = (0.172, 0.345, 0.689, 1.03, 1.38, 2.07, 3.45, 5.17, 6.89)
DEEP_GROOVE_E = (0.19, 0.22, 0.26, 0.28, 0.30, 0.34, 0.38, 0.42, 0.44)
DEEP_GROOVE_Y = (2.30, 1.99, 1.71, 1.55, 1.45, 1.31, 1.15, 1.04, 1.00)
DEEP_GROOVE_X = 0.56


class AngularContact(NamedTuple):
    """Factors of angular contact ball bearings of one contact angle."""

    e: float
    X_single: float
    Y_single: float
    Y1_pair: float
    X2_pair: float
    Y2_pair: float
    X0_single: float
    Y0_single: float
    X0_pair: float
    Y0_pair: float


ANGULAR_CONTACT = {
    20: AngularContact(0.57, 0.43, 1.00, 1.09, 0.70, 1.63, 0.5, 0.42, 1.0, 0.84),
    25: AngularContact(0.68, 0.41, 0.87, 0.92, 0.67, 1.41, 0.5, 0.38, 1.0, 0.76),
    30: AngularContact(0.80, 0.39, 0.76, 0.78, 0.63, 1.24, 0.5, 0.33, 1.0, 0.66),
    35: AngularContact(0.95, 0.37, 0.66, 0.66, 0.60, 1.07, 0.5, 0.29, 1.0, 0.58),
    40: AngularContact(1.14, 0.35, 0.57, 0.55, 0.57, 0.93, 0.5, 0.26, 1.0, 0.52),
    45: AngularContact(1.34, 0.33, 0.50, 0.47, 0.54, 0.81, 0.5, 0.22, 1.0, 0.44),
}
"""By contact angle in degrees: ISO 281:2007, Table 3; ISO 76:2006, Table 2."""

DEEP_GROOVE = Formula("P = X Fr + Y Fa; e, Y over f0 Fa/C0; Fa/Fr ≤ e: P = Fr", "ISO 281:2007, 5.2.1 and Table 3, single row, radial contact groove")
DEEP_GROOVE_STATIC = Formula("s0 = C0/P0, P0 = max(Fr, 0.6 Fr + 0.5 Fa)", "ISO 76:2006, 5.2")
ANGULAR_SINGLE = Formula("P = X Fr + Y Fa; Fa/Fr ≤ e: P = Fr", "ISO 281:2007, Table 3, single row")
ANGULAR_SINGLE_STATIC = Formula("s0 = C0/P0, P0 = max(Fr, 0.5 Fr + Y0 Fa)", "ISO 76:2006, Table 2, single row")
ANGULAR_PAIR = Formula("P = Fr + Y1 Fa for Fa/Fr ≤ e, else X2 Fr + Y2 Fa", "ISO 281:2007, Table 3, pair")
ANGULAR_PAIR_STATIC = Formula("s0 = C0/P0, P0 = Fr + 2 Y0 Fa (Y0 of a single row)", "ISO 76:2006, Table 2, pair")
CROSSED_ROLLER = Formula(
    "P = X (Fr + 2 M/dp) + Y Fa; X, Y = 1, 0.45 for Fa/(Fr + 2 M/dp) ≤ 1.5, else 0.67, 0.67",
    "the same in the catalogues of THK (Cross-Roller Ring), IKO and Harmonic Drive",
)
CROSSED_ROLLER_STATIC = Formula("fs = C0/P0, P0 = Fr + 2 M/dp + 0.44 Fa, at each sample", "catalogues of THK and IKO")
CROSSED_ROLLER_LIFE = Formula("L10 = a1 (C/(fw Pm))^(10/3) million revolutions", "catalogues of THK and IKO; a1: ISO 281:2007, Table 12")


class Equivalent(NamedTuple):
    """An equivalent dynamic load P, N, with the factors that made it."""

    X: Array
    Y: Array
    P: Array


def deep_groove_factors(Fa: ArrayLike, C0: float, f0: float) -> tuple[Array, Array]:
    """e and Y of a deep-groove ball bearing: linear between the rows of the table over f0 Fa / C0, held outside of it.

    Fa: axial load, N; C0: basic static load rating, N; f0: its factor in ISO 76 and the catalogue.  Source: ISO 281:2007, Table 3.
    """
    relative = f0 * np.abs(np.asarray(Fa, dtype=float)) / C0
    return np.interp(relative, DEEP_GROOVE_AXIAL, DEEP_GROOVE_E), np.interp(relative, DEEP_GROOVE_AXIAL, DEEP_GROOVE_Y)


def deep_groove_load(Fr: ArrayLike, Fa: ArrayLike, C0: float, f0: float) -> Equivalent:
    """Equivalent dynamic load of a deep-groove ball bearing: Fr where Fa/Fr ≤ e, else 0.56 Fr + Y Fa.  ISO 281:2007, 5.2.1."""
    e, Y = deep_groove_factors(Fa, C0, f0)
    return _below_or_above(Fr, Fa, e, (1.0, 0.0), (DEEP_GROOVE_X, Y))


def deep_groove_static(Fr: ArrayLike, Fa: ArrayLike) -> Array:
    """Equivalent static load of a deep-groove ball bearing, N: 0.6 Fr + 0.5 Fa, at least Fr.  ISO 76:2006, 5.2."""
    r, a = np.abs(np.asarray(Fr, dtype=float)), np.abs(np.asarray(Fa, dtype=float))
    return np.asarray(np.maximum(r, 0.6 * r + 0.5 * a))


def angular_contact_load(Fr: ArrayLike, Fa: ArrayLike, angle: int, arrangement: Literal["single", "pair"]) -> Equivalent:
    """Equivalent dynamic load of angular contact ball bearings of a contact angle in degrees: 20, 25, 30, 35, 40 or 45.

    arrangement: one row, whose Fa includes what the radial load induces (`opposed_axial_loads`), or a back-to-back or
    face-to-face pair, taken as one bearing with C and C0 of the pair.  Source: ISO 281:2007, Table 3.
    """
    f = ANGULAR_CONTACT[angle]
    if arrangement == "single":
        return _below_or_above(Fr, Fa, f.e, (1.0, 0.0), (f.X_single, f.Y_single))
    return _below_or_above(Fr, Fa, f.e, (1.0, f.Y1_pair), (f.X2_pair, f.Y2_pair))


def angular_contact_static(Fr: ArrayLike, Fa: ArrayLike, angle: int, arrangement: Literal["single", "pair"]) -> Array:
    """Equivalent static load, N: 0.5 Fr + Y0 Fa, at least Fr; of a pair Fr + 2 Y0 Fa.  Source: ISO 76:2006, Table 2."""
    f, r, a = ANGULAR_CONTACT[angle], np.abs(np.asarray(Fr, dtype=float)), np.abs(np.asarray(Fa, dtype=float))
    return np.asarray(np.maximum(r, f.X0_single * r + f.Y0_single * a) if arrangement == "single" else f.X0_pair * r + f.Y0_pair * a)


def crossed_roller_load(Fr: ArrayLike, Fa: ArrayLike, M: ArrayLike, dp: float) -> Equivalent:
    """Equivalent dynamic load of a crossed roller bearing; Fr and 2 M/dp add as numbers, whatever their directions.

    M: tilting moment about the pitch plane of the rollers, N m; dp: pitch diameter, m.  Source: THK, IKO, Harmonic Drive catalogues.
    """
    combined = np.abs(np.asarray(Fr, dtype=float)) + 2.0 * np.abs(np.asarray(M, dtype=float)) / dp
    return _below_or_above(combined, Fa, 1.5, (1.0, 0.45), (0.67, 0.67))


def crossed_roller_static(Fr: ArrayLike, Fa: ArrayLike, M: ArrayLike, dp: float) -> Array:
    """Equivalent static load of a crossed roller bearing, N: Fr + 2 M/dp + 0.44 Fa.  Source: THK and IKO catalogues."""
    r, a, m = (np.abs(np.asarray(x, dtype=float)) for x in (Fr, Fa, M))
    return np.asarray(r + 2.0 * m / dp + 0.44 * a)


def static_safety(C0: float, P0: ArrayLike) -> Array:
    """s0 = C0/P0; infinite without load.  ISO 76:2006."""
    with np.errstate(divide="ignore"):
        return np.asarray(C0 / np.asarray(P0, dtype=float))


def _below_or_above(Fr: ArrayLike, Fa: ArrayLike, e: ArrayLike, below: tuple[ArrayLike, ArrayLike], above: tuple[ArrayLike, ArrayLike]) -> Equivalent:
    """X Fr + Y Fa with one pair of factors where Fa ≤ e Fr, the limit included, and another above."""
    r, a = np.abs(np.asarray(Fr, dtype=float)), np.abs(np.asarray(Fa, dtype=float))
    light = a <= np.asarray(e) * r
    X, Y = np.where(light, below[0], above[0]), np.where(light, below[1], above[1])
    return Equivalent(X, Y, X * r + Y * a)
