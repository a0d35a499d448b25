"""Figures of a motor with its drive and brake."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ksl.load_cases.quantities import work
from ksl.mechanism.states import Array
from ksl.sizing import motor
from ksl.sizing.figures import Formula, significant
from ksl.sizing.life import mean_speed
from ksl.sizing.samples import JointSamples
from ksl.sizing.utilisation.sheet import RPM, Sheet


@dataclass(frozen=True)
class Cloud:
    """Torque and speed of a rotor at every sample, and what the drive allows: for a plot."""

    joint: str
    component: str
    rpm: Array
    torque: Array
    curve: list[list[float]] | None
    """Pairs of r/min and N m."""
    continuous: list[list[float]] | None = None


ROTOR_FIGURES = "rms torque, peak torque, power and regenerated energy"


def motor_figures(sheet: Sheet) -> Cloud | None:
    """Adds the figures of a motor; returns its cloud of torque over speed if there are the numbers for it."""
    s = sheet.samples
    ratio, efficiency, gear = _gear(sheet)
    if ratio is None:
        sheet.leave_out("everything at the rotor", "gear_ratio is not given, and no gear on this joint has a ratio; write gear_ratio = 1 for a direct drive")
        return None
    rpm = s.speed * ratio * RPM
    k = int(np.argmax(np.abs(rpm)))
    sheet.add("peak speed", motor.SPEED, abs(float(rpm[k])), "r/min", {"N": gear["N"], "ω": _of(s.speed[k], sheet, "/s")}, "max_speed_rpm", at=k)
    _brake(sheet, ratio, gear)
    if not sheet.has(ROTOR_FIGURES, "rotor_inertia"):
        return None
    J = sheet.number("rotor_inertia")
    torque = np.where(s.braked, 0.0, motor.rotor_torque(s.load_effort, s.speed, s.acceleration, J, ratio, efficiency))
    inputs = sheet.given("rotor_inertia") | gear
    _torques(sheet, torque, rpm, inputs)
    _powers(sheet, torque, ratio, inputs)
    reflected = {"J": sheet.given("rotor_inertia")["rotor_inertia"], "N": gear["N"]}
    unit = "kg m²" if s.joint.turns else "kg"
    sheet.add("reflected rotor inertia", motor.REFLECTED, J * ratio**2, unit, reflected)
    curves = [sheet.part.get(key) for key in ("torque_speed", "continuous_torque_speed")]
    return Cloud(s.joint.name, sheet.part.name, rpm, torque, *curves)


def _gear(sheet: Sheet) -> tuple[float | None, float, dict[str, str]]:
    """Ratio and efficiency, of the motor's own entry or of the gear on its joint, and both in words."""
    part, gear = sheet.part, sheet.gear
    own = part.get("gear_ratio")
    ratio = own if own is not None else gear.get("ratio") if gear else None
    efficiency, said = part.get("gear_efficiency"), ""
    if efficiency is None and gear is not None:
        efficiency, said = gear.get("efficiency"), f" ({gear.name})"
    if efficiency is None:
        efficiency, said = 1.0, " (none given)"
        if ratio != 1:
            sheet.leave_out("the efficiency of the gear", "gear_efficiency is not given; torques are those of a gear without losses")
    return ratio, float(efficiency), {"N": f"{_text(ratio)}", "η": f"{efficiency:g}{said}"}


