// Calls of all algorithms from Python.  Arguments are checked here, by what engine/run/arguments.hpp asks of them.
//
// Arrays that can be read as they are go straight to the kernels: they must have one precision, equal leading shapes and a
// constant distance between rows.  Others are first converted by ksl.mechanism.states.
#pragma once

#include "array.hpp"
#include "one_state.hpp"
#include "result_memory.hpp"
#include "without_gil.hpp"

#include "batch/compute_batch.hpp"
#include "batch/threads.hpp"
#include "engine/run/arguments.hpp"
#include "engine/run/all_ways.hpp"
#include "text/rounding.hpp"
#include "ksl/dynamics.hpp"
#include "text/words.hpp"

#include <atomic>
#include <climits>
#include <cstring>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

namespace calls {

/// Links by index, in the order wanted.  ksl.mechanism.requests keeps these objects, so that calls need not convert lists.
struct link_request {
  std::vector<int> index;
  ksl::frame_options frame; ///< how the motion of a single link is expressed
};

/// Joints whose reactions are wanted, and how these are expressed.
struct reactions_request {
  std::vector<int> links;
  ksl::reaction_request request;
};

/// Raises ValueError.
[[noreturn]] inline void refuse(const std::string &sentence) { throw nb::value_error(sentence.c_str()); }

inline std::string text_of(nb::handle object) { return nb::str(object).c_str(); }
inline std::string class_name(nb::handle object) { return text_of(object.type().attr("__name__")); }

/// The argument `threads`; 0 means all cores.
inline int thread_count(nb::handle threads) {
  const int none = threads.is_none() ? 1 : PyObject_Not(threads.ptr());
  if (none < 0)
    nb::raise_python_error();
  if (none)
    return 0;
  const nb::object whole =
      nb::steal(PyBool_Check(threads.ptr()) ? nullptr : PyNumber_Index(threads.ptr())); // True is no count
  if (!whole.is_valid()) {
    PyErr_Clear();
    refuse("threads=" + std::string(nb::repr(threads).c_str()) +
           "; expected how many threads to use at most, or None or 0 for all cores");
  }
  int overflow = 0;
  const long n = PyLong_AsLongAndOverflow(whole.ptr(), &overflow);
  if (overflow < 0 || (!overflow && n < 0))
    refuse("threads=" + text_of(whole) + "; expected how many threads to use at most, or None or 0 for all cores");
  return overflow || n > INT_MAX ? INT_MAX : static_cast<int>(n);
}

/// An argument: q, v, a, tau, or the wrench on a link.
struct argument {
  nb::object object;
  const char *name = nullptr; ///< null: a wrench
  int columns = 0;
  nb::object link_name = {};
  int link = -1;
  row_array array = {};

  /// Its name in messages.
  std::string text() const { return name ? name : "external[" + std::string(nb::repr(link_name).c_str()) + "]"; }
  std::string short_text() const { return name ? name : text_of(link_name); }

  /// The shape that sentences ask for.
  std::string expected() const {
    const char *const numbers = !name            ? "force, then moment"
                                : name[0] == 'q' ? "nq numbers for each state"
                                : name[0] == 'f' ? "one number for each state"
                                                 : "nv numbers for each state";
    return "expected (…, " + std::to_string(columns) + "): " + numbers;
  }

