"""`ksl.size`: components of a file, or of a dictionary, against the results of `ksl loads`."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from ksl.base.errors import SizingError
from ksl.base.extras import require
from ksl.base.files_read import recorded
from ksl.mechanism.lengths import far, far_point
from ksl.sizing.bearing_figures import (
    crossed_roller_figures,
    opposed_figures,
    pair_figures,
)
from ksl.sizing.bolt_figures import flange_figures
from ksl.sizing.catalogue.catalogue_numbers import lengths_of
from ksl.sizing.cylinder_figures import cylinder_figures
from ksl.sizing.components import Components, Part
from ksl.sizing.fatigue_figures import fatigue_figures
from ksl.sizing.figures import Figure, LeftOut
from ksl.sizing.gear_figures import planetary_figures, strain_wave_figures
from ksl.sizing.given import components_given, for_cases, joints_given, points_given, results_given
from ksl.sizing.limit_figures import limit_figures
from ksl.sizing.motor_figures import Cloud, motor_figures
from ksl.sizing.peaks import simultaneous_sets
from ksl.sizing.pin_figures import bush_figures, pin_figures
from ksl.sizing.provenance import made_of
from ksl.sizing.results import Results
from ksl.sizing.samples import JointSamples
from ksl.sizing.sheet import Demands, Sheet
from ksl.sizing.sizing import Sizing

FIGURES: dict[str, Callable[[Sheet], Cloud | None]] = {
    "motor": motor_figures,
    "strain wave gear": strain_wave_figures,
    "planetary gear": planetary_figures,
    "crossed roller bearing": crossed_roller_figures,
    "bearing pair": pair_figures,
    "opposed angular contact bearings": opposed_figures,
    "bolted flange": flange_figures,
    "pin": pin_figures,
    "plain bush": bush_figures,
    "hydraulic cylinder": cylinder_figures,
    "fatigue": fatigue_figures,
    "limits": limit_figures,
}
"""What adds the figures of each kind of component."""

WRENCH = ("axial_force", "radial_force", "bending_moment", "axial_moment")
USES = {
    "motor": (), "strain wave gear": (), "planetary gear": (), "hydraulic cylinder": (),
    "crossed roller bearing": WRENCH[:3], "bearing pair": WRENCH[:3], "opposed angular contact bearings": WRENCH[:3],
    "bolted flange": WRENCH, "fatigue": WRENCH, "pin": WRENCH[1:3], "plain bush": WRENCH[1:3],
}  # fmt: skip
"""The quantities of the wrench that the figures of each kind use: those that rigid bodies leave open get no verdict."""

GEARS = ("strain wave gear", "planetary gear")
DRIVES = ("motor", *GEARS, "hydraulic cylinder")


def size(
    results: Any,
    components: str | os.PathLike[str] | Mapping[str, Any] | Components | None = None,
    *,
    joints: Iterable[str] | None = None,
    at: Mapping[str, Sequence[float]] | None = None,
) -> Sizing:
    """Checks components against the loads of their joints.

    results: what `ksl loads` has written (the folder or its wrenches.parquet), the table that `Model.wrench_table` returns, or an
    object with such a table as `wrenches`.  components: a TOML file, its tables as a dictionary, or what
    `ksl.sizing.components.read_components` has read; None for the simultaneous
    sets alone.  joints: only these.  at: {joint: (x, y, z)} points of the moments in the simultaneous sets, from the joint's
    origin in its axes, m; components say their own positions.  Returns figures with formula, inputs, source and utilisation.
    Raises SizingError.  Cost: O(samples) for each component.

        loads = m.wrench_table(time, q_over_time)
        motor = {"kind": "motor", "joint": "elbow", "gear_ratio": 100, "rotor_inertia": 2.6e-5, "rated_torque": 0.45}
        sizing = ksl.size(loads, {"component": [motor]})
        print(sizing.verdict)
    """
    require("sizing", "pyarrow")
    with recorded() as ledger:
        table = results_given(results)
        parts = None if components is None else components_given(components)
    chosen = joints_given(table, joints)
    points = points_given(table, at, chosen)
    if parts is not None:
        parts = for_cases(table, parts)
        parts = replace(parts, parts=tuple(replace(part, joints=tuple(table.named(name, part.where) for name in part.joints)) for part in parts.parts))
        _check(table, parts)
    kept: dict[str, JointSamples] = {}

    def samples(joint: str) -> JointSamples:
        if joint not in kept:
            kept[joint] = table.joint(joint, parts.spectrum) if parts else table.joint(joint)
        return kept[joint]

    sheets, clouds = _sheets(table, parts, chosen, samples) if parts else ([], [])
    in_order = tuple(f for sheet in sheets for f in sheet.figures)
    figures = tuple(sorted(in_order, key=_by_utilisation))
    peaks = [row for joint in chosen for row in simultaneous_sets(samples(joint).about(points.get(joint, (0, 0, 0))))]
    left_out = tuple(x for sheet in sheets for x in sheet.left_out)
    notes = (*table.notes, *_doubtful_lengths(table, points, parts), *_notes(table, parts, left_out))
    return Sizing(
        table.robot,
        figures,
        tuple(peaks),
        left_out,
        notes,
        tuple(clouds),
        in_order,
        made_of(table, ledger.files, parts),
    )


def _check(table: Results, parts: Components) -> None:
    """Refuses components on joints where they can't sit."""
    taken: dict[tuple[str, str, str], Part] = {}
    for part in parts.parts:
        for name in part.joints:
            joint = table.joints[name]
            fits = {"turning": joint.turns, "sliding": joint.driven and not joint.turns, "driven": joint.driven, "any": True}
            if not fits[part.kind.joints]:
                sits = {"turning": "turns about one axis", "sliding": "slides along one axis", "driven": "has one coordinate"}[part.kind.joints]
                raise SizingError(
                    f"{part.where}: a {part.kind.name} sits on a joint that {sits}, and {name} is {joint.kind}; "
                    "`limits` and `bolted flange` take any joint"
                )
            key = (name, part.kind.name, part.name)
            if key in taken:
                raise SizingError(
                    f"{part.where}: {name} has two components of kind {part.kind.name} named {part.name!r}; give each a name"
                )
            taken[key] = part


