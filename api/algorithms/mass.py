"""The mass matrix, its factors and inverse, and the Coriolis matrix."""

from algorithms.row import Algorithm, Result

ROWS = (
    Algorithm(
        name="mass_matrix",
        header="mass_matrix.hpp",
        inputs=("q",),
        results=(Result("M", ("nv", "nv"), "mass matrix, both triangles"),),
        form="symmetric_matrix",
        elements="elements_of_mass_matrix",
        summary="Mass matrix (…, nv, nv), symmetric: inverse_dynamics = mass_matrix · a + bias.",
        text="Mass matrix {M}, row-major, both triangles, for {q}, by the composite-rigid-body algorithm (Featherstone, RBDA 2008, "
        "table 6.2): tau = M a + bias.  O(bodies × depth).",
        python="""
Composite-rigid-body algorithm (Featherstone, RBDA 2008, table 6.2); O(bodies × depth).
:meth:`mass_matrix_upper` and :meth:`mass_matrix_tree` write less, which is what takes the time in batches of large robots.
""",
    ),
    Algorithm(
        name="mass_matrix_upper",
        header="mass_matrix.hpp",
        inputs=("q",),
        results=(Result("M", ("nv", "nv"), "mass matrix, upper triangle"),),
        form="upper_triangle",
        elements="elements_of_mass_matrix",
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
        header="mass_matrix.hpp",
        inputs=("q",),
        results=(Result("M", ("tree",), "elements of the lower triangle"),),
        workspace="mass_matrix_workspace",
        summary="The elements (…, tree) of the mass matrix that aren't zero by the shape of the tree.",
        text="The elements {M} of the lower triangle of the mass matrix that aren't zero by the shape of the tree, row by row, for {q}: "
        "of each row those in the columns of the joints on the path from the ground, the diagonal last.  Composite-rigid-body "
        "algorithm (Featherstone, RBDA 2008, table 6.2 and section 6.5); O(bodies × depth).",
        python="""
q, out, threads: as in :meth:`inverse_dynamics`.  Compressed sparse rows of the lower triangle:
``scipy.sparse.csr_matrix((M, m.tree_columns, m.tree_rows))``.  Featherstone, RBDA 2008, table 6.2 and section 6.5.
""",
    ),
)
