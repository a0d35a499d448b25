"""Robots and arguments of the tests of operators."""

import sys
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

import ksl

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "laws"))
from closed_mechanisms import random_case

ROBOTS = ("every kind", "coupled", "floating", "physics")


def robot_named(name: str) -> ksl.Model:
    """A robot with every kind of joint, one with joints that follow others, one that floats, and one with all physics of joints."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ksl.DescriptionWarning)  # types beyond URDF
        if name in ("every kind", "coupled"):
            return ksl.load(HERE.parent / f"engine/{name.replace(' ', '_')}.urdf")
        arm = ksl.load(HERE.parents[1] / "examples/robots/ur5.urdf", floating_base=name == "floating", physics="all" if name == "physics" else None)
    # Heavier, since accelerations of a light wrist bend too much for differences; and differences take masses below what they are.
    return arm.with_parameters(dict(zip(arm.link_names, arm.parameters + [0.3, 0, 0, 0, 0.05, 0, 0.05, 0, 0, 0.05])))


LINKS = {"frame_poses", "frame_velocities", "frame_accelerations"}


def call_of(d, name: str):
    """A function of the operator's arguments, of what ksl.torch.differentiable or ksl.jax.differentiable has made."""
    m, call = d.model, getattr(d, name)
    if name in LINKS:
        return lambda *x: call(*x, [m.link_names[-1], m.link_names[1]])
    if name == "reactions":
        return lambda *x: call(*x, joints=[j.name for j in m.joints][:3], at="world", axes=m.link_names[-1])
    return call


def given_to(m: ksl.Model, row, parameters: bool, n: int, seed: int):
    """Random arguments of a row."""
    return arguments(m, (*row.inputs, "parameters") if parameters else row.inputs, np.random.default_rng(seed), n)


PUSHED = [("inverse_dynamics", "link", False), ("inverse_dynamics", "world", True), ("forward_dynamics", "world", False), ("forward_dynamics", "link", True)]
"""Operators with external wrenches, the axes of these, and whether parameters of links are given, too."""


def pushed(call, m: ksl.Model, axes: str, parameters: bool):
    """The call as a function of its three arguments, a wrench on the last link, one on another, and parameters."""
    links = (m.link_names[-1], m.link_names[2])

    def called(x, y, z, f, g, *p):
        return call(x, y, z, *p, external=dict(zip(links, (f, g))), external_axes=axes)

    return called


def pushed_arguments(m: ksl.Model, name: str, parameters: bool, rng: np.random.Generator, n: int = 2) -> list[np.ndarray]:
    """The wrench on the other link is one for all states."""
    more = [rng.uniform(-9, 9, (n, 6)), rng.uniform(-9, 9, 6)]
    return [*arguments(m, ("q", "v", "a" if name == "inverse_dynamics" else "tau"), rng, n), *more, *([1.1 * m.parameters] if parameters else [])]


def arguments(m: ksl.Model, names: tuple[str, ...], rng: np.random.Generator, n: int) -> list[np.ndarray]:
    """Random arguments of these names; quaternions are not of unit length, since operators are functions of all numbers of q."""
    given = []
    for name in names:
        if name in ("q", "q0", "q1"):
            q = m.random(rng, size=n)
            given.append(q * rng.uniform(0.7, 1.4, size=(n, 1)) if any(j.quaternion is not None for j in m.joints) else q)
        elif name == "parameters":
            given.append(1.1 * m.parameters)
        else:
            given.append(rng.uniform(-1, 1, size=(n, m.nv)))
    return given


CLOSED = ("four-bar", "Stewart platform", "quaternions")
"""Mechanisms with loops, the last with two spherical joints, of which one is driven, and one follows."""


