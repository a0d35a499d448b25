"""The test that compares the C++ and C interfaces with each other (Python: test/mechanism/algorithms_test.py), and every algorithm as a template
over any scalar, for tests with dual numbers."""

import textwrap

from generator.c_calls import SCALARS, batches
from generator.kernels import header, over_any_scalar, workspace
from generator.rows import ALGORITHMS, COMPUTING, MARK, Algorithm, call, has, ordered, with_request

REQUEST_CPP = {"links": ["3", "s.r.links.data()"], "frame": ["s.r.links[0]", "s.r.how"], "link": ["s.r.links[0]"],
               "frames": ["3", "s.r.links.data()", "s.r.how"], "relative": ["s.r.links[0]", "s.r.links[1]", "s.r.how"],
               "joints": ["s.r.request"], "reactions": ["s.r.request"]}  # fmt: skip
JOINTS = ["s.r.request.n", "s.r.joints.data()", "nullptr"]
REQUEST_C = {"links": ["3", "s.r.links.data()"], "frame": ["s.r.links[0]", "s.r.c_how"], "link": ["s.r.links[0]"],
             "frames": ["3", "s.r.links.data()", "s.r.c_how"], "relative": ["s.r.links[0]", "s.r.links[1]", "s.r.c_how"],
             "joints": JOINTS, "reactions": JOINTS}  # fmt: skip


CPP, C = (REQUEST_CPP, "s.r.order()"), (REQUEST_C, "s.r.c_order()")


def request(row: Algorithm, of: tuple[dict[str, list[str]], str]) -> list[str]:
    return of[0].get(row.request, []) + ([of[1]] if ordered(row) else [])


def results(row: Algorithm) -> list[str]:
    return [f"s.result[{i}]" for i in range(len(row.results))] + (["s.wrenches"] if row.request == "reactions" else [])


def cpp(row: Algorithm) -> str:
    out = results(row)
    arguments = ["s.r.m", "s.r.d", *(f"s.{name}" for name in row.inputs), *with_request(row, out, request(row, CPP))]
    return call(f"    ksl::{row.name}(", arguments + (["s.external"] if row.external else []), ");")


def c(row: Algorithm, suffix: str) -> str:
    out = results(row)
    external = ["&s.c_external"] if row.external else []
    arguments = ["s.r.c_model", "s.r.c_data", *(f"s.{name}" for name in row.inputs), *external, *with_request(row, out, request(row, C))]
    return call(f"    s.status = ksl_{row.name}{suffix}(", arguments, ");")


def c_batch(row: Algorithm, suffix: str) -> str:
    strided = lambda rows: [f"{rows}.first", f"{rows}.stride"]
    out = [strided(f"s.batch.result[{i}]") for i in range(len(row.results))] + ([strided("s.batch.reactions->out")] if row.request == "reactions" else [])
    inputs = [a for name in row.inputs for a in strided(f"s.batch.{name}")]
    after = [a for some in with_request(row, out, [request(row, C)]) for a in some]
    calls = [call(f"s.status = {name}{suffix}(", ["s.r.c_model", "s.n", *inputs, *(["&s.external"] if external else []), *after, "s.threads"], ");")
             for name, external in batches(row)]  # fmt: skip
    indented = [textwrap.indent(text, "    " if len(calls) == 1 else "      ") for text in calls]
    if len(calls) == 1:
        return indented[0]
    alone, pushed = indented
    return f"    if (s.external.n == 0)\n{alone}\n    else\n{pushed}"


CASE = """\
TEST_CASE("{name}: C++ and C, one state and batches, in {scalar}") {{
  const auto cpp = [](faces::one<{scalar}> &s) {{
{cpp}
  }};
  const auto c = [](faces::one<{scalar}> &s) {{
{c}
  }};
  const auto cpp_batch = [](faces::many<{scalar}> &s) {{
    ksl::{name}_batch(s.r.m, s.batch, s.threads);
  }};
  const auto c_batch = [](faces::many<{scalar}> &s) {{
{c_batch}
  }};
  faces::agree<{scalar}>(ksl::rows::{name}, cpp, c, cpp_batch, c_batch{ordered});
}}
"""

TEST = """\
// {mark}
//
// Every algorithm gives the same bits by its C++ and its C interface.  Compiled once more for test/faults, where memory runs out.
#ifdef KSL_TEST_STARVED
#include "starved_faces.hpp"
#else
#include "faces.hpp"
#endif

{cases}"""


ALGORITHM = """\
struct {name} {{
  static constexpr const ksl::algorithm_row &row = ksl::rows::{name};
  template <class T> using workspace = ksl::{workspace}<T>;
  template <class T>
  static void compute(const ksl::model_view<ksl::scalar_of<T>> &model, const workspace<T> &w,
                      const ksl::state_view<T> &s) {{
    {call}
  }}
}};
"""

EVERY_ALGORITHM = """\
// {mark}
//
// Every algorithm of a tree as a template over any scalar.  Where efforts come with reactions, these are a second result.
#pragma once

#include "engine/kernels/algorithm_rows.hpp"
{includes}

#include <tuple>

namespace algorithms {{

{structs}
using all = std::tuple<{names}>;

}} // namespace algorithms
"""


def every_algorithm() -> str:
    rows = [row for row in COMPUTING if row.loops != "plan"]
    structs = "\n".join(ALGORITHM.format(name=row.name, workspace=workspace(row), call=over_any_scalar(row)) for row in rows)
    includes = "\n".join(f'#include "{name}"' for name in sorted({header(row) for row in rows}))
    names = call("using all = std::tuple<", [row.name for row in rows], "").removeprefix("using all = std::tuple<")
    return EVERY_ALGORITHM.format(mark=MARK, includes=includes, structs=structs, names=names)


def files() -> dict[str, str]:
    """The sources by name, which the build of the tests writes."""
    rows = [row for row in ALGORITHMS if has(row, "c++")]
    cases = [
        CASE.format(name=row.name, scalar=scalar, ordered=", true" if ordered(row) else "", cpp=cpp(row), c=c(row, suffix), c_batch=c_batch(row, suffix))
        for row in rows
        for scalar, suffix in SCALARS.items()
    ]
    return {"algorithms_test.cpp": TEST.format(mark=MARK, cases="\n".join(cases)), "every_algorithm.hpp": every_algorithm()}
