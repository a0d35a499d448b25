// KSL: inverse kinematics: positions q at which frames have given poses, by damped least squares within the joints' limits.
//
// e are the weighted errors of the frames and J is their Jacobian by the joints.  A step of Levenberg (1944) and Marquardt (1963) solves
//
//     (Jᵀ J + λ 1) step = Jᵀ e,                                                                                   (1)
//
// with the damping λ in proportion to the squared error (Sugihara, IEEE Trans. Robotics 27 (2011) 984): steps are cautious far from
// the target, and those of Gauss and Newton near it.  A joint that is at a limit, and would cross it with the step, is held there.
// If a start doesn't lead to the target, another one is drawn.
//
// Each lane of a pack has a target of its own.  When it is done, it takes the next, so that no lane waits for the slowest.
//
// Where joints follow others (coupling.hpp), positions are those of the expanded mechanism.  Columns of followers are added to those
// of their leaders, Ĵ G, and the limits of leaders are narrowed so that followers keep theirs.
#pragma once

#include "ksl/engine/algorithms/batch_view.hpp"
#include "ksl/engine/algorithms/kinematics/frame_jacobian.hpp"
#include "ksl/engine/model/coupling.hpp"
#include "ksl/engine/steps/positive_definite.hpp"

#include <cstdint>

