// The motion that a controller follows: cubic positions between rows over time.
#pragma once

#include "simulate/system/manifold.hpp"
#include "simulate/system/over_time.hpp"

namespace ksl::simulating {

class motion_asked {
public:
  motion_asked(const model &m, const manifold &space, const drive_law &law);

  /// The motion of a run at time t; the arrays stay until the next call.
  void find_at(std::size_t run, double t);
  const double *q() const { return q_.data(); }
  const double *v() const { return v_.data(); }
  const double *a() const { return a_.data(); }

private:
  const drive_law &law_;
  const manifold &space_;
  std::size_t nq_, nv_;
  std::vector<double> q_, v_, a_, way_, end_, step_, rate_;
};

} // namespace ksl::simulating
