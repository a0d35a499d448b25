"""The mass matrix, its factors and inverse, and the Coriolis matrix."""

from algorithms.row import Algorithm, Result

ROWS = (
    Algorithm(
        name="mass_matrix",
        mimic="projection",
        elements="nothing",
        loops="refusal",
        header="mass_matrix.hpp",
        inputs=("q",),
        results=(Result("M", ("nv", "nv"), "mass matrix, both triangles"),),
        form="symmetric_matrix",
        upper="mass_matrix_tree",
        choices={"triangle": {"both": "mass_matrix", "upper": "mass_matrix_upper"}},
        summary="Mass matrix (…, nv, nv), symmetric: inverse_dynamics = mass_matrix · a + bias.",
        text="Mass matrix {M}, row-major, both triangles, for {q}, by the composite-rigid-body algorithm (Featherstone, RBDA 2008, "
        "table 6.2): tau = M a + bias.  O(bodies × depth).",
        python="""
kg m², kg m or kg.  Armature and rotors are included if `physics=` of :func:`ksl.load` names them.
triangle: "both"; or "upper", which is :meth:`mass_matrix_upper`: elements below the diagonal are not written.  In batches of large
robots most of the time goes into writing, and that call and :meth:`mass_matrix_tree` write less.
q, out, threads: as in :meth:`inverse_dynamics`.  Composite-rigid-body algorithm (Featherstone, RBDA 2008, table 6.2);
O(bodies × depth).
""",
    ),
    Algorithm(
        name="mass_matrix_upper",
        mimic="upper_triangle",
        elements="nothing",
        loops="refusal",
        header="mass_matrix.hpp",
        inputs=("q",),
        results=(Result("M", ("nv", "nv"), "mass matrix, upper triangle"),),
        form="upper_triangle",
        upper="mass_matrix_tree",
        workspace="mass_matrix_workspace",
        summary="Upper triangle of the mass matrix, in an array (…, nv, nv).",
        text="Upper triangle, diagonal included, of the mass matrix {M}, row-major, for {q}; elements below the diagonal are left as "
        "they are.  Composite-rigid-body algorithm (Featherstone, RBDA 2008, table 6.2); O(bodies × depth).",
        python="""
q, out, threads: as in :meth:`inverse_dynamics`.  Elements below the diagonal are left as they are in `out`, and have any value
without it.  For solvers that read one triangle: ``scipy.linalg.cho_factor(M)``, ``numpy.linalg.eigvalsh(M, UPLO="U")``.
""",
    ),
    Algorithm(
        name="mass_matrix_tree",
        mimic="refusal",
        elements="nothing",
        loops="refusal",
        header="mass_matrix.hpp",
        inputs=("q",),
        results=(Result("M", ("tree",), "elements of the lower triangle"),),
        workspace="mass_matrix_workspace",
        summary="The elements (…, tree) of the mass matrix that the shape of the tree lets differ from zero.",
        text="The elements {M} of the lower triangle of the mass matrix that the shape of the tree lets differ from zero, row by row, for {q}.  "
        "A row has the columns of the joints on the path from the ground, the diagonal last.  Composite-rigid-body "
        "algorithm (Featherstone, RBDA 2008, table 6.2 and section 6.5); O(bodies × depth).  Not for models with mimic joints, whose mass "
        "matrix has other zeros: use mass_matrix_upper.",
        python="""
q, out, threads: as in :meth:`inverse_dynamics`.  Compressed sparse rows of the lower triangle:
``scipy.sparse.csr_matrix((M, m.tree_columns, m.tree_rows))``.  Featherstone, RBDA 2008, table 6.2 and section 6.5.

Not for robots with mimic joints (ValueError): a leader and its followers may be on different branches, so that the mass matrix has
other zeros than those of the tree.  Use :meth:`mass_matrix_upper` for them.
""",
    ),
    Algorithm(
        name="mass_matrix_factor",
        mimic="refusal",
        elements="nothing",
        loops="refusal",
        header="mass_matrix_factor.hpp",
        needs_mass=True,
        inputs=("q",),
        results=(Result("LD", ("tree",), "elements of L, with D on the diagonal"),),
        summary="Factors (…, tree) of the mass matrix that are as sparse as the tree: M = Lᵀ D L.",
        text="Factors {LD} of the mass matrix M = Lᵀ D L for {q}, L a unit lower triangle and D diagonal: the elements of L in the layout of "
        "mass_matrix_tree, with D on the diagonal (Featherstone, RBDA 2008, section 6.5, table 6.3).  O(nv × depth²).  Not for models "
        "with mimic joints: use solve_mass_matrix or mass_matrix_inverse.",
        python="""
q, out, threads: as in :meth:`inverse_dynamics`.  The layout is that of :meth:`mass_matrix_tree`, with D instead of the ones on the
diagonal of L.  Featherstone, RBDA 2008, section 6.5 and table 6.3; O(nv × depth²).
Not for robots with mimic joints (ValueError), as :meth:`mass_matrix_tree`.  Use :meth:`solve_mass_matrix` or
:meth:`mass_matrix_inverse` for them.
""",
    ),
    Algorithm(
        name="mass_matrix_inverse",
        mimic="inverse",
        elements="nothing",
        loops="refusal",
        header="mass_matrix_inverse.hpp",
        needs_mass=True,
        inputs=("q",),
        results=(Result("W", ("motion", "motion"), "inverse of the mass matrix"),),
        summary="Inverse (…, nv, nv) of the mass matrix, symmetric.",
        text="Inverse {W} of the mass matrix, row-major, both triangles, for {q}, from factors that are as sparse as the tree.  O(nv² × depth).",
        python="""
q, out, threads: as in :meth:`inverse_dynamics`.  From the factors of :meth:`mass_matrix_factor`, row by row (Takahashi, Fagan and
Chen 1973); O(nv² × depth).  :meth:`solve_mass_matrix` is faster for few vectors.
""",
    ),
    Algorithm(
        name="solve_mass_matrix",
        mimic="product",
        elements="nothing",
        loops="refusal",
        header="solve_mass_matrix.hpp",
        needs_mass=True,
        inputs=("q", "tau"),
        results=(Result("a", ("motion",), "accelerations without gravity and velocities"),),
        summary="a (…, nv) with mass_matrix(q) · a = tau.",
        text="Accelerations {a} with M a = {tau}, at {q}, without gravity and velocities: the articulated-body algorithm (Featherstone, RBDA "
        "2008, table 7.1).  O(bodies).",
        python="""
q, tau, out, threads: as in :meth:`forward_dynamics`, of which this is the case without gravity, velocities and external wrenches:
M⁻¹ tau, by the articulated-body algorithm (Featherstone, RBDA 2008, table 7.1); O(bodies).
""",
    ),
    Algorithm(
        name="coriolis_matrix",
        mimic="projection",
        elements="nothing",
        loops="refusal",
        header="coriolis_matrix.hpp",
        inputs=("q", "v"),
        results=(Result("C", ("nv", "nv"), "Coriolis matrix"),),
        summary="Coriolis matrix (…, nv, nv): inverse_dynamics = mass_matrix · a + coriolis_matrix · v + gravity_torque; no damping, no friction.",
        text="Coriolis matrix {C}, row-major, for {q} and {v}: tau = M a + C v + gravity, besides what damping and friction need.  Of the matrices "
        "with this property it is the one of Christoffel's symbols, and dM/dt − 2 C is skew-symmetric (Echeandia and Wensing 2021).  O(bodies × depth).",
        python="""
q, v, out, threads: as in :meth:`inverse_dynamics`.  Damping and friction are not included, even if `physics=` of :func:`ksl.load` names them:
they are the difference bias − gravity_torque − C v.  Many matrices have this property; this one is ∫ Jᵀ dJ/dt dm, J being the
Jacobian of a particle in world axes.  dM/dt − 2 C is skew-symmetric, for all joints.  If every joint has one coordinate,
C_ij = Σ_k Γ_ijk v_k with Christoffel's symbols of the first kind of M.  Linear in v.

Echeandia and Wensing, "Numerical methods to compute the Coriolis matrix and Christoffel symbols for rigid-body systems", 2021;
O(bodies × depth).
""",
    ),
)
