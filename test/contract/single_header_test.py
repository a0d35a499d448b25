"""The one-file header: complete, the same numbers as the headers it is made from, without a warning, and without a C library."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "test" / "algebra"))
sys.path.insert(0, str(ROOT / "scripts"))
from functions import bodies, published
from single_header import expand, flatten

WARNINGS = ["-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow", "-Werror"]
EMBEDDED = ROOT / "examples" / "embedded" / "arm_control.c"
TARGETS = {
    "thumbv7em": ["-target", "thumbv7em-none-eabi"],
    "thumbv7em-fpu": ["-target", "thumbv7em-none-eabihf", "-mfpu=fpv4-sp-d16"],
    "riscv32": ["-target", "riscv32-unknown-elf"],
}
MATHEMATICS = {name + f for name in ("sqrt", "sin", "cos", "atan2") for f in ("", "f")}
COPIES = {"memcpy", "memset", "memmove"}  # compilers call them by themselves, C library or not
RUNTIME = re.compile(r"__aeabi_\w+|__\w+([sdt]f|[sd]i)[sdt]?[fi]?\d?")
"""The compiler's own library of arithmetic, for processors that lack it."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("release")
    subprocess.run([sys.executable, ROOT / "scripts" / "single_header.py", folder / "ksl.h"], check=True, capture_output=True)
    (folder / "include.c").write_text('#include "ksl.h"\n#include "ksl.h"\nint included;\n')
    (folder / "implementation.c").write_text('#define KSL_IMPLEMENTATION\n#include "ksl.h"\n')
    (folder / "all.c").write_text('#define KSL_INLINE __attribute__((used)) static inline\n#include "ksl.h"\n')
    return folder


def compile_(*command):
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


def undefined(obj):
    """Symbols that an object asks for.  nm of any machine reads them."""
    return {line.split()[-1] for line in compile_("nm", "-u", obj).splitlines()}


def test_expansion():
    macros = {"KSL": (["name"], "ksl_##name##f"), "vec3": (None, "ksl_vec3f_t"), "SELECT": (["c", "a", "b"], "((c) ? (a) : (b))"), "real": (None, "float")}
    assert expand("vec3 KSL(vec3)(real x) /* real */;", macros) == "ksl_vec3f_t ksl_vec3f(float x) /* real */;"
    assert expand("SELECT(x, (real)1, SELECT(f(y, z), KSL(a)(u, v), 2))", macros) == "((x) ? ((float)1) : (((f(y, z)) ? (ksl_af(u, v)) : (2))))"
    assert expand('"real" realm a.real 1.0e5', macros) == '"real" realm a.real 1.0e5'


def test_nothing_is_missing(folder):
    text = (folder / "ksl.h").read_text()
    names = set(re.findall(r"\b(\w+)\(", re.sub(r"/\*.*?\*/", "", text, flags=re.S)))
    assert {f.name for f in [*published(), *bodies()]} <= names
    assert '#include "' not in re.sub(r"/\*.*?\*/", "", text, flags=re.S)
    assert not re.search(r"\b(KSL_FN|KSL_HELPER|KSL_OF|KSL_NAMES|KSL)\b\(?", re.sub(r"/\*.*?\*/", "", text, flags=re.S))


def inline_functions(text):
    """name → tokens of every inline function in what the preprocessor left."""
    found = {}
    for part in re.split(r"\bstatic inline\b", text)[1:]:
        tokens = re.findall(r"\w+|\S", part)
        depth, end = 0, None
        for i, token in enumerate(tokens):
            depth += (token == "{") - (token == "}")
            if token == "}" and depth == 0:
                end = i + 1
                break
        tokens = [t.removeprefix("ksl_libm_") for t in tokens[:end]]
        found[tokens[tokens.index("(") - 1]] = tokens
    return found


def test_the_same_functions_token_for_token(folder):
    """What a compiler sees is what it sees in the headers that this one is made from."""
    (folder / "many.c").write_text("#include <ksl/ksl.h>\n#include <ksl/memory.h>\n#include <ksl/trig.h>\n")
    many, one = (inline_functions(compile_("gcc", "-std=c11", "-DNDEBUG", "-E", "-P", "-I", ROOT / "include", folder / f)) for f in ("many.c", "include.c"))
    assert len(many) > 1000 and many.keys() <= one.keys()
    assert [name for name in many if many[name] != one[name]] == []
    assert one.keys() - many.keys() == {name + f for name in ("fabs", "floor", "fmod", "fma") for f in ("", "f")}


COMPILERS = [
    "gcc -std=c99",
    "clang -std=c99",
    "gcc -std=c99 -fshort-enums",
    "gcc -std=c11",
    "gcc -std=c17",
    "clang -std=c11",
    "clang -std=c17",
    "g++ -std=c++20 -x c++",
    "clang++ -std=c++20 -x c++",
]


@pytest.mark.parametrize("compiler", COMPILERS)
def test_no_warning(folder, compiler):
    compile_(*compiler.split(), *WARNINGS, "-fsyntax-only", folder / "include.c")
    if "++" not in compiler:
        compile_(*compiler.split(), *WARNINGS, "-fsyntax-only", folder / "implementation.c")


