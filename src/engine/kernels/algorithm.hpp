// An algorithm at run time: its row of api/algorithms/, and its kernels.
#pragma once

#include "ksl/engine/algorithms/batch_view.hpp"
#include "ksl/engine/model/loop_view.hpp"

namespace ksl {

/// Computes one state.  The kernel lays out its workspace in `memory`, which is aligned to 64 bytes.  The inputs that the
/// algorithm reads and the results that it writes must not be null.  Returns whether the results are ordinary: false if one of them
/// may be NaN or infinite, or so large that it must be examined (engine/run/examine.hpp).  Kernels of algorithms that don't need mass don't
/// look, and return true.
template <class S> using state_kernel = bool (*)(const model_view<S> &, void *memory, const state_view<S> &);

struct batch_outcome {
  std::size_t bytes; ///< of memory that the kernel needs
  bool ordinary;     ///< are the results of all states ordinary, as above
};

/// Computes the states [first, end) of a batch, one in each lane.  The memory is aligned to 64 bytes; with null for it the kernel
/// computes nothing.
template <class S>
using batch_kernel = batch_outcome (*)(const model_view<S> &, const batch_view<S> &, std::size_t first, std::size_t end,
                                       void *memory);

template <class S> struct kernels_in {
  int lanes;                                             ///< number of states computed at a time
  std::size_t (*workspace_bytes)(const model_view<S> &); ///< of one state
  state_kernel<S> state;
  batch_kernel<S> batch;
};

/// The kernels of one algorithm for one instruction set.  An object file exports those of its algorithms, and nothing else.
struct algorithm_kernels {
  kernels_in<double> in_double;
  kernels_in<float> in_float;
};

struct kernel_table;

/// An extent of a result: a fixed number, or one that follows from the model or from what is requested.
///
/// Along `motion` a result has nv velocities or accelerations, along `nv` efforts or derivatives by a motion.
/// twists: six numbers for each link.
enum class extent : unsigned char {
  three,
  four,
  five,
  six,
  ten,
  nq,
  nv,
  motion,
  links,
  twists,
  joints,
  tree,
  all_links,
  freedoms
};

struct result_row {
  const char *name;
  int axes;        ///< 0: a number
  extent shape[4]; ///< (axes)
};

/// An input: positions, velocities, accelerations, efforts, second positions, or one number.
enum class input : unsigned char { q, v, a, tau, q1, fraction };

/// Whether an algorithm takes external wrenches.
enum class external_use : unsigned char { none, optional, required };

/// What a call specifies besides numbers.  link, links: one link, or several.  frame, frames: the same with frame_options.  relative: a
/// link and the one that it is seen from.  joints: joints with a reaction_request.  reactions: the same, and the reactions are a
/// further result.
enum class request_kind : unsigned char { none, link, links, frame, frames, relative, joints, reactions };

/// How an algorithm is computed where joints follow others (engine/mimic/algorithms.hpp).
enum class mimic_by : unsigned char {
  projection,           ///< of the results for the expanded mechanism
  solution,             ///< a of M a = τ − bias
  product,              ///< M⁻¹ τ
  inverse,              ///< M⁻¹
  upper_triangle,       ///< of M; the elements below the diagonal are not written
  solution_derivatives, ///< of a by q, v and τ
  solution_second_derivatives,
  hybrid, ///< a and τ, where some of each are given
  jump,   ///< M⁻¹ Jᵀ impulses
  operational_inverse,
  operational_inertia,
  operational_space, ///< J M⁻¹ Jᵀ, and what follows from it
  refusal            ///< not at all: where the layout is that of the tree
};

/// What force elements do in an algorithm (engine/elements/algorithms.hpp).
enum class elements_by : unsigned char {
  nothing,
  wrenches, ///< they are external wrenches, and no more
  energy,
  energy_derivatives,
  effort_derivatives,
  effort_gradient,
  acceleration_derivatives,
  reaction_derivatives,
  refusal ///< it can't be computed with them
};

/// How an algorithm is computed for mechanisms with loops (engine/loops/algorithms.hpp).
enum class loops_by : unsigned char {
  tree,          ///< as for the tree that carries the loops: a function of the given numbers, whatever the loops demand
  efforts,       ///< efforts of the drives
  reactions,     ///< efforts of the drives, and wrenches through joints
  parts,         ///< what the efforts consist of
  steady,        ///< efforts at independent accelerations of zero
  statics,       ///< efforts at rest
  accelerations, ///< under given efforts
  jump,          ///< of velocities under impulses
  linear,        ///< efforts or reactions for each component of wrenches on links, or for each inertial parameter
  refusal,       ///< not at all
  plan           ///< it is private: what computes efforts and accelerations by the model's plan
};

constexpr int most_inputs = 4; ///< how many an algorithm can have

/// One row: which inputs an algorithm reads and which results it writes.
struct algorithm_row {
  const char *name;
  int inputs;
  input input_list[most_inputs];       ///< (inputs), in the order of calls
  const char *input_name[most_inputs]; ///< their names in calls
  external_use external = external_use::none;
  request_kind request = request_kind::none;
  bool needs_mass = false;       ///< is it refused if a joint can move without moving any mass
  bool nan_without_mass = false; ///< is its result NaN, as documented, where nothing that moves has mass
  /// Is it refused if dry friction is exact, since it solves or differentiates the law of friction?
  bool smooth_friction = false;
  int results; ///< besides reactions
  result_row result[most_results];
  const algorithm_kernels *kernel_table::*kernels = nullptr;
  /// The row whose kernels compute this one, with zeros for the inputs that this row lacks; null if it has its own.
  const algorithm_row *variant_of = nullptr;
  /// Of the library's rows, which say them all.  Kernels, whose own rows don't, know the tree alone.
  mimic_by mimic = mimic_by::projection;
  elements_by elements = elements_by::nothing;
  loops_by loops = loops_by::tree;

