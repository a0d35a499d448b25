// An operator: an algorithm with the algorithms that compute its derivatives, for one model.
//
// All are computed in parts of the batch.  The Jacobians of a part are contracted with tangents or cotangents while they are in the
// caches, and never leave them.
#pragma once

#include "tangent.hpp"

#include "engine/kernels/algorithm_rows.hpp"
#include "engine/run/arguments.hpp"
#include "engine/loops/algorithms.hpp"
#include "ksl/result_error.hpp"
#include "ksl/surgery.hpp"

#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace operators {

/// What is computed.  x are the inputs, then external wrenches and the parameters of links if the operator has them; y is the result.  jvp: the change of y along
/// changes of x.  vjp: for a cotangent of y those of x.  The second ones: the change of these along further changes of x.
///
/// value: x → y.  jvp: x, dx → dy.  vjp: x, λ → one for each x.  second_jvp: x, dx, dx₂ → dy.  second_vjp: x, λ, dx₂ → one for each x.
enum class stage : unsigned char { value, jvp, vjp, second_jvp, second_vjp };
constexpr int stages = 5;

/// How the result follows from what derivatives are of.  plain: it is that.  position: they are of the tangent of a position.
/// poses: they are of twists in the axes of frames, and the result are their poses.
enum class lifted : unsigned char { plain, position, poses };

/// Which numbers of a closed mechanism the result has, that follow from those of given joints; nothing: it is that of an algorithm.
enum class completed : unsigned char { nothing, position, velocity, acceleration };

/// A row without kernels, with the first so many inputs of q, v and a.
constexpr ksl::algorithm_row completion_row(const char *name, int inputs, ksl::extent result) {
  ksl::algorithm_row row{};
  row.name = name, row.inputs = inputs, row.results = 1;
  row.input_list[0] = ksl::input::q, row.input_list[1] = ksl::input::v, row.input_list[2] = ksl::input::a;
  row.result[0] = {name, 1, {result}};
  return row;
}
/// By what they complete.
inline constexpr ksl::algorithm_row closing_row = completion_row("close", 1, ksl::extent::nq),
                                    velocity_row = completion_row("consistent_velocity", 2, ksl::extent::nv),
                                    acceleration_row = completion_row("consistent_acceleration", 3, ksl::extent::nv);
inline constexpr const ksl::algorithm_row *completions[] = {nullptr, &closing_row, &velocity_row, &acceleration_row};

/// A result of the second derivatives: by input x, then by input y.
struct second_term { int result, x, y; };

struct description {
  const ksl::algorithm_row *value = nullptr;
  int value_result = 0; ///< which of its results
  lifted lift = lifted::plain;
  const ksl::algorithm_row *first = nullptr;
  std::vector<int> first_result; ///< of each input, which of its results
  /// Computes the products of cotangents, its input tau, and all first derivatives; null: they are multiplied.
  const ksl::algorithm_row *gradient = nullptr;
  const ksl::algorithm_row *second = nullptr; ///< null: there are none
  std::vector<second_term> second_terms;
  const ksl::algorithm_row *regressor = nullptr; ///< derivative by the parameters of links; null: they are no input
  int regressor_result = 0;
  /// Regressor and gradient are those of efforts, and the result are accelerations: they change by −M⁻¹ times what efforts change by.
  bool solved = false;
  const ksl::algorithm_row *solve = nullptr; ///< M⁻¹ tau
  std::vector<int> external_links;           ///< of the wrenches that are an input; none: they are no input
  ksl::expressed_in external_axes = ksl::expressed_in::frame;
  std::vector<int> links;
  ksl::frame_options frame = {};
  std::vector<int> joint_links;
  ksl::reaction_request joints = {};
  bool has_joints = false;
  completed completes = completed::nothing;
  std::vector<unsigned char> given; ///< (nv) flags of the coordinates from which the others follow
  bool nan_where_open = false;      ///< derivatives of reactions that rigid bodies don't determine: NaN, or an error
};

class operation {
public:
  /// Throws std::invalid_argument for models that an algorithm refuses.
  operation(const ksl::model &m, description given)
      : model_(m), given_(std::move(given)), tangent_(m), all_links_(m.links().size()) {
    given_.joints.link = given_.joint_links.data();
    given_.joints.n = static_cast<int>(given_.joint_links.size());
    for (std::size_t i = 0; i < all_links_.size(); ++i)
      all_links_[i] = static_cast<int>(i);
    if (!m.loops().empty()) {
      ksl::loops::refuse(*given_.value, m);
      if (is_along() && (gives_reactions() || has_parameters()))
        tree_.emplace(ksl::without_loops(m.description()));
    } else if (given_.completes != completed::nothing)
      throw std::invalid_argument(std::string(name()) + ": no joint of this model closes a loop");
    for (const ksl::algorithm_row *row :
         {given_.value, given_.first, given_.gradient, given_.second, given_.regressor, given_.solve})
      if (row)
        ksl::check_model(*row, m, [](const std::string &sentence) { throw std::invalid_argument(sentence); });
  }
  operation(const operation &) = delete;
  operation &operator=(const operation &) = delete;

