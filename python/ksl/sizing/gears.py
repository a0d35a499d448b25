"""Gears: strain wave (harmonic) and planetary, by the selection procedures of their catalogues."""

from __future__ import annotations

from ksl.sizing.figures import Formula

AVERAGE_TORQUE = Formula("T_av = (Σ |n| Δt |T|³ / Σ |n| Δt)^(1/3), n of the output", "selection procedure of the Harmonic Drive CSF/CSG catalogue")
INPUT_AVERAGE = Formula("n_av = N Σ |n| Δt / Σ Δt, pauses included", "selection procedure of the Harmonic Drive CSF/CSG catalogue")
INPUT_PEAK = Formula("N max |n|", "selection procedure of the gear's catalogue")
REPEATED_PEAK = Formula("max |T| over the cases of the cycle", "limit of repeated peak torque, gear's catalogue")
MOMENTARY_PEAK = Formula("max |T| over all cases, emergencies included", "limit of momentary peak torque, gear's catalogue")
GENERATOR_LIFE = Formula(
    "L10 = L_rated (T_r/T_av)³ (n_r/n_av), input speeds",
    "Harmonic Drive catalogue: life of the wave generator's bearing; L_rated 7000 h (CSF, SHF), 10 000 h (CSG, SHG)",
)
EVENTS = Formula("N_allowed = 10⁴ / (2 (n_in/60) t)", "Harmonic Drive CSF/CSG catalogue: 10⁴ momentary peaks, two for each turn of the wave generator")
PLANETARY_MEAN = Formula("T2m = (Σ |n| Δt |T|^p / Σ |n| Δt)^(1/p), n of the output", "selection procedure of planetary gears' catalogues, cyclic duty")
PLANETARY_SPEED = Formula("n1m = N Σ |n| Δt / Σ Δt, pauses included", "selection procedure of planetary gears' catalogues")

# Average torques are `life.mean_load` with the exponent 3, average speeds `life.mean_speed`: the same sums as for bearings.


def wave_generator_life(average_torque: float, average_input_rpm: float, rated_torque: float, rated_input_rpm: float, rated_life: float = 7000.0) -> float:
    """Life of the wave generator's bearing, h: L (Tr/Tav)³ (nr/nav); infinite for a gear that carries nothing or stands still.

    average_torque: cubic mean at the output, N m; average_input_rpm: mean speed of the input, pauses included; rated_life: h at the
    rated torque and input speed, L10 7000 (CSF, SHF) or 10,000 (CSG, SHG); L50 is five times that.  Source: Harmonic Drive catalogue.
    """
    if average_torque == 0 or average_input_rpm == 0:
        return float("inf")
    return rated_life * (rated_torque / average_torque) ** 3 * (rated_input_rpm / average_input_rpm)


def momentary_events(input_rpm: float, duration: float) -> float:
    """How many momentary peaks a strain wave gear may see: 10⁴ / (2 n/60 t).

    input_rpm: speed of the input during the event; duration: of one event, s.  Infinite at rest.  Source: Harmonic Drive catalogue.
    """
    turns = 2.0 * abs(input_rpm) / 60.0 * duration
    return 1e4 / turns if turns > 0 else float("inf")