  constexpr bool reads(input x) const {
    for (int i = 0; i < inputs; ++i)
      if (input_list[i] == x)
        return true;
    return false;
  }
};

inline namespace KSL_ISA { // since kernels call these functions

/// How many links a call must name at least.
constexpr int least_links(request_kind request) {
  const bool one = request == request_kind::link || request == request_kind::frame;
  return one ? 1 : request == request_kind::relative ? 2 : 0;
}
/// Is the number of links in a call limited to that of the model?  It is if a result has a row and a column for each link.
constexpr bool links_are_few(const algorithm_row &row) {
  for (int r = 0; r < row.results; ++r)
    for (int i = 1; i < row.result[r].axes; ++i)
      if (row.result[r].shape[i] == extent::twists)
        return true;
  return false;
}
/// Does a call name links?
constexpr bool names_links(request_kind request) {
  return request != request_kind::none && request != request_kind::joints && request != request_kind::reactions;
}

/// The extents that follow from a model and a request.
struct extents {
  int nq, nv, links, joints;
  int tree;         ///< elements of a matrix that aren't zero by the shape of the tree (engine/steps/tree_rows.hpp)
  int all_links;    ///< of the model
  int freedoms = 0; ///< of a mechanism whose loops have a plan, in kernels
};

constexpr int length_of(extent e, const extents &of) {
  switch (e) {
  case extent::three: return 3;
  case extent::four: return 4;
  case extent::five: return 5;
  case extent::six: return 6;
  case extent::ten: return 10;
  case extent::nq: return of.nq;
  case extent::nv:
  case extent::motion: return of.nv;
  case extent::links: return of.links;
  case extent::twists: return 6 * of.links;
  case extent::joints: return of.joints;
  case extent::tree: return of.tree;
  case extent::all_links: return of.all_links;
  case extent::freedoms: return of.freedoms;
  }
  __builtin_unreachable();
}

/// How many numbers an input of one state has.
constexpr int length_of(input x, int nq, int nv) {
  return x == input::q || x == input::q1 ? nq : x == input::fraction ? 1 : nv;
}

/// How many numbers a result of one state has.
constexpr std::ptrdiff_t numbers_of(const result_row &result, const extents &of) {
  std::ptrdiff_t n = 1;
  for (int i = 0; i < result.axes; ++i)
    n *= length_of(result.shape[i], of);
  return n;
}

/// The extents of a model and of a state or batch.
template <class Model, class View> constexpr extents extents_of(const Model &model, const View &view) {
  return {model.nq,
          model.nv,
          view.links.n,
          view.joints ? view.joints->n : 0,
          model.tree_elements,
          model.links,
          model.loops ? model.loops->freedoms : 0};
}

/// The member of a state_view or batch_view that holds an input.
template <class View> constexpr auto &input_of(View &view, input x) {
  switch (x) {
  case input::q: return view.q;
  case input::v: return view.v;
  case input::a: return view.a;
  case input::tau: return view.tau;
  case input::q1: return view.q1;
  case input::fraction: break;
  }
  return view.fraction;
}

} // namespace KSL_ISA

} // namespace ksl
