"""Euler angles, axis and angle, sequences, principal axes; the errata B8 and B19 of the published library."""

import functools
import itertools
import subprocess

import gmpy2
import numpy as np
import pytest

import reference as ref
from functions import INCLUDE
from random_cases import AT_200_BITS
from reference import UNIT, mp, mul, norm
from quaternion_test import all_rotations, rotation, unit

pytestmark = pytest.mark.many_cases
N = AT_200_BITS // 3
F = pytest.mark.parametrize("f, scalar", [("", "double"), ("f", "float")])
DTYPE = {"double": np.float64, "float": np.float32}
SEQUENCES = ["xyz", "yzx", "zxy", "xzy", "yxz", "zyx", "xyx", "xzx", "yxy", "yzy", "zxz", "zyz"]
SEQUENCE = pytest.mark.parametrize("number", range(12), ids=SEQUENCES)
QUARTER = np.pi / 4
PI = gmpy2.const_pi()
sin, cos, acos = (np.frompyfunc(g, 1, 1) for g in (gmpy2.sin, gmpy2.cos, gmpy2.acos))


def axes(number):
    return ["xyz".index(c) for c in SEQUENCES[number]]


def euler(number, angles):
    """R_i(a0) R_j(a1) R_k(a2), at 200 bits."""
    R = [ref.axis_rotation(k, np.stack([sin(a), cos(a)], -1)) for k, a in zip(axes(number), angles.T)]
    return mul(mul(R[0], R[1]), R[2])


def sets_of_angles(number, scalar):
    """Random ones, small ones, and gimbal lock, exact and nearly so."""
    random = np.random.default_rng(number)
    a = np.concatenate(
        [
            random.uniform(-7, 7, (N, 3)),
            random.normal(size=(N, 3)) * 10.0 ** random.uniform(-9, 0, (N, 1)),
            random.uniform(-3, 3, (2 * N, 3)),
            list(itertools.product([0, np.pi / 2, np.pi, -np.pi / 2], repeat=3)),
        ]
    )
    lock = [0, np.pi, -np.pi] if number >= 6 else [np.pi / 2, -np.pi / 2]
    a[2 * N : 4 * N, 1] = random.choice(lock, 2 * N)
    a[3 * N : 4 * N, 1] += random.choice([-1, 1], N) * 10.0 ** random.uniform(-17, -1, N)
    return a.astype(DTYPE[scalar])


@functools.cache
def exact_rotations(number, scalar):
    """Those of the sets of angles, at 200 bits; made once for all tests."""
    return euler(number, mp(sets_of_angles(number, scalar)))


def difference(number, angles, R):
    return ref.spectral(euler(number, mp(angles)) - R)


def numbers(R, scalar):
    return ref.numbers(R).astype(float).astype(DTYPE[scalar])


@F
@SEQUENCE
def test_matrix_of_euler_angles(ksl, f, scalar, number, record_property):
    a = sets_of_angles(number, scalar)
    (got,) = ksl.outputs(f"ksl_mat3x3{f}_setFromEulerAngles", np.zeros((len(a), 9)), number, a)
    worst = ref.spectral(ref.matrix(mp(got)) - exact_rotations(number, scalar)).max() / UNIT[scalar]
    record_property("worst_u", float(worst))
    assert worst <= 4


@F
@SEQUENCE
def test_euler_angles_of_every_rotation(ksl, f, scalar, number, record_property):
    """They give R again, whatever R; in the published ranges."""
    R = np.concatenate([exact_rotations(number, scalar), rotation(all_rotations())])
    given = numbers(R, scalar)
    (a,) = ksl.outputs(f"ksl_mat3x3{f}_getEulerAnglesNear", given, number, np.zeros((len(R), 3)), np.zeros((len(R), 3)))
    worst = difference(number, a, ref.matrix(mp(given))).max() / UNIT[scalar]
    record_property("worst_u", float(worst))
    assert worst <= 16
    slack = 8 * UNIT[scalar]
    assert (a >= -QUARTER - slack).all() and (a[:, :2] < 7 * QUARTER + slack).all() and (a[:, 2] < 3 * QUARTER + slack).all()


