// KSL: the derivatives of reactions by external wrenches: minus the map that carries a wrench from its link to the joint.
//
// A wrench on a link reduces the wrenches through all joints that carry the link by as much (Featherstone, RBDA (2008), table 5.1).
// Component c of a reaction is the power of the requested part on a unit twist.  Let s be the twist of the link's frame that has the
// same power with the wrench on the link (for_components).  Then the row of derivatives is −s.
#pragma once

#include "ksl/engine/algorithms/parameters/reactions_regressor.hpp"

namespace ksl {
inline namespace KSL_ISA {

template <class T> using reactions_external_derivatives_workspace = forward_kinematics_workspace<T>;

/// The derivative (request.n, 6, links, 6), row-major, for q (nq), of reactions by the external wrench on each link of the model, in the
/// link's axes, linear first; Featherstone, RBDA (2008), table 5.1.  Point, axes, part, side and order of reactions are those of the
/// request.  O(joints × links).
template <class T>
void reactions_external_derivatives(const model_view<scalar_of<T>> &model,
                                    const reactions_external_derivatives_workspace<T> &w, const T *q,
                                    const reaction_request &request, T *by_external) {
  const int n = model.links;
  for (std::ptrdiff_t k = 0; k < std::ptrdiff_t(36) * request.n * n; ++k)
    by_external[k] = T(0);
  forward_kinematics(model, w, q);
  for_components(model, w, request, [&](int r, int c, int l, const screw<T> &s) KSL_INLINED {
    T *const out = by_external + 6 * ((std::ptrdiff_t(6) * r + c) * n + l);
    out[0] = -s.lin.x, out[1] = -s.lin.y, out[2] = -s.lin.z;
    out[3] = -s.ang.x, out[4] = -s.ang.y, out[5] = -s.ang.z;
  });
}

} // namespace KSL_ISA
} // namespace ksl
