"""Requests by name, converted for the compiled calls: links, joints, and how wrenches are expressed.

Requests are cached, since making one takes longer than the dynamics of a state.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterable, Sequence
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from ksl import _core
from ksl.base.errors import ArgumentError, near_names, of_argument
from ksl.base.files_read import InputFile
from ksl.base.printable import sentence
from ksl.base.real_arrays import real_array
from ksl.mechanism.mechanism import Mechanism
from ksl.mechanism.payload import Payload
from ksl.mechanism.states import Point

T = TypeVar("T", str, int)

REQUESTS_KEPT = 64
KINDS = ("spatial", "classical", "rate")
"""Kinds of accelerations, in the order of the compiled calls."""

WORLD = "ksl:world"
"""The world as a point or axes, whatever links are called."""

_PLAIN_NUMBERS = frozenset((float, int))
_pack_three = struct.Struct("3d").pack
_ANGULAR_FIRST = _core.Links([], angular_first=True)


class Requests(Mechanism):
    """A mechanism with a cache of its requests."""

    def __init__(self, core: _core.Model, inputs: tuple[InputFile, ...] = (), payloads: tuple[Payload, ...] = ()) -> None:
        self._requests: dict[tuple[object, ...], _core.Request] = {}
        self._link_lists: dict[tuple[object, ...] | str | None, _core.Links] = {}
        super().__init__(core, inputs, payloads)

    def _links_of(self, names: Iterable[str] | None, order: str = "lin_ang") -> _core.Links:
        """The request for `frame_poses` of these names.  Cached, since looking names up takes longer than computing the poses of a state."""
        if type(order) is not str or order != "lin_ang":
            return self._frames_of(names, "frame", "frame", order)
        key = names_in_order(names, "names")
        try:
            links = self._link_lists.get(key)
        except TypeError:  # a list, say, instead of a name: refused below
            links = None
        if links is None:
            links = _core.Links(self._frame_links(key))
            self._keep_links(key, links)
        return links

    def _own_links_of(self, names: Iterable[str] | None, order: str = "lin_ang") -> _core.Links:
        """The request of regressors: links, for which joints that carry them don't stand."""
        names = names_in_order(names, "links")
        key = ("links alone", names, order)
        try:
            links = self._link_lists.get(key)
        except TypeError:  # refused below
            links = None
        if links is None:
            wanted = self.link_names if names is None else [names] if isinstance(names, str) else names
            angular_first = one_of(order, "order", "lin_ang", "ang_lin") == "ang_lin"
            links = _core.Links([self._index(self._link_index, name, "link") for name in wanted], angular_first=angular_first)
            self._keep_links(key, links)
        return links

    def _frame_links(self, names: tuple[str, ...] | str | None) -> list[int]:
        """Links by index; all of them for None."""
        return list(range(len(self.links))) if names is None else [self.frame_link(name) for name in ([names] if isinstance(names, str) else names)]

    def _held_of(self, names: Iterable[str] | None) -> _core.Links:
        """The request for `hybrid_dynamics`: joints whose accelerations are given.  Every one must be able to move, by itself or with its leader."""
        names = names_in_order(names, "names")
        key = ("joints held", names)
        try:
            links = self._link_lists.get(key)
        except TypeError:  # refused below
            links = None
        if links is None:
            moving = self.joints[: self._moving + self._followers]
            wanted = [joint.name for joint in moving] if names is None else [names] if isinstance(names, str) else names
            chosen = [self.joint(name) for name in wanted]
            require_once([joint.name for joint in chosen], "names")
            for joint in chosen:
                if joint.nv == 0 and joint.leader is None:
                    raise ValueError(
                        sentence(f"names: {joint.name!r} is a fixed joint, which has no acceleration to be given; name joints that move, or leave it out")
                    )
            links = _core.Links([self._children[joint.name] for joint in chosen])
            self._keep_links(key, links)
        return links

    def _order_of(self, order: str) -> _core.Links | None:
        """The request of results that aren't those of links, in this order."""
        if type(order) is str and order == "lin_ang":
            return None
        return _ANGULAR_FIRST if one_of(order, "order", "lin_ang", "ang_lin") == "ang_lin" else None

    def _keep_links(self, key: tuple[object, ...] | str | None, links: _core.Links) -> None:
        if len(self._link_lists) >= REQUESTS_KEPT:  # names that change from call to call
            self._link_lists.clear()
        self._link_lists[key] = links

    def _frames_of(self, names: Iterable[str] | None, axes: str, at: str, order: str, offset: ArrayLike | None = None, kind: str = "spatial") -> _core.Links:
        """Links, and how motions of their frames are expressed."""
        names = names_in_order(names, "names")
        point = None if offset is None else _offset_key(offset)
        key = (names, (axes, at, order, kind, point))
        try:
            request = self._link_lists.get(key) if offset is None or point is not None else None
        except TypeError:  # unhashable, for example a list instead of a word: refused below
            request = None
        if request is None:
            request = _core.Links(
                self._frame_links(names),
                world_axes=one_of(axes, "axes", "frame", "world") == "world",
                at_world=one_of(at, "at", "frame", "world") == "world",
                angular_first=one_of(order, "order", "lin_ang", "ang_lin") == "ang_lin",
                kind=KINDS.index(one_of(kind, "kind", *KINDS)),
                offset=(0.0, 0.0, 0.0) if offset is None else three_numbers(offset, "point or offset"),
            )
            if offset is None or point is not None:
                self._keep_links(key, request)
        return request

    def _point_of(self, name: str, axes: str, point: ArrayLike) -> _core.Links:
        """The request of calls about a point that is fixed in a link."""
        if point is None:  # no offset, elsewhere
            raise ValueError("point is None; expected three numbers, in the link's axes, m")
        return self._frames_of((name,), axes, "frame", "lin_ang", point)

    def _frame(self, name: str, what: str) -> tuple[_core.Frame, int]:
        """What `at` and `axes` name.  "joint" is always the joint's own, being the default; "world" must not be a link that is elsewhere."""
        word = name if isinstance(name, str) else ""
        if word in (WORLD, "world"):
            if word == "world" and not self._is_the_world(word):
                said = f"the world and also a link of {self.name or self.file}, which is elsewhere; say 'link:world' or '{WORLD}'"
                raise of_argument(ArgumentError, what, f": {said}", name)
            return _core.Frame.world, -1
        if word == "joint":
            return _core.Frame.joint, -1
        link = word.removeprefix("link:")
        link = link if link in self._link_index else word
        if link not in self._link_index or not isinstance(name, str):
            hint = near_names(name, ("joint", "world", *self._link_index))
            if word in self._children:
                hint = f"{name!r} is a joint, which carries link {self.links[self._children[name]].name!r}; "
            known = ", ".join(self._link_index)
            raise of_argument(ArgumentError, what, f": {hint}expected 'joint', 'world' or a link of {self.name or self.file}: {known}", name)
        return _core.Frame.link, self._link_index[link]

    def _is_the_world(self, link: str) -> bool:
        """Is there no link of this name, or does it stand at the world's origin in the world's axes?"""
        if link not in self._link_index:
            return True
        if any(self.joint(joint).nv or self.joint(joint).leader for joint in self.support(link)):
            return False
        pose = self._core.frame_poses(self.neutral(), None, None, None, None, _core.Links([self._link_index[link]]), None, None)
        return bool(np.allclose(pose[0], np.eye(4), rtol=0, atol=1e-12))

    def reaction_request(
        self, on: str = "child", at: Point = "joint", axes: str = "joint", order: str = "lin_ang", part: str = "total", joints: Iterable[str] | None = None
    ) -> _core.Request:
        """Which reactions :meth:`inverse_dynamics_with_reactions` shall give, and how; keywords as in :meth:`reactions`.

        Raises ValueError for sides, points, axes, orders, parts and joints that there are not.  Requests are kept for the next call with
        the same keywords, since making one takes longer than the dynamics of a state.
        """
        joints = names_in_order(joints, "joints")
        point = at if isinstance(at, str) else _offset_key(at)
        key = (on, point, axes, order, part, joints)
        try:
            request = self._requests.get(key)
        except TypeError:  # unhashable, for example a list instead of a name: refused below
            request = point = None
        if request is None:
            request = self._new_request(on, at, axes, order, part, joints)
            if point is not None:
                if len(self._requests) >= REQUESTS_KEPT:  # a point that changes from call to call
                    self._requests.clear()
                self._requests[key] = request
        return request

    def _carried_link(self, joint: str) -> int:
        """What a request calls a joint: the index of the link that it carries; for one that closes a loop, a number after those of all links."""
        loop = self._loop_index.get(self._plain(joint, "joint")) if isinstance(joint, str) else None
        if loop is not None:
            return len(self._link_index) + loop
        return self._link_index[self.joint(joint).child]

    def _new_request(self, on: str, at: Point, axes: str, order: str, part: str, joints: tuple[str, ...] | str | None) -> _core.Request:
        offset: Sequence[float] = (0.0, 0.0, 0.0)
        if not isinstance(at, str):
            offset, at = three_numbers(at, "at"), "joint"
        at_frame, at_link = self._frame(at, "at")
        axes_frame, axes_link = self._frame(axes, "axes")
        names = self.joint_names if joints is None else [joints] if isinstance(joints, str) else list(joints)
        return _core.Request(
            links=[self._carried_link(name) for name in names],
            part=getattr(_core.Part, one_of(part, "part", "total", "constraint", "actuation", "coupling")),
            on=getattr(_core.Side, one_of(on, "on", "child", "parent")),
            at=at_frame,
            at_link=at_link,
            offset=list(offset),
            axes=axes_frame,
            axes_link=axes_link,
            angular_first=one_of(order, "order", "lin_ang", "ang_lin") == "ang_lin",
        )