@F
@SEQUENCE
def test_reference_chooses_the_angles(ksl, f, scalar, number):
    """Angles near the reference come back, turns and all; locked, the third is the reference's."""
    a = sets_of_angles(number, scalar)
    R = numbers(exact_rotations(number, scalar), scalar)
    random = np.random.default_rng(50 + number)
    turns = 2 * np.pi * random.integers(-3, 4, a.shape)
    reference = (a + turns + random.uniform(-0.5, 0.5, a.shape)).astype(DTYPE[scalar])
    (got,) = ksl.outputs(f"ksl_mat3x3{f}_getEulerAnglesNear", R, number, np.zeros_like(a), reference)
    assert difference(number, got, ref.matrix(mp(R))).max() <= 100 * UNIT[scalar]
    regular = slice(0, N)
    margin = abs(np.cos(a[regular, 1]) if number < 6 else np.sin(a[regular, 1]))
    clear = margin > 0.05
    assert abs(got[regular][clear] - (a + turns)[regular][clear]).max() < 2000 * UNIT[scalar]
    locked = slice(2 * N, 3 * N)
    assert np.array_equal(got[locked, 2], reference[locked, 2])


@F
@SEQUENCE
def test_published_calls_are_the_same(ksl, f, scalar, number):
    a = sets_of_angles(number, scalar)
    R = numbers(exact_rotations(number, scalar), scalar)
    near = ksl.outputs(f"ksl_mat3x3{f}_getEulerAnglesNear", R, number, np.zeros_like(a), a)[0]
    assert np.array_equal(ksl.outputs(f"ksl_mat3x3{f}_getEulerAnglesWithReference", R, number, np.zeros_like(a), a)[0], near)


@pytest.mark.parametrize("compiler", [["gcc", "-std=c11", "-x", "c"], ["g++", "-std=c++20", "-x", "c++"]], ids=["C", "C++"])
def test_published_macros(compiler, tmp_path):
    """With and without a reference, in both languages; no reference is a reference of zeros."""
    (tmp_path / "main").write_text("""#include <ksl/ksl.h>
    int main(void) {
      ksl_vec3_t a = ksl_vec3(0.3, 0.2, 0.1), b, c, zero = ksl_vec3(0, 0, 0), far = ksl_vec3(6.5, 0, 0);
      ksl_vec3f_t g = ksl_vec3f(0.3f, 0.2f, 0.1f), h, farf = ksl_vec3f(6.5f, 0, 0);
      ksl_mat3x3_t R; ksl_mat3x3f_t S;
      ksl_mat3x3_setFromEulerAngles(&R, KSL_AXIS_ZYX, &a);
      ksl_mat3x3_getEulerAngles(&R, KSL_AXIS_ZYX, &b);
      if (!(fabs(b.x - 0.3) < 1e-15 && fabs(b.y - 0.2) < 1e-15 && fabs(b.z - 0.1) < 1e-15)) return 1;
      ksl_mat3x3_getEulerAngles(&R, KSL_AXIS_ZYX, &c, &zero);
      if (b.x != c.x || b.y != c.y || b.z != c.z) return 2;
      ksl_mat3x3_getEulerAngles(&R, KSL_AXIS_ZYX, &c, &far);
      if (!(fabs(c.x - 0.3 - 2 * 3.14159265358979) < 1e-12)) return 3;
      ksl_mat3x3f_setFromEulerAngles(&S, KSL_AXIS_ZYX, &g);
      ksl_mat3x3f_getEulerAngles(&S, KSL_AXIS_ZYX, &h);
      if (!(fabsf(h.x - 0.3f) < 1e-6f && fabsf(h.z - 0.1f) < 1e-6f)) return 4;
      ksl_mat3x3f_getEulerAngles(&S, KSL_AXIS_ZYX, &h, &farf);
      if (!(fabsf(h.x - 0.3f - 6.2831853f) < 1e-5f)) return 5;
      return sizeof(ksl_eulerangles_t) == 32 && sizeof(ksl_euleranglesf_t) == 16 ? 0 : 6;
    }
    """)
    subprocess.run(
        [*compiler, "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Werror", f"-I{INCLUDE}", tmp_path / "main", "-o", tmp_path / "run", "-lm"], check=True
    )
    assert subprocess.run([tmp_path / "run"]).returncode == 0