namespace ksl {

/// A frame that is to reach a pose.  The weights say how much the errors of its position and of its orientation count.  With equal
/// weights, an error of the position by a twentieth of the length of the chain that carries the frame counts as much as an error of the
/// orientation by one radian.  An error with zero weight is ignored.  Only the ratios of weights matter.
struct wanted_frame {
  int link = 0;
  double position_weight = 1, orientation_weight = 1;
};

struct inverse_kinematics_options {
  int frames_n = 0;
  const wanted_frame *frames = nullptr; ///< (frames_n)
  double position_tolerance = 1e-6;     ///< m
  double orientation_tolerance = 1e-6;  ///< rad
  int iterations = 40;                  ///< at most, from each start
  int starts = 5;                       ///< at most: the given one, if any, and random ones
  std::uint64_t seed = 0;
  bool limits = true; ///< are the joints' limits to be kept
};

/// How the attempts for a target ended: converged, or why the best of them stopped.  It had no iterations left, was held by limits, or
/// made no progress, as in a local minimum of the error.
enum class inverse_kinematics_end : int { converged, iterations, limits, stuck };

/// Targets, and what is found for them.  Without starts, random ones are drawn.  Results without memory are not stored.
template <class S> struct inverse_kinematics_batch {
  std::size_t n = 0;
  rows_view<const S> start = {};  ///< rows of nq
  rows_view<const S> target = {}; ///< rows of frames_n × 4 × 4: poses in the world, row-major, m
  rows_view<S> q = {};            ///< rows of nq: needed
  rows_view<S> error = {};        ///< rows of 2: the largest error of a position, m, and of an orientation, rad
  int *end = nullptr;             ///< (n) inverse_kinematics_end
  int *iterations = nullptr;      ///< (n) iterations from all starts together
  int *starts = nullptr;          ///< (n) how many were used
};

inline namespace KSL_ISA {

template <class P> struct inverse_kinematics_workspace {
  pose_workspace<P> pose;
  P *q, *lower, *upper;    ///< (nq)
  P *step;                 ///< (nv)
  SE3<P> *target;          ///< (frames)
  P *columns;              ///< (coordinates, 6 frames): a row for each coordinate, weighted
  P *error;                ///< (6 frames), weighted
  scalar_of<P> *per_metre; ///< (frames) weight of the error of a position, per metre
  double heaviest;         ///< the largest weight, by which all are divided
  P *matrix, *solution;    ///< (size, size), (size); size is the smaller one of coordinates and 6 frames
  int *coordinate;         ///< (nv) the coordinate's row in `columns`; −1: it moves no frame
  bool *leads;             ///< (nv) do others follow the coordinate
  int *body;               ///< (bodies) those that move the frames, or whose followers do
  int coordinates, bodies;

  KSL_LANES void lay_out(arena &memory, const model_view<scalar_of<P>> &model, int frames) {
    pose.lay_out(memory, model);
    q = memory.take<P>(model.nq), lower = memory.take<P>(model.nq), upper = memory.take<P>(model.nq);
    step = memory.take<P>(model.nv);
    target = memory.take<SE3<P>>(frames);
    columns = memory.take<P>(6 * frames * model.nv);
    error = memory.take<P>(6 * frames);
    per_metre = memory.take<scalar_of<P>>(frames);
    const int size = model.nv < 6 * frames ? model.nv : 6 * frames;
    matrix = memory.take<P>(size * size), solution = memory.take<P>(size);
    coordinate = memory.take<int>(model.nv), leads = memory.take<bool>(model.nv);
    body = memory.take<int>(model.bodies);
  }
};

/// Errors of the frames at a position: the largest square of a position's error and of an orientation's, not weighted, and the sum of
/// all weighted squares.
template <class P> struct pose_errors { P position, orientation, cost; };

template <class P> KSL_LANES P larger(const P &a, const P &b) { return math<P>::select(a > b, a, b); }
template <class P> KSL_LANES P smaller(const P &a, const P &b) { return math<P>::select(a < b, a, b); }

/// 2 n for a rotation R by nearly half a turn about the unit vector n.  R + 1 is nearly 2 n nᵀ, so that its longest column has the
/// direction of n.
template <class P> KSL_LANES vec3<P> half_turn_vector(const mat3x3<P> &R) {
  const P one = P(1);
  vec3<P> column = {R.m00 + one, R.m10, R.m20};
  P longest = R.m00; // the largest element of the diagonal: column k has the square 2 (1 + R_kk)
  const auto consider = [&](const P &diagonal, const P &x, const P &y, const P &z) KSL_INLINED {
    column.x = math<P>::select(diagonal > longest, x, column.x);
    column.y = math<P>::select(diagonal > longest, y, column.y);
    column.z = math<P>::select(diagonal > longest, z, column.z);
    longest = larger(longest, diagonal);
  };
  consider(R.m11, R.m01, R.m11 + one, R.m21);
  consider(R.m22, R.m02, R.m12, R.m22 + one);
  const P scale = math<P>::sqrt(P(2) / (one + longest));
  return {scale * column.x, scale * column.y, scale * column.z};
}

/// 2 sin(θ/2) times the axis of a rotation by θ: near the rotation vector where θ is small.
template <class P> KSL_LANES vec3<P> half_sine_vector(const mat3x3<P> &R) {
  const P half = P(0.5), least = P(1e-6), square = P(0.25) * (R.m00 + R.m11 + R.m22 + P(1)); // cos²(θ/2)
  const P scale = half / math<P>::sqrt(larger(square, least));
  const vec3<P> of_half_turn = half_turn_vector(R); // at half a turn, R − Rᵀ is zero
  return {math<P>::select(square > least, scale * (R.m21 - R.m12), of_half_turn.x),
          math<P>::select(square > least, scale * (R.m02 - R.m20), of_half_turn.y),
          math<P>::select(square > least, scale * (R.m10 - R.m01), of_half_turn.z)};
}

/// Adds the columns of followers to those of their leaders, Ĵ G, and clears the columns of the followers, so that they get no steps.
template <class P>
void fold_followers(const coupling_view<scalar_of<P>> &coupling, const inverse_kinematics_workspace<P> &w, int rows) {
  for (int i = 0; i < coupling.followers; ++i) {
    const follower<scalar_of<P>> &f = coupling.follower[i];
    if (w.coordinate[f.v] < 0)
      continue;
    P *const own = w.columns + w.coordinate[f.v] * rows, *const leader = w.columns + w.coordinate[f.leader_v] * rows;
    for (int r = 0; r < rows; ++r)
      leader[r] = leader[r] + P(f.multiplier) * own[r], own[r] = P(0);
  }
}

/// The largest weight, or 1 where all are zero.
inline double heaviest_weight(const inverse_kinematics_options &options) {
  double most = 0;
  for (int f = 0; f < options.frames_n; ++f) {
    const wanted_frame &frame = options.frames[f];
    most = frame.position_weight > most ? frame.position_weight : most;
    most = frame.orientation_weight > most ? frame.orientation_weight : most;
  }
  return most > 0 ? most : 1;
}

/// Sets the weighted errors e of all frames at w.q and their Jacobian J, both in the frames' axes.  Returns the size of the errors.
template <class P> pose_errors<P> errors_and_columns(const model_view<scalar_of<P>> &model,
                                                     const coupling_view<scalar_of<P>> &coupling,
                                                     const inverse_kinematics_workspace<P> &w,
                                                     const inverse_kinematics_options &options) {
  using A = algebra<P>;
  pose_errors<P> largest = {P(0), P(0), P(0)};
  const int rows = 6 * options.frames_n;
  // some coordinates may not move all frames: their numbers stay zero
  if (options.frames_n > 1 || coupling.followers > 0)
    for (int i = 0; i < w.coordinates * rows; ++i)
      w.columns[i] = P(0);
  for (int f = 0; f < options.frames_n; ++f) {
    const wanted_frame &frame = options.frames[f];
    const P position(w.per_metre[f]), orientation(static_cast<scalar_of<P>>(frame.orientation_weight / w.heaviest));
    const int last = model.link[frame.link].body;
    sines_and_cosines_of_supports(model, w.pose, w.q, last);
    SE3<P> D = walk_supports(model, w.pose, w.q, body_in_frame<P>(model, frame.link, {}), last, 0,
                             [&]<joint_kind K>(int i, const SE3<P> &in_frame) KSL_INLINED {
                               const body<scalar_of<P>> &b = model.body[i];
                               for_coordinates<K>(b, [&](auto k) KSL_INLINED {
                                 const screw<P> s = column_in<K>(k, b, in_frame);
                                 P *const out = w.columns + w.coordinate[b.v_index + k] * rows + 6 * f;
                                 out[0] = position * s.lin.x, out[1] = position * s.lin.y, out[2] = position * s.lin.z;
                                 out[3] = orientation * s.ang.x, out[4] = orientation * s.ang.y,
                                 out[5] = orientation * s.ang.z;
                               });
                             });
    A::product_dd(&D, &w.target[f], &D); // the target in the frame
    const vec3<P> turn = half_sine_vector(D.R);
    P *const e = w.error + 6 * f;
    e[0] = position * D.t.x, e[1] = position * D.t.y, e[2] = position * D.t.z;
    e[3] = orientation * turn.x, e[4] = orientation * turn.y, e[5] = orientation * turn.z;
    if (frame.position_weight > 0)
      largest.position = larger(largest.position, A::dot_vv(&D.t, &D.t));
    if (frame.orientation_weight > 0)
      largest.orientation = larger(largest.orientation, A::dot_vv(&turn, &turn));
    for (int r = 0; r < 6; ++r)
      largest.cost = largest.cost + e[r] * e[r];
  }
  fold_followers(coupling, w, rows);
  return largest;
}

inline constexpr double whole_turn = 6.283185307179586;

/// The position of a joint that turns.  If q has reached a limit, it is a whole turn back from there, the same orientation, as long as
/// that is within the limits.
template <class P> KSL_LANES P within_turns(const P &q, const P &lower, const P &upper) {
  const P turn = P(scalar_of<P>(whole_turn));
  const P back = math<P>::select(q - turn >= lower, q - turn, q),
          forth = math<P>::select(q + turn <= upper, q + turn, q);
  return math<P>::select(q >= upper, back, math<P>::select(q <= lower, forth, q));
}

/// The first number of a joint's position that can be held at a limit; all that follow it can.  nv if there is none.  Such a number
/// must have a coordinate of the velocity as its rate.  Quaternions have none, and neither have the numbers before an angle, as those
/// of a planar joint: its velocities are along axes that turn with the angle.
template <joint_kind K>
constexpr int first_held = joint<K>::nq != joint<K>::nv || (joint<K>::nv == 1 && !joint<K>::has_limits) ? joint<K>::nv
                           : joint<K>::angle > 0 ? joint<K>::angle
                                                 : 0;

/// Holds coordinates that are at a limit and would cross it, by clearing their columns.  The sign of Jᵀ e says where a coordinate goes.
template <class P>
void hold_at_limits(const model_view<scalar_of<P>> &model, const inverse_kinematics_workspace<P> &w, int rows) {
  const P zero = P(0), one = P(1);
  for (int k = 0; k < w.bodies; ++k) {
    const body<scalar_of<P>> &b = model.body[w.body[k]];
    by_every_kind(b.kind, [&]<joint_kind K>() KSL_INLINED {
      if constexpr (first_held<K> < joint<K>::nv)
        for (int c = first_held<K>; c < joint<K>::nv; ++c) {
          P *const column = w.columns + w.coordinate[b.v_index + c] * rows;
          P slope = zero;
          for (int r = 0; r < rows; ++r)
            slope = slope + column[r] * w.error[r];
          const P q = w.q[b.q_index + c];
          const P below = math<P>::select(q <= w.lower[b.q_index + c], smaller(slope, zero), zero);
          const P above = math<P>::select(q >= w.upper[b.q_index + c], larger(slope, zero), zero);
          P free = math<P>::select(above - below > zero, zero, one);
          if constexpr (only_turns(
                            K)) // if the limits are a whole turn apart, it goes on at the other one (within_turns)
            if (!w.leads[b.v_index])
              free = math<P>::select(w.upper[b.q_index] - w.lower[b.q_index] >= P(scalar_of<P>(whole_turn)), one, free);
          for (int r = 0; r < rows; ++r)
            column[r] = free * column[r];
        }
    });
  }
}

/// The damped step (1).  of_errors: there are fewer errors than coordinates, and the solution x is of (J Jᵀ + λ 1) x = e.  The step is
/// then Jᵀ x, the same as that of (1).
template <bool of_errors, int N, class P>
void damped_step(const inverse_kinematics_workspace<P> &w, int rows, const P &damping, matrix_size<N> n) {
  P *const M = w.matrix, *const x = w.solution;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j <= i; ++j)
      M[i * n + j] = P(0);
    x[i] = of_errors ? w.error[i] : P(0);
  }
  if constexpr (of_errors) {
    for (int c = 0; c < w.coordinates; ++c) {
      const P *const s = w.columns + c * n;
      for (int i = 0; i < n; ++i)
        for (int j = 0; j <= i; ++j)
          M[i * n + j] = M[i * n + j] + s[i] * s[j];
    }
  } else {
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j <= i; ++j)
        for (int r = 0; r < rows; ++r)
          M[i * n + j] = M[i * n + j] + w.columns[i * rows + r] * w.columns[j * rows + r];
      for (int r = 0; r < rows; ++r)
        x[i] = x[i] + w.columns[i * rows + r] * w.error[r];
    }
  }
  P trace = P(0);
  for (int i = 0; i < n; ++i)
    trace = trace + M[i * n + i];
  const P lambda = damping + P(64 * math<scalar_of<P>>::epsilon) * trace + P(math<scalar_of<P>>::epsilon);
  for (int i = 0; i < n; ++i)
    M[i * n + i] = M[i * n + i] + lambda;
  factorise<N>(M, n);
  solve_factorised<N>(M, x, n);
}