  /// An array of numbers with at least one axis; one number, an array with named fields, and what is no number (dates, texts, objects) is converted
  /// or refused by Python.
  bool is_array() const {
    if (!PyArray_CheckExact(object.ptr()))
      return false;
    const auto given = reinterpret_cast<PyArrayObject *>(object.ptr());
    return PyArray_NDIM(given) > 0 && std::strchr("fiubc", PyArray_DESCR(given)->kind) != nullptr;
  }
  void read() {
    array = {reinterpret_cast<PyArrayObject *>(object.ptr()), columns, 1};
  } // is_array(), or made one by Python
};

/// Numbers are checked and then computed in parts of this size, which stay in the inner caches in between.
constexpr std::size_t cached_bytes = 64 << 10;
/// Fewer states than this are computed with the interpreter's lock held, since releasing it takes 50 ns.
constexpr std::size_t states_worth_releasing = 32;

inline bool finite(const double *x, std::size_t n) { return ksl::finite_kernels_in_force().in_double(x, n); }
inline bool finite(const float *x, std::size_t n) { return ksl::finite_kernels_in_force().in_float(x, n); }

/// Are the numbers of the rows [first, end) finite?  True if there are no rows.
template <class S> bool finite(const ksl::rows_view<const S> &rows, int columns, std::size_t first, std::size_t end) {
  const std::size_t width = static_cast<std::size_t>(columns);
  if (!rows.first)
    return true;
  if (rows.stride == columns)
    return finite(row(rows, first), (end - first) * width);
  for (std::size_t k = first; k < end; ++k)
    if (!finite(row(rows, k), width))
      return false;
  return true;
}

inline std::string of_normalised(const std::string &which) {
  return which + " differs from unit length by more than 1e-6 and was normalised; give unit quaternions [qx qy qz qw]";
}

/// Warns where the method was called that a quaternion was normalised.
inline void warn_of_quaternion(const std::string &which) {
  const std::string text = of_normalised(which);
  const nb::object category = nb::module_::import_("ksl.base.errors").attr("QuaternionWarning");
  if (PyErr_WarnEx(category.ptr(), text.c_str(), 2) < 0)
    nb::raise_python_error();
}

/// Refuses the first quaternion of n positions that is not of unit length, even nearly.
template <class S>
void refuse_quaternions(const ksl::model &m, const ksl::rows_view<const S> &q, std::size_t n) {
  ksl::check_quaternions(m, q, 0, n, [](const ksl::joint_row &joint, std::size_t k, const S *numbers) {
    if (ksl::is_unit_quaternion(numbers))
      return true;
    refuse(joint.name + ": quaternion of state " + std::to_string(k) + " has length " +
           ksl::text::shown(ksl::quaternion_length(numbers)) + "; expected a unit quaternion [qx qy qz qw]");
  });
}

/// Which quaternion a warning is about.
inline std::string rough_quaternion(const std::string &method, const ksl::model &m, std::size_t state) {
  std::string joints;
  for (const ksl::model::quaternion_in_q &quaternion : m.quaternions())
    joints += (joints.empty() ? "" : ", ") + m.joints()[static_cast<std::size_t>(quaternion.joint)].name;
  return method + ": a quaternion of state " + std::to_string(state) + " (of " + joints + ")";
}

/// One call of an algorithm.
class call {
public:
  call(const ksl::algorithm_row &row, const ksl::model &m, const nb::handle *inputs, nb::handle external,
       nb::handle request)
      : row_(row), m_(m), external_(nb::borrow(external)) {
    ksl::check_model(row, m, refuse);
    inputs_.reserve(ksl::most_inputs);
    for (int i = 0; i < row.inputs; ++i)
      inputs_.push_back({nb::borrow(inputs[i]), row.input_name[i], ksl::length_of(row.input_list[i], m.nq(), m.nv())});
    read_request(request);
  }

  nb::object run(nb::handle out, nb::handle threads) {
    const ksl::nearest_rounding rounding;
    const int most = thread_count(threads);
    ksl::require_computable(row_, m_);
    ksl::kernels(); // raises the error of an unusable KSL_ISA here and not on another thread
    if (!take_external() || !all_of([](const argument &x) { return x.is_array(); }))
      convert();
    check_shapes();
    if (!readable<double>() && !readable<float>())
      rearrange();
    return readable<double>() ? run_in<double>(out, most) : run_in<float>(out, most);
  }

private:
  template <class Condition> bool all_of(Condition condition) const {
    for (const std::vector<argument> *arguments : {&inputs_, &wrenches_})
      for (const argument &x : *arguments)
        if (!condition(x))
          return false;
    return true;
  }
  template <class Step> void for_each(Step step) {
    for (std::vector<argument> *arguments : {&inputs_, &wrenches_})
      for (argument &x : *arguments)
        step(x);
  }

  void read_request(nb::handle request) {
    const auto add = [&](nb::handle one) { reactions_.push_back(&nb::cast<const reactions_request &>(one).request); };
    if (row_.request == ksl::request_kind::joints)
      joints_ = &nb::cast<const reactions_request &>(request).request;
    else if (row_.request == ksl::request_kind::reactions && PyTuple_Check(request.ptr()))
      for (nb::handle one : nb::borrow<nb::tuple>(request))
        add(one);
    else if (row_.request == ksl::request_kind::reactions)
      add(request);
    else if (row_.request != ksl::request_kind::none || !request.is_none()) // no links: in which order numbers are
      links_ = &nb::cast<const link_request &>(request);
    if (const int least = ksl::least_links(row_.request); least > 0 && link_count() != least)
      refuse(least == 1 ? "expected one link or joint" : "expected two links or joints");
    if (!ksl::may_name_links(row_, m_, link_count()))
      refuse("names has " + std::to_string(link_count()) +
             " frames; expected at most as many as the model has links, " + std::to_string(m_.links().size()));
  }