def test_sequences(ksl):
    for number in range(12):
        assert ksl("ksl_axis_getVector", number)[0].tolist() == [axes(number)]
        assert ksl("ksl_axis_getEulerAngles", np.array([axes(number)]))[0].tolist() == [number]
    for bad in (12, 13, -1, 1000):
        assert ksl("ksl_axis_getVector", bad)[0].tolist() == [[0, 1, 2]]
    for bad in itertools.product(range(-1, 4), repeat=3):
        known = list(bad) in [axes(n) for n in range(12)]
        assert (ksl("ksl_axis_getEulerAngles", np.array([bad]))[0][0] == 12) != known


@F
def test_B19_no_sequence_gives_NaN_and_goes_on(ksl, f, scalar):
    R = np.eye(3).reshape(1, 9)
    for bad in (12, -1, 99):
        assert np.isnan(ksl.outputs(f"ksl_mat3x3{f}_getEulerAnglesNear", R, bad, np.zeros((1, 3)), np.zeros((1, 3)))[0]).all()
        assert np.isnan(ksl.outputs(f"ksl_mat3x3{f}_setFromEulerAngles", R, bad, np.zeros((1, 3)))[0]).all()


# axis and angle


@F
def test_axis_and_angle_of_every_rotation(ksl, f, scalar, record_property):
    q = all_rotations(3)
    R = ref.numbers(rotation(q)).astype(float).astype(DTYPE[scalar])
    n = len(R)
    axis, angle = ksl.outputs(f"ksl_mat3x3{f}_getAxisAngle", R, np.zeros((n, 3)), np.zeros((n, 1)))
    angle = angle[:, 0]
    assert abs(norm(mp(axis)) - 1).max() <= 4 * UNIT[scalar]
    assert (angle >= 0).all() and (angle.astype(float) <= np.pi * (1 + 2 * UNIT[scalar])).all()
    a, t = mp(axis), mp(angle)
    back = ref.expm(ref.tilde(a * t[:, None]))
    worst = ref.spectral(back - ref.matrix(mp(R))).max() / UNIT[scalar]
    record_property("worst_u", float(worst))
    assert worst <= 12
    (again,) = ksl.outputs(f"ksl_mat3x3{f}_setFromAxisAngle", np.zeros((n, 9)), axis, angle)
    assert abs(again.astype(float) - R).max() <= 16 * UNIT[scalar]


@F
def test_B8_half_turns_have_their_axis(ksl, f, scalar):
    for a in ([0, 1, 0], [1, 2, 3], [1, 1, 0], [1, 0, 0], [0, 0, -1], [1e-6, 1, 0]):
        a = unit(mp([a]))
        R = (2 * ref.outer(a, a) - ref.identity(1, 3)).astype(float).reshape(1, 9)
        axis, angle = ksl.outputs(f"ksl_mat3x3{f}_getAxisAngle", R, np.zeros((1, 3)), np.zeros((1, 1)))
        assert abs(angle[0, 0] - np.pi) <= 4 * UNIT[scalar] * np.pi
        assert min(ref.distance(axis, a)[0], ref.distance(-axis, a)[0]) <= 4 * UNIT[scalar]


