"""Every row of api/algorithms for robots with mimic joints, against the projection of the same robot with independent joints."""

import sys
from pathlib import Path

import numpy as np
import pytest
from projection import Projection, close, random_projection
from random_tree import random_external, random_states

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "api"))
from algorithms import ALGORITHMS, Algorithm

ROWS = {row.name: row for row in ALGORITHMS if "python" in row.faces}
STATES = 3
PARTS = ("total", "constraint", "actuation", "coupling")


class Case:
    """A coupled robot in random states, and the same with independent joints."""

    def __init__(self, seed: int) -> None:
        self.p, self.rng = random_projection(seed)
        m, free = self.p.m, self.p.free
        self.names = [m.link_names[i] for i in self.rng.permutation(len(m.link_names))[:3]]
        self.joints = [j.name for j in m.joints]
        q, v, a = random_states(m, self.rng, STATES)
        self.given = {"q": q, "v": v, "a": a, "tau": self.rng.normal(size=v.shape) * 10, "q1": random_states(m, self.rng, STATES)[0]}
        self.given["fraction"] = self.rng.uniform(size=STATES)
        self.external = random_external(m, self.rng, STATES)
        self.free_given = {x: self.p.motion(n) if x in ("v", "a") else self.p.position(n) if x in ("q", "q1") else n for x, n in self.given.items()}
        pairs = [(free.joint(j.name), j) for j in m.joints]
        self.kept = {
            "motion": [f.v_index + k for f, j in sorted(pairs, key=lambda pair: pair[1].v_index) for k in range(j.nv)],
            "nq": [f.q_index + k for f, j in sorted(pairs, key=lambda pair: pair[1].q_index) for k in range(j.nq)],
        }

    def keywords(self, row: Algorithm, **more) -> dict:
        names = self.names
        asked = {
            "links": {row.links_keyword: names}, "frames": {"names": names}, "link": {"name": names[0]}, "frame": {"name": names[0]},
            "relative": {"name": names[0], "seen_from": names[-1]}, "joints": {"joints": self.joints}, "reactions": {"joints": self.joints},
        }.get(row.request, {})  # fmt: skip
        asked |= {"names": [j.name for j in self.p.m.joints if j.nv or j.leader][:3]} if row.mimic == "hybrid" else {}
        asked |= {"point": [0.1, -0.2, 0.3]} if "point" in row.keywords else {}
        return asked | ({"external": self.external} if row.external else {}) | more

    def results(self, row: Algorithm, of: str, **more) -> list[np.ndarray]:
        model, given = (self.p.m, self.given) if of == "coupled" else (self.p.free, self.free_given)
        if row.called.get("tau") and of != "coupled":  # no efforts, but a virtual velocity
            given = given | {"tau": self.p.motion(given["tau"])}
        found = getattr(model, row.name)(*(given[x] for x in row.inputs), **self.keywords(row, **more))
        return list(found) if isinstance(found, tuple) else [found]

    def reduced(self, result: np.ndarray, shape: tuple) -> np.ndarray:
        for axis, extent in enumerate(shape, 1):
            if extent == "nv":
                result = np.moveaxis(np.moveaxis(result, axis, -1) @ self.p.G, -1, axis)
            elif extent in self.kept:
                result = np.take(result, self.kept[extent], axis)
        return result

    def mass_matrix(self) -> np.ndarray:
        return self.p.G.T @ self.p.free.mass_matrix(self.free_given["q"]) @ self.p.G

    def jacobian(self, names: list[str], **more) -> np.ndarray:
        return np.concatenate([self.p.free.jacobian(self.free_given["q"], name, **more) @ self.p.G for name in names], axis=-2)

    def bias(self, a: np.ndarray | None = None) -> np.ndarray:
        given = self.free_given
        return self.p.free.inverse_dynamics(given["q"], given["v"], np.zeros_like(given["v"]) if a is None else self.p.motion(a), self.external) @ self.p.G


def regular(seed: int) -> Case | None:
    """A case whose accelerations are determined."""
    case = Case(seed)
    return case if case.p.m.nv and np.linalg.cond(case.mass_matrix()).max() < 1e7 else None


def times(A: np.ndarray, x: np.ndarray) -> np.ndarray:
    return np.einsum("...ij,...j->...i", A, x)


def compare(found: np.ndarray, expected: np.ndarray, case: Case, tolerance: float = 1e-10) -> None:
    scale = np.linalg.cond(case.mass_matrix()).max() if case.p.m.nv and tolerance > 1e-11 else 1
    close(found, expected, tolerance, min(scale, 1e4) * np.abs(expected).max(initial=0))


