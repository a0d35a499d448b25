// Chooses the instruction set, once, at the first call.
//
// Each set is the same sources compiled once more, in objects of its own (CMakeLists.txt).  Here is nothing of them but pointers in tables: no code
// of a set may run before it is known that the processor has it.
#include "engine/kernels/array_kernels.hpp"
#include "engine/kernels/inverse_kinematics_kernels.hpp"
#include "engine/kernels/kernel_tables.hpp"
#include "engine/kernels/kernels.hpp"
#include "engine/kernels/no_instruction_set.hpp"

#include "ksl/dynamics.hpp"

#include <cstdlib>
#include <stdexcept>
#include <string>

#if defined(__x86_64__)
#include <cpuid.h>
#endif

#define KSL_DECLARE_TABLES(set)                                                                                        \
  KSL_DECLARE_KERNELS(set)                                                                                             \
  extern "C" const ksl::finite_kernels ksl_finite_##set;                                                               \
  extern "C" const ksl::array_kernel_table ksl_array_kernels_##set;                                                    \
  extern "C" const ksl::inverse_kinematics_kernels ksl_kernels_inverse_kinematics_##set;                               \
  constexpr ksl::kernel_table kernels_##set = KSL_KERNEL_TABLE(set);
// KSL_HAS_…: the sets that the library is built for.
#ifdef KSL_HAS_x86_64_v2
KSL_DECLARE_TABLES(x86_64_v2)
#endif
#ifdef KSL_HAS_x86_64_v3
KSL_DECLARE_TABLES(x86_64_v3)
#endif
#ifdef KSL_HAS_x86_64_v4
KSL_DECLARE_TABLES(x86_64_v4)
#endif
#ifdef KSL_HAS_neon
KSL_DECLARE_TABLES(neon)
#endif
#ifdef KSL_HAS_generic
KSL_DECLARE_TABLES(generic)
#endif

namespace ksl {
namespace {

struct instruction_set_row {
  const char *name;
  const kernel_table *table;
  const finite_kernels *finite;
  const array_kernel_table *arrays;
  const inverse_kinematics_kernels *inverse_kinematics;
  bool (*runs_here)();
};

#if defined(__x86_64__)

/// What cpuid and the operating system say.  Not by __builtin_cpu_supports, whose table is part of libgcc, and is empty where a program is
/// linked with other runtime libraries.
struct processor {
  unsigned first = 0, seventh = 0, extended = 0; ///< ecx of leaf 1, ebx of leaf 7, ecx of leaf 0x80000001
  unsigned saved = 0;                            ///< registers that the system saves where it changes threads

