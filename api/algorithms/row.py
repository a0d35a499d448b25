"""What the row of an algorithm says."""

from __future__ import annotations

from dataclasses import dataclass


INPUTS = {"q": "nq", "v": "nv", "a": "nv", "tau": "nv", "q1": "nq", "fraction": 1}
"""Inputs, in the order of all calls, and how many numbers they have.  q1: a second position."""


@dataclass(frozen=True)
class Result:
    """A result: its name in C and C++, its shape, and what it is.

    shape: for each axis, of which there are at most four, a number (3, 4, 5, 6 or 10), "nq", "nv", "links" or "joints" (how many
    are requested).  Empty: one number.
    """

    name: str
    shape: tuple[int | str, ...]
    text: str


@dataclass(frozen=True)
class Algorithm:
    """The row of an algorithm.

    name: the name of every call, and of the engine's function NAME(model, workspace, inputs, [external,] [links,] results),
    unless another form is given.  The workspace is NAME_workspace, unless given.
    inputs: names of INPUTS, q first.  external: wrenches on links are "optional" or "required".
    request: what a call specifies besides numbers:
        "links": links, how many and which; "link": one
        "frames", "frame": the same, and in whose axes and about whose origin their motion is expressed
        "relative": a link, the link that it is seen from, and how the motion is expressed
        "joints": joints, and how their wrenches are expressed; the results are those of the row
        "reactions": the same; the reactions are a result besides those of the row, and there may be several requests
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
