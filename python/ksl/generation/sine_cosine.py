"""The C text of sine and cosine: those of the engine, to the bit (include/ksl/engine/lanes/sine_cosine.hpp, large_angle.hpp).

A libm's sine differs from the engine's in the last bit, and from that of another libm.  In the text `@` stands for the prefix of all names."""

from __future__ import annotations

LARGE = """\
/* Angles beyond 2^18: x = quarters pi/2 + numerator unit, by integers alone (Payne and Hanek 1983).  An angle is an integer m
   times a power of two, and only m 2^e 2/pi mod 4 is needed: the leading bits of 2/pi, up to a place that depends on e, contribute
   multiples of 4 and are left out. */
static const uint64_t @two_over_pi[20] = { /* 64 zero bits, then those of 2/pi */
    UINT64_C(0x0000000000000000), UINT64_C(0xa2f9836e4e441529), UINT64_C(0xfc2757d1f534ddc0), UINT64_C(0xdb6295993c439041),
    UINT64_C(0xfe5163abdebbc561), UINT64_C(0xb7246e3a424dd2e0), UINT64_C(0x06492eea09d1921c), UINT64_C(0xfe1deb1cb129a73e),
    UINT64_C(0xe88235f52ebb4484), UINT64_C(0xe99c7026b45f7e41), UINT64_C(0x3991d639835339f4), UINT64_C(0x9c845f8bbdf9283b),
    UINT64_C(0x1ff897ffde05980f), UINT64_C(0xef2f118b5a0a6d1f), UINT64_C(0x6d367ecf27cb09b7), UINT64_C(0x4f463f669e5fea2d),
    UINT64_C(0x7527bac7ebe5f17b), UINT64_C(0x3d0739f78a5292ea), UINT64_C(0x6bfb5fb11f8d5d08), UINT64_C(0x56033046fc7b6bab)};

static uint64_t @upper_product(uint64_t a, uint64_t b) {
  const uint64_t half = UINT64_C(0xffffffff);
  const uint64_t a0 = a & half, a1 = a >> 32, b0 = b & half, b1 = b >> 32;
  const uint64_t middle = a1 * b0 + (a0 * b0 >> 32), other = a0 * b1 + (middle & half);
  return a1 * b1 + (middle >> 32) + (other >> 32);
}

/* Returns the quarters, -4 ... 4. */
static int @reduce_large(REAL x, int64_t *numerator, REAL *unit) {
  union { REAL number; UINT bits; } of;
  uint64_t m, w[3], low, sum, turn, upper, lower;
  int64_t sign;
  int begin, shift, i, quarters, zeros = 0;
  of.number = x;
  m = (uint64_t)((of.bits & MANTISSA) | LEADING) << TO_53_BITS;
  begin = (int)(of.bits >> EXPONENT_AT & EXPONENT) - BIAS - 2 + 64;
  shift = begin % 64;
  for (i = 0; i < 3; ++i) {
    const uint64_t *const word = @two_over_pi + begin / 64 + i;
    w[i] = shift ? word[0] << shift | word[1] >> (64 - shift) : word[0];
  }
  low = m * w[1];
  sum = low + @upper_product(m, w[2]);
  turn = m * w[0] + @upper_product(m, w[1]) + (uint64_t)(sum < low);
  sign = x < ZERO ? -1 : 1;
  quarters = (int)(turn >> 62) * (int)sign;
  upper = turn << 2 | sum >> 62;
  lower = sum << 2;
  if (upper >> 63) { /* more than half a quarter: round up, the remainder is negative */
    quarters += (int)sign;
    upper = ~upper + (uint64_t)(lower == 0);
    lower = ~lower + 1;
    sign = -sign;
  }
  while (!(upper << zeros >> 63)) /* at least one, since this is less than a half */
    ++zeros;
  *numerator = sign * (int64_t)@upper_product(upper << zeros | lower >> (64 - zeros), UINT64_C(0x6487ed5110b4611a)); /* pi/4 */
  of.bits = (UINT)(ONE_AT - 62 - zeros) << EXPONENT_AT;
  *unit = of.number;
  return quarters;
}
"""

