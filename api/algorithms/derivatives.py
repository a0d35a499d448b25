"""First and second derivatives of dynamics."""

from algorithms.row import Algorithm, Result

ROWS = (
    Algorithm(
        name="inverse_dynamics_derivatives",
        mimic="projection",
        elements="effort_derivatives",
        loops="refusal",
        header="inverse_dynamics_derivatives.hpp",
        inputs=("q", "v", "a"),
        external="optional",
        results=(
            Result("dtau_dq", ("nv", "nv"), "derivative of the efforts by q"),
            Result("dtau_dv", ("nv", "nv"), "by v"),
            Result("dtau_da", ("nv", "nv"), "by a: the mass matrix"),
        ),
        form="sparse_results",
        smooth_friction=True,
        summary="Derivatives of inverse_dynamics by q, v and a, each (…, nv, nv).",
        text="Derivatives {dtau_dq}, {dtau_dv}, {dtau_da} of the joint efforts that inverse dynamics gives for {q}, {v}, {a}, each "
        "row-major: element (i, k) is that of effort i by coordinate k.  By q is along q ⊕ s e_k with v and a held componentwise; "
        "by a is the mass matrix.  External wrenches are held in the axes in which they are given, those of their links, which move, or "
        "of the world (Singh, Russell, Wensing, RA-L 7(2), 2022).  O(bodies × depth).",
        python="""
q, v, a, external, threads: as in :meth:`inverse_dynamics`.  Element (i, k) is that of effort i by coordinate k.
By q is along q ⊕ s e_k (:meth:`integrate`), with v and a held componentwise.  By a is the mass matrix.
External wrenches are held in `external_axes`: in those of their links, with which they move, or in the world's.
out: three arrays, one for each derivative.
Singh, Russell, Wensing, Efficient Analytical Derivatives of Rigid-Body Dynamics Using Spatial Vector Algebra
(RA-L 7(2), 2022); O(bodies × depth).
Of mechanisms with loops they are along the mechanism, (…, nv, freedoms) each: by the coordinates that :meth:`independent` lists, one at a
time, while the others follow.  There must be as many drives as freedoms, and out must be None.
""",
    ),
    Algorithm(
        name="inverse_dynamics_gradient",
        mimic="projection",
        elements="effort_gradient",
        loops="refusal",
        header="inverse_dynamics_gradient.hpp",
        inputs=("q", "v", "a", "tau"),
        called={"tau": "weights"},
        results=(Result("by_q", ("nv",), "gradient by q"), Result("by_v", ("nv",), "by v"), Result("by_a", ("nv",), "by a: the mass matrix times the weights")),
        smooth_friction=True,
        summary="Gradients by q, v and a, each (…, nv), of a weighted sum of the efforts of inverse_dynamics.",
        text="Gradients {by_q}, {by_v}, {by_a} of the sum of {weights} times the joint efforts that inverse dynamics gives for {q}, {v}, {a}, "
        "without external wrenches: the derivatives of the efforts, transposed, times the weights, and none of these matrices is computed.  By q "
        "is along q ⊕ s e_k with v and a held componentwise (reverse accumulation: Griewank and Walther, Evaluating Derivatives, 2008, "
        "chapter 3).  O(bodies).",
        python="""
weights (…, nv): what each effort counts.  They are the product of weights and :meth:`inverse_dynamics_derivatives`,
numpy.einsum("...i,...ik->...k", weights, derivative), at about three times the cost of :meth:`inverse_dynamics`: what an optimiser needs of a
cost, or training of a loss.  By q is along q ⊕ s e_k (:meth:`integrate`), with v and a held componentwise.
out: three arrays, one for each gradient.  q, v, a, threads: as in :meth:`inverse_dynamics`.
Reverse accumulation (Griewank and Walther, Evaluating Derivatives, 2008, chapter 3); O(bodies).
""",
    ),
    Algorithm(
        name="stiffness",
        mimic="projection",
        elements="effort_derivatives",
        loops="refusal",
        header="inverse_dynamics_derivatives.hpp",
        inputs=("q",),
        external="optional",
        results=(Result("K", ("nv", "nv"), "derivative of the efforts that hold the pose by q"),),
        variant_of="inverse_dynamics_derivatives",
        smooth_friction=True,
        summary="Stiffness (…, nv, nv) of a pose at rest: derivative of the efforts that hold it, :meth:`gravity_torque`, by q.",
        text="Stiffness {K}, row-major, of the pose {q} at rest: the derivative along q ⊕ s e_k of the efforts that hold it, those of "
        "gravity_torque.  External wrenches are held in the axes in which they are given, those of their links, which move, or of the world.  "
        "O(bodies × depth).",
        python="""
External wrenches are held in `external_axes`: in those of their links, with which they move, or in the world's.  The
derivative is along q ⊕ s e_k.  Without external wrenches it is the second derivative of the potential energy, symmetric where
joints have one axis each.  With drives of stiffness K the pose is stable if K plus it is positive definite.
q, external, out, threads: as in :meth:`inverse_dynamics`.  The first of :meth:`inverse_dynamics_derivatives` with v = a = 0;
O(bodies × depth).
""",
    ),
    Algorithm(
        name="forward_dynamics_derivatives",
        mimic="solution_derivatives",
        elements="acceleration_derivatives",
        loops="refusal",
        header="forward_dynamics_derivatives.hpp",
        inputs=("q", "v", "tau"),
        external="optional",
        results=(
            Result("da_dq", ("nv", "nv"), "derivative of the accelerations by q"),
            Result("da_dv", ("nv", "nv"), "by v"),
            Result("da_dtau", ("nv", "nv"), "by tau: the inverse of the mass matrix"),
        ),
        needs_mass=True,
        smooth_friction=True,
        summary="Derivatives of forward_dynamics by q, v and tau, each (…, nv, nv).",
        text="Derivatives {da_dq}, {da_dv}, {da_dtau} of the accelerations that forward dynamics gives for {q}, {v}, {tau}, each "
        "row-major: element (i, k) is that of acceleration i by coordinate k.  By q is along q ⊕ s e_k with v and tau held "
        "componentwise; by tau is the inverse of the mass matrix.  External wrenches are held in the axes in which they are given, those "
        "of their links, which move, or of the world (Carpentier and Mansard, RSS 2018, eq. (27)).  O(nv² × depth).",
        python="""
q, v, tau, external, threads: as in :meth:`forward_dynamics`.  Element (i, k) is that of acceleration i by coordinate k.
By q is along q ⊕ s e_k (:meth:`integrate`), with v and tau held componentwise.  By tau is the inverse of the mass matrix.
External wrenches are held in `external_axes`: in those of their links, with which they move, or in the world's.
out: three arrays, one for each derivative.
From those of inverse dynamics and factors of the mass matrix: Carpentier and Mansard, Analytical Derivatives of Rigid Body
Dynamics Algorithms (RSS 2018), eq. (27); O(nv² × depth).
Of mechanisms with loops those by q and v are along the mechanism, (…, nv, freedoms), by the coordinates that :meth:`independent` lists;
out must be None.
""",
    ),
    Algorithm(
        name="reactions_derivatives",
        mimic="projection",
        elements="reaction_derivatives",
        loops="refusal",
        header="reactions_derivatives.hpp",
        inputs=("q", "v", "a"),
        external="optional",
        request="joints",
        results=(
            Result("by_q", ("joints", 6, "nv"), "derivative of the reactions by q"),
            Result("by_v", ("joints", 6, "nv"), "by v"),
            Result("by_a", ("joints", 6, "nv"), "by a"),
        ),
        form="sparse_results",
        summary="Derivatives of reactions by q, v and a, each (…, joints, 6, nv).",
        text="Derivatives {by_q}, {by_v}, {by_a} of the reactions of the joints that are asked for, for {q}, {v}, {a}: those of the "
        "components in the requested axes, about the requested point, of the requested part.  By q is along q ⊕ s e_k with v and a "
        "held componentwise.  External wrenches are held in the axes in which they are given, those of their links, which move, "
        "or of the world (after Singh, Russell, Wensing, RA-L 7(2), 2022).  O(joints × nv).",
        python="""
All arguments as in :meth:`reactions`, whose components in the requested axes are differentiated, whether or not
these axes and the point move.  By q is along q ⊕ s e_k (:meth:`integrate`), with v and a held componentwise.
External wrenches are held in `external_axes`: in those of their links, with which they move, or in the world's.
out: three arrays, one for each derivative.  After Singh, Russell, Wensing (RA-L 7(2), 2022); O(joints × nv).

Of a mechanism with loops, columns are the coordinates of :meth:`independent`, which vary one at a time, while the others follow; there must
be as many drives as freedoms.  Joints that close loops have derivatives at the joint in its axes.  What rigid bodies don't determine
is an error, or with undetermined="nan" NaN.
""",
    ),
    Algorithm(
        name="reactions_external_derivatives",
        mimic="projection",
        elements="nothing",
        loops="linear",
        header="reactions_external_derivatives.hpp",
        inputs=("q",),
        request="joints",
        results=(Result("by_external", ("joints", 6, "all_links", 6), "derivative of the reactions by the wrench on each link"),),
        summary="Derivatives of reactions by the external wrench on each link, (…, joints, 6, links, 6), for q (…, nq).",
        text="Derivatives {by_external} of the reactions of the joints that are asked for by the external wrench on each link of the model, in "
        "the link's axes, linear first, for {q}; row-major.  They don't depend on velocities and accelerations (Featherstone, RBDA 2008, "
        "table 5.1).  O(joints × links).",
        python="""
on, at, axes, order, part, joints: as in :meth:`reactions`, which changes by
numpy.einsum("...jclk,...lk->...jc", derivatives, wrenches) for changes of wrenches on all links, in the order of `link_names`, in
their axes, linear first.  For wrenches in the world's axes, turn the last axis by the links' rotations (:meth:`frame_poses`).
q, out, threads: as in :meth:`inverse_dynamics`.  Featherstone, RBDA 2008, table 5.1; O(joints × links).
""",
    ),
    Algorithm(
        name="frame_velocity_derivatives",
        mimic="projection",
        elements="nothing",
        loops="tree",
        header="frame_motion_derivatives.hpp",
        inputs=("q", "v"),
        request="frame",
        results=(Result("by_q", (6, "nv"), "derivative of the twist by q"), Result("by_v", (6, "nv"), "by v: the Jacobian")),
        variant_of="frame_velocities_derivatives",
        summary="Derivatives of frame_velocity by q and v, each (…, 6, nv).",
        text="Derivatives {by_q} and {by_v} of the twist of a link's frame, for {q} and {v}: those of its components, row-major.  By q is "
        "along q ⊕ s e_k with v held componentwise; by v is the Jacobian.  O(depth), besides writing 12 nv numbers.",
        python="""
All arguments as in :meth:`frame_velocity`, whose components in the requested axes are differentiated, whether or not
these axes and the point move.  By q is along q ⊕ s e_k (:meth:`integrate`), with v held componentwise; by v is
:meth:`jacobian`.  out: two arrays, one for each derivative.
O(depth), besides writing 12 nv numbers.
""",
    ),
    Algorithm(
        name="frame_velocities_derivatives",
        mimic="projection",
        elements="nothing",
        loops="tree",
        header="frame_motion_derivatives.hpp",
        inputs=("q", "v"),
        request="frames",
        results=(Result("by_q", ("links", 6, "nv"), "derivative of the twists by q"), Result("by_v", ("links", 6, "nv"), "by v: the Jacobians")),
        summary="Derivatives of frame_velocities by q and v, each (…, names, 6, nv).",
        text="Derivatives {by_q} and {by_v} of the twists of links' frames, for {q} and {v}: those of their components, row-major.  By q is "
        "along q ⊕ s e_k with v held componentwise; by v are the Jacobians.  A link may come twice (after Singh, Russell, Wensing, RA-L "
        "7(2), 2022).  O(bodies + links × depth), besides writing 12 nv numbers for each link.",
        python="""
All arguments as in :meth:`frame_velocities`; the rest as in :meth:`frame_velocity_derivatives`.
out: two arrays, one for each derivative.  After Singh, Russell, Wensing (RA-L 7(2), 2022);
O(bodies + links × depth), besides writing 12 nv numbers for each link.
""",
    ),
    Algorithm(
        name="frame_acceleration_derivatives",
        mimic="projection",
        elements="nothing",
        loops="tree",
        header="frame_motion_derivatives.hpp",
        inputs=("q", "v", "a"),
        request="frame",
        keywords="kind",
        results=(
            Result("by_q", (6, "nv"), "derivative of the acceleration by q"),
            Result("by_v", (6, "nv"), "by v"),
            Result("by_a", (6, "nv"), "by a: the Jacobian"),
        ),
        variant_of="frame_accelerations_derivatives",
        summary="Derivatives of frame_acceleration by q, v and a, each (…, 6, nv).",
        text="Derivatives {by_q}, {by_v}, {by_a} of the acceleration of a link's frame, of the kind that the options say, for {q}, {v} and "
        "{a}: those of its components, row-major.  By q is along q ⊕ s e_k with v and a held componentwise; by a is the Jacobian.  "
        "O(depth), besides writing 18 nv numbers.",
        python="""
All arguments as in :meth:`frame_acceleration`, whose components in the requested axes are differentiated, whether or
not these axes and the point move.  By q is along q ⊕ s e_k (:meth:`integrate`), with v and a held componentwise; by a is
:meth:`jacobian`.  out: three arrays, one for each derivative.
O(depth), besides writing 18 nv numbers.
""",
    ),
    Algorithm(
        name="frame_accelerations_derivatives",
        mimic="projection",
        elements="nothing",
        loops="tree",
        header="frame_motion_derivatives.hpp",
        inputs=("q", "v", "a"),
        request="frames",
        keywords="kind",
        results=(
            Result("by_q", ("links", 6, "nv"), "derivative of the accelerations by q"),
            Result("by_v", ("links", 6, "nv"), "by v"),
            Result("by_a", ("links", 6, "nv"), "by a: the Jacobians"),
        ),
        summary="Derivatives of frame_accelerations by q, v and a, each (…, names, 6, nv).",
        text="Derivatives {by_q}, {by_v}, {by_a} of the accelerations of links' frames, of the kind that the options say, for {q}, {v} and "
        "{a}: those of their components, row-major.  By q is along q ⊕ s e_k with v and a held componentwise; by a are the Jacobians.  A "
        "link may come twice (after Singh, Russell, Wensing, RA-L 7(2), 2022).  O(bodies + links × depth), besides writing 18 nv numbers "
        "for each link.",
        python="""
All arguments as in :meth:`frame_accelerations`; the rest as in :meth:`frame_acceleration_derivatives`.
out: three arrays, one for each derivative.  After Singh, Russell, Wensing (RA-L 7(2), 2022);
O(bodies + links × depth), besides writing 18 nv numbers for each link.
""",
    ),
    Algorithm(
        name="energy_derivatives",
        mimic="projection",
        elements="energy_derivatives",
        loops="tree",
        header="energy_derivatives.hpp",
        inputs=("q", "v"),
        results=(
            Result("kinetic_by_q", ("nv",), "derivative of the kinetic energy by q"),
            Result("kinetic_by_v", ("nv",), "by v: the joint momentum M v"),
            Result("potential_by_q", ("nv",), "derivative of the potential energy by q"),
        ),
        summary="Derivatives of energy: of the kinetic energy by q and by v, of the potential energy by q, each (…, nv).",
        text="Derivatives {kinetic_by_q} and {kinetic_by_v} of the kinetic energy, {potential_by_q} of the potential energy, for {q} and {v}.  "
        "By q is along q ⊕ s e_k with v held componentwise; by v is M v; that of the potential energy is the effort that holds the "
        "mechanism at rest.  O(bodies).",
        python="""
By q is along q ⊕ s e_k (:meth:`integrate`), with v held componentwise.  By v is M v; the potential energy's is
:meth:`gravity_torque`.  It doesn't depend on v.  N m or N; by v N m s or N s.
out: three arrays, one for each derivative.  q, v, threads: as in :meth:`inverse_dynamics`.  O(bodies).
""",
    ),
    Algorithm(
        name="centroidal_momentum_derivatives",
        mimic="projection",
        elements="nothing",
        loops="tree",
        header="centroidal_momentum_derivatives.hpp",
        inputs=("q", "v"),
        keywords="order",
        results=(Result("by_q", (6, "nv"), "derivative of the momentum by q"), Result("by_v", (6, "nv"), "by v: the centroidal momentum matrix")),
        summary="Derivatives of centroidal_momentum by q and v, each (…, 6, nv).",
        text="Derivatives {by_q} and {by_v} of the momentum about the centre of mass, in the world's axes, row-major, for {q} and "
        "{v}.  By q is along q ⊕ s e_k with v held componentwise; by v is the centroidal momentum matrix.  O(bodies).",
        python="""
By q is along q ⊕ s e_k (:meth:`integrate`), with v held componentwise.  By v is :meth:`centroidal_momentum_matrix`.
order: of the six rows, as in :meth:`centroidal_momentum`.
out: two arrays, one for each derivative.  q, v, threads: as in :meth:`inverse_dynamics`.  O(bodies).
""",
    ),
    Algorithm(
        name="centroidal_momentum_rate_derivatives",
        mimic="projection",
        elements="nothing",
        loops="tree",
        header="centroidal_momentum_derivatives.hpp",
        inputs=("q", "v", "a"),
        keywords="order",
        results=(
            Result("by_q", (6, "nv"), "derivative of the rate of the momentum by q"),
            Result("by_v", (6, "nv"), "by v"),
            Result("by_a", (6, "nv"), "by a: the centroidal momentum matrix"),
        ),
        summary="Derivatives of centroidal_momentum_rate by q, v and a, each (…, 6, nv).",
        text="Derivatives {by_q}, {by_v}, {by_a} of the rate of the momentum about the centre of mass, in the world's axes, "
        "row-major, for {q}, {v} and {a}.  By q is along q ⊕ s e_k with v and a held componentwise; by a is the centroidal momentum "
        "matrix (after Carpentier and Mansard, RSS 2018).  O(bodies).",
        python="""
By q is along q ⊕ s e_k (:meth:`integrate`), with v and a held componentwise.  By a is :meth:`centroidal_momentum_matrix`.
order: of the six rows, as in :meth:`centroidal_momentum`.
out: three arrays, one for each derivative.  q, v, a, threads: as in :meth:`inverse_dynamics`.
After Carpentier and Mansard (RSS 2018); O(bodies).
""",
    ),
    Algorithm(
        name="inverse_dynamics_second_derivatives",
        mimic="projection",
        elements="refusal",
        loops="refusal",
        header="inverse_dynamics_second_derivatives.hpp",
        inputs=("q", "v", "a"),
        external="optional",
        results=(
            Result("d2tau_dqdq", ("nv", "nv", "nv"), "second derivative of the efforts by q"),
            Result("d2tau_dvdv", ("nv", "nv", "nv"), "by v"),
            Result("d2tau_dqdv", ("nv", "nv", "nv"), "by q and v"),
            Result("dM_dq", ("nv", "nv", "nv"), "derivative of the mass matrix by q, or of the efforts by a and q"),
        ),
        form="sparse_results",
        smooth_friction=True,
        summary="Second derivatives of inverse_dynamics by q, v, q and v, a and q, each (…, nv, nv, nv).",
        text="Second derivatives {d2tau_dqdq}, {d2tau_dvdv}, {d2tau_dqdv}, {dM_dq} of the joint efforts that inverse dynamics gives for "
        "{q}, {v}, {a}, each row-major.  Element (i, k, m) is that of effort i by q_k and q_m; by v_k and v_m; by q_k and v_m; by a_k "
        "and q_m, which is dM_ik/dq_m.  The first is the derivative along q ⊕ s e_m of the derivative along q ⊕ s e_k, with v and a "
        "held componentwise; it is symmetric in k and m unless both are of one joint with several coordinates.  External wrenches are "
        "held in the axes in which they are given, those of their links, which move, or of the world (after Singh, Russell, Wensing, T-RO 40, "
        "2024).  O(nv × depth²), besides writing 4 nv³ numbers.",
        python="""
q, v, a, external, threads: as in :meth:`inverse_dynamics`.  Element (i, k, m) is that of effort i by q_k and q_m; by v_k
and v_m; by q_k and v_m; by a_k and q_m, which is dM_ik/dq_m.  The first is the derivative along q ⊕ s e_m
(:meth:`integrate`) of the derivative along q ⊕ s e_k, with v and a held componentwise.  It is symmetric in k and m unless
both are of one joint with several coordinates.  External wrenches are held in `external_axes`: in those of their links, with
which they move, or in the world's.
out: four arrays, one for each derivative.
After Singh, Russell, Wensing, On Second-Order Derivatives of Rigid-Body Dynamics: Theory & Implementation (T-RO 40, 2024),
analytic; O(nv × depth²), besides writing 4 nv³ numbers.
""",
    ),
    Algorithm(
        name="forward_dynamics_second_derivatives",
        mimic="solution_second_derivatives",
        elements="refusal",
        loops="refusal",
        header="forward_dynamics_second_derivatives.hpp",
        inputs=("q", "v", "tau"),
        external="optional",
        results=(
            Result("d2a_dqdq", ("nv", "nv", "nv"), "second derivative of the accelerations by q"),
            Result("d2a_dvdv", ("nv", "nv", "nv"), "by v"),
            Result("d2a_dqdv", ("nv", "nv", "nv"), "by q and v"),
            Result("d2a_dqdtau", ("nv", "nv", "nv"), "by q and tau: derivative of the inverse of the mass matrix"),
        ),
        needs_mass=True,
        smooth_friction=True,
        summary="Second derivatives of forward_dynamics by q, v, q and v, q and tau, each (…, nv, nv, nv).",
        text="Second derivatives {d2a_dqdq}, {d2a_dvdv}, {d2a_dqdv}, {d2a_dqdtau} of the accelerations that forward dynamics gives for "
        "{q}, {v}, {tau}, each row-major.  Element (i, k, m) is that of acceleration i by q_k and q_m; by v_k and v_m; by q_k and v_m; "
        "by q_k and tau_m.  The first is the derivative along q ⊕ s e_m of the derivative along q ⊕ s e_k, with v and tau held "
        "componentwise; it is symmetric in k and m unless both are of one joint with several coordinates.  External wrenches are held "
        "in the axes in which they are given, those of their links, which move, or of the world (after Singh, Russell, Wensing, T-RO 40, 2024).  O(nv⁴).",
        python="""
q, v, tau, external, threads: as in :meth:`forward_dynamics`.  Element (i, k, m) is that of acceleration i by q_k and q_m;
by v_k and v_m; by q_k and v_m; by q_k and tau_m.  The first is the derivative along q ⊕ s e_m (:meth:`integrate`) of the
derivative along q ⊕ s e_k, with v and tau held componentwise.  It is symmetric in k and m unless both are of one joint
with several coordinates.  External wrenches are held in `external_axes`: in those of their links, with which they move, or in
the world's.
out: four arrays, one for each derivative.
From those of inverse dynamics and the inverse of the mass matrix, analytic: after Singh, Russell, Wensing, On Second-Order
Derivatives of Rigid-Body Dynamics: Theory & Implementation (T-RO 40, 2024); O(nv⁴).
""",
    ),
)