  const ksl::model &model() const { return model_; }
  /// Are derivatives along a closed mechanism (along.hpp)?  Otherwise the result is a function of all numbers that are given, as a tree's.
  bool is_along() const {
    return given_.completes != completed::nothing || ksl::way_of(*given_.value, model_) == ksl::way::loops;
  }
  /// The tree that carries the loops of a closed mechanism, for derivatives that are made of its own.
  const ksl::model &tree() const { return tree_ ? *tree_ : model_; }
  const char *name() const { return given_.value->name; }
  /// A state of the call has no result.
  [[noreturn]] void refuse(std::size_t state, const std::string &sentence) const {
    throw ksl::result_error(std::string(name()) + ": state " + std::to_string(state) + ": " + sentence, state, -1);
  }
  const description &given() const { return given_; }
  const tangent &positions() const { return tangent_; }
  /// Without external wrenches and parameters of links.  Those of the algorithm that it doesn't have are zero.
  int inputs() const { return static_cast<int>(given_.first_result.size()); }
  bool has_parameters() const { return given_.regressor != nullptr; }
  bool has_external() const { return !given_.external_links.empty(); }
  int external_at() const { return inputs(); } ///< which of the buffers
  int external_numbers() const { return 6 * static_cast<int>(given_.external_links.size()); }
  int parameters_at() const { return inputs() + (has_external() ? 1 : 0); }
  int buffers() const { return parameters_at() + (has_parameters() ? 1 : 0); } ///< with them
  /// Is the product of a cotangent and all first derivatives computed at once?  That algorithm knows no external wrenches.
  bool has_gradient() const { return given_.gradient && !has_external() && !is_along(); }
  int parameters() const { return 10 * static_cast<int>(all_links_.size()); }

  bool is_position(int x) const {
    const ksl::input list = given_.value->input_list[x];
    return list == ksl::input::q || list == ksl::input::q1;
  }
  /// How many numbers buffer x has.
  int width(int x) const {
    return x < inputs() ? ksl::length_of(given_.value->input_list[x], model_.nq(), model_.nv())
           : has_external() && x == external_at() ? external_numbers()
                                                  : parameters();
  }
  /// How many numbers a result of a row has.
  std::ptrdiff_t numbers(const ksl::algorithm_row &row, int result) const {
    return ksl::numbers_of(row.result[result], extents(row));
  }
  bool gives_reactions() const { return given_.value->request == ksl::request_kind::reactions; }
  std::ptrdiff_t result_numbers() const {
    return gives_reactions() ? std::ptrdiff_t(6) * given_.joints.n : numbers(*given_.value, given_.value_result);
  }
  /// The shape of the result of a state.
  std::vector<int> result_shape() const {
    if (gives_reactions())
      return {given_.joints.n, 6};
    const ksl::result_row &result = given_.value->result[given_.value_result];
    std::vector<int> shape;
    for (int i = 0; i < result.axes; ++i)
      shape.push_back(ksl::length_of(result.shape[i], extents(*given_.value)));
    return shape;
  }
  /// How many numbers derivatives are of: fewer than those of the result if that is lifted.
  std::ptrdiff_t moving_numbers() const {
    return given_.lift == lifted::position ? model_.nv()
           : given_.lift == lifted::poses  ? 6 * static_cast<std::ptrdiff_t>(given_.links.size())
                                           : result_numbers();
  }

  /// A batch of a row for these inputs; null for inputs that the row doesn't have.
  template <class S> ksl::batch_view<S> batch(const ksl::algorithm_row &row, std::size_t n,
                                              const std::vector<const S *> &inputs) const {
    ksl::batch_view<S> b;
    b.n = n;
    for (int i = 0; i < this->inputs(); ++i)
      if (const ksl::input list = given_.value->input_list[i]; row.reads(list))
        ksl::input_of(b, list) = {inputs[static_cast<std::size_t>(i)], width(i)};
    const std::vector<int> &links = links_of(row);
    b.links = {static_cast<int>(links.size()), links.data()};
    b.frame = given_.frame;
    if (given_.has_joints)
      b.joints = &given_.joints;
    return b;
  }

private:
  /// Regressors are by all links.
  const std::vector<int> &links_of(const ksl::algorithm_row &row) const {
    return &row == given_.regressor ? all_links_ : given_.links;
  }
  ksl::extents extents(const ksl::algorithm_row &row) const {
    return {model_.nq(),
            model_.nv(),
            static_cast<int>(links_of(row).size()),
            given_.joints.n,
            model_.tree_elements(),
            static_cast<int>(all_links_.size())};
  }

  const ksl::model model_;
  std::optional<ksl::model> tree_;
  description given_;
  const tangent tangent_;
  std::vector<int> all_links_;
};

} // namespace operators
