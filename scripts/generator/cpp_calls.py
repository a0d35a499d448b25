"""C++ calls: one state (ksl/dynamics.hpp) and batches (ksl/batch.hpp), each in double and float."""

import re

from generator.rows import ALGORITHMS, DEFAULTS, INPUTS, MARK, Algorithm, call, comment, extent_name, has, kernels_of, ordered, sentence, with_request


def request_arguments(row: Algorithm) -> list[str]:
    return {
        "links": ["int n", "const int *links"],
        "link": ["int link"],
        "frame": ["int link", "const frame_options &how"],
        "frames": ["int n", "const int *links", "const frame_options &how"],
        "relative": ["int link", "int seen_from", "const frame_options &how"],
        "joints": ["const reaction_request &request"],
        "reactions": ["const reaction_request &request"],
    }.get(row.request, []) + (["component_order order"] if ordered(row) else [])


def arguments(row: Algorithm, default: bool) -> list[str]:
    """Arguments for one state: inputs, what is requested, results, external wrenches."""
    results = [f"S *{result.name}" for result in row.results] + (["S *reactions"] if row.request == "reactions" else [])
    external = {"": [], "required": ["const external_wrenches<S> &external"]}.get(
        row.external, ["const external_wrenches<S> &external" + (" = {}" if default else "")]
    )
    return ["const model &m", "data &d", *(f"const S *{name}" for name in row.input_names()), *with_request(row, results, request_arguments(row)), *external]


def members(row: Algorithm) -> list[str]:
    """Initialisers of the members of state_view, in their order."""
    inputs = {name: row.called.get(name, name) for name in row.inputs} | {name: "zero" for name in kernels_of(row).inputs if name not in row.inputs}
    out = [f".{name} = {inputs[name]}" for name in INPUTS if name in inputs]
    out += [".external = external"] if row.external else []
    out += {
        "links": [".links = {n, links}"],
        "link": [".links = {1, &link}"],
        "frame": [".links = {1, &link}", ".frame = how"],
        "frames": [".links = {n, links}", ".frame = how"],
        "relative": [".links = {2, links}", ".frame = how"],
        "joints": [".joints = &request"],
        "reactions": [".reactions_n = 1", ".reactions = &wanted"],
    }.get(row.request, [])
    out += [".frame = options_of(order)"] if ordered(row) else []
    return out + [f".result = {{{', '.join(result.name for result in row.results)}}}"]


def defaults(row: Algorithm) -> str:
    """What options are where they are not set."""
    options = "reaction_request" if row.request in ("joints", "reactions") else "frame_options"
    return f"  {options} by default: {DEFAULTS[row.request]}." if row.request in DEFAULTS else ""


def of_one_state(row: Algorithm) -> str:
    text = comment(sentence(row) + defaults(row) + "  No allocation.", "/// ")
    return f"{text}\n" + call(f"template <class S>\nKSL_EXPORT void {row.name}(", arguments(row, True), ");")


def definition_of_one_state(row: Algorithm) -> str:
    lines = []
    if row.request == "reactions":
        lines.append("const reaction_result<S> wanted = {&request, reactions};")
    if row.request == "relative":
        lines.append("const int links[] = {link, seen_from};")
    if set(kernels_of(row).inputs) - set(row.inputs):
        lines.append("const S *const zero = d.template zero<S>();")
    lines.append(call(f"  compute<S>(rows::{row.name}, m, d, {{", members(row), "});").strip())
    body = "".join(f"  {line}\n" for line in lines)
    opening = call(f"template <class S>\nvoid {row.name}(", arguments(row, False), ") {")
    return f"{opening}\n{body}}}\n"


def instantiation_of_one_state(row: Algorithm, scalar: str) -> str:
    types = ", ".join(re.sub(r"\w+$", "", argument).strip() for argument in arguments(row, False))
    types = re.sub(r"\bS\b", scalar, types)
    return call(f"template void {row.name}<{scalar}>(", types.split(", "), ");")


