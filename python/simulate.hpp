// Simulation from Python: arrays that ksl.simulation has converted, double, C-contiguous; functions of the user are called with the lock.
#pragma once

#include "calls.hpp"
#include "loops.hpp"
#include "without_gil.hpp"

#include "ksl/simulate.hpp"

#include <atomic>
#include <chrono>
#include <optional>
#include <thread>

namespace simulation_calls {

namespace nb = nanobind;
using namespace nb::literals;
using loops_calls::data_of;

inline std::vector<std::size_t> shape_of(nb::handle array) {
  const auto a = reinterpret_cast<PyArrayObject *>(array.ptr());
  if (!PyArray_Check(array.ptr()) || PyArray_TYPE(a) != NPY_DOUBLE || !PyArray_ISCARRAY_RO(a))
    throw std::invalid_argument("a contiguous array of doubles is expected");
  return {PyArray_DIMS(a), PyArray_DIMS(a) + PyArray_NDIM(a)};
}

/// (times (n), rows (runs or 1, n, columns)), or None.
inline ksl::rows_over_time over_time(nb::handle given) {
  if (given.is_none())
    return {};
  const nb::tuple pair = nb::cast<nb::tuple>(given);
  const std::vector<std::size_t> times = shape_of(pair[0]), rows = shape_of(pair[1]);
  if (times.size() != 1 || rows.size() != 3 || rows[1] != times[0])
    throw std::invalid_argument("times (n) and rows (runs, n, columns) are expected");
  return {times[0], data_of(pair[0]), data_of(pair[1]), rows[0] > 1 ? rows[1] * rows[2] : 0};
}
inline const double *numbers(nb::handle array) { return array.is_none() ? nullptr : (shape_of(array), data_of(array)); }

/// A function of Python that is called while the lock is released; its error ends the call.
class python_function {
public:
  python_function(nb::handle function, const ksl::model &m) : function_(function.ptr()), m_(m) {}

  /// function(run, t, q (n, nq), v (n, nv)) → an array of `columns` numbers for each, into out; None ends the runs.
  bool call(std::size_t first, std::size_t n, double t, const double *q, const double *v, double *out) {
    const nb::gil_scoped_acquire lock;
    if (PyErr_Occurred()) // of another run
      return false;
    nb::object row = nb::int_(first), at = nb::float_(t), positions = array(n, static_cast<std::size_t>(m_.nq()), q),
               speeds = array(n, static_cast<std::size_t>(m_.nv()), v);
    const nb::object result = nb::steal(call_python(function_, row.ptr(), at.ptr(), positions.ptr(), speeds.ptr()));
    if (!result.is_valid() || result.is_none()) // an error, or a wish to end the run
      return false;
    std::copy_n(data_of(result), n * columns, out);
    return true;
  }

  std::size_t columns = 0;

private:
  static nb::object array(std::size_t n, std::size_t columns, const double *from) {
    nb::object out = loops_calls::new_rows(n, columns);
    std::copy_n(from, n * columns, data_of(out));
    return out;
  }
  PyObject *function_;
  const ksl::model &m_;
};

/// Looks for signals, Ctrl-C above all, and tells a function of Python how far the first run is, some times a second.
class watcher {
public:
  explicit watcher(nb::handle progress) : progress_(progress.ptr()), caller_(std::this_thread::get_id()) {}

