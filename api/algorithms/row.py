"""What the row of an algorithm says."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field


INPUTS = {"q": "nq", "v": "nv", "a": "nv", "tau": "nv", "q1": "nq", "fraction": 1}
"""Inputs, in the order of all calls, and how many numbers they have.  q1: a second position."""


@dataclass(frozen=True)
class Result:
    """A result: its name in C and C++, its shape, and what it is.

    shape: for each axis, of which there are at most four, a number (3, 4, 5, 6 or 10), "nq", "nv", "motion", "links" or "joints" (how
    many are requested), "6 links", "all_links" (those of the model), "freedoms" (of a mechanism with loops; private rows alone), or "tree" (how many elements of a matrix aren't zero by the
    shape of the tree).  Empty: one number.  "motion" are nv numbers that are velocities or accelerations; along "nv" are efforts, or
    derivatives by a motion.  The difference matters to robots with mimic joints (src/engine/mimic/algorithms.hpp).
    """

    name: str
    shape: tuple[int | str, ...]
    text: str


@dataclass(frozen=True)
class Algorithm:
    """The row of an algorithm.

    name: the name of every call, and of the engine's function NAME(model, workspace, inputs, [external,] [links,] results),
    unless another form is given.  The workspace is NAME_workspace, unless given.
    header: the file that defines it, in include/ksl/engine/algorithms/GROUP/; "mass/NAME.hpp" names that of another group.
    inputs: names of INPUTS, q first.  called: what calls name them instead, where that says more, or where they are something else.  external: wrenches on links are "optional" or "required".
    request: what a call specifies besides numbers:
        "links": links, how many and which; "link": one
        "frames", "frame": the same, and in whose axes and about whose origin their motion is expressed
        "relative": a link, the link that it is seen from, and how the motion is expressed
        "joints": joints, and how their wrenches are expressed; the results are those of the row
        "reactions": the same; the reactions are a result besides those of the row, and there may be several requests
    keywords: what a call asks for besides.  Of a frame or frames, in Python: "kind" of acceleration, or a "point" fixed in the link
        instead of the frame's origin and the order.  Of links, and of calls without a request: "order", of the six numbers of
        twists, wrenches and momenta (those of frames and joints have it anyway).
    choices: keywords of the Python method whose values are other algorithms: {"triangle": {"both": this one, "upper": the other}}.
        The first is the default.
    links_keyword: what the argument is called in Python that names several links.
    form: how results are stored from lanes to rows, a struct of src/engine/kernels/forms.hpp.
    upper: of the forms symmetric_matrix and upper_triangle, the function that computes the upper triangle alone, without zeros.
    needs_mass: is the call refused if a joint can move without moving any mass.
    nan_without_mass: is the result NaN where nothing that moves has mass, which its documentation says.
    smooth_friction: is the call refused if dry friction is exact, for it solves or differentiates the law of friction.
    variant_of: the algorithm that computes this one, with zeros for the inputs that this one doesn't have.  It may have more results,
        after those of this one.
    mimic, elements, loops: what the kernels alone don't know.  None has a default, so that no algorithm leaves them out in silence.
    mimic: how it is computed for robots with mimic joints (src/engine/mimic/algorithms.hpp): by "projection", which holds for all that is a
        function of positions and motions and is written whole; as the "solution" of M a = tau − bias, for forward dynamics; as
        "product", M⁻¹ tau; as "inverse", M⁻¹; as the "upper_triangle" of M; as "solution_derivatives", "solution_second_derivatives", "hybrid", "jump" or
        one of the "operational" quantities, from M, its factors and Jacobians; or not at all, "refusal".
    elements: what springs, dampers and cylinders between two points do in it (src/engine/elements/algorithms.hpp): "nothing"; they are external
        "wrenches", and no more; they have an "energy" and "energy_derivatives"; "effort_derivatives", the "effort_gradient",
        "acceleration_derivatives" and "reaction_derivatives" get what they add; or it isn't computed with them, "refusal".
    loops: how it is computed for mechanisms with loops (src/engine/loops/algorithms.hpp): as for the "tree", for what is a function of the given
        numbers; as "efforts" of the drives, "reactions", "parts" of efforts, "steady" or "statics"; as "accelerations" or the "jump" of
        velocities; as results that are "linear" in wrenches on links; or not at all, "refusal".  "plan": it is what computes them, and private.
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
    keywords: str = ""
    choices: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    links_keyword: str = "names"
    form: str = "whole_results"
    upper: str = ""
    workspace: str = ""
    needs_mass: bool = False
    nan_without_mass: bool = False
    smooth_friction: bool = False
    variant_of: str = ""
    faces: tuple[str, ...] = ("c++", "c", "python")
    called: Mapping[str, str] = field(default_factory=dict)
    mimic: str = field(kw_only=True)
    elements: str = field(kw_only=True)
    loops: str = field(kw_only=True)

    def __post_init__(self) -> None:
        if self.keywords == "order" and self.request not in ("", "links"):
            raise ValueError(f"{self.name}: the request {self.request} has an order of its own")
        # other numbers than efforts expand as velocities do; plans of loops have an equation for each follower, and efforts at leaders are enough
        if "tau" in self.inputs and self.mimic == "projection" and "tau" not in self.called and self.loops != "plan":
            raise ValueError(f"{self.name}: efforts of coupled joints can't be expanded; give another mimic=")
        if "tau" in self.inputs and self.loops == "tree":
            raise ValueError(f"{self.name}: efforts of a tree are not those of a mechanism with loops; give another loops=")

    def input_names(self) -> tuple[str, ...]:
        """The inputs as calls name them."""
        return tuple(self.called.get(name, name) for name in self.inputs)


TAU = Result("tau", ("nv",), "joint efforts, N m or N")
