"""What sizing is given: results, components, and the cases of their spectrum, checked against each other."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from ksl.base.errors import SizingError, close_names, of_argument, unknown_name
from ksl.mechanism.requests import names_in_order, three_numbers
from ksl.sizing.catalogue.components import components_of, read_components
from ksl.sizing.catalogue.parts import Components
from ksl.sizing.results import Results, read_results
from ksl.sizing.samples import Spectrum


def results_given(results: Any) -> Results:
    """Results of a folder, of a table, or of an object with such a table as `wrenches`.  Raises SizingError for what is none."""
    if isinstance(results, (str, os.PathLike)):
        return read_results(Path(results))
    if isinstance(results, Results):
        return results
    table = getattr(results, "wrenches", results)
    if not hasattr(table, "column_names"):
        raise SizingError(f"results: {type(results).__name__} is no table of wrenches; give a folder of `ksl loads`, or what Model.wrench_table returns")
    return Results(table)


def components_given(components: str | os.PathLike[str] | Mapping[str, Any] | Components) -> Components:
    """Components of a file, of its tables, or as they were read."""
    if isinstance(components, Components):
        return components
    return components_of(components) if isinstance(components, Mapping) else read_components(components)


def joints_given(table: Results, joints: Iterable[str] | None) -> list[str]:
    """The names of the joints that are meant; None: all of the results."""
    if joints is None:
        return [name for name in table.joints if table.holds(name)]
    given = names_in_order(joints, "joints")
    return list(dict.fromkeys(table.named(name, "joints") for name in ([given] if isinstance(given, str) else given or ())))


def points_given(table: Results, at: Mapping[str, Sequence[float]] | None, chosen: Sequence[str]) -> dict[str, tuple[float, float, float]]:
    """{joint: point of its moments}, m, by the names in the results.  Raises SizingError for others than those that are chosen."""
    points = {}
    if not isinstance(at or {}, Mapping):
        raise SizingError(f"at={at!r}; expected {{joint: (x, y, z)}}, m")
    for given, point in (at or {}).items():
        name = table.named(given, "at")
        if name not in chosen:
            raise of_argument(
                SizingError,
                "at",
                f": a point of {name}, which is none of the joints that are sized: {', '.join(chosen)}; add it to them, or leave out the point",
            )
        try:
            points[name] = three_numbers(point, f"at: the point of {name}")
        except ValueError as e:
            raise SizingError(str(e)) from None
    return points


def for_cases(table: Results, parts: Components) -> Components:
    """Components for these results.  The spectrum is left out, with a note, where it is of other runs: of one motion, and of the cases of a sweep, which have no names.

    Raises SizingError for components of another robot, and for cases that the results don't have.
    """
    if parts.robot not in (None, table.robot):
        raise SizingError(
            f"{parts.file}: is for the robot {parts.robot!r}, and {table.file} are results of {table.robot!r}; "
            "take the results of that robot, or change `robot`"
        )
    named = (*parts.spectrum.repetitions, *parts.spectrum.shares)
    known = any(case in table.cases or close_names(case, table.cases, 1) for case in named)  # or misspelt
    if not named or known or not (len(table.cases) == 1 or table.of_sweep):
        for case in named:
            if case not in table.cases:
                line = parts.case_lines.get(case)
                raise SizingError(unknown_name(f"{parts.file}:{line}" if line else parts.file, "case", case, table.cases))
        return parts
    which = "[shares]" if parts.spectrum.shares else "[cases]"
    runs = "a sweep" if table.of_sweep else f"one case, {table.cases[0]}"
    note = f"{parts.file}: {which} is left out: it names {', '.join(named[:3])}{' …' if len(named) > 3 else ''}, and these are results of {runs}, which counts once"
    return replace(parts, spectrum=Spectrum(), left_out_spectrum=note)
