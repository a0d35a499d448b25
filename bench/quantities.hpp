// What each operation computes: its name, and the common layout of its results.
#pragma once

#include "peer.h"

#include <cstdio>
#include <cstdlib>
#include <cstring>

/// What an operation computes, in the layout in which all peers give it: matrices row-major, upper triangles mirrored.
struct quantity {
  const char *name;
  int (*width)(const bench_model &); ///< numbers for one state
  bool solves;                       ///< loses digits with the condition of the mass matrix
  const char *beside = nullptr;      ///< the operation of other libraries to compare with, if that has another name

  const char *of_others() const { return beside ? beside : name; }
};

template <int n> int per_coordinate(const bench_model &m) { return n * m.nv; }
template <int n> int matrices(const bench_model &m) { return n * m.nv * m.nv; }
template <int n> int per_joint(const bench_model &m) { return n * m.joints; }

inline const quantity quantities[] = {
    {"rnea", per_coordinate<1>, false},
    {"reactions", per_joint<6>, false}, // rnea with the wrench through every joint
    {"aba", per_coordinate<1>, true},
    {"crba", matrices<1>, false},
    {"crba_upper", matrices<1>, false, "crba"},
    {"crba_tree", matrices<1>, false, "crba"}, // only elements that aren't zero by the shape of the tree
    {"fk", per_joint<12>, false},              // rotation row-major, then position, of each joint's frame in the world
    {"inverse_dynamics_derivatives", matrices<3>, false},                                        // ∂τ/∂q, ∂τ/∂v, ∂τ/∂a
    {"reactions_derivatives", [](const bench_model &m) { return 18 * m.joints * m.nv; }, false}, // by q, v, a
    {"forward_dynamics_derivatives", matrices<3>, true},                                         // ∂a/∂q, ∂a/∂v, ∂a/∂τ
    {"mass_matrix_inverse", matrices<1>, true},
    {"coriolis_matrix", per_coordinate<1>, false}, // C v: there are many C, but this is the same for all
    {"centroidal_momentum_matrix", per_coordinate<6>, false},
    {"center_of_mass_jacobian", per_coordinate<3>, false},
    {"jacobian", per_coordinate<6>, false}, // this and the next two: of one frame, in its axes, about its origin
    {"frame_velocity", [](const bench_model &) { return 6; }, false},
    {"frame_acceleration", [](const bench_model &) { return 6; }, false}, // spatial, without gravity
    {"inverse_dynamics_regressor", [](const bench_model &m) { return 10 * m.nv * m.joints; },
     false}, // (nv, joints, 10)
};

inline const quantity &quantity_of(const char *name) {
  for (const quantity &x : quantities)
    if (!std::strcmp(x.name, name))
      return x;
  std::fprintf(stderr, "%s is no operation of quantities.hpp\n", name);
  std::abort();
}
