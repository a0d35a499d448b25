"""C calls: ksl/engine_calls.h and their definitions; one state and batches, in double and (suffix f) in float.

Each definition is written once: engine_calls.cpp includes the file of them for double and for float."""

from generator.rows import ALGORITHMS, DEFAULTS, INPUTS, MARK, WIDTH, Algorithm, call, comment, has, ordered, sentence, with_request

SCALARS = {"double": "", "float": "f"}
EXTERNAL = {"double": "ksl_external_t", "float": "ksl_externalf_t", "KSL_REAL": "KSL_EXTERNAL"}
EXTERNAL_ROWS = {"double": "ksl_external_rows_t", "float": "ksl_external_rowsf_t", "KSL_REAL": "KSL_EXTERNAL_ROWS"}
FRAME, JOINTS = "const ksl_frame_options_t *options", ["int n", "const int *joints", "const ksl_reaction_options_t *options"]
REQUEST = {"links": ["int links_n", "const int *links"], "link": ["int link"], "frame": ["int link", FRAME],
           "frames": ["int links_n", "const int *links", FRAME], "relative": ["int link", "int seen_from", FRAME],
           "joints": JOINTS, "reactions": JOINTS}  # fmt: skip
LINKS = {"links": "{N, links}", "link": "{1, &link}", "frame": "{1, &link}", "frames": "{N, links}", "relative": "{2, links}"}
"""The member of a view that names links; N: how many."""


def request_of(row: Algorithm) -> list[str]:
    """Arguments that say what is requested, and how it is expressed."""
    return REQUEST.get(row.request, []) + (["ksl_order_t order"] if ordered(row) else [])


def results(row: Algorithm) -> list[str]:
    return [result.name for result in row.results] + (["wrenches"] if row.request == "reactions" else [])


def state_arguments(row: Algorithm, scalar: str) -> list[str]:
    """Arguments: model and workspace, inputs, external wrenches, what is requested, results."""
    out = [f"{scalar} *{name}" for name in results(row)]
    request = [a.replace("links_n", "n") for a in request_of(row)]
    external = [f"const {EXTERNAL[scalar]} *external"] if row.external else []
    inputs = [f"const {scalar} *{name}" for name in row.input_names()]
    return ["const ksl_model_t *model", "ksl_data_t *data", *inputs, *external, *with_request(row, out, request)]


def batch_arguments(row: Algorithm, scalar: str, external: bool) -> list[str]:
    """Arguments of a batch call: no workspace, and a stride for each array."""
    out = [[f"{scalar} *{name}", f"ptrdiff_t {name}_stride"] for name in results(row)]
    request = [a.replace("int n", "int joints_n") for a in request_of(row)]
    after = [a for some in with_request(row, out, [request]) for a in some]
    inputs = [a for name in row.input_names() for a in (f"const {scalar} *{name}", f"ptrdiff_t {name}_stride")]
    wrenches = [f"const {EXTERNAL_ROWS[scalar]} *external"] if external else []
    return ["const ksl_model_t *model", "size_t n", *inputs, *wrenches, *after, "int threads"]


def batches(row: Algorithm) -> list[tuple[str, bool]]:
    """Names of a row's batch calls, and whether they take external wrenches."""
    if row.external == "optional":
        return [(f"ksl_{row.name}_batch", False), (f"ksl_{row.name}_external_batch", True)]
    return [(f"ksl_{row.name}_batch", bool(row.external))]


def what_may_be_null(row: Algorithm) -> str:
    text = "  external may be NULL: no wrench." if row.external else ""
    return text + (f"  options may be NULL: {DEFAULTS[row.request]}." if row.request in DEFAULTS else "")


def declarations(row: Algorithm) -> str:
    lines = [comment(sentence(row) + what_may_be_null(row), "    ", "/** ", " */", WIDTH)]
    for scalar, suffix in SCALARS.items():
        if has(row, "c"):
            lines.append(call(f"KSL_EXPORT ksl_status_t ksl_{row.name}{suffix}(", state_arguments(row, scalar), ");"))
    for scalar, suffix in SCALARS.items():
        for name, external in batches(row):
            lines.append(call(f"KSL_EXPORT ksl_status_t {name}{suffix}(", batch_arguments(row, scalar, external), ");"))
    return "\n".join(lines)


def before_the_call(row: Algorithm) -> str:
    """What a call makes of its arguments."""
    if ordered(row):
        return "  ksl_frame_options_t options = {};\n  options.order = order;\n"
    return "  const int links[] = {link, seen_from};\n" if row.request == "relative" else ""


