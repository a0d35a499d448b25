"""Identities between algorithms on a hundred random trees, on thousands with --long: every kind of joint, mimics, up to 64 bodies, double and float.

Where nothing is solved, errors are at most 1e-12 (double) or 1e-5 (float) of the sum of the norms of what is added.  What a solve
enters is held to C n u cond(M): n links, u = eps / 2, cond(M) the condition of the mass matrix.

`python identities_test.py` prints the largest errors in these units.  Of 1,000 trees they were 2e-15 and 9e-7 of the sum of norms
without a solve, both for the rate of M, which is a sum of nv derivatives; and with one C = 1.7, in a tree of few links.
"""

from __future__ import annotations

import numpy as np
import pytest

import ksl
import random_cases
from newton_euler import skew
from projection import with_mimics
from random_tree import load_text, random_external, random_model, random_states, random_tree

TREES = random_cases.MANY // 20
CHUNKS = 10
"""Tests that the trees are divided into, so that they can run beside each other."""
LIMIT = {np.float64: 1e-12, np.float32: 1e-5}
C = 5.0
"""Three times the largest of those measured."""
TYPES = (np.float64, np.float32)
PLACES = (("frame", "frame", "spatial"), ("world", "frame", "classical"), ("world", "world", "spatial"))
"""axes, at, and the kind of acceleration that is the rate of the velocity's numbers."""


def norm(x: np.ndarray) -> float:
    return float(np.sqrt(np.sum(np.asarray(x, float) ** 2)))


def times(A: np.ndarray, x: np.ndarray) -> np.ndarray:
    return np.einsum("...ij,...j->...i", A.astype(float), x)


