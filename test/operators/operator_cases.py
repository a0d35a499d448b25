"""Robots and arguments of the tests of operators."""

import warnings
from pathlib import Path

import numpy as np

import ksl

HERE = Path(__file__).resolve().parent

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
