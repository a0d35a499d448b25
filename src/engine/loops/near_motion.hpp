// A mechanism moved with those of its loops' equations left out that depend on the others but for a limit (exact_frames.hpp).
#pragma once

#include "engine/loops/elimination.hpp"
#include "engine/loops/geometry.hpp"
#include "engine/loops/least_norm.hpp"
#include "engine/loops/own_memory.hpp"

#include <vector>

namespace ksl::loops {

/// A position from which closed ones are looked for, the same in every run: number 0 is the neutral one.
std::vector<double> start_position(const model &m, int number);

/// Equations are scaled by the length of their own loop, so that a small loop of a large machine counts as much as others: lengths are those of
/// loops, and errors are relative to them.
class near_motion {
public:
  /// t may be changed between calls, but not in its sizes.
  near_motion(const model &m, const tables &t);

  /// A position, and how open it is: relative to the length of each loop, the largest, and of which equation.
  struct position {
    std::vector<double> q;
    double open = 0;
    int row = 0;
  };

  /// Moves a position to the nearest at which the independent equations are closed; those that depend on others but for `zero` are left out.
  /// fixed (nv) coordinates stay; may be null.
  void close(position &at, double zero, const unsigned char *fixed = nullptr);

  /// Elimination at a position with this limit of pivots.
  const elimination &factor(const position &at, double zero);

  /// Positions around one, each with other values of its independent coordinates, away from it by `far` rad or lengths, less where the way is
  /// shorter; empty where one of them is open by more than `most`: what seemed to be freedoms are those of an instant.
  std::vector<position> around(const position &base, double zero, double most, double far, int n);

  geometry &at() { return g_; }
  const double *errors() const { return error_; }

private:
  void lay_out(arena &memory);
  void set(position &at);
  void step(const position &from, const double *dv, double share, position &to);

  const model &m_;
  const tables &t_;
  geometry g_;
  elimination k_;
  least_norm solve_;
  std::vector<double> row_scale_, column_scale_, length_of_column_;
  double *error_ = nullptr, *right_ = nullptr, *step_ = nullptr, *tangent_ = nullptr;
  std::vector<unsigned char> none_;
  own_memory memory_;
};

} // namespace ksl::loops
