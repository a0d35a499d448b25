"""Figures of strain wave gears and planetary gears."""

from __future__ import annotations

import math

import numpy as np

from ksl.sizing import gears
from ksl.sizing.figures import Formula, significant
from ksl.sizing.life import mean_load, mean_speed
from ksl.sizing.utilisation.sheet import RPM, Sheet

NO_TURN = "the joint does not turn in the cycle"


def strain_wave_figures(sheet: Sheet) -> None:
    """Adds the figures of a strain wave gear, by its catalogue's selection procedure."""
    s = sheet.samples
    average = mean_load(s.load_effort, s.speed, s.weight)
    if math.isnan(average):
        sheet.leave_out("average torque and life", NO_TURN)
    else:
        governing = s.governing_case(np.abs(s.load_effort) ** 3 * np.abs(s.speed) * s.weight)
        sheet.add("average torque", gears.AVERAGE_TORQUE, average, "N m", _cycle(sheet), "average_torque", case=governing)
    _peak(sheet, "repeated peak torque", gears.REPEATED_PEAK, s.repeated, "repeated_peak_torque")
    _peak(sheet, "momentary peak torque", gears.MOMENTARY_PEAK, np.ones(len(s.time), dtype=bool), "momentary_peak_torque")
    if not sheet.has("input speeds and life", "ratio"):
        return
    ratio = sheet.number("ratio")
    n_av = ratio * mean_speed(s.speed, s.weight) * RPM
    _speeds(sheet, ratio, n_av, gears.INPUT_AVERAGE, "max_average_input_rpm")
    _events(sheet, ratio)
    if not math.isnan(average) and sheet.has("life of the wave generator's bearing", "rated_torque", "rated_input_rpm", "rated_life_h"):
        L10 = gears.wave_generator_life(average, n_av, *(sheet.number(key) for key in ("rated_torque", "rated_input_rpm", "rated_life_h")))
        required = sheet.required_life()
        if required is None:
            sheet.leave_out("the limit of “wave generator L10h”", "required_life_h is not given")
        inputs = {**sheet.given("rated_life_h", "rated_torque", "rated_input_rpm"), "T_av": f"{significant(average)} N m", "n_av": f"{significant(n_av)} r/min"}
        inputs |= {"required": f"{significant(required)} h"} if required is not None else {}
        sheet.add("wave generator L10h", gears.GENERATOR_LIFE, L10, "h", inputs, required, case=governing, smallest=True)


def planetary_figures(sheet: Sheet) -> None:
    """Adds the figures of a planetary gear in cyclic duty."""
    s = sheet.samples
    p = sheet.part.get("torque_exponent")
    average = math.nan if p is None else mean_load(s.load_effort, s.speed, s.weight, float(p))
    if math.isnan(average):
        sheet.leave_out("mean torque", sheet.part.why_absent("torque_exponent") if p is None else NO_TURN)
    else:
        governing = s.governing_case(np.abs(s.load_effort) ** float(p) * np.abs(s.speed) * s.weight)
        sheet.add("mean torque", gears.PLANETARY_MEAN, average, "N m", {**_cycle(sheet), "p": f"{p:g}"}, "nominal_torque", case=governing)
    _peak(sheet, "acceleration torque", gears.REPEATED_PEAK, s.repeated, "acceleration_torque")
    _peak(sheet, "emergency torque", gears.MOMENTARY_PEAK, np.ones(len(s.time), dtype=bool), "emergency_torque")
    if sheet.has("input speeds", "ratio"):
        ratio = sheet.number("ratio")
        _speeds(sheet, ratio, ratio * mean_speed(s.speed, s.weight) * RPM, gears.PLANETARY_SPEED, "nominal_input_rpm")


def _cycle(sheet: Sheet) -> dict[str, str]:
    """What a mean over the cycle is taken over."""
    s = sheet.samples
    turned = float(np.sum(np.abs(s.speed) * s.weight)) / (2 * math.pi)
    return {
        "Σ |n| Δt": f"{significant(turned)} rev",
        "Σ Δt": f"{significant(float(s.weight.sum()))} s",
        "largest T": f"{significant(float(np.abs(s.load_effort).max()))} N m",
    }


def _peak(sheet: Sheet, figure: str, formula: Formula, of: np.ndarray, limit: str) -> None:
    s = sheet.samples
    if not of.any():
        sheet.leave_out(figure, "no case of the cycle lasts any time")
        return
    k = int(np.argmax(np.where(of, np.abs(s.load_effort), -1.0)))
    sheet.add(figure, formula, abs(float(s.load_effort[k])), "N m", {"T": f"{significant(float(s.load_effort[k]))} N m"}, limit, at=k)


def _speeds(sheet: Sheet, ratio: float, average: float, formula: Formula, limit: str) -> None:
    s = sheet.samples
    mean = {"N": f"{ratio:g}", "n_m": f"{significant(average / ratio)} r/min"}
    sheet.add("average input speed", formula, average, "r/min", mean, limit, case=s.governing_case(np.abs(s.speed) * s.weight))
    k = int(np.argmax(np.abs(s.speed)))
    n = abs(float(s.speed[k])) * RPM
    sheet.add("peak input speed", gears.INPUT_PEAK, ratio * n, "r/min", {"N": f"{ratio:g}", "n": f"{significant(n)} r/min"}, "max_input_rpm", at=k)


def _events(sheet: Sheet, ratio: float) -> None:
    """How often the exceptional cases may occur whose torque is above the repeated peak."""
    s, limit = sheet.samples, sheet.part.get("repeated_peak_torque")
    if limit is None:
        return
    above = np.logical_not(s.repeated) & (np.abs(s.load_effort) > limit)
    for case, part in s.slices():
        over = above[part]
        if not over.any():
            continue
        half = np.diff(s.time[part]) / 2
        stands_for = np.concatenate([half, [0.0]]) + np.concatenate([[0.0], half])
        duration = float(stands_for[over].sum())
        n_in = ratio * float(np.abs(s.speed[part][over]).max()) * RPM
        inputs = {"n_in": f"{significant(n_in)} r/min", "t": f"{significant(duration)} s above {limit:g} N m"}
        sheet.add(f"allowed occurrences of {case}", gears.EVENTS, gears.momentary_events(n_in, duration), "", inputs, case=case)