@pytest.mark.parametrize("compiler", ["gcc -std=c99", "gcc -std=c11 -fshort-enums", "clang -std=c99"])
def test_no_warning_of_the_headers(folder, compiler):
    """In C99, and where enumerations have one byte, as compilers for microcontrollers have them."""
    (folder / "headers.c").write_text("".join(f"#include <ksl/{name}.h>\n" for name in ("ksl", "engine", "arrays", "memory", "trig", "print")))
    for source in (folder / "headers.c", ROOT / "src/ksl.c", ROOT / "src/print.c"):
        quiet = ["-Wno-static-in-inline"] if "clang" in compiler else []  # as cmake/warnings.txt: a helper is static, and the same everywhere
        compile_(*compiler.split(), *WARNINGS, *quiet, "-fsyntax-only", "-I", ROOT / "include", source)


@pytest.mark.parametrize("target", ["thumbv7em", "riscv32"])
def test_no_c_library(folder, target):
    """Every function at once asks for the mathematics that is documented, and for nothing else."""
    obj = folder / f"{target}.o"
    compile_("clang", *TARGETS[target], "-std=c11", "-ffreestanding", "-O0", *WARNINGS, "-c", folder / "all.c", "-o", obj)
    asked = undefined(obj)
    assert MATHEMATICS <= asked
    assert {name for name in asked - MATHEMATICS - COPIES if not RUNTIME.fullmatch(name)} == set()


@pytest.mark.parametrize("target", TARGETS)
def test_embedded_example(folder, target):
    obj = folder / f"example_{target}.o"
    compile_("clang", *TARGETS[target], "-std=c11", "-ffreestanding", "-O2", *WARNINGS, "-I", folder, "-c", EMBEDDED, "-o", obj)
    asked = {name for name in undefined(obj) if not RUNTIME.fullmatch(name)}
    assert asked == {"sinf", "cosf"}


def test_embedded_example_on_a_pc(folder):
    compile_("gcc", "-std=c11", *WARNINGS, "-I", folder, EMBEDDED, "-lm", "-o", folder / "arm_control")
    # 2 kg · 9.81 m/s² at 0.9, 0.5, 0.2 m; then 5 N more
    assert compile_(folder / "arm_control") == "holding   17.658 9.810 3.924 N m\npressing  22.158 12.310 4.924 N m\n"


COMPARED = {"floor": 1, "fmod": 2, "fma": 3, "fabs": 1}


def test_mathematics_of_its_own(folder):
    """Without a C library, floor, fmod and fabs are exact and fma is within an ULP of it."""
    (folder / "own.c").write_text(
        '#define KSL_FREESTANDING\n#include "ksl.h"\n'
        + "".join(
            f"{t} own_{n}{s}({', '.join(f'{t} x{i}' for i in range(k))});\n{t} own_{n}{s}({', '.join(f'{t} x{i}' for i in range(k))}) "
            f"{{ return ksl_libm_{n}{s}({', '.join(f'x{i}' for i in range(k))}); }}\n"
            for n, k in COMPARED.items()
            for t, s in (("double", ""), ("float", "f"))
        )
    )
    checks = []
    for t, s in (("double", ""), ("float", "f")):
        for n, k in COMPARED.items():
            a = ["x", "m", "z"][:k] if n != "fma" else ["x", "y", "z"]
            args = ", ".join(f"({t}){v}" for v in a)
            tolerance = f"({t}){'2.3e-16' if t == 'double' else '1.2e-7'} * fabs{s}(expected)" if n == "fma" else f"({t})0"
            checks.append(f"{t} own_{n}{s}({', '.join([t] * k)});")
            wrong = f"!(fabs{s}(got - expected) <= {tolerance}) && expected - expected == 0"
            report = f'printf("{n}{s} %.17g %.17g %.17g: %.17g %.17g\\n", x, y, z, (double)got, (double)expected)'
            checks.append((n + s, f"  {{ {t} expected = {n}{s}({args}), got = own_{n}{s}({args}); if ({wrong}) {{ {report}; return 1; }} }}"))
    (folder / "compare.c").write_text(
        "#include <math.h>\n#include <stdint.h>\n#include <stdio.h>\n"
        + "\n".join(c for c in checks if isinstance(c, str))
        + """
static double number(uint64_t *s, int range) {
  *s = *s * 6364136223846793005u + 1442695040888963407u;
  const double x = (double)(int64_t)*s / 9.3e18;
  return ldexp(x, (int)(*s >> 33) % range - range / 2);
}
int main(void) {
  uint64_t s = 1;
  for (int i = 0; i < 200000; i++) {
    const double x = i % 100 ? (double)(i % 2 ? number(&s, 80) : floor(number(&s, 60))) : 0.0;
    const double y = number(&s, 40), z = i % 3 ? number(&s, 60) : -x * y * (1 + number(&s, 20)), m = i % 2 ? 360.0 : 6.2831853071795862;
"""
        + "\n".join(c[1] for c in checks if not isinstance(c, str))
        + "\n  }\n  return 0;\n}\n"
    )
    compile_("gcc", "-std=c11", "-O2", "-ffp-contract=off", folder / "own.c", folder / "compare.c", "-lm", "-o", folder / "compare")
    compile_(folder / "compare")


def test_the_script_and_the_module_agree(folder):
    assert (folder / "ksl.h").read_text() == flatten()
