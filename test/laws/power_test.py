"""Energy: what the joints and the environment supply is what the mechanism gains."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import ksl
from frames import coadjoint, requested, subspace
from newton_euler import adjoint, apply, read_tree, turn
from random_tree import Case, load_text, random_tree, witness

STENCIL = np.array([4 / 5, -1 / 5, 4 / 105, -1 / 280])
"""Central difference of order eight: offsets ± 1 … 4."""


class Sines:
    """Sums of sines with their derivatives."""

    def __init__(self, rng: np.random.Generator, width: int, size: float = 1.0) -> None:
        self.amplitude, self.rate, self.phase = rng.normal(size=(3, width)) * size / 2, rng.uniform(0.5, 3, (3, width)), rng.uniform(0, 6, (3, width))

    def __call__(self, t: np.ndarray, order: int = 0) -> np.ndarray:
        angle = t[:, None, None] * self.rate + self.phase + order * np.pi / 2
        return np.sum(self.amplitude * self.rate**order * np.sin(angle), axis=1)


def orientation(angles: Sines, t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Rotation (n, 3, 3), its quaternion, angular velocity and acceleration in the body's axes, of Rz(α) Ry(β) Rx(γ): closed form."""
    (al, be, ga), (al1, be1, ga1), (al2, be2, ga2) = (angles(t, k).T for k in range(3))
    R = (turn([0, 0, 1], al) @ turn([0, 1, 0], be) @ turn([1, 0, 0], ga))[:, :3, :3]
    half = lambda x: (np.cos(x / 2), np.sin(x / 2))
    (ca, sa), (cb, sb), (cg, sg) = half(al), half(be), half(ga)
    quaternion = np.stack([ca * cb * sg - sa * sb * cg, ca * sb * cg + sa * cb * sg, sa * cb * cg - ca * sb * sg, ca * cb * cg + sa * sb * sg], axis=1)
    sin, cos = np.sin, np.cos
    w = np.stack([ga1 - al1 * sin(be), be1 * cos(ga) + al1 * cos(be) * sin(ga), -be1 * sin(ga) + al1 * cos(be) * cos(ga)], axis=1)
    dw = np.stack(
        [
            ga2 - al2 * sin(be) - al1 * be1 * cos(be),
            be2 * cos(ga) - be1 * ga1 * sin(ga) + al2 * cos(be) * sin(ga) - al1 * be1 * sin(be) * sin(ga) + al1 * ga1 * cos(be) * cos(ga),
            -be2 * sin(ga) - be1 * ga1 * cos(ga) + al2 * cos(be) * cos(ga) - al1 * be1 * sin(be) * cos(ga) - al1 * ga1 * cos(be) * sin(ga),
        ],
        axis=1,
    )
    return R, quaternion, w, dw


