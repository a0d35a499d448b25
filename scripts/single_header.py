#!/usr/bin/env python3
"""Write all of the C algebra, double and float, as one header without other files of KSL: build/release/ksl.h.

    scripts/single_header.py [OUTPUT]

Bodies of include/ksl/detail/*.inc appear twice, with the names that detail/names.h gives them; comments are kept.  What
needs a C library (allocation, printing, assert) is left out where there is none: see PROLOGUE."""

import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
INCLUDE = ROOT / "include"

PROLOGUE = """\
/* KSL {version}: spatial algebra in C11 and C++20, double and float, in one file.  Made by scripts/single_header.py.
   {license}

   Everything is static inline: include it where you need it, link with -lm.  Printing alone needs code of its own; one C
   file of the program has these two lines:

     #define KSL_IMPLEMENTATION
     #include "ksl.h"

   Without a C library (-ffreestanding, or KSL_FREESTANDING defined) nothing is included but headers that every compiler
   brings along; allocation and printing are left out, assert does nothing.  The program provides sqrt, sin, cos, atan2,
   their float twins, and memcpy, memset and memmove, which compilers call by themselves: as far as the functions that it
   calls need them. */
#ifndef KSL_KSL_H
#define KSL_KSL_H

#if !defined(KSL_FREESTANDING) && defined(__STDC_HOSTED__) && __STDC_HOSTED__ == 0
#define KSL_FREESTANDING
#endif

#include <float.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#ifndef KSL_FREESTANDING
#include <assert.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#endif
"""

LIBM = """\
/* ---- what the bodies take from a C library ---- */

#ifndef KSL_FREESTANDING

#define KSL_ASSERT(condition) assert(condition)
#define KSL_NAN NAN
static inline double ksl_libm_fabs(double x) { return fabs(x); }
static inline float ksl_libm_fabsf(float x) { return fabsf(x); }
static inline double ksl_libm_floor(double x) { return floor(x); }
static inline float ksl_libm_floorf(float x) { return floorf(x); }
static inline double ksl_libm_fmod(double x, double y) { return fmod(x, y); }
static inline float ksl_libm_fmodf(float x, float y) { return fmodf(x, y); }
static inline double ksl_libm_fma(double a, double b, double c) { return fma(a, b, c); }
static inline float ksl_libm_fmaf(float a, float b, float c) { return fmaf(a, b, c); }

#else

#define KSL_ASSERT(condition) ((void)0)
#define KSL_NAN (__builtin_nanf(""))
KSL_BEGIN_C
double sqrt(double);
double sin(double);
double cos(double);
double atan2(double, double);
float sqrtf(float);
float sinf(float);
float cosf(float);
float atan2f(float, float);
void *memcpy(void *, const void *, size_t);
KSL_END_C

static inline double ksl_libm_fabs(double x) { return __builtin_fabs(x); }
static inline float ksl_libm_fabsf(float x) { return __builtin_fabsf(x); }

/* the largest integer that is not above x */
static inline double ksl_libm_floor(double x) {
  if (!(-4503599627370496.0 < x && x < 4503599627370496.0))
    return x; /* an integer already, or NaN */
  const double whole = (double)(int64_t)x;
  return whole > x ? whole - 1.0 : x == 0.0 ? x : whole;
}
static inline float ksl_libm_floorf(float x) {
  if (!(-8388608.0f < x && x < 8388608.0f))
    return x;
  const float whole = (float)(int32_t)x;
  return whole > x ? whole - 1.0f : x == 0.0f ? x : whole;
}

/* the rest of x / y, exact, with the sign of x; for y > 0, normal, at most half the largest number */
static inline double ksl_libm_fmod(double x, double y) {
  double rest = x < 0.0 ? -x : x, t = y;
  if (!(rest <= DBL_MAX))
    return x - x;
  while (t <= rest * 0.5)
    t *= 2.0;
  for (; t >= y; t *= 0.5)
    rest = rest >= t ? rest - t : rest;
  return x < 0.0 ? -rest : rest;
}
static inline float ksl_libm_fmodf(float x, float y) { return (float)ksl_libm_fmod((double)x, (double)y); }

/* a b + c with the product exact: two halves of each factor, then the sum and its rounding error.  Beyond 2^900 the
   product is rounded. */
static inline double ksl_libm_fma(double a, double b, double c) {
#ifdef __FP_FAST_FMA
  return __builtin_fma(a, b, c);
#else
  const double p = a * b, limit = 0x1p900;
  if (!(-limit < a && a < limit && -limit < b && b < limit && -limit < p && p < limit))
    return p + c;
  const double ka = 134217729.0 * a, kb = 134217729.0 * b;
  const double a1 = ka - (ka - a), a2 = a - a1, b1 = kb - (kb - b), b2 = b - b1;
  const double low = ((a1 * b1 - p) + a1 * b2 + a2 * b1) + a2 * b2;
  const double s = p + c, cc = s - p;
  return s + (((p - (s - cc)) + (c - cc)) + low);
#endif
}
static inline float ksl_libm_fmaf(float a, float b, float c) { return (float)((double)a * (double)b + (double)c); }

#endif
"""

