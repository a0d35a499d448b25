"""The loads of joints as functions of the masses that are chosen.

Wrenches and efforts of a given motion are linear in masses: those of one kilogram at each place are computed once, and every choice is then a sum.  The motion is
given: one that was simulated is not simulated again.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from ksl.base.errors import DescriptionWarning, SizingError, unknown_name
from ksl.load_cases.load_case import LoadCase
from ksl.load_cases.reaction_joints import has_drive
from ksl.mechanism.lengths import extent, far_point
from ksl.mechanism.states import Array
from ksl.sizing.catalogue.parts import Request
from ksl.sizing.samples import JointSamples

Place = tuple[str, tuple[float, float, float]]
"""A link, and a point from its origin in its axes, m."""


class LoadsWithMasses:
    """samples: of a joint without what is chosen.  requests: those with a link give the places."""

    def __init__(self, samples: Callable[[str], JointSamples], requests: Sequence[Request], cases: Callable[[], Sequence[LoadCase]]) -> None:
        self._samples = samples
        self.requests = tuple(requests)
        self.notes: list[str] = []
        self._of_one_kilogram: dict[Place, dict[str, Array]] = {}
        seats = [r for r in self.requests if r.link is not None]
        if seats:
            found = cases()
            for request in seats:
                self._add(request, found)

    def samples(self, joint: str, masses: Sequence[float]) -> JointSamples:
        """Loads of a joint with so much mass at the place of each request, kg; those without a link have none."""
        s = self._samples(joint)
        change = self._change(joint, masses)
        if change is None:
            return s
        force, moment, effort = change[:, :3], change[:, 3:6], change[:, 6]
        brake = None if s.brake is None else s.brake + effort  # NaN where drives supply the efforts
        return replace(s, force=s.force + force, moment=s.moment + moment, effort=s.effort + np.where(s.braked, 0.0, effort), brake=brake)

    def _change(self, joint: str, masses: Sequence[float]) -> Array | None:
        found = [m * self._of_one_kilogram[_place(r)][joint] for r, m in zip(self.requests, masses, strict=True) if r.link is not None and m]
        return np.asarray(sum(found[1:], found[0])) if found else None

    def _add(self, request: Request, cases: Sequence[LoadCase]) -> None:
        place = _place(request)
        model = cases[0].model
        if place[0] not in model.link_names:
            raise SizingError(unknown_name(request.where, "link", place[0], model.link_names))
        self.notes += far_point(f"{request.where}: what is chosen for {request.joint} is", place[1], extent(model))
        if place in self._of_one_kilogram:
            return
        parts = [_of_one_kilogram(case, place) for case in cases]
        self._of_one_kilogram[place] = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def _place(request: Request) -> Place:
    assert request.link is not None
    return request.link, request.at


def _of_one_kilogram(case: LoadCase, place: Place) -> dict[str, Array]:
    """{joint: (n, 7)}: what one kilogram at a place adds to the wrench on the child, about the joint's origin in its axes, and to the effort of the drive or brake."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DescriptionWarning)  # a note says it of the file
        heavier = replace(case, model=case.model.with_payload(place[0], 1.0, place[1]))  # type: ignore[attr-defined]
    joints, found = case.joints, []
    for with_it, without in zip(heavier.blocks(), case.blocks(), strict=True):
        change = with_it.total - without.total
        efforts = with_it.tau - without.tau
        drives = [efforts[:, j.v_index] if has_drive(case.model, j) else np.zeros(len(efforts)) for j in joints]
        found.append(np.concatenate([change, np.stack(drives, axis=1)[:, :, None]], axis=2))
    whole = np.concatenate(found)
    return {j.name: whole[:, k] for k, j in enumerate(joints)}
