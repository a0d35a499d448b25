// The order of questions:
//
//     look()         is there a closed position at which no pivot is small enough to be due to digits?   yes, and it moves: nothing is to do
//     fit_digits()   does the mechanism move without the equations of small pivots?                      yes: correct(), at most four times
//                    are all equations closed then, and frames within 2 few_digits of the file's?        yes: take()
//                                                                                                        no: the digits become a tolerance
//     say_open(), say_locked()   there is no closed position; or the mechanism is a structure, which would move with frames a little different
#include "engine/loops/exact_frames.hpp"

#include "engine/loops/near_motion.hpp"
#include "engine/loops/vectors.hpp"
#include "text/words.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

namespace ksl::loops {
namespace {

using namespace loop_tolerance;
using position = near_motion::position;

std::size_t index(int i) { return static_cast<std::size_t>(i); }

/// Pivots that few digits can have made.
constexpr double small_pivot = rank_by_digits * few_digits;

/// How far a mechanism is moved to see whether it moves, and on the way back to see whether it still does: rad and lengths of loops.
constexpr double far = 0.4, less_far = 0.25;
constexpr int samples = 6, checks = 3, starts = 8;

/// Changes of frames that make less than this of an error, beside themselves, are not made: rounding would decide them.
constexpr double of_influence = 1e-4;

/// Equations times changes of frames that are looked at: seconds; larger mechanisms keep their frames.
constexpr std::size_t most_numbers = 2000000;

/// Errors that are rounding where frames are exact.
constexpr double exact = closed / 2;

class fitter {
public:
  fitter(const model &m, tables &t, robot_description &robot) : m_(m), t_(t), robot_(robot), moves_(m, t) {}

  frame_fit fit() {
    const bool is_sound = look();
    if (is_sound && !is_locked_)
      return {};
    if (!is_sound && fit_digits())
      return std::move(fit_);
    if (!best_)
      say_open();
    else if (is_locked_)
      say_locked();
    return std::move(fit_);
  }

private:
  /// Looks at closed positions near the first starts.  Is there one at which no pivot is so small that few digits can have made it?
  bool look() {
    bool is_sound = false;
    for (int start = 0, closed_ones = 0; start < starts && closed_ones < 2 && (start < 3 || !is_sound); ++start) {
      position at{start_position(m_, start), 0, 0};
      moves_.close(at, rank);
      if (!nearest_ || at.open < nearest_->open)
        nearest_ = at;
      if (!(at.open <= exact))
        continue;
      ++closed_ones;
      // With pivots down to `closed` the rank is that of the numbers as they stand.  If it is the same with small_pivot, no pivot lies between, which
      // digits of the file could have made of a zero.
      const elimination &k = moves_.factor(at, closed);
      const int fine = k.rank;
      is_locked_ = (is_locked_ || !best_) && k.freedoms() == 0;
      best_ = at;
      is_sound |= moves_.factor(at, small_pivot).rank == fine;
    }
    return is_sound;
  }

  /// Of positions near the starts at which equations are closed to `most`, that with most independent ones; all but for `zero`.
  std::optional<position> base(double zero, double most) {
    std::optional<position> found;
    int rank_of_found = -1;
    double last = 0;
    for (int start = 0; start < starts && last < plan_pivot; ++start) {
      position at{start_position(m_, start), 0, 0};
      moves_.close(at, zero);
      if (!(at.open <= most))
        continue;
      const elimination &k = moves_.factor(at, zero);
      if (k.rank > rank_of_found || (k.rank == rank_of_found && k.last_pivot() > last))
        found = at, rank_of_found = k.rank, last = k.last_pivot();
      freedoms_ = m_.nv() - rank_of_found;
    }
    return found;
  }

  /// Positions of the mechanism, with the equations left out that depend on others but for `zero`; none where it doesn't move.
  /// `samples` positions at the distance `far`, the base, and `checks` nearer ones: frames that fit all of these fit on the whole way.
  std::vector<position> motion(double zero, double most) {
    const std::optional<position> from = base(zero, most);
    if (!from)
      return {};
    std::vector<position> found = moves_.around(*from, zero, most, far, samples);
    if (found.empty() && freedoms_ > 0)
      return {};
    found.push_back(*from);
    const std::vector<position> more = moves_.around(*from, zero, most, less_far, checks);
    found.insert(found.end(), more.begin(), more.end());
    return found;
  }

