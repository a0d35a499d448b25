/* KSL: models and dynamics from C.  Link with libksl.

   Handles are opaque.  A model is immutable and may be shared between threads; a workspace (ksl_data_t) belongs to one
   thread and one model.  Only the calls that create something allocate memory.  Calls that can fail return a status;
   ksl_error_message() then describes the error in one sentence.  SI units, radians; six-vectors are linear first unless a
   request says otherwise.  Joints and links are identified by index: see ksl_model_joint and ksl_model_link. */
#ifndef KSL_ENGINE_H
#define KSL_ENGINE_H

#include "ksl/engine_types.h"

KSL_BEGIN_C

/** The error message of this thread's last call that did not return KSL_OK: one sentence, valid until the next such call. */
KSL_EXPORT const char *ksl_error_message(void);

/** The warning of this thread's last call that took positions of one state, in one sentence, or NULL.  It names a quaternion that
    differs from unit length by more than 1e-6 and was used as normalised.  (One that differs by more than 1e-2 is an error.) */
KSL_EXPORT const char *ksl_warning_message(void);

/** Name of the instruction set in use, for example x86-64-v3; NULL if KSL_ISA names one that is unknown or doesn't run here. */
KSL_EXPORT const char *ksl_instruction_set(void);

/** The default options: fixed base, mimic joints coupled, not strict, masses needed, no payload, no physics of joints, and gravity
    (0, 0, −9.81) unless the file gives another. */
KSL_EXPORT ksl_model_options_t ksl_model_options(void);

/** Reads a URDF or an SDF file; its root element says which.  options may be NULL.  Free the model with ksl_model_free. */
KSL_EXPORT ksl_status_t ksl_model_load(const char *path, const ksl_model_options_t *options, ksl_model_t **model);

/** Reads the contents of such a file from memory, `length` bytes.  Messages call it <string>. */
KSL_EXPORT ksl_status_t ksl_model_load_memory(const char *text, size_t length, const ksl_model_options_t *options,
                                              ksl_model_t **model);

KSL_EXPORT void ksl_model_free(ksl_model_t *model);

/** Workspace for one thread.  Free it with ksl_data_free, before the model. */
KSL_EXPORT ksl_status_t ksl_data_create(const ksl_model_t *model, ksl_data_t **data);
KSL_EXPORT void ksl_data_free(ksl_data_t *data);

/** Sizes: length of q and of v; number of moving joints that have numbers in q, of all joints (followers, fixed ones and `base`
    included), and of links. */
KSL_EXPORT int ksl_model_nq(const ksl_model_t *model);
KSL_EXPORT int ksl_model_nv(const ksl_model_t *model);
KSL_EXPORT int ksl_model_moving_joints(const ksl_model_t *model);
KSL_EXPORT int ksl_model_joints(const ksl_model_t *model);
KSL_EXPORT int ksl_model_links(const ksl_model_t *model);

/** Name by index, NULL out of range.  Joints: the moving ones in the order of q, then the followers of mimic joints, which have
    no numbers in q and v of their own, then the fixed ones, `base` last. */
KSL_EXPORT const char *ksl_model_joint_name(const ksl_model_t *model, int joint);
KSL_EXPORT const char *ksl_model_link_name(const ksl_model_t *model, int link);

/** The joint that a mimic joint follows, −1 if it follows none, and how: position = multiplier × that of its leader + offset.
    multiplier and offset may be NULL. */
KSL_EXPORT int ksl_model_leader(const ksl_model_t *model, int joint, double *multiplier, double *offset);

/** Line i of the warnings about a file (for example an inertia that no body can have, to a relative 1e-6), and of the list of
    contents that KSL doesn't use; NULL after the last. */
KSL_EXPORT const char *ksl_model_warning(const ksl_model_t *model, int i);
KSL_EXPORT const char *ksl_model_unused(const ksl_model_t *model, int i);

/** The physics of joints that a model has. */
KSL_EXPORT ksl_physics_t ksl_model_physics(const ksl_model_t *model);

