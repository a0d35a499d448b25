// The C interface of the builder, and of models made from others.
//
// A builder copies all that it is given.  A call that fails leaves it as it was, and a model that was built doesn't follow it any more.
//
// How C says what C++ says by types:
//
//     C                                         C++
//     ksl_SE3_t, null for the identity          SE3<double>, the same layout: columns of R, then t
//     inertia[row][column]                      mat3x3, column by column
//     a vector, null where it isn't given       std::optional<vec3>
//     a number, NaN where it isn't given        optional_number
//     an index of a link or joint               its name, by which descriptions know it: made models number anew
//     ten parameters of a link                  m, m c, Ixx Ixy Iyy Ixz Iyz Izz about the link's origin, as regressors have them
//
// Models are made from descriptions, so that options of the first, floating base and gravity say, are those of the new one.
#include "c_api/calls.hpp"
#include "engine/building/inertias.hpp"

#include "ksl/surgery.hpp"
#include "ksl/urdf.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

struct ksl_builder_t { ksl::builder builder; };

namespace {

using ksl::c_api::created;
using ksl::c_api::guarded;
using ksl::c_api::require;

ksl::SE3<double> pose_of(const ksl_SE3_t *pose) {
  if (!pose)
    return {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0}};
  return ksl::same_layout<ksl::SE3<double>>(*pose);
}

// C has rows, inertia[row][column]; mat3x3 lies in columns
ksl::link_mass mass_of(const ksl_link_mass_t &of) {
  const auto &I = of.inertia;
  return {of.mass,
          {of.center_of_mass[0], of.center_of_mass[1], of.center_of_mass[2]},
          {I[0][0], I[1][0], I[2][0], I[0][1], I[1][1], I[2][1], I[0][2], I[1][2], I[2][2]}};
}

std::optional<ksl::vec3<double>> vector_of(const double *x) {
  return x ? std::optional(ksl::vec3<double>{x[0], x[1], x[2]}) : std::nullopt;
}

// C has no optional numbers: NaN says that one isn't given
ksl::optional_number number_of(double x) { return std::isnan(x) ? std::nullopt : ksl::optional_number(x); }

ksl::joint_options options_of(const ksl_joint_options_t &of) {
  ksl::joint_options options = {vector_of(of.axis),
                                vector_of(of.axis2),
                                number_of(of.pitch),
                                number_of(of.lower),
                                number_of(of.upper),
                                number_of(of.effort),
                                number_of(of.velocity),
                                of.damping,
                                of.friction,
                                {},
                                number_of(of.friction_width),
                                of.armature,
                                of.rotor_inertia,
                                of.gear_ratio,
                                of.spring_stiffness,
                                of.spring_rest,
                                {}};
  for (std::size_t c = 0; c < 2; ++c)
    options.further[c] = {number_of(of.further_lower[c]), number_of(of.further_upper[c])};
  if (of.mimics)
    options.mimic = {of.mimics, of.multiplier, of.offset, {}};
  return options;
}

std::string or_empty(const char *text) { return text ? text : ""; }

const std::string &link_name(const ksl_model_t *m, int link) {
  ksl::c_api::require_links(m, 1, &link, "link");
  return m->model.links()[static_cast<std::size_t>(link)].name;
}

void require_joint(const ksl_model_t *m, int joint) {
  ksl::c_api::require_index(joint, ksl_model_joints(m), "a joint is out of range", "joint");
}

/// Runs `make`, which returns a description or a model, with the result in *made.  Null where it fails.
/// `make` may return a description, from which the model is then built, or a model, as with_gravity does, which shares what stays.
template <class Make> ksl_status_t made_from(const ksl_model_t *model, ksl_model_t **made, Make &&make) {
  return created(made, model, "model and made must not be null", [&] { return new ksl_model_t{ksl::model(make())}; });
}

} // namespace

extern "C" {

ksl_joint_options_t ksl_joint_options(void) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN(); // the macro NAN is a float
  // axis, axis2; pitch, lower, upper, effort, velocity; damping, friction; mimics, multiplier, offset; friction_width, armature, rotor_inertia,
  // gear_ratio, spring_stiffness, spring_rest; further limits
  return {nullptr, nullptr, nan, nan, nan, nan, nan, 0, 0, nullptr, 1, 0, nan, 0, 0, 1, 0, 0, {nan, nan}, {nan, nan}};
}

