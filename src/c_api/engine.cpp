// The C interface of models, and the calls that are not generated from api/algorithms/.
//
// Strings that are returned belong to the model, and live as long as it; messages belong to the thread.  What a caller gives is copied or read within
// the call.
//
// ksl_reactions reads the wrenches of bodies that ksl_inverse_dynamics has left in the workspace.  holds_wrenches says whether they are there, by the
// size of their numbers:
//
//     ksl_inverse_dynamics(_with_reactions)     8      any other call that writes to the workspace     0, before it computes
//     the same in single precision              4      ksl_reactions(f)                                needs 8 (4), and leaves it
#include "c_api/calls.hpp"
#include "engine/building/inertias.hpp"

#include "ksl/builder.hpp"
#include "ksl/section.hpp"

#include "load/robot_file.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace {

using ksl::c_api::created;
using ksl::c_api::guarded;
using ksl::c_api::require;
using ksl::c_api::require_finite;

/// Line i, or null.
const char *line(const std::vector<std::string> &lines, int i) {
  return i >= 0 && static_cast<std::size_t>(i) < lines.size() ? lines[static_cast<std::size_t>(i)].c_str() : nullptr;
}

template <class S>
ksl_status_t reactions_of_last_state(const ksl_model_t *m, ksl_data_t *d, int n, const int *joints,
                                     const ksl_reaction_options_t *options,
                                     const typename ksl::c_api::c_types<S>::external *external, S *wrenches) {
  return guarded([&] {
    ksl::c_api::require_workspace(m, d);
    require(wrenches || n == 0, "wrenches must not be null");
    require(
        d->holds_wrenches == sizeof(S),
        "ksl_reactions reads what ksl_inverse_dynamics left in the workspace; call that first, in the same precision");
    ksl::reactions<S>(m->model, d->data, ksl::c_api::request_of(m, d->links.data(), {n, joints, options}), wrenches,
                      ksl::c_api::external_of<S>(m, external));
    ksl::examine_numbers("reactions", "wrenches", wrenches, 6 * std::ptrdiff_t(n));
  });
}

template <class S> ksl_status_t neutral(const ksl_model_t *m, S *q) {
  return guarded([&] {
    require(m && (q || m->model.nq() == 0), "model and q must not be null");
    ksl::neutral(m->model, q);
  });
}

template <class S> ksl_status_t random_position(const ksl_model_t *m, const S *uniform, S *q) {
  return guarded([&] {
    require(m && (q || m->model.nq() == 0), "model and q must not be null");
    require_finite(uniform, m->model.nq(), "uniform");
    for (int i = 0; i < m->model.nq(); ++i)
      require(uniform[i] >= 0 && uniform[i] < 1, "uniform needs numbers from 0 to below 1");
    ksl::random_position(m->model, uniform, q);
    ksl::examine_numbers("random_position", "q", q, m->model.nq());
  });
}

/// The index of a name; if it is −1, the message says which names are near.
/// Not a status, but an index: C asks once for each name, and a message is there if −1 comes.
template <class Items> int found(const char *what, const ksl_model_t *m, const char *name, Items items) {
  int index = -1;
  guarded([&] {
    require(m && name, "model and name must not be null");
    for (const auto &item : items(m->model)) {
      ++index;
      if (item.name == name)
        return;
    }
    index = -1;
    std::vector<std::string> names;
    for (const auto &item : items(m->model))
      names.push_back(item.name);
    throw ksl::c_api::bad_argument(ksl::unknown_name(what, name, names));
  });
  return index;
}