def spherical_motion(angles: Sines, t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """q (n, 4), v (n, 3), a (n, 3)."""
    return orientation(angles, t)[1:]


def floating_motion(position: Sines, angles: Sines, t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """q (n, 7), v (n, 6), a (n, 6) of a body on a path."""
    R, quaternion, w, dw = orientation(angles, t)
    into_body = lambda x: np.einsum("nij,ni->nj", R, x)
    v = into_body(position(t, 1))
    return np.hstack([position(t), quaternion]), np.hstack([v, w]), np.hstack([into_body(position(t, 2)) - np.cross(w, v), dw])


def planar_motion(curve: Sines, t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """q (n, 3), v (n, 3), a (n, 3) of a body on a path in a plane."""
    (_, _, angle), (x1, y1, w), (x2, y2, dw) = (curve(t, k).T for k in range(3))
    cos, sin = np.cos(angle), np.sin(angle)
    vx, vy = cos * x1 + sin * y1, cos * y1 - sin * x1
    ax, ay = cos * x2 + sin * y2 + w * vy, cos * y2 - sin * x2 - w * vx
    return curve(t), np.stack([vx, vy, w], axis=1), np.stack([ax, ay, dw], axis=1)


SEVERAL_NUMBERS = {"floating": (floating_motion, 2), "spherical": (spherical_motion, 1), "planar": (planar_motion, 1)}
"""Kinds whose velocity is not the derivative of the position: how they move, and along how many curves in space."""


class SmoothMotion:
    """q(t), v(t), a(t) of all joints of a model in closed form."""

    def __init__(self, m: ksl.Model, rng: np.random.Generator) -> None:
        self.m = m
        self.curves = {
            j.name: [Sines(rng, 3) for _ in range(SEVERAL_NUMBERS[j.kind][1])] if j.kind in SEVERAL_NUMBERS else Sines(rng, j.nv) for j in m.joints if j.nv
        }

    def __call__(self, t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        q, v, a = np.empty((len(t), self.m.nq)), np.empty((len(t), self.m.nv)), np.empty((len(t), self.m.nv))
        for j in self.m.joints:
            if j.nv:
                curve, rows, cols = self.curves[j.name], slice(j.q_index, j.q_index + j.nq), slice(j.v_index, j.v_index + j.nv)
                moved = SEVERAL_NUMBERS[j.kind][0](*curve, t) if j.kind in SEVERAL_NUMBERS else (curve(t, k) for k in range(3))
                q[:, rows], v[:, cols], a[:, cols] = moved
        return q, v, a


def energy_rate(m: ksl.Model, motion: SmoothMotion, t: np.ndarray, h: float = 2e-3) -> np.ndarray:
    def energy(s):
        q, v, _ = motion(s)
        return np.sum(m.energy(q, v), axis=0)

    return sum(c * (energy(t + (k + 1) * h) - energy(t - (k + 1) * h)) for k, c in enumerate(STENCIL)) / h


@given(st.integers(0, 2**32 - 1), st.integers(1, 40), st.booleans())
def test_power_balance_along_a_smooth_motion(seed, bodies, floating):
    """Joint power + power of the environment = d/dt (kinetic + potential), the latter by differences of the energy alone."""
    rng = np.random.default_rng(seed)
    text = random_tree(rng, bodies)
    m = load_text(text, floating_base=floating)
    motion, t = SmoothMotion(m, rng), np.linspace(0, 2, 7)
    q, v, a = motion(t)
    external = {name: Sines(rng, 6, 20.0)(t) for name in m.link_names if rng.random() < 0.3}
    joints = np.sum(m.inverse_dynamics(q, v, a, external) * v, axis=1)
    w = witness(m, read_tree(text), q, v, a, external)
    environment = sum((np.sum(w.external[name] * w.twist[name], axis=1) for name in external), np.zeros(len(t)))
    gained = energy_rate(m, motion, t)
    scale = max(1.0, *(np.abs(x).max() for x in (joints, environment, gained)))
    assert np.abs(joints + environment - gained).max() < 1e-10 * scale, f"of {scale:.3g} W"


@given(st.integers(0, 2**32 - 1), st.integers(1, 20), st.booleans())
def test_power_is_the_same_in_any_frame(seed, bodies, floating):
    """Wrench · relative twist = effort · speed, wherever and in whatever axes both are expressed."""
    c = Case(seed, bodies, floating_base=floating)
    tau = c.m.inverse_dynamics(*c.state, c.external)
    at, axes = c.m.link_names[-1], "world"
    total, constraint = (c.all_reactions(at=at, axes=axes, part=p) for p in ("total", "constraint"))
    for i, j in enumerate(c.m.joints):
        cols = slice(j.v_index, j.v_index + j.nv) if j.nv else slice(0, 0)
        relative = np.einsum("nij,nj->ni", subspace(j, c.q), c.v[:, cols])
        X = np.swapaxes(np.linalg.inv(requested(c.m, c.q, j, at, axes)), 1, 2)  # twists move by the inverse transpose
        twist = (X @ relative[..., None])[..., 0]
        scale = max(1.0, np.abs(total[:, i]).max() * np.abs(twist).max(initial=0.0))
        assert np.abs(np.sum(total[:, i] * twist, axis=1) - np.sum(tau[:, cols] * c.v[:, cols], axis=1)).max() < 1e-11 * scale, j.name
        assert np.abs(np.sum(constraint[:, i] * twist, axis=1)).max() < 1e-11 * scale, f"the constraint of {j.name} works"


def test_twist_and_wrench_matrices_are_dual():
    """The witness's two conventions agree: adjoint and coadjoint pair to the same power."""
    rng = np.random.default_rng(3)
    T = turn([0.0, 0.6, 0.8], 1.2)
    T[:3, 3] = rng.normal(size=3)
    twist, wrench = rng.normal(size=(2, 6))
    moved = coadjoint(T[:3, :3], T[:3, 3]) @ wrench
    assert moved @ np.roll(apply(adjoint(T), np.roll(twist, 3)), 3) == pytest.approx(wrench @ twist, rel=1e-14)