/** The elements of the lower triangle of the mass matrix that the shape of the tree lets differ from zero: the layout of
    ksl_mass_matrix_tree and ksl_mass_matrix_factor, as compressed sparse rows.  ksl_model_tree_elements returns how many they are.
    ksl_model_tree writes where the rows begin, and where the last one ends, into rows (nv + 1), and the columns of the elements into
    columns (elements).  Either may be NULL.  It is refused for robots with mimic joints, whose mass matrix has other zeros. */
KSL_EXPORT int ksl_model_tree_elements(const ksl_model_t *model);
KSL_EXPORT ksl_status_t ksl_model_tree(const ksl_model_t *model, int *rows, int *columns);

/** Index by name; −1 if there is no such name, or if model or name is NULL.  ksl_error_message() then says which names are near. */
KSL_EXPORT int ksl_model_joint(const ksl_model_t *model, const char *name);
KSL_EXPORT int ksl_model_link(const ksl_model_t *model, const char *name);

/** The neutral position into q (nq): zeros, and quaternions of no rotation.  Limits of joints may exclude it. */
KSL_EXPORT ksl_status_t ksl_neutral(const ksl_model_t *model, double *q);
KSL_EXPORT ksl_status_t ksl_neutralf(const ksl_model_t *model, float *q);

/** A random position into q (nq), from nq independent numbers, each uniform in [0, 1).  It is uniform between the limits of
    joints; where the file gives none, between −π and π for angles and between −1 m and 1 m for lengths; quaternions are uniform on the
    sphere (Shoemake, Uniform random rotations, Graphics Gems III (1992), p. 124).
    KSL_NOT_FINITE: limits are too large for float. */
KSL_EXPORT ksl_status_t ksl_random_position(const ksl_model_t *model, const double *uniform, double *q);
KSL_EXPORT ksl_status_t ksl_random_positionf(const ksl_model_t *model, const float *uniform, float *q);

/** Reactions through n joints into wrenches (n, 6).  Call it right after ksl_inverse_dynamics (or _with_reactions) in the same
    precision and with the same external wrenches.  After any other call with this workspace it fails, since such calls overwrite
    the wrenches.  options may be NULL.  The wrench is split in the joint's frame and the part is then transformed by the
    coadjoint.  KSL_NOT_FINITE: the wrenches or the offset are too large. */
KSL_EXPORT ksl_status_t ksl_reactions(const ksl_model_t *model, ksl_data_t *data, int n, const int *joints,
                                      const ksl_reaction_options_t *options, const ksl_external_t *external,
                                      double *wrenches);
KSL_EXPORT ksl_status_t ksl_reactionsf(const ksl_model_t *model, ksl_data_t *data, int n, const int *joints,
                                       const ksl_reaction_options_t *options, const ksl_externalf_t *external,
                                       float *wrenches);

/** How much of a link's own inertia is beyond a section: all or nothing, by its centre of mass; a fraction of it; or an inertia
    that is given. */
typedef enum ksl_section_share_t KSL_INT_ENUM { KSL_BY_CENTER, KSL_FRACTION, KSL_INERTIA } ksl_section_share_t;

/** A plane that cuts a link, and what is beyond it.  Initialise it with ksl_section(). */
typedef struct ksl_section_t {
  int link;
  double point[3];  /**< on the plane, in the link's frame, m; moments are about it */
  double normal[3]; /**< of the plane, in the link's axes, of any length; it points to the part beyond */
  ksl_section_share_t share;
  double fraction; /**< 0 to 1, with KSL_FRACTION */
  /** of the part beyond, with KSL_INERTIA: m, m c, Ixx Ixy Iyy Ixz Iyz Izz about the link's origin */
  double inertia[10];
  int beyond_n; /**< how many joints are listed; −1: none, those whose origins are beyond, where no joint has moved */
  const int *beyond;    /**< (beyond_n) of the joint that carries the link, those that it carries, and loops' at it */
  ksl_expressed_t axes; /**< KSL_IN_FRAME: those of the link */
  ksl_order_t order;
} ksl_section_t;

/** The section of a link by the plane z = 0, no joint listed, the inertia by its centre, in the link's axes, linear first. */
KSL_EXPORT ksl_section_t ksl_section(int link);

/** The wrench (6) that the near part of a link exerts on the part beyond a section, for q (nq), v (nv) and a (nv): Newton's and
    Euler's laws for the part beyond, with the reactions of its joints and the force elements whose points are beyond.  N, N m.
    A wrench on the link itself acts on the part with the link's origin.  external may be NULL.  O(bodies).
    KSL_NOT_FINITE: the state, the point or the inertia is too large. */