def of_batch(row: Algorithm) -> str:
    reads = [f"batch.{name}" + (f" ({row.called[name]})" if name in row.called else "") for name in row.inputs] + (["batch.external"] if row.external else [])
    reads += {
        "links": ["batch.links"],
        "link": ["batch.links (the first; without one nothing is computed)"],
        "frame": ["batch.links (the first; without one nothing is computed)", "batch.frame"],
        "frames": ["batch.links", "batch.frame"],
        "relative": ["batch.links (two: the link, and the one that it is seen from; with fewer nothing is computed)", "batch.frame"],
        "joints": ["batch.joints"],
        "reactions": ["batch.reactions"],
    }.get(row.request, [])
    reads += ["batch.frame.angular_first"] if ordered(row) else []
    what = {"links": "links.n", "6 links": "6 links.n", "joints": "joints->n", "all_links": "all links"}
    shapes = [" × ".join(what.get(n, extent_name(n)) for n in result.shape) or "1" for result in row.results]
    writes = [f"{result.name} into batch.result[{i}] (rows of {shapes[i]})" for i, result in enumerate(row.results)]
    writes += ["the reactions (rows of request.n × 6)"] if row.request == "reactions" else []
    text = f"{sentence(row)}{defaults(row)}  Reads {', '.join(reads)}; writes {', '.join(writes)}."
    arguments = ["const model &m", "const batch_view<S> &batch", "int threads = 0"]
    return comment(text, "/// ") + "\n" + call(f"template <class S>\nKSL_EXPORT void {row.name}_batch(", arguments, ");")


SCALARS = ("double", "float")


def includes(*headers: str) -> str:
    return "\n".join(f'#include "{header}"' for header in headers)


HEADER_INCLUDES = includes("ksl/engine/algorithms/batch_view.hpp", "ksl/model.hpp")

WHAT_SINGLE = "Algorithms on one state; included by ksl/dynamics.hpp.  S: double or float."

WHAT_BATCH = """\
Algorithms on batches; included by ksl/batch.hpp.  S: double or float.
//
// Arguments are not checked.  Results without rows are not wanted: nothing is written.  Throws std::bad_alloc, and
// std::runtime_error for an unusable KSL_ISA; nothing else."""

HEADER = """\
// {mark}
//
// {what}
#pragma once

{includes}

namespace ksl {{

{declarations}

}} // namespace ksl
"""

SOURCE = """\
// {mark}
//
// {what}
{includes}

namespace ksl {{

{definitions}
}} // namespace ksl
"""

BATCHES = """\
#define KSL_BATCH_CALL(name) \\
  template <class S> void name##_batch(const model &m, const batch_view<S> &batch, int threads) {{ compute_batch(rows::name, m, batch, threads); }} \\
  template void name##_batch(const model &, const batch_view<double> &, int); \\
  template void name##_batch(const model &, const batch_view<float> &, int);

{calls}
#undef KSL_BATCH_CALL
"""


def files() -> dict[str, str]:
    single = [row for row in ALGORITHMS if has(row, "c++")]
    batch = [row for row in ALGORITHMS if has(row, "c++ batch")]
    return {
        "include/ksl/dynamics_calls.hpp": HEADER.format(
            mark=MARK, what=WHAT_SINGLE, includes=HEADER_INCLUDES, declarations="\n\n".join(map(of_one_state, single))
        ),
        "include/ksl/batch_calls.hpp": HEADER.format(mark=MARK, what=WHAT_BATCH, includes=HEADER_INCLUDES, declarations="\n\n".join(map(of_batch, batch))),
        "src/engine/run/dynamics_calls.cpp": SOURCE.format(
            mark=MARK,
            what="The calls of ksl/dynamics_calls.hpp: a model and a workspace, unpacked for the kernels.",
            includes=includes("engine/run/compute.hpp", "ksl/dynamics.hpp"),
            definitions="\n".join([*map(definition_of_one_state, single), *(instantiation_of_one_state(row, s) for row in single for s in SCALARS), ""]),
        ),
        "src/batch/batch_calls.cpp": SOURCE.format(
            mark=MARK,
            what="The calls of ksl/batch_calls.hpp.",
            includes=includes("batch/compute_batch.hpp", "ksl/batch.hpp"),
            definitions=BATCHES.format(calls="".join(f"KSL_BATCH_CALL({row.name})\n" for row in batch)),
        ),
    }
