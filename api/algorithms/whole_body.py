"""Centre of mass and centroidal momentum."""

from algorithms.row import Algorithm, Result

ROWS = (
    Algorithm(
        name="center_of_mass",
        mimic="projection",
        elements="nothing",
        loops="tree",
        header="center_of_mass.hpp",
        inputs=("q",),
        results=(Result("center", (3,), "centre of mass, m"),),
        nan_without_mass=True,
        summary="Centre of mass (…, 3) of the bodies that move, in the world, m, for q (…, nq).",
        text="Centre of mass {center} of the bodies that move, in the world, m, for {q}.  Links welded to the ground don't count.  "
        "NaN where nothing that moves has mass.  O(bodies).",
        python="""
Links that are welded to the ground don't count.  NaN where nothing that moves has mass.
q, out, threads: as in :meth:`inverse_dynamics`.  O(bodies).
""",
    ),
    Algorithm(
        name="center_of_mass_jacobian",
        mimic="projection",
        elements="nothing",
        loops="tree",
        header="center_of_mass.hpp",
        inputs=("q",),
        results=(Result("J", (3, "nv"), "velocity of the centre of mass for each joint velocity"),),
        nan_without_mass=True,
        summary="Jacobian (…, 3, nv) of the centre of mass, for q (…, nq): J v is its velocity in the world's axes.",
        text="Jacobian {J} of the centre of mass, row-major, for {q}: J v is its velocity in the world's axes.  Links welded to the ground "
        "don't count.  NaN where nothing that moves has mass.  O(bodies).",
        python="""
The linear rows of :meth:`centroidal_momentum_matrix`, divided by the mass; links and NaN as in :meth:`center_of_mass`.
q, out, threads: as in :meth:`inverse_dynamics`.  O(bodies).
""",
    ),
    Algorithm(
        name="center_of_mass_velocity",
        mimic="projection",
        elements="nothing",
        loops="tree",
        header="center_of_mass_motion.hpp",
        inputs=("q", "v"),
        results=(Result("velocity", (3,), "velocity of the centre of mass, m/s"),),
        nan_without_mass=True,
        summary="Velocity (…, 3) of the centre of mass in the world's axes, m/s, for q (…, nq), v (…, nv).",
        text="Velocity {velocity} of the centre of mass in the world's axes, m/s, for {q} and {v}.  Links welded to the ground don't "
        "count.  NaN where nothing that moves has mass.  O(bodies).",
        python="""
Links and NaN as in :meth:`center_of_mass`; q, v, out, threads as in :meth:`inverse_dynamics`.  O(bodies).
""",
    ),
    Algorithm(
        name="center_of_mass_acceleration",
        mimic="projection",
        elements="nothing",
        loops="tree",
        header="center_of_mass_motion.hpp",
        inputs=("q", "v", "a"),
        results=(Result("acceleration", (3,), "acceleration of the centre of mass, m/s²"),),
        nan_without_mass=True,
        summary="Acceleration (…, 3) of the centre of mass in the world's axes, m/s², for q (…, nq), v and a (…, nv).",
        text="Acceleration {acceleration} of the centre of mass in the world's axes, m/s², for {q}, {v} and {a}.  Gravity doesn't enter.  "
        "Links welded to the ground don't count.  NaN where nothing that moves has mass.  O(bodies).",
        python="""
The rate of :meth:`center_of_mass_velocity`; gravity doesn't enter.
Links and NaN as in :meth:`center_of_mass`; q, v, a, out, threads as in :meth:`inverse_dynamics`.  O(bodies).
""",
    ),
    Algorithm(
        name="centroidal_momentum",
        mimic="projection",
        elements="nothing",
        loops="tree",
        header="centroidal_momentum.hpp",
        inputs=("q", "v"),
        keywords="order",
        results=(Result("momentum", (6,), "linear and angular momentum, kg m/s and kg m²/s"),),
        summary="Momentum (…, 6) about the centre of mass, in the world's axes, for q (…, nq), v (…, nv).",
        text="{momentum} about the centre of mass, in the world's axes, kg m/s and kg m²/s, for {q} and {v}, of the bodies "
        "that move (Orin, Goswami, Lee, Autonomous Robots 35, 2013, eq. (7)).  O(bodies).",
        python="""
Of the bodies that move; kg m/s, kg m²/s.  Where nothing that moves has mass, all is zero.
order: "lin_ang" (px py pz Lx Ly Lz) or "ang_lin".
q, v, out, threads: as in :meth:`inverse_dynamics`.  Orin, Goswami, Lee, Autonomous Robots 35, 2013, eq. (7); O(bodies).
""",
    ),
    Algorithm(
        name="centroidal_momentum_matrix",
        mimic="projection",
        elements="nothing",
        loops="tree",
        header="centroidal_momentum_matrix.hpp",
        inputs=("q",),
        keywords="order",
        results=(Result("matrix", (6, "nv"), "momentum for each joint velocity"),),
        summary="Centroidal momentum matrix (…, 6, nv) for q (…, nq): times v it is :meth:`centroidal_momentum`.",
        text="Centroidal momentum {matrix}, row-major, for {q}: times v it is the momentum about the centre of mass, in the world's axes "
        "(Orin, Goswami, Lee, Autonomous Robots 35, 2013, section 4).  O(bodies).",
        python="""
A column is the momentum of the joint's subtree at unit velocity, about the centre of mass of all bodies that move.
order: of the rows, as in :meth:`centroidal_momentum`.
q, out, threads: as in :meth:`inverse_dynamics`.  Orin, Goswami, Lee, Autonomous Robots 35, 2013, section 4; O(bodies).
""",
    ),
    Algorithm(
        name="centroidal_momentum_rate",
        mimic="projection",
        elements="nothing",
        loops="tree",
        header="centroidal_momentum.hpp",
        inputs=("q", "v", "a"),
        keywords="order",
        results=(Result("rate", (6,), "rate of linear and angular momentum, N and N m"),),
        summary="Rate (…, 6) of the centroidal momentum, in the world's axes, for q (…, nq), v and a (…, nv).",
        text="{rate} of the momentum about the centre of mass, in the world's axes, N and N m, for {q}, {v} and {a}: the sum "
        "of all external wrenches, those of gravity and of the ground among them.  O(bodies).",
        python="""
The rate of :meth:`centroidal_momentum`: the sum of all external wrenches about the centre of mass, those of gravity and of the
ground among them; N, N m.
order: as in :meth:`centroidal_momentum`.  q, v, a, out, threads: as in :meth:`inverse_dynamics`.  O(bodies).
""",
    ),
)
