"""Poses and motions of links."""

from algorithms.row import Algorithm, Result

ROWS = (
    Algorithm(
        name="frame_pose",
        mimic="projection",
        elements="nothing",
        loops="tree",
        header="forward_kinematics.hpp",
        inputs=("q",),
        request="link",
        results=(Result("pose", (4, 4), "pose in the world, m"),),
        variant_of="frame_poses",
        faces=("python",),
        summary="Pose (…, 4, 4) in the world of a link's frame, or of a joint's (the child link's), for q (…, nq).",
        text="Pose {pose} in the world of a link's frame for {q}.  O(bodies).",
        python="""
q, out, threads: as in :meth:`inverse_dynamics`.  :meth:`frame_poses` gives several from one walk over the bodies.
""",
    ),
    Algorithm(
        name="frame_poses",
        mimic="projection",
        elements="nothing",
        loops="tree",
        header="forward_kinematics.hpp",
        inputs=("q",),
        request="links",
        results=(Result("poses", ("links", 4, 4), "poses in the world, m"),),
        form="poses_of_links",
        workspace="forward_kinematics_workspace",
        summary="Poses (…, names, 4, 4) in the world of links' frames, or of joints' (the child links'), for q (…, nq); m.",
        text="Poses {poses} of links' frames in the world, m, each matrix row-major, for {q}.  A link may come twice.  All are computed "
        "from one walk over the bodies: O(bodies + links).",
        python="""
names: in the order wanted; by default all links in the order of `link_names`.  "link:NAME" and "joint:NAME" say which is meant where a
link and a joint that carries another one have the same name, which alone is refused.
q, out, threads: as in :meth:`inverse_dynamics`.  O(bodies + links).
""",
    ),
    Algorithm(
        name="frame_velocity",
        mimic="projection",
        elements="nothing",
        loops="tree",
        header="frame_motion.hpp",
        inputs=("q", "v"),
        request="frame",
        results=(Result("twist", (6,), "twist of the frame, m/s and rad/s"),),
        variant_of="frame_velocities",
        summary="Twist (…, 6) of a link's frame, or of a joint's (the child link's), for q (…, nq) and v (…, nv); m/s, rad/s.",
        text="Twist {twist} of a link's frame for {q} and {v} (Featherstone, RBDA 2008, eq. (5.14)).  O(depth).",
        python="""
axes, at: "frame" or "world", in whose axes and about whose origin the twist is.  order: "lin_ang" or "ang_lin".
offset: three numbers, of the frame's origin from the link's, in the link's axes, m; none by default.
q, v, out, threads: as in :meth:`inverse_dynamics`.  Featherstone, RBDA 2008, eq. (5.14); O(depth): only the bodies
that carry the link enter.
""",
    ),
    Algorithm(
        name="frame_velocities",
        mimic="projection",
        elements="nothing",
        loops="tree",
        header="frame_motion.hpp",
        inputs=("q", "v"),
        request="frames",
        results=(Result("twists", ("links", 6), "twists of the frames, m/s and rad/s"),),
        summary="Twists (…, names, 6) of links' frames, or of joints' (the child links'), for q (…, nq) and v (…, nv); m/s, rad/s.",
        text="Twists {twists} of links' frames for {q} and {v}.  A link may come twice.  All are computed from one walk over the bodies "
        "that carry any of them.  O(bodies + links).",
        python="""
names: in the order wanted; by default all links in the order of `link_names`.
axes, at, order: as in :meth:`frame_velocity`.  q, v, out, threads: as in :meth:`inverse_dynamics`.  O(bodies + links).
""",
    ),
    Algorithm(
        name="frame_acceleration",
        mimic="projection",
        elements="nothing",
        loops="tree",
        header="frame_motion.hpp",
        inputs=("q", "v", "a"),
        request="frame",
        keywords="kind",
        results=(Result("acceleration", (6,), "acceleration of the frame, m/s² and rad/s²"),),
        variant_of="frame_accelerations",
        summary="Acceleration (…, 6) of a link's frame, or of a joint's (the child link's), for q (…, nq), v and a (…, nv); no gravity.",
        text="Acceleration {acceleration} of a link's frame for {q}, {v} and {a}, without gravity (Featherstone, RBDA 2008, eq. (5.15) and "
        "section 2.11).  O(depth).",
        python="""
kind: "classical" is the acceleration of the link's point that is at the origin in question, and the rate of ω.
"spatial" is the classical one less ω × v of that point in the linear part: the rate of the twist about a point at rest.
"rate" is the rate of each number of :meth:`frame_velocity` with the same keywords, J a + (rate of J) v: the spatial
acceleration if axes and at are the same, the classical one with axes="world", at="frame".
axes, at: "frame" or "world", in whose axes and about whose origin.

order, offset: as in :meth:`frame_velocity`.  q, v, a, out, threads: as in :meth:`inverse_dynamics`.  m/s², rad/s².
Featherstone, RBDA 2008, eq. (5.15) and section 2.11; O(depth).
""",
    ),
    Algorithm(
        name="frame_accelerations",
        mimic="projection",
        elements="nothing",
        loops="tree",
        header="frame_motion.hpp",
        inputs=("q", "v", "a"),
        request="frames",
        keywords="kind",
        results=(Result("accelerations", ("links", 6), "accelerations of the frames, m/s² and rad/s²"),),
        summary="Accelerations (…, names, 6) of links' frames, or of joints' (the child links'), for q (…, nq), v and a (…, nv); no gravity.",
        text="Accelerations {accelerations} of links' frames for {q}, {v} and {a}, without gravity.  A link may come twice.  All are "
        "computed from one walk over the bodies that carry any of them.  O(bodies + links).",
        python="""
names: in the order wanted; by default all links in the order of `link_names`.
kind, axes, at, order: as in :meth:`frame_acceleration`.  q, v, a, out, threads: as in :meth:`inverse_dynamics`.
O(bodies + links).
""",
    ),
    Algorithm(
        name="point_velocity",
        mimic="projection",
        elements="nothing",
        loops="tree",
        header="frame_motion.hpp",
        inputs=("q", "v"),
        request="frame",
        keywords="point",
        results=(Result("velocity", (3,), "velocity of the point, m/s"),),
        workspace="frame_velocities_workspace",
        summary="Velocity (…, 3) of a point fixed in a link, for q (…, nq) and v (…, nv); m/s.",
        text="{velocity} of the point of a link that the options' offset names, for {q} and {v}; in the axes that the options name.  O(depth).",
        python="""
name: of the link, or of a joint (the child link).  point: three numbers, in the link's axes, m.
axes: "frame" or "world".  q, v, out, threads: as in :meth:`inverse_dynamics`.  O(depth).
""",
    ),
    Algorithm(
        name="point_acceleration",
        mimic="projection",
        elements="nothing",
        loops="tree",
        header="frame_motion.hpp",
        inputs=("q", "v", "a"),
        request="frame",
        keywords="point",
        results=(Result("acceleration", (3,), "acceleration of the point, m/s²"),),
        workspace="frame_accelerations_workspace",
        summary="Acceleration (…, 3) of a point fixed in a link, for q (…, nq), v and a (…, nv), without gravity; m/s².",
        text="{acceleration} of the point of a link that the options' offset names, for {q}, {v} and {a}, without gravity; in the axes "
        "that the options name.  O(depth).",
        python="""
name, point, axes: as in :meth:`point_velocity`.  q, v, a, out, threads: as in :meth:`inverse_dynamics`.  O(depth).
""",
    ),
    Algorithm(
        name="jacobian",
        mimic="projection",
        elements="nothing",
        loops="tree",
        header="frame_jacobian.hpp",
        inputs=("q",),
        request="frame",
        results=(Result("J", (6, "nv"), "twist of the frame for each joint velocity"),),
        summary="Jacobian (…, 6, nv) of a link's frame, or of a joint's (the child link's), for q (…, nq): J v is its twist.",
        text="Jacobian {J} of a link's frame, row-major, for {q}: J v is the frame's twist (Featherstone, RBDA 2008, "
        "eq. (4.14)).  O(depth), besides writing 6 nv numbers.",
        python="""
axes, at: "frame" or "world", in whose axes and about whose origin twists are.  order: "lin_ang" or "ang_lin".
offset: three numbers, of the frame's origin from the link's, in the link's axes, m; none by default.
q, out, threads: as in :meth:`inverse_dynamics`.  Featherstone, RBDA 2008, eq. (4.14); O(depth), besides writing
6 nv numbers: only the bodies that carry the link enter.
""",
    ),
    Algorithm(
        name="jacobian_rate",
        mimic="projection",
        elements="nothing",
        loops="tree",
        header="frame_jacobian.hpp",
        inputs=("q", "v"),
        request="frame",
        results=(Result("rate", (6, "nv"), "rate of the Jacobian of the frame"),),
        summary="Rate (…, 6, nv) of the Jacobian of a link's frame, for q (…, nq) and v (…, nv): of each of its numbers.",
        text="Rate {rate} of the Jacobian of a link's frame, row-major, for {q} and {v}: J a + rate v is the rate of J v (Featherstone, RBDA "
        "2008, eqs. (2.45), (3.35)).  O(depth).",
        python="""
The rate of each number of :meth:`jacobian` with the same keywords: J a + rate v is the rate of J v.
q, v, out, threads: as in :meth:`inverse_dynamics`.  Featherstone, RBDA 2008, eqs. (2.45), (3.35); O(depth).
""",
    ),
    Algorithm(
        name="relative_pose",
        mimic="projection",
        elements="nothing",
        loops="tree",
        header="relative_motion.hpp",
        inputs=("q",),
        request="relative",
        results=(Result("pose", (4, 4), "pose of the one frame in the other, m"),),
        summary="Pose (…, 4, 4) of a link's frame as seen from another link's, for q (…, nq); m.",
        text="Pose {pose}, row-major, of a link's frame as seen from another link's for {q}; only the offset of the options has an effect.  "
        "O(joints between the links).",
        python="""
name, seen_from: links, or joints (the child links).  offset: of the first frame's origin, as in :meth:`frame_velocity`.
axes, at, order: no effect.  q, out, threads: as in :meth:`inverse_dynamics`.  O(joints between the links).
""",
    ),
    Algorithm(
        name="relative_velocity",
        mimic="projection",
        elements="nothing",
        loops="tree",
        header="relative_motion.hpp",
        inputs=("q", "v"),
        request="relative",
        results=(Result("twist", (6,), "twist of the one frame relative to the other, m/s and rad/s"),),
        summary="Twist (…, 6) of a link's frame relative to another link's, for q (…, nq) and v (…, nv); m/s, rad/s.",
        text="Twist {twist} of a link's frame relative to another link's for {q} and {v}.  The other frame takes the place of the world in "
        "the options.  O(joints between the links).",
        python="""
name, seen_from: links, or joints (the child links).  It is the twist that an observer who moves with `seen_from` sees.
axes, at: "frame" or "world"; the frame `seen_from` takes the place of the world.
order, offset: as in :meth:`frame_velocity`.  q, v, out, threads: as in :meth:`inverse_dynamics`.
O(joints between the links).
""",
    ),
    Algorithm(
        name="relative_jacobian",
        mimic="projection",
        elements="nothing",
        loops="tree",
        header="relative_motion.hpp",
        inputs=("q",),
        request="relative",
        results=(Result("J", (6, "nv"), "relative twist for each joint velocity"),),
        summary="Jacobian (…, 6, nv) of a link's frame relative to another link's, for q (…, nq): J v is the relative twist.",
        text="Jacobian {J}, row-major, of a link's frame relative to another link's for {q}: J v is the relative velocity.  Columns of "
        "joints that don't lie between the links are zero.  O(joints between the links), besides writing 6 nv numbers.",
        python="""
name, seen_from, axes, at, order, offset: as in :meth:`relative_velocity`.
q, out, threads: as in :meth:`inverse_dynamics`.  O(joints between the links), besides writing 6 nv numbers.
""",
    ),
)
