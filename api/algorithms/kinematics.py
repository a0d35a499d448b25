"""Poses and motions of links."""

from algorithms.row import Algorithm, Result

ROWS = (
    Algorithm(
        name="frame_pose",
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
names: in the order wanted; by default all links in the order of `link_names`.
q, out, threads: as in :meth:`inverse_dynamics`.  O(bodies + links).
""",
    ),
    Algorithm(
        name="jacobian",
        header="frame_jacobian.hpp",
        inputs=("q",),
        request="frame",
        results=(Result("J", (6, "nv"), "twist of the frame for each joint velocity"),),
        summary="Jacobian (…, 6, nv) of a link's frame, or of a joint's (the child link's), for q (…, nq): J v is its twist.",
        text="Jacobian {J} of a link's frame, row-major, for {q}: J v is the frame's twist (Featherstone, RBDA 2008, "
        "eq. (4.14)).  O(bodies).",
        python="""
axes, at: "frame" or "world", in whose axes and about whose origin twists are.  order: "lin_ang" or "ang_lin".
q, out, threads: as in :meth:`inverse_dynamics`.  Featherstone, RBDA 2008, eq. (4.14); O(bodies).
""",
    ),
)