  /// To which the equations agree that are left out at these positions: their errors, and what they have of freedoms.
  double digits_of(std::vector<position> &along, double zero) {
    double most = 0;
    for (position &at : along) {
      moves_.close(at, zero);
      most = std::max({most, at.open, moves_.factor(at, zero).largest_rest()});
    }
    return most;
  }

  /// Makes frames exact, or sets the digits to which equations agree.  False where the mechanism doesn't move but for few digits.
  bool fit_digits() {
    std::vector<position> along = motion(small_pivot, few_digits);
    if (along.empty())
      return false;
    const double digits = digits_of(along, small_pivot);
    if (digits <= exact)
      return true;
    // Newton's method on the frames: each time the mechanism is closed anew with them, and its equations that are left out are linear in small
    // changes
    const std::vector<loop> given = t_.loops;
    double left = digits;
    for (int k = 0; k < 4 && left > exact / 4; ++k) {
      correct(along);
      left = digits_of(along, small_pivot);
    }
    if (left <= exact && std::isfinite(left) && take(given))
      return true;
    t_.loops = given;
    fit_.digits = digits;
    if (digits > 10 * closed)
      fit_.notes.push_back(
          "the joints that close loops, " + names() + ", fit to " + text::shown(digits) +
          " rad or lengths of a loop only, since joints of the tree have few digits; equations that agree as far count as one, "
          "and results are as exact as that; give angles and lengths with all digits");
    return true;
  }

  std::string names() const {
    std::vector<std::string> all;
    for (const loop_row &l : m_.loops())
      all.push_back(l.name);
    return text::listed(all);
  }

  /// Changes frames by the least that closes the equations which are left out at these positions, to first order.
  void correct(const std::vector<position> &along) {
    // An equation that is left out has multipliers λ with λᵀ K = 0 but for what counts as zero.  Displacements δ of the frames change the errors e to
    // e + F δ + K dq, dq how the coordinates follow, whatever it is: λᵀ of that is zero where
    //
    //     (λᵀ F) δ = −λᵀ e,     one row of A x = b for each such equation at each position,
    //
    //     x = [ loop 0: that on the predecessor (translation in lengths of the loop, rotation), that on the successor | loop 1 | … ]
    const int loops = static_cast<int>(t_.loops.size()), n = 12 * loops;
    std::vector<double> A, b;
    std::vector<double> lambda(index(t_.rows));
    for (const position &at : along) {
      const elimination &k = moves_.factor(at, small_pivot);
      std::vector<double> error(index(t_.rows));
      moves_.at().error(error.data());
      for (int r = 0; r < t_.rows - k.rank; ++r) {
        k.null_vector(r, lambda.data());
        double sum = 0;
        for (int i = 0; i < t_.rows; ++i)
          sum -= lambda[index(i)] * error[index(i)];
        b.push_back(sum);
        for (int l = 0; l < loops; ++l)
          add_influence(l, moves_.at().wrench(l, lambda.data()), A);
      }
    }
    const int equations = static_cast<int>(b.size());
    if (A.size() > most_numbers)
      return;
    least_norm solve;
    const own_memory memory([&](arena &pieces) { solve.lay_out(pieces, equations, n); });
    std::vector<double> change(index(n), 0.0);
    const std::vector<double> scale(index(equations), 1.0);
    const std::vector<unsigned char> fixed(index(n), 0);
    solve.solve(A.data(), equations, n, scale.data(), fixed.data(), of_influence, b.data(), change.data());
    for (int l = 0; l < loops; ++l)
      change_frames(t_.loops[index(l)], change.data() + 12 * l);
  }

  /// How small displacements of a loop's frames change a combination of errors: of that on the predecessor, and of that on the successor, each in its
  /// own axes, force first, in lengths.
  void add_influence(int l, const coscrew<double> &w, std::vector<double> &A) {
    const double length = t_.loops[index(l)].length;
    for (const bool on_successor : {false, true})
      for (int c = 0; c < 6; ++c) {
        double x[6] = {};
        // λᵀ F is the power of the wrench w = Σ λ T on the twist that the displacement gives the successor relative to the predecessor
        x[c] = c < 3 ? length : 1;
        const screw<double> s = screw_of(x);
        A.push_back(on_successor ? work(w, s) : -work(w, at_frame(moves_.at().relative(l), s)));
      }
  }

