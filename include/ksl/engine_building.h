/* KSL: models that a program describes, and models made from other models, in C.  Included by ksl/engine.h.

   Every call copies what it is given.  Models that are made are freed with ksl_model_free.  A joint or link that
   doesn't exist, a pose that is not rigid, … is KSL_BAD_ARGUMENT or KSL_BAD_DESCRIPTION; ksl_error_message() names it
   and how to mend it. */
#ifndef KSL_ENGINE_BUILDING_H
#define KSL_ENGINE_BUILDING_H

#include "ksl/engine_types.h"

KSL_BEGIN_C

/** A builder, which collects links and joints. */
typedef struct ksl_builder_t ksl_builder_t;

/** Mass, kg; centre of mass in the link's axes, m; inertia about the centre of mass in the link's axes, kg m². */
typedef struct ksl_link_mass_t {
  double mass;
  double center_of_mass[3];
  double inertia[3][3];
} ksl_link_mass_t;

/** What a joint may have besides kind, links and pose.  Initialise it with ksl_joint_options(); NAN and NULL mean that
 * something is not given. */
typedef struct ksl_joint_options_t {
  const double *axis, *axis2; /**< (3), of any length, in the joint's frame; kinds that have them need them */
  double pitch;               /**< m/rad, positive for a right-handed screw; helical joints need it */
  double lower, upper;        /**< rad or m; of the first number of its position */
  double effort, velocity;    /**< N m or N; rad/s or m/s */
  double damping, friction;   /**< of each coordinate, N m s/rad or N s/m, and N m or N */
  const char *mimics; /**< a joint that it follows: its position is multiplier × that joint's + offset; NULL: none */
  double multiplier, offset;
  double friction_width;            /**< of the smooth law of friction, rad/s or m/s */
  double armature;                  /**< inertia that each coordinate feels besides that of the links, kg m² or kg */
  double rotor_inertia, gear_ratio; /**< of the motor's rotor, kg m²; its turns for each of the joint */
  double spring_stiffness, spring_rest; /**< N m/rad or N/m; rad or m; of joints with one coordinate */
  /** of the second and third number: cylindrical, universal, planar, translation */
  double further_lower[2], further_upper[2];
} ksl_joint_options_t;

/** What a joint that closes a loop may have besides kind, links and frames.  Initialise it with ksl_loop_options(); NAN and NULL mean
 * that something is not given. */
typedef struct ksl_loop_options_t {
  const double *axis, *axis2; /**< (3), of any length, with the same components in the frames on both links */
  double pitch;               /**< m/rad, positive for a right-handed screw; helical joints need it */
} ksl_loop_options_t;

/** A row of a table of Denavit–Hartenberg parameters, m and rad.  theta is added to q of a joint that turns, d to q of
 * one that slides. */
typedef struct ksl_dh_row_t {
  double a, alpha, d, theta;
  const char *kind;     /**< revolute, continuous or prismatic; NULL: revolute */
  ksl_link_mass_t mass; /**< in the axes of the row's frame */
} ksl_dh_row_t;

/** Frame i is at the end of link i, Rz(theta) Tz(d) Tx(a) Rx(alpha), or at its start, Rx(alpha) Tx(a) Rz(theta) Tz(d).
 */
typedef enum ksl_dh_convention_t KSL_INT_ENUM { KSL_DH_STANDARD, KSL_DH_MODIFIED } ksl_dh_convention_t;

/** Options of a joint that give nothing: no axis, no limits, no damping, friction or rotor. */
KSL_EXPORT ksl_joint_options_t ksl_joint_options(void);

/** Options of a joint that closes a loop, which give nothing. */
KSL_EXPORT ksl_loop_options_t ksl_loop_options(void);

/** Makes a builder for an empty robot.  Free it with ksl_builder_free. */
KSL_EXPORT ksl_status_t ksl_builder_create(const char *name, ksl_builder_t **builder);
KSL_EXPORT void ksl_builder_free(ksl_builder_t *builder);

/** Adds a link; mass may be NULL for a massless one.  The link that no joint carries is the root. */
KSL_EXPORT ksl_status_t ksl_builder_add_link(ksl_builder_t *builder, const char *name, const ksl_link_mass_t *mass);

/** Adds a joint between two links that have been added.  kind: fixed, revolute, continuous, prismatic, helical, cylindrical,
    universal, spherical, planar, translation, floating; pose: of the joint in the parent link, NULL for the identity;
   options may be NULL. */