@pytest.mark.parametrize("name", [row.name for row in ROWS.values() if row.mimic == "projection"])
def test_a_projection_is_reduced_as_its_row_says(name):
    row = ROWS[name]
    for seed in range(6):
        case = Case(seed)
        for result, found, free in zip(row.results or [_reactions()], case.results(row, "coupled"), case.results(row, "free"), strict=True):
            expected = case.reduced(free, result.shape)
            size = np.abs(free).max(initial=1) * max(1, np.abs(case.p.G).sum(axis=0).max(initial=0)) ** sum(x == "nv" for x in result.shape)
            close(found, expected, 1e-12, 10 * np.nan_to_num(size))


def _reactions():
    from algorithms import Result

    return Result("reactions", ("joints", 6), "")


@pytest.mark.parametrize("name", ["reactions", "reactions_derivatives", "reactions_regressor"])
@pytest.mark.parametrize("options", [{}, {"on": "parent", "at": "world", "axes": "world"}], ids=["joint", "world"])
def test_parts_are_those_of_independent_joints_but_for_the_names(name, options):
    """What a motor exerts on an independent joint, the coupling exerts on a follower."""
    row = ROWS[name]
    for seed in range(6):
        case = Case(seed)
        follows = np.array([case.p.m.joint(j).leader is not None for j in case.joints])
        for part in PARTS:
            of_free = {"coupling": "actuation"}.get(part, part)
            whole = case.results(row, "free", **options)
            for result, found, free, total in zip(
                row.results or [_reactions()],
                case.results(row, "coupled", part=part, **options),
                case.results(row, "free", part=of_free, **options),
                whole,
                strict=True,
            ):
                expected = case.reduced(free, result.shape)
                some = {"actuation": ~follows, "coupling": follows}.get(part, np.ones_like(follows))
                expected = np.where(some.reshape(-1, *[1] * (expected.ndim - 2)), expected, 0)
                close(found, expected, 1e-12, 10 * np.abs(total).max(initial=1) * max(1, np.abs(case.p.G).sum(axis=0).max(initial=0)))


def test_every_other_row_is_tested_here():
    others = {row.mimic for row in ROWS.values()} - {"projection"}
    assert others == {
        "solution",
        "product",
        "inverse",
        "upper_triangle",
        "solution_derivatives",
        "solution_second_derivatives",
        "hybrid",
        "jump",
        *OPERATIONAL,
        "refusal",
    }


OPERATIONAL = ("operational_inverse", "operational_inertia", "operational_space")
SEEDS = [seed for seed in range(24) if regular(seed)]


@pytest.mark.parametrize("seed", SEEDS)
def test_results_of_the_mass_matrix(seed):
    case = regular(seed)
    m, given, M = case.p.m, case.given, case.mass_matrix()
    inverse = np.linalg.inv(M)
    for name in ("forward_dynamics", "forward_dynamics_by_mass_matrix"):
        compare(case.results(ROWS[name], "coupled")[0], times(inverse, given["tau"] - case.bias()), case)
    compare(m.solve_mass_matrix(given["q"], given["tau"]), times(inverse, given["tau"]), case)
    compare(m.mass_matrix_inverse(given["q"]), inverse, case)
    compare(np.triu(m.mass_matrix_upper(given["q"])), np.triu(M), case)
    impulses = sum((np.einsum("nij,ni->nj", case.jacobian([link]), f) for link, f in case.external.items()), np.zeros((STATES, m.nv)))
    compare(m.velocity_jump(given["q"], case.external), times(inverse, impulses), case)


@pytest.mark.parametrize("seed", SEEDS)
def test_derivatives_of_forward_dynamics(seed):
    case = regular(seed)
    m, given = case.p.m, case.given
    inverse = np.linalg.inv(case.mass_matrix())
    a = times(inverse, given["tau"] - case.bias())
    at_a = (case.free_given["q"], case.free_given["v"], case.p.motion(a), case.external)
    by_q, by_v, _ = (case.reduced(x, ("nv", "nv")) for x in case.p.free.inverse_dynamics_derivatives(*at_a))
    found = m.forward_dynamics_derivatives(given["q"], given["v"], given["tau"], case.external)
    for x, expected in zip(found, (-inverse @ by_q, -inverse @ by_v, inverse), strict=True):
        compare(x, expected, case)


