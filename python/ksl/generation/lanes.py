"""Steps in lanes: each number is a vector of as many states, of the vector types that gcc and clang have in C.

A vector's arithmetic is that of its numbers one by one, so that results have the bits of the functions for one state.
"""

from __future__ import annotations

from itertools import islice

from ksl.generation.c99 import FUNCTIONS, Printer
from ksl.generation.recording import Operation, Recording

STRAIGHT, PART = 3000, 2500
"""So many statements are one function, and so many a part has at most: their code stays in a processor's inner cache.  With 1,000 or 4,000 Talos' inverse dynamics
takes 10 to 20 % longer, as one function 16 %."""
BLOCKS = 8
"""So many blocks of lanes each part computes before the next one does."""
HEAD = """\
/* LANES states at a time, each of which is computed as one state is. */
#if defined(__GNUC__)
#pragma GCC diagnostic ignored "-Wpsabi" /* vectors are handed on inside this file alone */
#endif
typedef REAL @lanes __attribute__((vector_size(LANES * sizeof(REAL)), aligned(LANES * sizeof(REAL))));
typedef WORD @mask __attribute__((vector_size(sizeof(@lanes)), aligned(sizeof(@lanes)))); /* -1 where a condition holds, and 0 */

#define @all(number) ((@lanes){SAME})

"""
PIECES = {
    "select": """\
static inline @lanes @select(@mask c, @lanes a, @lanes b) {
  return (@lanes)((c & (@mask)a) | (~c & (@mask)b));
}

""",
    "absolute": """\
static inline @lanes @absolute(@lanes x) {
  return (@lanes)((@mask)x & ~(@mask)@all(-ZERO));
}

""",
    "root": """\
static inline @lanes @root(@lanes x) {
  @lanes y;
  int k;
  for (k = 0; k < LANES; ++k)
    y[k] = SQRT(x[k]);
  return y;
}

""",
    "arctangent": """\
static inline @lanes @arctangent(@lanes y, @lanes x) {
  int k;
  for (k = 0; k < LANES; ++k)
    y[k] = ATAN2(y[k], x[k]);
  return y;
}

""",
    "holds": """\
/* Does a condition hold in all lanes? */
static inline int @holds(@mask c) {
  WORD all = -1;
  int k;
  for (k = 0; k < LANES; ++k)
    all &= c[k];
  return all != 0;
}

""",
}
"""What steps call besides sine and cosine.  In the text `@` stands for the prefix of all names."""

REDUCE = {
    "double": """\
  const @lanes shifted = x * 6.36619772367581382433e-01 + 6755399441055744.0; /* 1.5 2^52 + k: the lowest bits are those of k */
  const @lanes k = shifted - 6755399441055744.0;
  const @mask quarters = (@mask)shifted;
  const @lanes a = x - k * 1.57079632673412561417e+00, u = k * 6.07710050630396597660e-11, w = k * 2.02226624879595063154e-21;
  const @lanes b = a - u, hi = b - w, lo = ((b - hi) - w) + ((a - b) - u);
""",
    "float": """\
  const float two_over_pi = 6.36619772367581382433e-01f, round = 12582912.0f;
  const @lanes nearest = (x * two_over_pi + round) - round, left = @difference(x, nearest, @all(0x1.921fb6p+0f));
  const @lanes more = (left * two_over_pi + round) - round, k = nearest + more;
  const @mask quarters = (@mask)(k + round); /* 1.5 2^23 + k: the lowest bits are those of k */
  const @lanes a = @difference(left, more, @all(0x1.921fb6p+0f)), p = k * -0x1.777a5cp-25f, rest = @difference(p, k, @all(-0x1.777a5cp-25f));
  const @lanes hi = a - p, b = hi - a, lo = (((a - (hi - b)) - (p + b)) + rest) - k * -0x1.ee59dap-50f;
""",
}
"""Sine and cosine as for one state (sine_cosine.py), but that quarters of a turn are read from the bits of a sum: to make a whole number takes more steps."""
DIFFERENCE = """\
/* x - k p, rounded once. */
static inline @lanes @difference(@lanes x, @lanes k, @lanes p) {
  typedef double wide __attribute__((vector_size(2 * sizeof(@lanes))));
  return __builtin_convertvector(__builtin_convertvector(x, wide) - __builtin_convertvector(k, wide) * __builtin_convertvector(p, wide), @lanes);
}

"""
POLYNOMIALS = {
    "double": """\
  const @lanes sine = (-1.66666666666666324348e-01 + 8.33333333332248946124e-03 * z) +
                      zz * ((-1.98412698298579493134e-04 + 2.75573137070700676789e-06 * z) +
                            zz * (-2.50507602534068634195e-08 + 1.58969099521155010221e-10 * z));
  const @lanes cosine = (4.16666666666666019037e-02 + -1.38888888888741095749e-03 * z) +
                        zz * ((2.48015872894767294178e-05 + -2.75573143513906633035e-07 * z) +
                              zz * (2.08757232129817482790e-09 + -1.13596475577881948265e-11 * z));
""",
    "float": """\
  const @lanes sine = (-1.6666654611e-1f + 8.3321608736e-3f * z) + zz * -1.9515295891e-4f;
  const @lanes cosine = (4.166664568298827e-2f + -1.388731625493765e-3f * z) + zz * 2.443315711809948e-5f;
""",
}
SINE_COSINE = """\
/* One by one where an angle is large. */
static void @sine_cosine(const @lanes *angle, @lanes *sine_of_x, @lanes *cosine_of_x) {
  const @lanes x = *angle;
REDUCE  const @lanes z = hi * hi, zz = z * z, half_z = HALF * z;
POLYNOMIALS  const @lanes s = hi + (z * hi * sine + (lo - half_z * lo)), v = UNITY - half_z;
  const @lanes c = v + (((UNITY - v) - half_z) + (zz * cosine - hi * lo));
  const @mask odd = -(quarters & 1);
  if (!@holds(@absolute(x) <= @all(LIMIT))) {
    int k;
    for (k = 0; k < LANES; ++k) {
      REAL one, other;
      SCALAR(x[k], &one, &other);
      (*sine_of_x)[k] = one;
      (*cosine_of_x)[k] = other;
    }
    return;
  }
  *sine_of_x = (@lanes)((@mask)@select(odd, c, s) ^ (quarters & 2) << SIGN);
  *cosine_of_x = (@lanes)((@mask)@select(odd, s, c) ^ ((quarters + 1) & 2) << SIGN);
}

"""
WORDS = {
    "double": {
        "WORD": "int64_t",
        "ZERO": "0.0",
        "SQRT": "sqrt",
        "ATAN2": "atan2",
        "HALF": "0.5",
        "UNITY": "1.0",
        "LIMIT": "262144.0",
        "SIGN": "62",
        "REAL": "double",
    },
    "float": {
        "WORD": "int32_t",
        "ZERO": "0.0f",
        "SQRT": "sqrtf",
        "ATAN2": "atan2f",
        "HALF": "0.5f",
        "UNITY": "1.0f",
        "LIMIT": "262144.0f",
        "SIGN": "30",
        "REAL": "float",
    },
}


