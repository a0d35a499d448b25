"""Laws of the physics of joints on random trees: forward dynamics inverts inverse dynamics, derivatives are those of differences."""

import re

import numpy as np
import pytest

from random_tree import load_text, random_states, random_tree

KINDS = ("revolute", "continuous", "prismatic", "helical", "cylindrical", "universal", "spherical", "planar", "translation", "fixed")
SPRINGS = ("revolute", "continuous", "prismatic", "helical")


def with_physics(text: str, rng: np.random.Generator) -> str:
    """Random numbers for the joints that may have them; every link a mass."""

    def dynamics(found: re.Match) -> str:
        if found["kind"] == "fixed":
            return found[0]
        numbers = {"damping": rng.uniform(0, 2), "friction": rng.uniform(0, 3), "friction_width": rng.uniform(0.1, 1), "armature": rng.uniform(0, 0.1)}
        numbers |= {"rotor_inertia": rng.uniform(0, 1e-3), "gear_ratio": rng.normal() * 20}
        if found["kind"] in SPRINGS:
            numbers |= {"spring_stiffness": rng.uniform(0, 9), "spring_reference": rng.normal()}
        return found[0][: -len("</joint>")] + "<dynamics " + " ".join(f'{name}="{float(x)!r}"' for name, x in numbers.items()) + "/></joint>"

    return re.sub(r'<joint name="\w+" type="(?P<kind>\w+)">.*?</joint>', dynamics, text, flags=re.S)


@pytest.fixture(scope="module", params=range(4))
def case(request):
    rng = np.random.default_rng(request.param)
    m = load_text(with_physics(random_tree(rng, 9, KINDS), rng), physics="all", floating_base=request.param == 3)
    return m, *random_states(m, rng, 3)


def test_forward_dynamics_is_the_inverse(case):
    m, q, v, a = case
    tau = m.inverse_dynamics(q, v, a)
    condition = np.linalg.cond(m.mass_matrix(q)).max()
    for forward in (m.forward_dynamics, m.forward_dynamics_by_mass_matrix):
        assert abs(forward(q, v, tau) - a).max() < 1e-14 * condition * max(1, abs(tau).max())
    np.testing.assert_allclose(m.effort_parts(q, v, a).sum(axis=-2), tau, rtol=1e-12, atol=1e-12 * abs(tau).max())
    M, still = m.mass_matrix(q), np.zeros_like(v)
    np.testing.assert_allclose(np.einsum("nij,nj->ni", M, a), m.inverse_dynamics(q, v, a) - m.inverse_dynamics(q, v, still), atol=1e-11 * abs(tau).max())
    np.testing.assert_allclose(np.einsum("ni,nij,nj->n", v, M, v) / 2, m.energy(q, v)[0], rtol=1e-11)


def test_derivatives_are_those_of_differences(case):
    m, q, v, a = case
    step, tau, eye = 1e-5, m.inverse_dynamics(q, v, a), np.eye(m.nv)
    moved = {
        "q": lambda s: m.inverse_dynamics(m.integrate(q[:, None], s * eye), v[:, None], a[:, None]),
        "v": lambda s: m.inverse_dynamics(q[:, None], v[:, None] + s * eye, a[:, None]),
        "a": lambda s: m.inverse_dynamics(q[:, None], v[:, None], a[:, None] + s * eye),
    }
    for found, efforts in zip(m.inverse_dynamics_derivatives(q, v, a), moved.values(), strict=True):
        expected = np.swapaxes(efforts(step) - efforts(-step), 1, 2) / (2 * step)
        assert abs(found - expected).max() < 1e-7 * max(1, abs(tau).max(), abs(expected).max())
    for found, derivative in zip(m.inverse_dynamics_gradient(q, v, a, a), m.inverse_dynamics_derivatives(q, v, a), strict=True):
        expected = np.einsum("ni,nik->nk", a, derivative)
        assert abs(found - expected).max() < 1e-12 * max(1, abs(expected).max())
    for given in range(4):  # also written over an argument
        arguments = [q.copy(), v.copy(), a.copy(), a.copy()]
        if arguments[given].shape == v.shape:
            out = tuple(arguments[given] if i == 0 else np.empty_like(v) for i in range(3))
            for x, y in zip(m.inverse_dynamics_gradient(*arguments, out=out), m.inverse_dynamics_gradient(q, v, a, a), strict=True):
                np.testing.assert_array_equal(x, y)


def test_power_is_the_rate_of_energy_and_the_heat(case):
    m, q, v, a = case
    step = 1e-5
    energies = [sum(m.energy(m.integrate(q, s * v + s * s / 2 * a), v + s * a)) for s in (step, -step)]
    parts = m.effort_parts(q, v, a)
    power, heat = (m.inverse_dynamics(q, v, a) * v).sum(axis=-1), ((parts[:, 1] + parts[:, 2]) * v).sum(axis=-1)
    assert (heat > 0).all()
    np.testing.assert_allclose((energies[0] - energies[1]) / (2 * step), power - heat, rtol=1e-6, atol=1e-6 * abs(power).max())


def test_derivatives_of_energies(case):
    """By v, those of rotors; by q, those of springs."""
    m, q, v, _ = case
    step, eye = 1e-5, np.eye(m.nv)
    by_q, by_v, potential = m.energy_derivatives(q, v)
    np.testing.assert_allclose(by_v, np.einsum("nij,nj->ni", m.mass_matrix(q), v), atol=1e-12 * max(1, abs(by_v).max()))
    np.testing.assert_allclose(potential, m.gravity_torque(q), atol=1e-12 * max(1, abs(potential).max()))
    energies = [m.energy(m.integrate(q[:, None], s * eye), v[:, None]) for s in (step, -step)]
    for found, ahead, behind in zip((by_q, potential), *energies, strict=True):
        assert abs(found - (ahead - behind) / (2 * step)).max() < 1e-7 * max(1, abs(found).max())