ksl_loop_options_t ksl_loop_options(void) { return {nullptr, nullptr, std::numeric_limits<double>::quiet_NaN()}; }

ksl_force_element_numbers_t ksl_force_element_numbers(void) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  return {0, 0, 0, 0, nan, nan, 0};
}

ksl_status_t ksl_builder_create(const char *name, ksl_builder_t **builder) {
  return created(builder, name, "name and builder must not be null",
                 [&] { return new ksl_builder_t{ksl::builder(name)}; });
}

void ksl_builder_free(ksl_builder_t *builder) { delete builder; }

ksl_status_t ksl_builder_add_link(ksl_builder_t *builder, const char *name, const ksl_link_mass_t *mass) {
  return guarded([&] {
    require(builder && name, "builder and name must not be null");
    builder->builder.add_link(name, mass ? mass_of(*mass) : ksl::link_mass());
  });
}

ksl_status_t ksl_builder_add_joint(ksl_builder_t *builder, const char *name, const char *kind, const char *parent,
                                   const char *child, const ksl_SE3_t *pose, const ksl_joint_options_t *options) {
  return guarded([&] {
    require(builder && name && kind && parent && child, "builder, name, kind, parent and child must not be null");
    builder->builder.add_joint(name, ksl::joint_kind_named(kind), parent, child, pose_of(pose),
                               options ? options_of(*options) : ksl::joint_options());
  });
}

ksl_status_t ksl_builder_add_loop(ksl_builder_t *builder, const char *name, const char *kind, const char *predecessor,
                                  const char *successor, const ksl_SE3_t *predecessor_pose,
                                  const ksl_SE3_t *successor_pose, const ksl_loop_options_t *options) {
  return guarded([&] {
    require(builder && name && kind && predecessor && successor,
            "builder, name, kind, predecessor and successor must not be null");
    ksl::loop_options given;
    if (options)
      given = {vector_of(options->axis), vector_of(options->axis2), number_of(options->pitch)};
    builder->builder.add_loop(name, ksl::joint_kind_named(kind), predecessor, successor, pose_of(predecessor_pose),
                              pose_of(successor_pose), given);
  });
}

ksl_status_t ksl_builder_add_force_element(ksl_builder_t *builder, const char *name, const char *link1,
                                           const double *point1, const char *link2, const double *point2,
                                           const ksl_force_element_numbers_t *numbers) {
  return guarded([&] {
    require(builder && name && link1 && point1 && link2 && point2 && numbers,
            "builder, name, links, points and numbers must not be null");
    const ksl_force_element_numbers_t &x = *numbers;
    builder->builder.add_force_element(
        name, link1, *vector_of(point1), link2, *vector_of(point2),
        {x.stiffness, x.free_length, x.damping, x.preload, number_of(x.lower), number_of(x.upper), x.stop_stiffness});
  });
}

// Only null is refused here: joints may be added later, and names are judged with the whole robot.
ksl_status_t ksl_builder_set_drives(ksl_builder_t *builder, int n, const char *const *joints) {
  return guarded([&] {
    require(builder && n >= 0 && (joints || n == 0),
            "builder and joints must not be null, and their number not negative");
    std::vector<std::string> names;
    for (int i = 0; i < n; ++i) {
      require(joints[i], "the name of a joint must not be null");
      names.push_back(joints[i]);
    }
    builder->builder.set_drives(names);
  });
}

ksl_status_t ksl_builder_add_dh_chain(ksl_builder_t *builder, const char *parent, int n, const ksl_dh_row_t *rows,
                                      ksl_dh_convention_t convention, const char *prefix) {
  return guarded([&] {
    require(builder && parent && n >= 0 && (rows || n == 0),
            "builder, parent and rows must not be null, and their number not negative");
    require(convention == KSL_DH_STANDARD || convention == KSL_DH_MODIFIED,
            "convention must be KSL_DH_STANDARD or KSL_DH_MODIFIED");
    std::vector<ksl::dh_row> table;
    for (int i = 0; i < n; ++i) {
      const ksl_dh_row_t &row = rows[i];
      const ksl::joint_kind kind = row.kind ? ksl::joint_kind_named(row.kind) : ksl::joint_kind::revolute;
      table.push_back({row.a, row.alpha, row.d, row.theta, kind, mass_of(row.mass), {}});
    }
    builder->builder.add_dh_chain(
        parent, table, convention == KSL_DH_MODIFIED ? ksl::dh_convention::modified : ksl::dh_convention::standard,
        or_empty(prefix));
  });
}

