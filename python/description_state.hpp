// Descriptions as nested lists of plain Python values, for pickles: all that a model is made of, in a fixed order.
#pragma once

#include "ksl/engine/model/description.hpp"
#include "paths.hpp"

#include <nanobind/nanobind.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <stdexcept>
#include <type_traits>

namespace description_state {

namespace nb = nanobind;

// The fields of each struct, once for both directions.  `go` is a writer or a reader.
template <class Go> void fields(Go &go, ksl::vec3<double> &v) { go(v.x, v.y, v.z); }
template <class Go> void fields(Go &go, ksl::mat3x3<double> &R) {
  go(R.m00, R.m10, R.m20, R.m01, R.m11, R.m21, R.m02, R.m12, R.m22);
}
template <class Go> void fields(Go &go, ksl::SE3<double> &D) { go(D.R, D.t); }
template <class Go> void fields(Go &go, ksl::spatial_inertia<double> &I) {
  go(I.m, I.h, I.Ixx, I.Iyy, I.Izz, I.Ixy, I.Iyz, I.Izx);
}
template <class Go> void fields(Go &go, ksl::file_position &at) { go(at.line); }
template <class Go> void fields(Go &go, ksl::given_rotation &r) { go(r.by, r.numbers); }
template <class Go> void fields(Go &go, ksl::given_inertia &I) { go(I.mass, I.center_of_mass, I.axes, I.moments); }
template <class Go> void fields(Go &go, ksl::given_joint &j) { go(j.rotation, j.axis, j.axis2, j.pitch); }
template <class Go> void fields(Go &go, ksl::link_description &l) {
  go(l.name, l.at, l.inertia, l.has_inertial, l.has_geometry, l.given);
}
template <class Go> void fields(Go &go, ksl::coordinate_limits &l) { go(l.lower, l.upper); }
template <class Go> void fields(Go &go, ksl::mimic_description &m) { go(m.joint, m.multiplier, m.offset, m.at); }
template <class Go> void fields(Go &go, ksl::joint_description &j) {
  go(j.name, j.at, j.kind, j.parent, j.child, j.placement, j.axis, j.axis2, j.pitch, j.lower, j.upper, j.effort,
     j.velocity, j.damping, j.friction, j.friction_width, j.armature, j.rotor_inertia, j.gear_ratio, j.spring_stiffness,
     j.spring_rest, j.is_rotor, j.mimic, j.given);
  go(j.further[0], j.further[1]);
}
template <class Go> void fields(Go &go, ksl::given_loop &l) {
  go(l.predecessor, l.successor, l.axis, l.axis2, l.pitch);
}
template <class Go> void fields(Go &go, ksl::loop_description &l) {
  go(l.name, l.at, l.kind, l.predecessor, l.successor, l.predecessor_pose, l.successor_pose, l.axis, l.axis2, l.pitch,
     l.given, l.turned, l.moved);
}
template <class Go> void fields(Go &go, ksl::force_element_numbers &f) {
  go(f.stiffness, f.free_length, f.damping, f.preload, f.lower, f.upper, f.stop_stiffness);
}
template <class Go> void fields(Go &go, ksl::force_element_description &f) {
  go(f.name, f.at, f.link1, f.link2, f.point1, f.point2, f.numbers);
}
template <class Go> void fields(Go &go, ksl::joint_compliance &c) { go(c.joint, c.matrix, c.loose); }
template <class Go> void fields(Go &go, ksl::physics_options &p) {
  go(p.damping, p.friction, p.armature, p.rotor, p.spring, p.rotor_bodies, p.exact_friction, p.friction_width,
     p.force_elements);
}
template <class Go> void fields(Go &go, ksl::robot_description &r) {
  go(r.name, r.file, r.links, r.joints, r.loops, r.force_elements, r.drives, r.drive_weights, r.compliances, r.gravity,
     r.physics, r.floating_base, r.unused, r.warnings);
}

template <class T> constexpr bool is_struct = requires(T &x, void (&go)(...)) { fields(go, x); };

/// Appends values to a list; a struct is a list of its own.
class writer {
public:
  template <class... T> void operator()(T &...x) { (put(x), ...); }
  nb::list list;

private:
  template <class T> static nb::object value(T &x) {
    if constexpr (std::is_enum_v<T>) {
      return nb::cast(static_cast<int>(x));
    } else if constexpr (is_struct<T>) {
      writer of_struct;
      fields(of_struct, x);
      return of_struct.list;
    } else if constexpr (std::is_same_v<T, std::string>) {
      return paths::str_of(x);
    } else {
      return nb::cast(x);
    }
  }
  template <class T> static nb::object value(std::optional<T> &x) { return x ? value(*x) : nb::none(); }
  template <class T> static nb::object value(std::vector<T> &all) {
    nb::list values;
    for (T &x : all)
      values.append(value(x));
    return values;
  }
  template <class T> void put(T &x) { list.append(value(x)); }
};

/// Takes them from the list again, in the same order.  Throws where the list is shorter or longer: another version of KSL wrote it.
class reader {
public:
  explicit reader(nb::list from) : list_(std::move(from)) {}
  template <class... T> void operator()(T &...x) { (get(next(), x), ...); }
  template <class T> static void all_of(nb::list from, T &x) {
    reader go(std::move(from));
    fields(go, x);
    if (go.next_ != go.list_.size())
      refuse();
  }

private:
  [[noreturn]] static void refuse() {
    throw std::invalid_argument("the model was pickled by another version of KSL; load its robot file again");
  }
  nb::object next() {
    if (next_ == list_.size())
      refuse();
    return list_[next_++];
  }
  template <class T> static void get(nb::object from, T &x) {
    if constexpr (std::is_enum_v<T>) {
      x = static_cast<T>(nb::cast<int>(from));
    } else if constexpr (is_struct<T>) {
      all_of(nb::cast<nb::list>(from), x);
    } else if constexpr (std::is_same_v<T, std::string>) {
      x = paths::bytes_of(from);
    } else {
      x = nb::cast<T>(from);
    }
  }
  template <class T> static void get(nb::object from, std::optional<T> &x) {
    if (from.is_none())
      x.reset();
    else
      get(std::move(from), x.emplace());
  }
  template <class T> static void get(const nb::object &from, std::vector<T> &all) {
    for (nb::handle each : nb::cast<nb::list>(from))
      get(nb::borrow(each), all.emplace_back());
  }

  nb::list list_;
  std::size_t next_ = 0;
};

inline nb::list state_of(ksl::robot_description robot) {
  writer go;
  fields(go, robot);
  return go.list;
}

inline ksl::robot_description robot_of(nb::list state) {
  ksl::robot_description robot;
  reader::all_of(std::move(state), robot);
  return robot;
}

} // namespace description_state
