// The array functions of ksl/arrays.h.  They call the table of the instruction set in use.
#include "engine/kernels/array_kernels.hpp"

namespace {

/// Exceptions can't be passed to C, and these functions return no status: an unusable KSL_ISA ends the program with a message.
const ksl::array_kernel_table &table() noexcept { return ksl::array_kernels(); }

} // namespace

#define KSL_DEFINE_1(name, T)                                                                                          \
  void ksl_array_##name(size_t n, const T *a, ptrdiff_t a_stride, T *out, ptrdiff_t out_stride) {                      \
    table().name(n, a, a_stride, out, out_stride);                                                                     \
  }
#define KSL_DEFINE_2(name, T)                                                                                          \
  void ksl_array_##name(size_t n, const T *a, ptrdiff_t a_stride, const T *b, ptrdiff_t b_stride, T *out,              \
                        ptrdiff_t out_stride) {                                                                        \
    table().name(n, a, a_stride, b, b_stride, out, out_stride, n);                                                     \
  }
#define KSL_BOTH_1(name, namef, A, a, O) KSL_DEFINE_1(name, double) KSL_DEFINE_1(namef, float)
#define KSL_BOTH_2(name, namef, A, a, B, b, O) KSL_DEFINE_2(name, double) KSL_DEFINE_2(namef, float)

KSL_ARRAY_FUNCTIONS(KSL_BOTH_1, KSL_BOTH_2)
