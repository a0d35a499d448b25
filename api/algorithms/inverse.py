"""Inverse dynamics, and what follows from it: reactions, bias, efforts against gravity."""

from algorithms.row import TAU, Algorithm, Result

ROWS = (
    Algorithm(
        name="inverse_dynamics",
        mimic="projection",
        elements="wrenches",
        loops="efforts",
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
link's origin, in the link's axes, or with external_axes="world" in the world's.  Gravity is included.  Damping, friction,
rotors and springs of joints are included if `physics=` of :func:`ksl.load` names them; :meth:`effort_parts` gives each.

A floating base is the first joint: q = [x y z qx qy qz qw] in the world, v = [linear, angular] in the body's
frame, a = dv/dt componentwise; its effort is the wrench on the body in the same frame.

q, v and a are arrays, sequences, or objects with the array, buffer or DLPack protocol.  They are not copied if the numbers of a row
are neighbours and the rows are at equal distances, also negative ones.  The result is float32 if all arguments are.
One number stands for each coordinate: v=0.  Tables (pandas, polars, pyarrow, structured arrays, mappings) whose columns have
names are taken by name: those of joints, `elbow`, `elbow.v`, `elbow.a`, as in motions.  external takes :class:`ksl.Wrench`, too.
out: a C-contiguous array for the result; it may be one of the arguments, but not overlap one otherwise.
threads: the most threads for large batches.  None or 0 is all cores that the process may use, by affinity and quotas of containers;
more are never used.  Results don't depend on it.  The interpreter's lock is released from 32 states on.

Recursive Newton–Euler (Featherstone, RBDA 2008, table 5.1); O(bodies).
Raises ValueError for shapes that don't fit and numbers that are complex or not finite.
""",
    ),
    Algorithm(
        name="inverse_dynamics_with_reactions",
        mimic="projection",
        elements="wrenches",
        loops="reactions",
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
        mimic="projection",
        elements="wrenches",
        loops="reactions",
        header="reactions.hpp",
        inputs=("q", "v", "a"),
        external="optional",
        request="reactions",
        results=(),
        variant_of="inverse_dynamics_with_reactions",
        faces=("c++ batch", "c batch", "python"),
        summary="The wrench through each joint: what the parent side exerts on the child side.",
        text="Reactions of the joints that are asked for, for {q}, {v}, {a}, under gravity and external wrenches: the wrench that the "
        "parent side exerts on the child side through each joint, whole or its constraint, actuation or coupling part (Coscrews page, (7)–(9)).",
        python="""
q, v, a, external: as in :meth:`inverse_dynamics`.  Returns (…, joints, 6); N and N m.
joints: names in the order wanted, mimic joints, fixed ones and `base` too; by default the moving joints in the order of q.  `base` joins
a fixed root to the ground; it is `ground` where a joint, or a link other than the root, is called `base`.
on: the side that the wrench acts on; "parent" gives the negative.
at: the point that moments are about: "joint" (the joint's origin), "world" (its origin), a link's name (its
origin), or three numbers, an offset from the joint's origin in the joint's axes, m.
axes: "joint" (those of the joint's frame on the child side: the child link's), "world", or a link's name.  "link:NAME" is a link
whatever it is called, "joint" say; "ksl:world" is the world beside a link `world` that is elsewhere, for which "world" is refused.
order: "lin_ang" (fx fy fz tx ty tz) or "ang_lin".
part: "constraint" is what the structure carries, H̄* f; "actuation" what lies along the joint's motion, h̄* f
(revolute: the moment about the axis; prismatic: the force along it; fixed: nothing; floating: all); "coupling" the
same of a mimic joint, which has no actuation; "total" their sum.  The effort of a drive that leads mimic joints is
the sum of Sᵀ f of its own joint's actuation and, times their multipliers, of their couplings.  The split is made in
the joint's frame and then moved by the coadjoint (Coscrews page, (7)–(9)).
Joints that close loops are named, too.  Components that rigid bodies leave open (:meth:`reactions_unique`) have the values of least norm,
or with stiffness={joint: …}, as :meth:`with_stiffness` takes it, those of least energy.
""",
    ),
    Algorithm(
        name="effort_parts",
        mimic="projection",
        elements="wrenches",
        loops="parts",
        header="effort_parts.hpp",
        inputs=("q", "v", "a"),
        external="optional",
        results=(Result("parts", (5, "nv"), "transmitted effort, and what damping, friction, rotors and springs need"),),
        summary="What the efforts (…, 5, nv) of inverse_dynamics consist of: transmitted, damping, friction, rotor, spring.",
        text="The parts {parts} of the efforts of inverse dynamics for {q}, {v}, {a}: the transmitted effort Sᵀ f, then what damping, dry "
        "friction, the inertia of rotors and springs need, as far as the model's options name them.  O(bodies).",
        python="""
q, v, a, external, out, threads: as in :meth:`inverse_dynamics`, whose result is the sum over the parts; N m, N.
The rotor's part is armature · a, the damping's damping · v, the friction's F v/√(v² + w²) with the stated width w (or F sign(v)
for `physics="exact friction"`), the spring's stiffness · (q − rest).  They are zero unless `physics=` of :func:`ksl.load` names them.
O(bodies).
""",
    ),
    Algorithm(
        name="bias",
        mimic="projection",
        elements="wrenches",
        loops="steady",
        header="inverse_dynamics.hpp",
        inputs=("q", "v"),
        external="optional",
        results=(TAU,),
        variant_of="inverse_dynamics",
        summary="Efforts (…, nv) that hold velocities v without acceleration: Coriolis, centrifugal, gravity, less external wrenches; N m, N.",
        text="Efforts {tau} that hold velocities {v} at {q} without acceleration: inverse dynamics with a = 0.  O(bodies).",
        python="""
q, v, external, out, threads: as in :meth:`inverse_dynamics`, of which this is the case a = 0.  Damping, friction and springs are included
if `physics=` of :func:`ksl.load` names them.  O(bodies).
""",
    ),
    Algorithm(
        name="gravity_torque",
        mimic="projection",
        elements="wrenches",
        loops="statics",
        header="inverse_dynamics.hpp",
        inputs=("q",),
        external="optional",
        results=(TAU,),
        variant_of="inverse_dynamics",
        summary="Efforts (…, nv) that hold the mechanism at rest at q, against gravity and external wrenches; N m, N.",
        text="Efforts {tau} that hold the mechanism at rest at {q}: inverse dynamics with v = a = 0.  O(bodies).",
        python="""
q, external, out, threads: as in :meth:`inverse_dynamics`, of which this is the case v = a = 0.  Springs are included if `physics=` of
:func:`ksl.load` names them.  O(bodies).
""",
    ),
)
