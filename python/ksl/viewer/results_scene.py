"""Motions and results of `ksl loads` as scenes."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from ksl.load_cases.case_files.results_model import external_of_results
from ksl.load_cases.results_table import SavedCase, motion_of_results
from ksl.mechanism.states import Array
from ksl.viewer.results_wrenches import with_wrenches
from ksl.viewer.scene import Scene, make_scene, thinned

if TYPE_CHECKING:
    from ksl.mechanism.calls import Calls


def scene_of_motion(
    model: Calls, time: Array, q: Array, v: Array, a: Array, external: Mapping[str, Array], package_paths: Sequence[str | os.PathLike[str]] = ()
) -> Scene:
    """The scene of a motion: of all its samples, or of about 1500 of them, the largest efforts included."""
    chosen = thinned(model.inverse_dynamics(q, v, a, external))
    wrenches = {name: w[chosen] for name, w in external.items()}
    scene = make_scene(model, q[chosen], v[chosen], a[chosen], time[chosen], wrenches, package_paths=package_paths)
    return replace(scene, samples=chosen)


def scene_of_results(model: Calls, results: SavedCase, package_paths: Sequence[str | os.PathLike[str]] = ()) -> tuple[Scene, list[str]]:
    """The scene of a load case, and notes.

    Positions and rates are those of the table where every joint has one coordinate, otherwise those of the motion file that the table names.
    Wrenches and efforts are those of the table.  They are compared with what the robot at hand gives; where the table holds some joints alone,
    those of others are computed, and robots that differ are refused.  Raises MotionError.
    """
    time, q, v, a = motion_of_results(model, results)
    external, why_none = external_of_results(model, results, time)
    scene = scene_of_motion(model, time, q, v, a, external, package_paths)
    kept = scene.samples
    wrenches = {name: replace(w, total=w.total[kept], constraint=w.constraint[kept]) for name, w in results.wrenches.items()}
    scene, differ = with_wrenches(scene, wrenches, {name: x[kept] for name, x in results.effort.items()}, not why_none)
    return scene, [*([f"external wrenches of the load case are not shown, since {why_none}"] if why_none else []), *differ]
