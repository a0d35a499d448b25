// KSL: two steps of the articulated-body algorithm for one body: solving A x = b, and the articulated inertia that the parent
// feels through a joint.
#pragma once

#include "ksl/engine/model/body_constants.hpp"

namespace ksl {
inline namespace KSL_ISA {

/// x = A⁻¹ b for the 6 × 6 matrix [M H; Hᵀ I] of an articulated inertia, by A = L D Lᵀ without pivoting; A is positive definite.
template <class T> inline screw<T> solve(const articulated_inertia<T> &A, const coscrew<T> &b) {
  T L[6][6] = {{A.Mxx, A.Mxy, A.Mzx, A.H.m00, A.H.m01, A.H.m02}, {A.Mxy, A.Myy, A.Myz, A.H.m10, A.H.m11, A.H.m12},
               {A.Mzx, A.Myz, A.Mzz, A.H.m20, A.H.m21, A.H.m22}, {A.H.m00, A.H.m10, A.H.m20, A.Ixx, A.Ixy, A.Izx},
               {A.H.m01, A.H.m11, A.H.m21, A.Ixy, A.Iyy, A.Iyz}, {A.H.m02, A.H.m12, A.H.m22, A.Izx, A.Iyz, A.Izz}};
  T x[6] = {b.lin.x, b.lin.y, b.lin.z, b.ang.x, b.ang.y, b.ang.z};
  for (int k = 0; k < 6; ++k) { // the lower triangle becomes L, the diagonal 1/D
    L[k][k] = T(1) / L[k][k];
    for (int i = k + 1; i < 6; ++i) {
      const T l = L[i][k] * L[k][k];
      for (int j = k + 1; j <= i; ++j)
        L[i][j] = L[i][j] - l * L[j][k];
      x[i] = x[i] - l * x[k];
    }
  }
  for (int i = 5; i >= 0; --i) {
    x[i] = x[i] * L[i][i];
    for (int j = 0; j < i; ++j)
      x[j] = x[j] - L[i][j] * x[i];
  }
  return {{x[0], x[1], x[2]}, {x[3], x[4], x[5]}};
}

/// sum += A − U D⁻¹ Uᵀ, translated by t: the articulated inertia that the parent feels through a joint
/// (articulated_inertia_downdated, _translated, _added).  With A = [M H; Hᵀ I] and U = (U.lin, n), the downdate is
///
///     M − U.lin U.linᵀ/D,   H − U.lin nᵀ/D,   I − n nᵀ/D,                                                        (1)
///
/// and the translation of its result
///
///     M,   K = H − M t̃,   I + t̃ K + (t̃ H)ᵀ.                                                                      (2)
///
/// The sum is computed one row of H at a time, so that the intermediate values fit into the registers.  147 flops.
template <class T>
KSL_LANES void add_beyond_joint(const articulated_inertia<T> &A, const coscrew<T> &U, const T &D_inverse,
                                const vec3<T> &t, articulated_inertia<T> &sum) {
  const vec3<T> &n = U.ang;
  vec3<T> F, N;
  algebra<T>::vec3_scaled(&U.lin, D_inverse, &F); // U.lin/D
  const T xx = A.Mxx - F.x * U.lin.x, yy = A.Myy - F.y * U.lin.y, zz = A.Mzz - F.z * U.lin.z;
  const T xy = A.Mxy - F.x * U.lin.y, yz = A.Myz - F.y * U.lin.z, zx = A.Mzx - F.z * U.lin.x;
  sum.Mxx = sum.Mxx + xx, sum.Myy = sum.Myy + yy, sum.Mzz = sum.Mzz + zz;
  sum.Mxy = sum.Mxy + xy, sum.Myz = sum.Myz + yz, sum.Mzx = sum.Mzx + zx;
  // h is a row of H after the downdate (1), and k the same row of K (2); Ixx … Izx collect t̃ K + (t̃ H)ᵀ
  vec3<T> h, k;
  h.x = A.H.m00 - F.x * n.x, h.y = A.H.m01 - F.x * n.y, h.z = A.H.m02 - F.x * n.z;
  k.x = h.x + (zx * t.y - xy * t.z), k.y = h.y + (xx * t.z - zx * t.x), k.z = h.z + (xy * t.x - xx * t.y);
  sum.H.m00 = sum.H.m00 + k.x, sum.H.m01 = sum.H.m01 + k.y, sum.H.m02 = sum.H.m02 + k.z;
  T Iyy = t.z * (k.y + h.y), Izz = t.y * (k.z + h.z), Ixy = t.z * h.x, Iyz = t.z * k.z - t.y * h.y, Izx = t.y * k.x;
  h.x = A.H.m10 - F.y * n.x, h.y = A.H.m11 - F.y * n.y, h.z = A.H.m12 - F.y * n.z;
  k.x = h.x + (yz * t.y - yy * t.z), k.y = h.y + (xy * t.z - yz * t.x), k.z = h.z + (yy * t.x - xy * t.y);
  sum.H.m10 = sum.H.m10 + k.x, sum.H.m11 = sum.H.m11 + k.y, sum.H.m12 = sum.H.m12 + k.z;
  T Ixx = t.z * (k.x + h.x);
  Izz = t.x * (k.z + h.z) - Izz, Ixy = Ixy - t.z * k.y, Iyz = Iyz + t.x * h.y, Izx = (t.x * k.x - t.z * h.z) - Izx;
  h.x = A.H.m20 - F.z * n.x, h.y = A.H.m21 - F.z * n.y, h.z = A.H.m22 - F.z * n.z;
  k.x = h.x + (zz * t.y - yz * t.z), k.y = h.y + (zx * t.z - zz * t.x), k.z = h.z + (yz * t.x - zx * t.y);
  sum.H.m20 = sum.H.m20 + k.x, sum.H.m21 = sum.H.m21 + k.y, sum.H.m22 = sum.H.m22 + k.z;
  Ixx = t.y * (k.x + h.x) - Ixx, Iyy = Iyy - t.x * (k.y + h.y);
  Ixy = Ixy + (t.y * k.y - t.x * h.x), Iyz = Iyz - t.x * k.z, Izx = Izx + t.y * h.z;
  algebra<T>::vec3_scaled(&n, D_inverse, &N); // n/D
  sum.Ixx = sum.Ixx + ((A.Ixx - N.x * n.x) + Ixx), sum.Iyy = sum.Iyy + ((A.Iyy - N.y * n.y) + Iyy);
  sum.Izz = sum.Izz + ((A.Izz - N.z * n.z) + Izz), sum.Ixy = sum.Ixy + ((A.Ixy - N.x * n.y) + Ixy);
  sum.Iyz = sum.Iyz + ((A.Iyz - N.y * n.z) + Iyz), sum.Izx = sum.Izx + ((A.Izx - N.z * n.x) + Izx);
}

} // namespace KSL_ISA
} // namespace ksl