KSL_EXPORT ksl_status_t ksl_builder_add_joint(ksl_builder_t *builder, const char *name, const char *kind,
                                              const char *parent, const char *child, const ksl_SE3_t *pose,
                                              const ksl_joint_options_t *options);

/** Adds a joint that closes a loop, between two links that have been added and that joints connect already.  kind: as in
    ksl_builder_add_joint, but not floating; predecessor_pose, successor_pose: of the joint's frame on either side, in that link's frame,
    NULL for the identity; the two coincide where the joint's position is zero.  options may be NULL for kinds without an axis. */
KSL_EXPORT ksl_status_t ksl_builder_add_loop(ksl_builder_t *builder, const char *name, const char *kind,
                                             const char *predecessor, const char *successor,
                                             const ksl_SE3_t *predecessor_pose, const ksl_SE3_t *successor_pose,
                                             const ksl_loop_options_t *options);

/** The numbers of a force element between two points at a distance l.  It pulls them together, or with a negative force apart, with
    preload + stiffness (l - free_length) + damping dl/dt, and beyond its limits with stop_stiffness (l - limit) more; N/m, m, N s/m, N.
    Initialise it with ksl_force_element_numbers(). */
typedef struct ksl_force_element_numbers_t {
  double stiffness, free_length, damping, preload;
  double lower, upper;   /**< limits of l, m; NAN: none */
  double stop_stiffness; /**< N/m of stops at the limits; 0: a length beyond them is refused */
} ksl_force_element_numbers_t;

/** Numbers of a force element that exerts no force and has no limits. */
KSL_EXPORT ksl_force_element_numbers_t ksl_force_element_numbers(void);

/** Adds a spring, damper or cylinder between two points (3), each in the frame of a link that has been added.  It has no effect unless
    physics.force_elements of the options is set. */
KSL_EXPORT ksl_status_t ksl_builder_add_force_element(ksl_builder_t *builder, const char *name, const char *link1,
                                                      const double *point1, const char *link2, const double *point2,
                                                      const ksl_force_element_numbers_t *numbers);

/** The n joints that have a motor.  Inverse dynamics of mechanisms with loops need to know them. */
KSL_EXPORT ksl_status_t ksl_builder_set_drives(ksl_builder_t *builder, int n, const char *const *joints);

/** Adds joint1, link1, joint2, link2, … to a link, names after prefix (NULL: none).  The frame of link i is that of row i.
 */
KSL_EXPORT ksl_status_t ksl_builder_add_dh_chain(ksl_builder_t *builder, const char *parent, int n,
                                                 const ksl_dh_row_t *rows, ksl_dh_convention_t convention,
                                                 const char *prefix);

/** The model of what has been added; options may be NULL. */
KSL_EXPORT ksl_status_t ksl_builder_build(const ksl_builder_t *builder, const ksl_model_options_t *options,
                                          ksl_model_t **model);

/** The same robot with another root.  Joints between the two are reversed, and keep the meaning of their q and v. */
KSL_EXPORT ksl_status_t ksl_model_with_root(const ksl_model_t *model, int link, ksl_model_t **made);

/** The same robot with n joints fixed at the positions in q, which has the numbers of these joints one after the other. */
KSL_EXPORT ksl_status_t ksl_model_with_frozen_joints(const ksl_model_t *model, int n, const int *joints,
                                                     const double *q, ksl_model_t **made);

/** The same robot with a rigid body welded to a link. */
KSL_EXPORT ksl_status_t ksl_model_with_payload(const ksl_model_t *model, int link, const ksl_link_mass_t *payload,
                                               ksl_model_t **made);

/** The same robot with the root of another one welded to a link at a pose (NULL: identity); the names of the other get the prefix
    (NULL: none). */
KSL_EXPORT ksl_status_t ksl_model_merged(const ksl_model_t *model, const ksl_model_t *other, int parent_link,
                                         const ksl_SE3_t *pose, const char *prefix, ksl_model_t **made);

/** The robot of a link, which is the root, and all that it carries.  A loop that would lose a link is refused. */
KSL_EXPORT ksl_status_t ksl_model_subtree(const ksl_model_t *model, int link, ksl_model_t **made);

/** The same robot with its loops cut: a tree, whose joints all have a motor. */
KSL_EXPORT ksl_status_t ksl_model_without_loops(const ksl_model_t *model, ksl_model_t **made);

