// SPDX-License-Identifier: BSD-3-Clause
// The East-North-Up frame: round trips, signs of each axis, azimuth and elevation, gravity as a vector.
#include <doctest/doctest.h>

#include <cmath>
#include <numbers>

#include <searvins/geodesy/local_frame.hpp>

#include "examples/support/angle_units.hpp"
#include "support/property.hpp"

namespace geodesy = searvins::geodesy;
using geodesy::Geodetic;
using geodesy::LocalFrame;
using searvins::test::Rng;
using searvins::test::uniform;

namespace {

using searvins::examples::kRadPerDeg;
using std::numbers::pi;
const Eigen::Vector3d kBase_e_m{-742080.4125, -5462031.7412, 3198339.6909};
const Eigen::Vector3d kRover_e_m{-741205.0262, -5462376.8743, 3197933.6654};

Geodetic random_place(Rng& rng) { return {uniform(rng, -1.5, 1.5), uniform(rng, -pi, pi), uniform(rng, -100, 9000)}; }

}  // namespace

TEST_CASE("local frame: there and back, lengths kept, origin at zero") {
  searvins::test::for_all_seeds(500, [](Rng& rng) {
    const LocalFrame frame = LocalFrame::at(geodesy::ecef_from_geodetic(random_place(rng)));
    const Eigen::Vector3d a_w_m = searvins::test::random_vector<3>(rng, 2e4), b_w_m = searvins::test::random_vector<3>(rng, 2e4);
    CHECK((frame.to_local(frame.to_ecef(a_w_m)) - a_w_m).norm() <= 5e-9);
    CHECK((frame.to_ecef(a_w_m) - frame.to_ecef(b_w_m)).norm() == doctest::Approx((a_w_m - b_w_m).norm()).epsilon(1e-12));
    CHECK(frame.to_local(frame.origin_e_m).norm() == 0);
    CHECK((frame.R_ew.transpose() * frame.R_ew - Eigen::Matrix3d::Identity()).norm() <= 1e-15);
    CHECK(frame.R_ew.col(0).cross(frame.R_ew.col(1)).dot(frame.R_ew.col(2)) == doctest::Approx(1).epsilon(1e-15));
  });
}

TEST_CASE("local frame: east, north and up are where latitude, longitude and height grow") {
  searvins::test::for_all_seeds(300, [](Rng& rng) {
    const Geodetic g = random_place(rng);
    const LocalFrame frame = LocalFrame::at(geodesy::ecef_from_geodetic(g));
    const Eigen::Vector3d east = frame.to_local(geodesy::ecef_from_geodetic({g.lat_rad, g.lon_rad + 1e-6, g.height_m}));
    const Eigen::Vector3d north = frame.to_local(geodesy::ecef_from_geodetic({g.lat_rad + 1e-6, g.lon_rad, g.height_m}));
    const Eigen::Vector3d up = frame.to_local(geodesy::ecef_from_geodetic({g.lat_rad, g.lon_rad, g.height_m + 10}));
    CHECK((east.normalized() - Eigen::Vector3d::UnitX()).norm() < 1e-5);
    CHECK((north.normalized() - Eigen::Vector3d::UnitY()).norm() < 1e-5);
    CHECK((up - Eigen::Vector3d{0, 0, 10}).norm() < 1e-8);
  });
}

TEST_CASE("local frame: the rover's parking lot seen from the base of the recordings") {
  const Eigen::Vector3d rover_w_m = LocalFrame::at(kBase_e_m).to_local(kRover_e_m);
  CHECK((rover_w_m - Eigen::Vector3d{913.88, -463.65, -11.25}).cwiseAbs().maxCoeff() < 6e-3);
  CHECK(rover_w_m.norm() == doctest::Approx((kRover_e_m - kBase_e_m).norm()).epsilon(1e-12));
  const auto seen = geodesy::azimuth_elevation(kBase_e_m, kRover_e_m);
  CHECK(seen.azimuth_rad / kRadPerDeg == doctest::Approx(116.9).epsilon(1e-3));  // east-south-east
  CHECK(seen.elevation_rad < 0);
}

TEST_CASE("azimuth and elevation: the four winds, zenith, nadir, horizon") {
  searvins::test::for_all_seeds(300, [](Rng& rng) {
    const Eigen::Vector3d p_e_m = geodesy::ecef_from_geodetic(random_place(rng));
    const LocalFrame frame = LocalFrame::at(p_e_m);
    const auto seen = [&](double e, double n, double u) { return geodesy::azimuth_elevation(p_e_m, frame.to_ecef({e, n, u})); };
    CHECK(std::abs(seen(0, 1e4, 0).azimuth_rad) < 1e-12);
    CHECK(seen(1e4, 0, 0).azimuth_rad == doctest::Approx(pi / 2));
    CHECK(std::abs(seen(0, -1e4, 0).azimuth_rad) == doctest::Approx(pi));
    CHECK(seen(-1e4, 0, 0).azimuth_rad == doctest::Approx(-pi / 2));
    CHECK(std::abs(seen(1e4, 2e4, 0).elevation_rad) < 1e-12);
    CHECK(seen(0, 0, 2e7).elevation_rad == doctest::Approx(pi / 2));
    CHECK(seen(0, 0, -10).elevation_rad == doctest::Approx(-pi / 2));

    const double azimuth = uniform(rng, -pi, pi), elevation = uniform(rng, -1.5, 1.5), range_m = uniform(rng, 1e3, 3e7);
    const auto any = seen(range_m * std::cos(elevation) * std::sin(azimuth), range_m * std::cos(elevation) * std::cos(azimuth),
                          range_m * std::sin(elevation));
    CHECK(std::abs(std::remainder(any.azimuth_rad - azimuth, 2 * pi)) < 1e-9);
    CHECK(std::abs(any.elevation_rad - elevation) < 1e-10);
  });
}

TEST_CASE("gravity points down the ellipsoidal normal and has the size of normal gravity") {
  searvins::test::for_all_seeds(300, [](Rng& rng) {
    const Geodetic g = random_place(rng);
    const Eigen::Vector3d p_e_m = geodesy::ecef_from_geodetic(g);
    const Eigen::Vector3d gravity_w = LocalFrame::at(p_e_m).R_ew.transpose() * geodesy::gravity_e_mps2(p_e_m);
    CHECK(gravity_w.head<2>().norm() < 1e-14);
    CHECK(gravity_w.z() == doctest::Approx(-geodesy::normal_gravity_mps2(g.lat_rad, g.height_m)).epsilon(1e-14));
    CHECK(gravity_w.z() < -9.75);
    CHECK(gravity_w.z() > -9.84);
  });
  const Eigen::Vector3d at_base = LocalFrame::at(kBase_e_m).R_ew.transpose() * geodesy::gravity_e_mps2(kBase_e_m);
  CHECK(std::abs(at_base.z() + 9.792953) < 1e-6);
}
