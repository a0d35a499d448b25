"""Motors: torque of the rotor with reflected inertia and gear efficiency, rms, envelope."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ksl.mechanism.states import Array
from ksl.sizing.figures import Formula

ROTOR_TORQUE = Formula(
    "T = J N α + (T_load/N) · (1/η if T_load ω > 0, η if < 0, 1 at rest)",
    "drive sizing, as in textbooks; the efficiency is the gear's and does not act on the rotor's own inertia",
)
RMS = Formula(ROTOR_TORQUE.text + "; T_rms = √(Σ T² Δt / Σ Δt), pauses included", ROTOR_TORQUE.source)
PEAK = Formula("max |T|, T = J N α + (T_load/N) · (1/η, η, 1)", ROTOR_TORQUE.source)
SPEED = Formula("n = N |ω|", "kinematics of the gear")
POWER = Formula("P = T N ω", "power at the rotor")
REGENERATED = Formula("E = −∫ min(T N ω, 0) dt over all cases", "energy that flows back into the drive, without losses in the winding and the converter")
ENVELOPE = Formula(
    "max |T|/T_max(n) over all samples, T_max linear between the points of the curve; beyond its last speed at least n/n_last",
    "torque–speed curve of motor with drive, from the catalogue",
)
CONTINUOUS = Formula("T_rms/T_S1(n_m), n_m the mean of |n|", "curve of continuous torque (S1), from the catalogue")
BRAKE = Formula("max |T_load|/N while the joint is at rest", "statics of the brake on the rotor's shaft; the gear's friction, which helps, is left out")
REFLECTED = Formula("J N²", "inertia of the rotor as the joint feels it")


def rotor_torque(
    load: ArrayLike, speed: ArrayLike, acceleration: ArrayLike, rotor_inertia: float, ratio: float, efficiency: float = 1.0, rest: float = 0.0
) -> Array:
    """Torque of a motor's rotor, N m: J N α + (T_load/N) × (1/η driving, η driven, 1 at rest).

    load (n): torque at the gear's output, N m (N where the joint slides); speed, acceleration (n): of the joint, rad/s, rad/s²
    (m/s, m/s²); rotor_inertia J: about the rotor's axis, brake and encoder included, kg m²; ratio N: turns of the rotor for each of
    the joint (rad/m); efficiency η: of the gear, 0 < η ≤ 1; rest: speeds up to this count as standstill.
    """
    T, w = np.asarray(load, dtype=float), np.asarray(speed, dtype=float)
    power = np.where(np.abs(w) <= rest, 0.0, T * w)
    factor = np.where(power > 0, 1.0 / efficiency, np.where(power < 0, efficiency, 1.0))
    return rotor_inertia * ratio * np.asarray(acceleration, dtype=float) + T / ratio * factor


def root_mean_square(x: ArrayLike, duration: ArrayLike) -> float:
    """√(Σ x² t / Σ t); x (n), duration (n), s."""
    values, t = np.asarray(x, dtype=float), np.asarray(duration, dtype=float)
    return float(np.sqrt(np.sum(values * values * t) / np.sum(t)))


def envelope_share(torque: ArrayLike, rpm: ArrayLike, curve_rpm: ArrayLike, curve_torque: ArrayLike) -> Array:
    """|T|/T_max(|n|) of each sample (n), for a curve of torque over speed; beyond its last speed n/n_last if that is more.

    torque (n), N m; rpm (n), r/min; curve_rpm (k), increasing; curve_torque (k), N m.  Below the first speed the curve is flat.
    """
    n, T = np.abs(np.asarray(rpm, dtype=float)), np.abs(np.asarray(torque, dtype=float))
    speeds = np.asarray(curve_rpm, dtype=float)
    allowed = np.interp(n, speeds, np.asarray(curve_torque, dtype=float))
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(allowed > 0, T / allowed, np.where(T > 0, np.inf, 0.0))
    return np.where(n > speeds[-1], np.maximum(share, n / speeds[-1]), share)
