"""Printing, under the address and undefined-behaviour sanitizers: C functions in one program, each run in a process of its own and its standard output compared."""

import subprocess

import pytest

from functions import INCLUDE, ROOT, published
from library import c_compiler

COMPILER = c_compiler("-fsanitize=address,undefined", "-fno-sanitize-recover=all")
FLAGS = ["-std=c11", "-g", "-Wall", "-Wextra", "-Wpedantic", "-Werror", f"-I{INCLUDE}"]

DATA = """
  ksl_vec3_t v = {{{1, -2.5, 3e10}}}; ksl_vec3f_t vf = {{{1, -2.5f, 0.1f}}};
  ksl_SE3_t D = ksl_SE3(1, 2, 3, 10, 4, 5, 6, 11, 7, 8, 9, 12);
  ksl_mat3x3_t R = ksl_mat3x3(1, 2, 3, 4, 5, 6, 7, 8, 9);
  double a[6] = {1, 2, 3, 4, 5, 6}; int i[6] = {1, 2, 3, 4, 5, 6}; bool b[3] = {true, false, true};
  ksl_print_options_t *o = ksl_print_options();
  (void)v; (void)vf; (void)D; (void)R; (void)a; (void)i; (void)b; (void)o;
"""
"""What every function begins with."""

# name: body of the function, what it prints; a delimiter ends each line but the last of a matrix, and ~ stands for the blank before the line break
PRINTED = {
    "lines": ("""
      ksl_vec3_print(stdout, &v);
      ksl_vec3_print(stdout, &v, "v = ");
      ksl_vec3f_print(stdout, &vf);
      ksl_vec4_t w = {{{1, 2, 3, 4}}}; ksl_vec4_print(stdout, &w);
      ksl_vec4f_t wf = {{{1, 2, 3, 4}}}; ksl_vec4f_print(stdout, &wf);
      ksl_quaternion_t q = {{0, 0, 0, 1}}; ksl_quaternion_print(stdout, &q, "q ");
      ksl_quaternionf_t qf = {{0, 0, 0, 1}}; ksl_quaternionf_print(stdout, &qf);
      ksl_screw_t s = {{{1, 2, 3, 4, 5, 6}}}; ksl_screw_print(stdout, &s);
      ksl_screwf_t sf = {{{1, 2, 3, 4, 5, 6}}}; ksl_screwf_print(stdout, &sf);
      ksl_coscrew_t c = {{{1, 2, 3, 4, 5, 6}}}; ksl_coscrew_print(stdout, &c);
      ksl_coscrewf_t cf = {{{1, 2, 3, 4, 5, 6}}}; ksl_coscrewf_print(stdout, &cf, "", o);
      ksl_eulerangles_t e = {{{{0.5, 1, -1}}}, KSL_AXIS_ZYX}; ksl_eulerangles_print(stdout, &e);
      ksl_euleranglesf_t ef = {{{{0.5f, 1, -1}}}, KSL_AXIS_XYZ}; ksl_euleranglesf_print(stdout, &ef);
      e.axis = KSL_AXIS_INVALID; ksl_eulerangles_print(stdout, &e);
      ksl_array_print(stdout, 3, a, "a "); ksl_arrayi_print(stdout, 3, i, "i "); ksl_array_print(stdout, 0, a);
      float af[2] = {0.5f, 2}; ksl_arrayf_print(stdout, 2, af);
    """, """[1, -2.5, 3e+10]
v = [1, -2.5, 3e+10]
[1, -2.5, 0.1]
[1, 2, 3, 4]
[1, 2, 3, 4]
q [0, 0, 0, 1]
[0, 0, 0, 1]
[1, 2, 3, 4, 5, 6]
[1, 2, 3, 4, 5, 6]
[1, 2, 3, 4, 5, 6]
[1, 2, 3, 4, 5, 6]
[0.5, 1, -1, zyx]
[0.5, 1, -1, xyz]
[0.5, 1, -1, invalid]
a [1, 2, 3]
i 1, 2, 3
[]
[0.5, 2]
"""),
    "matrices": ("""
      ksl_mat3x3_print(stdout, &R);
      ksl_mat3x3_print(stdout, &R, "R = ");
      ksl_SE3_print(stdout, &D, "D");
      ksl_print_setRowColumnMajorPrinting(KSL_COLUMN_MAJOR, o);
      ksl_mat3x3_print(stdout, &R, "R = ", o);
      ksl_SE3_print(stdout, &D, "", o);
      ksl_print_setBreakBetweenLinesInMatrix(KSL_NO_BREAK_BETWEEN_LINES);
      ksl_print_setOuterBrackets("<<", ">>");
      ksl_print_setInnerBrackets("", "");
      ksl_print_setDelimiter(" ");
      ksl_mat3x3_print(stdout, &R, "R");
      ksl_print_setBreakBetweenLinesInMatrix(KSL_BREAK_BETWEEN_LINES);
      ksl_mat3x3f_t Rf = ksl_mat3x3f(1, 2, 3, 4, 5, 6, 7, 8, 9); ksl_mat3x3f_print(stdout, &Rf, "R");
      ksl_print_setDefaultOptions();
      ksl_mat4x4_t M = ksl_mat4x4(1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16); ksl_mat4x4_print(stdout, &M);
      ksl_mat4x4f_t Mf = ksl_mat4x4f(1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16); ksl_mat4x4f_print(stdout, &Mf, "", o);
      ksl_SE3f_t Df = ksl_SE3f(1, 2, 3, 10, 4, 5, 6, 11, 7, 8, 9, 12); ksl_SE3f_print(stdout, &Df);
    """, """[[1, 2, 3],~
 [4, 5, 6],~
 [7, 8, 9]]
R = [[1, 2, 3],~
     [4, 5, 6],~
     [7, 8, 9]]
D[[1, 2, 3, 10],~
  [4, 5, 6, 11],~
  [7, 8, 9, 12],~
  [0, 0, 0, 1]]
R = [[1, 4, 7],~
     [2, 5, 8],~
     [3, 6, 9]]
[[1, 4, 7, 0],~
 [2, 5, 8, 0],~
 [3, 6, 9, 0],~
 [10, 11, 12, 1]]
R<<1 2 3 4 5 6 7 8 9>>
R<<1 2 3~
   4 5 6~
   7 8 9>>
[[1, 2, 3, 4],~
 [5, 6, 7, 8],~
 [9, 10, 11, 12],~
 [13, 14, 15, 16]]
[[1, 5, 9, 13],~
 [2, 6, 10, 14],~
 [3, 7, 11, 15],~
 [4, 8, 12, 16]]
[[1, 2, 3, 10],~
 [4, 5, 6, 11],~
 [7, 8, 9, 12],~
 [0, 0, 0, 1]]
"""),
    "arrays and triangles": ("""
      ksl_array2D_print(stdout, 2, 3, a, "A");
      ksl_print_setRowColumnMajorPrinting(KSL_COLUMN_MAJOR, o);
      ksl_array2D_print(stdout, 2, 3, a, "A", o);
      float af[2] = {1, 2}; ksl_array2Df_print(stdout, 2, 1, af);
      ksl_triang_print(stdout, 3, a);
      ksl_triangi_print(stdout, 3, i);
      ksl_triangb_print(stdout, 2, b);
      ksl_print_setBoolean("yes", "%s%n", o);
      ksl_triangb_print(stdout, 2, b, "", o);
      float tf[1] = {7}; ksl_triangf_print(stdout, 1, tf);
    """, """A[[1, 2, 3],~
  [4, 5, 6]]
A[[1, 3, 5],~
  [2, 4, 6]]
[[1],~
 [2]]
[[1, 2, 4],~
 [2, 3, 5],~
 [4, 5, 6]]
[[1, 2, 4],~
 [2, 3, 5],~
 [4, 5, 6]]
[[true, false],~
 [false, true]]
[[yes, %s%n],~
 [%s%n, yes]]
[[7]]
"""),
    "B16 texts are no formats": ("""
      ksl_print_setDelimiter(" %% %s%n%d ");
      ksl_print_setInnerBrackets("%n", "%s");
      ksl_print_setOuterBrackets("{%s", "%n}");
      ksl_print_setBreakBetweenLinesInMatrix(KSL_NO_BREAK_BETWEEN_LINES);
      ksl_vec3_print(stdout, &v, "%s%n ");
      ksl_array_print(stdout, 2, a);
      ksl_array2D_print(stdout, 2, 1, a, "%d");
      ksl_eulerangles_t e = {{{{0, 0, 0}}}, KSL_AXIS_ZYX}; ksl_eulerangles_print(stdout, &e);
    """, """%s%n {%s1 %% %s%n%d -2.5 %% %s%n%d 3e+10%n}
%n1 %% %s%n%d 2%s
%d{%s%n1%s %% %s%n%d %n2%s%n}
{%s0 %% %s%n%d 0 %% %s%n%d 0 %% %s%n%d zyx%n}
"""),
    "B16 macros are statements": ("""
      for (int k = 0; k < 2; k++)
        if (k)
          ksl_vec3_print(stdout, &v, "one ");
        else
          ksl_vec3_debug(stdout, &v, "zero ");
      if (v.x > 0) ksl_print_setDelimiter(";"); else ksl_print_setDelimiter(",");
      v.x > 0 ? ksl_array_print(stdout, 2, a) : ksl_arrayi_print(stdout, 2, i);
      ksl_vec3_print(stdout, &(ksl_vec3_t){{{1, 2, 3}}}, "literal ");
      ksl_vec3_print(stdout, &v, NULL, o);
      ksl_vec3_print(stdout, &v, "label ", NULL);
      ksl_vec3_printWithOptions(stdout, &v, NULL, NULL);
    """, "zero [1, -2.5, 3e+10]\none [1, -2.5, 3e+10]\n[1;2]\nliteral [1;2;3]\n[1, -2.5, 3e+10]\nlabel [1;-2.5;3e+10]\n[1;-2.5;3e+10]\n"),
    "nothing to print or nowhere to": ("""
      ksl_vec3_print(stdout, (ksl_vec3_t *)NULL, "label"); ksl_SE3_print(stdout, (ksl_SE3_t *)NULL); ksl_inertia_print(stdout, (ksl_inertia_t *)NULL);
      ksl_eulerangles_print(stdout, (ksl_eulerangles_t *)NULL); ksl_array_print(stdout, 3, (double *)NULL);
      ksl_vec3_print((FILE *)NULL, &v); ksl_mat3x3_print((FILE *)NULL, &R, "R"); ksl_array2D_print((FILE *)NULL, 2, 3, a);
      ksl_array_print(stdout, -1, a); ksl_array2D_print(stdout, 0, 3, a); ksl_triang_print(stdout, -2, a);
    """, "[]\n[]\n[]\n"),
    "layout of the options": ('printf("%zu", sizeof(ksl_print_options_t));', "908"),
    "numbers that are not finite": ("double x[3] = {NAN, INFINITY, -INFINITY}; ksl_array_print(stdout, 3, x);", "[nan, inf, -inf]\n"),
}  # fmt: skip
PRINTED |= {  # B11, off-diagonal blocks of an inertia [m 1, −m r̃; m r̃, I]: with m r = (2, 3, 4) the element (v_y, ω_z) is +2
    f"B11 {kind}{f}": (f"""ksl_{kind}{f}_t M = {{{{{{1, 2, 3, 4, 11, 12, 13, 14, 15, 16}}}}}};
      ksl_{kind}{f}_print(stdout, &M);
      ksl_print_setRowColumnMajorPrinting(KSL_COLUMN_MAJOR);
      ksl_{kind}{f}_print(stdout, &M);""", """[[1, 0, 0, 0, 4, -3],~
 [0, 1, 0, -4, 0, 2],~
 [0, 0, 1, 3, -2, 0],~
 [0, -4, 3, 11, 14, 16],~
 [4, 0, -2, 14, 12, 15],~
 [-3, 2, 0, 16, 15, 13]]
""" * 2)
    for kind in ("inertia", "spatial_inertia") for f in ("", "f")
}  # fmt: skip
GOOD = {"%.2f": "3.14", "%10.3e": " 3.142e+00", "<%+g>": "<+3.14159>", "%lf": "3.141593", "%5.1f%%": "  3.1%", "%-8gm": "3.14159 m"}
BAD = [
    "",
    "x",
    "%",
    "%d",
    "%s",
    "%n",
    "%*f",
    "%.*f",
    "%f %f",
    "%1$f",
    "%Lf",
    "%f%n",
    "%s%f",
    "%hf",
    "%1000f",
    "%.1000f",
    "%%",
    "%f%",
    "%99999999999f",
    "%llf",
    "%lLf",
    "%-",
    "%l",
]
for how, write in (("by the setter", 'ksl_print_setRealFormat("{}", o);'), ("directly", 'strcpy(o->real_fmt, "{}");')):
    PRINTED[f"B16 formats of numbers that are set {how}"] = (
        "double x[1] = {3.14159265};" + "".join(write.format(f) + 'ksl_array_print(stdout, 1, x, "", o);\n' for f in (*GOOD, *BAD)),
        "".join(f"[{text}]\n" for text in [*GOOD.values(), *["3.14159"] * len(BAD)]))  # fmt: skip