# instead of the values that names.h has: these are defined above
LIBM_NAMES = {"KSL_FABS": "fabs", "KSL_FLOOR": "floor", "KSL_FMOD": "fmod", "KSL_FMA": "fma"}
EVERYWHERE = {"assert": (["x"], "KSL_ASSERT(x)"), "NAN": (None, "KSL_NAN")}

TOKEN = re.compile(r"""/\*.*?\*/|//[^\n]*|"(?:\\.|[^"\\])*"|'(?:\\.|[^'\\])*'|(?<![\w.])[A-Za-z_]\w*|\d[\w.]*|\s+|.""", re.S)
DEFINE = re.compile(r"^#define (\w+)(\(([\w, ]*)\))?[ \t]*(.*)$")


def parse_define(line):
    """name, (parameters or None, body) of a line `#define ...`."""
    m = DEFINE.match(line)
    return m[1], ([p.strip() for p in m[3].split(",")] if m[2] else None, m[4].strip())


def closing(text, start):
    """Where the parenthesis that opens at start closes."""
    depth = 0
    for m in TOKEN.finditer(text, start):
        depth += (m[0] == "(") - (m[0] == ")")
        if depth == 0:
            return m.start()
    raise ValueError(f"no closing parenthesis: {text[start : start + 80]!r}")


def arguments(text):
    """Text between parentheses, split at its outermost commas."""
    out, depth = [""], 0
    for m in TOKEN.finditer(text):
        depth += (m[0] in "([{") - (m[0] in ")]}")
        if m[0] == "," and depth == 0:
            out.append("")
        else:
            out[-1] += m[0]
    return [a.strip() for a in out]


def expand(text, macros):
    """Text after the preprocessor with these macros, comments and white space as they were."""
    out, at = [], 0
    while m := TOKEN.match(text, at):
        at = m.end()
        if m[0] not in macros:
            out.append(m[0])
            continue
        parameters, body = macros[m[0]]
        if parameters is None:
            out.append(expand(body, {k: v for k, v in macros.items() if k != m[0]}))
            continue
        open_ = text.index("(", at)
        end = closing(text, open_)
        values = dict(zip(parameters, arguments(text[open_ + 1 : end]), strict=True))
        pasted = {w for pair in re.findall(r"(\w+)\s*##\s*(?=(\w+))", body) for w in pair}
        values = {p: v if p in pasted else expand(v, macros) for p, v in values.items()}
        result = "".join(values.get(t[0], t[0]) for t in TOKEN.finditer(body))
        result = re.sub(r"\s*##\s*", "", result)
        out.append(result if m[0] in pasted else expand(result, {k: v for k, v in macros.items() if k != m[0]} if m[0] in result else macros))
        at = end + 1
    return "".join(out)


def scalar_macros(scalar):
    """What names.h makes of the names in bodies, for DOUBLE or FLOAT."""
    text = (INCLUDE / "ksl" / "detail" / "names.h").read_text(encoding="utf-8")
    part = re.search(rf"^#(?:el)?if KSL_NAMES == KSL_NAMES_{scalar}\n(.*?)^#el", text, re.S | re.M)[1]
    of_both = re.search(r"^#if KSL_NAMES == KSL_NAMES_DOUBLE \|\| KSL_NAMES == KSL_NAMES_FLOAT\n(.*?)^#endif", text, re.S | re.M)[1]
    macros = dict(parse_define(line) for line in (part + of_both).splitlines() if line.startswith("#define"))
    suffix = "f" if scalar == "FLOAT" else ""
    macros |= {name: (None, f"ksl_libm_{function}{suffix}") for name, function in LIBM_NAMES.items()}
    return macros | EVERYWHERE


def guarded(text):
    """Functions that need a heap, in #ifndef KSL_FREESTANDING."""
    functions = re.compile(r"(?:^/\*\*(?:(?!\*/).)*?\*/\n)?^(?:KSL_INLINE|static inline)[^;{]*?\) \{(?:[^\n]*\}\n|.*?^\}\n)", re.S | re.M)
    heap = re.compile(r"\b(calloc|malloc|free)\(")

    def guard(m):
        code = re.sub(r"/\*.*?\*/", "", m[0], flags=re.S)
        return f"#ifndef KSL_FREESTANDING\n{m[0]}#endif\n" if heap.search(code) else m[0]

    return functions.sub(guard, text)


def without_top_comment(text):
    return re.sub(r"\A/\*(?!\*).*?\*/\n+", "", text, flags=re.S)