def core_of(model: Requests) -> _core.Model:
    """The compiled model, for rooms that have compiled calls of their own."""
    return model._core


def request_of_links(model: Requests, names: Iterable[str] | None) -> _core.Links:
    """The request of calls about links, as `frame_poses` takes names."""
    return model._links_of(names)


def request_of_frames(
    model: Requests, names: Iterable[str] | None, axes: str, at: str, order: str, offset: ArrayLike | None = None, kind: str = "spatial"
) -> _core.Links:
    """The request of calls about motions of frames; keywords as in `frame_acceleration`."""
    return model._frames_of(names, axes, at, order, offset, kind)


def request_of_order(model: Requests, order: str) -> _core.Links | None:
    """The request of results of six numbers that belong to no link."""
    return model._order_of(order)


def requests_given(requests: Iterable[_core.Request] | _core.Request) -> tuple[_core.Request, ...]:
    """What :meth:`Requests.reaction_request` made; one request stands for itself."""
    given = (requests,) if isinstance(requests, _core.Request) else tuple(requests) if isinstance(requests, Iterable) else (requests,)
    for each in given:
        if not isinstance(each, _core.Request):
            raise ValueError(f"requests: {type(each).__name__} is no request for reactions; expected what reaction_request returns, or a list of these")
    return given


