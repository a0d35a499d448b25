"""The functions of the algebra, as two sources state them: the rows of api/functions.tsv and the bodies of
include/ksl/detail/*.inc.  Tests and generators share this reading, so that no name can be forgotten."""

import re
from dataclasses import dataclass, field, replace
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
INCLUDE = ROOT / "include"

# how many numbers each type holds
SIZES = {
    "vec3": 3,
    "vec4": 4,
    "quaternion": 4,
    "mat3x3": 9,
    "mat4x4": 16,
    "SE3": 12,
    "screw": 6,
    "coscrew": 6,
    "inertia": 10,
    "spatial_inertia": 10,
    "articulated_inertia": 21,
    "joint_space": 72,
    "motion": 6,
    "force": 6,
    "plucker": 12,
}
INTEGERS = {"vec3i": 3, "vec4i": 4}
# functions of arrays of any length, tables and files: tested in files of their own (linalg_test.py, print_test.py ...),
# left out by everything()
UNSIZED_HEADERS = {"array.h", "linalg.h", "memory.h", "print.h"}
UNSIZED_BODIES = {"array.inc", "linalg.inc"}


@dataclass
class Type:
    """One argument or result: base is a name of SIZES or INTEGERS, real, int, bool, ptrdiff_t, axis_enum or void.  A
    variadic one, "...", is a last pointer of the given type."""

    base: str
    kind: str  # value, pointer, array
    const: bool = False
    scalar: str = ""  # double, float, int
    variadic: bool = False

    def c(self):
        if self.variadic:
            return "..."
        name = {"real": self.scalar}.get(self.base)
        if self.base in INTEGERS or self.base == "axis_enum":
            name = f"ksl_{self.base}_t"
        if self.base in SIZES:
            name = f"ksl_{self.base}{'f' if self.scalar == 'float' else ''}_t"
        return f"{'const ' if self.const else ''}{name or self.base}{' *' if self.kind != 'value' else ''}"

    def numbers(self):
        return SIZES.get(self.base, INTEGERS.get(self.base, 1))


@dataclass
class Function:
    name: str
    returns: Type
    args: list
    header: str = ""
    body: str = ""  # name inside algebra<T>; empty if not for lanes
    doc: str = ""
    double: str = field(default="")  # name of the twin in double precision
    linkable: bool = True  # the published library both declares and defines it
    helper: bool = False  # called by other bodies alone, and no symbol of the library


def c_type(text):
    """A type as api/functions.tsv writes it."""
    text = text.strip()
    const = text.startswith("const ")
    text = text.removeprefix("const ").strip()
    kind = "pointer" if text.endswith("*") else "array" if text.endswith("]") else "value"
    text = re.sub(r"\*|\[\d*\]", "", text).strip()
    if m := re.fullmatch(r"ksl_(\w+?)(f?)_t", text):
        if m[1] in INTEGERS or m[1] == "axis_enum":
            return Type(m[1], kind, const, "int")
        return Type(m[1], kind, const, "float" if m[2] else "double")
    if text in ("double", "float"):
        return Type("real", kind, const, text)
    return Type(text, kind, const, "int")


def in_single(types):
    """Types of a function in double precision, as its twin has them."""
    return re.sub(r"\bdouble\b", "float", re.sub(r"\b(ksl_\w+?)_t\b", r"\1f_t", types))


@dataclass
class Row:
    """A row of api/functions.tsv, column by column: functions of one header, a function and its twin in single precision where both have the same."""

    header: str
    names: list
    returns: str  # as published, in double precision; empty if no published library has it
    args: str
    published: str  # yes, "declared, not defined", "not declared" or no
    symbol: str  # yes or no
    not_finite: tuple  # what NaN, infinities and subnormal numbers give: not_finite_test.py
    golden: tuple  # hashes of results, and functions of the C library in them: test/golden


TABLE = ROOT / "api/functions.tsv"


def rows_of_functions():
    """The rows of api/functions.tsv."""
    for header, names, returns, args, there, symbol, *more in (line.split("\t") for line in TABLE.read_text().splitlines()[1:]):
        yield Row(header, names.split(", "), returns, args, there, symbol, tuple(more[:3]), tuple(more[3:]))