/// The section that a call names, checked.
/// Joints in `beyond` are numbered as in requests for reactions: those of the tree, and then those that close loops.  Each has to have one end on the
/// link that is cut.
ksl::link_section section_of(const ksl_model_t *m, const ksl_section_t *given) {
  require(given, "section must not be null");
  ksl::c_api::require_links(m, 1, &given->link, "link");
  require_finite(given->point, 3, "point");
  require_finite(given->normal, 3, "normal");
  require(given->normal[0] != 0 || given->normal[1] != 0 || given->normal[2] != 0,
          "normal is zero; it needs a direction");
  require(given->share >= KSL_BY_CENTER && given->share <= KSL_INERTIA, "share must be a value of its enumeration");
  require(given->share != KSL_FRACTION || (given->fraction >= 0 && given->fraction <= 1),
          "fraction must be between 0 and 1");
  require_finite(given->inertia, given->share == KSL_INERTIA ? 10 : 0, "inertia");
  require(given->beyond_n <= 0 || given->beyond, "beyond must not be null");
  for (int k = 0; k < given->beyond_n; ++k) {
    const int j = given->beyond[k], joints = ksl_model_joints(m), loops = static_cast<int>(m->model.loops().size());
    ksl::c_api::require_index(j, joints + loops, "beyond names a joint out of range", "beyond", k);
    const auto require_end = [&](int one, int other, const std::string &name) {
      if (one != given->link && other != given->link)
        throw ksl::c_api::bad_argument("beyond names " + name + ", which neither carries " +
                                       ksl_model_link_name(m, given->link) + " nor is carried by it");
    };
    if (j < joints) {
      const ksl::joint_row &joint = m->model.joints()[static_cast<std::size_t>(j)];
      require_end(joint.link, joint.parent_link, joint.name);
    } else {
      const ksl::loop_row &loop = m->model.loops()[static_cast<std::size_t>(j - joints)];
      require_end(loop.predecessor, loop.successor, loop.name);
    }
  }
  const ksl_frame_options_t how = {given->axes, KSL_IN_FRAME, given->order, KSL_SPATIAL, {0, 0, 0}};
  ksl::c_api::frame_options_of(&how);
  ksl::link_section section;
  section.link = given->link;
  for (int i = 0; i < 3; ++i)
    section.point[i] = given->point[i], section.normal[i] = given->normal[i];
  section.share = static_cast<ksl::section_share>(given->share), section.fraction = given->fraction;
  section.inertia = ksl::inertia_of_parameters(given->inertia);
  section.beyond_n = given->beyond_n, section.beyond = given->beyond;
  section.axes = static_cast<ksl::expressed_in>(given->axes);
  section.order = static_cast<ksl::component_order>(given->order);
  return section;
}

template <class S>
ksl_status_t section_wrench(const ksl_model_t *m, ksl_data_t *d, const S *q, const S *v, const S *a,
                            const typename ksl::c_api::c_types<S>::external *external, const ksl_section_t *given,
                            S *wrench) {
  return guarded([&] {
    ksl::c_api::require_workspace(m, d);
    require(wrench, "wrench must not be null");
    const ksl::link_section section = section_of(m, given);
    ksl::c_api::require_position(m->model, q, "q");
    require_finite(v, m->model.nv(), "v");
    require_finite(a, m->model.nv(), "a");
    d->holds_wrenches = 0;
    ksl::section_wrench<S>(m->model, d->data, q, v, a, section, wrench, ksl::c_api::external_of<S>(m, external));
    ksl::examine_numbers("section_wrench", "wrench", wrench, 6);
  });
}

std::vector<ksl::payload> payloads_of(const ksl_model_options_t &options) {
  require(options.payloads_n >= 0 && (options.payloads || options.payloads_n == 0),
          "payloads_n must say how many payloads there are");
  std::vector<ksl::payload> payloads;
  for (int i = 0; i < options.payloads_n; ++i) {
    const ksl_payload_t &p = options.payloads[i];
    require(p.link, "a payload names no link");
    require_finite(&p.mass, 1, "payload mass");
    require(p.mass >= 0, "the mass of a payload is negative");
    require_finite(p.point, 3, "payload point");
    payloads.push_back({p.link, p.mass, {p.point[0], p.point[1], p.point[2]}});
  }
  return payloads;
}

/// The model of a file's contents; `name` stands for the file in messages.
ksl_model_t *read_model(const std::string &text, const std::string &name, const ksl_model_options_t *options) {
  const ksl_model_options_t o = options ? *options : ksl_model_options();
  // what files say themselves goes to the reader, the rest to the model: payloads, physics, and gravity unless the file's is asked for
  ksl::model_options others = ksl::c_api::options_of(o);
  ksl::robot_description robot =
      ksl::read_robot_text(text, name,
                           {.floating_base = std::exchange(others.floating_base, false), // the description says it
                            .mimic_independent = o.mimic_independent,
                            .strict = o.strict,
                            .model = o.model_name ? o.model_name : ""});
  // a file that says nothing has the usual gravity, and then that of the options holds
  if (o.file_gravity && robot.gravity != ksl::robot_description().gravity)
    others.gravity.reset(); // that of the description
  return new ksl_model_t{
      ksl::model_of(std::move(robot), others, {.strict = o.strict, .masses_optional = o.masses_optional})};
}

} // namespace

