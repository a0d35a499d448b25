// What only C can pass to functions of the algebra: null pointers, and sizes that are none; and arrays on the heap.
#include "../engine/sanitizer.hpp"
#include "ksl/ksl.h"
#include "ksl/memory.h"

#include <doctest/doctest.h>

#include <array>
#include <climits>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <initializer_list>
#include <string>

namespace {

/// What print writes to a file.
template <class Print> std::string printed(Print print) {
  char *text = nullptr;
  std::size_t size = 0;
  std::FILE *const file = open_memstream(&text, &size);
  REQUIRE(file);
  print(file);
  std::fclose(file);
  const std::string all(text, size);
  std::free(text);
  return all;
}

} // namespace

#define KSL_CHECK_TABLE(type, suffix)                                                                                  \
  do {                                                                                                                 \
    type **const table = ksl_array2D##suffix##_alloc(7, 5);                                                            \
    REQUIRE(table);                                                                                                    \
    for (int k = 0; k < 35; ++k) {                                                                                     \
      CHECK(table[0][k] == static_cast<type>(0));                                                                      \
      table[k / 5][k % 5] = static_cast<type>(k % 2);                                                                  \
    }                                                                                                                  \
    for (int k = 0; k < 35; ++k)                                                                                       \
      CHECK(table[0][k] == static_cast<type>(k % 2));                                                                  \
    CHECK((table[1] == table[0] + 5 && table[6] == table[0] + 30));                                                    \
    ksl_array2D##suffix##_free(table);                                                                                 \
    ksl_array2D##suffix##_free(nullptr);                                                                               \
    for (const auto &size : {std::array{0, 5}, {5, 0}, {-1, 5}, {5, -1}})                                              \
      CHECK(ksl_array2D##suffix##_alloc(size[0], size[1]) == nullptr);                                                 \
    ksl_array##suffix##_free(static_cast<type *>(std::malloc(sizeof(type))));                                          \
  } while (false)

TEST_CASE(
    "a table on the heap is zero, in one block, and freed with one call; sizes that are none or too large give no table") {
  KSL_CHECK_TABLE(double, );
  KSL_CHECK_TABLE(float, f);
  KSL_CHECK_TABLE(int, i);
  KSL_CHECK_TABLE(unsigned, ui);
  KSL_CHECK_TABLE(char, c);
  KSL_CHECK_TABLE(bool, b);
#ifndef KSL_TEST_SANITIZER     // which ends a program that asks for too much
  volatile int most = INT_MAX; // unknown to compilers, which would warn
  CHECK(ksl_array2D_alloc(most, most) == nullptr);
#endif
}

TEST_CASE("Euler angles without a reference are those near (0, 0, 0)") {
  const ksl_vec3_t given = {{{0.3, 0.4, -0.5}}}, zero = {{{0, 0, 0}}};
  ksl_mat3x3_t R;
  ksl_mat3x3_setFromEulerAngles(&R, KSL_AXIS_XYZ, &given);
  ksl_vec3_t near, alone;
  ksl_mat3x3_getEulerAnglesNear(&R, KSL_AXIS_XYZ, &near, &zero);
  ksl_mat3x3_getEulerAnglesNear(&R, KSL_AXIS_XYZ, &alone, nullptr);
  for (int i = 0; i < 3; ++i) {
    CHECK(alone.at[i] == near.at[i]);
    CHECK(std::abs(alone.at[i] - given.at[i]) < 1e-15);
  }
}

TEST_CASE(
    "factors of a matrix: sizes that are none, and columns that aren't there, are refused and nothing is changed") {
  double A[4] = {1, 2, 3, 4};
  int pr[2] = {7, 7}, pc[2] = {7, 7};
  for (const auto &size : {std::array{0, 2}, {2, 0}})
    CHECK(ksl_linalg_lu_full_rmo(size[0], size[1], A, 0.0, pr, pc) == -1);
  for (const auto &size : {std::array{0, 2, 0}, {2, 1, 0}, {2, 2, -1}, {2, 2, 2}})
    CHECK(ksl_linalg_lu_full_specified_rmo(size[0], size[1], A, 0.0, pr, pc, size[2]) == -1);
  ksl_linalg_gramSchmidt(A, 0, 2);
  for (int k = 0; k < 4; ++k)
    CHECK(A[k] == k + 1);
  CHECK((pr[0] == 7 && pr[1] == 7 && pc[0] == 7 && pc[1] == 7));
}

TEST_CASE("printing: nothing of a null pointer, and the name of angles about no sequence of axes") {
  CHECK(
      printed([](std::FILE *file) { ksl_eulerangles_print(file, static_cast<ksl_eulerangles_t *>(nullptr)); }).empty());
  CHECK(printed([](std::FILE *file) {
          ksl_euleranglesf_print(file, static_cast<ksl_euleranglesf_t *>(nullptr));
        }).empty());
  CHECK(printed([](std::FILE *file) {
          ksl_spatial_inertia_print(file, static_cast<ksl_spatial_inertia_t *>(nullptr));
        }).empty());
  CHECK(printed([](std::FILE *file) {
          ksl_spatial_inertiaf_print(file, static_cast<ksl_spatial_inertiaf_t *>(nullptr));
        }).empty());
  ksl_eulerangles_t angles = {};
  for (int axis : {-1, static_cast<int>(KSL_AXIS_INVALID)}) {
    angles.axis = static_cast<ksl_axis_enum_t>(axis);
    CHECK(printed([&](std::FILE *file) { ksl_eulerangles_print(file, &angles); }).find("invalid") != std::string::npos);
  }
}
