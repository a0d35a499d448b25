// KSL: wrenches that the environment exerts on links.
#pragma once

#include "ksl/engine/workspace.hpp"

namespace ksl {

/// Linear first, at the link's origin, in the link's axes.
template <class T> struct external_wrenches {
  int n = 0;
  const int *link = nullptr;  ///< (n)
  const T *wrench = nullptr;  ///< (n, 6)
};

inline namespace KSL_ISA {

/// External wrench k, about the origin of its body and in the body's axes.
template <class T>
inline coscrew<T> external_in_body(const model_view<scalar_of<T>> &model, const external_wrenches<T> &external, int k) {
  const T *e = external.wrench + 6 * k;
  const SE3<T> pose = spread<T>(model.link[external.link[k]].pose);
  coscrew<T> f = {{e[0], e[1], e[2]}, {e[3], e[4], e[5]}};
  algebra<T>::product_CoAdc(&pose, &f, &f);
  return f;
}

/// Adds a wrench to that of body i.
template <class T> KSL_LANES void add_wrench(const per_body<coscrew, T> &wrench, int i, const coscrew<T> &f) {
  coscrew<T> sum = wrench[i];
  algebra<T>::xpy_cc(&f, &sum);
  wrench.set(i, sum);
}

/// Subtracts external wrenches from the wrenches that the bodies' motions need.  express(body, wrench) converts each from the
/// body's axes to those of the algorithm.
template <class T, class Express>
KSL_LANES void subtract_external(const model_view<scalar_of<T>> &model, const external_wrenches<T> &external,
                                 const per_body<coscrew, T> &wrench, Express express) {
  for (int k = 0; k < external.n; ++k) {
    const int i = model.link[external.link[k]].body;
    coscrew<T> f = external_in_body(model, external, k), rest = wrench[i];
    express(i, f);
    algebra<T>::nxpy_cc(&f, &rest);
    wrench.set(i, rest);
  }
}

} // namespace KSL_ISA
} // namespace ksl