def _sheets(
    table: Results, parts: Components, chosen: list[str], samples: Callable[[str], JointSamples]
) -> tuple[list[Sheet], list[Cloud]]:
    demands = Demands(parts.required_life_h, parts.reliability, parts.edition, bool(parts.spectrum.shares))
    gears: dict[str, Part] = {}
    for part in parts.parts:
        if part.kind.name in GEARS:
            gears |= {joint: part for joint in part.joints if joint not in gears}
    sheets, clouds = [], []
    for part in parts.parts:
        for name in (joint for joint in part.joints if joint in chosen):
            s = samples(name)
            sheet = Sheet(part, s, demands, gears.get(name))
            sheet.uses = USES.get(part.kind.name, WRENCH)
            sheets.append(sheet)
            if part.kind.name in DRIVES and not _has_effort(s):
                sheet.leave_out("everything", f"{name} has no drive in these results: it follows other joints")
                continue
            cloud = FIGURES[part.kind.name](sheet)
            clouds += [cloud] if cloud is not None else []
    return sheets, clouds


def _has_effort(s: JointSamples) -> bool:
    return bool((s.supplied == s.supplied).all())  # NaN where there is none


def _by_utilisation(figure: Figure) -> tuple[bool, float]:
    return (figure.utilisation is None, -(figure.utilisation or 0.0))


def _doubtful_lengths(table: Results, points: Mapping[str, Sequence[float]], parts: Components | None) -> list[str]:
    """Lengths that are likely in millimetres: points of moments, and what components have in m."""
    reach = table.extent
    found = [line for name, point in points.items() for line in far_point(f"the point of the moments of {name} is", point, reach, "the joint's origin")]
    for part in parts.parts if parts else ():
        for name, value in lengths_of(part.kind.keys, part.values):
            found += far(f"{part.where}: {part.name}: {name} is", value, reach, times=1.0)  # a component is in its joint
    return found


def _notes(table: Results, parts: Components | None, left_out: Sequence[LeftOut]) -> list[str]:
    """What the reader should know of the spectrum, and of numbers that were not used and that leave no figure out."""
    if parts is None:
        return []
    said = "; ".join(x.why for x in left_out)
    notes = [
        f"{sentence}; it is not used"
        for part in parts.parts
        for sentence in part.refused.values()
        if sentence not in said
    ]
    if parts.left_out_spectrum:
        notes.append(parts.left_out_spectrum)
    absent = {name: part.name for part in parts.parts for name in part.joints if not table.holds(name)}
    if absent:
        notes.append(f"components of joints whose wrenches the results don't hold are left out: {', '.join(f'{part} of {name}' for name, part in absent.items())}")
    spectrum = parts.spectrum
    if spectrum.shares:
        without = [case for case in table.cases if case not in spectrum.shares]
        notes += (
            [f"cases without a share of the time count for peaks and not for life: {', '.join(without)}"]
            if without
            else []
        )
    exceptional = [case for case, n in spectrum.repetitions.items() if n == 0]
    notes += (
        [
            f"exceptional cases (0 repetitions) count for peaks and static safety and not for life: {', '.join(exceptional)}"
        ]
        if exceptional
        else []
    )
    return notes
