// The interface that a library must have to be measured: a C ABI, so that libraries built by different compilers with different
// options can be loaded into one process and run in turns.
//
// Every peer gets the same model as flat arrays and the same states, and gives results in one common layout: SI units,
// joints in the order of the model, six-vectors linear first, a floating base with q = [x y z qx qy qz qw] and
// v = [linear, angular] in the body's frame.  Conversions are not part of the timed runs.
#pragma once

#include <cstddef>

extern "C" {

/// bench_other: a kind that only KSL is measured with.
enum bench_joint_kind { bench_revolute, bench_prismatic, bench_floating, bench_other };

/// A joint and the body that it carries, including all links welded to it.
struct bench_joint {
  int kind;
  int nq, nv;         ///< its numbers in q and in v; nq = nv + 1: a unit quaternion xyzw is the last of them
  int parent;         ///< joint; −1: the world
  double rotation[9]; ///< of the joint's frame in the parent's, row-major, at q = 0
  double position[3]; ///< its origin there
  double axis[3];     ///< in the joint's frame
  double mass;        ///< of the body
  double centroid[3]; ///< in the joint's frame
  double inertia[6];  ///< about the centroid, in the joint's axes: xx yy zz xy yz zx
};

struct bench_model {
  const char *urdf; ///< the file that the arrays were made from
  int floating_base;
  int joints, nq, nv;
  const bench_joint *joint;
  int frame; ///< the joint whose frame is asked for where an operation is about one frame: the last of the deepest
  double gravity[3];
};

/// n states, a row for each state.
struct bench_states {
  size_t n;
  const double *q, *v, *a, *tau;
};

/// An operation that can be timed.
struct bench_operation {
  const char *name;    ///< one of quantities.hpp
  const char *variant; ///< a convention or method; for each peer and name the fastest one counts
  int batch;           ///< whole batch in one call, or a loop over single states
  int single;          ///< float
  int threads;
};

struct bench_peer {
  const char *name;    ///< what the table shows: library and compiler
  const char *library; ///< peers of one library compete for "best"
  const char *version;
  int operations;
  const bench_operation *operation;
  /// Creates a model with memory for results; null if the library doesn't support the model.  States are copied.
  void *(*create)(const bench_model *, const bench_states *few, const bench_states *many);
  void (*destroy)(void *);
  /// Evaluates an operation for all few states (or many, for batches).  out: null, or rows of results.
  void (*run)(void *, int operation, double *out);
  /// Bytes of workspace for each state computed at a time; 0 if unknown.
  size_t (*state_bytes)(void *);
};

__attribute__((visibility("default"))) const bench_peer *bench_peer_table(void);
}
