"""The sheet of one component on one joint: collects its figures, and says which ones are left out and why."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ksl.mechanism.states import Array
from ksl.sizing.catalogue.parts import Part
from ksl.sizing.figures import Figure, Formula, LeftOut, significant
from ksl.sizing.life import LIFE_HOURS, MEAN_LOAD, RATING_LIFE, ROLLER, SLOW, hours, mean_load, mean_speed, rating_life, reliability_factor
from ksl.sizing.samples import JointSamples

RPM = 60.0 / (2.0 * math.pi)
"""r/min of 1 rad/s."""


PLACED = ("revolute", "continuous", "prismatic", "fixed")
"""Kinds of joints of which it is known how a part that is fixed to the parent moves against the child."""
OPTIONAL = ("max_power", "regenerated_energy", "amplitude_limit")
"""Limits that a file may well lack: that nothing is compared is then not listed as left out."""


@dataclass(frozen=True)
class Demands:
    """What the file asks of all components."""

    required_life_h: float | None = None
    reliability: float = 90.0
    edition: int = 2007
    by_share: bool = False
    """Cases have shares of the time and not repetitions: what would be of one pass through them is of one hour."""


class Sheet:
    """Figures of one component on one joint."""

    def __init__(self, part: Part, samples: JointSamples, demands: Demands = Demands(), gear: Part | None = None) -> None:
        self.part, self.samples, self.demands, self.gear = part, samples, demands, gear
        self.figures: list[Figure] = []
        self.left_out: list[LeftOut] = []
        self.remark = ""
        """A note on all figures."""
        self.uses: tuple[str, ...] = ()
        """The quantities or components of the wrench that the figures use, which decide whether these can be judged; see `judged`."""

    @cached_property
    def placed(self) -> JointSamples | None:
        """The samples about the component's point `at`, in the axes of the link that it is fixed to; None, and left out, where that can't be said."""
        at, s = self.part.values.get("at") or (0.0, 0.0, 0.0), self.samples
        if self.part.values.get("on", "child") == "child":
            return s.about(at)
        if s.joint.kind not in PLACED:
            self.leave_out("everything", f'on = "parent" needs a joint that turns or slides along one axis, or is fixed; {s.joint.name} is {s.joint.kind}')
            return None
        if s.joint.driven and not np.isfinite(s.position).all():
            self.leave_out("everything", f'on = "parent" needs the positions of {s.joint.name}, which these results lack')
            return None
        return s.fixed_to_parent(at)

    @property
    def moves_along(self) -> str:
        """Says that the component moves with the child, where it might be fixed to the parent and that isn't said."""
        joint = self.samples.joint
        if not joint.driven or "on" in self.part.values:
            return ""
        return f'it {"turns" if joint.turns else "slides"} with {joint.child or "the child"}; write on = "parent" for one that stays with {joint.parent or "the parent"}'

    def leave_out(self, figure: str, why: str) -> None:
        self.left_out.append(LeftOut(self.samples.joint.name, self.part.name, figure, why))

    def judged(self, uses: Sequence[str] | None = None) -> str:
        """Why figures that use these quantities, or `uses` of the sheet, get no verdict; empty where all of them are determined."""
        s = (self.placed or self.samples) if self.samples.undetermined else self.samples
        found = [*s.open_quantities(), *s.undetermined] if s.undetermined else []
        names = [name.replace("_", " ") for name in (self.uses if uses is None else uses) if name in found]
        return f"not judged: needs stiffnesses of joints; rigid bodies leave {' and '.join(names)} open" if names else ""

    def number(self, key: str) -> float:
        """A number that `has` has found."""
        return float(self.part.get(key))

    def has(self, figure: str, *keys: str) -> bool:
        """Whether all numbers that a figure needs are there; notes that it is left out otherwise."""
        absent = [key for key in keys if self.part.get(key) is None]
        if absent:
            self.leave_out(figure, "; ".join(dict.fromkeys(self.part.why_absent(key) for key in absent)))
        return not absent

    def given(self, *keys: str) -> dict[str, str]:
        """Catalogue numbers as inputs of a figure: {key: number and unit}."""
        part = self.part
        inputs = {}
        for key in keys:
            table, _, name = key.rpartition(".")
            row = next(k for k in (part.kind.by_name[table].keys if table else part.kind.keys) if k.name == name)
            x = part.get(key)
            unit = row.unit.replace("the stress's", str(part.values.get("unit", "Pa")))
            if x is not None:
                inputs[name] = f"{_plain(x)} {unit}".strip()
        return inputs

    def add(
        self,
        figure: str,
        formula: Formula,
        value: float,
        unit: str,
        inputs: Mapping[str, str],
        limit: str | float | None = None,
        at: int | None = None,
        case: str = "",
        smallest: bool = False,
        share: float | None = None,
        note: str = "",
        uses: Sequence[str] | None = None,
    ) -> None:
        """Adds a figure.  uses: the quantities of the wrench that it uses, where they are others than those of the sheet.

        limit: a catalogue key, or a number; its utilisation is value/limit, of a `smallest` limit limit/value, or `share`
        where it is something else.  at: the governing sample; case: the governing case, where it is no single sample.
        """
        allowed: float | None
        if isinstance(limit, str):
            given = self.part.get(limit)
            allowed = None if given is None else float(given)
            if given is None and (limit not in OPTIONAL or limit in self.part.refused):
                self.leave_out(f"the limit of “{figure}”", self.part.why_absent(limit))
        else:
            allowed = limit
        utilisation = share
        if share is None and allowed is not None:
            utilisation = _ratio(allowed, value) if smallest else _ratio(abs(value), allowed)
        if isinstance(limit, str) and allowed is None:
            utilisation = None
        not_judged = self.judged(uses)
        if not_judged and (utilisation is not None or allowed is not None):
            self.leave_out(f"the verdict on “{figure}”", not_judged)
            allowed = utilisation = None
        note = "; ".join(x for x in (note, self.remark, not_judged) if x)
        time = None
        if at is not None:
            case, time = self.samples.where(at)
        text = ", ".join(f"{name} = {x}" for name, x in inputs.items())
        joint, part = self.samples.joint.name, self.part
        bound = "" if allowed is None else "≥" if smallest else "≤"
        result = (float(value), unit, allowed, utilisation)
        self.figures.append(Figure(joint, part.name, part.kind.name, figure, *result, formula.text, text, formula.source, case, time, note, bound))

    @property
    def of_one_pass(self) -> float:
        """Sums over samples with their weights × this are of one pass through all cases, or of one hour where cases have shares."""
        return 3600.0 / float(self.samples.weight.sum()) if self.demands.by_share else 1.0

    @property
    def one_pass(self) -> str:
        """What such sums are of, in words."""
        return "one hour" if self.demands.by_share else "one pass"

    def has_passes(self, figure: str, key: str, instead: str) -> bool:
        """Whether a limit of one pass through all cases can be compared: shares of the time say nothing of passes.  Notes that it is left out otherwise."""
        if self.demands.by_share and self.part.get(key) is not None:
            self.leave_out(f"the limit of “{figure}”", f"{key} is of one pass through all cases, and [shares] don't say how long that is; give {instead}")
        return not self.demands.by_share

    def required_life(self) -> float | None:
        """Hours that are asked for, of this component or of all."""
        own = self.part.get("required_life_h")
        return self.demands.required_life_h if own is None else float(own)

    def life(
        self,
        of: str,
        C: float,
        load: Array,
        exponent: float,
        equivalent: Formula,
        inputs: Mapping[str, str],
        load_factor: float = 1.0,
        rating: Formula = RATING_LIFE,
    ) -> None:
        """Mean load, L10 in revolutions and in hours of a bearing under an equivalent load (n), N."""
        s = self.samples
        weight = np.abs(s.speed) * s.weight
        mean = mean_load(load, s.speed, s.weight, exponent)
        if math.isnan(mean):
            self.leave_out(f"{of}life", "the joint does not turn in the cycle; only the static safety counts")
            return
        reliability = self.part.get("reliability") or self.demands.reliability
        a1 = reliability_factor(float(reliability), self.demands.edition)
        case = s.governing_case(load**exponent * weight)
        p = "10/3" if exponent == ROLLER else f"{exponent:g}"
        source = f"{equivalent.source}; {MEAN_LOAD.source}"
        self.add(
            f"{of}mean load",
            Formula(f"{equivalent.text}; {MEAN_LOAD.text}", source),
            mean,
            "N",
            {**inputs, "p": p, "largest P": f"{significant(float(load.max()))} N"},
            case=case,
        )
        life = float(rating_life(C / load_factor, mean, exponent, a1))
        adjusted = f"{a1:g} ({reliability:g} %, ISO 281:{self.demands.edition})"
        rpm = mean_speed(s.speed, s.weight) * RPM
        named = {"C": f"{significant(C)} N", "Pm": f"{significant(mean)} N", "p": p, "a1": adjusted}
        named |= {"fw": f"{load_factor:g}"} if rating is not RATING_LIFE else {}
        self.add(f"{of}L10", rating, life, "10⁶ rev", named, case=case)
        required = self.required_life()
        if required is None:
            self.leave_out(f"the limit of “{of}L10h”", "required_life_h is not given")
        wanted = {"required": f"{significant(required)} h"} if required is not None else {}
        per_hour = {"L10": f"{significant(life)}·10⁶", "n_m": f"{significant(rpm)} r/min", **wanted}
        self.add(f"{of}L10h", LIFE_HOURS, float(hours(life, rpm)), "h", per_hour, required, case=case, smallest=True, note=SLOW if s.oscillates else "")


def _ratio(x: float, of: float) -> float:
    """x / of, 0 for nothing, infinite where nothing is allowed."""
    if x == 0 or math.isinf(of):
        return 0.0
    return x / of if of > 0 else math.inf


def _plain(x: object) -> str:
    if isinstance(x, float):
        return significant(x, 6)
    if isinstance(x, list):
        return "[" + ", ".join(_plain(v) for v in x) + "]"
    if isinstance(x, Mapping):
        return ", ".join(f"{v:g} {k}" for k, v in x.items())
    return str(x)