  processor() {
    unsigned a, b, c, d;
    if (__get_cpuid(1, &a, &b, &c, &d))
      first = c;
    if (__get_cpuid_count(7, 0, &a, &b, &c, &d))
      seventh = b;
    if (__get_cpuid(0x80000001, &a, &b, &c, &d))
      extended = c;
    if (first & bit_OSXSAVE)
      __asm__ volatile("xgetbv" : "=a"(saved), "=d"(d) : "c"(0));
  }
  static bool all(unsigned word, unsigned bits) { return (word & bits) == bits; }
};

// Levels of the x86-64 psABI, by features that tell them apart.  Instructions are illegal whose registers the system doesn't save: xgetbv says whether it saves
// xmm and ymm (bits 1 and 2), and for v4 the mask registers and both parts of zmm (bits 5 to 7; Intel's manual, volume 1, chapter 13).
[[maybe_unused]] bool has_v2() { return processor::all(processor().first, bit_SSE4_2 | bit_POPCNT); }

[[maybe_unused]] bool has_v3() {
  const processor p;
  return has_v2() && processor::all(p.first, bit_AVX | bit_FMA | bit_MOVBE | bit_F16C) &&
         processor::all(p.extended, bit_LZCNT) && processor::all(p.seventh, bit_AVX2 | bit_BMI | bit_BMI2) &&
         processor::all(p.saved, 0x06);
}

#ifdef KSL_HAS_x86_64_v4
bool has_v4() {
  const processor p;
  return has_v3() &&
         processor::all(p.seventh, bit_AVX512F | bit_AVX512BW | bit_AVX512CD | bit_AVX512DQ | bit_AVX512VL) &&
         processor::all(p.saved, 0xe6);
}
#endif

// best first
constexpr instruction_set_row sets[] = {
#ifdef KSL_HAS_x86_64_v4
    {"x86-64-v4", &kernels_x86_64_v4, &ksl_finite_x86_64_v4, &ksl_array_kernels_x86_64_v4,
     &ksl_kernels_inverse_kinematics_x86_64_v4, has_v4},
#endif
#ifdef KSL_HAS_x86_64_v3
    {"x86-64-v3", &kernels_x86_64_v3, &ksl_finite_x86_64_v3, &ksl_array_kernels_x86_64_v3,
     &ksl_kernels_inverse_kinematics_x86_64_v3, has_v3},
#endif
#ifdef KSL_HAS_x86_64_v2
    {"x86-64-v2", &kernels_x86_64_v2, &ksl_finite_x86_64_v2, &ksl_array_kernels_x86_64_v2,
     &ksl_kernels_inverse_kinematics_x86_64_v2, has_v2},
#endif
};

#elif defined(__aarch64__)

constexpr instruction_set_row sets[] = {{"neon", &kernels_neon, &ksl_finite_neon, &ksl_array_kernels_neon,
                                         &ksl_kernels_inverse_kinematics_neon, [] { return true; }}};

#else

constexpr instruction_set_row sets[] = {{"generic", &kernels_generic, &ksl_finite_generic, &ksl_array_kernels_generic,
                                         &ksl_kernels_inverse_kinematics_generic, [] { return true; }}};

#endif

/// Why no set of this library runs here.
std::string none_runs() {
  std::string built;
  for (const instruction_set_row &set : sets)
    built += (built.empty() ? "" : ", ") + std::string(set.name);
#if defined(__x86_64__)
  const char *const here = has_v3() ? "x86-64-v3" : has_v2() ? "x86-64-v2" : "";
#else
  const char *const here = "another one";
#endif
  return no_instruction_set_text(built, here);
}

/// KSL_ISA names a set, which is taken if it runs here; without it, the best that does.
const instruction_set_row &choose() {
  const char *forced = std::getenv("KSL_ISA"); // NOLINT(concurrency-mt-unsafe): read, and once
  std::string known;
  for (const instruction_set_row &set : sets) {
    if (!set.runs_here())
      continue;
    if (!forced || !*forced || std::string(forced) == set.name)
      return set;
    known += (known.empty() ? "" : ", ") + std::string(set.name);
  }
  throw std::runtime_error(forced && *forced && !known.empty()
                               ? "KSL_ISA=" + std::string(forced) + " is no instruction set that runs here; known: " +
                                     known + "; unset it to have the best one chosen"
                               : none_runs());
}

const instruction_set_row &chosen() {
  static const instruction_set_row &set = choose();
  return set;
}

} // namespace

const kernel_table &kernels() { return *chosen().table; }
const finite_kernels &finite_kernels_in_force() { return *chosen().finite; }
const array_kernel_table &array_kernels() { return *chosen().arrays; }
const inverse_kinematics_kernels &inverse_kinematics_kernels_in_force() { return *chosen().inverse_kinematics; }
const char *instruction_set() { return chosen().name; }

// Some processors execute 512-bit operations in two steps.  (AMD reports it in cpuid: bit 2 means 256 bits a step, bit 3 means
// 512.)  On these, transposing eight rows costs more than twice as much as transposing four.  If KSL_ISA is set, full
// registers are used.
#ifdef KSL_HAS_x86_64_v4
bool half_registers() {
  static const bool half = [] {
    unsigned width = 0, b, c, d;
    const char *forced = std::getenv("KSL_ISA"); // NOLINT(concurrency-mt-unsafe): read, and once
    return __get_cpuid(0x8000001a, &width, &b, &c, &d) && (width & 4) && !(width & 8) && !(forced && *forced);
  }();
  return half;
}
#endif

} // namespace ksl
