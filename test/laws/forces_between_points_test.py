"""Laws of force elements on random trees and closed mechanisms: they are external wrenches of equal and opposite forces, and derivatives are those of
differences."""

import itertools

import closed_mechanisms
import numpy as np
import pytest

import ksl
from differences import differences
from projection import with_mimics
from random_tree import load_text, random_external, random_states, random_tree

ON = "force elements"


def elements(rng: np.random.Generator, links: list[str], n: int) -> list[dict]:
    """Springs, dampers and cylinders between random links, one with stops that act."""
    found = []
    for i in range(n):
        a, b = rng.choice(len(links), 2, replace=False)
        numbers = {"stiffness": rng.uniform(0, 90), "free_length": rng.uniform(0.2, 1), "damping": rng.uniform(0, 9), "preload": rng.normal()}
        stops = {"limits": (None, 0.1), "stop_stiffness": 70.0} if i == 0 else {}
        ends = {"link1": links[a], "point1": rng.normal(size=3), "link2": links[b], "point2": rng.normal(size=3)}
        found.append({"name": f"element {i}", **ends, **numbers, **stops})
    return found


def in_urdf(text: str, of: list[dict]) -> str:
    def element(e: dict) -> str:
        numbers = {k: e[k] for k in ("stiffness", "free_length", "damping", "preload")} | {k: e[k] for k in ("stop_stiffness",) if k in e}
        numbers |= {"upper": e["limits"][1]} if "limits" in e else {}
        ends = "".join(f'<link{i} link="{e[f"link{i}"]}" xyz="{" ".join(repr(float(x)) for x in e[f"point{i}"])}"/>' for i in (1, 2))
        return f'<force_element name="{e["name"]}" {" ".join(f"{k}={chr(34)}{float(x)!r}{chr(34)}" for k, x in numbers.items())}>{ends}</force_element>'

    return text.replace("</robot>", "".join(map(element, of)) + "</robot>")


def by_hand(m: ksl.Model, q: np.ndarray, v: np.ndarray) -> tuple[dict[str, np.ndarray], float, float]:
    """The wrenches of elements in world axes at links' origins, their energy, and what they turn into heat."""
    wrenches, energy, heat = {}, 0.0, 0.0
    for e in m.force_elements:
        poses = [m.frame_pose(q, link) for link in (e.link1, e.link2)]
        arms = [T[:3, :3] @ p for T, p in zip(poses, (e.point1, e.point2), strict=True)]
        D = poses[1][:3, 3] + arms[1] - poses[0][:3, 3] - arms[0]
        l = np.linalg.norm(D)
        moved = [m.point_velocity(q, v, link, p, axes="world") for link, p in ((e.link1, e.point1), (e.link2, e.point2))]
        rate = D @ (moved[1] - moved[0]) / l
        beyond = max(0.0, l - e.upper) if e.upper is not None else 0.0
        tension = e.preload + e.stiffness * (l - e.free_length) + e.damping * rate + e.stop_stiffness * beyond
        stretch = l - e.free_length
        energy += e.preload * stretch + e.stiffness * stretch**2 / 2 + e.stop_stiffness * beyond**2 / 2
        heat += e.damping * rate**2
        for link, arm, force in ((e.link1, arms[0], tension * D / l), (e.link2, arms[1], -tension * D / l)):
            wrenches[link] = wrenches.get(link, 0) + np.concatenate([force, np.cross(arm, force)])
    return wrenches, energy, heat


@pytest.fixture(scope="module", params=range(6))
def case(request):
    """A tree, every third with mimic joints, with and without its elements, and states."""
    rng = np.random.default_rng(request.param)
    text = random_tree(rng, 9)
    if request.param % 3 == 0:
        text = with_mimics(text, rng)
    text = in_urdf(text, elements(rng, [f"link{i}" for i in range(9)], 3))
    m = load_text(text, physics=ON, floating_base=request.param % 2 == 1)
    assert len(m.force_elements) == 3
    return m, m.with_physics(None), *random_states(m, rng, 3), rng


def test_elements_are_equal_and_opposite_forces(case):
    m, off, q, v, a, _ = case
    for k in range(len(q)):
        by, energy, heat = by_hand(m, q[k], v[k])
        given = {"external": by, "external_axes": "world"}
        for call in ("inverse_dynamics", "reactions", "effort_parts"):
            expected = getattr(off, call)(q[k], v[k], a[k], **given)
            np.testing.assert_allclose(getattr(m, call)(q[k], v[k], a[k]), expected, rtol=1e-11, atol=1e-11 * max(1, abs(expected).max()))
        still, at_rest = by_hand(m, q[k], 0 * v[k])[0], m.gravity_torque(q[k])
        np.testing.assert_allclose(at_rest, off.gravity_torque(q[k], external=still, external_axes="world"), rtol=1e-11, atol=1e-10)
        np.testing.assert_allclose(np.subtract(m.energy(q[k], v[k]), off.energy(q[k], v[k])), (0, energy), rtol=1e-10, atol=1e-10)
        states = m.force_element_states(q[k], v[k])
        assert np.sum([e.damping * r**2 for e, r in zip(m.force_elements, states.rate, strict=True)]) == pytest.approx(heat)