def _torques(sheet: Sheet, torque: Array, rpm: Array, inputs: dict[str, str]) -> None:
    s = sheet.samples
    cycle = float(s.weight.sum())
    if cycle > 0:
        rms = motor.root_mean_square(torque, s.weight)
        governing = s.governing_case(torque**2 * s.weight)
        duty = {**inputs, "Σ Δt": f"{significant(cycle)} s", **_standstill(sheet)}
        sheet.add("rms torque", motor.RMS, rms, "N m", duty, "rated_torque", case=governing)
        curve = sheet.part.get("continuous_torque_speed")
        if curve:
            mean = mean_speed(rpm, s.weight)
            share = float(motor.envelope_share(rms, mean, *np.array(curve, dtype=float).T))
            said = {
                "T_rms": f"{significant(rms)} N m",
                "n_m": f"{significant(mean)} r/min",
                "T_S1(n_m)": f"{significant(float(np.interp(mean, *np.array(curve).T)))} N m",
            }
            sheet.add("rms torque, S1 curve", motor.CONTINUOUS, share, "", said, 1.0, case=governing)
    else:
        sheet.leave_out("rms torque and regenerated energy", "no case of the cycle lasts any time")
    k = int(np.argmax(np.abs(torque)))
    peak = {**inputs, **_state(sheet, k)}
    sheet.add("peak torque", motor.PEAK, abs(float(torque[k])), "N m", peak, "peak_torque", at=k, note=_at_a_stand(s) if s.stands[k] else "")
    curve = sheet.part.get("torque_speed")
    if curve is None:
        sheet.leave_out("torque–speed envelope", sheet.part.why_absent("torque_speed"))
        return
    shares = motor.envelope_share(torque, rpm, *np.array(curve, dtype=float).T)
    k = int(np.argmax(shares))
    outside = int(np.count_nonzero(shares > 1))
    note = f"{outside} of {len(shares)} samples are outside the envelope" if outside else ""
    said = {
        "T": f"{significant(float(torque[k]))} N m",
        "n": f"{significant(float(rpm[k]))} r/min",
        "T_max(n)": f"{significant(float(np.interp(abs(rpm[k]), *np.array(curve).T)))} N m",
    }
    sheet.add("torque–speed envelope", motor.ENVELOPE, float(shares[k]), "", said, 1.0, at=k, note=note)


def _powers(sheet: Sheet, torque: Array, ratio: float, inputs: dict[str, str]) -> None:
    s = sheet.samples
    power = torque * ratio * s.speed
    k = int(np.argmax(np.abs(power)))
    sheet.add(
        "peak power",
        motor.POWER,
        abs(float(power[k])),
        "W",
        {"T": f"{significant(float(torque[k]))} N m", "N": inputs["N"], "ω": _of(s.speed[k], sheet, "/s")},
        "max_power",
        at=k,
    )
    returned = np.zeros(len(s.cases))
    for i, (part, times) in enumerate(s.passes()):
        returned[i] = -work(s.time[part], power[part])[1] * times
    cycle = float(s.weight.sum())
    if cycle > 0:
        case = s.cases[int(np.argmax(returned))]
        sheet.add(
            "regenerated energy",
            motor.REGENERATED,
            float(returned.sum()) * sheet.of_one_pass,
            "J",
            {"of": sheet.one_pass, "Σ Δt": f"{significant(cycle)} s"},
            "regenerated_energy" if sheet.has_passes("regenerated energy", "regenerated_energy", "[cases]") else None,
            case=case,
        )


def _brake(sheet: Sheet, ratio: float, gear: dict[str, str]) -> None:
    if not sheet.has("holding torque against the brake", "brake_torque"):
        return
    s = sheet.samples
    still = s.stands
    load = np.abs(s.load_effort) / ratio
    formula, note = motor.BRAKE, _at_a_stand(s)
    if not still.any():
        formula, note = (
            Formula("max |T_load|/N over all samples", motor.BRAKE.source),
            "the joint is never at rest in these results; the peak while it moves is taken. Add a case that holds the worst pose",
        )
        still = np.ones(len(load), dtype=bool)
    k = int(np.argmax(np.where(still, load, -1.0)))
    sheet.add("holding torque", formula, float(load[k]), "N m", {"T_load": _of(s.load_effort[k], sheet, ""), "N": gear["N"]}, "brake_torque", at=k, note=note)


def _standstill(sheet: Sheet) -> dict[str, str]:
    """How much of the cycle the joint stands, where the gear's friction would help to hold it; nothing if it never does."""
    s = sheet.samples
    held = float(s.weight[s.stands].sum())
    return {"at a stand": f"{significant(held)} s, held without help of friction"} if held > 0 else {}


def _at_a_stand(s: JointSamples) -> str:
    unit = "rad/s" if s.joint.turns else "m/s"
    return f"at a stand (|ω| up to {significant(s.resolution, 2)} {unit}, what its positions resolve): held without help of friction"


def _state(sheet: Sheet, k: int) -> dict[str, str]:
    s = sheet.samples
    return {
        "T_load": "carried by the brake" if s.braked[k] else _of(s.load_effort[k], sheet, ""),
        "ω": _of(s.speed[k], sheet, "/s"),
        "α": _of(s.acceleration[k], sheet, "/s²"),
    }


def _of(x: float, sheet: Sheet, rate: str) -> str:
    """A number of the joint with its unit."""
    turns = sheet.samples.joint.turns
    unit = ("rad" if turns else "m") + rate if rate else "N m" if turns else "N"
    return f"{significant(float(x))} {unit}"


def _text(x: float | None) -> str:
    return "–" if x is None else f"{x:g}"
