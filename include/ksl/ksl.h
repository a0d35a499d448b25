/* KSL: everything, except trig.h and memory.h. */
#ifndef KSL_KSL_H
#define KSL_KSL_H

#include "ksl/SE3.h"
#include "ksl/array.h"
#include "ksl/articulated_inertia.h"
#include "ksl/axis.h"
#include "ksl/config.h"
#include "ksl/coscrew.h"
#include "ksl/eulerangles.h"
#include "ksl/inertia.h"
#include "ksl/joint_space.h"
#include "ksl/linalg.h"
#include "ksl/mat3x3.h"
#include "ksl/mat4x4.h"
#include "ksl/matrix.h"
#include "ksl/matrix6.h"
#include "ksl/plucker.h"
#include "ksl/poinsot.h"
#include "ksl/print.h"
#include "ksl/quaternion.h"
#include "ksl/screw.h"
#include "ksl/spatial_inertia.h"
#include "ksl/types.h"
#include "ksl/vec3.h"
#include "ksl/vec4.h"

#include <assert.h>

#endif