INTEGERS = {"%04d": "0007", "%+i": "+7", "%f": "7", "%s": "7", "%n": "7", "%*d": "7", "%d%d": "7", "%ld": "7", "": "7"}
PRINTED["B16 formats of integers"] = (
    "int x[1] = {7};" + "".join(f'strcpy(o->int_fmt, "{f}"); ksl_arrayi_print(stdout, 1, x, "", o);' for f in INTEGERS),
    "".join(f"{text}\n" for text in INTEGERS.values()),
)
PRINTED["B16 long texts are cut: 100-byte fields hold 99 bytes, and nothing beyond is written or read"] = (
    """
      char text[1001]; memset(text, 'x', 1000); text[1000] = 0;
      ksl_print_setDelimiter(text, o); ksl_print_setRealFormat(text, o); ksl_print_setBoolean(text, text, o);
      ksl_print_setInnerBrackets(text, text, o); ksl_print_setOuterBrackets(text, text, o);
      if (strlen(o->delimiter) != 99 || strlen(o->outer_right_bracket) != 99 || o->line_breaks_in_matrices != KSL_BREAK_BETWEEN_LINES) return 1;
      if (strcmp(o->real_fmt, "%0.6g") || strcmp(o->int_fmt, "%d")) return 2;
      ksl_array_print(stdout, 2, a, "", o);
      ksl_print_options_t *full = ksl_print_options(); /* texts that do not end */
      memset(full, 'y', 900);
      ksl_array_print(stdout, 2, a, "", full);
      ksl_array2D_print(stdout, 2, 2, a, "", full);
      memset(text, 'a', 98); strcpy(text + 98, "\\xc3\\xa9 and more"); /* é would be cut in two */
      ksl_print_setDelimiter(text, o);
      if (strlen(o->delimiter) != 98) return 3;
      ksl_print_setDelimiter(o->delimiter, o);
      if (strlen(o->delimiter) != 98) return 4;
      ksl_print_setDelimiter(NULL, o);
      if (*o->delimiter) return 5;
      ksl_print_setRealFormat(NULL, o);
      ksl_array_print(stdout, 1, a, text, full);
      free(full);
    """,
    "".join(f"{x * 99}1{x * 99}2{x * 99}\n" for x in "xy"),
)


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """Prints what the function prints."""
    folder = tmp_path_factory.mktemp("print")
    functions = "".join(f"static int f{k}(void) {{\n{DATA}\n{body}\nfree(o); return 0; }}\n" for k, (body, _) in enumerate(PRINTED.values()))
    cases = "".join(f"  case {k}: return f{k}();\n" for k in range(len(PRINTED)))
    (folder / "main.c").write_text(
        f"#include <ksl/ksl.h>\n#include <string.h>\n{functions}int main(int n, char **a) {{ switch (atoi(a[n - 1])) {{\n{cases}  }}\n  return 99; }}\n"
    )
    subprocess.run([*COMPILER, *FLAGS, "-Wconversion", "-c", ROOT / "src" / "print.c", "-o", folder / "print.o"], check=True)
    subprocess.run([*COMPILER, *FLAGS, folder / "main.c", folder / "print.o", "-o", folder / "main", "-lm"], check=True)

    def run(name: str) -> str:
        done = subprocess.run([folder / "main", str(list(PRINTED).index(name))], capture_output=True)
        assert done.returncode == 0, done.stderr.decode()
        return done.stdout.decode(errors="surrogateescape")

    return run


