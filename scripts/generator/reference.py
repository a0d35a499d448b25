"""The page of all algorithms that the site has: reference/dynamics.md."""

from generator.c_calls import batch_arguments, batches, state_arguments
from generator.rows import ALGORITHMS, DEFAULTS, ORDER, Algorithm, call, has, kernels_of, ordered, sentence, shape

PAGE = """\
# Dynamics

Every algorithm, from C++ (`ksl/dynamics.hpp`, `ksl/batch.hpp`), C (`ksl/engine.h`) and Python (`ksl.Model`). Numbers are SI,
six-vectors linear first unless `order` says otherwise. q has nq numbers; v, a and tau have nv.

* **C++**, one state: `NAME(model, data, inputs…, request…, results…, external)`, S is double or float. Batches: `NAME_batch(model, batch, threads)`;
  `batch_view` has pointers to the rows.
* **C**, one state: `ksl_NAME(model, data, inputs…, external, request…, results…)`. Batches: `ksl_NAME_batch(model, n, …, threads)`, with a
  stride behind each array; where external wrenches are optional, `ksl_NAME_external_batch` takes them. The suffix `f` is
  single precision. (Where reactions are computed beside efforts, the request comes between the two.) Each section below has the
  calls in double precision whole; [KSL in C and C++](../start/embedded.md#inverse-dynamics-and-reactions) shows them at work.
* **Python**: `model.NAME(inputs…, external, …, out, threads)`, any leading shape. `rnea`, `aba` and `crba` are other names of
  `inverse_dynamics`, `forward_dynamics` and `mass_matrix`.

All languages give the same bits; a test compares them with each other.

| algorithm | inputs | results | external wrenches | C++ | C | Python |
|---|---|---|---|---|---|---|
{rows}

{sections}
[Other calls](../reference.md#other-calls) are written by hand, with the same conventions.
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


def page() -> str:
    public = [row for row in ALGORITHMS if row.loops != "plan"]
    return PAGE.format(rows="\n".join(map(table_row, public)), sections="\n".join(map(section, public)))
