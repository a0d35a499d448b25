#include "engine/states/not_finite.hpp"

namespace ksl {

std::string beginning_of_error(const char *call, std::size_t state, bool of_batch) {
  return std::string(call) + ": " + (of_batch ? "state " + std::to_string(state) + ": " : "");
}

template <class S>
result_error not_finite(const char *call, const found_number &found, std::size_t state, bool of_batch) {
  const char *const what = std::isnan(found.value) ? "nan" : found.value > 0 ? "inf" : "-inf";
  return {beginning_of_error(call, state, of_batch) + found.name + "[" + std::to_string(found.index) + "] is " + what +
              ", although all arguments are finite: they, or numbers of the model, are too large or too small for " +
              (sizeof(S) == 8 ? "double precision" : "single precision"),
          state, -1};
}

template <class S>
void examine_numbers(const char *call, const char *result, const S *x, std::ptrdiff_t n, std::size_t state,
                     bool of_batch) {
  found_number found;
  look(result, x, 0, n, found);
  if (!found.finite)
    throw not_finite<S>(call, found, state, of_batch);
}

#define KSL_INSTANTIATE(S)                                                                                             \
  template result_error not_finite<S>(const char *, const found_number &, std::size_t, bool);                          \
  template void examine_numbers(const char *, const char *, const S *, std::ptrdiff_t, std::size_t, bool);
KSL_INSTANTIATE(double)
KSL_INSTANTIATE(float)
#undef KSL_INSTANTIATE

} // namespace ksl