def support(prefix: str, scalar: str, lanes: int, used: set[Operation], judged: bool, sine_of_one: str) -> str:
    """Types, and definitions of what is called: by steps with these operations, and where results are judged.  sine_of_one: the function for one angle."""
    trigonometric = bool(used & {Operation.SINE, Operation.COSINE})
    calls = {"select": trigonometric or Operation.SELECT in used, "absolute": trigonometric or judged or Operation.ABSOLUTE in used}
    calls |= {"root": Operation.ROOT in used, "arctangent": Operation.ARCTANGENT in used, "holds": trigonometric or judged}
    text = HEAD + "".join(piece for name, piece in PIECES.items() if calls[name])
    if trigonometric:
        text += (DIFFERENCE if scalar == "float" else "") + SINE_COSINE.replace("POLYNOMIALS", POLYNOMIALS[scalar]).replace("REDUCE", REDUCE[scalar])
    for word, meaning in WORDS[scalar].items():
        text = text.replace(word, meaning)
    text = text.replace("SAME", ", ".join(["number"] * lanes)).replace("LANES", str(lanes)).replace("SCALAR", sine_of_one)
    return text.replace("static inline", "static inline __attribute__((always_inline))").replace("@", prefix)  # vectors are then handed on by no call


class LanesPrinter(Printer):
    """Prints one function in lanes, of arrays of `PREFIXlanes`.

    A result that has a number several times, zeros of a matrix or both of its triangles, has it once in lanes.  columns: which number each column of a result is."""

    def __init__(self, of: Recording, prefix: str) -> None:
        super().__init__(of, prefix)
        self.real, self.condition, self.sine_cosine = f"{prefix}lanes", f"{prefix}mask", f"{prefix}sine_cosine"
        self.columns: list[list[int]] = []
        self.blocks = 1
        """So many blocks of lanes are handed to the function at most."""
        self.written = {}
        steps = iter(of.outputs.tolist())
        for (name, _), size in zip(of.results, of.sizes()):
            seen: dict[int, int] = {}
            self.columns.append([seen.setdefault(step, len(seen)) for step in islice(steps, size)])
            for step, place in seen.items():
                self.written.setdefault(step, []).append(f"{name}[{place}]")
        self.straight, self.part, self.storage, self.maybe_unread, self.kept = STRAIGHT, PART, "static ", ("w", "blocks"), 0
        self.sizes = {**dict(of.inputs), **{name: len(set(columns)) for (name, _), columns in zip(of.results, self.columns)}}
        """Numbers in lanes of each array; of w when the text is made."""

    def parameters(self) -> str:
        """With memory for what parts keep for others."""
        return f"{super().parameters()}, {self.real} *w, int blocks"

    def workspace(self, numbers: int) -> str:
        self.kept, self.blocks = numbers, BLOCKS
        return f"  const int kept = {numbers};\n  int b;\n"

    def call_of_part(self, name: str, pointers: list[str]) -> str:
        """Each part computes all blocks before the next: its code stays in the inner cache meanwhile."""
        places = ", ".join(f"{x} + b * {'kept' if x == 'w' else self.sizes[x]}" for x in pointers)
        return f"  for (b = 0; b < blocks; ++b)\n    {name}({places});\n"

    def angle(self, step: int) -> str:
        return f"&{super().angle(step)}"

    def constant(self, step: int) -> str:
        return self.all(self.of.numbers[step])

    def all(self, number: float) -> str:
        return f"{self.prefix}all({self.literal(number)})"

    def selected(self, condition: str, a: str, b: str) -> str:
        return f"{self.prefix}select({condition}, {a}, {b})"

    def kept_condition(self, number: str) -> str:
        return f"{number} != {self.all(0)}"

    def number_of_condition(self, condition: str) -> str:
        return self.selected(condition, self.all(1), self.all(0))

    def called(self, what: Operation, operands: list[str]) -> str:
        name = {"sqrt": "root", "fabs": "absolute", "atan2": "arctangent"}[FUNCTIONS[what]]
        return f"{self.prefix}{name}({', '.join(operands)})"
