// The function that programs of JAX call for arrays on a graphics card: it starts a kernel in XLA's stream, and waits for nothing.
//
// Python compiles and loads the kernel, and has the driver's functions (ksl/generation/card/): nothing here is linked to either.
#pragma once

#include "ffi.hpp"

#include <algorithm>
#include <vector>

namespace operators::card {

/// Functions of the driver, as CUDA declares them.
struct driver {
  int (*launch)(void *, unsigned, unsigned, unsigned, unsigned, unsigned, unsigned, unsigned, void *, void **, void **);
  int (*context_of)(void *, void **);
  int (*get_current)(void **);
  int (*push)(void *);
  int (*pop)(void **);
  int (*name_of)(int, const char **);
};

/// A kernel as a card has loaded it, in its context: the most threads of a block, and the multiprocessors that share the blocks.
struct loaded {
  void *function, *context;
  std::int64_t threads, multiprocessors;
};

struct kernel {
  driver of;
  std::vector<loaded> on;
  std::vector<std::int64_t> widths; ///< numbers of a state, of each input and then each result
  std::size_t inputs;
  bool single;
};

inline std::int64_t rows_of(const xla::buffer &b) {
  std::int64_t rows = 1;
  for (std::int64_t axis = 0; axis + 1 < b.rank; ++axis)
    rows *= b.shape[axis];
  return rows;
}

/// What the kernel is given: the number of states, and for each array its address and its stride; 0 is one row for all states.
inline std::vector<std::int64_t> arguments_of(const kernel &k, const xla::call_frame &frame) {
  const auto arrays = static_cast<std::int64_t>(k.widths.size()), inputs = static_cast<std::int64_t>(k.inputs);
  const bool all_there = frame.arguments.n == inputs && frame.results.n == arrays - inputs && frame.results.n > 0;
  std::vector<std::int64_t> given = {all_there ? rows_of(ffi::buffer(frame.results, 0)) : 0};
  for (std::int64_t i = 0; all_there && i < arrays; ++i) {
    const xla::buffer &b = i < inputs ? ffi::buffer(frame.arguments, i) : ffi::buffer(frame.results, i - inputs);
    const std::int64_t width = k.widths[static_cast<std::size_t>(i)], rows = rows_of(b);
    if (b.type != (k.single ? xla::number_type::f32 : xla::number_type::f64))
      throw std::invalid_argument("arrays of another precision than the kernel's");
    if (b.rank < 1 || b.shape[b.rank - 1] != width || (rows != given[0] && (rows != 1 || i >= inputs)))
      break;
    given.push_back(static_cast<std::int64_t>(reinterpret_cast<std::intptr_t>(b.data)));
    given.push_back(rows == given[0] ? width : 0);
  }
  if (!all_there || given.size() != 2 * k.widths.size() + 1)
    throw std::invalid_argument("arguments don't fit the kernel");
  return given;
}

inline void check(const kernel &k, int code) {
  const char *name = nullptr;
  if (code == 0)
    return;
  const bool has_name = k.of.name_of(code, &name) == 0 && name;
  throw std::invalid_argument(std::string("the card's driver reports ") + (has_name ? name : "an unknown error") +
                              " (" + std::to_string(code) + ")");
}

/// The context of a card is the thread's as long as this lives.
class in_context {
public:
  in_context(const kernel &k, void *context) : k_(k) {
    void *current = nullptr;
    check(k, k.of.get_current(&current));
    if (current != context)
      check(k, k.of.push(context)), pushed_ = true;
  }
  ~in_context() {
    void *popped = nullptr;
    if (pushed_)
      k_.of.pop(&popped);
  }
  in_context(const in_context &) = delete;
  in_context &operator=(const in_context &) = delete;

private:
  const kernel &k_;
  bool pushed_ = false;
};

inline xla::error *execute(const xla::call_frame &frame) {
  const std::shared_ptr<const kernel> k = kept<kernel>::find(ffi::constant(frame, "kernel"));
  if (!k)
    throw std::invalid_argument(
        "the model of this compiled function is of another process, or is gone; compile the function here");
  std::vector<std::int64_t> given = arguments_of(*k, frame);
  xla::stream_arguments of = {sizeof(xla::stream_arguments), nullptr, frame.context, nullptr};
  if (xla::error *error = frame.api->get_stream(&of))
    return error;
  const std::int64_t states = given[0];
  if (states == 0)
    return nullptr;
  void *context = nullptr;
  check(*k, k->of.context_of(of.stream, &context));
  const auto found = std::find_if(k->on.begin(), k->on.end(), [&](const loaded &l) { return l.context == context; });
  if (found == k->on.end())
    throw std::invalid_argument("the program's stream is of no card that the kernel is loaded on");
  // Smaller blocks where some multiprocessors would have none: as functions.py has it.
  const std::int64_t warps = std::min(found->threads / 32, states / (32 * found->multiprocessors));
  const std::int64_t threads = 32 * std::max<std::int64_t>(1, warps), blocks = (states + threads - 1) / threads;
  std::vector<void *> places;
  for (std::int64_t &x : given)
    places.push_back(&x);
  const in_context here(*k, context);
  check(*k, k->of.launch(found->function, static_cast<unsigned>(blocks), 1, 1, static_cast<unsigned>(threads), 1, 1, 0,
                         of.stream, places.data(), nullptr));
  return nullptr;
}

/// A kernel that Python holds.
struct held {
  std::int64_t number;

  explicit held(kernel k) : number(kept<kernel>::add(std::make_shared<const kernel>(std::move(k)))) {}
  held(const held &) = delete;
  held &operator=(const held &) = delete;
  ~held() { kept<kernel>::remove(number); }
};

} // namespace operators::card