KSL_EXPORT ksl_status_t ksl_section_wrench(const ksl_model_t *model, ksl_data_t *data, const double *q, const double *v,
                                           const double *a, const ksl_external_t *external,
                                           const ksl_section_t *section, double *wrench);
KSL_EXPORT ksl_status_t ksl_section_wrenchf(const ksl_model_t *model, ksl_data_t *data, const float *q, const float *v,
                                            const float *a, const ksl_externalf_t *external,
                                            const ksl_section_t *section, float *wrench);

/** Pose of a link's frame in the world for q (nq).  KSL_NOT_FINITE: positions are too large. */
KSL_EXPORT ksl_status_t ksl_frame_pose(const ksl_model_t *model, ksl_data_t *data, const double *q, int link,
                                       ksl_SE3_t *pose);

/** A frame that is to reach a pose.  The weights say how much the errors of its position and of its orientation count.  With equal
    weights, an error of the position by a twentieth of the length of the chain that carries the frame counts as much as an error of the
    orientation by one radian.  An error with zero weight is ignored.  Weights are finite and not negative. */
typedef struct ksl_wanted_frame_t {
  int link;
  double position_weight, orientation_weight;
} ksl_wanted_frame_t;

typedef struct ksl_inverse_kinematics_options_t {
  double position_tolerance, orientation_tolerance; /**< m, rad; positive and finite */
  int iterations;                                   /**< at most, from each start */
  int starts;                                       /**< at most: the given one, if any, and random ones */
  uint64_t seed;                                    /**< of the random starts */
  bool limits;                                      /**< are the joints' limits to be kept */
} ksl_inverse_kinematics_options_t;

/** The defaults: 1e-6 m, 1e-6 rad (single precision reaches about 1e-5), 40 iterations, 5 starts, seed 0, with limits. */
KSL_EXPORT ksl_inverse_kinematics_options_t ksl_inverse_kinematics_options(void);

/** How the attempts for a target ended: converged; or the best of them needed more iterations, was held by limits, or stood
    still where the error has a local minimum. */
typedef enum ksl_inverse_kinematics_end_t {
  KSL_CONVERGED,
  KSL_ITERATIONS,
  KSL_LIMITS,
  KSL_STUCK
} ksl_inverse_kinematics_end_t;

/** Positions q (n, nq) at which frames have the poses of each of n targets (n, frames_n, 4, 4), row-major, in the world, by
    damped least squares.  start (n, nq) may be NULL: random ones.  errors (n, 2): the largest error of a position, m,
    and of an orientation, rad.  ends (n), iterations (n, of all starts) and starts (n, used).  These four may be NULL, and options.
    threads: 0 is all cores that the process may use (batches: below).  A target that is not reached is no
    error.  KSL_NOT_FINITE: a target or a start is so far away that the square of its distance is not finite; what was
    found has been written. */
KSL_EXPORT ksl_status_t ksl_inverse_kinematics(const ksl_model_t *model, size_t n, int frames_n,
                                               const ksl_wanted_frame_t *frames, const double *targets,
                                               ptrdiff_t targets_stride, const double *start, ptrdiff_t start_stride,
                                               const ksl_inverse_kinematics_options_t *options, double *q,
                                               ptrdiff_t q_stride, double *errors, ptrdiff_t errors_stride, int *ends,
                                               int *iterations, int *starts, int threads);
KSL_EXPORT ksl_status_t ksl_inverse_kinematicsf(const ksl_model_t *model, size_t n, int frames_n,
                                                const ksl_wanted_frame_t *frames, const float *targets,
                                                ptrdiff_t targets_stride, const float *start, ptrdiff_t start_stride,
                                                const ksl_inverse_kinematics_options_t *options, float *q,
                                                ptrdiff_t q_stride, float *errors, ptrdiff_t errors_stride, int *ends,
                                                int *iterations, int *starts, int threads);

KSL_END_C

#include "ksl/engine_building.h"
#include "ksl/engine_loops.h"
#include "ksl/engine_simulate.h"
#include "ksl/engine_calls.h"

#endif
