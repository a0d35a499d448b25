// What a function must look like that programs of XLA call: the part of its foreign function interface that KSL uses.
//
// The interface is one of C structs, each of which begins with its size, and is meant for code that is compiled apart from XLA.  These are
// declarations of our own, so that KSL is built without JAX, and one build serves all of its releases; test/operators/xla_test.py compares
// them with the header that jaxlib brings.
#pragma once

#include <cstddef>
#include <cstdint>

namespace xla {

struct extension {
  std::size_t size;
  int type;
  extension *next;
};
constexpr int metadata_extension = 1;
/// A trait: what is put into a stream may be recorded, and run again without a call.
constexpr std::uint32_t may_be_recorded = 1;

struct version {
  std::size_t size;
  extension *first;
  int major, minor;
};
constexpr int known_major = 0;

struct metadata {
  std::size_t size;
  version api;
  std::uint32_t traits;
};
struct with_metadata {
  extension base;
  metadata *of;
};

struct error;
enum class code : int { invalid_argument = 3, internal = 13 };
struct error_arguments {
  std::size_t size;
  extension *first;
  const char *message;
  code of;
};

struct stream_arguments {
  std::size_t size;
  extension *first;
  void *context, *stream;
};

/// The functions of XLA; there are more behind these.
struct functions {
  std::size_t size;
  extension *first;
  version api;
  const void *internal;
  error *(*create_error)(error_arguments *);
  const void *others[3];
  error *(*get_stream)(stream_arguments *);
};

enum class number_type : int { s64 = 5, f32 = 11, f64 = 12 };
struct buffer {
  std::size_t size;
  extension *first;
  number_type type;
  void *data;
  std::int64_t rank;
  std::int64_t *shape;
};
struct scalar {
  number_type type;
  void *value;
};
struct text {
  const char *first;
  std::size_t length;
};

/// Arguments, and results: kinds and pointers; a kind of 1 is a buffer.
struct buffers {
  std::size_t size;
  extension *first;
  std::int64_t n;
  int *kind;
  void **each;
};
/// Constants of the call, by name; a kind of 3 is a scalar.
struct attributes {
  std::size_t size;
  extension *first;
  std::int64_t n;
  int *kind;
  text **name;
  void **each;
};
constexpr int is_buffer = 1, is_scalar = 3;

enum class step : int { instantiate, prepare, initialize, execute };

struct call_frame {
  std::size_t size;
  extension *first;
  const functions *api;
  void *context;
  step what;
  buffers arguments, results;
  attributes constants;
};

} // namespace xla
