"""What every function of the algebra computes, at 200 bits: the references of accuracy_test.py.

Error is measured per vector of the result (lin and ang of a screw, each column of a matrix, ...) against the sum of the
norms of the products that enter it: spectral norms where a matrix meets a vector, Frobenius norms (of r̃: √2 |r|) where
the result is an inertia matrix; u is the unit roundoff.  The bound is 4 u unless a function's entry states another: 5 u
where a rounded sum is turned, or a turned matrix added to.  References take the rounded arguments as they are."""

import numpy as np

import reference as ref
from reference import T, cross, dot, matrix, mul, norm, numbers

Ad, CoAd, pose, inverse_pose = ref.Ad, ref.CoAd, ref.pose, ref.inverse_pose

# name in double → (reference, bound in u).  A reference takes the arguments at 200 bits, in their order and with what
# outputs held before, and returns what is computed as a list of (value, scale) in the order of its numbers.
TABLE = {}


def entry(*names, bound=4.0):
    def add(f):
        for name in names:
            TABLE[f"ksl_{name}"] = (f, bound)
        return f

    return add


def exact(*values):
    """Numbers that must come out as they are."""
    return [(v, np.zeros(len(v))) for v in values]


def blocks6(A):
    """Spectral norms of the four 3×3 blocks of 6×6 matrices."""
    A = A.astype(float)
    return np.stack([np.stack([ref.spectral(A[:, i : i + 3, j : j + 3]) for j in (0, 3)], -1) for i in (0, 3)], 1)


def product6(A, x, sign=1):
    y, n = mul(A, x), blocks6(A)
    size = n[:, :, 0] * norm(x[:, :3])[:, None] + n[:, :, 1] * norm(x[:, 3:])[:, None]
    return [(sign * y[:, :3], size[:, 0]), (sign * y[:, 3:], size[:, 1])]


def product3(R, v, sign=1):
    return [(sign * mul(R, v), norm(v))]


def product4(A, B):
    """Pose × pose: four columns."""
    C, t = mul(A, B), norm(A[:, :3, 3])
    return [(C[:, :3, j], norm(B[:, :3, j]) + (t if j == 3 else 0)) for j in range(4)]


def product_rotations(A, B):
    C = mul(A, B)
    return [(C[:, :, j], norm(B[:, :, j])) for j in range(3)]


