// Closed positions near open ones, and motions that keep loops closed.
#pragma once

#include "engine/loops/elimination.hpp"
#include "engine/loops/geometry.hpp"
#include "engine/loops/least_norm.hpp"
#include "ksl/loops.hpp"

#include <limits>

namespace ksl::loops {

/// The error of a closed position, in lengths of the mechanism, and what rounding of its numbers q (nq) makes of it: a crank that has turned
/// a thousand times is known to 1e-12 rad.  Numbers whose rounding is more than what ranks are judged by close nothing.
inline double closed_within(const tables &t, const double *q, int nq) {
  const double converged = loop_tolerance::closed + loop_tolerance::closed_by_digits * t.digits;
  constexpr double rounding = 4 * std::numeric_limits<double>::epsilon();
  double most = 0;
  for (int i = 0; i < nq; ++i)
    most = std::max(most, std::fabs(q[i]));
  return std::min(converged + rounding * most, rank_within(t, 0)) * t.length;
}

class assembly {
public:
  assembly(const model &m) : m_(m), t_(m.loop_tables()), g_(m, t_) {}

  void lay_out(arena &memory);

  /// As ksl::close; out may be q.
  closing close(const double *q, const unsigned char *hold, const close_options &options, double *out, double *error);

  /// Velocities x (nv) at q with K x = 0 and the given coordinates as in `near`, nearest to it; x may be `near`.  Where coordinates are given, an idle
  /// body none of whose coordinates are has no spin.
  completion complete_velocity(const double *q, const double *near, const unsigned char *given, double *x);

  /// The velocity nearest to `near` that completes the given ones, at the position that is set, idle bodies nearest to `near`, too.
  completion nearest_velocity(const double *near, const unsigned char *given, double *x) {
    return complete({nullptr, nullptr, near}, given, nullptr, x);
  }

  /// Accelerations at q and v: K x = −K̇ v, and idle bodies as for velocities.
  completion complete_acceleration(const double *q, const double *v, const double *near, const unsigned char *given,
                                   double *x);

  geometry &at() { return g_; }

private:
  struct request {
    const double *q, *v, *near; ///< q null: idle bodies may spin; v null: `near` are velocities
  };
  /// x (nv) with K x = b for all equations.  b null: zero.  terms: of b before they cancelled, as lengths.
  completion complete(const request &at, const unsigned char *given, const double *b, double *x, double terms = 0);
  const double *with_spins(const request &at, const unsigned char *given);
  double set_error(const double *q);
  void set_step();
  double longest_share() const;
  bool descend(double *q, int iterations, const close_options &options);
  bool descend_from(double *q, const unsigned char *hold, const close_options &options);
  void set_start(const double *q, const unsigned char *hold, int start);
  bool search(const double *q, const unsigned char *hold, const close_options &options, double *out, double *error);
  void step(const double *q, const double *dv, double share, double *out);
  bool keep_limits(double *q);
  double way_back(const double *start, const double *q, double &far);
  void move_nearer(const double *start, double *q, const close_options &options);
  double distance(const double *start, const double *q, double *d);

  const model &m_;
  const tables &t_;
  geometry g_;
  least_norm solve_;
  elimination eliminate_;
  double *error_ = nullptr, *right_ = nullptr, *step_ = nullptr, *trial_ = nullptr, *far_ = nullptr, *kept_ = nullptr,
         *begin_ = nullptr, *other_ = nullptr, *tangent_ = nullptr, *kept_step_ = nullptr, *with_spins_ = nullptr,
         *scales_ = nullptr;
  unsigned char *fixed_ = nullptr;
  double *reached_ = nullptr; ///< error after `descend`
  bool at_limits_ = false, lost_rank_ = false, is_determined_ = false;
};

/// As ksl::close, in the memory of the thread if d is null: to make a workspace takes a microsecond.
closing close(const model &m, data *d, const double *q, const unsigned char *hold, const close_options &options,
              double *out, double *error);

} // namespace ksl::loops