ksl_status_t ksl_builder_build(const ksl_builder_t *builder, const ksl_model_options_t *options, ksl_model_t **model) {
  return created(model, builder, "builder and model must not be null", [&] {
    const ksl_model_options_t o = options ? *options : ksl_model_options();
    return new ksl_model_t{
        builder->builder.build(ksl::c_api::options_of(o), {.strict = o.strict, .masses_optional = o.masses_optional})};
  });
}

ksl_status_t ksl_model_with_root(const ksl_model_t *model, int link, ksl_model_t **made) {
  return made_from(model, made, [&] { return ksl::with_root(model->model.description(), link_name(model, link)); });
}

ksl_status_t ksl_model_with_frozen_joints(const ksl_model_t *model, int n, const int *joints, const double *q,
                                          ksl_model_t **made) {
  return made_from(model, made, [&] {
    require(n >= 0 && ((joints && q) || n == 0), "joints and q must not be null, and their number not negative");
    // q: [ nq numbers of joints[0] | those of joints[1] | … ]
    std::vector<ksl::frozen_joint> frozen;
    for (int i = 0; i < n; ++i) {
      require_joint(model, joints[i]);
      const ksl::joint_row &joint = model->model.joints()[static_cast<std::size_t>(joints[i])];
      frozen.push_back({joint.name, {q, q + ksl::row_of(joint.kind).nq}});
      q += ksl::row_of(joint.kind).nq;
    }
    return ksl::with_frozen_joints(model->model.description(), frozen);
  });
}

ksl_status_t ksl_model_with_payload(const ksl_model_t *model, int link, const ksl_link_mass_t *payload,
                                    ksl_model_t **made) {
  return made_from(model, made, [&] {
    require(payload, "payload must not be null");
    return ksl::with_payload(model->model.description(), link_name(model, link), mass_of(*payload));
  });
}

ksl_status_t ksl_model_merged(const ksl_model_t *model, const ksl_model_t *other, int parent_link,
                              const ksl_SE3_t *pose, const char *prefix, ksl_model_t **made) {
  return made_from(model, made, [&] {
    require(other, "other must not be null");
    return ksl::merged(model->model.description(), other->model.description(), link_name(model, parent_link),
                       pose_of(pose), or_empty(prefix));
  });
}

ksl_status_t ksl_model_subtree(const ksl_model_t *model, int link, ksl_model_t **made) {
  return made_from(model, made, [&] { return ksl::subtree(model->model.description(), link_name(model, link)); });
}

ksl_status_t ksl_model_without_loops(const ksl_model_t *model, ksl_model_t **made) {
  return made_from(model, made, [&] { return ksl::without_loops(model->model.description()); });
}

ksl_status_t ksl_model_with_drives(const ksl_model_t *model, int n, const int *joints, ksl_model_t **made) {
  return ksl_model_with_weighted_drives(model, n, joints, nullptr, made);
}

// weights (n), null: all 1
ksl_status_t ksl_model_with_weighted_drives(const ksl_model_t *model, int n, const int *joints, const double *weights,
                                            ksl_model_t **made) {
  return made_from(model, made, [&] {
    require(n >= 0 && (joints || n == 0), "joints must not be null, and their number not negative");
    std::vector<std::string> names;
    for (int i = 0; i < n; ++i) {
      require_joint(model, joints[i]);
      names.push_back(model->model.joints()[static_cast<std::size_t>(joints[i])].name);
    }
    return ksl::with_drives(model->model.description(), names,
                            weights ? std::vector<double>(weights, weights + n) : std::vector<double>());
  });
}

ksl_status_t ksl_model_with_frame(const ksl_model_t *model, const char *name, int link, const ksl_SE3_t *pose,
                                  ksl_model_t **made) {
  return made_from(model, made, [&] {
    require(name, "name must not be null");
    return ksl::with_frame(model->model.description(), name, link_name(model, link), pose_of(pose));
  });
}

// Null turns all physics off.
ksl_status_t ksl_model_with_physics(const ksl_model_t *model, const ksl_physics_t *physics, ksl_model_t **made) {
  return made_from(model, made, [&] {
    ksl::model_options options;
    options.physics = ksl::c_api::physics_of(physics ? *physics : ksl_physics_t{});
    return ksl::model(model->model.description(), options);
  });
}