class Tree:
    """A random robot in one state, and the errors of the identities there."""

    def __init__(self, seed: int, scalar: type) -> None:
        rng = np.random.default_rng(seed)
        bodies, self.heavy, floating = int(rng.integers(1, 65)), bool(rng.integers(2)), bool(rng.integers(2))
        if seed % 8:
            self.m = random_model(rng, bodies, massless=0.0 if self.heavy else 0.15, floating_base=floating)
        else:  # only files have mimics
            self.m = load_text(with_mimics(random_tree(rng, bodies), rng), floating_base=floating)
            self.heavy = min(link.mass for link in self.m.links) > 0
        self.scalar, self.rng = scalar, rng
        state = *random_states(self.m, rng, 1), rng.normal(size=(1, self.m.nv)) * 10
        self.external = {name: w[0].astype(scalar) for name, w in random_external(self.m, rng, 1).items()}
        self.single = [x[0].astype(scalar) for x in state]
        self.q, self.v, self.a, self.tau = (x.astype(float) for x in self.single)
        self.names = [j.name for j in self.m.joints]
        self.errors: dict[str, float] = {}

    def call(self, name: str, of: str = "q", *rest, **options) -> np.ndarray:
        """An algorithm's result for some of q, v, a and tau, in the scalar of this test."""
        return getattr(self.m, name)(*(self.single["qvat".index(x)] for x in of), *rest, **options)

    def close(self, law: str, difference: np.ndarray, *added: np.ndarray | float) -> None:
        """Keeps the error as a share of the sum of the norms of what was added."""
        scale = sum(norm(x) for x in added)
        error = norm(difference)
        self.errors[law] = max(self.errors.get(law, 0.0), error / scale if error else 0.0)

    def run(self) -> dict[str, float]:
        self.M, self.bias = self.call("mass_matrix").astype(float), self.call("bias", "qv", self.external).astype(float)
        self.reactions = self.call("reactions", "qva", self.external, joints=self.names).astype(float)
        self.load = sum(norm(w) for w in self.reactions)
        self.velocity, self.acceleration = (self.call(f"frame_{x}", of) for x, of in (("velocities", "qv"), ("accelerations", "qva")))
        self.mass_and_efforts()
        self.coriolis_and_energy()
        self.momentum()
        self.frames()
        self.regressors()
        self.balance()
        return self.errors

    def mass_and_efforts(self) -> None:
        M, v = self.M, self.v
        if not self.m.follower_names:
            assert np.array_equal(M, M.T)
        self.close("mass matrix is symmetric", M - M.T, M)
        self.close("mass matrix: kinetic energy", v @ M @ v / 2 - float(self.call("energy", "qv")[0]), norm(v) ** 2 * norm(M))
        efforts = self.call("inverse_dynamics", "qva", self.external)
        self.close("efforts are M a + bias", M @ self.a + self.bias - efforts, norm(M) * norm(self.a), self.bias, self.load)

    def coriolis_and_energy(self) -> None:
        """The rate of M from derivatives of efforts: column j of ∂(M e_j)/∂q v."""
        m, v, nv = self.m, self.v, self.m.nv
        C, gravity = self.call("coriolis_matrix", "qv").astype(float), self.call("gravity_torque").astype(float)
        unit = np.vstack([np.eye(nv), np.zeros((1, nv))]).astype(self.scalar)
        by_q = m.inverse_dynamics_derivatives(np.tile(self.single[0], (nv + 1, 1)), 0 * unit, unit)[0].astype(float)
        rate = np.einsum("jik,k->ij", by_q[:-1] - by_q[-1], v)
        scale = norm(by_q) * norm(v)
        self.close("rate of M is C + Cᵀ", rate - C - C.T, scale, C)
        plain = self.call("bias", "qv").astype(float)
        self.close("bias is C v + gravity", C @ v + gravity - plain, norm(C) * norm(v), gravity, plain)
        power = v @ self.call("inverse_dynamics", "qva", self.external)
        if self.external:
            power += float(self.call("external_power", "qv", self.external))
        gained = v @ self.M @ self.a + v @ rate @ v / 2 + v @ gravity
        flow = [np.abs(np.asarray(w, float)) @ np.abs(np.asarray(self.velocity[m.link_names.index(k)], float)) for k, w in self.external.items()]
        self.close("energy rate", power - gained, norm(v) * (norm(self.M) * norm(self.a) + self.load + norm(rate) * norm(v)), *flow)
        mass = sum(link.mass for link in m.links)
        if nv and np.isfinite(center := self.call("center_of_mass_velocity", "qv")).all():
            moving = self.moving_mass()
            lifted = -moving * np.asarray(m.gravity) @ center.astype(float)
            self.close("rate of potential energy", v @ gravity - lifted, norm(v) * norm(gravity), mass * norm(m.gravity) * norm(center))

    def moving_mass(self) -> float:
        welded = set()
        for j in self.m.joints:  # the ground last: names of links that it carries, through fixed joints
            if j.parent is None and j.kind == "fixed":
                welded.add(j.child)
        while more := {j.child for j in self.m.joints if j.kind == "fixed" and j.parent in welded} - welded:
            welded |= more
        return sum(link.mass for link in self.m.links if link.name not in welded)

    def momentum(self) -> None:
        m, v = self.m, self.v
        h, A = self.call("centroidal_momentum", "qv").astype(float), self.call("centroidal_momentum_matrix")
        self.close("momentum map", times(A, v) - h, norm(A) * norm(v))
        if self.moving_mass() and m.nv:
            of_links = np.einsum("clp,lp->lc", self.call("momentum_regressor", "qv").astype(float), m.parameters)
            total, c = of_links.sum(axis=0), self.call("center_of_mass").astype(float)
            about = np.concatenate([total[:3], total[3:] - np.cross(c, total[:3])])
            self.close("momentum is that of the links", about - h, *of_links, norm(c) * sum(norm(p[:3]) for p in of_links))

    def frames(self) -> None:
        for name in self.rng.choice(self.m.link_names, 2):
            axes, at, kind = PLACES[self.rng.integers(3)]
            where = {"axes": axes, "at": at}
            J, rate = self.call("jacobian", "q", name, **where), self.call("jacobian_rate", "qv", name, **where)
            velocity, acceleration = self.call("frame_velocity", "qv", name, **where), self.call("frame_acceleration", "qva", name, kind=kind, **where)
            self.close("J v is the velocity", times(J, self.v) - velocity, norm(J) * norm(self.v))
            added = norm(J) * norm(self.a), norm(rate) * norm(self.v), norm(velocity) ** 2
            self.close("J a + rate of J v is the acceleration", times(J, self.a) + times(rate, self.v) - acceleration, *added)

    def regressors(self) -> None:
        phi = self.m.parameters
        Y, efforts = self.call("inverse_dynamics_regressor", "qva"), self.call("inverse_dynamics", "qva")
        of_links = np.einsum("jlp,lp->lj", Y.astype(float), phi)
        self.close("regressor times parameters", of_links.sum(axis=0) - efforts, *of_links, self.load)

    def balance(self) -> None:
        """Free-body diagram of each link about its origin, in its axes: own joint − joints of its children + environment + weight."""
        m, links = self.m, {name: i for i, name in enumerate(self.m.link_names)}
        carrier = {j.child: i for i, j in enumerate(m.joints)}
        V, A = self.velocity.astype(float), self.acceleration.astype(float)
        poses = self.call("frame_poses").astype(float)
        R = poses[:, :3, :3]
        free = A.copy()
        free[:, :3] -= np.einsum("lij,i->lj", R, m.gravity)
        momentum, rate = inertias(m) @ V[..., None], inertias(m) @ free[..., None]
        p, L, v, w = momentum[:, :3, 0], momentum[:, 3:, 0], V[:, :3], V[:, 3:]
        needed = rate[..., 0] + np.concatenate([np.cross(w, p), np.cross(w, L) + np.cross(v, p)], axis=1)
        exerted = np.array([self.reactions[carrier[name]] for name in m.link_names])
        added = norm(needed) + norm(exerted)
        for name, wrench in self.external.items():
            exerted[links[name]] += wrench
            added += norm(wrench)
        for j in m.joints:
            if j.parent is not None:
                k, i = links[j.parent], links[j.child]
                turned = R[k].T @ R[i] @ self.reactions[carrier[j.child]].reshape(2, 3).T
                arm = R[k].T @ (poses[i, :3, 3] - poses[k, :3, 3])
                exerted[k] -= np.concatenate([turned[:, 0], turned[:, 1] + np.cross(arm, turned[:, 0])])
        self.close("every body is in balance", exerted - needed, added, norm(poses[:, :3, 3]) * added)

    def solves(self) -> dict[str, float]:
        """Errors of what a solve enters, in units of n u cond(M); needs `run`, and links that all have mass."""
        eigenvalues, single = np.linalg.eigvalsh(self.M), self.scalar is np.float32
        self.condition = eigenvalues[-1] / max(eigenvalues[0], 1e-300)
        u = np.finfo(self.scalar).eps / 2
        assert eigenvalues[0] > (-len(self.m.links) * u * eigenvalues[-1] if single else 0), "M is positive"
        unit = len(self.m.links) * u * self.condition
        if unit > 0.1:
            return {}  # so near to singular that nothing can be said
        self.errors = {}
        a = self.call("forward_dynamics", "qvt", self.external).astype(float)
        right = self.tau - self.bias
        size = norm(self.tau) + norm(self.bias)
        back = self.m.inverse_dynamics(*self.single[:2], a.astype(self.scalar), self.external)
        self.close("inverse dynamics of forward dynamics", back - self.tau, size, norm(self.M) * norm(a), self.load)
        solved = np.linalg.solve(self.M, right)
        spread = size / eigenvalues[-1]
        self.close("articulated bodies against the mass matrix", solved - a, solved, spread)
        by_mass = self.call("forward_dynamics_by_mass_matrix", "qvt", self.external)
        self.close("through the mass matrix", by_mass - a, solved, spread)
        W = self.call("mass_matrix_inverse").astype(float)
        self.close("M⁻¹ M = 1", W @ self.M - np.eye(self.m.nv), 1.0)
        x = self.call("solve_mass_matrix", "qt")
        self.close("solution by factors", W @ self.tau - x, norm(x))
        return {law: error / unit for law, error in self.errors.items()}


