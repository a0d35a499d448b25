// A scalar that counts what is done with it.
#pragma once

#include "ksl/algebra.hpp"

#include <cmath>

struct counting {
  double value = 0;

  static inline int flops, roots, sines, arctangents;
  static void reset() { flops = roots = sines = arctangents = 0; }

  counting() = default;
  explicit counting(double v) : value(v) {}

  friend counting operator+(counting a, counting b) { return flops++, counting(a.value + b.value); }
  friend counting operator-(counting a, counting b) { return flops++, counting(a.value - b.value); }
  friend counting operator*(counting a, counting b) { return flops++, counting(a.value * b.value); }
  friend counting operator/(counting a, counting b) { return flops++, counting(a.value / b.value); }
  friend counting operator-(counting a) { return counting(-a.value); }
  friend bool operator<(counting a, counting b) { return a.value < b.value; }
  friend bool operator>(counting a, counting b) { return a.value > b.value; }
  friend bool operator<=(counting a, counting b) { return a.value <= b.value; }
  friend bool operator==(counting a, counting b) { return a.value == b.value; }
};

template <> struct ksl::math<counting> {
  static inline const counting epsilon{DBL_EPSILON};
  static counting sqrt(counting x) { return counting::roots++, counting(std::sqrt(x.value)); }
  static counting fabs(counting x) { return counting(std::fabs(x.value)); }
  static counting sin(counting x) { return counting::sines++, counting(std::sin(x.value)); }
  static counting cos(counting x) { return counting::sines++, counting(std::cos(x.value)); }
  static void sine_cosine(counting x, counting &sine, counting &cosine) { sine = sin(x), cosine = cos(x); }
  static counting atan2(counting y, counting x) {
    return counting::arctangents++, counting(std::atan2(y.value, x.value));
  }
  static counting select(bool condition, counting a, counting b) { return condition ? a : b; }
};

/// Some numbers, none of them special, into an object made of counting scalars.
template <class X> void fill(X *object, int seed) {
  counting numbers[sizeof(X) / sizeof(counting)];
  for (counting &x : numbers)
    x.value = std::sin(1 + seed + 10 * double(&x - numbers));
  std::memcpy(static_cast<void *>(object), numbers, sizeof numbers);
}
inline void fill(counting (&numbers)[64], int seed) {
  for (counting &x : numbers)
    x.value = std::sin(1 + seed + 10 * double(&x - numbers));
}
