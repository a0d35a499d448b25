"""Forward dynamics."""

from algorithms.row import Algorithm, Result

ROWS = (
    Algorithm(
        name="forward_dynamics",
        mimic="solution",
        elements="wrenches",
        loops="accelerations",
        header="forward_dynamics.hpp",
        needs_mass=True,
        inputs=("q", "v", "tau"),
        external="optional",
        results=(Result("a", ("motion",), "accelerations, rad/s² or m/s²"),),
        form="accelerations",
        smooth_friction=True,
        summary="Accelerations (…, nv) under joint efforts tau (…, nv) at q (…, nq) and v (…, nv).",
        text="Accelerations {a} for {q}, {v} and joint efforts {tau}, under gravity and external wrenches, by the articulated-body "
        "algorithm (Featherstone, RBDA 2008, table 7.1).  O(bodies).",
        python="""
The inverse of :meth:`inverse_dynamics`, same conventions.  Articulated-body algorithm (Featherstone, RBDA 2008,
table 7.1); O(bodies).

Raises ValueError if a joint can move without moving any mass, for example at an end of the mechanism whose links have none: its
acceleration is not determined.

stabilise: of a mechanism with loops, corrects errors e of loops that are slightly open: ë + 2 α ė + β² e = 0 (Baumgarte, 1972), with (α, β) in
1/s, or one number for both, with which errors decay as e^(−α t).  Errors up to 1e-2 of the mechanism's length, and of the terms of
velocities, are then accepted; otherwise past 1e-6 they are refused.  The states are computed one by one.
""",
    ),
    Algorithm(
        name="forward_dynamics_by_mass_matrix",
        mimic="solution",
        elements="wrenches",
        loops="accelerations",
        header="forward_dynamics_by_mass_matrix.hpp",
        needs_mass=True,
        inputs=("q", "v", "tau"),
        external="optional",
        results=(Result("a", ("motion",), "accelerations, rad/s² or m/s²"),),
        smooth_friction=True,
        summary="Joint accelerations (…, nv) as of forward_dynamics, through the mass matrix: a = M⁻¹ (tau − bias).",
        text="Accelerations {a} for {q}, {v} and joint efforts {tau}, under gravity and external wrenches, by the mass matrix, its factors and "
        "the bias (Featherstone, RBDA 2008, section 6.1).  O(nv × depth²).",
        python="""
It serves to check :meth:`forward_dynamics`, with which it has no step in common.  It is slower, except for very small mechanisms.
Composite-rigid-body algorithm and sparse factors (Featherstone, RBDA 2008, tables 6.2 and 6.3); O(nv × depth²).
""",
    ),
    Algorithm(
        name="hybrid_dynamics",
        mimic="hybrid",
        elements="wrenches",
        loops="refusal",
        header="hybrid_dynamics.hpp",
        needs_mass=True,
        inputs=("q", "v", "a", "tau"),
        external="optional",
        request="links",
        results=(Result("a_out", ("motion",), "accelerations of all joints"), Result("tau_out", ("nv",), "efforts of all joints")),
        smooth_friction=True,
        summary="Accelerations and efforts of all joints, where the accelerations of some are given, and the efforts of the others.",
        text="Accelerations {a_out} and efforts {tau_out} of all joints for {q} and {v}, under gravity and external wrenches.  Of the joints that "
        "carry the links named, the accelerations {a} are given, and of the others the efforts {tau} (Featherstone, RBDA 2008, section 9.2).  "
        "O(bodies).",
        python="""
names: the joints whose accelerations are given, in a (…, nv); by default all.  For the other joints the efforts are given, in
tau (…, nv).  The remaining numbers in a and tau may have any value.  Returns (a, tau), complete.  A mimic joint that is named stands
for its leader.  Fixed joints, and links, are refused.
q, v, external, out, threads: as in :meth:`inverse_dynamics`.  Articulated-body algorithm (Featherstone, RBDA 2008, section 9.2); O(bodies).
""",
    ),
    Algorithm(
        name="velocity_jump",
        mimic="jump",
        elements="nothing",
        loops="jump",
        header="mass/solve_mass_matrix.hpp",
        needs_mass=True,
        inputs=("q",),
        external="required",
        results=(Result("dv", ("motion",), "jump of the joint velocities"),),
        summary="Jump (…, nv) of the joint velocities that impulses on links cause.",
        text="Jump {dv} of the joint velocities at {q} caused by impulses on links, the time integrals of external wrenches: M dv = Σ Jᵀ impulse "
        "(Featherstone, RBDA 2008, section 11.7).  O(bodies).",
        python="""
external: {link name: (…, 6)}, impulses that the environment exerts on links, N s and N m s: linear first, about the link's origin, in the
link's axes or, with external_axes="world", the world's.  q, out, threads: as in :meth:`inverse_dynamics`.
Articulated-body algorithm without gravity and velocities; O(bodies).
""",
    ),
)
