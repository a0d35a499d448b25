"""Mechanisms with loops: what src/engine/loops/closed.cpp calls for states that the model's plan of elimination fits."""

from algorithms.row import TAU, Algorithm, Result

ROWS = (
    Algorithm(
        name="closed_inverse_dynamics",
        header="closed_dynamics.hpp",
        inputs=("q", "v", "a"),
        external="optional",
        results=(TAU,),
        needs_mass=True,
        closed="plan",
        faces=(),
        summary="Efforts of the drives of a mechanism with loops.",
        text="Efforts {tau} of drives for {q}, {v} and {a}; NaN for states that the plan of elimination doesn't fit.",
    ),
    Algorithm(
        name="closed_inverse_dynamics_with_reactions",
        header="closed_reactions.hpp",
        inputs=("q", "v", "a"),
        external="optional",
        request="reactions",
        results=(TAU,),
        form="efforts_and_reactions",
        needs_mass=True,
        closed="plan",
        faces=(),
        summary="Efforts of the drives of a mechanism with loops, and the wrench through each joint.",
        text="Efforts {tau} of drives and the reactions of the joints that are asked for, for {q}, {v} and {a}: of joints of "
        "the tree, and of those that close loops; NaN in {tau} for states that the plan of elimination doesn't fit.",
    ),
    Algorithm(
        name="closed_forward_dynamics",
        header="closed_dynamics.hpp",
        inputs=("q", "v", "tau"),
        external="optional",
        results=(Result("a", ("motion",), "accelerations, m/s² and rad/s²"),),
        needs_mass=True,
        coupled="refusal",
        closed="plan",
        faces=(),
        summary="Accelerations of a mechanism with loops.",
        text="Accelerations {a} of a mechanism with loops for {q}, {v} and {tau}; NaN for states that the plan of elimination doesn't fit.",
    ),
)