ksl_status_t ksl_model_with_parameters(const ksl_model_t *model, int n, const int *links, const double *parameters,
                                       ksl_model_t **made) {
  return made_from(model, made, [&] {
    ksl::c_api::require_links(model, n, links);
    require(parameters || n == 0, "parameters must not be null");
    std::vector<ksl::link_inertia> inertias;
    for (int i = 0; i < n; ++i)
      inertias.push_back({links[i], ksl::inertia_of_parameters(parameters + 10 * i)});
    return model->model.with_inertias(inertias);
  });
}

ksl_status_t ksl_model_with_gravity(const ksl_model_t *model, const double *gravity, ksl_model_t **made) {
  return made_from(model, made, [&] {
    require(gravity, "gravity must not be null");
    return model->model.with_gravity({gravity[0], gravity[1], gravity[2]});
  });
}

ksl_status_t ksl_model_write_urdf(const ksl_model_t *model, const char *path) {
  return guarded([&] {
    require(model && path, "model and path must not be null");
    ksl::write_urdf(model->model.description(), path);
  });
}

double ksl_model_mass(const ksl_model_t *m) { return m ? m->model.mass() : 0; }

double ksl_model_subtree_mass(const ksl_model_t *m, int joint) {
  return joint >= 0 && joint < ksl_model_joints(m) ? m->model.subtree_mass(joint) : 0;
}

int ksl_model_joint_above(const ksl_model_t *m, int link) {
  return link < 0 || link >= ksl_model_links(m) ? -1 : m->model.joint_above(link);
}

int ksl_model_parent_link(const ksl_model_t *m, int link) {
  const int above = ksl_model_joint_above(m, link);
  return above < 0 ? -1 : m->model.joints()[static_cast<std::size_t>(above)].parent_link;
}

ksl_status_t ksl_model_joint_info(const ksl_model_t *m, int joint, ksl_joint_info_t *info) {
  return guarded([&] {
    require(m && info, "model and info must not be null");
    require_joint(m, joint);
    const ksl::joint_row &row = m->model.joints()[static_cast<std::size_t>(joint)];
    const ksl::joint_kind_row kind = ksl::row_of(row.kind);
    // followers and fixed joints have no numbers in q and v; limits that a joint hasn't are infinite
    const bool moves = row.q_index >= 0;
    *info = {kind.name,
             row.parent_link,
             row.link,
             row.q_index,
             row.v_index,
             moves ? kind.nq : 0,
             moves ? kind.nv : 0,
             kind.quaternion,
             {row.axis.x, row.axis.y, row.axis.z},
             {row.axis2.x, row.axis2.y, row.axis2.z},
             row.pitch,
             {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL},
             {HUGE_VAL, HUGE_VAL, HUGE_VAL},
             HUGE_VAL,
             HUGE_VAL};
    if (!kind.has_axis2)
      info->axis2[0] = info->axis2[1] = info->axis2[2] = 0;
    if (row.description < 0)
      return;
    const ksl::joint_description &given = m->model.description().joints[static_cast<std::size_t>(row.description)];
    for (int c = 0; c < 3; ++c) {
      const auto [lower, upper] = ksl::limits_of(given, c);
      info->lower[c] = lower.value_or(-HUGE_VAL), info->upper[c] = upper.value_or(HUGE_VAL);
    }
    info->effort = given.effort.value_or(HUGE_VAL), info->velocity = given.velocity.value_or(HUGE_VAL);
  });
}

ksl_status_t ksl_model_link_parameters(const ksl_model_t *m, int link, double *parameters) {
  return guarded([&] {
    require(m && parameters, "model and parameters must not be null");
    ksl::c_api::require_links(m, 1, &link, "link");
    const ksl::spatial_inertia<double> &I = m->model.links()[static_cast<std::size_t>(link)].inertia;
    const double ten[] = {I.m, I.h.x, I.h.y, I.h.z, I.Ixx, I.Ixy, I.Iyy, I.Izx, I.Iyz, I.Izz};
    std::copy(ten, ten + 10, parameters);
  });
}

int ksl_model_support(const ksl_model_t *m, int link, int *joints) {
  return link < 0 || link >= ksl_model_links(m) ? -1 : m->model.support(link, joints);
}
int ksl_model_subtree_links(const ksl_model_t *m, int joint, int *links) {
  return joint < 0 || joint >= ksl_model_joints(m) ? -1 : m->model.subtree_links(joint, links);
}

} // extern "C"