  static void change_frames(loop &l, const double *change) {
    for (SE3<double> *frame : {&l.on_predecessor, &l.on_successor}) {
      screw<double> s = screw_of(change);
      s.lin = scaled(l.length, s.lin);
      SE3<double> D;
      algebra<double>::SE3_exp(&s, &D);
      *frame = product(*frame, D);
      change += 6;
    }
  }

  /// Takes the frames as they are now, unless they are further from those of the file than its digits allow.
  bool take(const std::vector<loop> &given) {
    std::vector<std::string> notes;
    std::vector<std::pair<double, double>> changes;
    for (std::size_t l = 0; l < given.size(); ++l) {
      const loop &now = t_.loops[l];
      double turned = 0, moved = 0;
      for (const auto &[from, to] :
           {std::pair{&given[l].on_predecessor, &now.on_predecessor}, {&given[l].on_successor, &now.on_successor}}) {
        SE3<double> D;
        screw<double> s;
        algebra<double>::product_dinvd(from, to, &D);
        algebra<double>::SE3_log(&D, &s);
        turned = std::max(turned, length(s.ang)), moved = std::max(moved, length(s.lin));
      }
      const double size = std::max(turned, moved / now.length);
      if (!(size <= 2 * few_digits))
        return false;
      changes.push_back(size > closed ? std::pair(turned, moved) : std::pair(0.0, 0.0));
      if (size > closed)
        notes.push_back("loop joint " + m_.loops()[l].name +
                        " lets the mechanism move but for the digits of its frames: they are made exact, turned by " +
                        text::shown(turned) + " rad and moved by " + text::shown(moved) + " m");
    }
    for (std::size_t l = 0; l < given.size(); ++l) {
      loop_description &of = robot_.loops[l];
      of.turned = std::max(of.turned, changes[l].first), of.moved = std::max(of.moved, changes[l].second);
      // a frame that hasn't changed keeps the numbers of the file; one that has can't be written by them any more
      const auto set = [](const SE3<double> &from, const SE3<double> &to, SE3<double> &pose, given_rotation &rotation) {
        if (std::equal(&from.R.m00, &from.R.m00 + 9, &to.R.m00) && length(difference(from.t, to.t)) == 0)
          return;
        pose = to, rotation = {};
      };
      set(given[l].on_predecessor, t_.loops[l].on_predecessor, of.predecessor_pose, of.given.predecessor);
      set(given[l].on_successor, t_.loops[l].on_successor, of.successor_pose, of.given.successor);
    }
    fit_.is_changed = true;
    fit_.notes = std::move(notes);
    return true;
  }

  std::string opening_of(const position &at) const {
    int l = 0;
    while (l + 1 < static_cast<int>(t_.loops.size()) && t_.loops[index(l + 1)].first_row <= at.row)
      ++l;
    const bool turns = t_.row_turns[index(at.row)];
    return "loop joint " + m_.loops()[index(l)].name + " stays open by " +
           text::shown(at.open * (turns ? 1 : t_.loops[index(l)].length)) + (turns ? " rad" : " m");
  }

  void say_open() {
    fit_.notes.push_back(
        "no closed position of the loops was found from " + std::to_string(starts) + " positions: at best " +
        opening_of(*nearest_) +
        "; correct the frames and axes of the joints around the loop, or take another kind of joint there");
  }

  /// A structure that would move if frames were a little different was likely meant to.
  void say_locked() {
    std::vector<position> along = motion(nearly_moves, nearly_moves);
    if (along.empty() || freedoms_ == 0)
      return;
    fit_.notes.push_back(
        "the loops let nothing move, and would let " + std::to_string(freedoms_) +
        (freedoms_ == 1 ? " coordinate" : " coordinates") + " move if the joints around them, " + names() +
        " and those of the tree, fitted better by " + text::shown(digits_of(along, nearly_moves)) +
        " rad or lengths of a loop; it is computed as the structure that its numbers give; correct axes and origins if it should move");
  }

  const model &m_;
  tables &t_;
  robot_description &robot_;
  near_motion moves_;
  frame_fit fit_;
  std::optional<position> nearest_, best_;
  bool is_locked_ = false;
  int freedoms_ = 0;
};

} // namespace

frame_fit fit_frames(const model &m, tables t, robot_description &robot) { return fitter(m, t, robot).fit(); }

} // namespace ksl::loops