REDUCE = {
    "double": """\
    const double two_over_pi = 6.36619772367581382433e-01, round = 6755399441055744.0; /* 1.5 2^52: adding it rounds to an integer */
    const double k = (x * two_over_pi + round) - round; /* pi/2 in three parts, whose products with k are exact (Cody and Waite 1980) */
    const double a = x - k * 1.57079632673412561417e+00, u = k * 6.07710050630396597660e-11, w = k * 2.02226624879595063154e-21;
    const double b = a - u;
    hi = b - w;
    lo = ((b - hi) - w) + ((a - b) - u);
    quarters = (int)k;
""",
    "float": """\
    const float two_over_pi = 6.36619772367581382433e-01f, round = 12582912.0f; /* 1.5 2^23: adding it rounds to an integer */
    const float nearest = (x * two_over_pi + round) - round, left = @difference(x, nearest, 0x1.921fb6p+0f);
    const float more = (left * two_over_pi + round) - round, k = nearest + more; /* large products round to a neighbour */
    const float a = @difference(left, more, 0x1.921fb6p+0f), p = k * -0x1.777a5cp-25f, rest = @difference(p, k, -0x1.777a5cp-25f);
    float b;
    hi = a - p;
    b = hi - a; /* Knuth (1969): the error of a sum */
    lo = (((a - (hi - b)) - (p + b)) + rest) - k * -0x1.ee59dap-50f;
    quarters = (int)k;
""",
}
IN_SINGLE = """\
/* x - k p, rounded once, if the difference has 53 bits at most.  Both forms have the same bits; the first needs no double.  FP_FAST_FMAF is C's word for it,
   which the libraries of microcontrollers (newlib, picolibc) lack. */
static float @difference(float x, float k, float p) {
#if defined(FP_FAST_FMAF) || defined(__FP_FAST_FMAF) || defined(__ARM_FEATURE_FMA) || defined(__riscv_flen)
  return fmaf(-k, p, x);
#else
  return (float)((double)x - (double)k * (double)p);
#endif
}

/* (int64_t)x of 2^24 <= |x| < 2^63.  Where no instruction does it, libraries of compilers convert by way of double. */
static int64_t @integer(float x) {
  union { float number; uint32_t bits; } of;
  int64_t size;
  of.number = x;
  size = (int64_t)((of.bits & MANTISSA) | LEADING) << ((of.bits >> EXPONENT_AT & EXPONENT) - 150);
  return x < 0.0f ? -size : size;
}

"""
POLYNOMIALS = {
    "double": """\
  zz = z * z;
  sine = (-1.66666666666666324348e-01 + 8.33333333332248946124e-03 * z) +
         zz * ((-1.98412698298579493134e-04 + 2.75573137070700676789e-06 * z) +
               zz * (-2.50507602534068634195e-08 + 1.58969099521155010221e-10 * z));
  cosine = (4.16666666666666019037e-02 + -1.38888888888741095749e-03 * z) +
           zz * ((2.48015872894767294178e-05 + -2.75573143513906633035e-07 * z) +
                 zz * (2.08757232129817482790e-09 + -1.13596475577881948265e-11 * z));
""",
    "float": """\
  zz = z * z;
  sine = (-1.6666654611e-1f + 8.3321608736e-3f * z) + zz * -1.9515295891e-4f;
  cosine = (4.166664568298827e-2f + -1.388731625493765e-3f * z) + zz * 2.443315711809948e-5f;
""",
}
WHOLE = """\
/* Sine and cosine of any angle; NaN for infinities and NaN.  The polynomials are those of K. C. Ng (double) and S. Moshier (float). */
static void @sine_cosine(REAL x, REAL *sine_of_x, REAL *cosine_of_x) {
  REAL hi, lo, z, zz, half_z, v, sine, cosine;
  int quarters; /* x = quarters pi/2 + hi + lo */
  if (FABS(x) <= LIMIT) {
REDUCE  } else if (x - x == ZERO) {
    int64_t numerator;
    REAL unit;
    quarters = @reduce_large(x, &numerator, &unit);
    hi = (REAL)numerator;
    lo = (REAL)(numerator - INTEGER_OF(hi)) * unit;
    hi *= unit;
  } else {
    *sine_of_x = *cosine_of_x = x - x;
    return;
  }
  z = hi * hi;
  half_z = HALF * z;
POLYNOMIALS  sine = hi + (z * hi * sine + (lo - half_z * lo));
  v = UNITY - half_z;
  cosine = v + (((UNITY - v) - half_z) + (zz * cosine - hi * lo));
  if (quarters & 1) {
    z = sine;
    sine = cosine;
    cosine = z;
  }
  *sine_of_x = quarters & 2 ? -sine : sine;
  *cosine_of_x = (quarters + 1) & 2 ? -cosine : cosine;
}
"""
WORDS = {
    "double": {
        "UINT": "uint64_t", "MANTISSA": "UINT64_C(0xfffffffffffff)", "LEADING": "UINT64_C(0x10000000000000)", "<< TO_53_BITS": "", "EXPONENT_AT": "52", "EXPONENT": "0x7ff",
        "ONE_AT": "1023", "BIAS": "1075", "FABS": "fabs", "LIMIT": "262144.0", "ZERO": "0.0", "HALF": "0.5", "UNITY": "1.0", "REAL": "double", "INTEGER_OF(": "(int64_t)(",
    },
    "float": {
        "UINT": "uint32_t", "MANTISSA": "UINT32_C(0x7fffff)", "LEADING": "UINT32_C(0x800000)", "TO_53_BITS": "29", "EXPONENT_AT": "23", "EXPONENT": "0xff",
        "ONE_AT": "127", "BIAS": "179", "FABS": "fabsf", "LIMIT": "262144.0f", "ZERO": "0.0f", "HALF": "0.5f", "UNITY": "1.0f", "REAL": "float", "INTEGER_OF(": "@integer(",
    },
}  # fmt: skip


def sine_cosine(prefix: str, scalar: str) -> str:
    """Definitions of `PREFIXsine_cosine` and what it calls."""
    text = LARGE + "\n" + (IN_SINGLE if scalar == "float" else "") + WHOLE.replace("POLYNOMIALS", POLYNOMIALS[scalar]).replace("REDUCE", REDUCE[scalar])
    text = text.replace("UINT64_C(", "\0(")  # the macro of C, not our word
    for word, meaning in WORDS[scalar].items():
        text = text.replace(word, meaning.replace("UINT64_C(", "\0(").replace("UINT32_C(", "\1("))
    return text.replace("\0(", "UINT64_C(").replace("\1(", "UINT32_C(").replace("@", prefix)
