"""Figures of fatigue: the damage of one pass through all cases, and the life."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ksl.model.states import Array
from ksl.sizing import fatigue
from ksl.sizing.figures import Formula, significant
from ksl.sizing.results import WRENCH
from ksl.sizing.samples import JointSamples
from ksl.sizing.sheet import Sheet

LINE = ("k", "knee_amplitude", "knee_cycles")


def fatigue_figures(sheet: Sheet) -> None:
    """Adds range, damage and life of a stress that is a sum of components of the wrench."""
    part, s = sheet.part, sheet.samples.about(sheet.part.get("at"))
    factors: Mapping[str, float] = part.get("stress")
    unit = part.get("unit")
    if "effort" in factors and not s.joint.driven:
        sheet.leave_out("everything", f"{s.joint.name} has no effort, it is {s.joint.kind}")
        return
    stress = _stress(s, factors)
    named = sheet.given("stress", "at")
    k = int(np.argmax(np.abs(stress)))
    sheet.add(
        "largest stress",
        Formula("S = Σ c_i w_i", "the file's factors of the wrench"),
        float(stress[k]),
        unit,
        named,
        at=k,
    )
    correction = part.get("mean_stress")
    needed = LINE if correction == "none" else (*LINE, "ultimate")
    if not sheet.has("damage and life", *needed):
        return
    _damage(sheet, s, stress, correction, unit, named)


def _stress(s: JointSamples, factors: Mapping[str, float]) -> Array:
    columns = dict(zip(WRENCH, np.concatenate([s.force, s.moment], axis=1).T, strict=True)) | {"effort": s.effort}
    return np.asarray(sum((c * columns[name] for name, c in factors.items()), np.zeros(len(s.time))))


def _damage(
    sheet: Sheet, s: JointSamples, stress: Array, correction: fatigue.MeanStress, unit: str, named: dict[str, str]
) -> None:
    part = sheet.part
    k, knee, cycles = (sheet.number(key) for key in LINE)
    amplitudes, counts, damages = [], [], np.zeros(len(s.cases))
    for i, (_, rows) in enumerate(s.slices()):
        length = float(s.time[rows.stop - 1] - s.time[rows.start]) if rows.stop > rows.start else 0.0
        times = float(s.weight[rows].sum()) / length if length > 0 else 0.0
        if times == 0:
            continue
        found = fatigue.rainflow_cycles(stress[rows], part.get("residue"))
        corrected = fatigue.corrected_amplitude(found.ranges / 2, found.means, correction, part.get("ultimate"))
        amplitudes.append(corrected)
        counts.append(found.counts * times)
        damages[i] = fatigue.miner_sum(corrected, found.counts * times, k, knee, cycles, part.get("below_knee"))
    if not amplitudes:
        sheet.leave_out("damage and life", "no case of the cycle lasts any time")
        return
    case, scale = s.cases[int(np.argmax(damages))], sheet.of_one_pass
    D = float(damages.sum()) * scale
    line = sheet.given(*LINE, "below_knee", "mean_stress", "residue") | (
        sheet.given("ultimate") if correction != "none" else {}
    )
    formula = Formula(
        fatigue.DAMAGE.text
        + (
            ""
            if correction == "none"
            else f", S_a from {fatigue.GOODMAN}" + ("" if correction == "goodman" else ", S_m ≥ 0")
        ),
        fatigue.DAMAGE.source,
    )
    amplitude, count = np.concatenate(amplitudes), np.concatenate(counts) * scale
    counted = {
        "largest S_a": f"{significant(float(amplitude.max(initial=0.0)))} {unit}",
        "cycles": significant(float(count.sum())),
    }
    asked = part.get("required_repetitions")
    share = None if asked is None else D * float(asked)
    sheet.add(
        f"damage of {sheet.one_pass}",
        formula,
        D,
        "",
        {**named, **counted, **line},
        None if asked is None else 1.0 / float(asked),
        case=case,
        share=share,
    )
    finite = amplitude[np.isfinite(amplitude)]
    if len(finite) == len(amplitude) and len(finite):
        sheet.add(
            "equivalent amplitude",
            fatigue.EQUIVALENT,
            fatigue.equivalent_amplitude(amplitude, count, k, cycles),
            unit,
            {**counted, **sheet.given("k", "knee_cycles")},
            case=case,
        )
    required = sheet.required_life()
    cycle = float(s.weight.sum()) * scale
    life = cycle / D / 3600.0 if D > 0 else np.inf
    wanted = {"required": f"{significant(required)} h"} if required is not None else {}
    if required is None and asked is None:
        sheet.leave_out("the limit of “fatigue life”", "required_life_h and required_repetitions are not given")
    inputs = {"D": significant(D), "Σ Δt": f"{significant(cycle)} s", **wanted}
    sheet.add(
        "fatigue life",
        Formula("Σ Δt/(3600 D)", "Palmgren–Miner, failure at D = 1"),
        float(life),
        "h",
        inputs,
        required,
        case=case,
        smallest=True,
    )