/** The same robot, which has loops, with motors at these n joints and at no others. */
KSL_EXPORT ksl_status_t ksl_model_with_drives(const ksl_model_t *model, int n, const int *joints, ksl_model_t **made);

/** The same robot with motors at these n joints, and a weight for each: where drives are more than freedoms, efforts are those with the least sum of weight x effort^2.  weights may
    be NULL: all 1. */
KSL_EXPORT ksl_status_t ksl_model_with_weighted_drives(const ksl_model_t *model, int n, const int *joints,
                                                       const double *weights, ksl_model_t **made);

/** The same robot with another frame, which is a massless link, at a pose in a link's frame (NULL: identity). */
KSL_EXPORT ksl_status_t ksl_model_with_frame(const ksl_model_t *model, const char *name, int link,
                                             const ksl_SE3_t *pose, ksl_model_t **made);

/** The same robot with this physics of joints, instead of its own; NULL: none. */
KSL_EXPORT ksl_status_t ksl_model_with_physics(const ksl_model_t *model, const ksl_physics_t *physics,
                                               ksl_model_t **made);

/** The same robot with other inertias for n links: parameters (n, 10), m, m c, Ixx, Ixy, Iyy, Ixz, Iyz, Izz about the link's origin, in its
   axes. The structure is copied, not built again. */
KSL_EXPORT ksl_status_t ksl_model_with_parameters(const ksl_model_t *model, int n, const int *links,
                                                  const double *parameters, ksl_model_t **made);

/** The same robot under another gravity (3), m/s² in world axes. The structure is copied, not built again. */
KSL_EXPORT ksl_status_t ksl_model_with_gravity(const ksl_model_t *model, const double *gravity, ksl_model_t **made);

/** The robot as a URDF file, which appears complete or not at all.  It is written beside its place first, under a name
    that no other file has; other files stay as they are, whatever other threads and processes write. */
KSL_EXPORT ksl_status_t ksl_model_write_urdf(const ksl_model_t *model, const char *path);

/** Mass of all links, payloads included, and of those that a joint carries, directly or not; kg. */
KSL_EXPORT double ksl_model_mass(const ksl_model_t *model);
KSL_EXPORT double ksl_model_subtree_mass(const ksl_model_t *model, int joint);

/** The joint that carries a link, and the link on its other side, −1 for the ground.  −1 for a link that is out of
 * range. */
KSL_EXPORT int ksl_model_joint_above(const ksl_model_t *model, int link);
KSL_EXPORT int ksl_model_parent_link(const ksl_model_t *model, int link);

/** A joint.  SI units. */
typedef struct ksl_joint_info_t {
  const char *kind;      /**< as in ksl_builder_add_joint */
  int parent_link, link; /**< parent_link is −1 for the ground; link is the child */
  int q_index, v_index;  /**< where its numbers begin in q and in v; −1 for fixed joints and followers */
  int nq, nv;            /**< how many numbers it has in q and v; 0 for fixed joints and followers */
  int quaternion;        /**< where, within them, a unit quaternion [qx qy qz qw] begins; −1: it has none */
  /** unit vectors in the joint's frame; zero for kinds without one; axis2 of universal joints */
  double axis[3], axis2[3];
  double pitch;              /**< m/rad, of helical joints */
  double lower[3], upper[3]; /**< limits of the numbers of its position, rad or m; infinite where there are none */
  double effort, velocity;   /**< limits, N m or N, rad/s or m/s; infinite where there are none */
} ksl_joint_info_t;
KSL_EXPORT ksl_status_t ksl_model_joint_info(const ksl_model_t *model, int joint, ksl_joint_info_t *info);

/** The ten inertial parameters of a link, payloads included, in the layout of ksl_model_with_parameters, which is also that of
    regressors. */
KSL_EXPORT ksl_status_t ksl_model_link_parameters(const ksl_model_t *model, int link, double *parameters);

/** The joints between the root and a link, the root's first, into joints; and the links that a joint carries, directly or not,
    parents first, into links.  Each returns how many they are, −1 where the index is out of range; the array may be NULL, or else
    has room for as many as the model has. */
KSL_EXPORT int ksl_model_support(const ksl_model_t *model, int link, int *joints);
KSL_EXPORT int ksl_model_subtree_links(const ksl_model_t *model, int joint, int *links);

KSL_END_C

#endif
