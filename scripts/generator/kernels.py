"""Kernels, a file for what is compiled together; the rows as the library sees them; the tables of the instruction sets."""

from generator.rows import ALGORITHMS, COMPUTING, GROUP_OF, MARK, Algorithm, Result, call, kernels_of, ordered

KERNELS = "src/engine/kernels/algorithms"

EXTENTS = {
    3: "three",
    4: "four",
    5: "five",
    6: "six",
    10: "ten",
    "6 links": "twists",
    **{name: name for name in ("nq", "nv", "motion", "links", "joints", "tree", "all_links", "freedoms")},
}

REQUEST = {
    "links": ["s.links.n", "s.links.index"],
    "link": ["s.links.index[0]"],
    "frame": ["s.links.index[0]", "s.frame"],
    "frames": ["s.links.n", "s.links.index", "s.frame"],
    "relative": ["s.links.index[0]", "s.links.index[1]", "s.frame"],
    "joints": ["*s.joints"],
}


def engine_call(row: Algorithm, function: str, workspace: str = "w") -> str:
    """The call of the engine's function with the members of a state_view."""
    arguments = [f"s.{name}" for name in row.inputs]
    arguments += REQUEST.get(row.request, []) + (["order_of(s.frame)"] if ordered(row) else []) + (["s.external"] if row.external else [])
    arguments += [f"s.result[{i}]" for i in range(len(row.results))]
    return f"{function}(model, {workspace}, {', '.join(arguments)});"


def header(row: Algorithm) -> str:
    """The header that the row names, in the folder of its group unless it says another's: "mass/solve_mass_matrix.hpp"."""
    return f"ksl/engine/algorithms/{row.header if '/' in row.header else f'{GROUP_OF[row.name]}/{row.header}'}"


STEP = """\
  template <class T>
  static void {name}(const model_view<scalar_of<T>> &model, const workspace<T> &w, const state_view<T> &s) {{
    {call}
  }}
"""

KERNEL = """\
struct {name}_algorithm {{
  static constexpr algorithm_row row = {{
{row}  }};
  using form = forms::{form}<{name}_algorithm>;
  template <class T> using workspace = {workspace}<T>;
{steps}}};
"""

UNIT = """\
// {mark}
#include "engine/kernels/forms.hpp"
{includes}

namespace ksl {{
inline namespace KSL_ISA {{

{kernels}
}} // namespace KSL_ISA
}} // namespace ksl

{tables}"""

TOGETHER = {"derivatives": 2}
"""How many kernels of a group are compiled together, where that isn't three.  They share functions: one by one they take half as long again.  More
together are units that take more than 20 s."""

ALONE = ("mass_matrix_inverse",)
"""Kernels with options of the compiler of their own (CMakeLists.txt)."""


def kernel(row: Algorithm) -> str:
    steps = {
        "efforts_and_reactions": {},
        **{form: {"compute": row.name, "elements": row.upper} for form in ("symmetric_matrix", "upper_triangle")},
        "accelerations": {"compute": row.name, "reduce": "reduce_to_root"},
        "sparse_results": {"compute": row.name, "elements": f"elements_of_{row.name}"},
    }.get(row.form, {"compute": row.name})
    text = "".join("\n" + STEP.format(name=name, call=engine_call(row, function)) for name, function in steps.items())
    row_lines = "".join(f"      {line},\n" for line in row_members(row))
    return KERNEL.format(row=row_lines, name=row.name, form=row.form, workspace=workspace(row), steps=text)


def unit(rows: list[Algorithm]) -> str:
    """The text of one file of kernels."""
    headers = sorted({header(row) for row in rows})
    once = ["engine/kernels/compiled_once/closed.hpp"] if any("/loops/" in name for name in headers) else []
    includes = "\n".join(f'#include "{name}"' for name in [*once, *headers])
    tables = "".join(f"KSL_KERNELS({row.name}) = ksl::kernels_of<ksl::{row.name}_algorithm>;\n" for row in rows)
    return UNIT.format(mark=MARK, includes=includes, kernels="\n".join(map(kernel, rows)), tables=tables)


def units() -> dict[str, list[Algorithm]]:
    """{path: the rows of COMPUTING whose kernels are in it}: "mass_2.cpp" for the second few of a group, the algorithm's name where it is alone."""
    out = {}
    for group in sorted({GROUP_OF[row.name] for row in COMPUTING}):
        rows = sorted((row for row in COMPUTING if GROUP_OF[row.name] == group), key=lambda row: row.name)
        together, count = [row for row in rows if row.name not in ALONE], TOGETHER.get(group, 3)
        out |= {f"{KERNELS}/{row.name}.cpp": [row] for row in rows if row.name in ALONE}
        out |= {f"{KERNELS}/{group}_{first // count + 1}.cpp": together[first : first + count] for first in range(0, len(together), count)}
    return out


def result_row(result: Result) -> str:
    extents = ", ".join(f"extent::{EXTENTS[n]}" for n in result.shape)
    return f'{{"{result.name}", {len(result.shape)}, {{{extents}}}}}'


def row_members(row: Algorithm) -> list[str]:
    """Lines of members: name and inputs; what else a call takes and what it demands, where that isn't nothing; results."""
    names = ", ".join(f'"{name}"' for name in row.input_names())
    inputs = [f'.name = "{row.name}"', f".inputs = {len(row.inputs)}", f".input_list = {{{', '.join(f'input::{name}' for name in row.inputs)}}}"]
    takes = [f".external = external_use::{row.external}"] if row.external else []
    takes += [f".request = request_kind::{row.request}"] if row.request else []
    takes += [f".{demand} = true" for demand in ("needs_mass", "nan_without_mass", "smooth_friction") if getattr(row, demand)]
    results = [f".results = {len(row.results)}", f".result = {{{', '.join(map(result_row, row.results))}}}"]
    return [", ".join(members) for members in ([*inputs, f".input_name = {{{names}}}"], takes, results) if members]