def state_definition(row: Algorithm) -> str:
    members = [f".{name} = {row.called.get(name, name)}" for name in INPUTS if name in row.inputs]
    members += [f".links = {LINKS[row.request].replace('N', 'n')}"] if row.request in LINKS else []
    members += [f".result = {{{', '.join(r.name for r in row.results)}}}"]
    arguments = ["model", "data", "{" + ", ".join(members) + "}"]
    arguments += ["external"] if row.external else ["no_external"]
    arguments += ["options"] if row.request in ("frame", "frames", "relative") else ["&options"] if ordered(row) else []
    arguments += ["{n, joints, options}"] if row.request in ("joints", "reactions") else []
    arguments += ["wrenches"] if row.request == "reactions" else []
    opening = call(f"ksl_status_t KSL_CALL(ksl_{row.name})(", state_arguments(row, "KSL_REAL"), ") {")
    return f"{opening}\n{before_the_call(row)}" + call(f"  return state_call<rows::{row.name}, KSL_REAL>(", arguments, ");") + "\n}\n"


def batch_definition(row: Algorithm, name: str, external: bool) -> str:
    members = [".n = n", *(f".{x} = {{{row.called.get(x, x)}, {row.called.get(x, x)}_stride}}" for x in INPUTS if x in row.inputs)]
    members += [f".links = {LINKS[row.request].replace('N', 'links_n')}"] if row.request in LINKS else []
    members += [f".result = {{{', '.join(f'{{{r.name}, {r.name}_stride}}' for r in row.results)}}}"]
    arguments = [f"rows::{row.name}", "model", "{" + ", ".join(members) + "}", "external" if external else "no_external_rows", "threads"]
    arguments += ["options"] if row.request in ("frame", "frames", "relative") else ["&options"] if ordered(row) else []
    arguments += ["nullptr", "{joints_n, joints, options}"] if row.request in ("joints", "reactions") else []
    arguments += ["rows_view<KSL_REAL>{wrenches, wrenches_stride}"] if row.request == "reactions" else []
    opening = call(f"ksl_status_t KSL_CALL({name})(", batch_arguments(row, "KSL_REAL", external), ") {")
    return f"{opening}\n{before_the_call(row)}" + call("  return batch_call<KSL_REAL>(", arguments, ");") + "\n}\n"


def definitions(row: Algorithm) -> str:
    out = [state_definition(row)] if has(row, "c") else []
    return "\n".join(out + [batch_definition(row, name, external) for name, external in batches(row)])


HEADER = """\
/* {mark}

   Algorithms from C; included by ksl/engine.h.  ksl/engine_types.h says how external wrenches and reactions are given.

   One state: the workspace is data.  Arrays hold one state's numbers, which are checked.  Names with the suffix f are the
   same in single precision.

   _batch: n states at once, in lanes and on `threads` threads (0: all cores that the process may use,
   by affinity and quotas; never more).  Arrays are row-major: a row a state, strides
   in numbers between rows, negative ones too.  No workspace is passed; memory is kept for each calling thread.  Results are
   the bits of the one-state calls.  Numbers are not checked: a NaN spoils its own state only.  Where an algorithm takes
   external wrenches or does without, _external_batch is the call that takes them.

   Memory: rows of a result must not overlap, and a result must not overlap another one, external wrenches, or an input unless both
   have the same rows: the same address, stride and length.  Such calls are KSL_BAD_ARGUMENT.  Arrays of equal strides may be parts
   of one record. */
#ifndef KSL_ENGINE_CALLS_H
#define KSL_ENGINE_CALLS_H

#include "ksl/engine_types.h"

#include <stddef.h>

KSL_BEGIN_C

{declarations}

KSL_END_C

#endif
"""

DEFINITIONS = """\
// {mark}
//
// The calls of ksl/engine_calls.h, which engine_calls.cpp includes once for double and once for float.

{definitions}"""

SOURCE = """\
// {mark}
//
// The calls of ksl/engine_calls.h, in double and (suffix f) in float.
#include "c_api/calls.hpp"

using namespace ksl::c_api;
using ksl::rows_view;
namespace rows = ksl::rows;

extern "C" {{
{scalars}
}} // extern "C"
"""

OF_SCALAR = """
#define KSL_REAL {scalar}
#define KSL_CALL(name) {name}
#define KSL_EXTERNAL {external}
#define KSL_EXTERNAL_ROWS {rows}
#include "c_api/engine_calls.inc"
#undef KSL_REAL
#undef KSL_CALL
#undef KSL_EXTERNAL
#undef KSL_EXTERNAL_ROWS
"""


def of_scalar(scalar: str, suffix: str) -> str:
    return OF_SCALAR.format(scalar=scalar, name=f"name##{suffix}" if suffix else "name", external=EXTERNAL[scalar], rows=EXTERNAL_ROWS[scalar])


def files() -> dict[str, str]:
    wanted = [row for row in ALGORITHMS if has(row, "c batch")]
    return {
        "include/ksl/engine_calls.h": HEADER.format(mark=MARK, declarations="\n\n".join(map(declarations, wanted))),
        "src/c_api/engine_calls.inc": DEFINITIONS.format(mark=MARK, definitions="\n".join(map(definitions, wanted))),
        "src/c_api/engine_calls.cpp": SOURCE.format(mark=MARK, scalars="".join(of_scalar(*pair) for pair in SCALARS.items())),
    }
