"""`ksl.spectra`: load spectra of joints from the results of `ksl loads`."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Literal, overload

import numpy as np
from numpy.typing import ArrayLike

from ksl.base.errors import SizingError
from ksl.base.extras import require
from ksl.base.files_read import recorded
from ksl.mechanism.requests import one_of, three_numbers
from ksl.mechanism.states import Side
from ksl.sizing.catalogue.parts import Components
from ksl.sizing.catalogue.given import components_given, for_cases, joints_given, points_given, results_given
from ksl.sizing.catalogue.provenance import made_of
from ksl.sizing.results import Results
from ksl.sizing.samples import Spectrum
from ksl.sizing.utilisation.sheet import PLACED
from ksl.sizing.spectra.classes import edges_given
from ksl.sizing.spectra.spectra import Spectra, torque_of
from ksl.sizing.spectra.spectra_of_joints import SpectraOfJoints

ComponentsGiven = str | os.PathLike[str] | Mapping[str, Any] | Components
PointsGiven = Sequence[float] | Mapping[str, Sequence[float]]


@overload
def spectra(
    results: Any, joint: str, *, torque_edges: ArrayLike | None = None, speed_edges: ArrayLike | None = None,
    at: PointsGiven = (0.0, 0.0, 0.0), on: Side = "child", components: ComponentsGiven | None = None,
) -> Spectra: ...  # fmt: skip
@overload
def spectra(
    results: Any, joint: Iterable[str] | None = None, *, torque_edges: ArrayLike | None = None, speed_edges: ArrayLike | None = None,
    at: PointsGiven = (0.0, 0.0, 0.0), on: Side = "child", components: ComponentsGiven | None = None,
) -> SpectraOfJoints: ...  # fmt: skip
def spectra(
    results: Any,
    joint: str | Iterable[str] | None = None,
    *,
    torque_edges: ArrayLike | None = None,
    speed_edges: ArrayLike | None = None,
    at: PointsGiven = (0.0, 0.0, 0.0),
    on: Literal["child", "parent"] = "child",
    components: ComponentsGiven | None = None,
) -> Spectra | SpectraOfJoints:
    """Load spectra of a joint, for makers of bearings and gears: time and revolutions by torque and speed, cycles, a bearing's loads in a few classes.

    results: as :func:`ksl.size` takes them.  joint: a name; several, or None for all that turn or slide, give a dictionary {joint: Spectra} that can be written.
    torque_edges (k + 1), N m; speed_edges (k + 1), rad/s: edges of the classes; round ones by default (N and m/s where a joint slides).
    at: point of the bearing, from the joint's origin in its axes, m; or {joint: point}.  on: "parent" for a point and axes that stay with the parent.
    components: a file or its tables, whose [cases] or [shares] say how often each load case occurs; otherwise each occurs once.
    Raises SizingError.  Cost: O(samples).

        s = ksl.spectra(loads, "elbow")
        s.duration, s.equivalent(3), s.rainflow_matrix("ty"), s.bearing(classes=12)
    """
    require("spectra", "pyarrow")
    with recorded() as ledger:
        table = results_given(results)
        parts = None if components is None else for_cases(table, components_given(components))
    spectrum = parts.spectrum if parts else Spectrum()
    one_of(on, "on", "child", "parent")
    names = [table.named(joint, "joint")] if isinstance(joint, str) else joints_given(table, joint)
    if joint is None:
        names = [name for name in names if table.joints[name].driven]
    points = points_given(table, at, names) if isinstance(at, Mapping) else dict.fromkeys(names, three_numbers(at, "at"))
    found = {name: _of_joint(table, name, spectrum, torque_edges, speed_edges, points.get(name, (0.0, 0.0, 0.0)), on) for name in names}
    return found[names[0]] if isinstance(joint, str) else SpectraOfJoints(found, table.robot, made_of(table, ledger.files, parts), _notes(table, parts))


def _of_joint(
    table: Results, name: str, spectrum: Spectrum, torque_edges: ArrayLike | None, speed_edges: ArrayLike | None, at: Sequence[float], on: str
) -> Spectra:
    samples = table.joint(name, spectrum)
    if on == "parent" and samples.joint.kind not in PLACED:
        raise SizingError(f'on="parent" needs a joint that turns or slides along one axis, and {name} is {samples.joint.kind}')
    placed = samples.fixed_to_parent(at) if on == "parent" else samples.about(at)
    speed = placed.speed if samples.joint.driven else np.zeros(0)  # rainflow counts need no speed
    edges = edges_given(torque_edges, torque_of(placed), "torque_edges"), edges_given(speed_edges, speed, "speed_edges")
    return Spectra(placed, *edges, bool(spectrum.shares))


def _notes(table: Results, parts: Components | None) -> tuple[str, ...]:
    return (*table.notes, *([parts.left_out_spectrum] if parts and parts.left_out_spectrum else []))