class Flattener:
    def __init__(self):
        self.sections = []  # (header, text), in the order in which they must stand
        self.seen = set()

    def header(self, name):
        if name in self.seen:
            return
        self.seen.add(name)
        text = (INCLUDE / name).read_text(encoding="utf-8")
        lines = text.replace("\\\n", "\\\0").splitlines()  # a macro of many lines is one line here
        undefined = {line.split()[1] for line in lines if line.startswith("#undef")}
        out, macros, local, depth, twins = [], {}, {}, 0, set()
        for line in lines:
            line = line.replace("\\\0", "\\\n")
            if m := re.match(r'#include "(ksl/[\w/]+\.(\w+))"', line):
                if m[1].endswith("names.h"):
                    continue
                if m[2] == "h":
                    self.header(m[1])
                    continue
                body = (INCLUDE / m[1]).read_text(encoding="utf-8")
                if m[1] in twins:
                    body = without_top_comment(body)
                twins.add(m[1])
                out.append("\n" + expand(body, macros | local))
            elif line.startswith("#include"):
                continue  # PROLOGUE has them
            elif m := re.match(r"#define KSL_NAMES KSL_NAMES_(\w+)", line):
                macros = scalar_macros(m[1]) if m[1] != "END" else {}
            elif line.startswith("#pragma") and "diagnostic" not in line:
                continue  # no name of the user's is touched any more
            elif (m := re.match(r"#define (\w+)", line)) and depth == 1 and m[1] in undefined:
                defined, value = parse_define(line)
                local[defined] = value
                if out and re.fullmatch(r"/\* .* \*/", out[-1]):
                    out.pop()  # it explains what is expanded now
            elif line.startswith("#undef") and (defined := line.split()[1]) in local | {"element": 0}:
                local.pop(defined, None)
            else:
                if re.match(r"#\s*if", line):
                    depth += 1
                elif re.match(r"#\s*endif", line):
                    depth -= 1
                    if depth == 0:
                        continue
                elif depth == 1 and line.startswith("#ifndef"):
                    continue
                out.append(expand(line, EVERYWHERE))
        text = "\n".join(out) + "\n"
        text = re.sub(r"^#ifndef (KSL_\w+_H)\n#define \1\n", r"#define \1\n", text, count=1, flags=re.M)
        text = re.sub(r"\n{3,}", "\n\n", text)
        if name in ("ksl/print.h", "ksl/memory.h"):
            text = f"#ifndef KSL_FREESTANDING\n{text}#endif\n"
        else:
            text = guarded(text)
        self.sections.append((name, text))


def printing():
    """src/print.c, with its twins, for the one file that has KSL_IMPLEMENTATION."""
    source = ROOT / "src"
    text = (source / "print.c").read_text(encoding="utf-8")
    macros, out, kind = {}, [], {}
    for line in text.splitlines():
        if m := re.match(r"#define KSL_NAMES KSL_NAMES_(\w+)", line):
            macros = scalar_macros(m[1]) if m[1] != "END" else {}
        elif m := re.match(r"#define NUMBER (\w+)", line):
            kind = {"NUMBER": (None, m[1])}
        elif line == '#include "print.inc"':
            out.append(expand(without_top_comment((source / "print.inc").read_text(encoding="utf-8")), macros | kind))
        elif not re.match(r"#include|#undef NUMBER", line):
            out.append(line)
    return re.sub(r"\n{3,}", "\n\n", "\n".join(out) + "\n")


def sections():
    """(header, text) of every header, flattened, each after those that it needs."""
    flattener = Flattener()
    for name in re.findall(r'#include "(ksl/\w+\.h)"', (ROOT / "src" / "ksl.c").read_text(encoding="utf-8")):
        flattener.header(name)
    return [(name, text) for name, text in flattener.sections if name != "ksl/ksl.h"]


def flatten():
    parts = sections()
    version = re.search(r'#define KSL_VERSION "(.*)"', dict(parts)["ksl/config.h"])[1]
    out = [PROLOGUE.format(version=version, license="BSD-3-Clause; the licence stands at the end of this file.")]
    for name, text in parts:
        text = text.replace("Link with libksl:", "KSL_IMPLEMENTATION makes its code:")
        out.append(f"\n/* ======== {name} ======== */\n\n{text}")
        if name == "ksl/config.h":
            out.append("\n" + LIBM)
    out.append("\n#undef KSL_ASSERT\n#undef KSL_NAN\n\n#endif\n")
    wanted = "defined(KSL_IMPLEMENTATION) && !defined(KSL_FREESTANDING) && !defined(KSL_IMPLEMENTED)"
    out.append(f"\n#if {wanted}\n#define KSL_IMPLEMENTED\n\n{printing()}\n#endif\n")
    out.append("\n/*\n" + (ROOT / "LICENSE").read_text(encoding="utf-8").rstrip() + "\n*/\n")
    return "".join(out)


def main(argv):
    output = Path(argv[0]) if argv else ROOT / "build" / "release" / "ksl.h"
    output.parent.mkdir(parents=True, exist_ok=True)
    text = flatten()
    output.write_text(text, encoding="utf-8")
    print(f"{output}: {text.count(chr(10))} lines")


if __name__ == "__main__":
    main(sys.argv[1:])