/// Element c of the step, from the solution of damped_step.
template <class P> P step_of(const inverse_kinematics_workspace<P> &w, int rows, int c) {
  if (w.coordinates < rows)
    return w.solution[c];
  P x = P(0);
  for (int r = 0; r < rows; ++r)
    x = x + w.columns[c * rows + r] * w.solution[r];
  return x;
}

/// Positions of followers, from those of their leaders.
template <class P> void place_followers(const coupling_view<scalar_of<P>> &coupling, P *q) {
  for (int i = 0; i < coupling.followers; ++i) {
    const follower<scalar_of<P>> &f = coupling.follower[i];
    q[f.q] = P(f.multiplier) * q[f.leader_q] + P(f.offset);
  }
}

/// Moves w.q by a damped step, in the lanes where `active` is one; where it is zero q stays.
template <class P> void improve(const model_view<scalar_of<P>> &model, const coupling_view<scalar_of<P>> &coupling,
                                const inverse_kinematics_workspace<P> &w, const inverse_kinematics_options &options,
                                const P &cost, const P &active) {
  constexpr double damping = 0.2, longest = 1; // of the squared error; rad or m
  const int rows = 6 * options.frames_n;
  if (options.limits)
    hold_at_limits(model, w, rows);
  const P lambda = P(scalar_of<P>(damping)) * cost;
  if (w.coordinates < rows)
    damped_step<false>(w, rows, lambda, matrix_size<0>{w.coordinates});
  else if (rows == 6)
    damped_step<true>(w, rows, lambda, matrix_size<6>{});
  else
    damped_step<true>(w, rows, lambda, matrix_size<0>{rows});
  P largest = P(0);
  for (int k = 0; k < w.bodies; ++k) {
    const body<scalar_of<P>> &b = model.body[w.body[k]];
    for (int v = b.v_index; v < b.v_index + b.nv; ++v) {
      w.step[v] = step_of(w, rows, w.coordinate[v]);
      largest = larger(largest, math<P>::fabs(w.step[v]));
    }
  }
  const P limit = P(scalar_of<P>(longest));
  const P scale = active * math<P>::select(largest > limit, limit / larger(largest, limit), P(1));
  for (int k = 0; k < w.bodies; ++k) {
    const body<scalar_of<P>> &b = model.body[w.body[k]];
    for (int v = b.v_index; v < b.v_index + b.nv; ++v)
      w.step[v] = scale * w.step[v];
    by_every_kind(b.kind, [&]<joint_kind K>() KSL_INLINED {
      P moved[joint<K>::nq];
      joint<K>::integrate(w.q + b.q_index, w.step + b.v_index, moved);
      if constexpr (only_turns(K))
        if (!w.leads[b.v_index]) // a whole turn of a leader would move its followers by another angle
          moved[0] = options.limits ? within_turns(moved[0], w.lower[b.q_index], w.upper[b.q_index]) : moved[0];
      for (int c = 0; c < joint<K>::nq; ++c) {
        P &q = w.q[b.q_index + c];
        const P there =
            options.limits ? smaller(larger(moved[c], w.lower[b.q_index + c]), w.upper[b.q_index + c]) : moved[c];
        q = math<P>::select(active > P(0), there, q); // a step of zero would normalise quaternions
      }
    });
  }
  place_followers(coupling, w.q);
}

