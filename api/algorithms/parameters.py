"""Regressors: results as linear functions of the links' inertial parameters."""

from algorithms.row import Algorithm, Result

ROWS = (
    Algorithm(
        name="inverse_dynamics_regressor",
        mimic="projection",
        elements="nothing",
        loops="linear",
        header="inverse_dynamics_regressor.hpp",
        inputs=("q", "v", "a"),
        request="links",
        links_keyword="links",
        results=(Result("Y", ("nv", "links", 10), "joint efforts for each parameter"),),
        summary="Regressor (…, nv, links, 10) of inverse dynamics: joint efforts for each inertial parameter of each link.",
        text="Regressor {Y} of inverse dynamics for {q}, {v} and {a}: summed over all links with their parameters it is the transmitted "
        "efforts Sᵀ f under gravity, without external wrenches (those of inverse_dynamics, if no physics of joints is on; Atkeson, An, "
        "Hollerbach, IJRR 5, 1986).  A link has ten parameters: mass, mass × centroid, "
        "Ixx Ixy Iyy Ixz Iyz Izz about its origin, in its axes.  O(links × depth).",
        python="""
numpy.einsum("...jlp,lp", regressor, model.parameters) is `inverse_dynamics` without external wrenches.  Of physics of joints only rotor bodies, which
are links of the model, are in it; without these it is the transmitted effort (:meth:`effort_part`).  Of a closed mechanism: of the efforts of its drives.
links: names in the order wanted; by default all links in the order of `link_names`.  Links that fixed joints weld together have
parameters of their own.  Those of a link: m, m cx, m cy, m cz, Ixx, Ixy, Iyy, Ixz, Iyz, Izz, about its origin and in its axes.
q, v, a, out, threads: as in :meth:`inverse_dynamics`.  Atkeson, An, Hollerbach, IJRR 5, 1986; O(links × depth).
""",
    ),
    Algorithm(
        name="gravity_torque_regressor",
        mimic="projection",
        elements="nothing",
        loops="linear",
        header="inverse_dynamics_regressor.hpp",
        inputs=("q",),
        request="links",
        links_keyword="links",
        results=(Result("Y", ("nv", "links", 10), "joint efforts for each parameter"),),
        variant_of="inverse_dynamics_regressor",
        summary="Regressor (…, nv, links, 10) of the efforts at rest: those of :meth:`gravity_torque` for each inertial parameter.",
        text="Regressor {Y} of the joint efforts that hold the mechanism at rest at {q}: that of inverse dynamics with v = a = 0.  O(links × depth).",
        python="""
Only masses and first moments enter: columns 4 to 9 are zero.
links, q, out, threads: as in :meth:`inverse_dynamics_regressor`, of which this is the case v = a = 0.
""",
    ),
    Algorithm(
        name="reactions_regressor",
        mimic="projection",
        elements="nothing",
        loops="linear",
        header="reactions_regressor.hpp",
        inputs=("q", "v", "a"),
        request="joints",
        results=(Result("Y", ("joints", 6, "all_links", 10), "reactions for each parameter"),),
        summary="Regressor (…, joints, 6, links, 10) of reactions: the wrench through each joint for each parameter of every link.",
        text="Regressor {Y} of the reactions of the joints that are asked for, for {q}, {v} and {a}: summed over all links with their "
        "parameters (those of inverse_dynamics_regressor) it is the reactions under gravity, without external wrenches.  O(joints × links).",
        python="""
numpy.einsum("...jclp,lp", regressor, model.parameters) is `reactions` with the same keywords, without external wrenches.  Of closed mechanisms, too,
with all joints, and the components of least norm or energy that rigid bodies leave open.
All links of the model, in the order of `link_names`; a link's parameters: as in :meth:`inverse_dynamics_regressor`.
on, at, axes, order, part, joints: as in :meth:`reactions`.  q, v, a, out, threads: as in :meth:`inverse_dynamics`.
O(joints × links).
""",
    ),
    Algorithm(
        name="energy_regressor",
        mimic="projection",
        elements="nothing",
        loops="tree",
        header="energy_regressor.hpp",
        inputs=("q", "v"),
        request="links",
        links_keyword="links",
        results=(
            Result("kinetic", ("links", 10), "kinetic energy for each parameter"),
            Result("potential", ("links", 10), "potential energy for each parameter"),
        ),
        summary="Regressors (…, links, 10) of kinetic and of potential energy: those of :meth:`energy` for each inertial parameter.",
        text="Regressors {kinetic} and {potential} of the energies for {q} and {v}: summed over all links with their parameters (those of "
        "inverse_dynamics_regressor) they are kinetic and potential energy, J, of the links, without armature, "
        "reflected inertia of rotors and springs.  O(bodies + links).",
        python="""
numpy.einsum("...lp,lp", regressor, model.parameters) is the energy of the links, J, without armature, reflected inertia of rotors and
springs.  out: two arrays, for the one and for the other.
links, q, v, threads: as in :meth:`inverse_dynamics_regressor`.  O(bodies + links).
""",
    ),
    Algorithm(
        name="momentum_regressor",
        mimic="projection",
        elements="nothing",
        loops="tree",
        header="energy_regressor.hpp",
        inputs=("q", "v"),
        request="links",
        links_keyword="links",
        keywords="order",
        results=(Result("P", (6, "links", 10), "momentum for each parameter"),),
        summary="Regressor (…, 6, links, 10) of the momentum about the world's origin, in its axes.",
        text="Regressor {P} of the momentum about the world's origin, in its axes, for {q} and {v}: summed over links with "
        "their parameters (those of inverse_dynamics_regressor) it is their momentum.  O(bodies + links).",
        python="""
About the world's origin, since the centre of mass is not a linear function of the parameters; kg m/s, kg m²/s.
order: of the six rows, "lin_ang" (px py pz Lx Ly Lz) or "ang_lin".
links, q, v, out, threads: as in :meth:`inverse_dynamics_regressor`.  O(bodies + links).
""",
    ),
)