@F
def test_B8_small_angles_keep_axis_and_angle(ksl, f, scalar):
    a = unit(mp([[1, 2, 3]]))
    for angle in [1e-3, 1e-7, 1e-8, 1e-12, 1e-30] + ([1e-200, 1e-300] if scalar == "double" else []):
        R = ref.identity(1, 3) + gmpy2.mpfr(angle) * ref.tilde(a) + gmpy2.mpfr(angle) ** 2 / 2 * mul(ref.tilde(a), ref.tilde(a))
        axis, got = ksl.outputs(f"ksl_mat3x3{f}_getAxisAngle", ref.numbers(R).astype(float), np.zeros((1, 3)), np.zeros((1, 1)))
        assert abs(got[0, 0] / angle - 1) <= max(8 * UNIT[scalar], angle**2)
        assert ref.distance(axis, a)[0] <= max(8 * UNIT[scalar], angle**2)
    for angle in (np.pi - 1e-6, np.pi - 1e-9):
        R = ref.expm(ref.tilde(a * gmpy2.mpfr(angle)))
        axis, got = ksl.outputs(f"ksl_mat3x3{f}_getAxisAngle", ref.numbers(R).astype(float), np.zeros((1, 3)), np.zeros((1, 1)))
        assert abs(got[0, 0] - angle) <= 16 * UNIT[scalar]
        assert min(ref.distance(axis, a)[0], ref.distance(-axis, a)[0]) <= 8 * UNIT[scalar]


@F
def test_B8_a_trace_above_three_is_no_rotation_at_all(ksl, f, scalar):
    R = np.diag([1 + np.finfo(DTYPE[scalar]).eps, 1, 1]).reshape(1, 9)
    axis, angle = ksl.outputs(f"ksl_mat3x3{f}_getAxisAngle", R, np.zeros((1, 3)), np.zeros((1, 1)))
    assert angle[0, 0] == 0 and axis.tolist() == [[0, 0, 1]]


# principal axes


@F
@pytest.mark.parametrize("kind", ["positive", "any", "graded", "equal", "diagonal"])
def test_principal_axes(ksl, f, scalar, kind, record_property):
    random = np.random.default_rng(8)
    R = ref.rotations(random, N).astype(float)
    d = {
        "positive": random.uniform(0.1, 1, (N, 3)),
        "any": random.normal(size=(N, 3)),
        "graded": 10.0 ** random.uniform(-6, 6, (N, 3)),
        "equal": np.repeat(random.uniform(0.1, 1, (N, 1)), 3, 1) + np.array([0, 0, 1]) * random.integers(0, 2, (N, 1)),
        "diagonal": random.normal(size=(N, 3)),
    }[kind]
    if kind == "diagonal":
        R = np.tile(np.eye(3), (N, 1, 1))
    A = ((R * d[:, None, :]) @ R.transpose(0, 2, 1)).astype(DTYPE[scalar])
    A = np.tril(A) + np.tril(A, -1).transpose(0, 2, 1)
    given = A + np.triu(np.full((3, 3), 7), 1).astype(DTYPE[scalar])  # only the lower triangle is read
    values, vectors = ksl.outputs(f"ksl_mat3x3{f}_pca", given.transpose(0, 2, 1).reshape(N, 9), np.zeros((N, 9)))
    L, V = ref.matrix(mp(values)), ref.matrix(mp(vectors))
    size = abs(d).max(1)
    error = max((ref.spectral(mul(mul(V, L), ref.T(V)) - mp(A)) / size).max(), ref.spectral(mul(ref.T(V), V) - ref.identity(N, 3)).max()) / UNIT[scalar]
    record_property("worst_u", float(error))
    assert error <= 16
    l = values.reshape(N, 3, 3)
    assert not l[:, ~np.eye(3, dtype=bool)].any()
    assert (np.diff(l[:, [0, 1, 2], [0, 1, 2]], axis=1) <= 0).all()
    assert (np.linalg.det(V.astype(float)) > 0.5).all()


@F
def test_principal_axes_of_nothing_and_of_NaN(ksl, f, scalar):
    values, vectors = ksl.outputs(f"ksl_mat3x3{f}_pca", np.zeros((1, 9)), np.zeros((1, 9)))
    assert not values.any() and vectors.tolist() == np.eye(3).reshape(1, 9).tolist()
    values, vectors = ksl.outputs(f"ksl_mat3x3{f}_pca", np.full((1, 9), np.nan), np.zeros((1, 9)))
    assert np.isnan(values[0, [0, 4, 8]]).all()