def names_in_order(names: Iterable[str] | None, what: str) -> tuple[str, ...] | str | None:
    """Names as results follow them, and as a request can be kept by; one name stands for itself.  Raises ValueError for sets, which have no order."""
    if names is None or isinstance(names, (str, tuple)):
        return names
    if not isinstance(names, Iterable) or isinstance(names, (set, frozenset)):
        raise ValueError(f"{what}={names!r}; expected a list of names{', since a set has no order' if isinstance(names, (set, frozenset)) else ''}")
    return tuple(names)


def require_once(chosen: Sequence[T], what: str, shown: Callable[[T], object] = lambda x: x) -> None:
    """Raises ValueError where one is chosen twice, of arguments whose order doesn't matter: most likely another one was meant."""
    if len(set(chosen)) != len(chosen):
        raise ValueError(sentence(f"{what}: {shown(max(chosen, key=chosen.count))!r} is named more than once; name each once"))


def one_of(value: str, what: str, *known: str) -> str:
    if not isinstance(value, str) or value not in known:
        expected = f"; {near_names(value, known)}expected one of {', '.join(repr(k) for k in known)}"
        if len(repr(value)) <= 60:
            raise of_argument(ArgumentError, what, expected, value)
        raise ArgumentError(f"{what}={type(value).__name__}{expected}")  # an array at this place, say
    return value


def three_numbers(x: ArrayLike, what: str) -> tuple[float, float, float]:
    try:
        v = real_array(x, what).astype(float)
    except ValueError:
        v = np.empty(0)
    if v.shape != (3,) or not np.isfinite(v).all():
        shown = " ".join(repr(x).split())
        raise ValueError(f"{what} needs three finite numbers, found {shown if len(shown) <= 200 else type(x).__name__}")
    return float(v[0]), float(v[1]), float(v[2])


def _offset_key(at: Any) -> bytes | None:
    """A key that identifies an offset, with zeros of either sign distinct; None if only `three_numbers` can convert it."""
    numbers = at.tolist() if type(at) is np.ndarray else at
    if type(numbers) not in (list, tuple) or len(numbers) != 3:
        return None
    x, y, z = numbers
    if type(x) not in _PLAIN_NUMBERS or type(y) not in _PLAIN_NUMBERS or type(z) not in _PLAIN_NUMBERS:
        return None
    try:
        return _pack_three(x, y, z)
    except struct.error:  # an integer beyond all doubles
        return None
