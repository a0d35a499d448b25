"""The mass matrix."""

from algorithms.row import Algorithm, Result

ROWS = (
    Algorithm(
        name="mass_matrix",
        header="mass_matrix.hpp",
        inputs=("q",),
        results=(Result("M", ("nv", "nv"), "mass matrix, both triangles"),),
        form="symmetric_matrix",
        summary="Mass matrix (…, nv, nv), symmetric: inverse_dynamics = mass_matrix · a + bias.",
        text="Mass matrix {M}, row-major, both triangles, for {q}, by the composite-rigid-body algorithm (Featherstone, RBDA 2008, "
        "table 6.2): tau = M a + bias.  O(bodies × depth).",
        python="""
Composite-rigid-body algorithm (Featherstone, RBDA 2008, table 6.2); O(bodies × depth).
""",
    ),
)
