// SPDX-License-Identifier: BSD-3-Clause
// Earth rate and gravity in the local frame, and the matrices of a turn, against their definitions.
#include <searvins/imu/earth.hpp>

#include "support/property.hpp"

using namespace searvins;
using namespace searvins::test;
using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

geodesy::LocalFrame random_frame(Rng& rng) {
  return geodesy::LocalFrame::at(geodesy::ecef_from_geodetic({uniform(rng, -1.5, 1.5), uniform(rng, -3.1, 3.1), uniform(rng, -100, 3000)}));
}

}  // namespace

TEST_CASE("Earth rate in w: east 0, north omega cos(lat), up omega sin(lat)") {
  for_all_seeds(100, [](Rng& rng) {
    const geodesy::Geodetic place{uniform(rng, -1.5, 1.5), uniform(rng, -3.1, 3.1), 0};
    const imu::RotatingEarth earth{geodesy::LocalFrame::at(geodesy::ecef_from_geodetic(place))};
    const Vector3d expected = geodesy::kEarthRateRadps * Vector3d{0, std::cos(place.lat_rad), std::sin(place.lat_rad)};
    CHECK((earth.rate_w_radps() - expected).norm() < 1e-17);
    CHECK(imu::FlatEarth{earth.frame}.rate_w_radps() == Vector3d::Zero());
  });
}

TEST_CASE("gravity is that of the position: down at the origin, tilted and weaker away from it; the field follows it to the stated order") {
  for_all_seeds(100, [](Rng& rng) {
    const imu::RotatingEarth earth{random_frame(rng)};
    const Vector3d g0 = earth.gravity_w_mps2(Vector3d::Zero());
    CHECK(g0.head<2>().norm() < 1e-10);
    CHECK(g0.z() < -9.75);
    CHECK(g0.z() > -9.84);
    const Vector3d p{3e4, 0, 0};  // 30 km east: down turns by 30 km over the radius of the prime vertical, towards the origin
    CHECK(earth.gravity_w_mps2(p).x() == doctest::Approx(-9.8 * 3e4 / 6.385e6).epsilon(0.005));

    const Vector3d at = random_vector<3>(rng, 2e4).cwiseProduct(Vector3d{1, 1, 0.05});
    const imu::GravityField field = earth.gravity_field(at);
    CHECK(close(field.at(at), earth.gravity_w_mps2(at), 1e-15));
    for (const double away : {30.0, 1000.0}) {
      const Vector3d d = random_vector<3>(rng).normalized() * away;
      CHECK((field.at(at + d) - earth.gravity_w_mps2(at + d)).norm() < 3e-8 * away + 5e-13 * away * away);
      CHECK((field.gravity_w_mps2 - earth.gravity_w_mps2(at + d)).norm() > 5e-7 * away);  // a constant would be off
    }
    CHECK(close(imu::FlatEarth{earth.frame}.gravity_w_mps2(at), earth.gravity_w_mps2(at), 1e-15));
    const imu::ConstantGravity laboratory{};
    CHECK(laboratory.gravity_field(at).at(p) == laboratory.gravity_w_mps2);
  });
}

TEST_CASE("the matrices of a turn are C and its first two integrals") {
  for_all_seeds(50, [](Rng& rng) {
    const Vector3d rate = random_vector<3>(rng).normalized() * geodesy::kEarthRateRadps;
    const double T = std::pow(10.0, uniform(rng, -3, 1.8));
    const imu::EarthTurn w = imu::EarthTurn::over(rate, T);
    const auto turned = [&](double t) { return Matrix3d{Eigen::AngleAxisd{rate.norm() * t, rate.normalized()}.toRotationMatrix()}; };
    Matrix3d J1 = Matrix3d::Zero(), J2 = Matrix3d::Zero();
    const int n = 100;  // Simpson
    for (int k = 0; k <= n; ++k) {
      const double t = T * k / n, weight = (k == 0 || k == n ? 1.0 : k % 2 == 1 ? 4.0 : 2.0) * T / n / 3;
      J1 += weight * turned(t);
      J2 += weight * (T - t) * turned(t);
    }
    CHECK((w.C - turned(T)).norm() < 1e-14);
    CHECK((w.J1 - J1).norm() < 1e-11 * T + 0.07 * std::pow(geodesy::kEarthRateRadps * T, 3) * T);
    CHECK((w.J2 - J2).norm() < 1e-11 * T * T + 0.07 * std::pow(geodesy::kEarthRateRadps * T, 3) * T * T);
    const Vector3d u = random_vector<3>(rng);
    CHECK((w.K * u - rate.cross(u)).norm() < 1e-19);
    const imu::EarthTurn still = imu::EarthTurn::none(T), slow = imu::EarthTurn::over(Vector3d::Zero(), T);
    CHECK((still.C == slow.C && still.K == slow.K));
    CHECK(close(still.J1, slow.J1, 1e-15));
    CHECK(close(still.J2, slow.J2, 1e-15));
  });
}
