// The C++ calls of dynamics.hpp: a model and a workspace, unpacked for the kernels.
#include "ksl/dynamics.hpp"

#include "ksl/engine/forward_kinematics.hpp"

#include "load/check.hpp"
#include "load/urdf.hpp"
#include "engine/kernels.hpp"

#include <set>

namespace ksl {

model load(const std::string &urdf_path, const model_options &options, bool mimic_independent, bool strict,
           bool masses_optional) {
  robot_description robot = read_urdf(urdf_path, {mimic_independent, strict});
  std::set<std::string> with_payload;
  for (const payload &p : options.payloads)
    if (p.mass > 0)
      with_payload.insert(p.link);
  warn_of_links(robot, check_masses(robot, options.floating_base, with_payload, masses_optional), strict,
                "add <inertial> to these links");
  return model(std::move(robot), options);
}

void inverse_dynamics(const model &m, data &d, const double *q, const double *v, const double *a, double *tau,
                      const external_wrenches<double> &external) {
  kernels().inverse_dynamics(m.view(), d.memory(), q, v, a, external, tau);
}

void reactions(const model &m, data &d, const reaction_request &request, double *out,
               const external_wrenches<double> &external) {
  kernels().reactions(m.view(), d.memory(), external, request, out);
}

void inverse_dynamics_with_reactions(const model &m, data &d, const double *q, const double *v, const double *a, double *tau,
                                     const reaction_request &request, double *out,
                                     const external_wrenches<double> &external) {
  kernels().inverse_dynamics_with_reactions(m.view(), d.memory(), q, v, a, external, tau, request, out);
}

void forward_dynamics(const model &m, data &d, const double *q, const double *v, const double *tau, double *a,
                      const external_wrenches<double> &external) {
  kernels().forward_dynamics(m.view(), d.memory(), q, v, tau, external, a);
}

void mass_matrix(const model &m, data &d, const double *q, double *M) {
  kernels().mass_matrix(m.view(), d.memory(), q, M);
}

void bias(const model &m, data &d, const double *q, const double *v, double *tau,
          const external_wrenches<double> &external) {
  inverse_dynamics(m, d, q, v, d.zero(), tau, external);
}

void gravity_torque(const model &m, data &d, const double *q, double *tau, const external_wrenches<double> &external) {
  inverse_dynamics(m, d, q, d.zero(), d.zero(), tau, external);
}

SE3<double> frame_pose(const model &m, data &d, const double *q, int link) {
  double out[16];
  kernels().frame_poses(m.view(), d.memory(), q, 1, &link, out);
  return {{out[0], out[4], out[8], out[1], out[5], out[9], out[2], out[6], out[10]}, {out[3], out[7], out[11]}};
}

void frame_poses(const model &m, data &d, const double *q, int n, const int *links, double *out) {
  kernels().frame_poses(m.view(), d.memory(), q, n, links, out);
}

void energy(const model &m, data &d, const double *q, const double *v, double *kinetic, double *potential) {
  kernels().energy(m.view(), d.memory(), q, v, kinetic, potential);
}

double external_power(const model &m, data &d, const double *q, const double *v,
                      const external_wrenches<double> &external) {
  double power;
  kernels().external_power(m.view(), d.memory(), q, v, external, &power);
  return power;
}

} // namespace ksl
