"""`ksl.free_bodies`: load cases of parts, from a run or from results."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Literal

import numpy as np

from ksl.base.errors import ArgumentError, name_among, of_argument, unknown_name
from ksl.load_cases.computed_cases import ComputedCases
from ksl.load_cases.provenance import versions
from ksl.mechanism import given
from ksl.mechanism.lengths import extent, far_point
from ksl.mechanism.requests import names_in_order, one_of
from ksl.mechanism.states import Array
from ksl.parts.bodies import Welded
from ksl.parts.cases import FreeBodyCase
from ksl.parts.free_body_cases import FreeBodyCases
from ksl.parts.instants import Chosen, Factors, Section, at_peaks, at_times, of_hull, of_sections, of_stress, section_given
from ksl.parts.sources import Moved, Results, moved_of

Instants = Literal["peaks", "hull"]


def free_bodies(
    results: Results,
    times: Iterable[float] | None = None,
    *,
    instants: Instants | None = None,
    joints: Iterable[str] | None = None,
    links: Iterable[str] | None = None,
    stress: Mapping[str, Factors] | None = None,
    sections: Mapping[str, Sequence[Section]] | None = None,
    most: int | None = None,
    frames: Mapping[str, given.PoseLike] | None = None,
    welded: Welded = "together",
    cases: Sequence[str] | None = None,
    robot: str | os.PathLike[str] | None = None,
) -> FreeBodyCases:
    """Self-equilibrated load cases of parts: each link with everything that acts on it, at chosen instants of motions.

    results: a run of :func:`ksl.compute_loads`, or the folder that `ksl loads` has written.  cases: load cases by name; all by default.
    robot: the robot's file, where results name one that has moved since.

    One of these says which instants:

    * times, s: the samples next to them;
    * instants="peaks", the default: where each component of each joint is largest, over all load cases; repeated ones are merged.
      joints: only of these; by default all joints of `links` that aren't welded inside them;
    * stress={link: factors}: `most` cases that keep as large a share as can be of all combinations of some stresses, which are linear in the
      link's wrenches: (stresses, 6 × wrenches) in the order of its `wrenches`, or {wrench: (stresses, 6)}, in the axes of the free body, those of the part with `frames`;
    * sections={link: [(point, normal), …]}: the same for the six loads of plane sections (:meth:`ksl.Model.section_wrench`), beside `stress` or alone.  A section may
      be a mapping with point, normal, that method's share and beyond, and factors (stresses, 6): then its stresses count, 1 to 6 of them, and not its six loads;
    * instants="hull": the same for whatever is linear in all wrenches of each of `links`: of smooth motions nearly every sample is needed.

    most: so many cases of each stressed thing; None: as many as keep all.  links: those whose free bodies are wanted; all by default.
    frames: {link: pose (4, 4)}: of the CAD part's frame in the link's; the free body is then in the part's axes, from its origin.
    welded: "together" or "apart", as in :meth:`ksl.Model.free_bodies`.

    Returns a sequence of cases, each with time, case, bodies {link: free body} and why, tuples of a joint and a component; `share`, the least that is kept;
    `notes`; and `write(folder)`.  O(samples × links), and linear programs for shares: milliseconds for each sample that is looked at.
    Raises MotionError, DescriptionError, ArgumentError.  Needs the extra `ksl[loads]`.

        run = ksl.compute_loads("robot.urdf", "motion.csv")
        cases = ksl.free_bodies(run, links=["forearm_link"])
        cases.write("parts")
    """
    one_of(welded, "welded", "together", "apart")
    moved = moved_of(results, cases, robot, welded)
    asked = {"times": times, "instants": instants, "sections" if stress is None else "stress": sections if stress is None else stress}
    if len(two := [name for name, x in asked.items() if x is not None]) > 1:
        raise ArgumentError(f"{two[0]} and {two[1]}: each says which instants; give one of them")
    if most is not None and (isinstance(most, bool) or not isinstance(most, int) or most < 1):
        raise ArgumentError(f"most={most!r}; expected a number of cases, 1 or more")
    stressed = [name for of in (stress, sections) if isinstance(of, Mapping) for name in of]
    bodies = _bodies(moved[0], dict.fromkeys(stressed), "stress" if stress else "sections") if links is None and stressed else _bodies(moved[0], links)
    poses = {} if frames is None else _of_bodies(moved[0], given.mapping(frames, "frames", "{link: pose (4, 4)}"), "frames")
    in_bodies = {top: _in_body(moved[0], link, pose, top) for top, (link, pose) in poses.items()}
    chosen = _chosen(moved, bodies, times, instants, joints, stress, sections, most, in_bodies)
    made = []
    for (i, k), why in sorted(chosen.why.items()):
        found = moved[i].only(k).free_bodies(0, bodies)
        shown = {top: body.in_frame(in_bodies[top]) if top in in_bodies else body for top, body in found.items()}
        made.append(FreeBodyCase(float(moved[i].time[k]), moved[i].case, shown, tuple(dict.fromkeys(why))))
    doubts = _doubts(moved[0], frames or {}, sections or {})
    return FreeBodyCases(made, dict(chosen.shares), (*doubts, *chosen.notes, *_open_notes(made)), _made_of(moved, results))


def _bodies(moved: Moved, links: Iterable[str] | None, argument: str = "links") -> list[str]:
    """The topmost links of the bodies that some links belong to; of all by default."""
    tops = moved.bodies.links_of
    if links is None:
        return list(tops)
    found = []
    for name in names_in_order(links, argument) or ():
        plain = name_among(moved.model.link_names, name, "link")
        if plain not in moved.model.link_names:
            raise of_argument(ArgumentError, argument, f": {unknown_name(moved.model.name, 'link', name, moved.model.link_names)}")
        found.append(next(top for top, members in tops.items() if plain in members))
    return list(dict.fromkeys(found))


def _chosen(
    moved: Sequence[Moved], bodies: Sequence[str], times: Iterable[float] | None, instants: Instants | None, joints: Iterable[str] | None,
    stress: Mapping[str, Factors] | None, sections: Mapping[str, Sequence[Section]] | None, most: int | None, poses: Mapping[str, Array],
) -> Chosen:  # fmt: skip
    if times is not None:
        return at_times(moved, np.atleast_1d(given.numbers(list(times) if isinstance(times, Iterable) else times, "times")).tolist())
    if stress is not None or sections is not None:
        chosen = Chosen()
        if stress is not None:
            by_body = _of_bodies(moved[0], given.mapping(stress, "stress", "{link: factors on its wrenches}"), "stress")
            of_stress(chosen, moved, {top: factors for top, (_, factors) in by_body.items()}, most, {top: pose[:3, :3] for top, pose in poses.items()})
        if sections is not None:
            of_sections(chosen, moved, given.mapping(sections, "sections", "{link: [(point, normal), …]}"), most)
        return chosen
    if instants is not None and one_of(instants, "instants", "peaks", "hull") == "hull":
        return of_hull(moved, bodies, most)
    return at_peaks(moved, _joints(moved[0], bodies) if joints is None else _joints_named(moved[0], joints))


def _joints(moved: Moved, bodies: Sequence[str]) -> list[str]:
    """The joints that act on the bodies from outside."""
    return list(dict.fromkeys(e.joint for top in bodies for e in moved.bodies.body(top).entries if e.joint))


def _joints_named(moved: Moved, joints: Iterable[str]) -> list[str]:
    found = []
    for name in names_in_order(joints, "joints") or ():
        plain = name_among(moved.bodies.joint_names, name, "joint")
        if plain not in moved.bodies.joint_names:
            raise of_argument(ArgumentError, "joints", f": {unknown_name(moved.model.name, 'joint', name, moved.bodies.joint_names)}")
        found.append(plain)
    return found


def _of_bodies(moved: Moved, by_link: Iterable[tuple[str, Any]], argument: str) -> dict[str, tuple[str, Any]]:
    """{topmost link: (link, what is given for it)}.  Raises ArgumentError where two links are of one body."""
    found: dict[str, tuple[str, Any]] = {}
    for link, x in by_link:
        top = _bodies(moved, [link], argument)[0]
        if top in found:
            raise of_argument(
                ArgumentError, argument, f": {found[top][0]} and {link} are links of one body, {top}; give one of them, or take welded links apart"
            )
        found[top] = (link, x)
    return found


def _in_body(moved: Moved, link: str, pose: given.PoseLike, top: str) -> Array:
    """A part's frame, given in a link's, in the frame of the topmost link that it is welded to."""
    in_link = np.reshape(given.pose(pose, f"frames of {link}", link), (4, 4))
    return np.asarray(moved.model.relative_pose(moved.q[0], f"link:{name_among(moved.model.link_names, link, 'link')}", f"link:{top}") @ in_link)


def _doubts(moved: Moved, frames: Mapping[str, given.PoseLike], sections: Mapping[str, Sequence[Section]]) -> list[str]:
    """Sentences about lengths that are likely in millimetres."""
    points = [(f"the frame of {link} is", given.pose(pose, f"frames of {link}", link)[3:12:4]) for link, pose in frames.items()]
    points += [
        (f"the section of {link} is", list(point)) for link, planes in sections.items() for plane in planes for point in [section_given(link, plane)["point"]]
    ]
    reach = extent(moved.model, [payload.carried for payload in moved.model.payloads]) if points else 0.0
    return [line for what, point in points for line in far_point(what, point, reach)]


def _open_notes(cases: Sequence[FreeBodyCase]) -> list[str]:
    """Bodies some of whose wrenches rigid bodies leave open."""
    found = dict.fromkeys(w.name for case in cases for body in case.bodies.values() for w in body.wrenches if w.undetermined.any())
    if not found:
        return []
    said = f"rigid bodies leave components open at {', '.join(found)}: free bodies with these are in balance, but not complete"
    return [f"{said}; stiffnesses of the joints (--stiffness of `ksl loads`) decide them"]


def _made_of(moved: Sequence[Moved], results: Results) -> dict[str, str]:
    """Where free bodies come from."""
    source = "a run in a program" if isinstance(results, ComputedCases) else os.path.abspath(results)
    return {"robot": moved[0].model.name, "robot file": moved[0].model.file, "results": source, "load cases": ", ".join(m.case for m in moved), **versions()}