  /// Takes {link name: wrench}.  Returns false if it is not exactly a dict; subclasses of dict may override item access.
  bool take_external() {
    if (row_.external == ksl::external_use::none || external_.is_none())
      return true;
    if (!PyDict_CheckExact(external_.ptr()))
      return false;
    const nb::list items =
        nb::steal<nb::list>(PyDict_Items(external_.ptr())); // a copy, since other threads may change the dict
    wrenches_.clear();
    for (nb::handle item : items)
      wrenches_.push_back(
          {nb::borrow(PyTuple_GetItem(item.ptr(), 1)), nullptr, 6, nb::borrow(PyTuple_GetItem(item.ptr(), 0))});
    return true;
  }

  /// What a function of ksl.mechanism.states makes of arguments.
  template <class... Objects> static nb::tuple converted(const char *function, const Objects &...arguments) {
    const nb::object found = nb::module_::import_("ksl.mechanism.states").attr(function);
    PyObject *const made = call_python(found.ptr(), arguments.ptr()...);
    if (!made)
      nb::raise_python_error();
    return nb::cast<nb::tuple>(nb::steal<nb::object>(made));
  }

  /// Converts arguments that are not arrays (ksl.mechanism.states.as_arrays).
  void convert() {
    for_each([](const argument &x) {
      if (x.object.is_none())
        refuse(x.text() + " is None; " + x.expected());
    });
    nb::list given, roles;
    for (const argument &x : inputs_) {
      given.append(x.object);
      roles.append(nb::make_tuple(x.name, x.columns));
    }
    const nb::tuple made = converted("as_arrays", given, roles, nb::cast(m_, nb::rv_policy::reference), external_);
    for (std::size_t i = 0; i < inputs_.size(); ++i)
      inputs_[i].object = made[0][i];
    external_ = made[1];
    world_axes_ = nb::cast<bool>(made[2]);
    take_external();
  }

  /// Converts arrays to their full leading shape, contiguous and of one precision (ksl.mechanism.states.as_rows).  Wrenches are always
  /// copied, since a result may lie in their memory.
  void rearrange() {
    nb::list inputs, wrenches, leading;
    for (const argument &x : inputs_)
      inputs.append(x.object);
    for (const argument &x : wrenches_)
      wrenches.append(x.object);
    for (int i = 0; i < leading_.axes; ++i)
      leading.append(leading_.length[i]);
    const nb::tuple made = converted("as_rows", inputs, wrenches, nb::tuple(leading));
    for (std::size_t i = 0; i < inputs_.size(); ++i)
      inputs_[i].object = made[0][i];
    for (std::size_t i = 0; i < wrenches_.size(); ++i)
      wrenches_[i].object = made[1][i];
    for_each([](argument &x) { x.read(); });
    rearranged_ = true;
  }

  /// Checks the arrays: real numbers, the right length of rows, known links, and leading shapes that can be broadcast.
  void check_shapes() {
    for_each([](argument &x) {
      x.read();
      if (x.array.kind() == 'c')
        refuse(x.text() + " is complex (" + x.array.type() + "); expected real numbers: .real takes the real parts");
    });
    for_each([](argument &x) {
      if (x.array.axes() > 0 && x.array.length(x.array.axes() - 1) == x.columns)
        return;
      refuse(x.text() + " has shape " + x.array.shape() + "; " + x.expected());
    });
    for (argument &x : wrenches_)
      x.link = link_of(x.link_name);
    leading_ = inputs_[0].array.leading();
    for_each([&](argument &x) {
      if (!x.array.has_leading(leading_) && !leading_.broadcast(x.array.leading()))
        refuse_leading_shapes();
    });
  }

