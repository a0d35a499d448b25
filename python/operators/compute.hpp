// Computes operators and their derivatives on a batch.
//
// The states are groups of equally many; each group has one set of parameters of links.  A part is a range of states of one group, of a
// size that depends on the operator alone.  What is summed over states, the cotangents of parameters, is summed part by part and then
// in their order, so that results don't depend on the number of threads.
#pragma once

#include "along.hpp"

#include "batch/compute_batch.hpp"
#include "batch/threads.hpp"
#include "text/rounding.hpp"

#include <algorithm>
#include <cstring>
#include <exception>
#include <mutex>

namespace operators {

constexpr std::size_t cached_bytes = 192 << 10; ///< of the Jacobians of a part
constexpr std::size_t most_in_part = 512, lanes_in_part = 16;

/// Arrays of rows, contiguous: states in `groups` groups of `states`.  Parameters of links, and their tangents and cotangents, have one
/// row for each group.
template <class S> struct arrays {
  std::size_t groups = 0, states = 0;
  std::vector<const S *> in;
  std::vector<S *> out;
};

/// How many arrays a stage reads and writes, for an operator with so many inputs.
constexpr int inputs_of(stage s, int inputs) {
  switch (s) {
  case stage::value: return inputs;
  case stage::jvp: return 2 * inputs;
  case stage::vjp: return inputs + 1;
  case stage::second_jvp: return 3 * inputs;
  case stage::second_vjp: return 2 * inputs + 1;
  }
  __builtin_unreachable();
}
constexpr int outputs_of(stage s, int inputs) { return s == stage::vjp || s == stage::second_vjp ? inputs : 1; }

/// One thread's memory and model.
template <class S> class worker {
public:
  worker(const operation &of, stage what, const arrays<S> &given, std::vector<double> &sums)
      : of_(of), given_(given), what_(what), sums_(sums) {}

  /// The states [first, first + n) of a group; `part` numbers the sums.
  void run(std::size_t group, std::size_t first, std::size_t n, std::size_t part) {
    n_ = n, row_ = group * given_.states + first, group_ = group, part_ = part, has_value_ = false;
    set_model();
    set_inputs();
    switch (what_) {
    case stage::value: return value(out(0, of_.result_numbers()));
    case stage::jvp: return jvp();
    case stage::vjp: return vjp();
    case stage::second_jvp: return second_jvp();
    case stage::second_vjp: return second_vjp();
    }
  }

private:
  using index = std::ptrdiff_t;
  static index offset(std::size_t row, index width) { return static_cast<index>(row) * width; }

  /// Array i of those that the stage reads, at the first state of the part; input x of them.
  const S *in(int i, index width) const { return given_.in[static_cast<std::size_t>(i)] + offset(row_, width); }
  S *out(int i, index width) const { return given_.out[static_cast<std::size_t>(i)] + offset(row_, width); }
  const S *of_group(int i) const { return given_.in[static_cast<std::size_t>(i)] + offset(group_, of_.parameters()); }
  const S *raw(int x) const { return in(x, of_.width(x)); }
  const S *change(int set, int x) const { return in(set * of_.buffers() + x, of_.width(x)); }
  int nv() const { return of_.model().nv(); }

  static S *room(std::vector<S> &memory, index numbers) {
    if (static_cast<index>(memory.size()) < numbers)
      memory.resize(static_cast<std::size_t>(numbers));
    return memory.data();
  }
  static S *zeros(std::vector<S> &memory, index numbers) {
    S *const all = room(memory, numbers);
    std::fill_n(all, numbers, S(0));
    return all;
  }
  index states() const { return static_cast<index>(n_); }

  /// A batch of a row for the inputs of this part.
  ksl::batch_view<S> batch(const ksl::algorithm_row &row) const {
    ksl::batch_view<S> b = of_.batch<S>(row, n_, inputs_);
    if (row.external != ksl::external_use::none) {
      b.external_n = static_cast<int>(external_.size()), b.external = external_.data();
      b.external_axes = of_.given().external_axes;
    }
    return b;
  }

  /// The model with the parameters of the group.
  void set_model() {
    model_ = &of_.model();
    if (!of_.has_parameters())
      return;
    const S *const p = of_group(of_.parameters_at());
    const std::size_t n = static_cast<std::size_t>(of_.parameters());
    if (!own_ || std::memcmp(parameters_.data(), p, n * sizeof(S)) != 0) {
      parameters_.assign(p, p + n);
      std::vector<ksl::link_inertia> inertias;
      for (std::size_t l = 0; 10 * l < n; ++l) {
        double x[10];
        for (std::size_t i = 0; i < 10; ++i)
          x[i] = static_cast<double>(p[10 * l + i]);
        ksl::spatial_inertia<double> I{};
        I.m = x[0], I.h = {x[1], x[2], x[3]};
        I.Ixx = x[4], I.Ixy = x[5], I.Iyy = x[6], I.Izx = x[7], I.Iyz = x[8], I.Izz = x[9];
        inertias.push_back({static_cast<int>(l), I});
      }
      own_.emplace(of_.model().with_inertias(inertias));
      along_.reset(); // it is of the model before
    }
    model_ = &*own_;
  }

  /// The inputs as algorithms take them: with unit quaternions.
  void set_inputs() {
    inputs_.clear();
    const tangent &t = of_.positions();
    for (int x = 0; x < of_.inputs(); ++x) {
      const S *p = raw(x);
      if (of_.is_position(x) && t.has_quaternions()) {
        S *const unit = room(unit_[inputs_.size()], states() * t.nq());
        for (index k = 0; k < states(); ++k)
          t.normalise(p + k * t.nq(), unit + k * t.nq());
        p = unit;
      }
      inputs_.push_back(p);
    }
    external_.clear();
    const index width = of_.external_numbers();
    for (const int link : of_.given().external_links)
      external_.push_back({link, {in(of_.external_at(), width) + 6 * static_cast<index>(external_.size()), width}});
  }

  void value(S *to) {
    const ksl::algorithm_row &row = *of_.given().value;
    if (of_.given().completes != completed::nothing)
      return complete(to);
    ksl::batch_view<S> b = batch(row);
    ksl::reaction_rows<S> reactions;
    if (of_.gives_reactions()) {
      reactions = {of_.given().joints, {to, of_.result_numbers()}};
      b.reactions_n = 1, b.reactions = &reactions;
    } else
      b.result[of_.given().value_result] = {to, of_.result_numbers()};
    if (!ksl::compute_states(row, *model_, b, 0, n_) && of_.is_along())
      refuse(row, b);
  }
  /// Says why a state has no result whose numbers are not those of the closed mechanism; NaN is passed on.
  void refuse(const ksl::algorithm_row &row, const ksl::batch_view<S> &b) const {
    try {
      ksl::examine_states(row, *model_, b, 0, n_, ksl::arguments_are::unchecked);
    } catch (const ksl::result_error &e) { // it counts the states of the part
      const std::string said = e.what(), state = "state " + std::to_string(e.state) + ": ";
      const std::size_t at = n_ > 1 ? said.find(state) + state.size() : said.find(": ") + 2;
      of_.refuse(row_ + e.state, said.substr(at));
    }
  }

  /// The first derivatives: of each input n × moving numbers × nv.
  void set_first() {
    if (of_.is_along())
      return set_along();
    const description &d = of_.given();
    ksl::batch_view<S> b = batch(*d.first);
    for (const int r : d.first_result)
      if (const index width = of_.moving_numbers() * nv(); !b.result[r].first)
        b.result[r] = {room(first_[r], states() * width), width};
    ksl::compute_states(*d.first, *model_, b, 0, n_);
  }
  const S *first(int x, index k) const {
    const int r = of_.given().first_result[static_cast<std::size_t>(x)];
    return first_[r].data() + k * of_.moving_numbers() * nv();
  }

  along<S> &mechanism() {
    if (!along_)
      along_.emplace(of_, *model_, static_cast<int>(external_.size()));
    return *along_;
  }
  const S *const *inputs_of(index k) {
    for (std::size_t x = 0; x < inputs_.size(); ++x)
      state_inputs_[x] = inputs_[x] + k * of_.width(static_cast<int>(x));
    return state_inputs_;
  }
  void complete(S *to) {
    for (index k = 0; k < states(); ++k)
      mechanism().complete(inputs_of(k), row_ + static_cast<std::size_t>(k), to + k * of_.result_numbers());
  }
  /// The first derivatives of a closed mechanism.
  void set_along() {
    const description &d = of_.given();
    const index rows = of_.moving_numbers(), block = rows * nv(), square = index(nv()) * nv();
    const bool opens = of_.gives_reactions(),
               of_efforts = !d.solved && !opens && (of_.has_external() || of_.has_parameters());
    for (const int r : d.first_result)
      zeros(first_[r], states() * block);
    S *const P = of_efforts ? zeros(projection_, states() * square) : nullptr;
    S *const a = of_efforts ? room(a_, states() * nv()) : nullptr;
    open_.assign(static_cast<std::size_t>(opens ? states() * rows : 0), 0);
    const S *const y = d.completes == completed::nothing ? nullptr : lifted_value();
    std::vector<int> links;
    std::vector<S> wrenches(6 * external_.size());
    for (const ksl::external_rows<S> &e : external_)
      links.push_back(e.link);
    for (index k = 0; k < states(); ++k) {
      state_jacobians<S> to;
      for (std::size_t x = 0; x < d.first_result.size(); ++x)
        to.by[x] = first_[d.first_result[x]].data() + k * block;
      to.projection = P ? P + k * square : nullptr, to.a = a ? a + k * nv() : nullptr;
      to.open = opens ? open_.data() + k * rows : nullptr;
      for (std::size_t e = 0; e < external_.size(); ++e)
        std::copy_n(external_[e].wrench.first + k * external_[e].wrench.stride, 6, wrenches.data() + 6 * e);
      mechanism().derive(inputs_of(k), y ? y + k * of_.result_numbers() : nullptr,
                         {static_cast<int>(links.size()), links.data(), wrenches.data(), d.external_axes},
                         row_ + static_cast<std::size_t>(k), to);
    }
  }
  /// Component i of state k is not determined by rigid bodies: an error, or NaN in these results.
  void leave_open(index k, index i, S *results, index n) const {
    static constexpr const char *names[] = {"fx", "fy", "fz", "tx", "ty", "tz"};
    const ksl::reaction_request &r = of_.given().joints;
    if (of_.given().nan_where_open)
      return void(std::fill_n(results, n, std::numeric_limits<S>::quiet_NaN()));
    const int link = r.link[i / 6], links = static_cast<int>(model_->links().size());
    const std::string &joint = link < links ? model_->joints()[static_cast<std::size_t>(model_->joint_above(link))].name
                                            : model_->loops()[static_cast<std::size_t>(link - links)].name;
    of_.refuse(
        row_ + static_cast<std::size_t>(k),
        names[(i + (r.angular_first ? 3 : 0)) % 6] + (" of joint " + joint) +
            " is not determined by rigid bodies, and has no derivative; reactions_unique says which are: leave it out of what is "
            "differentiated, or give undetermined=\"nan\"");
  }
  bool is_open(index k, index i) const {
    return !open_.empty() && open_[static_cast<std::size_t>(k * of_.moving_numbers() + i)];
  }
  void set_second() {
    const description &d = of_.given();
    ksl::batch_view<S> b = batch(*d.second);
    for (const second_term &t : d.second_terms) {
      const index width = of_.moving_numbers() * nv() * nv();
      b.result[t.result] = {room(second_[t.result], states() * width), width};
    }
    ksl::compute_states(*d.second, *model_, b, 0, n_);
  }
  void set_regressor() {
    const description &d = of_.given();
    ksl::batch_view<S> b = batch(*d.regressor);
    if (d.solved)
      b.a = {lifted_value(), nv()};
    else if (of_.is_along() && !of_.gives_reactions() && d.regressor->reads(ksl::input::a))
      b.a = {a_.data(), nv()};
    const index width = of_.moving_numbers() * of_.parameters();
    b.result[d.regressor_result] = {room(regressor_, states() * width), width};
    ksl::compute_states(*d.regressor, of_.is_along() && !of_.gives_reactions() ? of_.tree() : *model_, b, 0, n_);
  }
  /// The Jacobians (6 × nv) of the links on which external wrenches act, at their origins in the axes of the wrenches.
  void set_jacobians() {
    const index each = index(6) * nv(), width = of_.external_numbers() * nv();
    S *const to = room(jacobians_, states() * width);
    for (std::size_t l = 0; l < external_.size(); ++l) {
      ksl::batch_view<S> b = batch(ksl::rows::jacobian);
      b.links = {1, &external_[l].link};
      b.frame = {};
      b.frame.axes = of_.given().external_axes;
      b.result[0] = {to + static_cast<index>(l) * each, width};
      ksl::compute_states(ksl::rows::jacobian, *model_, b, 0, n_);
    }
  }
  const S *jacobians(index k) const { return jacobians_.data() + k * of_.external_numbers() * nv(); }
  /// The result, where derivatives need it.
  S *lifted_value() {
    S *const y = room(value_, states() * of_.result_numbers());
    if (!has_value_)
      value(y);
    has_value_ = true;
    return y;
  }

  /// Change x of set `set`, as displacements: rows of nv.
  const S *displacement(int set, int x, index k, std::vector<S> &memory) const {
    const S *const d = change(set, x) + k * of_.width(x);
    if (!of_.is_position(x) || of_.positions().is_plain())
      return d;
    S *const v = room(memory, nv());
    of_.positions().apply(raw(x) + k * of_.width(x), d, v);
    return v;
  }

  /// to (rows) += J (rows × nv) v
  static void add_product(const S *J, const S *v, index rows, index columns, S *to) {
    for (index i = 0; i < rows; ++i) {
      S sum = 0;
      for (index k = 0; k < columns; ++k)
        sum += J[i * columns + k] * v[k];
      to[i] += sum;
    }
  }
  /// to (nv) += Jᵀ f
  static void add_transposed(const S *J, const S *f, index rows, index columns, S *to) {
    for (index i = 0; i < rows; ++i)
      for (index k = 0; k < columns; ++k)
        to[k] += J[i * columns + k] * f[i];
  }

  void jvp() {
    const index rows = of_.moving_numbers(), width = of_.result_numbers();
    set_first();
    set_others();
    const S *const y = of_.given().lift == lifted::plain ? nullptr : lifted_value();
    S *const to = out(0, width);
    for (index k = 0; k < states(); ++k) {
      S *const moved = y ? room(moved_, rows) : to + k * width;
      std::fill_n(moved, rows, S(0));
      for (int x = 0; x < of_.inputs(); ++x)
        add_product(first(x, k), displacement(1, x, k, displaced_), rows, nv(), moved);
      if (of_.has_external())
        add_of_external(k, change(1, of_.external_at()) + k * of_.external_numbers(), moved);
      if (of_.has_parameters())
        add_of_parameters(k, of_group(of_.buffers() + of_.parameters_at()), moved);
      for (index i = 0; i < rows; ++i)
        if (is_open(k, i))
          leave_open(k, i, moved + i, 1);
      if (y)
        lift(y + k * width, moved, to + k * width);
    }
  }

  /// Derivatives by wrenches and parameters.
  void set_others() {
    if (of_.has_external())
      set_jacobians();
    if (of_.has_parameters())
      set_regressor();
  }

  /// Adds the change of the result that a change of the parameters makes.
  void add_of_parameters(index k, const S *change, S *moved) {
    const index rows = of_.moving_numbers(), p = of_.parameters();
    const S *const Y = regressor_.data() + k * rows * p;
    if (!is_of_efforts())
      return add_product(Y, change, rows, p, moved);
    S *const efforts = zeros(efforts_, rows);
    add_product(Y, change, rows, p, efforts);
    add_of_efforts(k, efforts, moved);
  }

  /// Adds the change that a change of external wrenches makes, by which efforts change by −Jᵀ.
  void add_of_external(index k, const S *change, S *moved) {
    S *const efforts = zeros(efforts_, nv());
    add_transposed(jacobians(k), change, of_.external_numbers(), nv(), efforts);
    std::transform(efforts, efforts + nv(), efforts, [](S f) { return -f; });
    if (is_of_efforts())
      return add_of_efforts(k, efforts, moved);
    for (index i = 0; i < nv(); ++i)
      moved[i] += efforts[i];
  }

  /// Does the result follow from efforts of the tree: accelerations, and efforts of drives?
  bool is_of_efforts() const { return of_.given().solved || (of_.is_along() && !of_.gives_reactions()); }
  /// Adds the change of the result where these efforts change.
  void add_of_efforts(index k, S *efforts, S *moved) {
    if (!of_.given().solved)
      return add_product(projection_.data() + k * nv() * nv(), efforts, nv(), nv(), moved);
    std::transform(efforts, efforts + nv(), efforts, [](S f) { return -f; });
    add_product(first(of_.inputs() - 1, k), efforts, nv(), nv(), moved);
  }
  /// The cotangents of these efforts, from those of the result.
  const S *of_efforts(index k, const S *f) {
    S *const weights = zeros(efforts_, nv());
    if (of_.given().solved) {
      add_transposed(first(of_.inputs() - 1, k), f, nv(), nv(), weights);
      std::transform(weights, weights + nv(), weights, [](S w) { return -w; });
    } else
      add_transposed(projection_.data() + k * nv() * nv(), f, nv(), nv(), weights);
    return weights;
  }

  void vjp() {
    if (of_.has_gradient())
      return gradient();
    const index rows = of_.moving_numbers(), width = of_.result_numbers();
    set_first();
    set_others();
    const bool efforts = is_of_efforts() && (of_.has_external() || of_.has_parameters());
    const S *const y = of_.given().lift == lifted::plain ? nullptr : lifted_value();
    const S *const given = in(of_.buffers(), width);
    for (index k = 0; k < states(); ++k) {
      const S *f = given + k * width;
      if (y) {
        S *const pulled = room(moved_, rows);
        pull_lift(y + k * width, f, pulled);
        f = pulled;
      }
      for (int x = 0; x < of_.inputs(); ++x)
        pull(x, k, f);
      for (index i = 0; i < rows; ++i)
        if (is_open(k, i) && f[i] != 0)
          for (int x = 0; x < of_.inputs(); ++x)
            leave_open(k, i, out(x, of_.width(x)) + k * of_.width(x), of_.width(x));
      if (efforts)
        f = of_efforts(k, f);
      if (of_.has_external())
        pull_external(k, f);
      if (of_.has_parameters())
        sum_parameters(k, f);
    }
  }

  /// Cotangents by the algorithm that computes products for efforts.  Accelerations under given efforts change by −M⁻¹ times what efforts at
  /// these accelerations change by.
  void gradient() {
    const description &d = of_.given();
    const S *const weights = d.solved ? solved_weights() : in(of_.buffers(), nv());
    ksl::batch_view<S> b = batch(*d.gradient);
    b.tau = {weights, nv()};
    if (d.solved)
      b.a = {lifted_value(), nv()};
    const int moved = of_.inputs() - (d.solved ? 1 : 0); // by efforts it is −weights
    const bool plain = of_.positions().is_plain();
    for (int x = 0; x < moved; ++x)
      b.result[x] = {of_.is_position(x) && !plain ? room(first_[x], states() * nv()) : out(x, nv()), nv()};
    ksl::compute_states(*d.gradient, *model_, b, 0, n_);
    for (int x = 0; !plain && x < moved; ++x)
      if (of_.is_position(x))
        pull_all(x);
    if (d.solved)
      std::transform(weights, weights + states() * nv(), out(moved, nv()), [](S w) { return -w; });
    if (!of_.has_parameters())
      return;
    set_regressor();
    for (index k = 0; k < states(); ++k)
      sum_parameters(k, weights + k * nv());
  }

  /// −M⁻¹ times the cotangents.
  const S *solved_weights() {
    const ksl::algorithm_row &row = *of_.given().solve;
    S *const weights = room(efforts_, states() * nv());
    ksl::batch_view<S> b = batch(row);
    b.tau = {in(of_.buffers(), nv()), nv()};
    b.result[0] = {weights, nv()};
    ksl::compute_states(row, *model_, b, 0, n_);
    std::transform(weights, weights + states() * nv(), weights, [](S w) { return -w; });
    return weights;
  }

  /// Writes what gradients along joint velocities, in the memory of the first derivatives, are by the numbers of positions x.
  void pull_all(int x) {
    const index width = of_.width(x);
    S *const to = out(x, width);
    std::fill_n(to, states() * width, S(0));
    for (index k = 0; k < states(); ++k)
      of_.positions().add_pulled(raw(x) + k * width, first_[x].data() + k * nv(), to + k * width);
  }

  /// Writes Jᵀ f for input x.
  void pull(int x, index k, const S *f) {
    const index width = of_.width(x);
    S *const to = out(x, width) + k * width;
    std::fill_n(to, width, S(0));
    const index rows = of_.moving_numbers();
    if (!of_.is_position(x) || of_.positions().is_plain())
      return add_transposed(first(x, k), f, rows, nv(), to);
    S *const g = room(displaced_, nv());
    std::fill_n(g, nv(), S(0));
    add_transposed(first(x, k), f, rows, nv(), g);
    of_.positions().add_pulled(raw(x) + k * width, g, to);
  }

  /// Writes −J f for the wrenches; f are those of efforts where the result follows from these.
  void pull_external(index k, const S *f) {
    const index width = of_.external_numbers();
    S *const to = out(of_.external_at(), width) + k * width;
    std::fill_n(to, width, S(0));
    add_product(jacobians(k), f, width, nv(), to);
    std::transform(to, to + width, to, [](S x) { return -x; });
  }

  /// Adds the cotangents of parameters; f are those of efforts where the result follows from these.
  void sum_parameters(index k, const S *f) {
    const index rows = of_.moving_numbers(), p = of_.parameters();
    const S *const Y = regressor_.data() + k * rows * p;
    double *const sum = sums_.data() + offset(part_, p);
    for (index i = 0; i < rows; ++i)
      for (index c = 0; c < p; ++c)
        sum[c] += static_cast<double>(Y[i * p + c]) * static_cast<double>(f[i]);
  }

  /// The second derivative of the result by displacements of x and of y, along both: to (rows) += A x y, with A (rows × nv × nv).
  void add_second(const S *A, const S *x, const S *y, S *to) {
    S *const column = room(efforts_, nv());
    for (index i = 0; i < of_.moving_numbers(); ++i, A += nv() * nv()) {
      std::fill_n(column, nv(), S(0));
      add_product(A, y, nv(), nv(), column);
      for (int k = 0; k < nv(); ++k)
        to[i] += x[k] * column[k];
    }
  }

  void second_jvp() {
    const index rows = of_.moving_numbers();
    set_second();
    const bool plain = of_.positions().is_plain();
    if (!plain)
      set_first();
    S *const to = out(0, rows);
    for (index k = 0; k < states(); ++k) {
      S *const moved = to + k * rows;
      std::fill_n(moved, rows, S(0));
      for (const second_term &t : of_.given().second_terms) {
        const S *const A = second_[t.result].data() + k * rows * nv() * nv();
        add_second(A, displacement(1, t.x, k, one_), displacement(2, t.y, k, other_), moved);
        if (t.x != t.y)
          add_second(A, displacement(2, t.x, k, one_), displacement(1, t.y, k, other_), moved);
      }
      for (int x = 0; !plain && x < of_.inputs(); ++x)
        if (of_.is_position(x)) {
          const index w = of_.width(x);
          S *const v = room(one_, nv());
          of_.positions().apply_change(raw(x) + k * w, change(1, x) + k * w, change(2, x) + k * w, v);
          add_product(first(x, k), v, rows, nv(), moved);
        }
    }
  }

  void second_vjp() {
    const index rows = of_.moving_numbers();
    set_second();
    const bool plain = of_.positions().is_plain();
    if (!plain)
      set_first();
    const S *const given = in(of_.buffers(), rows);
    for (index k = 0; k < states(); ++k) {
      const S *const f = given + k * rows;
      S *const g = room(covectors_, nv() * of_.inputs());
      std::fill_n(g, nv() * of_.inputs(), S(0));
      for (const second_term &t : of_.given().second_terms)
        contract(t, k, f, g);
      for (int x = 0; x < of_.inputs(); ++x)
        write_second(x, k, f, g + x * nv(), plain);
    }
  }
  /// g of input x += f A y, and the other way round; changes are set 1 here, behind the cotangent.
  void contract(const second_term &t, index k, const S *f, S *g) {
    const index rows = of_.moving_numbers(), square = nv() * nv();
    const S *const A = second_[t.result].data() + k * rows * square;
    S *const sum = room(efforts_, square);
    std::fill_n(sum, square, S(0));
    for (index i = 0; i < rows; ++i)
      for (index j = 0; j < square; ++j)
        sum[j] += f[i] * A[i * square + j];
    add_product(sum, second_displacement(t.y, k), nv(), nv(), g + t.x * nv());
    if (t.x != t.y)
      add_transposed(sum, second_displacement(t.x, k), nv(), nv(), g + t.y * nv());
  }
  const S *second_change(int x, index k) const { return in(of_.buffers() + 1 + x, of_.width(x)) + k * of_.width(x); }
  const S *second_displacement(int x, index k) {
    if (!of_.is_position(x) || of_.positions().is_plain())
      return second_change(x, k);
    S *const v = room(displaced_, nv());
    of_.positions().apply(raw(x) + k * of_.width(x), second_change(x, k), v);
    return v;
  }
  void write_second(int x, index k, const S *f, const S *g, bool plain) {
    const index width = of_.width(x);
    S *const to = out(x, width) + k * width;
    if (!of_.is_position(x) || plain) {
      std::copy_n(g, width, to);
      return;
    }
    std::fill_n(to, width, S(0));
    const tangent &t = of_.positions();
    const S *const q = raw(x) + k * width;
    t.add_pulled(q, g, to);
    S *const c = room(one_, nv());
    std::fill_n(c, nv(), S(0));
    add_transposed(first(x, k), f, of_.moving_numbers(), nv(), c);
    t.add_pulled_change(q, c, second_change(x, k), to);
  }

  /// The change of the result of a state from that of what derivatives are of.
  void lift(const S *y, const S *moved, S *to) const {
    if (of_.given().lift == lifted::position)
      return of_.positions().lift(y, moved, to);
    for (std::size_t l = 0; l < of_.given().links.size(); ++l, y += 16, moved += 6, to += 16)
      for (int i = 0; i < 3; ++i) { // R ω̃ and R v
        const three<S> R = at(y + 4 * i), turned = S(-1) * cross(at(moved + 3), R);
        put(turned, to + 4 * i);
        to[4 * i + 3] = dot(R, at(moved));
        to[12 + i] = S(0), to[15] = S(0);
      }
  }
  void pull_lift(const S *y, const S *f, S *moved) const {
    if (of_.given().lift == lifted::position)
      return of_.positions().pull_lift(y, f, moved);
    for (std::size_t l = 0; l < of_.given().links.size(); ++l, y += 16, f += 16, moved += 6) {
      std::fill_n(moved, 6, S(0));
      for (int i = 0; i < 3; ++i) {
        const three<S> R = at(y + 4 * i);
        add(f[4 * i + 3] * R, moved);
        add(S(-1) * cross(R, at(f + 4 * i)), moved + 3);
      }
    }
  }

  const operation &of_;
  const arrays<S> &given_;
  stage what_;
  std::vector<double> &sums_;
  std::size_t n_ = 0, row_ = 0, group_ = 0, part_ = 0;
  bool has_value_ = false; ///< has value_ the results of this part?
  const ksl::model *model_ = nullptr;
  std::optional<ksl::model> own_;
  std::optional<along<S>> along_;
  std::vector<S> parameters_;
  std::vector<const S *> inputs_;
  std::vector<ksl::external_rows<S>> external_;
  std::vector<S> unit_[ksl::most_inputs], first_[ksl::most_results], second_[ksl::most_results], regressor_, value_,
      jacobians_;
  std::vector<S> moved_, efforts_, covectors_, projection_, a_;
  std::vector<unsigned char> open_;
  const S *state_inputs_[ksl::most_inputs] = {};
  mutable std::vector<S> displaced_, one_, other_;
};

/// How many states are computed together.
template <class S> std::size_t states_in_part(const operation &of, stage what) {
  const std::ptrdiff_t rows = of.moving_numbers(), nv = of.model().nv();
  std::ptrdiff_t numbers = of.result_numbers() + of.model().nq();
  if (what == stage::vjp && of.has_gradient())
    numbers += nv * of.inputs() + (of.has_parameters() ? rows * of.parameters() : 0);
  else if (what != stage::value)
    numbers += rows * nv * of.inputs() + (of.has_parameters() ? rows * of.parameters() : 0);
  if (what != stage::value)
    numbers += of.external_numbers() * nv;
  if (what == stage::second_jvp || what == stage::second_vjp)
    numbers += rows * nv * nv * static_cast<std::ptrdiff_t>(of.given().second_terms.size());
  const std::size_t fit = cached_bytes / (sizeof(S) * static_cast<std::size_t>(1 + numbers));
  return std::clamp(fit / lanes_in_part * lanes_in_part, lanes_in_part, most_in_part);
}

/// Computes a stage.  Throws std::bad_alloc, and ksl::description_error for parameters of links that no model takes.
template <class S> void compute(const operation &of, stage what, const arrays<S> &given, int threads) {
  const ksl::nearest_rounding rounding;
  const bool sums = what == stage::vjp && of.has_parameters();
  const std::size_t in_part = states_in_part<S>(of, what), p = static_cast<std::size_t>(of.parameters());
  const std::size_t parts_each = (given.states + in_part - 1) / in_part, parts = given.groups * parts_each;
  std::vector<double> partial(sums ? parts * p : 0, 0.0);
  std::exception_ptr failed;
  std::mutex failing;
  const std::size_t least = 1 + ksl::least_states(of.model().moving_joints()) / in_part;
  ksl::on_threads(ksl::partition(parts, 1, least, threads), [&](std::size_t first, std::size_t end, std::size_t) {
    try {
      worker<S> own(of, what, given, partial);
      for (std::size_t i = first; i < end; ++i) {
        const std::size_t begin = i % parts_each * in_part;
        own.run(i / parts_each, begin, std::min(in_part, given.states - begin), i);
      }
    } catch (...) { // an exception must not leave the thread
      const std::scoped_lock lock(failing);
      failed = std::current_exception();
    }
  });
  if (failed)
    std::rethrow_exception(failed);
  if (!sums)
    return;
  S *const to = given.out.back();
  for (std::size_t g = 0; g < given.groups; ++g)
    for (std::size_t c = 0; c < p; ++c) {
      double sum = 0;
      for (std::size_t i = 0; i < parts_each; ++i)
        sum += partial[(g * parts_each + i) * p + c];
      to[g * p + c] = static_cast<S>(sum);
    }
}

} // namespace operators
