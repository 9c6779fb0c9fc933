// SPDX-License-Identifier: BSD-3-Clause
// The navigation state as a manifold, and the order of its axes.
#include <searvins/imu/navigation_state.hpp>

#include <set>
#include <string>

#include "imu/factor_check.hpp"
#include "support/property.hpp"

using namespace searvins;
using namespace searvins::test;
using imu::NavigationState;

namespace {

NavigationState::Step random_step(Rng& rng, double attitude_rad) {
  NavigationState::Step d = random_vector<15>(rng, 3);
  d.head<3>() = random_vector<3>(rng, attitude_rad);
  return d;
}

}  // namespace

TEST_CASE("local undoes retract, retract undoes local, a state is at no distance from itself") {
  for_all_seeds(300, [](Rng& rng) {
    const NavigationState x = random_navigation_state(rng), y = random_navigation_state(rng);
    const NavigationState::Step d = random_step(rng, 1.7);  // |d| < pi
    CHECK(close(x.local(x.retract(d)), d, 1e-12));
    const NavigationState z = x.retract(x.local(y));
    CHECK(close(z.R_wb, y.R_wb, 1e-14));
    CHECK(y.local(z).norm() < 1e-12);
    CHECK(x.local(x).norm() < 1e-14);
    CHECK(x.retract(NavigationState::Step::Zero()).local(x).norm() < 1e-14);
    const Eigen::Matrix3d orthonormal = z.R_wb.transpose() * z.R_wb;
    CHECK(close(orthonormal, Eigen::Matrix3d::Identity().eval(), 1e-14));
  });
}

TEST_CASE("attitude is perturbed on the right, in body axes; position and velocity in axes of w") {
  for_all_seeds(50, [](Rng& rng) {
    const NavigationState x = random_navigation_state(rng);
    const Eigen::Vector3d theta = random_vector<3>(rng), forward_b = Eigen::Vector3d::UnitY();
    NavigationState::Step d = NavigationState::Step::Zero();
    d.segment<3>(NavigationState::attitude) = 1e-6 * theta;
    const Eigen::Vector3d moved = x.retract(d).R_wb * forward_b - x.R_wb * forward_b, expected = 1e-6 * (x.R_wb * theta.cross(forward_b));
    CHECK((moved - expected).norm() < 1e-11);
    CHECK(x.retract(d).p_wb_m == x.p_wb_m);
    d.setZero();
    d[NavigationState::position + 1] = 2, d[NavigationState::velocity + 2] = 3, d[NavigationState::accel_bias] = 4,
                                  d[NavigationState::gyro_bias + 1] = 5;
    const NavigationState y = x.retract(d);
    CHECK(close((y.p_wb_m - x.p_wb_m).eval(), Eigen::Vector3d{0, 2, 0}, 1e-13));
    CHECK(close((y.v_wb_mps - x.v_wb_mps).eval(), Eigen::Vector3d{0, 0, 3}, 1e-13));
    CHECK(close((y.accel_bias_b_mps2 - x.accel_bias_b_mps2).eval(), Eigen::Vector3d{4, 0, 0}, 1e-13));
    CHECK(close((y.gyro_bias_b_radps - x.gyro_bias_b_radps).eval(), Eigen::Vector3d{0, 5, 0}, 1e-13));
    CHECK(close(y.R_wb, x.R_wb, 1e-15));
  });
}

TEST_CASE("axes are named in the order of the tangent vector") {
  std::set<std::string> names;
  for (int i = 0; i < 15; ++i) names.insert(NavigationState::axis_name(i));
  CHECK(names.size() == 15);
  CHECK(std::string{NavigationState::axis_name(NavigationState::attitude)} == "attitude x");
  CHECK(std::string{NavigationState::axis_name(NavigationState::position + 2)} == "up");
  CHECK(std::string{NavigationState::axis_name(NavigationState::velocity + 1)} == "north velocity");
  CHECK(std::string{NavigationState::axis_name(NavigationState::accel_bias)} == "accel bias x");
  CHECK(std::string{NavigationState::axis_name(NavigationState::gyro_bias + 2)} == "gyro bias z");
  CHECK(std::string{NavigationState::axis_name(15)} == "?");
  CHECK(std::string{NavigationState::axis_name(-1)} == "?");
  CHECK((NavigationState::linearisation_scale().array() > 0).all());
}
