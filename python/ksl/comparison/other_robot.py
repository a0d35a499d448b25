"""A robot as another library has it: what each library's file fills in."""

from __future__ import annotations

from abc import ABC, abstractmethod
from contextlib import AbstractContextManager, nullcontext
from typing import NamedTuple

import numpy as np

from ksl.base.printable import sentence
from ksl.comparison.coordinates import Array, Form, Mapped
from ksl.comparison.results import Note
from ksl.mechanism.mechanism import Joint
from ksl.model.model import Model


class NotLoaded(Exception):
    """Why the library has no such robot, as a sentence."""


def said_by(error: Exception) -> str:
    """What a library says, in one line: its messages have several."""
    return sentence(" ".join(str(error).split()))


def check_root(file: File) -> None:
    """Raises NotLoaded where a root floats that other libraries take for the ground."""
    if file.floating_base and file.model.root == "world":
        raise NotLoaded("the root is called world, which is the ground there and can't float")


class File(NamedTuple):
    """A robot's file, as KSL has read it."""

    path: str
    contents: bytes
    format: str
    """urdf, sdf or mjcf."""
    model: Model
    """Mimic joints independent, loops cut."""
    floating_base: bool
    chosen: str | None = None
    """Which model of an SDF file that has several."""


class Place(NamedTuple):
    """Where the numbers of a joint are."""

    q: list[int]
    v: list[int]
    form: Form


class States(NamedTuple):
    """Positions (n, nq), and velocities, accelerations and efforts (n, nv), in KSL's layout."""

    q: Array
    v: Array
    a: Array
    tau: Array


class Numbers(NamedTuple):
    """What is compared, each with the states first."""

    efforts: Array
    """(n, nv)"""
    accelerations: Array | None
    """(n, nv); None where the forward dynamics have no result."""
    mass_matrix: Array
    """(n, nv, nv)"""
    poses: dict[str, Array]
    """{link: (n, 4, 4)}, in the world."""
    jacobians: dict[str, Array]
    """{link: (n, 6, nv)}, linear first, about the link's origin, in its axes."""


class OneState(NamedTuple):
    """What :class:`Numbers` holds, of one state and in the library's coordinates; columns of Jacobians are the library's, too."""

    efforts: Array
    accelerations: Array
    mass_matrix: Array
    poses: dict[str, Array]
    jacobians: dict[str, Array]


class OtherRobot(ABC):
    """The robot in another library.  A subclass loads it, and computes one state in the library's own coordinates."""

    library: str
    version: str
    gravity: Array
    neutral: Array
    """The robot's neutral position there, where joints are that KSL doesn't have."""
    nv: int

    def __init__(self, file: File) -> None:
        self.file, self.model = file, file.model
        self.conventions: list[Note] = []
        self.said: list[str] = []

    @abstractmethod
    def place(self, joint: Joint) -> Place | None:
        """Where a moving joint of KSL has its numbers; None if there is no such joint, or one of another kind."""

    @abstractmethod
    def note(self) -> None:
        """Adds the conventions that this robot meets to `conventions`."""

    @abstractmethod
    def links(self) -> list[str]:
        """The links of KSL that it has frames of."""

    @abstractmethod
    def bodies(self) -> dict[str, Array]:
        """{a link of each moving body: pseudo-inertia (4, 4) of the whole body, in that link's frame}, as `bodies.py` has it."""

    @abstractmethod
    def compute(self, q: Array, v: Array, a: Array, tau: Array, links: list[str]) -> OneState:
        """One state in its own coordinates."""

    def effects(self) -> dict[str, str]:
        """{topic: what it is} of forces that this robot has and KSL never has, whatever its options: they can be turned off by :meth:`without`."""
        return {}

    def without(self, topics: frozenset[str]) -> AbstractContextManager[None]:
        """While it is entered, these effects are off."""
        return nullcontext()

    def places(self) -> dict[str, Place]:
        """The places of all moving joints.  Raises NotLoaded where one is missing: dynamics of another tree are no comparison."""
        found = {name: self.place(self.model.joint(name)) for name in self.model.joint_names}
        absent = [f"{name} ({self.model.joint(name).kind})" for name, place in found.items() if place is None]
        if absent:
            raise NotLoaded(f"it has no such joint as {', '.join(absent[:5])}{' …' if len(absent) > 5 else ''}: its coordinates are others")
        return {name: place for name, place in found.items() if place is not None}

    def placement(self, joint: Joint) -> Array:
        """The pose (4, 4) of a joint in the world, its child being at the joint's zero, for joints that the ground carries."""
        return self.model.frame_pose(self.model.neutral(), f"link:{joint.child}")

    def map(self, q: Array, v: Array) -> Mapped:
        """Positions and velocities of all joints in its layout."""
        places = self.places()
        other_q = np.tile(self.neutral, (len(q), 1))
        T, rate = np.zeros((len(q), self.nv, self.model.nv)), np.zeros((len(q), self.nv))
        for name, place in places.items():
            joint = self.model.joint(name)
            own = slice(joint.v_index, joint.v_index + joint.nv)
            mapped = place.form(q[:, joint.q_index : joint.q_index + joint.nq], v[:, own])
            other_q[:, place.q], rate[:, place.v] = mapped.q, mapped.rate
            T[:, place.v, own] = mapped.T
        return Mapped(other_q, T, rate)

    def numbers(self, states: States) -> Numbers:
        """All numbers of these states, in KSL's coordinates."""
        mapped = self.map(states.q, states.v)
        if self.nv != self.model.nv:
            raise NotLoaded(f"it has {self.nv} coordinates of velocity, and KSL has {self.model.nv}")
        links, rows = self.links(), []
        for i in range(len(states.q)):
            T, rate = mapped.T[i], mapped.rate[i]
            back = np.linalg.inv(T)
            one = self.compute(mapped.q[i], T @ states.v[i], T @ states.a[i] + rate, back.T @ states.tau[i], links)
            jacobians = {link: J @ T for link, J in one.jacobians.items()}
            rows.append(OneState(T.T @ one.efforts, back @ (one.accelerations - rate), T.T @ one.mass_matrix @ T, one.poses, jacobians))
        efforts, accelerations, mass_matrix = (np.stack([np.asarray(row[k]) for row in rows]) for k in range(3))
        poses, jacobians = ({link: np.stack([row[k][link] for row in rows]) for link in links} for k in (3, 4))  # type: ignore[call-overload]
        return Numbers(efforts, accelerations, mass_matrix, poses, jacobians)


def numbers_of_ksl(model: Model, states: States, links: list[str]) -> Numbers:
    """All numbers of these states by KSL.  Accelerations are None where a joint moves no mass."""
    q, v, a, tau = states
    try:
        accelerations = model.forward_dynamics(q, v, tau)
    except ValueError:
        accelerations = None
    frames = {link: f"link:{link}" for link in links}  # a joint may have the same name
    poses = dict(zip(links, np.moveaxis(model.frame_poses(q, list(frames.values())), 1, 0))) if links else {}
    jacobians = {link: model.jacobian(q, frame) for link, frame in frames.items()}
    return Numbers(model.inverse_dynamics(q, v, a), accelerations, model.mass_matrix(q), poses, jacobians)