  int link_of(nb::handle name) const {
    Py_ssize_t size = 0;
    const char *const text = PyUnicode_Check(name.ptr()) ? PyUnicode_AsUTF8AndSize(name.ptr(), &size) : nullptr;
    const std::string word = text ? std::string(text, static_cast<std::size_t>(size)) : "";
    const int link = text ? m_.find_link(word) : -1;
    const int told = link < 0 && word.compare(0, 5, "link:") == 0 ? m_.find_link(word.substr(5)) : link;
    if (told >= 0)
      return told;
    PyErr_Clear();
    nb::list known;
    for (const ksl::link_description &l : m_.links())
      known.append(l.name);
    const ksl::robot_description &robot = m_.description();
    const int joint = text ? m_.find_joint(word) : -1;
    const auto carried = [&] {
      return m_.links()[static_cast<std::size_t>(m_.joints()[static_cast<std::size_t>(joint)].link)].name;
    };
    const nb::object errors = nb::module_::import_("ksl.base.errors");
    const std::string &where = robot.name.empty() ? robot.file : robot.name;
    refuse(text_of(joint < 0 ? errors.attr("unknown_name")(where, "link", name, known)
                             : errors.attr("other_kind")(where, "link", name, "joint", carried())));
  }

  [[noreturn]] void refuse_leading_shapes() {
    std::string found;
    for_each([&](argument &x) { found += (found.empty() ? "" : ", ") + x.short_text() + " " + x.array.shape(); });
    refuse("leading shapes don't broadcast: " + found);
  }

  template <class S> bool readable() const {
    return all_of([&](const argument &x) { return x.array.readable<S>() && x.array.has_leading(leading_); });
  }

  /// The shape of result r.  The results of the algorithm's row come first, then one for each request for reactions.
  leading_shape shape_of(std::size_t r) const {
    leading_shape shape = leading_;
    const auto add = [&](int n) { shape.length[shape.axes++] = n; };
    if (r >= static_cast<std::size_t>(row_.results)) {
      add(reactions_[r - static_cast<std::size_t>(row_.results)]->n), add(6);
      return shape;
    }
    const ksl::result_row &result = row_.result[r];
    for (int i = 0; i < result.axes; ++i)
      add(ksl::length_of(result.shape[i], {m_.nq(), m_.nv(), link_count(), joints_ ? joints_->n : 0, m_.tree_elements(),
                                           static_cast<int>(m_.links().size())}));
    return shape;
  }
  int link_count() const { return links_ ? static_cast<int>(links_->index.size()) : 0; }

  /// Creates arrays for the results, or takes those in `out`.
  template <class S> void take_results(nb::handle out) {
    const std::size_t n = static_cast<std::size_t>(row_.results) + reactions_.size();
    const bool several = n > 1, given = !out.is_none();
    if (several && given && !((PyTuple_Check(out.ptr()) || PyList_Check(out.ptr())) && nb::len(out) == n))
      refuse("out is " + class_name(out) + "; expected " + (n == 2 ? "two" : std::to_string(n)) + " arrays, (" +
             result_names() + ")");
    for (std::size_t r = 0; r < n; ++r) {
      leading_shape shape = shape_of(r);
      nb::object array;
      if (given)
        array = several ? nb::object(out[r]) : nb::borrow(out);
      else
        array = new_array(shape.axes, shape.length, numpy_type<S>);
      if (given)
        check_out<S>(array, shape);
      int columns = 1;
      for (int i = leading_.axes; i < shape.axes; ++i)
        columns *= static_cast<int>(shape.length[i]);
      results_.push_back({array, columns, shape.axes - leading_.axes});
      arrays_.push_back(std::move(array));
    }
  }
  std::string result_names() const {
    std::string names;
    for (int r = 0; r < row_.results; ++r)
      names += std::string(r ? ", " : "") + row_.result[r].name;
    return names;
  }

  template <class S> void check_out(nb::handle out, const leading_shape &wanted) const {
    const char *const dtype = sizeof(S) == 8 ? "float64" : "float32";
    std::string found = class_name(out);
    if (PyArray_Check(out.ptr())) {
      const auto array = reinterpret_cast<PyArrayObject *>(out.ptr());
      const row_array whole(out, 1, 0);
      const bool masked = !PyArray_CheckExact(out.ptr()) && nb::hasattr(out, "mask");
      if (PyArray_TYPE(array) == numpy_type<S> && PyArray_ISCARRAY(array) && whole.has_leading(wanted) && !masked)
        return;
      found = masked ? found : whole.type() + " " + whole.shape();
    }
    refuse("out is " + found + "; expected a C-contiguous, aligned, writeable " + dtype + " array of shape " +
           ::text_of(wanted.length, wanted.axes));
  }

