"""Dynamics as it is felt at frames of links."""

from algorithms.row import Algorithm, Result

INERTIA = Result("inertia", ("6 links", "6 links"), "operational-space inertia, symmetric; zero in dependent directions")
RANK = Result("rank", (), "how many of the directions are independent")

ROWS = (
    Algorithm(
        name="operational_space_inertia_inverse",
        mimic="operational_inverse",
        elements="nothing",
        loops="refusal",
        header="operational_space.hpp",
        inputs=("q",),
        request="frames",
        needs_mass=True,
        results=(Result("inverse", ("6 links", "6 links"), "rates of the twists for a unit wrench on each frame"),),
        summary="Inverse operational-space inertia (…, 6 names, 6 names), J M⁻¹ Jᵀ, symmetric, for q (…, nq).",
        text="Inverse operational-space inertia {inverse} = J M⁻¹ Jᵀ, symmetric, of n frames for {q}: rates of all their twists for a unit "
        "wrench on each (Khatib 1987; by propagation as Lilly and Orin 1993).  At most as many frames as the model has links.  "
        "O(bodies + n² depth).",
        python="""
names: in the order wanted; rows and columns are the six numbers of the first frame's twist, then of the second's …
axes, at, order: as in :meth:`frame_velocity`, whose numbers these are; wrenches have power with them.
q, out, threads: as in :meth:`inverse_dynamics`.  It exists for any frames, but may be singular.
Khatib, IEEE J. Robotics and Automation 3 (1987) 43; by propagation of wrenches through articulated bodies, as Lilly
and Orin (1993).  O(bodies + n² depth).
""",
    ),
    Algorithm(
        name="operational_space_inertia",
        mimic="operational_inertia",
        elements="nothing",
        loops="refusal",
        header="operational_space.hpp",
        inputs=("q",),
        request="frames",
        needs_mass=True,
        results=(INERTIA, RANK),
        summary="Operational-space inertia (…, 6 names, 6 names), symmetric, and its rank (…), for q (…, nq).",
        text="Operational-space inertia {inertia}, the inverse of J M⁻¹ Jᵀ, of n frames for {q}, and its {rank}.  Where it is "
        "singular, as many directions as the rank are inverted, and the others have zeros.  At most as many frames as the "
        "model has links.  O(bodies + n² depth + n³).",
        python="""
The inverse of :meth:`operational_space_inertia_inverse`, with the same arguments.  If that is singular, as many directions as the
rank are inverted, largest pivots first, and the others have zeros: a generalised inverse.  When the matrix is scaled to a diagonal of
ones, pivots below 1e-10 count as zero (1e-4 in single precision).  The rank is a number of the arrays' type.
O(bodies + n² depth + n³).
""",
    ),
    Algorithm(
        name="operational_space",
        mimic="operational_space",
        elements="wrenches",
        loops="refusal",
        header="operational_space.hpp",
        inputs=("q", "v"),
        external="optional",
        request="frames",
        needs_mass=True,
        results=(
            INERTIA,
            Result("bias", ("6 links",), "wrenches under which the twists stay as they are"),
            Result("pseudo_inverse", ("nv", "6 links"), "dynamically consistent pseudo-inverse of the Jacobian"),
            RANK,
        ),
        smooth_friction=True,
        summary="Inertia, bias force, dynamically consistent pseudo-inverse and rank of frames, for q (…, nq) and v (…, nv).",
        text="Dynamics at n frames for {q} and {v}, under gravity and external wrenches: F = inertia x'' + bias for wrenches F on the frames, "
        "no efforts, and rates x'' of the numbers of their twists.  {inertia}; {bias} = inertia (J M⁻¹ b − (rate of J) v), b the bias of the "
        "joints; {pseudo_inverse} = M⁻¹ Jᵀ inertia; {rank} as in operational_space_inertia (Khatib 1987).  At most as many frames as the "
        "model has links.  O(n bodies + n² depth + n³).",
        python="""
With F the wrenches on the frames (6 names), x'' the rates of their twists' numbers, and no joint efforts:
F = inertia x'' + bias.  Returns inertia (…, 6 names, 6 names); bias (…, 6 names), the wrenches under which the
twists stay as they are, gravity, velocities and external wrenches included: inertia (J M⁻¹ b − (rate of J) v) with
b = :meth:`bias`; pseudo_inverse (…, nv, 6 names) = M⁻¹ Jᵀ inertia, which gives of all accelerations with x'' those that need
efforts Jᵀ F only; and the rank (…).  If that is less than 6 names, see :meth:`operational_space_inertia`.

names, axes, at, order: as in :meth:`operational_space_inertia_inverse`.  q, v, external, threads: as in
:meth:`inverse_dynamics`.  out: four arrays.  Khatib, IEEE J. Robotics and Automation 3 (1987) 43.
O(n bodies + n² depth + n³).
""",
    ),
)
