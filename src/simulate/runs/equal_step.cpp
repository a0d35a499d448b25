//     start_ ──────── step h ────────▸ end_
//     start_ ── share · h ──▸ within_
#include "simulate/runs/equal_step.hpp"

#include "simulate/methods/methods.hpp"

namespace ksl::simulating {

equal_step::equal_step(system &of, stepping how)
    : of_(of), method_(make_method(how, of, 1)), start_(of, 1), end_(of, 1), within_(of, 1) {
  start_.n = 1;
}

bool equal_step::begin(double t, const double *q, const double *v, double work) {
  start_.t = t, start_.work[0] = work;
  std::copy_n(q, of_.nq(), start_.q.data());
  std::copy_n(v, of_.nv(), start_.v.data());
  has_rates_ = is_astray_ = false;
  method_->begin(start_);
  return true;
}

outcome equal_step::attempt(double h) {
  if (!has_rates_ && !of_.accelerate(start_.t, start_.first, 1, start_.q.data(), start_.v.data(), start_.a.data(),
                                     start_.power.data()))
    return outcome::stopped;
  has_rates_ = true;
  h_ = h, end_ = start_;
  return method_->step(of_, end_, h);
}

outcome equal_step::at(double share, double *q, double *v, double *work) {
  const block *found = share <= 0 ? &start_ : share >= 1 ? &end_ : &within_;
  // a method that remembers more than the state, as the variational one its momenta, has to begin anew, now and at the end (is_astray_)
  if (found == &within_) {
    is_astray_ = true;
    within_ = start_;
    method_->begin(within_);
    if (const outcome how = method_->step(of_, within_, share * h_); how != outcome::done)
      return how;
  }
  std::copy_n(found->q.data(), of_.nq(), q);
  std::copy_n(found->v.data(), of_.nv(), v);
  *work = found->work[0];
  return outcome::done;
}

void equal_step::accept(double t) {
  std::swap(start_, end_);
  start_.t = t;
  has_rates_ = false;
  if (is_astray_)
    method_->begin(start_);
  is_astray_ = false;
}

} // namespace ksl::simulating
