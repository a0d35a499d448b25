"""Positions as a manifold."""

from algorithms.row import Algorithm, Result

DIFFERENCE = {"q": "q0"}

ROWS = (
    Algorithm(
        name="integrate",
        mimic="projection",
        elements="nothing",
        loops="tree",
        header="manifold.hpp",
        inputs=("q", "v"),
        called={"v": "dv"},
        results=(Result("q1", ("nq",), "position"),),
        workspace="manifold_workspace",
        summary="Positions q ⊕ dv (…, nq): where q (…, nq) is after unit time at the constant joint velocity dv (…, nv).",
        text="Position {q1} = q ⊕ dv, after unit time at the constant joint velocity {dv} from {q}; joints with several coordinates move "
        "along the exponential of their group (Solà et al., A micro Lie theory for state estimation in robotics, 2018, section II-E).  "
        "O(joints).",
        python="""
dv: a displacement, in the numbers of a velocity: rad or m.  Spherical, planar and floating joints: the
exponential of dv in the child's axes; quaternions of the result have unit length.  Others: q + dv.

q, out, threads: as in :meth:`inverse_dynamics`.  Solà et al., A micro Lie theory for state estimation in robotics,
2018, section II-E; O(joints).
""",
    ),
    Algorithm(
        name="difference",
        mimic="projection",
        elements="nothing",
        loops="tree",
        header="manifold.hpp",
        inputs=("q", "q1"),
        called=DIFFERENCE,
        results=(Result("dv", ("motion",), "joint velocity that leads from q0 to q1 in unit time, rad or m"),),
        workspace="manifold_workspace",
        summary="Differences q1 ⊖ q0 (…, nv): the joint velocity that leads from q0 (…, nq) to q1 (…, nq) in unit time.",
        text="Difference {dv} = q1 ⊖ q0, the smallest joint velocity that leads from {q0} to {q1} in unit time (Solà et al., A micro Lie "
        "theory for state estimation in robotics, 2018, section II-E).  Angles of continuous joints are between −π and π; those of "
        "revolute joints are not reduced.  O(joints).",
        python="""
integrate(q0, difference(q0, q1)) is q1, but for whole turns of continuous joints and the sign of quaternions.
Continuous joints: between −π and π.  Spherical, planar and floating joints: the logarithm, a rotation by π at most.
Others: q1 − q0.  Whole turns of a revolute joint count, since it has limits.

q0, q1, out, threads: as in :meth:`inverse_dynamics`.  Solà et al., A micro Lie theory for state estimation in
robotics, 2018, section II-E; O(joints).
""",
    ),
    Algorithm(
        name="interpolate",
        mimic="projection",
        elements="nothing",
        loops="tree",
        header="manifold.hpp",
        inputs=("q", "q1", "fraction"),
        called=DIFFERENCE,
        results=(Result("between", ("nq",), "position"),),
        workspace="manifold_workspace",
        summary="Positions q0 ⊕ fraction (q1 ⊖ q0) (…, nq) between q0 and q1 (…, nq): q0 at 0, q1 at 1.",
        text="Position {between} = q0 ⊕ fraction (q1 ⊖ q0) between {q0} and {q1}: q0 where the {fraction} is 0, q1 where it is 1, on the "
        "shortest way and at constant joint velocity in between, and on the same way beyond.  O(joints).",
        python="""
fraction: (…), a number for each state, or one for all.  The way is the shortest and the joint velocity is constant; beyond 0 and 1 the
motion continues.  Rotations are interpolated spherically; floating joints move along a screw.

q0, q1, out, threads: as in :meth:`difference`.  O(joints).
""",
    ),
    Algorithm(
        name="integrate_jacobians",
        mimic="projection",
        elements="nothing",
        loops="tree",
        header="manifold.hpp",
        inputs=("q", "v"),
        called={"v": "dv"},
        results=(Result("by_q", ("motion", "nv"), "derivative by q"), Result("by_dv", ("motion", "nv"), "derivative by dv")),
        workspace="manifold_workspace",
        summary="Derivatives of q ⊕ dv by q and by dv, (…, nv, nv) each, all along joint velocities.",
        text="Derivatives of q ⊕ dv for {q} and {dv}: (q ⊕ δ) ⊕ (dv + ε) = (q ⊕ dv) ⊕ (by_q δ + by_dv ε) to first order; {by_q}, {by_dv} "
        "(Solà et al., A micro Lie theory for state estimation in robotics, 2018, section III).  O(joints), besides writing 2 nv² "
        "numbers.",
        python="""
(q ⊕ δ) ⊕ (dv + ε) = (q ⊕ dv) ⊕ (by_q δ + by_dv ε) to first order.  Both are identities except for spherical, planar and
floating joints, whose blocks are the inverse adjoint of the exponential, and its right Jacobian.

q, dv, threads: as in :meth:`integrate`; out: two arrays.  Solà et al., A micro Lie theory for state estimation in
robotics, 2018, section III; O(joints), besides writing 2 nv² numbers.
""",
    ),
    Algorithm(
        name="difference_jacobians",
        mimic="projection",
        elements="nothing",
        loops="tree",
        header="manifold.hpp",
        inputs=("q", "q1"),
        called=DIFFERENCE,
        results=(Result("by_q0", ("motion", "nv"), "derivative by q0"), Result("by_q1", ("motion", "nv"), "derivative by q1")),
        workspace="manifold_workspace",
        summary="Derivatives of q1 ⊖ q0 by q0 and by q1, (…, nv, nv) each, along joint velocities.",
        text="Derivatives of q1 ⊖ q0 for {q0} and {q1}: (q1 ⊕ ε) ⊖ (q0 ⊕ δ) = (q1 ⊖ q0) + by_q0 δ + by_q1 ε to first order; {by_q0}, {by_q1} "
        "(Solà et al., A micro Lie theory for state estimation in robotics, 2018, section III).  O(joints), besides writing 2 nv² "
        "numbers.",
        python="""
(q1 ⊕ ε) ⊖ (q0 ⊕ δ) = (q1 ⊖ q0) + by_q0 δ + by_q1 ε to first order.  They are ∓ identity except for spherical, planar and floating
joints.  If the rotation between the two is by π, the difference jumps; these are the derivatives on the side of the value that
:meth:`difference` returns.

q0, q1, threads: as in :meth:`difference`; out: two arrays.  Solà et al., A micro Lie theory for state estimation in
robotics, 2018, section III; O(joints), besides writing 2 nv² numbers.
""",
    ),
)