def column(A, j, sign=1):
    """Column j of a 6×6 adjoint: its two vectors; moments t × e have size |t|."""
    scale = blocks6(A)[:, :, j // 3]
    own = j // 3
    return [(sign * A[:, 3 * i : 3 * i + 3, j], 0 * scale[:, i] if i == own else scale[:, i]) for i in (0, 1)]


def unit(n, k, s=None):
    e = ref.zeros(n, 3)
    e[:, k] = ref.ONE if s is None else s
    return e


def split(x):
    return [x[:, :3], x[:, 3:]] if x.shape[1] == 6 else [x]


# elementwise, for vectors, screws and coscrews

for kind, letter in (("vec3", "v"), ("screw", "s"), ("coscrew", "c")):
    two = letter * 2

    entry(f"{kind}_copy")(lambda x, o: exact(x))
    entry(f"{kind}_inverted", f"{kind}_invert")(lambda x, o=None: exact(-x))
    entry(f"{kind}_scale")(lambda x, a: [(a[:, None] * p, abs(a.astype(float)) * norm(p)) for p in split(x)])
    entry(f"product_a{letter}")(lambda a, x, o: [(a[:, None] * p, abs(a.astype(float)) * norm(p)) for p in split(x)])
    entry(f"add_{two}", f"xpy_{two}")(lambda x, y, o=None: [(p + q, norm(p) + norm(q)) for p, q in zip(split(x), split(y))])
    entry(f"subtract_{two}")(lambda x, y, o: [(p - q, norm(p) + norm(q)) for p, q in zip(split(x), split(y))])
    entry(f"axpy_{two}")(lambda a, x, y: [(a[:, None] * p + q, abs(a.astype(float)) * norm(p) + norm(q)) for p, q in zip(split(x), split(y))])
    entry(f"nxpy_{two}")(lambda x, y: [(q - p, norm(p) + norm(q)) for p, q in zip(split(x), split(y))])


entry("vec3_setZero")(lambda v: exact(0 * v))
entry("vec3_swap")(lambda a, b: exact(b, a))
entry("vec3_scaled")(lambda v, a, o: [(a[:, None] * v, abs(a.astype(float)) * norm(v))])
entry("product_avinv")(lambda a, v, o: [(-a[:, None] * v, abs(a.astype(float)) * norm(v))])
entry("vec3_divided", "product_ainvvf")(lambda v, a, o: [(v / a[:, None], norm(v) / abs(a.astype(float)))])
entry("product_ainvv")(lambda a, v, o: [(v / a[:, None], norm(v) / abs(a.astype(float)))])
entry("vec3_l2norm")(lambda v: [(ref.sqrt(dot(v, v)), norm(v))])
entry("vec3_normalized", "vec3_normalize")(lambda v, o=None: [(v / ref.sqrt(dot(v, v))[:, None], np.ones(len(v)))])
entry("dot_vv")(lambda a, b: [(dot(a, b), norm(a) * norm(b))])
entry("cross_vv")(lambda a, b, o: [(cross(a, b), norm(a) * norm(b))])
entry("cross_vvinv")(lambda a, b, o: [(-cross(a, b), norm(a) * norm(b))])


for k, letter in enumerate("xyz"):
    for sign, inv in ((1, ""), (-1, "inv")):
        entry(f"add_vv{letter}{inv}")(lambda t, s, o, k=k, sign=sign: [(t + unit(len(t), k, sign * s), norm(t) + abs(s.astype(float)))])
        entry(f"product_drvt{letter}{inv}")(lambda R, s, o, k=k, sign=sign: [(sign * mul(matrix(R), unit(len(s), k, s)), abs(s.astype(float)))])

        @entry(f"product_drdr{letter}{inv}")
        def _(R, dc, o, k=k, sign=sign):
            A = ref.axis_rotation(k, dc)
            return product_rotations(matrix(R), A if sign == 1 else T(A))

        @entry(f"product_ddr{letter}{inv}")
        def _(D, dc, o, k=k, sign=sign):
            A = ref.axis_rotation(k, dc)
            return product4(pose(D), ref.rotation_pose(A if sign == 1 else T(A)))

        entry(f"product_ddt{letter}{inv}")(lambda D, s, o, k=k, sign=sign: product4(pose(D), ref.translation_pose(unit(len(s), k, sign * s))))
        entry(f"hst{letter}{inv}")(lambda D, o, k=k, sign=sign: column(Ad(pose(D)), k, sign))
        entry(f"hsr{letter}{inv}")(lambda D, o, k=k, sign=sign: column(Ad(pose(D)), 3 + k, sign))
        entry(f"hct{letter}{inv}")(lambda D, o, k=k, sign=sign: column(CoAd(pose(D)), k, sign))
        entry(f"hcr{letter}{inv}")(lambda D, o, k=k, sign=sign: column(CoAd(pose(D)), 3 + k, sign))

for sign, inv in ((1, ""), (-1, "inv")):
    entry(f"hsta{inv}")(lambda D, a, o, sign=sign: product6(Ad(pose(D)), np.concatenate([a, 0 * a], 1), sign))
    entry(f"hsra{inv}")(lambda D, a, o, sign=sign: product6(Ad(pose(D)), np.concatenate([0 * a, a], 1), sign))
    entry(f"hcta{inv}")(lambda D, a, o, sign=sign: product6(CoAd(pose(D)), np.concatenate([a, 0 * a], 1), sign))
    entry(f"hcra{inv}")(lambda D, a, o, sign=sign: product6(CoAd(pose(D)), np.concatenate([0 * a, a], 1), sign))
    entry(f"product_drv{inv}")(lambda R, v, o, sign=sign: product3(matrix(R), v, sign))
    entry(f"product_drinvv{inv}")(lambda R, v, o, sign=sign: product3(T(matrix(R)), v, sign))
    entry(f"product_Adrs{inv}")(lambda R, s, o, sign=sign: product6(Ad(ref.rotation_pose(matrix(R))), s, sign))
    entry(f"product_Adts{inv}")(lambda t, s, o, sign=sign: product6(Ad(ref.translation_pose(t)), s, sign))
    entry(f"product_Ads{inv}")(lambda D, s, o, sign=sign: product6(Ad(pose(D)), s, sign))
    entry(f"product_CoAdrc{inv}")(lambda R, c, o, sign=sign: product6(CoAd(ref.rotation_pose(matrix(R))), c, sign))
    entry(f"product_CoAdtc{inv}")(lambda t, c, o, sign=sign: product6(CoAd(ref.translation_pose(t)), c, sign))
    entry(f"product_CoAdc{inv}")(lambda D, c, o, sign=sign: product6(CoAd(pose(D)), c, sign))


# matrices

entry("mat3x3_setIdentity")(lambda R: exact(numbers(ref.identity(len(R), 3))))
entry("mat3x3_copy")(lambda R, o: exact(R))
entry("mat3x3_setFromVectors")(lambda o, x, y, z: exact(numbers(np.stack([x, y, z], -1))))
entry("mat3x3_toVectors")(lambda R, x, y, z: exact(*(matrix(R)[:, :, j] for j in range(3))))
entry("mat3x3_transposed", "mat3x3_transpose")(lambda R, o=None: exact(numbers(T(matrix(R)))))
entry("mat3x3_determinant")(lambda R: [(dot(matrix(R)[:, :, 0], cross(matrix(R)[:, :, 1], matrix(R)[:, :, 2])), np.ones(len(R)))])


def gram_schmidt(R):
    x, y, z = (matrix(R)[:, :, j] for j in range(3))
    x = x / ref.sqrt(dot(x, x))[:, None]
    y = y - dot(x, y)[:, None] * x
    y = y / ref.sqrt(dot(y, y))[:, None]
    z = z - dot(x, z)[:, None] * x - dot(y, z)[:, None] * y
    z = z / ref.sqrt(dot(z, z))[:, None]
    return [(c, np.ones(len(R))) for c in (x, y, z)]


entry("mat3x3_normalized", "mat3x3_normalize")(lambda R, o=None: gram_schmidt(R))


def inverse3(R):
    A = ref.solve3(matrix(R))
    return [(0 * R[:, 0], np.zeros(len(R)))] + [(A[:, :, j], norm(A) * norm(R) / 3) for j in range(3)]


entry("mat3x3_inverted", "mat3x3_invert")(lambda R, o=None: inverse3(R))


def rodrigues(a, s, c):
    A = c[:, None, None] * ref.identity(len(a), 3) + s[:, None, None] * ref.tilde(a) + (1 - c)[:, None, None] * ref.outer(a, a)
    size = abs(c.astype(float)) + abs(s.astype(float)) * norm(a) + abs((1 - c).astype(float)) * norm(a) ** 2
    return [(A[:, :, j], size) for j in range(3)]


entry("mat3x3_setFromAxisDC")(lambda o, axis, dc: rodrigues(axis, dc[:, 0], dc[:, 1]))
entry("product_drdr")(lambda A, B, o: product_rotations(matrix(A), matrix(B)))
entry("product_drdrinv")(lambda A, B, o: product_rotations(matrix(A), T(matrix(B))))
entry("product_drinvdr")(lambda A, B, o: product_rotations(T(matrix(A)), matrix(B)))


# poses

entry("SE3_setIdentity")(lambda D: exact(numbers(ref.identity(len(D), 4)[:, :3])))
entry("SE3_copy")(lambda D, o: exact(D))
entry("SE3_getTranslation")(lambda D, o: exact(pose(D)[:, :3, 3]))
entry("SE3_toMat4x4")(lambda D, o: exact(numbers(pose(D))))


def inverted(D):
    A = inverse_pose(pose(D))
    return [(A[:, :3, j], norm(A[:, :3, j])) for j in range(4)]


entry("SE3_inverted", "SE3_invert")(lambda D, o=None: inverted(D))
entry("product_dv")(lambda D, v, o: [(mul(pose(D)[:, :3, :3], v) + pose(D)[:, :3, 3], norm(v) + norm(D[:, 9:]))])


@entry("product_dinvv")
def _(D, v, o):
    A = inverse_pose(pose(D))
    return [(mul(A[:, :3, :3], v) + A[:, :3, 3], norm(v) + norm(D[:, 9:]))]


entry("product_dd")(lambda A, B, o: product4(pose(A), pose(B)))
entry("product_ddinv")(lambda A, B, o: product4(pose(A), inverse_pose(pose(B))))
entry("product_dinvd")(lambda A, B, o: product4(inverse_pose(pose(A)), pose(B)))
entry("product_ddr")(lambda D, R, o: product4(pose(D), ref.rotation_pose(matrix(R))))
entry("product_ddrinv")(lambda D, R, o: product4(pose(D), ref.rotation_pose(T(matrix(R)))))
entry("product_ddt")(lambda D, t, o: product4(pose(D), ref.translation_pose(t)))
entry("product_ddtinv")(lambda D, t, o: product4(pose(D), ref.translation_pose(-t)))
entry("product_dinvdt")(lambda D, t, o: product4(inverse_pose(pose(D)), ref.translation_pose(t)))


# screws and coscrews

entry("product_Adinvs", bound=5)(lambda D, s, o: product6(Ad(inverse_pose(pose(D))), s))
entry("product_Adrinvs")(lambda R, s, o: product6(Ad(ref.rotation_pose(T(matrix(R)))), s))
entry("product_Adtinvs")(lambda t, s, o: product6(Ad(ref.translation_pose(-t)), s))
entry("product_CoAdinvc", bound=5)(lambda D, c, o: product6(CoAd(inverse_pose(pose(D))), c))
entry("product_CoAdrinvc")(lambda R, c, o: product6(CoAd(ref.rotation_pose(T(matrix(R)))), c))
entry("product_CoAdtinvc")(lambda t, c, o: product6(CoAd(ref.translation_pose(-t)), c))
entry("cross_ss")(lambda a, b, o: product6(ref.ad(a), b))
entry("cross_sst")(lambda a, b, o: product6(ref.ad(a), np.concatenate([b[:, :3], 0 * b[:, 3:]], 1)))
entry("cross_sc")(lambda s, c, o: product6(ref.coad(s), c))
entry("cross_sca")(lambda s, c, o: product6(ref.coad(s), np.concatenate([0 * c[:, :3], c[:, 3:]], 1)))
entry("add_sst", "add_cct")(lambda a, b, o: [(a[:, :3] + b[:, :3], norm(a[:, :3]) + norm(b[:, :3])), (a[:, 3:], np.zeros(len(a)))])
entry("dot_cs")(lambda c, s: [(dot(c, s), norm(c[:, :3]) * norm(s[:, :3]) + norm(c[:, 3:]) * norm(s[:, 3:]))])


def magnitude(first, second, eps):
    """The norm of a screw's (ω, v) or a coscrew's (f, τ): the first, or the second where the first is negligible."""
    negligible = norm(first) <= eps * norm(second)
    return np.where(negligible, ref.sqrt(dot(second, second)), ref.sqrt(dot(first, first)))


@entry("screw_norm")
def _(s, eps):
    n = magnitude(s[:, 3:], s[:, :3], eps)
    return [(n, n.astype(float))]


@entry("coscrew_norm")
def _(c, eps):
    n = magnitude(c[:, :3], c[:, 3:], eps)
    return [(n, n.astype(float))]


def normalized(x, n):
    return [(p / n[:, None], norm(p) / n.astype(float)) for p in split(x)]


entry("screw_normalized")(lambda s, o, eps: normalized(s, magnitude(s[:, 3:], s[:, :3], eps)))
entry("screw_normalize")(lambda s, eps: normalized(s, magnitude(s[:, 3:], s[:, :3], eps)))
entry("coscrew_normalized")(lambda c, o, eps: normalized(c, magnitude(c[:, :3], c[:, 3:], eps)))
entry("coscrew_normalize")(lambda c, eps: normalized(c, magnitude(c[:, :3], c[:, 3:], eps)))
entry("screw_fromSlide")(lambda e, o: exact(np.concatenate([e, 0 * e], 1)))
entry("coscrew_fromCouple")(lambda e, o: exact(np.concatenate([0 * e, e], 1)))
entry("screw_fromTurn")(lambda t, e, o: [(cross(t, e), norm(t) * norm(e)), (e, np.zeros(len(e)))])
entry("coscrew_fromForce")(lambda t, e, o: [(e, np.zeros(len(e))), (cross(t, e), norm(t) * norm(e))])


# inertias


def parts(M):
    """m, first moment, inertia matrix."""
    return M[:, 0], M[:, 1:4], ref.symmetric(M[:, 4:])


def moment(M, I, size):
    """The numbers of a result: m, first moment, six elements."""
    m, h, hs = M
    return [(m, np.zeros(len(m))), (h, hs), (ref.six(I), size)]


entry("inertia_copy", "spatial_inertia_copy")(lambda M, o: exact(M))
entry("spatial_inertia_added")(lambda A, B, o: [(p(A) + p(B), norm(p(A)) + norm(p(B))) for p in (lambda x: x[:, :1], lambda x: x[:, 1:4], lambda x: x[:, 4:])])
entry("inertia_getMatrix", "spatial_inertia_getMatrix")(lambda M, o: exact(numbers(parts(M)[2])))


@entry("product_Ms")
def _(M, s, o):
    m, h, I = parts(M)
    y = mul(ref.spatial_inertia(m, h, I), s)
    v, w = norm(s[:, :3]), norm(s[:, 3:])
    return [(y[:, :3], abs(m.astype(float)) * v + norm(h) * w), (y[:, 3:], norm(I) * w + norm(h) * v)]


def spatial_inertia_moved(M, D):
    m, h, I = parts(M)
    dense = mul(mul(CoAd(D), ref.spatial_inertia(m, h, I)), Ad(inverse_pose(D)))
    t, mf = norm(D[:, :3, 3]), m.astype(float)
    first = np.stack([dense[:, 5, 1], dense[:, 3, 2], dense[:, 4, 0]], -1)
    return moment((M[:, 0], first, norm(h) + mf * t), dense[:, 3:, 3:], norm(I) + 4 * norm(h) * t + 2 * mf * t**2)


entry("spatial_inertia_transformed", bound=5)(lambda M, D, o: spatial_inertia_moved(M, pose(D)))
entry("spatial_inertia_translated")(lambda M, t, o: spatial_inertia_moved(M, ref.translation_pose(t)))


def rotated(M, R):
    m, h, I = parts(M)
    R = matrix(R)
    return moment((m, mul(R, h), norm(h)), mul(mul(R, I), T(R)), norm(I))


def translated(m, h, I, t):
    p = h + m[:, None] * t
    size = norm(h) + abs(m.astype(float)) * norm(t)
    r = p / m[:, None]
    return moment((m, p, size), I + ref.parallel_axis(m, r), norm(I) + 2 * size**2 / m.astype(float))


entry("inertia_rotated", "inertia_rotate")(lambda M, R, o=None: rotated(M, R))
entry("inertia_translated", "inertia_translate")(lambda M, t, o=None: translated(*parts(M), t))


def transformed(M, D):
    m, h, I = parts(M)
    R = pose(D)[:, :3, :3]
    return translated(m, mul(R, h), mul(mul(R, I), T(R)), pose(D)[:, :3, 3])


entry("inertia_transformed", "inertia_transform", bound=5)(lambda M, D, o=None: transformed(M, D))


@entry("inertia_merge", bound=6)
def _(Mi, ti, Mj, tj, D):
    """Both bodies' inertias moved to their common centroid and added."""
    (mi, _, Ii), (mj, _, Ij) = parts(Mi), parts(Mj)
    R, t = pose(D)[:, :3, :3], pose(D)[:, :3, 3]
    cj = mul(R, tj) + t
    m = mi + mj
    first = mi[:, None] * ti + mj[:, None] * cj
    c = first / m[:, None]
    I = Ii + ref.parallel_axis(mi, ti - c) + mul(mul(R, Ij), T(R)) + ref.parallel_axis(mj, cj - c)
    a, b = mi.astype(float), mj.astype(float)
    far = norm(ti) + norm(tj) + norm(t)
    return [(m, m.astype(float)), (first, a * norm(ti) + b * (norm(tj) + norm(t))), (ref.six(I), norm(Ii) + norm(Ij) + 2 * a * b / (a + b) * far**2)]


@entry("inertia_toSpatialInertia")
def _(M, o):
    m, h, I = parts(M)
    return moment((m, h, np.zeros(len(m))), I + ref.parallel_axis(m, h / m[:, None]), norm(I) + 2 * norm(h) ** 2 / m.astype(float))


@entry("spatial_inertia_toInertia")
def _(M, o):
    m, h, I = parts(M)
    return moment((m, h, np.zeros(len(m))), I - ref.parallel_axis(m, h / m[:, None]), norm(I) + 2 * norm(h) ** 2 / m.astype(float))


@entry("spatial_inertia_fromMassCentroid")
def _(m, c, xx, yy, zz, xy, yz, zx, o):
    I = ref.symmetric(np.stack([xx, yy, zz, xy, yz, zx], -1))
    am = abs(m.astype(float))
    return moment((m, m[:, None] * c, am * norm(c)), I + ref.parallel_axis(m, c), norm(I) + 2 * am * norm(c) ** 2)


# articulated-body inertias, block by block: M, H, I


def blocks(A):
    """M, H, I of the 21 numbers."""
    return ref.symmetric(A[:, :6]), matrix(A[:, 6:15]), ref.symmetric(A[:, 15:])


def articulated(A):
    M, H, I = blocks(A)
    return ref.block(M, H, T(H), I)


def of_blocks(dense, sizes):
    """The 21 numbers of a dense result."""
    return list(zip((ref.six(dense[:, :3, :3]), numbers(dense[:, :3, 3:]), ref.six(dense[:, 3:, 3:])), sizes, strict=True))


def articulated_moved(A, D):
    """[Ad]* A [Ad]⁻¹, from the definition; t̃ counts √2 |t|."""
    (M, H, I), t = map(norm, blocks(A)), np.sqrt(2) * norm(D[:, :3, 3])
    return of_blocks(mul(mul(CoAd(D), articulated(A)), Ad(inverse_pose(D))), (M, H + M * t, I + 2 * H * t + M * t**2))


entry("articulated_inertia_copy")(lambda A, o: exact(A))
entry("articulated_inertia_getM")(lambda A, o: exact(numbers(blocks(A)[0])))
entry("articulated_inertia_getI")(lambda A, o: exact(numbers(blocks(A)[2])))
entry("articulated_inertia_added")(lambda A, B, o: of_blocks(articulated(A) + articulated(B), [norm(a) + norm(b) for a, b in zip(blocks(A), blocks(B))]))
entry("articulated_inertia_rotated")(lambda A, R, o: articulated_moved(A, ref.rotation_pose(matrix(R))))
entry("articulated_inertia_translated")(lambda A, t, o: articulated_moved(A, ref.translation_pose(t)))
entry("articulated_inertia_transformed")(lambda A, D, o: articulated_moved(A, pose(D)))
entry("spatial_inertia_toArticulated")(lambda M, o: of_blocks(ref.spatial_inertia(*parts(M)), np.zeros((3, len(M)))))


@entry("articulated_inertia_downdated")
def _(A, U, d, o):
    (M, H, I), (p, q), k = map(norm, blocks(A)), map(norm, split(U)), abs(d.astype(float))
    return of_blocks(articulated(A) - d[:, None, None] * ref.outer(U, U), (M + k * p * p, H + k * p * q, I + k * q * q))


@entry("product_As")
def _(A, s, o):
    (M, H, I), (v, w), y = map(norm, blocks(A)), map(norm, split(s)), mul(articulated(A), s)
    return [(y[:, :3], M * v + H * w), (y[:, 3:], H * v + I * w)]


# the angular-first layer: equations (11) to (16) of the six-d page


def axes_and_origin(X):
    """E, r of the twelve numbers of a transform."""
    return matrix(X[:, :9]), X[:, 9:]


def X_motion(X):
    """six-d (11): [E 0; 0 E] [1 0; −r× 1]"""
    E, r = axes_and_origin(X)
    O, one = ref.zeros(len(X), 3, 3), ref.identity(len(X), 3)
    return mul(ref.block(E, O, O, E), ref.block(one, O, -ref.tilde(r), one))


def X_force(X):
    """six-d (12): [E 0; 0 E] [1 −r×; 0 1]"""
    E, r = axes_and_origin(X)
    O, one = ref.zeros(len(X), 3, 3), ref.identity(len(X), 3)
    return mul(ref.block(E, O, O, E), ref.block(one, -ref.tilde(r), O, one))


def crm(v):
    """× = [ω× 0; v× ω×]"""
    w, u = ref.tilde(v[:, :3]), ref.tilde(v[:, 3:])
    return ref.block(w, ref.zeros(len(v), 3, 3), u, w)


def crf(v):
    """×* = −(×)ᵀ"""
    return -T(crm(v))


def inertia6(M):
    """[I h̃; h̃ᵀ m1]"""
    m, h, I = parts(M)
    return ref.block(I, ref.tilde(h), T(ref.tilde(h)), m[:, None, None] * ref.identity(len(M), 3))


def swap(x):
    return np.concatenate([x[:, 3:], x[:, :3]], 1)


def power(m, f):
    (w, v), (t, p) = map(norm, split(m)), map(norm, split(f))
    return [(dot(m, f), w * t + v * p)]


entry("motion_fromScrew", "motion_toScrew", "force_fromCoscrew", "force_toCoscrew")(lambda x, o: exact(swap(x)))
entry("motion_added", "force_added")(lambda x, y, o: [(p + q, norm(p) + norm(q)) for p, q in zip(split(x), split(y))])
entry("motion_scaled", "force_scaled")(lambda x, a, o: [(a[:, None] * p, abs(a.astype(float)) * norm(p)) for p in split(x)])
entry("plucker_dot")(power)
entry("plucker_reciprocal_cm")(lambda c, m: power(m, swap(c)))
entry("plucker_reciprocal_fs")(lambda f, s: power(swap(s), f))
entry("plucker_crossMotion")(lambda v, m, o: product6(crm(v), m))
entry("plucker_crossForce")(lambda v, f, o: product6(crf(v), f))
entry("plucker_motion")(lambda X, m, o: product6(X_motion(X), m))
entry("plucker_motionInverse")(lambda X, m, o: product6(T(X_force(X)), m))
entry("plucker_force")(lambda X, f, o: product6(X_force(X), f))
entry("plucker_forceInverse")(lambda X, f, o: product6(T(X_motion(X)), f))
entry("plucker_plux")(lambda E, r, o: exact(E, r))
entry("plucker_xlt")(lambda r, o: exact(numbers(ref.identity(len(r), 3)), r))
entry("plucker_fromSE3", "plucker_toSE3")(lambda X, o: exact(numbers(T(matrix(X[:, :9]))), X[:, 9:]))
entry("plucker_Vpt")(lambda v, p, o: [(v[:, 3:] + cross(v[:, :3], p), norm(v[:, 3:]) + norm(v[:, :3]) * norm(p))])
entry("plucker_Fpt")(lambda f, p, o: [(cross(p, f), norm(p) * norm(f)), *exact(f)])


@entry("plucker_Xpt")
def _(X, p, o):
    E, r = axes_and_origin(X)
    return [(mul(E, p - r), norm(p) + norm(r))]


@entry("plucker_product")
def _(X2, X1, o):
    """CXA = CXB BXA."""
    (E2, r2), (E1, r1) = axes_and_origin(X2), axes_and_origin(X1)
    return [*product_rotations(E2, E1), (r1 + mul(T(E1), r2), norm(r1) + norm(r2))]


@entry("plucker_inverted")
def _(X, o):
    E, r = axes_and_origin(X)
    return [*exact(numbers(T(E))), (-mul(E, r), norm(r))]


@entry("plucker_pluho")
def _(X, o):
    """[E −E r; 0 1]"""
    E, r = axes_and_origin(X)
    H = ref.identity(len(X), 4)
    H[:, :3, :3], H[:, :3, 3] = E, -mul(E, r)
    return [(H[:, :, j], norm(r) if j == 3 else np.zeros(len(X))) for j in range(4)]


@entry("plucker_fromPluho")
def _(H, o):
    E, p = T(H.reshape(-1, 4, 4))[:, :3, :3], H[:, 12:15]
    return [*exact(numbers(E)), (-mul(T(E), p), ref.spectral(E) * norm(p))]


@entry("plucker_XtoV")
def _(X, o):
    """Half of X23 − X32, X31 − X13, X12 − X21 and of X53 − X62, X61 − X43, X42 − X51, by the definition."""
    A, at = X_motion(X), [(1, 2, 2, 1), (2, 0, 0, 2), (0, 1, 1, 0), (4, 2, 5, 1), (5, 0, 3, 2), (3, 1, 4, 0)]
    v = np.stack([(A[:, i, j] - A[:, k, l]) / 2 for i, j, k, l in at], -1)
    return list(zip(split(v), (np.ones(len(X)), 2 * norm(X[:, 9:])), strict=True))


@entry("plucker_inertia", bound=5)
def _(X, M, o):
    """I_B = BXA* I_A AXB."""
    (m, h, I), far, moved = parts(M), norm(X[:, 9:]), mul(mul(X_force(X), inertia6(M)), T(X_force(X)))
    mf = m.astype(float)
    first = np.stack([moved[:, 2, 4], moved[:, 0, 5], moved[:, 1, 3]], -1)
    return moment((m, first, norm(h) + mf * far), moved[:, :3, :3], norm(I) + 4 * norm(h) * far + 2 * mf * far**2)


@entry("plucker_momentum")
def _(M, v, o):
    (m, h, I), (w, u), y = parts(M), map(norm, split(v)), mul(inertia6(M), v)
    return [(y[:, :3], norm(I) * w + norm(h) * u), (y[:, 3:], m.astype(float) * u + norm(h) * w)]


@entry("plucker_kineticEnergy")
def _(M, v):
    (m, h, I), (w, u) = parts(M), map(norm, split(v))
    return [(dot(v, mul(inertia6(M), v)) / 2, (norm(I) * w * w + 2 * norm(h) * u * w + m.astype(float) * u * u) / 2)]


# four-vectors, 4×4 matrices, quaternions

for kind in ("vec4", "quaternion"):
    entry(f"{kind}_copy")(lambda x, o: exact(x))
    entry(f"{kind}_l2norm")(lambda x: [(ref.sqrt(dot(x, x)), norm(x))])
    entry(f"{kind}_scaled")(lambda x, a, o: [(a[:, None] * x, abs(a.astype(float)) * norm(x))])
    entry(f"{kind}_normalized", f"{kind}_normalize")(lambda x, o=None: [(x / ref.sqrt(dot(x, x))[:, None], np.ones(len(x)))])


entry("vec4_scale")(lambda x, a: [(a[:, None] * x, abs(a.astype(float)) * norm(x))])
entry("vec4_swap")(lambda a, b: exact(b, a))
entry("vec4_inverted", "vec4_invert")(lambda x, o=None: exact(-x))
entry("mat4x4_setIdentity")(lambda M: exact(numbers(ref.identity(len(M), 4))))
entry("mat4x4_getTranslation")(lambda M, o: exact(M[:, 12:15]))
entry("mat4x4_toSE3")(lambda M, o: exact(M.reshape(-1, 4, 4)[:, :, :3].reshape(len(M), 12)))


def conj(q):
    return q * np.array([-1, -1, -1, 1], dtype=int)


def pure(v):
    return np.concatenate([v, 0 * v[:, :1]], 1)


def hamilton(p, q):
    """p q, from the products of the units."""
    out = ref.zeros(len(p), 4)
    out[:, 3] = p[:, 3] * q[:, 3]
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        out[:, i] = out[:, i] + p[:, 3] * q[:, i] + p[:, i] * q[:, 3]  # 1 i = i 1 = i
        out[:, 3] = out[:, 3] - p[:, i] * q[:, i]  # i i = −1
        out[:, k] = out[:, k] + p[:, i] * q[:, j] - p[:, j] * q[:, i]  # i j = k, j i = −k
    return out


def product_quaternions(p, q):
    return [(hamilton(p, q), norm(p) * norm(q))]


entry("quaternion_setIdentity")(lambda q: exact(0 * q + np.array([0, 0, 0, 1])))
entry("quaternion_conjugated", "quaternion_conjugate")(lambda q, o=None: exact(conj(q)))
entry("dot_qq")(lambda p, q: [(dot(p, q), norm(p) * norm(q))])
entry("axpy_qq")(lambda a, x, y: [(a[:, None] * x + y, abs(a.astype(float)) * norm(x) + norm(y))])
entry("product_qq", "quaternion_product_qq")(lambda p, q, o: product_quaternions(p, q))
entry("product_qconjq", "quaternion_product_qconjq")(lambda p, q, o: product_quaternions(conj(p), q))
entry("quaternion_product_uqinverseq")(lambda p, q, o: exact(p, q) + product_quaternions(conj(p), q))
entry("product_qqconj", "quaternion_product_qqconj")(lambda p, q, o: product_quaternions(p, conj(q)))
entry("product_qconjqconj", "quaternion_product_qconjqconj")(lambda p, q, o: product_quaternions(conj(p), conj(q)))
entry("product_qv", "quaternion_product_qv")(lambda q, v, o: product_quaternions(q, pure(v)))
entry("product_qconjv", "quaternion_product_qconjv")(lambda q, v, o: product_quaternions(conj(q), pure(v)))
entry("product_vq", "quaternion_product_vq")(lambda v, q, o: product_quaternions(pure(v), q))
entry("product_vqconj", "quaternion_product_vqconj")(lambda v, q, o: product_quaternions(pure(v), conj(q)))


@entry("product_qxq")
def _(cs, q, o):
    qx = ref.zeros(len(q), 4)
    qx[:, 3], qx[:, 0] = cs[:, 0], cs[:, 1]
    return product_quaternions(qx, q)


def turned(q, v):
    """v + 2w r × v + 2 r × (r × v)"""
    r, w = q[:, :3], q[:, 3:]
    size = 1 + 2 * norm(w) * norm(r) + 2 * norm(r) ** 2
    return [(v + 2 * w * cross(r, v) + 2 * cross(r, cross(r, v)), norm(v) * size)]


entry("product_qvqconj")(lambda q, v, o: turned(q, v))
entry("product_qconjvq")(lambda q, v, o: turned(conj(q), v))


def turning(q):
    """R(q), q of any length: 1 + 2 (w r̃ + r̃²)/|q|²."""
    q = q / ref.sqrt(dot(q, q))[:, None]
    r = ref.tilde(q[:, :3])
    R = ref.identity(len(q), 3) + 2 * q[:, 3, None, None] * r + 2 * mul(r, r)
    sine, cosine = norm(q[:, :3]), norm(q[:, 3:])
    return [(R[:, :, j], 1 + 2 * cosine * sine + 2 * sine**2) for j in range(3)]


entry("mat3x3_setFromQuaternion")(lambda o, q: turning(q))
entry("quaternion_toMat3x3")(lambda q, o: [(q / ref.sqrt(dot(q, q))[:, None], np.ones(len(q)))] + turning(q))


def stepped(q, v, sign):
    return [(q + sign * hamilton(q, pure(v)) / 2, norm(q) * (1 + norm(v) / 2))]


entry("add_dpiToq")(lambda v, q: stepped(q, v, 1))
entry("subtract_dpiFromq")(lambda v, q: stepped(q, v, -1))


@entry("omega_to_dquaternion")
def _(w, q, o):
    length2 = dot(q, q)
    value = hamilton(pure(w), q) / 2 + (1 - length2)[:, None] * q
    return [(value, norm(q) * (norm(w) / 2 + 1 + length2.astype(float)))]


@entry("mat3x3_setFromTilde")
def _(o, a, b, w):
    W = ref.tilde(w)
    M = ref.identity(len(w), 3) + a[:, None, None] * W + b[:, None, None] * mul(W, W)
    size = 1 + abs(a.astype(float)) * norm(w) + abs(b.astype(float)) * norm(w) ** 2
    return [(M[:, :, j], size) for j in range(3)]


@entry("mat3x3_setFromTildeRate")
def _(o, w, v, b, c, db, dc):
    W, V, d = ref.tilde(w), ref.tilde(v), dot(w, v)[:, None, None]
    b, c, db, dc = (x[:, None, None] for x in (b, c, db, dc))
    M = b * V + c * (mul(W, V) + mul(V, W)) + d * (db * W + dc * mul(W, W))
    b, c, db, dc = (abs(x[:, 0, 0].astype(float)) for x in (b, c, db, dc))
    size = norm(v) * (b + 2 * c * norm(w) + db * norm(w) ** 2 + dc * norm(w) ** 3)
    return [(M[:, :, j], size) for j in range(3)]


# by value

entry("vec3", "vec4", "quaternion", "screw", "coscrew", "mat3x3_cmo", "SE3_cmo", "mat4x4_cmo")(lambda *numbers_: exact(np.stack(numbers_, -1)))
entry("mat3x3", "SE3")(lambda *numbers_: exact(numbers(np.stack(numbers_, -1).reshape(len(numbers_[0]), 3, -1))))
entry("mat4x4")(lambda *numbers_: exact(numbers(np.stack(numbers_, -1).reshape(-1, 4, 4))))
entry("mat4x4_fromRt")(lambda R, t: exact(numbers(pose(np.concatenate([R, t], 1)))))
entry("mat4x4_fromSE3")(lambda D: exact(numbers(pose(D))))
entry("SE3_fromRt")(lambda R, t: exact(np.concatenate([R, t], 1)))
entry("SE3_identity")(lambda: exact(numbers(ref.identity(1, 4)[:, :3])))
entry("inertia")(lambda m, t, *I: [(m, np.zeros(len(m))), (m[:, None] * t, abs(m.astype(float)) * norm(t)), (np.stack(I, -1), np.zeros(len(m)))])