  /// Checks that results don't overwrite arguments that are still needed.  Each state is read before its result is written, so a
  /// result may share memory with an argument if their rows coincide.
  void check_overlaps() {
    const auto spared = [&](const argument &x) {
      for (const row_array &result : results_)
        if (x.name ? !result.spares(x.array) : !result.apart_from(x.array))
          return false;
      return true;
    };
    if (!all_of(spared) && !rearranged_)
      rearrange(); // copies wrenches, and arguments that are not contiguous
    for_each([&](argument &x) {
      if (!spared(x)) {
        const std::string name = x.text();
        refuse("out overlaps " + name + ", which would be overwritten before it is read; give out=" + name +
               " itself or memory apart from it");
      }
    });
    for (std::size_t r = 1; r < results_.size(); ++r)
      for (std::size_t earlier = 0; earlier < r; ++earlier)
        if (!results_[r].apart_from(results_[earlier]))
          refuse("out: " + result_names() + " overlap; give each memory of its own");
  }

  template <class S> nb::object run_in(nb::handle out, int threads) {
    take_results<S>(out);
    check_overlaps();
    std::vector<ksl::external_rows<S>> external;
    std::vector<ksl::reaction_rows<S>> reactions;
    const ksl::batch_view<S> batch = batch_of(external, reactions);
    if (!compute(batch, threads))
      refuse_numbers(batch);
    if (!ordinary_.load())
      ksl::examine_states(row_, m_, batch, 0, batch.n, ksl::arguments_are::finite);
    if (rough_state_.load() != none)
      warn_of_quaternions();
    return arrays_.size() == 1 ? arrays_[0] : nb::object(nb::tuple(nb::cast(arrays_)));
  }

  template <class S>
  ksl::batch_view<S> batch_of(std::vector<ksl::external_rows<S>> &external,
                              std::vector<ksl::reaction_rows<S>> &reactions) const {
    ksl::batch_view<S> batch;
    batch.n = static_cast<std::size_t>(leading_.states());
    std::size_t i = 0;
    for (const argument &x : inputs_)
      ksl::input_of(batch, row_.input_list[i++]) = x.array.template rows<const S>();
    for (const argument &x : wrenches_)
      external.push_back({x.link, x.array.template rows<const S>()});
    batch.external_n = static_cast<int>(external.size()), batch.external = external.data();
    batch.external_axes = world_axes_ ? ksl::expressed_in::world : ksl::expressed_in::frame;
    if (links_)
      batch.links = {link_count(), links_->index.data()}, batch.frame = links_->frame;
    batch.joints = joints_;
    const std::size_t own = static_cast<std::size_t>(row_.results);
    for (std::size_t r = 0; r < own; ++r)
      batch.result[r] = results_[r].template rows<S>();
    for (std::size_t r = 0; r < reactions_.size(); ++r)
      reactions.push_back({*reactions_[r], results_[own + r].template rows<S>()});
    batch.reactions_n = static_cast<int>(reactions.size()), batch.reactions = reactions.data();
    return batch;
  }

  /// Are the numbers of the states [first, end) finite, and quaternions of unit length?
  template <class S> bool acceptable(const ksl::batch_view<S> &batch, std::size_t first, std::size_t end) const {
    bool well = true;
    for (int i = 0; i < row_.inputs; ++i) {
      const ksl::input x = row_.input_list[i];
      well = well && finite(ksl::input_of(batch, x), ksl::length_of(x, m_.nq(), m_.nv()), first, end);
    }
    for (int e = 0; e < batch.external_n; ++e)
      well = well && finite(batch.external[e].wrench, 6, first, end);
    for (ksl::input x : {ksl::input::q, ksl::input::q1})
      if (row_.reads(x))
        ksl::check_quaternions(m_, ksl::input_of(batch, x), first, end,
                               [&](const auto &, std::size_t k, const S *numbers) {
                                 std::size_t least = rough_state_.load(std::memory_order_relaxed);
                                 while (k < least && !rough_state_.compare_exchange_weak(least, k))
                                   ;
                                 return well = ksl::is_unit_quaternion(numbers);
                               });
    return well;
  }

