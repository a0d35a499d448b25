// KSL: the wrench through a plane section of a link.
#pragma once

#include "ksl/engine/steps/external_wrenches.hpp"
#include "ksl/engine/steps/frame_options.hpp"
#include "ksl/model.hpp"

namespace ksl {

/// How much of a link's own inertia is beyond a section: all or nothing, by its centre of mass; a fraction of it; or an inertia that
/// is given.
enum class section_share : int { by_center, fraction, inertia };

/// A plane that cuts a link, and what is beyond it.
struct link_section {
  int link = 0;                 ///< index into model::links()
  double point[3] = {0, 0, 0};  ///< on the plane, in the link's frame, m; moments are about it
  double normal[3] = {0, 0, 1}; ///< of the plane, in the link's axes, of any length; it points to the part beyond
  section_share share = section_share::by_center;
  double fraction = 0;               ///< 0 to 1
  spatial_inertia<double> inertia{}; ///< of the part beyond, about the link's origin, in its axes
  int beyond_n = -1;                 ///< how many joints are named; −1: none, the plane says which are beyond
  /// (beyond_n) indices into model::joints(): of that which carries the link, and those that it carries;
  /// after these those of loops, which the link is one end of
  const int *beyond = nullptr;
  expressed_in axes = expressed_in::frame;
  component_order order = component_order::linear_first;
};

/// Is a joint beyond the section?  It must carry the link, or be carried by it, or close a loop at it.  If the section lists joints, the list
/// decides.  Otherwise the joint is beyond if its origin is, as the description places it.  If the origin is in the plane itself, the joint that
/// carries the link is near, and others are beyond.
KSL_EXPORT bool is_beyond(const model &m, const link_section &section, int joint);

/// The wrench (6) that the near part of a link exerts on the part beyond a section, for q (nq), v (nv) and a (nv): Newton's and Euler's
/// laws for the part beyond, with the reactions of its joints and the force elements whose points are beyond.  N, N m.  A wrench on the link itself
/// acts on the part with the link's origin.  O(bodies).  No allocation.
template <class S>
KSL_EXPORT void section_wrench(const model &m, data &d, const S *q, const S *v, const S *a, const link_section &section,
                               S *wrench, const external_wrenches<S> &external = {});

} // namespace ksl