@pytest.mark.parametrize("seed", SEEDS)
def test_second_derivatives_of_forward_dynamics(seed):
    """tau = ID(q, v, a(q, v, tau)), differentiated twice."""
    case = regular(seed)
    m, given = case.p.m, case.given
    inverse = np.linalg.inv(case.mass_matrix())
    a = times(inverse, given["tau"] - case.bias())
    at_a = (case.free_given["q"], case.free_given["v"], case.p.motion(a), case.external)
    by_q, by_v, _ = (case.reduced(x, ("nv", "nv")) for x in case.p.free.inverse_dynamics_derivatives(*at_a))
    qq, vv, qv, aq = (case.reduced(x, ("nv", "nv", "nv")) for x in case.p.free.inverse_dynamics_second_derivatives(*at_a))
    mixed = np.einsum("nilk,nlj->nikj", aq, -inverse @ by_q)
    expected = (qq + mixed + np.swapaxes(mixed, -1, -2), vv, qv + np.einsum("nilk,nlj->nikj", aq, -inverse @ by_v), np.einsum("nilk,nlj->nikj", aq, inverse))
    for x, y in zip(m.forward_dynamics_second_derivatives(given["q"], given["v"], given["tau"], case.external), expected, strict=True):
        compare(x, -np.einsum("nil,nlkj->nikj", inverse, y), case)


@pytest.mark.parametrize("seed", SEEDS)
def test_hybrid_dynamics(seed):
    case = regular(seed)
    m, given, M = case.p.m, case.given, case.mass_matrix()
    moving = [j for j in m.joints if j.nv or j.leader]
    chosen = [j for j in moving if case.rng.random() < 0.5]
    is_given = np.zeros(m.nv, dtype=bool)
    for j in chosen:
        own = m.joint(j.leader) if j.leader else j
        is_given[own.v_index : own.v_index + own.nv] = True
    a, tau = m.hybrid_dynamics(given["q"], given["v"], given["a"], given["tau"], case.external, names=[j.name for j in chosen])
    assert np.array_equal(a[:, is_given], given["a"][:, is_given]) and np.array_equal(tau[:, ~is_given], given["tau"][:, ~is_given])
    known = np.where(is_given, given["a"], 0)
    right = (given["tau"] - case.bias(known))[:, ~is_given]
    compare(a[:, ~is_given], np.linalg.solve(M[:, ~is_given][:, :, ~is_given], right[..., None])[..., 0], case)
    size = np.abs(M).max() * np.abs(a).max() + np.abs(case.bias()).max()
    close(tau, m.inverse_dynamics(given["q"], given["v"], a, case.external), 1e-11, 10 * size * np.linalg.cond(M).max() ** 0.5)


@pytest.mark.parametrize("options", [{}, {"axes": "world", "order": "ang_lin"}], ids=["frame", "world"])
@pytest.mark.parametrize("seed", SEEDS)
def test_operational_space(seed, options):
    case = regular(seed)
    m, given = case.p.m, case.given
    inverse = np.linalg.inv(case.mass_matrix())
    J = case.jacobian(case.names, **options)
    expected = J @ inverse @ J.swapaxes(-1, -2)
    found = m.operational_space_inertia_inverse(given["q"], case.names, **options)
    compare(found, expected, case)
    assert np.array_equal(found, found.swapaxes(-1, -2))
    inertia, rank = m.operational_space_inertia(given["q"], case.names, **options)
    whole, bias, pseudo, ranks = m.operational_space(given["q"], given["v"], case.external, case.names, **options)
    assert np.array_equal(whole, inertia) and np.array_equal(rank, ranks)
    scale = 1 / np.sqrt(np.maximum(np.diagonal(found, axis1=-2, axis2=-1), 1e-300))
    scaled = np.where(found == 0, 0, found * scale[:, :, None] * scale[:, None, :])
    values = np.linalg.eigvalsh(scaled)
    if ((values > 1e-13) & (values < 1e-5)).any():
        return  # the rank is a matter of rounding
    assert np.array_equal(rank, (values > 1e-9).sum(axis=-1))
    size = np.abs(inertia).max(initial=1) * np.abs(found).max(initial=1)
    close(found @ inertia @ found, found, 1e-9, size * np.abs(found).max(initial=1))  # a generalised inverse
    close(pseudo, inverse @ J.swapaxes(-1, -2) @ inertia, 1e-9, size)
    a = times(inverse, -case.bias())
    rates = m.frame_accelerations(given["q"], given["v"], a, case.names, kind="rate", **options).reshape(STATES, -1)
    close(bias, -times(inertia, rates), 1e-9, size * np.abs(rates).max(initial=1))