  /// Checks each part right before it is computed, while its numbers are in the caches; this saves a second pass over memory.
  /// If a result is written over an argument, all parts are checked first, so that an error leaves the argument unchanged.
  template <class S> bool compute(const ksl::batch_view<S> &batch, int threads) const {
    bool in_place = false;
    for (const row_array &result : results_)
      in_place = in_place || !all_of([&](const argument &x) { return result.apart_from(x.array); });
    const auto check = [&](std::size_t first, std::size_t end) { return acceptable(batch, first, end); };
    const auto run = [&](std::size_t first, std::size_t end) {
      if (!ksl::compute_states(row_, m_, batch, first, end))
        ordinary_.store(false, std::memory_order_relaxed);
      return true;
    };
    const auto both = [&](std::size_t first, std::size_t end) { return check(first, end) && run(first, end); };
    std::optional<without_gil> released;
    if (batch.n >= states_worth_releasing)
      released.emplace();
    if (in_place)
      return for_parts<S>(batch.n, threads, check) && for_parts<S>(batch.n, threads, run);
    return for_parts<S>(batch.n, threads, both);
  }

  /// Calls step(first, end) for all states, in parts and on several threads, until one call returns false.
  template <class S, class Step> bool for_parts(std::size_t n, int threads, Step step) const {
    const std::size_t bytes = sizeof(S) * static_cast<std::size_t>(1 + m_.nq() + 2 * m_.nv());
    const std::size_t some = (1 + cached_bytes / 64 / bytes) * 64;
    std::atomic<bool> well{true}, no_memory{false};
    const ksl::partition parts(n, some, ksl::least_states(m_.moving_joints()), threads);
    ksl::on_threads(parts, [&](std::size_t first, std::size_t end, std::size_t) {
      for (std::size_t k = first; k < end && well.load(std::memory_order_relaxed); k += some)
        try {
          if (!step(k, end - k < some ? end : k + some))
            well.store(false, std::memory_order_relaxed);
        } catch (const std::bad_alloc &) { // an exception must not leave the thread
          no_memory.store(true);
          well.store(false);
        }
    });
    if (no_memory.load())
      throw std::bad_alloc();
    return well.load();
  }

  /// Raises the error that names the number that is not finite, or the quaternion that is not of unit length.
  template <class S> [[noreturn]] void refuse_numbers(const ksl::batch_view<S> &batch) {
    for_each([&](argument &x) {
      const ksl::rows_view<const S> rows = x.array.rows<const S>();
      for (std::size_t k = 0; k < batch.n; ++k)
        if (const int c = ksl::first_not_finite(row(rows, k), x.columns); c < x.columns) {
          const S number = row(rows, k)[c];
          const char *const value = std::isnan(number) ? "nan" : number > 0 ? "inf" : "-inf";
          const std::string index = leading_.index_of(static_cast<npy_intp>(k)) + std::to_string(c);
          refuse(x.text() + "[" + index + "] is " + value + "; every number must be finite");
        }
    });
    for (ksl::input x : {ksl::input::q, ksl::input::q1})
      if (row_.reads(x))
        refuse_quaternions<S>(m_, ksl::input_of(batch, x), batch.n);
    refuse("the arguments changed while they were read; other threads must not write to them during a call");
  }

  /// Warns that a quaternion was normalised.  (Algorithms divide by its length, so that no array is changed or copied.)
  void warn_of_quaternions() const { warn_of_quaternion(rough_quaternion(row_.name, m_, rough_state_.load())); }

  static constexpr std::size_t none = static_cast<std::size_t>(-1);

  const ksl::algorithm_row &row_;
  const ksl::model &m_;
  mutable std::atomic<std::size_t> rough_state_{none}; ///< the first with a quaternion that isn't quite of unit length
  mutable std::atomic<bool> ordinary_{true};           ///< are the results of all states
  std::vector<argument> inputs_, wrenches_;
  nb::object external_;
  bool world_axes_ = false; ///< of external wrenches
  const link_request *links_ = nullptr;
  const ksl::reaction_request *joints_ = nullptr; ///< of results that are those of the row
  std::vector<const ksl::reaction_request *> reactions_;
  leading_shape leading_;
  bool rearranged_ = false;
  std::vector<nb::object> arrays_; ///< results
  std::vector<row_array> results_;
};

/// Runs an algorithm and returns its result, or a tuple of results.  inputs are those that the row lists.
inline nb::object run(const ksl::algorithm_row &row, const ksl::model &m, const nb::handle (&inputs)[ksl::most_inputs],
                      nb::handle external, nb::handle request, nb::handle out, nb::handle threads) {
  if (nb::object result = one_state_call(row, m, inputs).run(external, request, out, threads); result.is_valid())
    return result;
  return call(row, m, inputs, external, request).run(out, threads);
}

} // namespace calls
