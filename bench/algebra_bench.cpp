// Time per item of spatial algebra in double precision, for arrays that fit into the cache: `algebra_bench`.
//
//   hand     the fastest plain C that we could write by hand: restrict pointers, scalars, a loop over the items
//   inline   a loop over the C functions of ksl.h
//            (clang 14 vectorises most of these loops with gathers, which costs up to three times as much with AVX-512:
//            both forms forbid it where that is faster)
//   array    one call of ksl/arrays.h on the same arrays
//   blocks   algebra<native_pack<double>> on data that is stored as packs already
//
// The variants run in turns, so that changes of the processor's speed affect all of them equally.  Figures are medians over
// many turns, and ratios are medians of the ratios within a turn.  At the end, large arrays are compared with memcpy.
#include "ksl/arrays.h"
#include "ksl/dynamics.hpp"
#include "ksl/ksl.h"
#include "ksl/pack.hpp"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <random>
#include <vector>

namespace {

constexpr int items = 128, turns = 61;
using P = ksl::native_pack<double>;
constexpr int W = ksl::native_lanes<double>;
using A = ksl::algebra<P>;

double now() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

double median(std::vector<double> x) {
  std::nth_element(x.begin(), x.begin() + static_cast<std::ptrdiff_t>(x.size() / 2), x.end());
  return x[x.size() / 2];
}

// By hand.  a, b and out are contiguous rows.
#if defined(__clang__)
#define NO_GATHERS _Pragma("clang loop vectorize(disable)")
#else
#define NO_GATHERS
#endif
#define ROWS const double *__restrict a, const double *__restrict b, double *__restrict out

void hand_Ads(ROWS) {
  NO_GATHERS
  for (int i = 0; i < items; i++, a += 12, b += 6, out += 6) {
    const double wx = a[0] * b[3] + a[3] * b[4] + a[6] * b[5], wy = a[1] * b[3] + a[4] * b[4] + a[7] * b[5],
                 wz = a[2] * b[3] + a[5] * b[4] + a[8] * b[5];
    out[0] = a[0] * b[0] + a[3] * b[1] + a[6] * b[2] + (a[10] * wz - a[11] * wy);
    out[1] = a[1] * b[0] + a[4] * b[1] + a[7] * b[2] + (a[11] * wx - a[9] * wz);
    out[2] = a[2] * b[0] + a[5] * b[1] + a[8] * b[2] + (a[9] * wy - a[10] * wx);
    out[3] = wx;
    out[4] = wy;
    out[5] = wz;
  }
}

void hand_Adinvs(ROWS) {
  NO_GATHERS
  for (int i = 0; i < items; i++, a += 12, b += 6, out += 6) {
    const double vx = b[0] - (a[10] * b[5] - a[11] * b[4]), vy = b[1] - (a[11] * b[3] - a[9] * b[5]),
                 vz = b[2] - (a[9] * b[4] - a[10] * b[3]);
    out[0] = a[0] * vx + a[1] * vy + a[2] * vz;
    out[1] = a[3] * vx + a[4] * vy + a[5] * vz;
    out[2] = a[6] * vx + a[7] * vy + a[8] * vz;
    out[3] = a[0] * b[3] + a[1] * b[4] + a[2] * b[5];
    out[4] = a[3] * b[3] + a[4] * b[4] + a[5] * b[5];
    out[5] = a[6] * b[3] + a[7] * b[4] + a[8] * b[5];
  }
}

void hand_CoAdc(ROWS) {
  NO_GATHERS
  for (int i = 0; i < items; i++, a += 12, b += 6, out += 6) {
    const double fx = a[0] * b[0] + a[3] * b[1] + a[6] * b[2], fy = a[1] * b[0] + a[4] * b[1] + a[7] * b[2],
                 fz = a[2] * b[0] + a[5] * b[1] + a[8] * b[2];
    out[3] = a[0] * b[3] + a[3] * b[4] + a[6] * b[5] + (a[10] * fz - a[11] * fy);
    out[4] = a[1] * b[3] + a[4] * b[4] + a[7] * b[5] + (a[11] * fx - a[9] * fz);
    out[5] = a[2] * b[3] + a[5] * b[4] + a[8] * b[5] + (a[9] * fy - a[10] * fx);
    out[0] = fx;
    out[1] = fy;
    out[2] = fz;
  }
}

void hand_CoAdinvc(ROWS) {
  NO_GATHERS
  for (int i = 0; i < items; i++, a += 12, b += 6, out += 6) {
    const double nx = b[3] - (a[10] * b[2] - a[11] * b[1]), ny = b[4] - (a[11] * b[0] - a[9] * b[2]),
                 nz = b[5] - (a[9] * b[1] - a[10] * b[0]);
    out[0] = a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    out[1] = a[3] * b[0] + a[4] * b[1] + a[5] * b[2];
    out[2] = a[6] * b[0] + a[7] * b[1] + a[8] * b[2];
    out[3] = a[0] * nx + a[1] * ny + a[2] * nz;
    out[4] = a[3] * nx + a[4] * ny + a[5] * nz;
    out[5] = a[6] * nx + a[7] * ny + a[8] * nz;
  }
}

void hand_ss(ROWS) {
  for (int i = 0; i < items; i++, a += 6, b += 6, out += 6) {
    out[0] = a[4] * b[2] - a[5] * b[1] + (a[1] * b[5] - a[2] * b[4]);
    out[1] = a[5] * b[0] - a[3] * b[2] + (a[2] * b[3] - a[0] * b[5]);
    out[2] = a[3] * b[1] - a[4] * b[0] + (a[0] * b[4] - a[1] * b[3]);
    out[3] = a[4] * b[5] - a[5] * b[4];
    out[4] = a[5] * b[3] - a[3] * b[5];
    out[5] = a[3] * b[4] - a[4] * b[3];
  }
}

void hand_sc(ROWS) {
  for (int i = 0; i < items; i++, a += 6, b += 6, out += 6) {
    out[0] = a[4] * b[2] - a[5] * b[1];
    out[1] = a[5] * b[0] - a[3] * b[2];
    out[2] = a[3] * b[1] - a[4] * b[0];
    out[3] = a[4] * b[5] - a[5] * b[4] + (a[1] * b[2] - a[2] * b[1]);
    out[4] = a[5] * b[3] - a[3] * b[5] + (a[2] * b[0] - a[0] * b[2]);
    out[5] = a[3] * b[4] - a[4] * b[3] + (a[0] * b[1] - a[1] * b[0]);
  }
}

void hand_dd(ROWS) {
  NO_GATHERS
  for (int i = 0; i < items; i++, a += 12, b += 12, out += 12) {
    for (int c = 0; c < 12; c += 3)
      for (int r = 0; r < 3; r++)
        out[c + r] = a[r] * b[c] + a[3 + r] * b[c + 1] + a[6 + r] * b[c + 2] + (c == 9 ? a[9 + r] : 0.0);
  }
}

/// f = m v + ω × h, τ = I ω + h × v.
void hand_Ms(ROWS) {
  NO_GATHERS
  for (int i = 0; i < items; i++, a += 10, b += 6, out += 6) {
    const double m = a[0], hx = a[1], hy = a[2], hz = a[3], xx = a[4], yy = a[5], zz = a[6], xy = a[7], yz = a[8],
                 zx = a[9];
    out[0] = m * b[0] + (b[4] * hz - b[5] * hy);
    out[1] = m * b[1] + (b[5] * hx - b[3] * hz);
    out[2] = m * b[2] + (b[3] * hy - b[4] * hx);
    out[3] = xx * b[3] + xy * b[4] + zx * b[5] + (hy * b[2] - hz * b[1]);
    out[4] = xy * b[3] + yy * b[4] + yz * b[5] + (hz * b[0] - hx * b[2]);
    out[5] = zx * b[3] + yz * b[4] + zz * b[5] + (hx * b[1] - hy * b[0]);
  }
}

/// One operation in its four forms; a table of them below.
struct operation {
  const char *name;
  int a_columns, b_columns, out_columns;
  void (*hand)(const double *__restrict, const double *__restrict, double *__restrict);
  void (*inlined)(const double *, const double *, double *);
  void (*array)(size_t, const double *, ptrdiff_t, const double *, ptrdiff_t, double *, ptrdiff_t);
  void (*blocks)(const P *, const P *, P *);
};

template <class X, class Y, class Z, void (*f)(const X *, const Y *, Z *)>
void loop(const double *a, const double *b, double *out) {
  const X *x = reinterpret_cast<const X *>(a);
  const Y *y = reinterpret_cast<const Y *>(b);
  Z *z = reinterpret_cast<Z *>(out);
  if constexpr (sizeof(X) + sizeof(Y) == 12 * sizeof(double)) {
    for (int i = 0; i < items; i++)
      f(x + i, y + i, z + i);
  } else {
    NO_GATHERS
    for (int i = 0; i < items; i++)
      f(x + i, y + i, z + i);
  }
}

template <class X, class Y, class Z, void (*f)(const X *, const Y *, Z *)> void block_loop(const P *a, const P *b,
                                                                                           P *out) {
  const X *x = reinterpret_cast<const X *>(a);
  const Y *y = reinterpret_cast<const Y *>(b);
  Z *z = reinterpret_cast<Z *>(out);
  for (int i = 0; i < items / W; i++)
    f(x + i, y + i, z + i);
}

#define OPERATION(label, name, X, Y, Z, hand)                                                                          \
  {label,                                                                                                              \
   sizeof(ksl_##X##_t) / 8,                                                                                            \
   sizeof(ksl_##Y##_t) / 8,                                                                                            \
   sizeof(ksl_##Z##_t) / 8,                                                                                            \
   hand,                                                                                                               \
   loop<ksl_##X##_t, ksl_##Y##_t, ksl_##Z##_t, ksl_##name>,                                                            \
   ksl_array_##name,                                                                                                   \
   block_loop<ksl::X<P>, ksl::Y<P>, ksl::Z<P>, A::name>}

const operation operations[] = {
    OPERATION("Ad s", product_Ads, SE3, screw, screw, hand_Ads),
    OPERATION("Ad^-1 s", product_Adinvs, SE3, screw, screw, hand_Adinvs),
    OPERATION("Ad* c", product_CoAdc, SE3, coscrew, coscrew, hand_CoAdc),
    OPERATION("Ad*^-1 c", product_CoAdinvc, SE3, coscrew, coscrew, hand_CoAdinvc),
    OPERATION("ad s", cross_ss, screw, screw, screw, hand_ss),
    OPERATION("ad* c", cross_sc, screw, coscrew, coscrew, hand_sc),
    OPERATION("D1 D2", product_dd, SE3, SE3, SE3, hand_dd),
    OPERATION("M s", product_Ms, spatial_inertia, screw, coscrew, hand_Ms),
};

std::vector<double> random_numbers(std::size_t n) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> number(-1, 1);
  std::vector<double> x(n);
  for (double &v : x)
    v = number(random);
  return x;
}

void in_cache() {
  const auto count = [](int columns) { return static_cast<std::size_t>(columns * items); };
  std::printf("%d items, medians of %d turns\n%-9s %9s %9s %9s %9s %14s %13s %13s\n", items, turns, "", "hand ns",
              "inline ns", "array ns", "blocks ns", "inline/hand", "array gains", "blocks gain");
  for (const operation &o : operations) {
    const std::vector<double> a = random_numbers(count(o.a_columns)), b = random_numbers(count(o.b_columns));
    std::vector<double> out(count(o.out_columns));
    std::vector<P> pa(count(o.a_columns) / W, P(0.5)), pb(count(o.b_columns) / W, P(0.25)),
        pout(count(o.out_columns) / W);
    std::vector<double> t[4], inline_ratio, array_gain, block_gain;
    const auto run = [&](int variant) {
      switch (variant) {
      case 0: return o.hand(a.data(), b.data(), out.data());
      case 1: return o.inlined(a.data(), b.data(), out.data());
      case 2: return o.array(items, a.data(), o.a_columns, b.data(), o.b_columns, out.data(), o.out_columns);
      default: return o.blocks(pa.data(), pb.data(), pout.data());
      }
    };
    for (int turn = -3; turn < turns; ++turn) {
      double each[4];
      for (int variant = 0; variant < 4; ++variant) {
        each[variant] = 1e9;
        for (int part = 0; part < 3; ++part) { // the best of three, so that an interruption spoils no turn
          constexpr int repeats = 150;
          const double start = now();
          for (int r = 0; r < repeats; ++r) {
            run(variant);
            asm volatile("" ::: "memory");
          }
          each[variant] = std::min(each[variant], (now() - start) / (repeats * items) * 1e9);
        }
      }
      if (turn < 0)
        continue;
      for (int variant = 0; variant < 4; ++variant)
        t[variant].push_back(each[variant]);
      inline_ratio.push_back(each[1] / each[0]);
      array_gain.push_back(std::min(each[0], each[1]) / each[2]);
      block_gain.push_back(std::min(each[0], each[1]) / each[3]);
    }
    std::printf("%-9s %9.2f %9.2f %9.2f %9.2f %14.2f %13.2f %13.2f\n", o.name, median(t[0]), median(t[1]), median(t[2]),
                median(t[3]), median(inline_ratio), median(array_gain), median(block_gain));
  }
  std::printf(
      "inline/hand: mark <= 1; gains are over the faster of hand and inline: marks array >= 1.5, blocks >= 2\n\n");
}

/// Bytes per second that an operation reads and writes, relative to memcpy on as many bytes.
void in_memory(std::size_t n) {
  std::printf("%zu items from memory, medians of 31 turns\n", n);
  const std::vector<double> D = random_numbers(12 * n), c = random_numbers(6 * n);
  std::vector<double> out(6 * n), copy(12 * n);
  std::vector<double> copy_speed, speed, share, inplace_speed, inplace_share;
  for (int turn = -1; turn < 31; ++turn) {
    double start = now();
    std::memcpy(copy.data(), D.data(), 96 * n);
    const double s = 192e-9 * static_cast<double>(n) / (now() - start);
    start = now();
    ksl_array_product_CoAdc(n, D.data(), 12, c.data(), 6, out.data(), 6);
    const double x = 192e-9 * static_cast<double>(n) / (now() - start);
    start = now();
    ksl_array_product_CoAdc(n, D.data(), 12, out.data(), 6, out.data(), 6);
    const double y = 192e-9 * static_cast<double>(n) / (now() - start);
    if (turn < 0)
      continue;
    copy_speed.push_back(s);
    speed.push_back(x);
    share.push_back(x / s);
    inplace_speed.push_back(y);
    inplace_share.push_back(y / s);
  }
  std::printf("memcpy %.1f GB/s; Ad* c %.1f GB/s, %.0f %% of it; in place %.1f GB/s, %.0f %%   (mark: 80 %%)\n",
              median(copy_speed), median(speed), 100 * median(share), median(inplace_speed),
              100 * median(inplace_share));
}

} // namespace

int main(int argc, char **argv) {
  std::printf("compiled with " __VERSION__ " for %d lanes; library kernels: %s\n", W, ksl::instruction_set());
  in_cache();
  in_memory(argc > 1 ? std::strtoull(argv[1], nullptr, 10) : 10'000'000);
}