def published():
    """Every function of the published library."""
    out = []
    for row in rows_of_functions():
        for k, name in enumerate(row.names if row.published != "no" else []):
            returns, args = (in_single(x) if k else x for x in (row.returns, row.args))
            texts = [a.strip() for a in args.split(",") if a.strip()]
            linkable = row.published == "yes"
            if row.header in UNSIZED_HEADERS:
                out.append(Function(name, Type(returns, "value"), [Type(a, "value") for a in texts], row.header, linkable=linkable))
                continue
            types = [c_type(a) for a in texts]
            if types and types[-1].base == "...":
                types[-1] = replace(types[-2], const=True, variadic=True)
            out.append(Function(name, c_type(returns), types, row.header, linkable=linkable))
    return out


_BODY = re.compile(r"(/\*\*.*?\*/\n)?^(KSL_FN|KSL_HELPER) ([\w ]+?\*?) ?(KSL|KSL_OF)\(([^)]*)\)\(([^)]*)\) \{", re.S | re.M)


def _body_type(text, scalar):
    """A parameter as a body declares it, with or without its name."""
    m = re.match(r"(const )?(\w+) ?(\*?)\w*(\[\d\])?$", text.strip())
    kind = "pointer" if m[3] else "array" if m[4] else "value"
    if m[2] == "ksl_axis_enum_t":
        return Type("axis_enum", kind, bool(m[1]), "int")
    return Type(m[2], kind, bool(m[1]), scalar)


def includes(path, seen=None):
    """The files under include/ that a file includes, directly or not, and the file itself."""
    seen = {path} if seen is None else seen
    for name in re.findall(r'#include "(ksl/[\w/]+\.\w+)"', path.read_text()):
        if INCLUDE / name not in seen:
            seen.add(INCLUDE / name)
            includes(INCLUDE / name, seen)
    return seen


def emitted_headers():
    """The headers whose functions src/ksl.c emits as symbols."""
    return re.findall(r'#include "(ksl/\w+\.h)"', (ROOT / "src" / "ksl.c").read_text())


def lane_files():
    """The .inc files that algebra.hpp includes, in its order."""
    text = (INCLUDE / "ksl" / "algebra.hpp").read_text()
    return list(re.findall(r'"ksl/detail/(\w+\.inc)"', text))


def _parse(path):
    text = path.read_text()
    found = _BODY.findall(re.sub(r"\n\s+(?=[\w ,*]+[,)])", " ", text))
    assert len(found) == len(re.findall(r"^(?:KSL_FN|KSL_HELPER)", text, re.M)), f"{path.name}: a body that this reading doesn't understand"
    return found


def bodies():
    """Every body of detail/*.inc that src/ksl.c includes, twice: double and float.  All but helpers are symbols."""
    out = []
    lanes = lane_files()
    files = sorted(p for p in includes(ROOT / "src" / "ksl.c") if p.suffix == ".inc" and p.name not in {"types.inc"} | UNSIZED_BODIES)
    assert set(lanes) <= {p.name for p in files}, "algebra.hpp includes bodies that src/ksl.c doesn't emit"
    for path in files:
        for doc, linkage, returns, macro, name, args in _parse(path):
            for scalar, f in (("double", ""), ("float", "f")):
                if macro == "KSL":
                    full, inner, double = f"ksl_{name}{f}", name, f"ksl_{name}"
                else:
                    kind, name_ = (x.strip() for x in name.split(","))
                    full, inner, double = f"ksl_{kind}{f}_{name_}", f"{kind}_{name_}", f"ksl_{kind}_{name_}"
                types = [_body_type(a, scalar) for a in args.split(",") if a.strip() not in ("", "void")]
                out.append(
                    Function(
                        full, _body_type(returns, scalar), types, path.name, inner if path.name in lanes else "", doc, double, helper=linkage == "KSL_HELPER"
                    )
                )
    return out


def everything():
    """name → Function: published rows first, then what the bodies add; bodies lend published rows their body and doc.
    Without the functions of UNSIZED_HEADERS."""
    out = {f.name: f for f in published() if f.header not in UNSIZED_HEADERS}
    for body in bodies():
        if body.name in out:
            out[body.name].body, out[body.name].doc, out[body.name].double = body.body, body.doc, body.double
        else:
            out[body.name] = body
    return out
