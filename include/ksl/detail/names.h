/* The one place where the names that algebra bodies use get their meaning (docs/algebra.md explains it).

   A body in detail/ *.inc is written once, with the names below.  A file that includes bodies says for which scalar:

     #define KSL_NAMES KSL_NAMES_DOUBLE      ksl_product_Ads   ksl_screw_copy    ksl_screw_t
     #define KSL_NAMES KSL_NAMES_FLOAT       ksl_product_Adsf  ksl_screwf_copy   ksl_screwf_t
     #define KSL_NAMES KSL_NAMES_TEMPLATE    product_Ads       screw_copy        screw (inside algebra<T>)
     #include "ksl/detail/names.h"           before the bodies;
     #define KSL_NAMES KSL_NAMES_END         and once more after the last of them.

   Macros of the user's that have these names are saved at the first and restored at the last inclusion. */

#define KSL_NAMES_END 0
#define KSL_NAMES_DOUBLE 1
#define KSL_NAMES_FLOAT 2
#define KSL_NAMES_TEMPLATE 3

#ifndef KSL_NAMES_OPEN
#define KSL_NAMES_OPEN
#pragma push_macro("real")
#pragma push_macro("vec3")
#pragma push_macro("vec4")
#pragma push_macro("mat3x3")
#pragma push_macro("mat4x4")
#pragma push_macro("SE3")
#pragma push_macro("quaternion")
#pragma push_macro("screw")
#pragma push_macro("coscrew")
#pragma push_macro("inertia")
#pragma push_macro("spatial_inertia")
#pragma push_macro("articulated_inertia")
#pragma push_macro("joint_space")
#pragma push_macro("motion")
#pragma push_macro("force")
#pragma push_macro("plucker")
#endif

#undef real
#undef vec3
#undef vec4
#undef mat3x3
#undef mat4x4
#undef SE3
#undef quaternion
#undef screw
#undef coscrew
#undef inertia
#undef spatial_inertia
#undef articulated_inertia
#undef joint_space
#undef motion
#undef force
#undef plucker
#undef KSL_FN
#undef KSL_HELPER
#undef KSL
#undef KSL_OF
#undef KSL_SELECT
#undef KSL_EPSILON
#undef KSL_SQRT
#undef KSL_FABS
#undef KSL_SIN
#undef KSL_COS
#undef KSL_SIN_WITH_HALF
#undef KSL_HALF_SIN_COS
#undef KSL_ATAN2
#undef KSL_FMA
#undef KSL_FMOD
#undef KSL_FLOOR

#if KSL_NAMES == KSL_NAMES_DOUBLE

#define real double
#define vec3 ksl_vec3_t
#define vec4 ksl_vec4_t
#define mat3x3 ksl_mat3x3_t
#define mat4x4 ksl_mat4x4_t
#define SE3 ksl_SE3_t
#define quaternion ksl_quaternion_t
#define screw ksl_screw_t
#define coscrew ksl_coscrew_t
#define inertia ksl_inertia_t
#define spatial_inertia ksl_spatial_inertia_t
#define articulated_inertia ksl_articulated_inertia_t
#define joint_space ksl_joint_space_t
#define motion ksl_motion_t
#define force ksl_force_t
#define plucker ksl_plucker_t
#define KSL_FN KSL_INLINE
#define KSL_HELPER KSL_INLINE_HELPER
#define KSL(name) ksl_##name
#define KSL_OF(type, name) ksl_##type##_##name
#define KSL_SELECT(condition, a, b) ((condition) ? (a) : (b))
#define KSL_EPSILON DBL_EPSILON
#define KSL_SQRT sqrt
#define KSL_FABS fabs
#define KSL_SIN sin
#define KSL_COS cos
#define KSL_ATAN2 atan2
#define KSL_FMA fma
#define KSL_FMOD fmod
#define KSL_FLOOR floor

#elif KSL_NAMES == KSL_NAMES_FLOAT

#define real float
#define vec3 ksl_vec3f_t
#define vec4 ksl_vec4f_t
#define mat3x3 ksl_mat3x3f_t
#define mat4x4 ksl_mat4x4f_t
#define SE3 ksl_SE3f_t
#define quaternion ksl_quaternionf_t
#define screw ksl_screwf_t
#define coscrew ksl_coscrewf_t
#define inertia ksl_inertiaf_t
#define spatial_inertia ksl_spatial_inertiaf_t
#define articulated_inertia ksl_articulated_inertiaf_t
#define joint_space ksl_joint_spacef_t
#define motion ksl_motionf_t
#define force ksl_forcef_t
#define plucker ksl_pluckerf_t
#define KSL_FN KSL_INLINE
#define KSL_HELPER KSL_INLINE_HELPER
#define KSL(name) ksl_##name##f
#define KSL_OF(type, name) ksl_##type##f_##name
#define KSL_SELECT(condition, a, b) ((condition) ? (a) : (b))
#define KSL_EPSILON FLT_EPSILON
#define KSL_SQRT sqrtf
#define KSL_FABS fabsf
#define KSL_SIN sinf
#define KSL_COS cosf
#define KSL_ATAN2 atan2f
#define KSL_FMA fmaf
#define KSL_FMOD fmodf
#define KSL_FLOOR floorf

#elif KSL_NAMES == KSL_NAMES_TEMPLATE

/* Types and the math functions are members of algebra<T>; an 8-lane function must not be left out of line where the compiler
   optimises. */
#ifdef __OPTIMIZE__
#define KSL_FN __attribute__((always_inline)) static inline
#else
#define KSL_FN static inline
#endif
#define KSL_HELPER KSL_FN
#define KSL(name) name
#define KSL_OF(type, name) type##_##name
#define KSL_SELECT(condition, a, b) math::select((condition), (a), (b))
#define KSL_EPSILON math::epsilon
#define KSL_SQRT math::sqrt
#define KSL_FABS math::fabs
#define KSL_SIN math::sin
#define KSL_COS math::cos
#define KSL_ATAN2 math::atan2
#define KSL_SIN_WITH_HALF ksl::sine_with_half<math>
#define KSL_HALF_SIN_COS ksl::half_sine_cosine<math>

#else

#pragma pop_macro("real")
#pragma pop_macro("vec3")
#pragma pop_macro("vec4")
#pragma pop_macro("mat3x3")
#pragma pop_macro("mat4x4")
#pragma pop_macro("SE3")
#pragma pop_macro("quaternion")
#pragma pop_macro("screw")
#pragma pop_macro("coscrew")
#pragma pop_macro("inertia")
#pragma pop_macro("spatial_inertia")
#pragma pop_macro("articulated_inertia")
#pragma pop_macro("joint_space")
#pragma pop_macro("motion")
#pragma pop_macro("force")
#pragma pop_macro("plucker")
#undef KSL_NAMES_OPEN

#endif

/* The sine of an angle and of its half, and sine and cosine of the half: a scalar may have all three at once. */
#if KSL_NAMES == KSL_NAMES_DOUBLE || KSL_NAMES == KSL_NAMES_FLOAT
#define KSL_SIN_WITH_HALF(x, sine, half) (*(sine) = KSL_SIN(x), *(half) = KSL_SIN((real)0.5 * (x)))
#define KSL_HALF_SIN_COS(x, sine, cosine) (*(sine) = KSL_SIN((real)0.5 * (x)), *(cosine) = KSL_COS((real)0.5 * (x)))
#endif

#undef KSL_NAMES
