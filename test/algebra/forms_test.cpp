// Inline C, linked C and C++ template forms of every function give the same bits (all compiled with -ffp-contract=off).
#include <doctest/doctest.h>

#include "forms.h"

#include <array>
#include <cstddef>
#include <cstring>
#include <random>
#include <string>

namespace {

constexpr int max_arguments = 16;

/// Room for any argument: the largest is a joint_space.
constexpr int room = 80;
union storage {
  double d[room];
  float f[room];
  int i[room];
  ptrdiff_t p;
};

struct call {
  storage arguments[max_arguments];
  storage result;

  void run(form *f) {
    void *pointers[max_arguments];
    for (int k = 0; k < max_arguments; k++)
      pointers[k] = &arguments[k];
    f(pointers, &result);
  }
};

/// Arguments from random numbers; equal generators give equal calls.
call make_call(const form_row &row, std::mt19937_64 random) {
  std::uniform_real_distribution<double> real(-2, 2);
  const std::array indices = {1, 2, 7, 5}; // row, column, stride; n of alloc; the four of a vec4i
  std::size_t index = 0;
  call c;
  std::memset(&c, 0, sizeof c);
  std::memset(&c.result, 0xaa, sizeof c.result);
  for (int k = 0; row.arguments[k]; k++) {
    storage &s = c.arguments[k];
    for (int j = 0; j < room; j++) {
      const double x = real(random);
      switch (row.arguments[k]) {
      case 'd': s.d[j] = x; break;
      case 'f': s.f[j] = float(x); break;
      case 'i': s.i[j] = int(x); break;
      }
    }
    if (row.arguments[k] == 'n')
      s.i[0] = indices.at(index++);
    if (row.arguments[k] == 'p')
      s.p = 3;
  }
  return c;
}

bool same(const call &a, const call &b) { return std::memcmp(&a, &b, sizeof a) == 0; }

} // namespace

TEST_CASE("the three forms of every function agree to the bit") {
  int templates = 0;
  std::mt19937_64 random(1);
  for (int k = 0; k < form_count; k++) {
    const form_row &row = form_rows[k];
    CAPTURE(std::string(row.name));
    templates += forms_template[k] != nullptr;
    for (int n = 0; n < 200; n++) {
      random.discard(1);
      const call before = make_call(row, random);
      call linked = before, inlined = before, templated = before;
      linked.run(forms_linked[k]);
      inlined.run(forms_inline[k]);
      REQUIRE(same(linked, inlined));
      if (forms_template[k]) {
        templated.run(forms_template[k]);
        REQUIRE(same(linked, templated));
      }
      // functions that did nothing would agree
      if (n == 0)
        CHECK_FALSE(same(linked, before));
    }
  }
  CHECK(form_count >= 396);
  CHECK(templates >= 2 * 170);
}