@pytest.mark.parametrize("name", PRINTED)
def test_printed(run, name):
    found, expected = run(name).replace(" \n", "~\n"), PRINTED[name][1]
    assert found.startswith(expected) if "long texts" in name else found == expected


def test_debug_is_nothing_without_assertions(tmp_path):
    names = [f.name.removesuffix("_printWithOptions") for f in published() if f.name.endswith("_printWithOptions")]
    assert len(names) == 25
    calls = "\n".join(f"{name}_debug(this, is, not, evaluated);" for name in names)
    (tmp_path / "main.c").write_text(f"#include <ksl/ksl.h>\nint main(void) {{\n{calls}\nreturn 0; }}\n")
    subprocess.run([*COMPILER, *FLAGS, "-DNDEBUG", tmp_path / "main.c", "-o", tmp_path / "main", "-lm"], check=True)
    assert subprocess.run([tmp_path / "main"], capture_output=True, check=True).stdout == b""


def test_every_macro_exists():
    text = subprocess.run(
        ["gcc", "-E", "-dM", f"-I{INCLUDE}", "-x", "c", "-include", "ksl/print.h", "/dev/null"], check=True, capture_output=True, text=True
    ).stdout
    for f in published():
        if f.header == "print.h" and f.name.endswith("_printWithOptions"):
            for verb in ("print", "debug"):
                assert f"#define {f.name.replace('printWithOptions', verb)}(...)" in text
        elif f.header == "print.h" and f.name.endswith("Option"):
            assert f"#define {f.name.removesuffix('Option')}(...)" in text


@pytest.mark.parametrize("compiler", ["g++", "clang++"])
def test_cpp(compiler, tmp_path):
    """The macros compile as C++20 without a warning."""
    (tmp_path / "main.cpp").write_text("""#include <ksl/print.h>
int main() {
  ksl_vec3_t v = {{{1, 2, 3}}};
  if (v.x > 0) ksl_vec3_print(stdout, &v); else ksl_vec3_print(stdout, &v, "v");
  ksl_print_options_t *o = ksl_print_options();
  ksl_print_setDelimiter(";", o);
  ksl_vec3_debug(stdout, &v, "v", o);
}
""")
    subprocess.run(
        [compiler, "-std=c++20", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Werror", f"-I{INCLUDE}", "-fsyntax-only", tmp_path / "main.cpp"],
        check=True,
    )
