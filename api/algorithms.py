"""One row for each algorithm.  From it scripts/generate.py makes the kernels, the C++ and C calls, the Python method, the
reference page, and the test that compares them with each other.

A new algorithm is a header in include/ksl/engine/ and a row here; CONTRIBUTING.md says what the header must define.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Result:
    """A result: its name in C and C++, its shape, and what it is.

    shape: for each axis a number, "nv", or "links" (how many links are requested).  Empty: one number.
    """

    name: str
    shape: tuple[int | str, ...]
    text: str


@dataclass(frozen=True)
class Algorithm:
    """The row of an algorithm.

    name: the name of every call, and of the engine's function NAME(model, workspace, inputs, [external,] [links,] results),
    unless another form is given.  The workspace is NAME_workspace, unless given.
    inputs: of q (nq), v, a and tau (nv).  external: wrenches on links are "optional" or "required".
    request: "links" (how many, which), "link" (one), "frame" (link, and how its motion is expressed), or
    "reactions" (joints, and how their wrenches are expressed).
    form: how results are stored from lanes to rows, a struct of src/engine/forms.hpp.
    variant_of: the algorithm that computes this one, with zeros for the inputs that this one doesn't have.
    faces: the languages for which a call is generated.  Other calls are written by hand, or are private.
    text: one sentence for C, C++ and the reference; {tau}, {q} … stand for names with shapes.
    python: the docstring of the method, after its first line.
    """

    name: str
    header: str
    inputs: tuple[str, ...]
    results: tuple[Result, ...]
    summary: str
    text: str
    python: str = ""
    external: str = ""
    request: str = ""
    form: str = "whole_results"
    workspace: str = ""
    variant_of: str = ""
    faces: tuple[str, ...] = ("c++", "c", "python")


TAU = Result("tau", ("nv",), "joint efforts, N m or N")

ALGORITHMS = (
    Algorithm(
        name="inverse_dynamics",
        header="inverse_dynamics.hpp",
        inputs=("q", "v", "a"),
        external="optional",
        results=(TAU,),
        summary="Joint efforts that give accelerations `a` at positions `q` and velocities `v`.",
        text="Joint efforts {tau} for {q}, {v}, {a}, under gravity and external wrenches, by the recursive Newton–Euler algorithm "
        "(Featherstone, RBDA 2008, table 5.1).  O(bodies).",
        python="""
q (…, nq), v and a (…, nv) → (…, nv); rad, m, N m, N.  Leading shapes are broadcast.
external: {link name: (…, 6)}, the wrench that the environment exerts on the link: force first, about the
link's origin, in the link's axes.  Gravity is included.  Joint friction and damping are not.

A floating base is the first joint: q = [x y z qx qy qz qw] in the world, v = [linear, angular] in the body's
frame, a = dv/dt componentwise; its effort is the wrench on the body in the same frame.

Arrays, sequences and whatever has the array, buffer or DLPack protocol; no copy where the numbers of a row are
neighbours and rows lie at one distance, a negative one too.  float32 stays float32 where every argument is.
out: a C-contiguous array for the result; it may be one of the arguments, but not overlap one otherwise.
threads: at most so many for large batches; None or 0: all cores; results don't depend on it.  The interpreter's
lock is released from 32 states on.

Recursive Newton–Euler (Featherstone, RBDA 2008, table 5.1); O(bodies).
Raises ValueError for shapes that don't fit and numbers that are complex or not finite.
""",
    ),
    Algorithm(
        name="inverse_dynamics_with_reactions",
        header="reactions.hpp",
        inputs=("q", "v", "a"),
        external="optional",
        request="reactions",
        results=(TAU,),
        form="efforts_and_reactions",
        workspace="reactions_workspace",
        faces=("c++", "c"),
        summary="Joint efforts, and the wrench through each joint, in one pass.",
        text="Joint efforts {tau} and the reactions of the joints that are asked for, for {q}, {v}, {a}, under gravity and external "
        "wrenches: what the parent side exerts on the child side through each joint.  Reactions of moving joints in their own frames "
        "are written during the backward pass of inverse dynamics, which costs less than two calls.",
    ),
    Algorithm(
        name="reactions",
        header="reactions.hpp",
        inputs=("q", "v", "a"),
        external="optional",
        request="reactions",
        results=(),
        variant_of="inverse_dynamics_with_reactions",
        faces=("c++ batch", "c batch", "python"),
        summary="The wrench through each joint: what the parent side exerts on the child side.",
        text="Reactions of the joints that are asked for, for {q}, {v}, {a}, under gravity and external wrenches: the wrench that the "
        "parent side exerts on the child side through each joint, whole or its constraint or actuation part (Coscrews page, (7)–(9)).",
        python="""
