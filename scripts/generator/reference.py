"""The reference page of all algorithms: docs/reference/dynamics.md."""

from generator.c_calls import batch_arguments, batches, state_arguments
from generator.rows import ALGORITHMS, DEFAULTS, MARK, ORDER, Algorithm, call, has, kernels_of, ordered, sentence, shape

PAGE = """\
# Dynamics

<!-- {mark} -->

Every algorithm, from C++ (`ksl/dynamics.hpp`, `ksl/batch.hpp`), C (`ksl/engine.h`) and Python (`ksl.Model`). Numbers are SI,
six-vectors linear first unless `order` says otherwise. q has nq numbers; v, a and tau have nv.

* **C++**, one state: `NAME(model, data, inputs…, request…, results…, external)`, S is double or float. Batches: `NAME_batch(model, batch, threads)`;
  `batch_view` has pointers to the rows.
* **C**, one state: `ksl_NAME(model, data, inputs…, external, request…, results…)`. Batches: `ksl_NAME_batch(model, n, …, threads)`, with a
  stride behind each array; where external wrenches are optional, `ksl_NAME_external_batch` takes them. The suffix `f` is
  single precision. (Where reactions are computed beside efforts, the request comes between the two.) Each section below has the
  calls in double precision whole; [From C](../c.md) shows them at work.
* **Python**: `model.NAME(inputs…, external, …, out, threads)`, any leading shape. `rnea`, `aba` and `crba` are other names of
  `inverse_dynamics`, `forward_dynamics` and `mass_matrix`.

All languages give the same bits; a test compares them with each other.

| algorithm | inputs | results | external wrenches | C++ | C | Python |
|---|---|---|---|---|---|---|
{rows}

{sections}
## Other calls

Written by hand, with the same conventions. C has those with the suffix `f`, too, where numbers of a state enter.

| what | C++ | C | Python |
|---|---|---|---|
| models | `ksl/dynamics.hpp`, `builder.hpp`, `surgery.hpp`, `urdf.hpp` | `ksl/engine.h`, `engine_building.h` | `ksl.load`, `ksl.Builder`, `Model.with_…` |
| reactions of the state that inverse dynamics computed last | `reactions` | `ksl_reactions` | |
| pose of one link | `frame_pose` | `ksl_frame_pose` | `frame_pose` |
| neutral, random position | `neutral`, `random_position` | `ksl_neutral`, `ksl_random_position` | `neutral`, `random` |
| inverse kinematics | `inverse_kinematics` | `ksl_inverse_kinematics` | `inverse_kinematics` |
| wrench through a section of a link | `section_wrench` (`ksl/section.hpp`), one state | `ksl_section_wrench`, one state | `section_wrench` |
| closed mechanisms: geometry, consistent motions, derivatives, what reactions leave open | `ksl/loops.hpp` | `ksl/engine_loops.h` | `mobility`, `close`, `consistent_velocity` … ([loops.md](../loops.md)) |
| motion over time: methods, controllers, brakes, limits, events | `ksl/simulate.hpp` | `ksl/engine_simulate.h` | `simulate` ([simulation.md](../simulation.md)) |
| layout of tree-sparse matrices | `model::tree_rows`, `tree_columns` | `ksl_model_tree` | `tree_rows`, `tree_columns` |
| one part of the efforts | `effort_parts` | `ksl_effort_parts` | `effort_part` |
| joints: kind, indices, axes, limits | `model::joints`, `description` | `ksl_model_joint_info` | `joints`, `joint` |
| inertial parameters of links | `model::links` | `ksl_model_link_parameters` | `parameters`, `link` |
| joints on the way to the root, links carried | `model::support`, `subtree_links` | `ksl_model_support`, `ksl_model_subtree_links` | `support`, `subtree_links` |

Quaternions that differ from unit length by more than 1e-6 are normalised: Python warns (`ksl.QuaternionWarning`), and in C
`ksl_warning_message` says so after a call for one state. Beyond 1e-2 they are refused. C++ and batches in C check no numbers.

In Python only: MJCF files (`ksl.mjcf`), identification, base parameters and the consistency of inertial parameters
([identification](../identification.md)), tables of loads and reports ([loads](../loads.md)).
"""

SECTION = """\
## {name}

{text}
"""


def mark_of(row: Algorithm, face: str) -> str:
    one, batch = has(row, face) and face in row.faces, has(row, f"{face} batch")
    return "one, batch" if one else "batch" if batch else ""


def table_row(row: Algorithm) -> str:
    results = [f"{r.name}{shape(r)}" for r in row.results] + (["wrenches (joints, 6)"] if row.request == "reactions" else [])
    external = row.external or "none"
    faces = f"{mark_of(row, 'c++')} | {mark_of(row, 'c')} | {'yes' if has(row, 'python') else ''}"
    inputs = [*row.input_names(), *(["external"] if row.external else [])]
    return f"| [{row.name}](#{row.name}) | {', '.join(inputs)} | {', '.join(results)} | {external} | {faces} |"


def c_signatures(row: Algorithm) -> str:
    """The calls from C in double precision, as ksl/engine_calls.h declares them."""
    calls = [call(f"ksl_status_t ksl_{row.name}(", state_arguments(row, "double"), ");")] if has(row, "c") and "c" in row.faces else []
    calls += [call(f"ksl_status_t {name}(", batch_arguments(row, "double", external), ");") for name, external in batches(row)] if has(row, "c batch") else []
    return "```c\n" + "\n".join(calls) + "\n```" if calls else ""


def section(row: Algorithm) -> str:
    lines = [sentence(row).replace(".  ", ". ")]
    request = {
        "links": "Request: links, by index or name.",
        "link": "Request: one link.",
        "frame": "Request: one link's frame. `axes` and `at` give the axes and the origin of its motion, `order` the order of the six numbers.",
        "frames": "Request: links' frames. `axes` and `at` give the axes and the origin of their motion, `order` the order of the six numbers.",
        "relative": "Request: a link's frame, and the link that it is seen from. `axes` and `at` give the axes and the origin of its motion, `order` the order of the six numbers.",
        "joints": "Request: joints. Part, side, point, axes and order of their wrenches are options.",
        "reactions": "Request: joints. Part, side, point, axes and order of the wrenches are options.",
    }.get(row.request, "")
    lines += [request] if request else []
    lines += [f"`order` is that of the six numbers, by default {ORDER}."] if ordered(row) else []
    for keyword, rows in row.choices.items():
        values = ", ".join(f'`"{value}"`: [{name}](#{name})' for value, name in rows.items())
        lines += [f"In Python, `{keyword}` chooses: {values}."]
    lines += [f"By default: {DEFAULTS[row.request]}."] if row.request in DEFAULTS else []
    lines += [f"Computed by `{kernels_of(row).name}`."] if row.variant_of else []
    lines += [f"`{r.name}`{shape(r)}: {r.text}." for r in row.results]
    return SECTION.format(name=row.name, text="\n\n".join(filter(None, [*lines, c_signatures(row)])))


def files() -> dict[str, str]:
    public = [row for row in ALGORITHMS if row.loops != "plan"]
    page = PAGE.format(mark=MARK, rows="\n".join(map(table_row, public)), sections="\n".join(map(section, public)))
    return {"docs/reference/dynamics.md": page}