def row_text(row: Algorithm) -> str:
    """The row as the library sees it, with its kernels.  Files of kernels include no other rows, so that a new row does not
    recompile all kernels."""
    computed = [f".kernels = &kernel_table::{kernels_of(row).name}"] + ([f".variant_of = &{row.variant_of}"] if row.variant_of else [])
    couplings = [f".mimic = mimic_by::{row.mimic}", f".elements = elements_by::{row.elements}", f".loops = loops_by::{row.loops}"]
    lines = [*row_members(row), ", ".join(computed), ", ".join(couplings)]
    return f"constexpr algorithm_row {row.name} = {{\n" + "".join(f"    {line},\n" for line in lines) + "};\n"


ROWS = """\
// {mark}
#pragma once

#include "engine/kernels/algorithm.hpp"

namespace ksl {{

/// DO(name, set) for the kernels of every algorithm.
#define KSL_EACH_KERNEL(DO, set) \\
{names}

/// The kernels of one instruction set.
struct kernel_table {{
#define KSL_KERNEL_MEMBER(name, set) const algorithm_kernels *name;
  KSL_EACH_KERNEL(KSL_KERNEL_MEMBER, none)
#undef KSL_KERNEL_MEMBER
}};

namespace rows {{

{rows}
constexpr const algorithm_row *all[] = {{
{all}}};

}} // namespace rows
}} // namespace ksl
"""

TABLES = """\
// {mark}
//
// For each instruction set: declarations of what its object files export, and the table made from them.
#pragma once

#include "engine/kernels/algorithm_rows.hpp"

#define KSL_DECLARE_KERNEL(name, set) extern "C" const ksl::algorithm_kernels ksl_kernels_##name##_##set;
#define KSL_DECLARE_KERNELS(set) KSL_EACH_KERNEL(KSL_DECLARE_KERNEL, set)

#define KSL_KERNEL_ENTRY(name, set) .name = &ksl_kernels_##name##_##set,
#define KSL_KERNEL_TABLE(set) {{KSL_EACH_KERNEL(KSL_KERNEL_ENTRY, set)}}
"""


LARGEST = """\
// {mark}
#pragma once

{includes}

#include <algorithm>

namespace ksl {{

/// Size in bytes of the largest workspace that any algorithm needs for one state.
inline std::size_t largest_workspace(const model_view<double> &m) {{
  return std::max({{
{sizes}
  }});
}}

}} // namespace ksl
"""


RECORDED = """\
// {mark}
#include "generate/recorded_rows.hpp"
#include "generate/workspace.hpp"
{includes}

#include <string_view>
#include <utility>

namespace ksl::generate {{

record_row recorder_of(const char *row) {{
  using model_type = model_view<recording>;
  using state_type = state_view<recording>;
  static constexpr std::pair<std::string_view, record_row> recorders[] = {{
{records}  }};
  for (const auto &[name, recorder] : recorders)
    if (name == row)
      return recorder;
  return nullptr;
}}

}} // namespace ksl::generate
"""

RECORD = """\
      {{"{name}",
       [](const model_type &model, const state_type &s) {{
         const empty_workspace<{workspace}<recording>> w(model);
         {call}
       }}}},
"""


def over_any_scalar(row: Algorithm, workspace: str = "w", indent: int = 4) -> str:
    """The call of the engine's function; where efforts come with reactions, these are a second result."""
    if row.request != "reactions":
        return engine_call(row, f"ksl::{row.name}", workspace)
    arguments = [*(f"s.{name}" for name in row.inputs), "s.external", "s.result[0]", *REQUEST["joints"], "s.result[1]"]
    return call(f"{' ' * indent}ksl::inverse_dynamics_with_reactions(", ["model", workspace, *arguments], ");").lstrip()


def recorded_rows() -> str:
    """All algorithms over recordings."""
    rows = COMPUTING
    includes = "\n".join(f'#include "{name}"' for name in sorted({header(row) for row in rows}))
    records = "".join(RECORD.format(name=row.name, workspace=workspace(row), call=over_any_scalar(row, "*w", 9)) for row in rows)
    return RECORDED.format(mark=MARK, includes=includes, records=records)


def workspace(row: Algorithm) -> str:
    return row.workspace or f"{row.name}_workspace"


def files() -> dict[str, str]:
    out = {path: unit(rows) for path, rows in units().items()}
    each = " \\\n".join(f"  DO({row.name}, set)" for row in COMPUTING)
    variants = [row for row in ALGORITHMS if row.variant_of]
    rows = "\n".join(map(row_text, [*COMPUTING, *variants]))
    names = call("    ", [f"&{row.name}" for row in ALGORITHMS], ",\n")
    out["src/engine/kernels/algorithm_rows.hpp"] = ROWS.format(mark=MARK, names=each, rows=rows, all=names)
    out["src/engine/kernels/kernel_tables.hpp"] = TABLES.format(mark=MARK)
    includes = "\n".join(f'#include "{name}"' for name in sorted({header(row) for row in COMPUTING}))
    sizes = "\n".join(f"      workspace_bytes<{workspace(row)}<double>>(m)," for row in COMPUTING)
    out["src/engine/kernels/largest_workspace.hpp"] = LARGEST.format(mark=MARK, includes=includes, sizes=sizes)
    out["src/generate/recorded_rows.cpp"] = recorded_rows()
    return out