  /// Called while the lock is released, by any thread.
  bool goes_on(std::size_t run, double t) {
    if (stopped_.load(std::memory_order_relaxed))
      return false;
    if (std::this_thread::get_id() != caller_)
      return true;
    const auto now = std::chrono::steady_clock::now();
    if (now - looked_ < std::chrono::milliseconds(50))
      return true;
    looked_ = now;
    const nb::gil_scoped_acquire lock;
    bool fails = PyErr_Occurred() != nullptr || PyErr_CheckSignals() != 0;
    if (!fails && progress_ != Py_None && run == 0) {
      nb::object at = nb::float_(t);
      fails = !nb::steal(call_python(progress_, at.ptr())).is_valid();
    }
    stopped_.store(fails, std::memory_order_relaxed);
    return !fails;
  }

private:
  PyObject *progress_;
  std::thread::id caller_;
  std::chrono::steady_clock::time_point looked_ = std::chrono::steady_clock::now();
  std::atomic<bool> stopped_{false};
};

/// Arrays of results by name.
class result_arrays {
public:
  result_arrays(const ksl::model &m, const ksl::simulation &task) : task_(task) {
    const std::size_t nq = static_cast<std::size_t>(m.nq()), nv = static_cast<std::size_t>(m.nv());
    out.q = make("q", nq), out.v = make("v", nv), out.a = make("a", nv), out.tau = make("tau", nv);
    out.kinetic = make("kinetic", 1), out.potential = make("potential", 1), out.work = make("work", 1);
    out.momentum = make("momentum", 6);
    if (!m.loops().empty())
      out.closure = make("closure", 1);
  }
  ksl::simulation_results out;
  nb::dict arrays;

private:
  double *make(const char *name, std::size_t columns) {
    const npy_intp shape[] = {static_cast<npy_intp>(task_.runs), static_cast<npy_intp>(task_.times_n),
                              static_cast<npy_intp>(columns)};
    const nb::object array = calls::new_array(3, shape, NPY_DOUBLE);
    arrays[name] = array;
    return data_of(array);
  }
  const ksl::simulation &task_;
};

inline void set_drives(const nb::dict &given, ksl::drive_law &law) {
  law.given = over_time(given["given"]);
  law.position = over_time(given["position"]), law.velocity = over_time(given["velocity"]);
  law.acceleration = over_time(given["acceleration"]);
  law.holds_gravity = nb::cast<bool>(given["gravity"]), law.computed_torque = nb::cast<bool>(given["computed_torque"]);
  law.stiffness = numbers(given["stiffness"]), law.damping = numbers(given["damping"]);
  law.limit = numbers(given["limit"]);
}

inline void set_laws(const nb::dict &given, ksl::exact_laws &laws) {
  laws.restitution = numbers(given["restitution"]);
  laws.lower = numbers(given["lower"]), laws.upper = numbers(given["upper"]);
  laws.friction = numbers(given["friction"]), laws.brake = numbers(given["brake"]);
  laws.brake_at = nb::cast<double>(given["brake_at"]), laws.cut_efforts = nb::cast<bool>(given["cut_efforts"]);
}

inline nb::tuple simulate(const ksl::model &m, nb::handle q, nb::handle v, nb::handle times, const nb::dict &how,
                          const nb::dict &drives, const nb::list &external, bool in_world, const nb::dict &laws,
                          const nb::list &events, nb::handle event_values, nb::handle threads, nb::handle progress) {
  ksl::simulation task;
  task.runs = shape_of(q)[0], task.q = data_of(q), task.v = data_of(v);
  task.times_n = shape_of(times)[0], task.times = data_of(times);
  task.method = static_cast<ksl::stepping>(nb::cast<int>(how["method"]));
  task.step = nb::cast<double>(how["step"]);
  task.relative = nb::cast<double>(how["rtol"]), task.absolute = nb::cast<double>(how["atol"]);
  task.most_steps = nb::cast<std::size_t>(how["most_steps"]), task.project = nb::cast<bool>(how["project"]);
  task.threads = calls::thread_count(threads);
  set_drives(drives, task.drives), set_laws(laws, task.laws);
  const nb::object driven = nb::borrow(drives["driven"]), efforts = nb::borrow(drives["function"]);
  std::vector<unsigned char> flags;
  if (!driven.is_none()) {
    flags = loops_calls::flags(m, nb::cast<std::vector<int>>(driven));
    task.drives.driven = flags.data();
  }
  std::vector<ksl::wrench_over_time> wrenches;
  for (nb::handle each : external)
    wrenches.push_back({nb::cast<int>(each[0]), over_time(each[1])});
  task.external_n = static_cast<int>(wrenches.size()), task.external = wrenches.data();
  task.external_axes = in_world ? ksl::expressed_in::world : ksl::expressed_in::frame;
  std::vector<ksl::event_rule> rules;
  for (nb::handle each : events)
    rules.push_back({nb::cast<int>(each[0]), nb::cast<bool>(each[1])});
  task.events_n = static_cast<int>(rules.size()), task.events = rules.data();

  python_function drive(efforts, m), watch(event_values, m);
  const std::size_t nv = static_cast<std::size_t>(m.nv());
  if (!efforts.is_none()) {
    task.drives.context = &drive;
    task.drives.function = [](void *function, std::size_t first, std::size_t n, double t, const double *at,
                              const double *speed, double *tau) {
      python_function &f = *static_cast<python_function *>(function);
      return f.call(first, n, t, at, speed, tau);
    };
    drive.columns = nv;
  }
  if (!rules.empty()) {
    watch.columns = rules.size();
    task.event_context = &watch;
    task.event_values = [](void *function, std::size_t run, double t, const double *at, const double *speed,
                           double *values) {
      python_function &f = *static_cast<python_function *>(function);
      return f.call(run, 1, t, at, speed, values);
    };
  }
  watcher watching(progress);
  task.step_context = &watching;
  task.after_step = [](void *context, std::size_t run, double t) {
    return static_cast<watcher *>(context)->goes_on(run, t);
  };
  ksl::kernels(); // raises the error of an unusable KSL_ISA here and not on another thread
  result_arrays results(m, task);
  ksl::simulation_record record;
  {
    const without_gil released;
    record = ksl::simulate(m, task, results.out);
  }
  if (PyErr_Occurred())
    throw nb::python_error();
  nb::list ends, happened;
  for (const ksl::run_end &e : record.ends)
    ends.append(
        nb::make_tuple(static_cast<int>(e.how), e.time, e.steps, e.rejected, e.evaluations, e.coordinate, e.element));
  for (const ksl::simulated_event &e : record.events)
    happened.append(nb::make_tuple(e.run, e.time, static_cast<int>(e.what), e.number, e.speed));
  return nb::make_tuple(results.arrays, ends, happened);
}

inline void add_simulation(nb::class_<ksl::model> &model) {
  model.def("simulate", &simulate, "q"_a, "v"_a, "times"_a, "how"_a, "drives"_a, "external"_a, "in_world"_a, "laws"_a,
            "events"_a, "event_values"_a.none(), "threads"_a.none(), "progress"_a.none());
}

} // namespace simulation_calls