@dataclass(frozen=True)
class Closed:
    """A closed mechanism at a position, and the joints from which all coordinates follow there."""

    model: ksl.Model
    q: np.ndarray
    drives: list[str]

    @property
    def driven(self) -> list[int]:
        """Their coordinates in v."""
        return [i for name in self.drives for i in range(self.model.joint(name).v_index, self.model.joint(name).v_index + self.model.joint(name).nv)]

    def near(self, rng: np.random.Generator, n: int, by: float = 0.1) -> np.ndarray:
        """Closed positions (n, nq) beside it."""
        dq = np.zeros((n, self.model.nv))
        dq[:, self.driven] = rng.uniform(-by, by, (n, len(self.driven)))
        found = self.model.close(self.model.integrate(self.q, dq), hold=self.drives)
        assert found.converged.all()
        return found.q

    def motions(self, rng: np.random.Generator, n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        q = self.near(rng, n)
        v, a = rng.uniform(-1, 1, (2, n, self.model.nv))
        v = self.model.consistent_velocity(q, v, self.drives)
        return q, v, self.model.consistent_acceleration(q, v, a, self.drives)


def along(close: Callable, velocity: Callable, acceleration: Callable, drives: list[str]):
    """The closed motion, of any library, that has the coordinates of the drives as in these numbers; the others of q say from where the search starts."""

    def motion(q, v, a):
        q = close(q, drives)
        v = velocity(q, v, drives)
        return q, v, acceleration(q, v, a, drives)

    return motion


@cache
def closed_named(name: str) -> Closed:
    """A mechanism of CLOSED, or a random one that this kind of joint closes, as test/laws has them."""
    if name == "four-bar":
        return _four_bar()
    if name == "Stewart platform":
        return _stewart_platform()
    if name == "quaternions":
        return _two_balls()
    for seed in range(100):
        c = random_case(name, seed)
        found = Closed(c.model, c.q, c.drives)
        if 0 < c.model.mobility(c.q).mobility == len(found.driven):
            return found
    raise AssertionError(f"no {name}")


def _at(x: float = 0, y: float = 0, z: float = 0) -> np.ndarray:
    pose = np.eye(4)
    pose[:3, 3] = x, y, z
    return pose


def _four_bar() -> Closed:
    """Planar, with all physics of joints, a spring and damper between two points, and a fan that follows the crank."""
    b = ksl.Builder("four-bar").add_link("ground", mass=1.0, inertia=np.eye(3))
    for name, mass, length, parent, x in (("crank", 1.0, 0.2, "ground", 0.0), ("coupler", 2.0, 0.6, "crank", 0.2), ("rocker", 1.5, 0.5, "ground", 0.6)):
        b.add_link(name, mass=mass, center_of_mass=(length / 2, 0, 0), inertia=np.diag([0.001, 1, 1]) * mass * length**2 / 12)
        b.add_joint(f"to {name}", "continuous", parent, name, pose=_at(x), axis=(0, 1, 0), damping=0.3, friction=0.2, armature=0.02, spring_stiffness=1.5)
    b.add_link("fan", mass=0.2, center_of_mass=(0, 0, 0.1), inertia=np.eye(3) * 0.01).add_joint(
        "to fan", "continuous", "coupler", "fan", axis=(1, 0, 0), mimic=("to crank", -2.0, 0.1)
    )
    b.add_force_element("spring", "ground", (0.1, 0, -0.3), "rocker", (0.2, 0, 0), stiffness=80.0, free_length=0.2, damping=5.0)
    b.add_loop("closure", "revolute", "coupler", "rocker", _at(0.6), _at(0.5), axis=(0, 1, 0))
    m = b.build(drives=["to crank"], physics=["all", "force elements"], friction_width=1.0)
    return Closed(m, m.close([-1.0, 0.4, -1.5], hold=["to crank"]).q, ["to crank"])


def _two_balls() -> Closed:
    """The second link keeps its axes, whatever the first does."""
    b = ksl.Builder("two balls").add_link("ground", mass=1.0, inertia=np.eye(3))
    for name, parent, place in (("first", "ground", _at(0.1, 0.2)), ("second", "first", _at(0.3, -0.1, 0.2))):
        b.add_link(name, mass=2.0, center_of_mass=(0.2, 0.1, -0.1), inertia=np.diag([0.2, 0.3, 0.4])).add_joint(
            f"to {name}", "spherical", parent, name, pose=place
        )
    m = b.add_loop("slides", "translation", "second", "ground", _at(0.1), _at(0, 0.2)).build(drives=["to first"])
    first = np.array([0.1, 0.5, -0.2, 0.8])
    return Closed(m, m.close([*first / np.linalg.norm(first), 0, 0, 0, 1], hold=["to first"]).q, ["to first"])


def _stewart_platform() -> Closed:
    """Six legs, each with a universal joint below and a spherical one, which closes a loop, above; 24 coordinates."""
    b = ksl.Builder("Stewart platform").add_link("ground", mass=1.0, inertia=np.eye(3))
    b.add_link("platform", mass=20.0, center_of_mass=(0, 0, 0.05), inertia=np.diag([0.5, 0.6, 1.0])).add_joint("free", "floating", "ground", "platform")
    for k in range(6):
        below, above = (np.deg2rad(120 * (k // 2) + (turn if k % 2 else -turn)) for turn in (15, 45))
        b.add_link(f"cylinder{k}", mass=2.0, center_of_mass=(0, 0, 0.3), inertia=np.diag([0.06, 0.06, 0.003]))
        b.add_link(f"rod{k}", mass=1.0, center_of_mass=(0, 0, -0.2), inertia=np.diag([0.03, 0.03, 0.001]))
        b.add_joint(f"U{k}", "universal", "ground", f"cylinder{k}", pose=_at(0.8 * np.cos(below), 0.8 * np.sin(below)), axis=(1, 0, 0), axis2=(0, 1, 0))
        b.add_joint(f"P{k}", "prismatic", f"cylinder{k}", f"rod{k}", axis=(0, 0, 1))
        b.add_loop(f"S{k}", "spherical", f"rod{k}", "platform", _at(), _at(0.5 * np.cos(above), 0.5 * np.sin(above)))
    m = b.build(drives=[f"P{k}" for k in range(6)])
    q = m.neutral()
    q[2] = 0.9
    for k in range(6):
        q[m.joint(f"P{k}").q_index] = 1.0
    return Closed(m, m.close(q, hold=["free"]).q, list(m.drives))