def test_other_rows_are_refused_in_words():
    case = next(c for c in map(Case, range(40)) if c.p.m.follower_names)
    for row in ROWS.values():
        if row.mimic == "refusal":
            instead = "mass_matrix_upper" if row.name == "mass_matrix_tree" else "solve_mass_matrix"
            with pytest.raises(ValueError, match=f"{row.name} is not available for robots with mimic joints.*other zeros.*{instead}.*independent"):
                case.results(row, "coupled")


def difference_quotients(p: Projection, f, q, h: float = 1e-6) -> np.ndarray:
    """∂f(q ⊕ s e_k)/∂s, the coordinates on the last axis."""
    step = h * np.eye(p.m.nv)
    return np.stack([(f(p.m.integrate(q, e)) - f(p.m.integrate(q, -e))) / (2 * h) for e in step], axis=-1)


@pytest.mark.parametrize("seed", [seed for seed in SEEDS if regular(seed).p.m.follower_names][:6])
def test_derivatives_are_limits_of_differences(seed):
    case = regular(seed)
    p, (q, v, a, tau) = case.p, (case.given[x][0] for x in ("q", "v", "a", "tau"))
    external = {link: f[0] for link, f in case.external.items()}
    cond = np.linalg.cond(case.mass_matrix()).max()

    def check(found, expected, tolerance):
        close(found, expected, tolerance, np.abs(expected).max(initial=1))

    by_q, by_v, by_a = p.m.inverse_dynamics_derivatives(q, v, a, external)
    check(by_q, difference_quotients(p, lambda x: p.m.inverse_dynamics(x, v, a, external), q), 1e-7)
    step = 1e-4 * np.eye(p.m.nv)
    check(by_v, np.stack([(p.m.inverse_dynamics(q, v + e, a, external) - p.m.inverse_dynamics(q, v - e, a, external)) / 2e-4 for e in step], -1), 1e-8)
    close(by_a, p.m.mass_matrix(q), 1e-12, np.abs(by_a).max(initial=0))
    by_q, by_v, _ = p.m.forward_dynamics_derivatives(q, v, tau, external)
    check(by_q, difference_quotients(p, lambda x: p.m.forward_dynamics(x, v, tau, external), q), 1e-9 * max(cond, 100))
    check(
        by_v,
        np.stack([(p.m.forward_dynamics(q, v + e, tau, external) - p.m.forward_dynamics(q, v - e, tau, external)) / 2e-4 for e in step], -1),
        1e-11 * max(cond, 1000),
    )
    *_, by_q_and_tau = p.m.forward_dynamics_second_derivatives(q, v, tau, external)
    check(by_q_and_tau.swapaxes(1, 2), difference_quotients(p, lambda x: p.m.mass_matrix_inverse(x), q), 1e-9 * max(cond, 100))
    by_qq, by_vv, by_qv, _ = p.m.forward_dynamics_second_derivatives(q, v, tau, external)
    first = lambda x, y: p.m.forward_dynamics_derivatives(x, y, tau, external)
    check(by_qq, difference_quotients(p, lambda x: first(x, v)[0], q), 1e-9 * max(cond, 1000))
    quotients = [np.stack([(first(q, v + e)[k] - first(q, v - e)[k]) / 2e-4 for e in step], -1) for k in (0, 1)]
    check(by_qv, quotients[0], 1e-11 * max(cond, 1000))
    check(by_vv, quotients[1], 1e-11 * max(cond, 1000))
    for part in PARTS:
        of = lambda x: p.m.reactions(x, v, a, external, joints=case.joints, part=part)
        by_q, *_ = p.m.reactions_derivatives(q, v, a, external, joints=case.joints, part=part)
        check(by_q, difference_quotients(p, of, q), 1e-7)


@pytest.mark.parametrize("name", [row.name for row in ROWS.values() if row.mimic != "refusal"])
def test_one_state_has_the_same_bits_as_many(name):
    row, case = ROWS[name], next(filter(lambda case: case and case.p.m.follower_names, map(regular, SEEDS)))
    many = case.results(row, "coupled")
    for k in range(STATES):
        one = getattr(case.p.m, name)(
            *(case.given[x][k] for x in row.inputs),
            **case.keywords(row) | ({"external": {link: f[k] for link, f in case.external.items()}} if row.external else {}),
        )
        for found, whole in zip(one if isinstance(one, tuple) else [one], many, strict=True):
            assert np.array_equal(np.triu(found), np.triu(whole[k])) if row.mimic == "upper_triangle" else np.array_equal(found, whole[k], equal_nan=True)
