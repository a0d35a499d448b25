// The function that programs of JAX call: it computes a stage of an operator on XLA's own arrays.
#pragma once

#include "compute.hpp"
#include "kept.hpp"
#include "operation.hpp"
#include "xla.hpp"

#include <cstring>

namespace operators::ffi {

inline xla::error *fail(const xla::call_frame &frame, const std::string &sentence, xla::code code) {
  xla::error_arguments arguments = {sizeof(xla::error_arguments), nullptr, sentence.c_str(), code};
  // cppcheck-suppress returnDanglingLifetime ; the error has a copy of the sentence
  return frame.api->create_error(&arguments);
}

/// A whole number among the constants of the call.
inline std::int64_t constant(const xla::call_frame &frame, const char *name) {
  const xla::attributes &all = frame.constants;
  for (std::int64_t i = 0; i < all.n; ++i) {
    const xla::text &found = *all.name[i];
    if (found.length != std::strlen(name) || std::memcmp(found.first, name, found.length) != 0)
      continue;
    const auto &scalar = *static_cast<const xla::scalar *>(all.each[i]);
    if (all.kind[i] == xla::is_scalar && scalar.type == xla::number_type::s64)
      return *static_cast<const std::int64_t *>(scalar.value);
  }
  throw std::invalid_argument(std::string("the call has no whole number ") + name);
}

inline const xla::buffer &buffer(const xla::buffers &all, std::int64_t i) {
  if (all.kind[i] != xla::is_buffer)
    throw std::invalid_argument("an argument is no array");
  return *static_cast<const xla::buffer *>(all.each[i]);
}

template <class S> void run(const xla::call_frame &frame, const operation &of, stage what, int threads) {
  arrays<S> given;
  const auto take = [&](const xla::buffers &all, auto &into) {
    for (std::int64_t i = 0; i < all.n; ++i) {
      const xla::buffer &b = buffer(all, i);
      if (b.type != buffer(frame.arguments, 0).type)
        throw std::invalid_argument("arrays of different precision");
      into.push_back(static_cast<S *>(b.data));
    }
  };
  take(frame.arguments, given.in);
  take(frame.results, given.out);
  const xla::buffer &first = buffer(frame.arguments, 0);
  if (static_cast<int>(given.in.size()) != inputs_of(what, of.buffers()) ||
      static_cast<int>(given.out.size()) != outputs_of(what, of.buffers()) || first.rank != 3 ||
      first.shape[2] != of.width(0))
    throw std::invalid_argument("arguments don't fit the operator");
  given.groups = static_cast<std::size_t>(first.shape[0]), given.states = static_cast<std::size_t>(first.shape[1]);
  compute(of, what, given, threads);
}

inline xla::error *execute(const xla::call_frame &frame) {
  const std::shared_ptr<const operation> of = kept<operation>::find(constant(frame, "operator"));
  if (!of)
    throw std::invalid_argument(
        "the model of this compiled function is of another process, or is gone; compile the function here");
  const std::int64_t number = constant(frame, "stage");
  if (number < 0 || number >= stages)
    throw std::invalid_argument("there is no stage of this number");
  const auto what = static_cast<stage>(number);
  const int threads = static_cast<int>(constant(frame, "threads"));
  if (frame.arguments.n == 0)
    throw std::invalid_argument("a call without arguments");
  switch (buffer(frame.arguments, 0).type) {
  case xla::number_type::f64: return run<double>(frame, *of, what, threads), nullptr;
  case xla::number_type::f32: return run<float>(frame, *of, what, threads), nullptr;
  case xla::number_type::s64: break;
  }
  throw std::invalid_argument("arrays are neither float32 nor float64");
}

/// What XLA calls, once to learn for which version of the interface it is made, and then for each step of a program.
template <xla::error *(*execute)(const xla::call_frame &), std::uint32_t traits>
xla::error *handle(xla::call_frame *frame) {
  if (frame->first && frame->first->type == xla::metadata_extension) {
    xla::metadata &of = *reinterpret_cast<xla::with_metadata *>(frame->first)->of;
    // Structs grow at their ends within a major version; XLA refuses one that it doesn't serve.
    of.api.major = xla::known_major, of.api.minor = frame->api ? frame->api->api.minor : 1;
    of.traits = traits;
    return nullptr;
  }
  if (frame->what != xla::step::execute)
    return nullptr;
  try {
    return execute(*frame);
  } catch (const std::exception &e) {
    return fail(*frame, std::string("ksl: ") + e.what(), xla::code::invalid_argument);
  }
}

} // namespace operators::ffi
