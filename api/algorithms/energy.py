"""Energies and powers."""

from algorithms.row import Algorithm, Result

ROWS = (
    Algorithm(
        name="energy",
        mimic="projection",
        elements="energy",
        loops="tree",
        header="energy.hpp",
        inputs=("q", "v"),
        results=(Result("kinetic", (), "kinetic energy, J"), Result("potential", (), "potential energy, J")),
        summary="Kinetic and potential energy, J, each (…), for q (…, nq), v (…, nv).",
        text="{kinetic} and {potential} energy, J, for {q} and {v}; that of gravity is zero with every centroid at the world's origin.  "
        "Armature, rotors and springs are included if the model's options name them.  O(bodies).",
        python="""
Potential energy is that of gravity, zero with every centroid at the world's origin.  If `physics=` of :func:`ksl.load` names them, kinetic energy
includes armature and rotors, and potential energy springs, ½ stiffness (q − rest)².
out: two arrays, for the one and for the other.  q, v, threads: as in :meth:`inverse_dynamics`.  O(bodies).
""",
    ),
    Algorithm(
        name="external_power",
        mimic="projection",
        elements="nothing",
        loops="tree",
        header="energy.hpp",
        inputs=("q", "v"),
        external="required",
        results=(Result("power", (), "power, W"),),
        summary="Power (…) of external wrenches, W: the sum of f · v of the links that they act on.",
        text="{power} of external wrenches, W, for {q} and {v}: the sum of f · v of the links that they act on.  Without wrenches it is zero.  O(bodies).",
        python="""
q (…, nq), v (…, nv); external, out, threads: as in :meth:`inverse_dynamics`.  Without wrenches it is zero.  O(bodies).
""",
    ),
)
