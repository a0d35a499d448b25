"""Forward dynamics."""

from algorithms.row import Algorithm, Result

ROWS = (
    Algorithm(
        name="forward_dynamics",
        header="forward_dynamics.hpp",
        inputs=("q", "v", "tau"),
        external="optional",
        coupled="solution",
        results=(Result("a", ("motion",), "accelerations, rad/s² or m/s²"),),
        summary="Accelerations (…, nv) under joint efforts tau (…, nv) at q (…, nq) and v (…, nv).",
        text="Accelerations {a} for {q}, {v} and joint efforts {tau}, under gravity and external wrenches, by the articulated-body "
        "algorithm (Featherstone, RBDA 2008, table 7.1).  O(bodies).",
        python="""
The inverse of :meth:`inverse_dynamics`, same conventions.  Articulated-body algorithm (Featherstone, RBDA 2008,
table 7.1); O(bodies).

Where a joint can move without moving any mass, at an end of the mechanism whose links have none, say, its
acceleration is not determined: it and others are then NaN or infinite, and no error is raised.
""",
    ),
)