q, v, a, external: as in :meth:`inverse_dynamics`.  Returns (…, joints, 6); N and N m.
joints: names in the order wanted, fixed ones and `base` too; by default the moving joints in the order of q.
on: the side the wrench acts on; "parent" is the negative.
at: the point that moments are about: "joint" (the joint's origin), "world" (its origin), a link's name (its
origin), or three numbers, an offset from the joint's origin in the joint's axes, m.
axes: "joint" (those of the joint's frame on the child side: the child link's), "world", or a link's name.
order: "lin_ang" (fx fy fz tx ty tz) or "ang_lin".
part: "constraint" is what the structure carries, H̄* f; "actuation" what lies along the joint's motion, h̄* f
(revolute: the moment about the axis; prismatic: the force along it; fixed: nothing; floating: all); "total"
their sum.  The split is made in the joint's frame and then moved by the coadjoint (Coscrews page, (7)–(9)).
""",
    ),
    Algorithm(
        name="forward_dynamics",
        header="forward_dynamics.hpp",
        inputs=("q", "v", "tau"),
        external="optional",
        results=(Result("a", ("nv",), "accelerations, rad/s² or m/s²"),),
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
    Algorithm(
        name="bias",
        header="inverse_dynamics.hpp",
        inputs=("q", "v"),
        external="optional",
        results=(TAU,),
        variant_of="inverse_dynamics",
        summary="Efforts (…, nv) that hold velocities v without acceleration: Coriolis, centrifugal, gravity, less external wrenches.",
        text="Efforts {tau} that hold velocities {v} at {q} without acceleration: inverse dynamics with a = 0.  O(bodies).",
        python="""
q, v, external, out, threads: as in :meth:`inverse_dynamics`, of which this is the case a = 0.
""",
    ),
    Algorithm(
        name="gravity_torque",
        header="inverse_dynamics.hpp",
        inputs=("q",),
        external="optional",
        results=(TAU,),
        variant_of="inverse_dynamics",
        summary="Efforts (…, nv) that hold the mechanism at rest at q, against gravity and external wrenches.",
        text="Efforts {tau} that hold the mechanism at rest at {q}: inverse dynamics with v = a = 0.  O(bodies).",
        python="""
q, external, out, threads: as in :meth:`inverse_dynamics`, of which this is the case v = a = 0.
""",
    ),
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
        name="energy",
        header="energy.hpp",
        inputs=("q", "v"),
        results=(Result("kinetic", (), "kinetic energy, J"), Result("potential", (), "potential energy, J")),
        summary="Kinetic and potential energy, J, each (…), for q (…, nq), v (…, nv).",
        text="{kinetic} and {potential} energy, J, for {q} and {v}; the latter zero with every centroid at the world's origin.  O(bodies).",
        python="""
Potential energy is that of gravity, zero with every centroid at the world's origin.
out: two arrays, for the one and for the other.  q, v, threads: as in :meth:`inverse_dynamics`.
""",
    ),
    Algorithm(
        name="external_power",
        header="energy.hpp",
        inputs=("q", "v"),
        external="required",
        results=(Result("power", (), "power, W"),),
        summary="Power (…) of external wrenches, W: the sum of f · v of the links that they act on.",
        text="{power} of external wrenches, W, for {q} and {v}: the sum of f · v of the links that they act on.  "
        "No wrench, no power.  O(bodies).",
        python="""
q (…, nq), v (…, nv); external, out, threads: as in :meth:`inverse_dynamics`.  No wrench, no power.
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