/// A random number in [0, 1) for a key: SplitMix64 (Steele, Lea, Flood 2014).
inline double random_number(std::uint64_t key) {
  std::uint64_t x = key + 0x9e3779b97f4a7c15u;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return static_cast<double>((x ^ (x >> 31)) >> 11) * 0x1p-53;
}

/// The target that a lane works on, and how far it is.
struct inverse_kinematics_lane {
  std::size_t state; ///< index of the target
  bool busy = false;
  int start;                                      ///< how many starts it has begun
  int iterations, since_progress, all_iterations; ///< from this start; from all
  double least, best; ///< the least cost from this start; the cost of the result that is stored
};

/// Solves the targets [first, end) of a batch, a target in each lane.
template <class P> class inverse_kinematics_solver {
public:
  using S = scalar_of<P>;
  static constexpr int lanes = static_cast<int>(sizeof(P) / sizeof(S));

  inverse_kinematics_solver(const model_view<S> &model, const coupling_view<S> &coupling,
                            const inverse_kinematics_options &options, const inverse_kinematics_batch<S> &batch)
      : model_(model), coupling_(coupling), options_(options), batch_(batch) {}

  void lay_out(arena &memory) { w_.lay_out(memory, model_, options_.frames_n); }

  void solve(std::size_t first, std::size_t end) {
    begin();
    std::size_t next = first;
    for (int l = 0; l < lanes && next < end; ++l)
      take(l, next++);
    for (int busy = 1; busy > 0;) {
      const pose_errors<P> errors = errors_and_columns(model_, coupling_, w_, options_);
      P moves = P(0);
      busy = 0;
      for (int l = 0; l < lanes; ++l) {
        if (!lane_[l].busy)
          continue;
        if (goes_on(l, double(number(&errors.position, l)), double(number(&errors.orientation, l)),
                    double(number(&errors.cost, l))))
          set(&moves, l, S(1));
        else if (!lane_[l].busy && next < end)
          take(l, next++);
        busy += lane_[l].busy;
      }
      if (busy > 0)
        improve(model_, coupling_, w_, options_, errors.cost, moves);
    }
  }

private:
  /// numbers: how many numbers a user's position has.  at: where number i of these is in the expanded position.  user_index: the
  /// inverse of at.
  int numbers() const { return coupling_.followers > 0 ? coupling_.nq : model_.nq; }
  int at(int i) const { return coupling_.followers > 0 ? coupling_.in_q[i] : i; }
  int user_index(int expanded) const {
    if (coupling_.followers == 0)
      return expanded;
    int i = 0;
    while (at(i) < expanded) // numbers keep their order
      ++i;
    return i;
  }

  static S number(const P *x, int lane) { return reinterpret_cast<const S *>(x)[lane]; }
  static void set(P *x, int lane, S value) { reinterpret_cast<S *>(x)[lane] = value; }

  /// Sets what is the same for all targets: limits, weights, and the coordinates that move the frames.  Lanes without a target stay at
  /// zero.
  void begin() {
    for (int i = 0; i < model_.nq; ++i)
      w_.lower[i] = P(model_.lower[i]), w_.upper[i] = P(model_.upper[i]), w_.q[i] = P(S(0));
    for (int i = 0; i < model_.nv; ++i)
      w_.coordinate[i] = -1, w_.leads[i] = false, w_.step[i] = P(S(0));
    w_.heaviest = heaviest_weight(options_);
    for (int f = 0; f < options_.frames_n; ++f) {
      w_.target[f] = ground_pose<P>(model_);
      double length = size_of(model_.link[options_.frames[f].link].pose.t);
      for (int i = model_.link[options_.frames[f].link].body; i > 0; i = model_.body[i].parent) {
        length += size_of(model_.body[i].placement.t);
        for (int c = model_.body[i].v_index; c < end_in_v(model_.body[i]); ++c)
          w_.coordinate[c] = 0;
      }
      w_.per_metre[f] = S(options_.frames[f].position_weight / w_.heaviest * (length > 0 ? 20 / length : 1));
    }
    for (int i = 0; i < coupling_.followers; ++i)
      couple(coupling_.follower[i]);
    w_.coordinates = w_.bodies = 0;
    for (int i = 1; i < model_.bodies; ++i) {
      const body<S> &b = model_.body[i];
      const bool moves_any = b.nv > 0 && w_.coordinate[b.v_index] == 0;
      by_every_kind(b.kind, [&]<joint_kind K>() { // quaternions of unit length
        if constexpr (joint<K>::quaternion >= 0)
          w_.q[b.q_index + joint<K>::quaternion + 3] = P(S(1));
      });
      if (!moves_any)
        continue;
      w_.body[w_.bodies++] = i;
      for (int c = b.v_index; c < end_in_v(b); ++c)
        w_.coordinate[c] = w_.coordinates++;
    }
    place_followers(coupling_, w_.q); // leaders that don't move frames stay at zero, too
  }

  /// Lets the leader move what its follower moves, and narrows the leader's limits to those of the follower, which then has none.
  void couple(const follower<S> &f) {
    if (w_.coordinate[f.v] == 0)
      w_.coordinate[f.leader_v] = 0;
    w_.leads[f.leader_v] = true;
    const S from = (model_.lower[f.q] - f.offset) / f.multiplier, to = (model_.upper[f.q] - f.offset) / f.multiplier;
    if (f.multiplier > 0)
      limit(f.leader_q, from, to);
    else if (f.multiplier < 0)
      limit(f.leader_q, to, from);
    w_.lower[f.q] = P(-S(1e30)), w_.upper[f.q] = P(S(1e30));
  }

  /// Narrows the limits of a number in q, unless nothing would be left between them.
  void limit(int q, S from, S to) {
    const S lower = number(w_.lower + q, 0), upper = number(w_.upper + q, 0), most = from > lower ? from : lower,
            least = to < upper ? to : upper;
    if (most <= least)
      w_.lower[q] = P(most), w_.upper[q] = P(least);
  }

  static double size_of(const vec3<S> &v) { return __builtin_sqrt(double(v.x * v.x + v.y * v.y + v.z * v.z)); }

  /// Gives lane l the target of a state.
  void take(int l, std::size_t state) {
    inverse_kinematics_lane &lane = lane_[l];
    lane = {};
    lane.busy = true, lane.state = state, lane.best = 1e300;
    const S *pose = row(batch_.target, state);
    for (int f = 0; f < options_.frames_n; ++f, pose += 16) {
      const SE3<S> D = {{pose[0], pose[4], pose[8], pose[1], pose[5], pose[9], pose[2], pose[6], pose[10]},
                        {pose[3], pose[7], pose[11]}};
      for (int c = 0; c < 12; ++c)
        set(reinterpret_cast<P *>(&w_.target[f]) + c, l, reinterpret_cast<const S *>(&D)[c]);
    }
    if (batch_.start.first)
      for (int i = 0; i < numbers(); ++i)
        set(w_.q + at(i), l, row(batch_.start, state)[i]);
    if (batch_.start.first && options_.limits)
      enter_limits(l);
    begin_start(l, !batch_.start.first);
  }

  /// Moves a start that is beyond limits to the limits.  It might be at its target there, and would then be the result.
  void enter_limits(int l) {
    for (int k = 0; k < w_.bodies; ++k) {
      const body<S> &b = model_.body[w_.body[k]];
      const int numbers = row_of(b.kind).nq;
      for (int i = b.q_index; i < b.q_index + numbers; ++i) {
        const S q = number(w_.q + i, l), lower = number(w_.lower + i, l), upper = number(w_.upper + i, l);
        set(w_.q + i, l, q < lower ? lower : q > upper ? upper : q);
      }
    }
  }

  void begin_start(int l, bool random) {
    inverse_kinematics_lane &lane = lane_[l];
    lane.iterations = lane.since_progress = 0, lane.least = 1e300;
    if (random)
      draw(l);
    place_followers(coupling_, w_.q);
    ++lane.start;
  }

  /// Draws the position that a start begins with.  Each number is uniform in its range: between its limits, or without limits up to π
  /// (rad or m) to both sides of the given start, or of zero.
  ///
  /// The first position drawn for a target is random.  Further ones follow from it: each number moves on by 0.07 of its range, and
  /// by half its range in every second start or so.  Pairs of neighbouring coordinates do that in different starts.  Other branches of
  /// solutions are reached sooner than by chance.
  void draw(int l) {
    constexpr double pi = 3.14159265358979323846, further = 0.07;
    const std::uint64_t key = options_.seed * 0xd1342543de82ef95u + lane_[l].state * 0x10001u;
    const int turn = lane_[l].start;
    const auto number_of = [&](int c) {
      const double x = random_number(key + static_cast<unsigned>(c) * 0x9e3779b97f4a7c15u) + turn * further +
                       0.5 * __builtin_parity(static_cast<unsigned>(turn) & (1 + static_cast<unsigned>(c) / 2 % 3));
      return x - static_cast<double>(static_cast<int>(x));
    };
    for (int k = 0; k < w_.bodies; ++k) {
      const body<S> &b = model_.body[w_.body[k]];
      by_every_kind(b.kind, [&]<joint_kind K>() {
        S q[joint<K>::nq], step[joint<K>::nv];
        const bool given = batch_.start.first != nullptr;
        for (int c = 0; c < joint<K>::nq; ++c)
          q[c] = given && !b.follows ? row(batch_.start, lane_[l].state)[user_index(b.q_index + c)]
                                     : S(c == joint<K>::quaternion + 3 && joint<K>::quaternion >= 0);
        for (int c = 0; c < joint<K>::nv; ++c)
          step[c] = S(pi * (2 * number_of(b.v_index + c) - 1));
        S drawn[joint<K>::nq];
        joint<K>::integrate(q, step, drawn);
        for (int c = 0; c < joint<K>::nq; ++c) {
          const S lower = number(w_.lower + b.q_index + c, l), upper = number(w_.upper + b.q_index + c, l);
          if (options_.limits && upper - lower < S(1e30)) {
            const bool all_round = only_turns(K) && lower < S(-pi) && upper > S(pi);
            const double from = all_round ? -pi : double(lower), to = all_round ? pi : double(upper);
            drawn[c] = S(from + (to - from) * number_of(b.v_index + c));
          }
          set(w_.q + b.q_index + c, l, drawn[c]);
        }
      });
    }
  }

  /// Looks at the errors at a lane's position.  Returns true if the lane goes on with a step; otherwise it is done with its target, or
  /// begins at another start.
  bool goes_on(int l, double position, double orientation, double cost) {
    constexpr int patience = 8; // iterations without progress
    inverse_kinematics_lane &lane = lane_[l];
    const double p = options_.position_tolerance, o = options_.orientation_tolerance;
    if (position <= p * p && orientation <= o * o) {
      finish(l, inverse_kinematics_end::converged, position, orientation, cost);
      lane.busy = false;
      return false;
    }
    lane.since_progress = cost < 0.9 * lane.least ? 0 : lane.since_progress + 1;
    lane.least = cost < lane.least ? cost : lane.least;
    const bool stands = lane.since_progress >= patience || // or the target has NaN
                        !(cost < 1e300);
    if (!stands && lane.iterations < options_.iterations) {
      ++lane.iterations, ++lane.all_iterations;
      return true;
    }
    using enum inverse_kinematics_end;
    finish(l, !stands ? iterations : held(l) ? limits : stuck, position, orientation, cost);
    lane.busy = lane.start < options_.starts;
    if (lane.busy)
      begin_start(l, true);
    return false;
  }

  /// Is any coordinate at a limit?
  bool held(int l) const {
    for (int k = 0; k < w_.bodies; ++k)
      for (int c = model_.body[w_.body[k]].q_index, n = 0; n < model_.body[w_.body[k]].nv; ++n, ++c)
        if (options_.limits &&
            (number(w_.q + c, l) <= number(w_.lower + c, l) || number(w_.q + c, l) >= number(w_.upper + c, l)))
          return true;
    return false;
  }

  /// Stores the position of a lane, if it is the best so far.
  void finish(int l, inverse_kinematics_end how, double position, double orientation, double cost) {
    inverse_kinematics_lane &lane = lane_[l];
    const std::size_t k = lane.state;
    if (batch_.iterations)
      batch_.iterations[k] = lane.all_iterations;
    if (batch_.starts)
      batch_.starts[k] = lane.start;
    if (lane.start > 1 && how != inverse_kinematics_end::converged && !(cost < lane.best))
      return;
    lane.best = cost;
    for (int i = 0; i < numbers(); ++i)
      row(batch_.q, k)[i] = number(w_.q + at(i), l);
    if (batch_.error.first) {
      row(batch_.error, k)[0] = S(__builtin_sqrt(position));
      row(batch_.error, k)[1] = S(__builtin_sqrt(orientation)); // 2 sin(θ/2)
    }
    if (batch_.end)
      batch_.end[k] = static_cast<int>(how);
  }

  const model_view<S> &model_;
  const coupling_view<S> coupling_; ///< its other members are read only if it has followers
  const inverse_kinematics_options &options_;
  const inverse_kinematics_batch<S> &batch_;
  inverse_kinematics_workspace<P> w_;
  inverse_kinematics_lane lane_[lanes];
};

} // namespace KSL_ISA
} // namespace ksl
