// The array functions of one instruction set (ksl/arrays.h lists them).  Each object compiled from array_kernels.cpp
// exports one such table and nothing else (test/contract/symbols_test.py).
#pragma once

#include "ksl/arrays.h"

namespace ksl {

template <class T> using array_function_1 = void (*)(size_t n, const T *a, ptrdiff_t a_stride, T *out,
                                                     ptrdiff_t out_stride);

/// whole: how many items the whole call has, of which these n are a part.  It decides whether the result is too large for the
/// caches; such a result is written by stores that bypass them.
template <class T>
using array_function_2 = void (*)(size_t n, const T *a, ptrdiff_t a_stride, const T *b, ptrdiff_t b_stride, T *out,
                                  ptrdiff_t out_stride, size_t whole);

struct array_kernel_table {
#define KSL_MEMBER_1(name, namef, A, a, O)                                                                             \
  array_function_1<double> name;                                                                                       \
  array_function_1<float> namef;
#define KSL_MEMBER_2(name, namef, A, a, B, b, O)                                                                       \
  array_function_2<double> name;                                                                                       \
  array_function_2<float> namef;
  KSL_ARRAY_FUNCTIONS(KSL_MEMBER_1, KSL_MEMBER_2)
#undef KSL_MEMBER_1
#undef KSL_MEMBER_2
};

/// The table of the instruction set in use, which is chosen at the first call.  Throws std::runtime_error for an unusable
/// KSL_ISA.
const array_kernel_table &array_kernels();

/// Whether packs of half a register are faster here than full ones.
bool half_registers();

} // namespace ksl
