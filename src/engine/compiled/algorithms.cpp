#include "engine/compiled/algorithms.hpp"

#include "engine/kernels/one_state.hpp"
#include "engine/loops/derivatives.hpp"
#include "ksl/engine/lanes/transpose.hpp"

#include <memory>
#include <vector>

namespace ksl::compiled {
namespace {

/// Rows of a batch as code gets them.  Inputs and results are no more than these; wrenches are few, and lie in memory of the call.
///
///     inputs_    [ those of the row, in its order | each wrench on a link ]       results_   [ those of the row | reactions ]
///     zeros_     what stands for inputs that the batch lacks, with a stride of zero
template <class S> class rows_for_code {
public:
  rows_for_code(arena &memory, const requested_code &code, const model &m, const batch_view<S> &batch)
      : code_(code), batch_(batch), inputs_(memory.take<code_rows>(most_inputs + batch.external_n)),
        zeros_(memory.take<S>(std::max({m.nq(), m.nv(), 6}))), numbers_(std::max({m.nq(), m.nv(), 6})),
        memory_(memory.take<std::byte>(static_cast<std::ptrdiff_t>(code.bytes))) {}

  /// The states from k on.
  void set(std::size_t k) {
    code_rows *next = inputs_;
    for (int i = 0; i < code_.row->inputs; ++i)
      *next++ = given(input_of(batch_, code_.row->input_list[i]), k);
    for (int e = 0; e < batch_.external_n; ++e)
      *next++ = given(batch_.external[e].wrench, k);
    int r = 0;
    for (; r < code_.row->results; ++r)
      results_[r] = wanted(batch_.result[r], k);
    if (code_.row->request == request_kind::reactions)
      results_[r] = wanted(batch_.reactions[0].out, k);
  }
  void clear_zeros() { std::fill_n(zeros_, numbers_, S(0)); }
  std::size_t run(std::size_t n) const { return code_.run(n, inputs_, results_, memory_); }

private:
  /// Code doesn't write to inputs.
  code_rows given(const rows_view<const S> &rows, std::size_t k) const {
    return rows.first ? code_rows{const_cast<S *>(row(rows, k)), rows.stride} : code_rows{zeros_, 0};
  }
  static code_rows wanted(const rows_view<S> &rows, std::size_t k) {
    return rows.first ? code_rows{row(rows, k), rows.stride} : code_rows{nullptr, 0};
  }

  const requested_code &code_;
  const batch_view<S> &batch_;
  code_rows *inputs_, results_[most_results + 1] = {};
  S *zeros_;
  int numbers_;
  std::byte *memory_;
};

} // namespace

/// transpose.hpp streams rows of `streamed_row` bytes and more in arrays that no cache holds; where a register is no whole line, only longer ones.
template <class S> bool is_streamed(const algorithm_row &row, const model &m, const batch_view<S> &batch) {
  const extents of = extents_of(m, batch);
  const bool whole_lines = static_cast<std::size_t>(kernels_of_row<S>(row).lanes) * sizeof(S) == 64;
  for (int r = 0; r < row.results; ++r) {
    const std::size_t bytes = static_cast<std::size_t>(numbers_of(row.result[r], of)) * sizeof(S);
    if (batch.result[r].first && bytes >= (whole_lines ? streamed_row : 4 * streamed_row) &&
        bytes * batch.n >= streamed_array)
      return true;
  }
  return false;
}

template <class S>
std::size_t batch_bytes(const way_calls<S> &below, const algorithm_row &row, const model &m,
                        const batch_view<S> &batch) {
  arena measure;
  const rows_for_code<S> rows(measure, *m.code()->find(row, batch), m, batch);
  return (measure.used() + 63) / 64 * 64 + below.batch_bytes(row, m, batch);
}

template <class S>
bool run_batch(const way_calls<S> &below, const algorithm_row &row, const model &m, const batch_view<S> &batch,
               std::size_t first, std::size_t end, void *memory) {
  const requested_code &code = *m.code()->find(row, batch);
  arena pieces(memory);
  rows_for_code<S> rows(pieces, code, m, batch);
  rows.clear_zeros();
  //     first ── code ──▸ k │ one block of lanes │ k ── code ──▸ … end          the code stops in front of a block with a result that isn't ordinary
  //                           the way below
  //
  // [ rows and the code's own memory | from a multiple of 64 on, that of the way below ]
  void *const behind = static_cast<std::byte *>(memory) + (pieces.used() + 63) / 64 * 64;
  bool ordinary = true;
  for (std::size_t k = first; k < end;) {
    rows.set(k);
    k += rows.run(end - k);
    if (k == end)
      break;
    // the block that the code stopped at has a result that isn't ordinary: the way below computes it, and judges it; the code goes on behind it
    const std::size_t left = std::min(end - k, static_cast<std::size_t>(code.lanes));
    ordinary &= below.run_batch(row, m, batch, k, k + left, behind);
    k += left;
  }
  return ordinary;
}

void derive_in_lanes(bool forward, const model &m, const batch_view<double> &batch, unsigned char *done) {
  const algorithm_row &row = forward ? rows::forward_dynamics_derivatives : rows::inverse_dynamics_derivatives;
  const requested_code *const code = m.code() ? m.code()->find(row, batch) : nullptr;
  if (!code)
    return loops::derive_in_lanes(forward, m, batch, done);
  arena measure;
  const rows_for_code<double> measured(measure, *code, m, batch);
  std::vector<std::byte> memory(measure.used() + 64); // of its own: what is left is computed in that of the thread
  void *begin = memory.data();
  std::size_t space = memory.size();
  arena pieces(std::align(64, measure.used(), begin, space));
  rows_for_code<double> rows(pieces, *code, m, batch);
  rows.clear_zeros();
  std::vector<external_rows<double>> wrenches(static_cast<std::size_t>(batch.external_n));
  for (std::size_t k = 0; k < batch.n;) {
    rows.set(k);
    const std::size_t found = rows.run(batch.n - k);
    std::fill_n(done + k, found, static_cast<unsigned char>(1));
    k += found;
    batch_view<double> left = batch;
    left.n = std::min(batch.n - k, static_cast<std::size_t>(code->lanes));
    for (const input x : every_input)
      input_of(left, x) = rows_from(input_of(batch, x), k);
    for (std::size_t e = 0; e < wrenches.size(); ++e)
      wrenches[e] = {batch.external[e].link, rows_from(batch.external[e].wrench, k)};
    left.external = wrenches.data();
    for (auto &result : left.result)
      result = rows_from(result, k);
    if (left.n > 0)
      loops::derive_in_lanes(forward, m, left, done + k);
    k += left.n;
  }
}

#define KSL_BATCHES(S)                                                                                                 \
  template bool is_streamed(const algorithm_row &, const model &, const batch_view<S> &);                              \
  template std::size_t batch_bytes(const way_calls<S> &, const algorithm_row &, const model &, const batch_view<S> &); \
  template bool run_batch(const way_calls<S> &, const algorithm_row &, const model &, const batch_view<S> &,           \
                          std::size_t, std::size_t, void *);
KSL_BATCHES(double)
KSL_BATCHES(float)
#undef KSL_BATCHES

} // namespace ksl::compiled
