"""Figures of fatigue: the damage of one pass through all cases, and the life."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ksl.mechanism.states import Array
from ksl.sizing import fatigue
from ksl.sizing.figures import Formula, significant
from ksl.sizing.results import WRENCH
from ksl.sizing.samples import JointSamples
from ksl.sizing.utilisation.sheet import Sheet

LINE = ("k", "knee_amplitude", "knee_cycles")


def fatigue_figures(sheet: Sheet) -> None:
    """Adds range, damage and life of a stress that is a sum of components of the wrench."""
    part, s = sheet.part, sheet.placed
    if s is None:
        return
    sheet.remark = sheet.moves_along
    factors: Mapping[str, float] = part.get("stress")
    unit = part.get("unit")
    if "effort" in factors and not (s.joint.driven and np.isfinite(s.supplied).all()):
        why = "it follows other joints" if s.joint.driven else f"it is {s.joint.kind}"
        sheet.leave_out("everything", f"{s.joint.name} has no effort, {why}")
        return
    sheet.uses = tuple(name for name, factor in factors.items() if factor)
    stress = _stress(s, factors)
    named = sheet.given("stress", "at", "on")
    k = int(np.argmax(np.abs(stress)))
    sheet.add("largest stress", Formula("S = Σ c_i w_i", "the file's factors of the wrench"), float(stress[k]), unit, named, at=k)
    correction = part.get("mean_stress")
    needed = LINE if correction == "none" else (*LINE, "ultimate")
    if not sheet.has("damage and life", *needed):
        return
    _damage(sheet, s, stress, correction, unit, named)


def _stress(s: JointSamples, factors: Mapping[str, float]) -> Array:
    columns = dict(zip(WRENCH, np.concatenate([s.force, s.moment], axis=1).T, strict=True)) | {"effort": s.supplied}
    return np.asarray(sum((c * columns[name] for name, c in factors.items()), np.zeros(len(s.time))))


def _largest_terms(s: JointSamples, factors: Mapping[str, float]) -> float:
    """The sum of the largest magnitudes of the terms of the stress, which round it where they cancel."""
    return sum(float(np.abs(_stress(s, {name: c})).max()) for name, c in factors.items())


@dataclass(frozen=True)
class _Counted:
    """The cycles of all cases, once through each, and their damage."""

    amplitude: Array
    """Amplitudes (cycles), corrected for their means."""
    count: Array
    """How often each occurs."""
    damages: Array
    """Damage of each case (cases)."""

    def words(self, unit: str) -> dict[str, str]:
        return {"largest S_a": f"{significant(float(self.amplitude.max(initial=0.0)))} {unit}", "cycles": significant(float(self.count.sum()))}


def _damage(sheet: Sheet, s: JointSamples, stress: Array, correction: fatigue.MeanStress, unit: str, named: dict[str, str]) -> None:
    """Adds the damage of one pass, the amplitude that does the same damage, and the life."""
    counted = _counted(sheet, s, stress, correction)
    if counted is None:
        sheet.leave_out("damage and life", "no case of the cycle lasts any time")
        return
    case, D = s.cases[int(np.argmax(counted.damages))], float(counted.damages.sum()) * sheet.of_one_pass
    passes = sheet.has_passes(f"damage of {sheet.one_pass}", "required_repetitions", "[cases], or required_life_h")
    asked = sheet.part.get("required_repetitions") if passes else None
    line = sheet.given(*LINE, "below_knee", "mean_stress", "residue") | (sheet.given("ultimate") if correction != "none" else {})
    sheet.add(
        f"damage of {sheet.one_pass}",
        _formula(correction),
        D,
        "",
        {**named, **counted.words(unit), **line},
        None if asked is None else 1.0 / float(asked),
        case=case,
        share=None if asked is None else D * float(asked),
    )
    if np.isfinite(counted.amplitude).all() and len(counted.amplitude):
        k, _, cycles = (sheet.number(key) for key in LINE)
        sheet.add(
            "equivalent amplitude",
            fatigue.EQUIVALENT,
            fatigue.equivalent_amplitude(counted.amplitude, counted.count, k, cycles),
            unit,
            {**counted.words(unit), **sheet.given("k", "knee_cycles")},
            case=case,
        )
    _life(sheet, D, float(s.weight.sum()) * sheet.of_one_pass, asked is not None, case)


def _counted(sheet: Sheet, s: JointSamples, stress: Array, correction: fatigue.MeanStress) -> _Counted | None:
    """Rainflow cycles of each case, as often as it occurs; None if no case lasts any time."""
    part = sheet.part
    k, knee, cycles = (sheet.number(key) for key in LINE)
    amplitudes, counts, damages = [], [], np.zeros(len(s.cases))
    largest = _largest_terms(s, part.get("stress"))
    for i, (rows, times) in enumerate(s.passes()):
        if times == 0:
            continue
        found = fatigue.without_round_off(fatigue.rainflow_cycles(stress[rows], part.get("residue")), largest)
        corrected = fatigue.corrected_amplitude(found.ranges / 2, found.means, correction, part.get("ultimate"))
        amplitudes.append(corrected)
        counts.append(found.counts * times)
        damages[i] = fatigue.miner_sum(corrected, found.counts * times, k, knee, cycles, part.get("below_knee"))
    if not amplitudes:
        return None
    return _Counted(np.concatenate(amplitudes), np.concatenate(counts) * sheet.of_one_pass, damages)


def _formula(correction: fatigue.MeanStress) -> Formula:
    """The formula of the damage: Miner's sum, and how means of stresses enter it."""
    ways = {"none": "", "goodman": f", S_a from {fatigue.GOODMAN}"}
    return Formula(fatigue.DAMAGE.text + ways.get(correction, f", S_a from {fatigue.GOODMAN}, S_m ≥ 0"), fatigue.DAMAGE.source)


def _life(sheet: Sheet, D: float, cycle: float, is_asked: bool, case: str) -> None:
    """Adds the life, h, of a damage D in a cycle of so many seconds; is_asked: a number of repetitions is required."""
    required = sheet.required_life()
    life = cycle / D / 3600.0 if D > 0 else np.inf
    wanted = {"required": f"{significant(required)} h"} if required is not None else {}
    if required is None and not is_asked:
        sheet.leave_out("the limit of “fatigue life”", "required_life_h and required_repetitions are not given")
    inputs = {"D": significant(D), "Σ Δt": f"{significant(cycle)} s", **wanted}
    sheet.add("fatigue life", Formula("Σ Δt/(3600 D)", "Palmgren–Miner, failure at D = 1"), float(life), "h", inputs, required, case=case, smallest=True)
