/* KSL: the types that calls from C share: handles, options, and how external wrenches, reactions and motions of frames are given.
   Included by ksl/engine.h, which has the calls. */
#ifndef KSL_ENGINE_TYPES_H
#define KSL_ENGINE_TYPES_H

#include "ksl/types.h"

#include <stddef.h>
#include <stdint.h>

KSL_BEGIN_C

typedef struct ksl_model_t ksl_model_t;
typedef struct ksl_data_t ksl_data_t;

typedef enum ksl_status_t {
  KSL_OK = 0,
  KSL_BAD_ARGUMENT = 1,    /**< a null pointer, an index out of range, a number that is not finite */
  KSL_BAD_DESCRIPTION = 2, /**< a file that can't be read or describes no mechanism */
  KSL_FAILED = 3,          /**< anything else: no memory, an unknown KSL_ISA */
  KSL_NOT_FINITE =
      4 /**< the arguments are finite and a result is not: numbers are too large or small, or a joint moves no mass at this
                                position; results have been written as they were computed */
} ksl_status_t;

/** A point mass fixed to a link. */
typedef struct ksl_payload_t {
  const char *link; /**< its name */
  double mass;      /**< kg, not negative */
  double point[3];  /**< in the link's frame, m */
} ksl_payload_t;

/** Which physics of joints a model has, besides that of rigid bodies.  All zeros is none: efforts are the transmitted ones of the
    textbook.  docs/conventions.md has the laws. */
typedef struct ksl_physics_t {
  bool damping, friction, armature, rotor, spring;
  /** rotors are bodies that turn with the joint's parent link, instead of inertia of its coordinate */
  bool rotor_bodies;
  /** F sign(v), instead of the smooth law; for inverse dynamics only: what solves or differentiates the law
      of friction is refused */
  bool exact_friction;
  bool force_elements;   /**< springs, dampers and cylinders between points of two links */
  double friction_width; /**< of the smooth law, rad/s or m/s, for joints that have none of their own; 0: 0.01 */
} ksl_physics_t;

/** How a file is made into a model.  Initialise it with ksl_model_options(). */
typedef struct ksl_model_options_t {
  /** the root link floats: first joint floating_base (floating_root if the file has one of that name),
      q = [x y z qx qy qz qw], v = [linear, angular] in its frame */
  bool floating_base;
  bool mimic_independent; /**< a mimic joint gets a coordinate of its own, instead of following another joint */
  bool strict; /**< an inertia that no body can have, or a moving link with geometry and no mass, is an error */
  /** a robot whose moving links have no mass is accepted, for kinematics, instead of being refused */
  bool masses_optional;
  double gravity[3]; /**< m/s², world axes */
  int payloads_n;
  const ksl_payload_t *payloads; /**< (payloads_n), read by ksl_model_load alone; several may be on one link */
  bool file_gravity;             /**< a gravity that an SDF file gives replaces `gravity` */
  const char *model_name;        /**< which model of an SDF file with several; NULL: the only one that is not static */
  ksl_physics_t physics;
} ksl_model_options_t;

typedef enum ksl_expressed_t KSL_INT_ENUM { KSL_IN_FRAME, KSL_IN_WORLD } ksl_expressed_t;

/** Wrenches that the environment exerts on links: at the link's origin, in the link's axes (KSL_IN_FRAME, the default) or in those
    of the world.  In derivatives by q, wrenches are held in these axes. */
typedef struct ksl_external_t {
  int n;
  const int *link;             /**< (n) */
  const ksl_coscrew_t *wrench; /**< (n) */
  ksl_expressed_t axes;
} ksl_external_t;

typedef struct ksl_externalf_t {
  int n;
  const int *link;
  const ksl_coscrewf_t *wrench;
  ksl_expressed_t axes;
} ksl_externalf_t;

/** Wrenches for a batch: the n wrenches of state k are contiguous, six numbers each, and begin at wrench + k × stride. */
typedef struct ksl_external_rows_t {
  int n;
  const int *link; /**< (n) */
  const double *wrench;
  ptrdiff_t stride;
  ksl_expressed_t axes;
} ksl_external_rows_t;
typedef struct ksl_external_rowsf_t {
  int n;
  const int *link;
  const float *wrench;
  ptrdiff_t stride;
  ksl_expressed_t axes;
} ksl_external_rowsf_t;

typedef enum ksl_part_t KSL_INT_ENUM { KSL_TOTAL, KSL_CONSTRAINT, KSL_ACTUATION, KSL_COUPLING } ksl_part_t;
typedef enum ksl_side_t KSL_INT_ENUM { KSL_ON_CHILD, KSL_ON_PARENT } ksl_side_t;
typedef enum ksl_frame_t KSL_INT_ENUM { KSL_JOINT, KSL_WORLD, KSL_LINK } ksl_frame_t;
typedef enum ksl_order_t KSL_INT_ENUM { KSL_LINEAR_FIRST, KSL_ANGULAR_FIRST } ksl_order_t;

/** How a reaction is expressed.  All zeros is the default: the whole wrench that the parent side exerts on the child
    side, at the joint's origin, in the axes of the joint's frame on the child side (in URDF: the child link's), linear
    first. */
typedef struct ksl_reaction_options_t {
  ksl_part_t part; /**< KSL_CONSTRAINT: what the structure carries, H̄* f; KSL_ACTUATION: along the joint's motion, h̄* f;
                       KSL_COUPLING: the same of a follower (mimic joint), which has no actuation */
  ksl_side_t on;
  /** point: KSL_JOINT (plus offset, in the joint's axes, m), KSL_WORLD (its origin), KSL_LINK (origin of at_link) */
  ksl_frame_t at;
  int at_link;
  double offset[3];
  ksl_frame_t axes; /**< KSL_JOINT, KSL_WORLD, KSL_LINK (those of axes_link) */
  int axes_link;
  ksl_order_t order;
} ksl_reaction_options_t;

/** Which acceleration.  Classical: that of the link's point which is at the origin in question.  Spatial: the classical one less
    ω × v of this point.  Rate: the rate of the numbers of the twist. */
typedef enum ksl_acceleration_t KSL_INT_ENUM { KSL_SPATIAL, KSL_CLASSICAL, KSL_RATE } ksl_acceleration_t;

/** How a motion of a link's frame is expressed.  All zeros is the default: about the frame's origin, in its axes, linear
    first, accelerations spatial.  KSL_IN_WORLD: about the world's origin, in its axes.  offset: of the frame's origin from
    the link's, in the link's axes, m. */
typedef struct ksl_frame_options_t {
  ksl_expressed_t axes, at;
  ksl_order_t order;
  ksl_acceleration_t kind;
  double offset[3];
} ksl_frame_options_t;

KSL_END_C

#endif
