"""`ksl.size`: components of a file, or of a dictionary, against the results of `ksl loads`."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import cache
from typing import Any

from ksl.base.extras import require
from ksl.base.files_read import recorded
from ksl.mechanism.lengths import far, far_point
from ksl.sizing.catalogue.catalogue_numbers import lengths_of
from ksl.sizing.catalogue.parts import Components
from ksl.sizing.choice.choose import choice_from
from ksl.sizing.choice.offers import Catalogue, catalogue_given
from ksl.sizing.figures import Figure, LeftOut
from ksl.sizing.utilisation.figures_of_parts import check_joints, demands_of, gears_of, sheet_of
from ksl.sizing.catalogue.given import components_given, for_cases, joints_given, points_given, results_given
from ksl.sizing.utilisation.motor_figures import Cloud
from ksl.sizing.peaks import simultaneous_sets
from ksl.sizing.catalogue.provenance import made_of
from ksl.sizing.results import Results
from ksl.sizing.samples import JointSamples, Spectrum
from ksl.sizing.utilisation.sheet import Sheet
from ksl.sizing.joints.sizing import Sizing


def size(
    results: Any,
    components: str | os.PathLike[str] | Mapping[str, Any] | Components | None = None,
    *,
    joints: Iterable[str] | None = None,
    at: Mapping[str, Sequence[float]] | None = None,
    choose: str | os.PathLike[str] | Mapping[str, Any] | Catalogue | None = None,
) -> Sizing:
    """Checks components against the loads of their joints.

    results: what `ksl loads` has written (the folder or its wrenches.parquet), the table that `Model.wrench_table` returns, or an
    object with such a table as `wrenches`.  components: a TOML file, its tables as a dictionary, or what
    `ksl.sizing.catalogue.components.read_components` has read; None for the simultaneous
    sets alone.  joints: only these.  at: {joint: (x, y, z)} points of the moments in the simultaneous sets, from the joint's
    origin in its axes, m; components say their own positions.  choose: a catalogue, TOML, CSV or xlsx, or its tables, from which components are
    chosen for the tables [[choose]] of components; their masses go back into the robot until nothing changes (docs/sizing.md).
    Returns figures with formula, inputs, source and utilisation, and `choices`.
    Raises SizingError.  Cost: O(samples) for each component, and for each entry of a catalogue in each round.

        loads = m.wrench_table(time, q_over_time)
        motor = {"kind": "motor", "joint": "elbow", "gear_ratio": 100, "rotor_inertia": 2.6e-5, "rated_torque": 0.45}
        sizing = ksl.size(loads, {"component": [motor]})
        print(sizing.verdict)
    """
    require("sizing", "pyarrow")
    with recorded() as ledger:
        table = results_given(results)
        parts = None if components is None else components_given(components)
        catalogue = None if choose is None else catalogue_given(choose)
    chosen = joints_given(table, joints)
    points = points_given(table, at, chosen)
    if parts is not None:
        parts = for_cases(table, parts)
        parts = replace(parts, parts=tuple(replace(part, joints=tuple(table.named(name, part.where) for name in part.joints)) for part in parts.parts))
        check_joints(table, parts.parts)
        for name, line in parts.stiffness_lines.items():
            table.named(name, f"{parts.file}:{line}" if line else parts.file)
    spectrum = parts.spectrum if parts else Spectrum()
    samples: Callable[[str], JointSamples] = cache(lambda joint: table.joint(joint, spectrum))
    selection = None
    if catalogue is not None:
        selection, parts, samples = choice_from(catalogue, results, table, parts, samples)
    sheets, clouds = _sheets(parts, chosen, samples) if parts else ([], [])
    in_order = tuple(f for sheet in sheets for f in sheet.figures)
    figures = tuple(sorted(in_order, key=_by_utilisation))
    peaks = [row for joint in chosen for row in simultaneous_sets(samples(joint).about(points.get(joint, (0, 0, 0))))]
    left_out = tuple(x for sheet in sheets for x in sheet.left_out) + (_not_held(table, parts) if parts and not joints else ())
    notes = (
        *table.notes,
        *(selection.notes if selection else ()),
        *_doubtful_lengths(table, points, parts),
        *_notes(table, parts, left_out, selection is not None),
    )
    return Sizing(table.robot, figures, tuple(peaks), left_out, notes, tuple(clouds), in_order, made_of(table, ledger.files, parts), selection)


def _sheets(parts: Components, chosen: list[str], samples: Callable[[str], JointSamples]) -> tuple[list[Sheet], list[Cloud]]:
    demands, gears = demands_of(parts), gears_of(parts.parts)
    sheets, clouds = [], []
    for part in parts.parts:
        for name in (joint for joint in part.joints if joint in chosen):
            sheet, cloud = sheet_of(part, samples(name), demands, gears.get(name))
            sheets.append(sheet)
            clouds += [cloud] if cloud is not None else []
    return sheets, clouds


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


def _not_held(table: Results, parts: Components) -> tuple[LeftOut, ...]:
    why = "the results don't hold the wrenches of this joint; run `ksl loads` without --joints, or with it among them"
    return tuple(LeftOut(name, part.name, "every figure", why) for part in parts.parts for name in part.joints if not table.holds(name))


def _notes(table: Results, parts: Components | None, left_out: Sequence[LeftOut], chosen: bool) -> list[str]:
    """What the reader should know of the spectrum, and of numbers that were not used and that leave no figure out."""
    if parts is None:
        return []
    said = "; ".join(x.why for x in left_out)
    notes = [f"{sentence}; it is not used" for part in parts.parts for sentence in part.refused.values() if sentence not in said]
    if parts.requests and not chosen:
        notes.append(f"{len(parts.requests)} of [[choose]] are not answered: give the catalogue that they are chosen from")
    if parts.left_out_spectrum:
        notes.append(parts.left_out_spectrum)
    spectrum = parts.spectrum
    if spectrum.shares:
        without = [case for case in table.cases if case not in spectrum.shares]
        notes += [f"cases without a share of the time count for peaks and not for life: {', '.join(without)}"] if without else []
    exceptional = [case for case, n in spectrum.repetitions.items() if n == 0]
    notes += [f"exceptional cases (0 repetitions) count for peaks and static safety and not for life: {', '.join(exceptional)}"] if exceptional else []
    return notes
