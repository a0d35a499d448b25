"""Laws between functions: what must hold whatever the formulas."""

import numpy as np
import pytest

import reference as ref
from functions import everything
from reference import UNIT

CASES = 300
FUNCTIONS = everything()


@pytest.fixture(params=["double", "float"])
def law(request, ksl):
    return Law(ksl, request.param)


class Law:
    """Calls in one precision, with random arguments of moderate size (vectors of length 0.3 to 3)."""

    def __init__(self, ksl, scalar):
        self.ksl, self.scalar, self.u = ksl, scalar, UNIT[scalar]
        self.random = np.random.default_rng(3)
        self.twins = {f.double: name for name, f in FUNCTIONS.items() if f.double and scalar in {t.scalar for t in f.args}}
        self.types = {t.base: t for f in FUNCTIONS.values() for t in f.args if t.scalar == scalar}

    def sample(self, base):
        x = ref.sample(self.random, CASES, self.types[base])
        for i in {"SE3": [9], "screw": [0, 3], "coscrew": [0, 3], "vec3": [0]}.get(base, []):
            v = x[:, i : i + 3].astype(float)
            x[:, i : i + 3] = v / np.linalg.norm(v, axis=1)[:, None] * self.random.uniform(0.3, 3, (CASES, 1))
        if base in ("inertia", "spatial_inertia"):
            m, c = self.random.uniform(0.5, 2, CASES), self.random.normal(size=(CASES, 3))
            J = np.array([3, 4, 5, 0.1, 0.2, -0.3]) * self.random.uniform(0.9, 1.1, (CASES, 6))
            far = (c**2).sum(1)[:, None, None] * np.eye(3) - c[:, :, None] * c[:, None, :]
            if base == "spatial_inertia":
                J = J + (m[:, None, None] * far)[:, [0, 1, 2, 0, 1, 2], [0, 1, 2, 1, 2, 0]]
            x = np.concatenate([m[:, None], m[:, None] * c, J], 1).astype(x.dtype)
        return x

    def __call__(self, name, *args):
        f = FUNCTIONS[self.twins[f"ksl_{name}"]]
        room = [np.zeros((CASES, t.numbers())) for t in f.args[len(args) :]]
        return self.ksl.outputs(f.name, *args, *room)[0]

    def equal(self, a, b, bound=128):
        scale = 1 + np.abs(b).max()
        assert np.abs(a.astype(float) - b.astype(float)).max() <= bound * self.u * scale


def test_adjoint_is_a_homomorphism(law):
    A, B, s, c = law.sample("SE3"), law.sample("SE3"), law.sample("screw"), law.sample("coscrew")
    AB = law("product_dd", A, B)
    law.equal(law("product_Ads", AB, s), law("product_Ads", A, law("product_Ads", B, s)))
    law.equal(law("product_CoAdc", AB, c), law("product_CoAdc", A, law("product_CoAdc", B, c)))


def test_poses_are_a_group(law):
    A, B, C = law.sample("SE3"), law.sample("SE3"), law.sample("SE3")
    law.equal(law("product_dd", law("product_dd", A, B), C), law("product_dd", A, law("product_dd", B, C)))
    one = np.tile(np.append(np.eye(3).ravel(), [0, 0, 0]), (CASES, 1))
    law.equal(law("product_dd", A, law("SE3_inverted", A)), one)
    law.equal(law("product_ddinv", A, A), one)
    law.equal(law("product_dinvd", A, A), one)
    law.equal(law("product_ddinv", A, B), law("product_dd", A, law("SE3_inverted", B)))
    law.equal(law("product_dinvd", A, B), law("product_dd", law("SE3_inverted", A), B))


def test_brackets_are_dual(law):
    """([ad]*(a) c) · b = −c · [ad](a) b"""
    a, b, c = law.sample("screw"), law.sample("screw"), law.sample("coscrew")
    law.equal(law("dot_cs", law("cross_sc", a, c), b), -law("dot_cs", c, law("cross_ss", a, b)), 1000)


def test_bracket_is_a_lie_bracket(law):
    a, b, c = (law.sample("screw") for _ in range(3))
    law.equal(law("cross_ss", a, b), -law("cross_ss", b, a), 0)
    cyclic = [law("cross_ss", x, law("cross_ss", y, z)) for x, y, z in ((a, b, c), (b, c, a), (c, a, b))]
    law.equal(sum(cyclic), np.zeros((CASES, 6)), 3000)


def test_bracket_is_carried_by_the_adjoint(law):
    D, a, b = law.sample("SE3"), law.sample("screw"), law.sample("screw")
    law.equal(law("cross_ss", law("product_Ads", D, a), law("product_Ads", D, b)), law("product_Ads", D, law("cross_ss", a, b)), 500)


def test_exp_and_log_are_inverse(law):
    s = law.sample("screw")
    s[:, 3:] /= 1.1  # |ω| < π
    law.equal(law("SE3_log", law("SE3_exp", s)), s, 500)


def test_exp_along_one_screw_is_a_homomorphism(law):
    s = law.sample("screw")
    law.equal(law("product_dd", law("SE3_exp", s * s.dtype.type(0.25)), law("SE3_exp", s * s.dtype.type(0.75))), law("SE3_exp", s), 500)


def test_exp_is_carried_by_the_adjoint(law):
    """D exp(s) D⁻¹ = exp(Ad(D) s)"""
    D, s = law.sample("SE3"), law.sample("screw")
    law.equal(law("product_ddinv", law("product_dd", D, law("SE3_exp", s)), D), law("SE3_exp", law("product_Ads", D, s)), 500)


def test_spatial_inertia_composes(law):
    A, B, M = law.sample("SE3"), law.sample("SE3"), law.sample("spatial_inertia")
    twice = law("spatial_inertia_transformed", law("spatial_inertia_transformed", M, B), A)
    law.equal(law("spatial_inertia_transformed", M, law("product_dd", A, B)), twice, 500)


def test_kinetic_energy_is_invariant(law):
    D, M, s = law.sample("SE3"), law.sample("spatial_inertia"), law.sample("screw")
    here = law("dot_cs", law("product_Ms", M, s), s)
    s2 = law("product_Ads", D, s)
    there = law("dot_cs", law("product_Ms", law("spatial_inertia_transformed", M, D), s2), s2)
    law.equal(there, here, 2000)


def test_momentum_transforms_as_a_coscrew(law):
    D, M, s = law.sample("SE3"), law.sample("spatial_inertia"), law.sample("screw")
    there = law("product_Ms", law("spatial_inertia_transformed", M, D), law("product_Ads", D, s))
    law.equal(law("product_CoAdc", D, law("product_Ms", M, s)), there, 1000)
