#include "engine/loops/planned.hpp"

#include "engine/coupled.hpp"
#include "engine/one_state.hpp"

#include <algorithm>
#include <cmath>

namespace ksl::loops {
namespace {

template <class S> const kernels_in<S> &kernels_for(const algorithm_row &row) { return kernels_of_row<S>(row); }

/// Is the wrench of a loop's joint wanted as the kernel gives it: at the joint, in its axes?
bool is_plain(const reaction_request &wanted) {
  return wanted.at == wrench_frame::joint && wanted.axes == wrench_frame::joint && wanted.offset[0] == 0 &&
         wanted.offset[1] == 0 && wanted.offset[2] == 0;
}

} // namespace

template <class S> bool planned<S>::suits(const batch_view<S> &batch) const {
  const loop_view<S> *const loops = view_.loops;
  if (!loops || loops->freedoms == 0)
    return false;
  if (row_.closed == closed_by::accelerations)
    return true;
  if (!loops->drives_are_independent)
    return false;
  if (row_.closed == closed_by::efforts)
    return true;
  if (row_.closed != closed_by::reactions || loops->pivots < loops->rows ||
      (batch.external_n > 0 && batch.external_axes == expressed_in::world))
    return false;
  for (int r = 0; r < batch.reactions_n; ++r)
    for (int k = 0; k < batch.reactions[r].request.n; ++k)
      if (batch.reactions[r].request.link[k] >= view_.links && !is_plain(batch.reactions[r].request))
        return false;
  return true;
}

template <class S> void planned<S>::lay_out(arena &memory, const batch_view<S> &batch, int states) {
  const int ends = view_.loops ? 12 * view_.loops->loops : 0, nv = m_.nv(),
            externals = batch.external_n + ends / 6 + forces_.ends();
  int joints = 0; // of all requests
  for (int r = 0; r < batch.reactions_n; ++r)
    joints += batch.reactions[r].request.n;
  numbers_ = memory.take<S>(states * nv), wrenches_ = memory.take<S>(states * ends),
  on_links_ = memory.take<S>(states * ends);
  found_ = memory.take<S>(static_cast<std::ptrdiff_t>(states) * 6 * joints), unwanted_ = memory.take<S>(states * nv);
  links_ = memory.take<int>(joints), external_ = memory.take<external_rows<S>>(externals);
  state_external_ = memory.take<S>(6 * externals), state_links_ = memory.take<int>(externals);
  reactions_ = memory.take<reaction_rows<S>>(batch.reactions_n);
  state_reactions_ = memory.take<reaction_result<S>>(batch.reactions_n);
  std::size_t bytes = 0;
  reaction_rows<S> rows[1];
  for (const algorithm_row *row : // those of any call, since memory is measured for one of them
       {&rows::closed_forward_dynamics, &rows::closed_inverse_dynamics, &rows::closed_inverse_dynamics_with_reactions,
        &rows::inverse_dynamics_with_reactions}) {
    batch_view<S> part;
    reaction_request all;
    all.n = joints;
    rows[0] = {all, {}};
    part.n = static_cast<std::size_t>(states), part.external_n = externals, part.reactions_n = 1, part.reactions = rows;
    bytes = std::max(bytes, kernels_for<S>(*row).workspace_bytes(view_));
    if (states > 1)
      bytes = std::max(bytes, kernels_for<S>(*row).batch(view_, part, 0, 0, nullptr).bytes);
  }
  workspace_ = memory.take<std::byte>(static_cast<std::ptrdiff_t>(bytes));
  if (forces_.ends() > 0)
    forces_.lay_out(memory, batch.external_n, states);
}

template <class S> batch_view<S> planned<S>::part_of(const batch_view<S> &batch, std::size_t first, int n) const {
  batch_view<S> part;
  part.n = static_cast<std::size_t>(n);
  part.q = rows_from(batch.q, first), part.v = rows_from(batch.v, first), part.a = rows_from(batch.a, first);
  part.tau = rows_from(batch.tau, first);
  const bool elements = forces_.ends() > 0; // `first` is the state that run has set them at
  for (int e = 0; e < batch.external_n + forces_.ends(); ++e)
    external_[e] = elements ? forces_.external()[e]
                            : external_rows<S>{batch.external[e].link, rows_from(batch.external[e].wrench, first)};
  part.external_n = batch.external_n + forces_.ends(), part.external = external_,
  part.external_axes = batch.external_axes;
  return part;
}

/// Several states in lanes, or one alone.
template <class S> void planned<S>::call(const algorithm_row &row, const batch_view<S> &part) {
  const kernels_in<S> &kernel = kernels_for<S>(row);
  if (part.n > 1) {
    kernel.batch(view_, part, 0, part.n, workspace_);
    return;
  }
  kernel.state(view_, workspace_, first_state(part, state_links_, state_external_, state_reactions_));
}

/// Wrenches at the joints' frames to those at the origins of the links, in their axes.
template <class S> void planned<S>::move_to_links(int n) {
  const int loops = view_.loops->loops;
  for (int l = 0; l < loops; ++l)
    for (int side = 0; side < 2; ++side) {
      const loop_row &of = m_.loops()[static_cast<std::size_t>(l)];
      const SE3<double> &D = side == 0 ? of.successor_pose : of.predecessor_pose;
      for (int i = 0; i < n; ++i) {
        const S *const x = wrenches_ + (i * loops + l) * 12 + 6 * side;
        coscrew<double> f = {{double(x[0]), double(x[1]), double(x[2])}, {double(x[3]), double(x[4]), double(x[5])}};
        algebra<double>::product_CoAdc(&D, &f, &f);
        S *const out = on_links_ + (i * loops + l) * 12 + 6 * side;
        const double numbers[] = {f.lin.x, f.lin.y, f.lin.z, f.ang.x, f.ang.y, f.ang.z};
        for (int c = 0; c < 6; ++c)
          out[c] = static_cast<S>(numbers[c]);
      }
    }
}

template <class S> void planned<S>::store_loop(const reaction_request &wanted, const S *at_joint, S *out) const {
  const bool none = wanted.part == wrench_part::actuation || wanted.part == wrench_part::coupling;
  const S sign = none ? S(0) : wanted.on == wrench_side::parent ? S(-1) : S(1);
  for (int c = 0; c < 6; ++c)
    out[wanted.angular_first ? (c + 3) % 6 : c] = sign * at_joint[c] + S(0);
}

template <class S> void planned<S>::set_reactions(const batch_view<S> &batch, std::size_t first, int n,
                                                  const bool *done) {
  move_to_links(n);
  const int ends = 2 * view_.loops->loops, links = view_.links;
  batch_view<S> part = part_of(batch, first, n);
  for (int k = 0; k < ends; ++k) {
    const loop_row &of = m_.loops()[static_cast<std::size_t>(k / 2)];
    external_[part.external_n + k] = {k % 2 == 0 ? of.successor : of.predecessor, {on_links_ + 6 * k, 6 * ends}};
  }
  part.external_n += ends, part.external_axes = expressed_in::frame;
  part.result[0] = {unwanted_, m_.nv()};
  for (int r = 0; r < batch.reactions_n; ++r) {
    const reaction_request &wanted = batch.reactions[r].request;
    reaction_rows<S> of_tree = {wanted, {}};
    of_tree.request.n = 0, of_tree.request.link = links_;
    for (int k = 0; k < wanted.n; ++k)
      if (wanted.link[k] < links)
        links_[of_tree.request.n++] = wanted.link[k];
    of_tree.out = {found_, 6 * std::ptrdiff_t(of_tree.request.n)};
    part.reactions_n = 1, part.reactions = &of_tree;
    if (of_tree.request.n > 0)
      call(rows::inverse_dynamics_with_reactions, part);
    for (int i = 0; i < n && batch.reactions[r].out.first; ++i) {
      if (!done[i])
        continue;
      S *const out = ksl::row(batch.reactions[r].out, first + static_cast<std::size_t>(i));
      for (int k = 0, t = 0; k < wanted.n; ++k)
        if (wanted.link[k] < links)
          std::copy_n(found_ + (std::ptrdiff_t(i) * of_tree.request.n + t++) * 6, 6, out + 6 * k);
        else
          store_loop(wanted, wrenches_ + (std::ptrdiff_t(i) * ends + 2 * std::ptrdiff_t(wanted.link[k] - links)) * 6,
                     out + 6 * k);
    }
  }
}

/// Do all requests name joints that move, and those of loops?  Wrenches through welds are found by a second call, which knows on which of the
/// welded links those of loops act.
template <class S> bool planned<S>::moves_all(const batch_view<S> &batch) const {
  for (int r = 0; r < batch.reactions_n; ++r)
    for (int k = 0; k < batch.reactions[r].request.n; ++k)
      if (const int link = batch.reactions[r].request.link[k];
          link < view_.links && !view_.link[link].carried_by_moving_joint)
        return false;
  return true;
}

template <class S> void planned<S>::copy_reactions(const batch_view<S> &batch, std::size_t first, int n,
                                                   const bool *done) const {
  for (int r = 0; r < batch.reactions_n; ++r) {
    const std::ptrdiff_t numbers = 6 * std::ptrdiff_t(batch.reactions[r].request.n);
    for (int i = 0; i < n && batch.reactions[r].out.first; ++i)
      if (done[i])
        std::copy_n(reactions_[r].out.first + i * numbers, numbers,
                    ksl::row(batch.reactions[r].out, first + static_cast<std::size_t>(i)));
  }
}

template <class S> void planned<S>::run(const batch_view<S> &batch, std::size_t first, int n, bool *done) {
  const int nv = m_.nv(), ends = 12 * view_.loops->loops;
  if (forces_.ends() > 0)
    forces_.set(batch, first, n);
  batch_view<S> part = part_of(batch, first, n);
  part.result[0] = {numbers_, nv};
  const bool inverse = row_.closed != closed_by::accelerations,
             together = row_.closed == closed_by::reactions && moves_all(batch);
  if (together) {
    S *found = found_;
    for (int r = 0; r < batch.reactions_n; ++r) {
      const std::ptrdiff_t numbers = 6 * std::ptrdiff_t(batch.reactions[r].request.n);
      reactions_[r] = {batch.reactions[r].request, {found, numbers}};
      found += n * numbers;
    }
    part.reactions_n = batch.reactions_n, part.reactions = reactions_;
  } else if (inverse) {
    part.result[1] = {wrenches_, ends};
  }
  call(together  ? rows::closed_inverse_dynamics_with_reactions
       : inverse ? rows::closed_inverse_dynamics
                 : rows::closed_forward_dynamics,
       part);
  for (int i = 0; i < n; ++i) {
    S sum = 0;
    for (int k = 0; k < nv; ++k)
      sum += numbers_[i * nv + k] * S(0);
    done[i] = sum == S(0);
  }
  if (together)
    copy_reactions(batch, first, n, done);
  else if (row_.closed == closed_by::reactions)
    set_reactions(batch, first, n, done);
  for (int i = 0; i < n && row_.results > 0 && batch.result[0].first; ++i)
    if (done[i])
      std::copy_n(numbers_ + i * nv, nv, ksl::row(batch.result[0], first + static_cast<std::size_t>(i)));
}

template class planned<double>;
template class planned<float>;

} // namespace ksl::loops