def inertias(m: ksl.Model) -> np.ndarray:
    """(links, 6, 6) about the links' origins, in their axes, linear first."""
    phi, I = m.parameters, np.zeros((len(m.links), 6, 6))
    I[:, :3, :3] = phi[:, 0, None, None] * np.eye(3)
    I[:, 3:, :3] = skew(phi[:, 1:4])
    I[:, :3, 3:] = -I[:, 3:, :3]
    I[:, 3:, 3:] = phi[:, [[4, 5, 7], [5, 6, 8], [7, 8, 9]]]
    return I


@pytest.mark.many_cases
@pytest.mark.parametrize("scalar", TYPES, ids=["double", "float"])
@pytest.mark.parametrize("chunk", range(CHUNKS))
def test_identities(chunk, scalar):
    for seed in range(chunk, TREES, CHUNKS):
        tree = Tree(seed, scalar)
        if not tree.m.nv:
            continue
        for law, error in tree.run().items():
            assert error < LIMIT[scalar], f"tree {seed}: {law}"
        for law, error in tree.solves().items() if tree.heavy else ():
            assert error < C, f"tree {seed}: {law}"


@pytest.mark.parametrize("changed, law", [("a", "efforts are M a + bias"), ("v", "momentum map"), ("reactions", "every body is in balance")])
def test_a_wrong_number_would_be_noticed(changed, law):
    """One that differs from the right one by ten millionths."""
    tree = Tree(1, np.float64)
    tree.run()
    wrong = getattr(tree, changed)
    wrong[np.unravel_index(np.argmax(np.abs(wrong)), wrong.shape)] *= 1 + 1e-5
    {"a": tree.mass_and_efforts, "v": tree.momentum, "reactions": tree.balance}[changed]()
    assert tree.errors[law] > 1000 * LIMIT[np.float64]


def main() -> None:
    for scalar in TYPES:
        plain: dict[str, tuple[float, int]] = {}
        solved: dict[str, tuple[float, int]] = {}
        for seed in range(TREES):
            tree = Tree(seed, scalar)
            if tree.m.nv:
                for kept, found in ((plain, tree.run()), (solved, tree.solves() if tree.heavy else {})):
                    for law, error in found.items():
                        kept[law] = max(kept.get(law, (0.0, 0)), (error, seed))
        for title, kept in (("share of the sum of norms", plain), ("units of n u cond(M)", solved)):
            print(scalar.__name__, title)
            for law, (error, seed) in kept.items():
                print(f"  {error:.1e}  {law} (tree {seed})")


if __name__ == "__main__":
    main()