def test_batches_have_the_bits_of_states(case):
    m, _, q, v, a, _ = case
    many = [np.tile(x, (15, 1)) for x in (q, v, a)]
    for call in ("inverse_dynamics", "inverse_dynamics_derivatives", "energy", "energy_derivatives", "reactions"):
        arguments = many[:2] if "energy" in call else many
        together, alone = getattr(m, call)(*arguments), [getattr(m, call)(*(x[k] for x in arguments)) for k in range(len(q))]
        for part in range(len(together)) if isinstance(together, tuple) else (None,):
            for k, one in enumerate(alone):
                np.testing.assert_allclose((together if part is None else together[part])[k], one if part is None else one[part], rtol=1e-12, atol=1e-11)
    single = m.inverse_dynamics(*(x.astype(np.float32) for x in (q, v, a)))
    np.testing.assert_allclose(single, m.inverse_dynamics(q, v, a), rtol=2e-3, atol=2e-4 * abs(single).max())


@pytest.mark.parametrize("axes", ["link", "world"])
def test_derivatives_are_those_of_differences(case, axes):
    m, _, q, v, a, rng = case
    given = {"external": {name: w[0] for name, w in random_external(m, rng, 1).items()}, "external_axes": axes}
    q, v, a = q[0], v[0], a[0]

    def check(found, call):
        for analytic, expected in zip(found, differences(m, call, q, v, a), strict=False):
            assert abs(analytic - expected).max() < 2e-7 * max(1, abs(expected).max())

    check(m.inverse_dynamics_derivatives(q, v, a, **given), lambda q, v, a: m.inverse_dynamics(q, v, a, **given))
    for how in ({}, {"at": "world", "axes": "world", "order": "ang_lin"}):
        check(m.reactions_derivatives(q, v, a, **given, **how), lambda q, v, a, how=how: m.reactions(q, v, a, **given, **how))
    check([m.stiffness(q, **given)], lambda q, v, a: m.gravity_torque(q, **given))
    check([m.energy_derivatives(q, v)[2]], lambda q, v, a: m.energy(q, v)[1])
    weights = rng.normal(size=m.nv)
    check(m.inverse_dynamics_gradient(q, v, a, weights), lambda q, v, a: m.inverse_dynamics(q, v, a) @ weights)


def test_derivatives_of_forward_dynamics(case):
    m, _, q, v, a, _ = case
    if m.mass_matrix(q).size and min(np.linalg.eigvalsh(M)[0] for M in m.mass_matrix(q)) < 1e-3:
        pytest.skip("a joint moves almost no mass")
    tau = m.inverse_dynamics(q, v, a)
    np.testing.assert_allclose(m.forward_dynamics(q, v, tau), a, rtol=1e-8, atol=1e-8)
    # a(q, v, τ(q, v, a)) = a: ∂a/∂q = −M⁻¹ ∂τ/∂q
    by_q, by_v, inverse = m.forward_dynamics_derivatives(q, v, tau)
    of_tau = m.inverse_dynamics_derivatives(q, v, a)
    for found, by in ((by_q, of_tau[0]), (by_v, of_tau[1])):
        expected = -inverse @ by
        np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-8 * abs(expected).max())


KINDS = ("revolute", "spherical", "universal")  # with a plan of elimination, with redundant equations left, and without a plan


def closed_case(kind: str, seed: int):
    c = closed_mechanisms.random_case(kind, seed)
    rng = np.random.default_rng(seed)
    text = in_urdf(c.model.to_urdf(), elements(rng, list(c.model.link_names), 2))
    m = ksl.load_string(text, physics=ON, gravity=tuple(c.model.gravity), masses="optional").with_drives(c.drives)
    v = m.consistent_velocity(c.q, rng.normal(size=m.nv), given=())
    a = m.consistent_acceleration(c.q, v, rng.normal(size=m.nv), given=())
    return m, m.with_physics(None), c.q, v, a


@pytest.mark.filterwarnings("ignore::UserWarning")
@pytest.mark.parametrize(("kind", "seed"), list(itertools.product(KINDS, range(2))))
def test_closed_mechanisms_feel_them_too(kind, seed):
    m, off, q, v, a = closed_case(kind, seed)
    by = {"external": by_hand(m, q, v)[0], "external_axes": "world"}
    tau = m.inverse_dynamics(q, v, a)
    close = {"rtol": 1e-8, "atol": 1e-8 * max(1, abs(tau).max())}
    np.testing.assert_allclose(tau, off.inverse_dynamics(q, v, a, **by), **close)
    joints = [*m.joint_names, *m.loop_names]
    np.testing.assert_allclose(m.reactions(q, v, a, joints=joints), off.reactions(q, v, a, joints=joints, **by), **close)
    np.testing.assert_allclose(m.effort_parts(q, v, a), off.effort_parts(q, v, a, **by), **close)
    np.testing.assert_allclose(m.forward_dynamics(q, v, tau), off.forward_dynamics(q, v, tau, **by), rtol=1e-7, atol=1e-7 * max(1, abs(a).max()))
    many = [np.tile(x, (7, 1)) for x in (q, v, a)]
    np.testing.assert_allclose(m.inverse_dynamics(*many), np.tile(tau, (7, 1)), **close)
