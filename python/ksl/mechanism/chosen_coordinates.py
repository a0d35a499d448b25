"""Coordinates that a call about loops holds or gets: by the names of joints, or by their indices."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from ksl.base.printable import sentence
from ksl.mechanism import given
from ksl.mechanism.mechanism import Joint
from ksl.mechanism.requests import Requests, require_once

Chosen = Iterable[str | int]
"""Joints by name, or single coordinates by their index into v, as :meth:`ksl.Model.independent` has them."""


class ChosenCoordinates(Requests):
    """Requests that name coordinates."""

    def _chosen(self, chosen: Chosen, what: str) -> list[str | int]:
        """Names, and indices as plain numbers; one of either stands for itself."""
        if not isinstance(chosen, Iterable) and not given.is_index(chosen):
            raise ValueError(f"{what}={chosen!r}; expected a list of names of joints, or of indices into v")
        each = np.atleast_1d(chosen) if isinstance(chosen, np.ndarray) else [chosen] if isinstance(chosen, str) or not isinstance(chosen, Iterable) else chosen
        return [int(x) if given.is_index(x) else given.name(x, f"one of {what}") for x in each]

    def _coordinates_of(self, chosen: Chosen, what: str) -> list[int]:
        """The coordinates in v of joints of the tree that move."""
        coordinates: list[int] = []
        for x in self._chosen(chosen, what):
            if isinstance(x, str):
                coordinates += self._own_coordinates.get(x) or self._coordinates_of_joint(x, what)
            elif 0 <= x < self.nv:
                coordinates.append(x)
            else:
                raise ValueError(f"{what}: {x} is no index into v; expected 0 to {self.nv - 1}, or the name of a joint")
        require_once(coordinates, what, lambda i: self._joint_at(i).name)
        return coordinates

    def _coordinates_of_joint(self, name: str, what: str) -> tuple[int, ...]:
        if self._plain(name, "joint") in self._loop_index:
            raise ValueError(f"{what}: {name!r} closes a loop, and has no coordinates; name joints of the tree")
        joint = self.joint(name)
        if joint.nv == 0:
            said = f"follows {joint.leader!r}; name that one" if joint.leader else "is fixed; leave it out"
            raise ValueError(f"{what}: joint {name!r} {said}")
        return self._own_coordinates[joint.name]

    def _joint_at(self, coordinate: int) -> Joint:
        return next(joint for joint in self.joints if joint.v_index <= coordinate < joint.v_index + joint.nv)

    def _held_of_positions(self, hold: Chosen) -> list[int]:
        """Coordinates whose positions are held; a quaternion as a whole, since its coordinates are those of motions alone."""
        held = self._coordinates_of(hold, "hold")
        for joint in self.joints[: self._moving] if self._quaternions else ():
            own = self._own_coordinates[joint.name]
            if joint.quaternion is not None and 0 < len(alone := [i for i in own if i in held]) < len(own):
                raise ValueError(
                    sentence(f"hold: {alone[0]} is one of the coordinates of joint {joint.name!r}, whose position has a quaternion; name the joint")
                )
        return held

    def _numbers_held(self, joint: Joint, held: Sequence[int]) -> list[int]:
        """Which numbers of a joint in q are kept with these coordinates."""
        own = self._own_coordinates[joint.name]
        if joint.quaternion is None:  # as many as in v
            return [joint.q_index + i - joint.v_index for i in own if i in held]
        return list(range(joint.q_index, joint.q_index + joint.nq)) if own[0] in held else []


def coordinates_of(model: ChosenCoordinates, chosen: Chosen, what: str) -> list[int]:
    """The coordinates in v of joints of the tree that move.  what: the argument that names them, for messages."""
    return model._held_of_positions(chosen) if what == "hold" else model._coordinates_of(chosen, what)
