// ksl._ufuncs: the array functions of ksl/arrays.h as NumPy generalised ufuncs.  Users import ksl.ufuncs.  This module is
// compiled into the file of ksl._core; ksl/_ufuncs.py loads it from there.
#define NPY_NO_DEPRECATED_API NPY_1_23_API_VERSION
#define NPY_TARGET_VERSION NPY_1_23_API_VERSION
#include <Python.h>

#include <numpy/ndarrayobject.h>
#include <numpy/ufuncobject.h>

#include "batch/threads.hpp"
#include "engine/kernels/array_kernels.hpp"
#include "text/rounding.hpp"

#include <algorithm>
#include <atomic>
#include <cfenv>
#include <cstdint>
#include <cstring>
#include <exception>
#include <string>

namespace {

enum operand_type { screw, coscrew, vec3, mat3x3, SE3, inertia, spatial_inertia, real };

/// An operand type: how many numbers an item has, the length of its last axis, and its core dimensions in NumPy's terms.
struct shape_row {
  int numbers, last;
  const char *core, *meaning;
};
constexpr shape_row shapes[] = {
    {6, 6, "(6)", "(6), a screw, linear first: twist (v, ω)"},
    {6, 6, "(6)", "(6), a coscrew, linear first: wrench (f, τ)"},
    {3, 3, "(3)", "(3), a vector or translation"},
    {9, 3, "(3,3)", "(3, 3), a rotation by columns: R[..., j, :] is column j, so the matrix is R.mT"},
    {12, 3, "(4,3)", "(4, 3), a pose by columns: D[..., :3, :] are the columns of R, D[..., 3, :] is t"},
    {10, 10, "(10)",
     "(10), a centroidal inertia: m, m c (3), Ixx Iyy Izz Ixy Iyz Izx about the centroid, in the frame's axes"},
    {10, 10, "(10)", "(10), a spatial inertia about the frame's origin: m, h = m c (3), Ixx Iyy Izz Ixy Iyz Izx"},
    {1, 1, "()", "a number"},
};

struct text_row { const char *name, *text; };
/// What each function computes, its source and its cost, as stated in include/ksl/detail.
constexpr text_row texts[] = {
    {"product_Ads",
     "[Ad](D) s = (R v + t × R ω, R ω): a twist in frame b, expressed in the frame a that D_ab carries to (coscrews (3)). 42 flops."},
    {"product_Adsinv", "−[Ad](D) s. 42 flops."},
    {"product_Adinvs", "[Ad]⁻¹(D) s = (Rᵀ (v − t × ω), Rᵀ ω) (coscrews (4), corrected). 42 flops."},
    {"product_Adrs", "[Ad](R, 0) s = (R v, R ω). 30 flops."},
    {"product_Adrinvs", "[Ad]⁻¹(R, 0) s = (Rᵀ v, Rᵀ ω). 30 flops."},
    {"product_Adts", "[Ad](1, t) s = (v + t × ω, ω). 12 flops."},
    {"product_Adtinvs", "[Ad]⁻¹(1, t) s = (v − t × ω, ω). 12 flops."},
    {"product_CoAdc",
     "[Ad]*(D) c = (R f, R τ + t × R f): a wrench in frame b, expressed in the frame a that D_ab carries to (coscrews (6)). 42 flops."},
    {"product_CoAdcinv", "−[Ad]*(D) c. 42 flops."},
    {"product_CoAdinvc", "([Ad]*)⁻¹(D) c = (Rᵀ f, Rᵀ (τ − t × f)) (coscrews (6), corrected). 42 flops."},
    {"product_CoAdrc", "[Ad]*(R, 0) c = (R f, R τ). 30 flops."},
    {"product_CoAdrinvc", "([Ad]*)⁻¹(R, 0) c = (Rᵀ f, Rᵀ τ). 30 flops."},
    {"product_CoAdtc", "[Ad]*(1, t) c = (f, τ + t × f). 12 flops."},
    {"product_CoAdtinvc", "([Ad]*)⁻¹(1, t) c = (f, τ − t × f). 12 flops."},
    {"cross_ss", "[ad](s1) s2 = (ω1 × v2 + v1 × ω2, ω1 × ω2): the Lie bracket. 30 flops."},
    {"cross_sc",
     "[ad]*(s) c = (ω × f, ω × τ + v × f): the rate of change of a coscrew that is carried along (coscrews (12)). 30 flops."},
    {"dot_cs",
     "c · s = f · v + τ · ω: the power of a wrench on a twist, the same in every frame (coscrews (2)). 11 flops."},
    {"product_dd", "D1 D2 = (R1 R2, R1 t2 + t1). 63 flops."},
    {"product_dinvd", "D1⁻¹ D2 = (R1ᵀ R2, R1ᵀ (t2 − t1)). 63 flops."},
    {"product_ddinv", "D1 D2⁻¹ = (R1 R2ᵀ, t1 − R1 R2ᵀ t2). 63 flops."},
    {"product_dv", "R v + t: a point's coordinates in the frame that D carries it to. 18 flops."},
    {"product_dinvv", "Rᵀ (v − t). 18 flops."},
    {"product_drv", "R v. 15 flops."},
    {"product_drinvv", "Rᵀ v. 15 flops."},
    {"product_Ms", "M s = (m v + ω × h, I ω + h × v): the momentum of a body that moves with the twist s. 42 flops."},
    {"spatial_inertia_transformed",
     "[Ad]*(D) M [Ad]⁻¹(D): an inertia in frame b, expressed in the frame a that D_ab carries to. 120 flops."},
    {"inertia_toSpatialInertia",
     "The inertia about the frame's origin of a centroidal one: h = m c, I + m (|c|² 1 − c cᵀ). 19 flops."},
    {"spatial_inertia_toInertia",
     "The centroidal inertia: I − m (|c|² 1 − c cᵀ), c = h/m, 0 without mass. Cancels digits where c is far from the origin. 19 flops."},
    {"SE3_inverted", "D⁻¹ = (Rᵀ, −Rᵀ t). 15 flops."},
    {"SE3_exp", "exp s: the pose reached after unit time with the constant twist s. 136 flops, 2 roots and 2 sines."},
    {"SE3_log", "log D: the screw of smallest |ω| whose exponential is D. 83 flops, a root and an arctangent."},
};

/// One array function.  NumPy passes it to the inner loops below as their data.
struct function_row {
  const char *name;
  int inputs;
  operand_type types[3]; ///< of the inputs, and of the output last
  const char *arguments[2];
  void (*call_double)(size_t n, double *const *at, const ptrdiff_t *stride,
                      size_t whole); ///< n items, of `whole` in the call
  void (*call_float)(size_t n, float *const *at, const ptrdiff_t *stride, size_t whole);
};

const function_row functions[] = {
#define KSL_CALL_1(member, T)                                                                                          \
  [](size_t n, T *const *at, const ptrdiff_t *s, size_t) { ksl::array_kernels().member(n, at[0], s[0], at[1], s[1]); }
#define KSL_CALL_2(member, T)                                                                                          \
  [](size_t n, T *const *at, const ptrdiff_t *s, size_t whole) {                                                       \
    ksl::array_kernels().member(n, at[0], s[0], at[1], s[1], at[2], s[2], whole);                                      \
  }
#define KSL_ROW_1(name, namef, A, a, O)                                                                                \
  {#name, 1, {A, O, real}, {#a, nullptr}, KSL_CALL_1(name, double), KSL_CALL_1(namef, float)},
#define KSL_ROW_2(name, namef, A, a, B, b, O)                                                                          \
  {#name, 2, {A, B, O}, {#a, #b}, KSL_CALL_2(name, double), KSL_CALL_2(namef, float)},
    KSL_ARRAY_FUNCTIONS(KSL_ROW_1, KSL_ROW_2)};
constexpr int function_count = sizeof functions / sizeof functions[0];

/// An operand's items as they lie in NumPy's memory.
struct view {
  char *at;
  npy_intp step, row_step, number_step; ///< bytes from item to item, and within one
  const shape_row *shape;

  template <class T> char *number(npy_intp item, int i) const {
    return at + item * step + i / shape->last * row_step + i % shape->last * number_step;
  }
  /// Whether the array functions can use it as it is: aligned, with contiguous items.
  template <class T> bool plain() const {
    constexpr npy_intp size = sizeof(T);
    return step % size == 0 && reinterpret_cast<std::uintptr_t>(at) % alignof(T) == 0 &&
           (shape->numbers == 1 || number_step == size) &&
           (shape->numbers == shape->last || row_step == size * shape->last);
  }
};

template <class T> void call(const function_row &f, size_t n, T *const *at, const ptrdiff_t *stride, size_t whole) {
  if constexpr (sizeof(T) == 8)
    f.call_double(n, at, stride, whole);
  else
    f.call_float(n, at, stride, whole);
}

/// The operands of one call of the inner loop.
template <class T> struct operands {
  const function_row &f;
  npy_intp n;
  view v[3];
  bool plain[3];

  int count() const { return f.inputs + 1; }
};

/// Computes n items from `first` on; all operands are plain.
template <class T> void plain_range(const operands<T> &all, npy_intp first, npy_intp n) {
  T *at[3];
  ptrdiff_t stride[3];
  for (int k = 0; k < all.count(); ++k) {
    at[k] = reinterpret_cast<T *>(all.v[k].at + first * all.v[k].step);
    stride[k] = all.v[k].step / static_cast<npy_intp>(sizeof(T));
  }
  call<T>(all.f, static_cast<size_t>(n), at, stride, static_cast<size_t>(all.n));
}

/// Computes the items [begin, end), some at a time.  Operands that are not plain are copied by way of a buffer.
template <class T> void buffered_range(const operands<T> &all, npy_intp begin, npy_intp end) {
  constexpr npy_intp some = 64;
  T buffer[3][some * 12];
  T *at[3];
  ptrdiff_t stride[3];
  const int out = all.f.inputs;
  for (npy_intp first = begin; first < end; first += some) {
    const npy_intp count = std::min(some, end - first);
    for (int k = 0; k <= out; ++k) {
      const view &v = all.v[k];
      const int numbers = v.shape->numbers;
      at[k] = all.plain[k] ? reinterpret_cast<T *>(v.at + first * v.step) : buffer[k];
      stride[k] = all.plain[k] ? v.step / static_cast<npy_intp>(sizeof(T)) : numbers;
      if (!all.plain[k] && k < out)
        for (npy_intp i = 0; i < count; ++i)
          for (int j = 0; j < numbers; ++j)
            std::memcpy(&buffer[k][i * numbers + j], v.number<T>(first + i, j), sizeof(T));
    }
    call<T>(all.f, static_cast<size_t>(count), at, stride, static_cast<size_t>(count));
    const view &to = all.v[out];
    const int numbers = to.shape->numbers;
    if (!all.plain[out])
      for (npy_intp i = 0; i < count; ++i)
        for (int j = 0; j < numbers; ++j)
          std::memcpy(to.number<T>(first + i, j), &buffer[out][i * numbers + j], sizeof(T));
  }
}

std::atomic<int> threads{0}; ///< the most threads that a large call may use; 0: all cores

/// Waking a thread may cost as much as ten thousand items.  Many parts for each thread keep the threads close to each other in
/// memory, which reads 10 % faster.
constexpr std::size_t block = 64, least_items = 32768, parts_each = 16;

/// Keeps the flags of floating-point exceptions as they were.  NumPy warns by them, but lanes compute both sides of a condition: they say
/// nothing of results.
class kept_exceptions {
public:
  kept_exceptions() { std::fegetexceptflag(&before_, FE_ALL_EXCEPT); }
  ~kept_exceptions() { std::fesetexceptflag(&before_, FE_ALL_EXCEPT); }
  kept_exceptions(const kept_exceptions &) = delete;
  kept_exceptions &operator=(const kept_exceptions &) = delete;

private:
  std::fexcept_t before_;
};

/// The inner loop.
template <class T> void loop(char **args, const npy_intp *dimensions, const npy_intp *steps, void *data) {
  const ksl::nearest_rounding rounding;
  const kept_exceptions exceptions;
  operands<T> all{*static_cast<const function_row *>(data), dimensions[0], {}, {}};
  const npy_intp n = all.n, *inner = steps + all.count();
  bool all_plain = true;
  for (int k = 0; k < all.count(); ++k) {
    const shape_row &s = shapes[all.f.types[k]];
    all.v[k] = {args[k], steps[k], 0, 0, &s};
    if (s.numbers != s.last)
      all.v[k].row_step = *inner++;
    if (s.numbers > 1)
      all.v[k].number_step = *inner++;
    all.plain[k] = all.v[k].template plain<T>();
    all_plain = all_plain && all.plain[k];
  }
  const auto range = [&](npy_intp first, npy_intp end) {
    all_plain ? plain_range(all, first, end - first) : buffered_range(all, first, end);
  };

  if (n < static_cast<npy_intp>(2 * least_items))
    return range(0, n);
  const ksl::partition parts(static_cast<std::size_t>(n), block, least_items, threads.load(std::memory_order_relaxed),
                             parts_each);
  ksl::on_threads(parts, [&](std::size_t first, std::size_t end, std::size_t) {
    range(static_cast<npy_intp>(first), static_cast<npy_intp>(end));
  });
}

PyUFuncGenericFunction loops[] = {loop<float>, loop<double>};
char types[] = {NPY_FLOAT, NPY_FLOAT, NPY_FLOAT, NPY_DOUBLE, NPY_DOUBLE, NPY_DOUBLE};
char types_1[] = {NPY_FLOAT, NPY_FLOAT, NPY_DOUBLE, NPY_DOUBLE};

/// Objects of each function that NumPy keeps pointers to.
struct kept {
  void *data[2];
  std::string signature, doc;
};
kept keep[function_count];

/// Sets signature and docstring.  NumPy adds the first line, with the arguments.  The next one says what a user of matrices gets wrong.
void describe(const function_row &f, kept &k) {
  if (std::any_of(f.types, f.types + f.inputs + 1, [](operand_type t) { return t == mat3x3 || t == SE3; }))
    k.doc =
        "Rotations are stored by columns, the transpose of the usual matrix: ksl.ufuncs.poses(matrix) converts.\n\n";
  for (const text_row &t : texts)
    if (std::strcmp(t.name, f.name) == 0)
      k.doc += t.text;
  k.doc += "\n\n";
  for (int i = 0; i <= f.inputs; ++i) {
    const shape_row &s = shapes[f.types[i]];
    k.signature += std::string(i == 0 ? "" : i < f.inputs ? "," : "->") + s.core;
    k.doc += std::string(i < f.inputs ? f.arguments[i] : "returns") + ": " + s.meaning + "\n";
  }
  k.doc += "\nLeading axes broadcast; float32 and float64. SI units, radians.";
}

PyObject *set_threads(PyObject *, PyObject *argument) {
  PyObject *const whole = PyBool_Check(argument) ? nullptr : PyNumber_Index(argument);
  const long n = whole ? PyLong_AsLong(whole) : -1;
  Py_XDECREF(whole);
  PyErr_Clear(); // of what is no whole number, or beyond all that C has; the sentence below says it
  if (n < 0 || n > 4096)
    return PyErr_Format(PyExc_ValueError,
                        "set_threads(%R): expected how many threads to use at most, 1 to 4096, or 0 for all cores",
                        argument);
  return PyLong_FromLong(threads.exchange(static_cast<int>(n)));
}

PyMethodDef methods[] = {
    {"set_threads", set_threads, METH_O,
     "set_threads(n, /)\n--\n\nCalls of 65536 items and more use at most n threads from now on; 0, as at the start: all cores.\n"
     "Returns what was set before.  Results don't depend on it."},
    {nullptr, nullptr, 0, nullptr}};

PyModuleDef definition = {PyModuleDef_HEAD_INIT,
                          "_ufuncs",
                          "The array functions of KSL as generalised ufuncs.",
                          -1,
                          methods,
                          nullptr,
                          nullptr,
                          nullptr,
                          nullptr};

} // namespace

PyMODINIT_FUNC PyInit__ufuncs() {
  import_array();
  import_umath();
  try {
    ksl::array_kernels(); // raises the error of an unusable KSL_ISA here and not inside a loop
  } catch (const std::exception &e) {
    PyErr_SetString(PyExc_ImportError, e.what());
    return nullptr;
  }
  PyObject *module = PyModule_Create(&definition);
  if (!module)
    return nullptr;
#ifdef Py_GIL_DISABLED
  PyUnstable_Module_SetGIL(module, Py_MOD_GIL_NOT_USED); // what threads share here is `threads` alone, which is atomic
#endif
  for (int i = 0; i < function_count; ++i) {
    const function_row &f = functions[i];
    kept &k = keep[i];
    k = {{const_cast<function_row *>(&f), const_cast<function_row *>(&f)}, {}, {}};
    describe(f, k);
    PyObject *ufunc =
        PyUFunc_FromFuncAndDataAndSignature(loops, k.data, f.inputs == 1 ? types_1 : types, 2, f.inputs, 1,
                                            PyUFunc_None, f.name, k.doc.c_str(), 0, k.signature.c_str());
    if (!ufunc || PyModule_AddObject(module, f.name, ufunc) < 0) {
      Py_XDECREF(ufunc);
      Py_DECREF(module);
      return nullptr;
    }
  }
  return module;
}