ksl::physics_options ksl::c_api::physics_of(const ksl_physics_t &from) {
  require(from.friction_width >= 0 && from.friction_width < HUGE_VAL,
          "friction_width must be a speed, or 0 for the default");
  physics_options physics;
  physics.damping = from.damping, physics.armature = from.armature, physics.spring = from.spring;
  physics.friction = from.friction || from.exact_friction, physics.exact_friction = from.exact_friction;
  physics.force_elements = from.force_elements;
  physics.rotor = from.rotor || from.rotor_bodies, physics.rotor_bodies = from.rotor_bodies;
  if (from.friction_width > 0)
    physics.friction_width = from.friction_width;
  return physics;
}

ksl::model_options ksl::c_api::options_of(const ksl_model_options_t &options) {
  require_finite(options.gravity, 3, "gravity");
  model_options made;
  made.floating_base = options.floating_base;
  made.gravity = {options.gravity[0], options.gravity[1], options.gravity[2]};
  made.payloads = payloads_of(options);
  made.physics = physics_of(options.physics);
  return made;
}

extern "C" {

const char *ksl_error_message(void) { return ksl::c_api::last_message(); }
const char *ksl_warning_message(void) { return ksl::c_api::last_warning()[0] ? ksl::c_api::last_warning() : nullptr; }

const char *ksl_instruction_set(void) {
  const char *name = nullptr;
  guarded([&] { name = ksl::instruction_set(); });
  return name;
}

ksl_model_options_t ksl_model_options(void) {
  ksl_model_options_t options = {};
  options.gravity[2] = -9.81;
  options.file_gravity = true;
  return options;
}

ksl_status_t ksl_model_load(const char *path, const ksl_model_options_t *options, ksl_model_t **model) {
  return created(model, path, "path and model must not be null",
                 [&] { return read_model(ksl::bytes_of_robot_file(path), path, options); });
}

ksl_status_t ksl_model_load_memory(const char *text, size_t length, const ksl_model_options_t *options,
                                   ksl_model_t **model) {
  return created(model, text, "text and model must not be null",
                 [&] { return read_model(ksl::bytes_of_robot_text(text, length, "<string>"), "<string>", options); });
}

void ksl_model_free(ksl_model_t *model) { delete model; }

// links: room for a request that names each joint once
ksl_status_t ksl_data_create(const ksl_model_t *model, ksl_data_t **data) {
  return created(data, model, "model and data must not be null", [&] {
    return new ksl_data_t{model, ksl::data(model->model), 0,
                          std::vector<int>(model->model.joints().size() + model->model.loops().size())};
  });
}

void ksl_data_free(ksl_data_t *data) { delete data; }

int ksl_model_nq(const ksl_model_t *m) { return m ? m->model.nq() : 0; }
int ksl_model_nv(const ksl_model_t *m) { return m ? m->model.nv() : 0; }
int ksl_model_moving_joints(const ksl_model_t *m) { return m ? m->model.moving_joints() : 0; }
int ksl_model_joints(const ksl_model_t *m) { return m ? static_cast<int>(m->model.joints().size()) : 0; }
int ksl_model_links(const ksl_model_t *m) { return m ? static_cast<int>(m->model.links().size()) : 0; }

const char *ksl_model_joint_name(const ksl_model_t *m, int joint) {
  return joint < 0 || joint >= ksl_model_joints(m) ? nullptr
                                                   : m->model.joints()[static_cast<std::size_t>(joint)].name.c_str();
}

int ksl_model_leader(const ksl_model_t *m, int joint, double *multiplier, double *offset) {
  const bool known = joint >= 0 && joint < ksl_model_joints(m);
  const ksl::joint_row none{}, &row = known ? m->model.joints()[static_cast<std::size_t>(joint)] : none;
  if (multiplier)
    *multiplier = row.multiplier;
  if (offset)
    *offset = row.offset;
  return row.leader;
}

const char *ksl_model_link_name(const ksl_model_t *m, int link) {
  return link < 0 || link >= ksl_model_links(m) ? nullptr
                                                : m->model.links()[static_cast<std::size_t>(link)].name.c_str();
}

ksl_physics_t ksl_model_physics(const ksl_model_t *m) {
  if (!m)
    return {};
  const ksl::physics_options &p = m->model.description().physics;
  return {p.damping,      p.friction,       p.armature,       p.rotor,         p.spring,
          p.rotor_bodies, p.exact_friction, p.force_elements, p.friction_width};
}

int ksl_model_joint(const ksl_model_t *m, const char *name) {
  return found("joint", m, name, [](const ksl::model &of) -> auto & { return of.joints(); });
}
int ksl_model_link(const ksl_model_t *m, const char *name) {
  return found("link", m, name, [](const ksl::model &of) -> auto & { return of.links(); });
}

const char *ksl_model_warning(const ksl_model_t *m, int i) {
  return m ? line(m->model.description().warnings, i) : nullptr;
}
const char *ksl_model_unused(const ksl_model_t *m, int i) {
  return m ? line(m->model.description().unused, i) : nullptr;
}

ksl_status_t ksl_reactions(const ksl_model_t *m, ksl_data_t *d, int n, const int *joints,
                           const ksl_reaction_options_t *options, const ksl_external_t *external, double *wrenches) {
  return reactions_of_last_state(m, d, n, joints, options, external, wrenches);
}
ksl_status_t ksl_reactionsf(const ksl_model_t *m, ksl_data_t *d, int n, const int *joints,
                            const ksl_reaction_options_t *options, const ksl_externalf_t *external, float *wrenches) {
  return reactions_of_last_state(m, d, n, joints, options, external, wrenches);
}

ksl_section_t ksl_section(int link) {
  return {link, {0, 0, 0}, {0, 0, 1}, KSL_BY_CENTER, 0, {}, -1, nullptr, KSL_IN_FRAME, KSL_LINEAR_FIRST};
}
ksl_status_t ksl_section_wrench(const ksl_model_t *m, ksl_data_t *d, const double *q, const double *v, const double *a,
                                const ksl_external_t *external, const ksl_section_t *section, double *wrench) {
  return section_wrench(m, d, q, v, a, external, section, wrench);
}
ksl_status_t ksl_section_wrenchf(const ksl_model_t *m, ksl_data_t *d, const float *q, const float *v, const float *a,
                                 const ksl_externalf_t *external, const ksl_section_t *section, float *wrench) {
  return section_wrench(m, d, q, v, a, external, section, wrench);
}

int ksl_model_tree_elements(const ksl_model_t *m) { return m ? m->model.tree_elements() : 0; }
// Where rows of the tree-sparse mass matrix begin, and the column of each element; robots with mimic joints have M = Gᵀ M̂ G, which is no such
// matrix.
ksl_status_t ksl_model_tree(const ksl_model_t *m, int *rows, int *columns) {
  return guarded([&] {
    require(m, "model must not be null");
    require(m->model.followers() == 0,
            "a robot with mimic joints has a mass matrix with other zeros than those of its tree; load it with "
            "mimic_independent, which gives each joint a coordinate of its own");
    if (rows)
      std::copy(m->model.tree_rows().begin(), m->model.tree_rows().end(), rows);
    if (columns)
      m->model.tree_columns(columns);
  });
}

ksl_status_t ksl_neutral(const ksl_model_t *m, double *q) { return neutral(m, q); }
ksl_status_t ksl_neutralf(const ksl_model_t *m, float *q) { return neutral(m, q); }
ksl_status_t ksl_random_position(const ksl_model_t *m, const double *uniform, double *q) {
  return random_position(m, uniform, q);
}
ksl_status_t ksl_random_positionf(const ksl_model_t *m, const float *uniform, float *q) {
  return random_position(m, uniform, q);
}

ksl_status_t ksl_frame_pose(const ksl_model_t *m, ksl_data_t *d, const double *q, int link, ksl_SE3_t *pose) {
  return guarded([&] {
    ksl::c_api::require_workspace(m, d);
    require(pose, "pose must not be null");
    ksl::c_api::require_links(m, 1, &link, "link");
    ksl::c_api::require_position(m->model, q, "q");
    d->holds_wrenches = 0;
    const ksl::SE3<double> found = ksl::frame_pose(m->model, d->data, q, link);
    *pose = ksl::same_layout<ksl_SE3_t>(found);
    ksl::examine_numbers("frame_pose", "position", &found.t.x, 3);
  });
}

} // extern "C"
