// SPDX-License-Identifier: BSD-3-Clause
// Rectification: what two raw cameras see of a point lies on one row of the rectified pair and triangulates to the point; maps both ways;
// remap rows; a real calibration; refusals.
#include <searvins/vision/rectification.hpp>

#include <cmath>
#include <vector>

#include <searvins/vision/triangulation.hpp>

#include "support/property.hpp"
#include "vision/vision_samples.hpp"

using namespace searvins;
using namespace searvins::test;
using vision::Eye;
using vision::StereoCalibration;

TEST_CASE("a point seen by both raw cameras lies on one row, where the rectified camera sees it, and triangulates back") {
  for_all_seeds(100, [](Rng& rng) {
    const StereoCalibration<double> pair = random_pair(rng);
    const auto rectification = vision::rectify(pair);
    REQUIRE(rectification.ok());
    const auto& camera = rectification->camera();
    CHECK(camera.baseline_m == doctest::Approx(pair.t_c1_c0_m.norm()));
    const double z = uniform(rng, 2, 40);
    const Eigen::Vector3d p_c0{uniform(rng, -0.3, 0.3) * z, uniform(rng, -0.2, 0.2) * z, z}, p_c1 = pair.R_c1_c0 * p_c0 + pair.t_c1_c0_m;
    const auto left = pair.eyes[0].project(p_c0), right = pair.eyes[1].project(p_c1);
    REQUIRE((left.ok() && right.ok()));
    const auto l = rectification->rectified(Eye::left, *left), r = rectification->rectified(Eye::right, *right);
    REQUIRE((l.ok() && r.ok()));
    CHECK(std::abs((*l)[1] - (*r)[1]) < 1e-8);
    const Eigen::Vector3d p_b = pair.R_b_c0 * p_c0 + pair.p_b_c0_m;
    const auto seen = camera.project(camera.camera_from_body(p_b));
    REQUIRE(seen.ok());
    CHECK((*seen - Eigen::Vector3d{(*l)[0], (*r)[0], (*l)[1]}).norm() < 1e-7);
    CHECK(close(camera.body_from_camera(vision::point_at(camera, {(*l)[0], (*r)[0], (*l)[1]})), p_b, 1e-6));
  });
}

TEST_CASE("the two maps are each other's inverse, in double and in float") {
  for_all_seeds(100, [](Rng& rng) {
    const StereoCalibration<double> pair = random_pair(rng);
    const auto r = vision::rectify(pair);
    REQUIRE(r.ok());
    const Eye eye = chance(rng, 0.5) ? Eye::left : Eye::right;
    const auto& raw = r->raw(eye);
    const Eigen::Vector2d pixel{uniform(rng, 0, raw.width_px - 1), uniform(rng, 0, raw.height_px - 1)};
    const auto there = r->rectified(eye, pixel);
    REQUIRE(there.ok());
    const auto back = r->raw_of(eye, *there);
    REQUIRE(back.ok());
    CHECK((*back - pixel).norm() < 1e-8);
    StereoCalibration<float> single;
    single.eyes = {pair.eyes[0].cast<float>(), pair.eyes[1].cast<float>()};
    single.R_c1_c0 = pair.R_c1_c0.cast<float>(), single.t_c1_c0_m = pair.t_c1_c0_m.cast<float>();
    single.R_b_c0 = pair.R_b_c0.cast<float>(), single.p_b_c0_m = pair.p_b_c0_m.cast<float>();
    const auto rf = vision::rectify(single);
    REQUIRE(rf.ok());
    const auto there_f = rf->rectified(eye, pixel.cast<float>());
    REQUIRE(there_f.ok());
    CHECK((there_f->cast<double>() - *there).norm() < 0.05);
  });
}

TEST_CASE("the rotations are rotations, turn each camera little, and a pair that is rectified already stays as it is") {
  for_all_seeds(50, [](Rng& rng) {
    const auto r = vision::rectify(random_pair(rng));
    REQUIRE(r.ok());
    for (const Eye eye : {Eye::left, Eye::right}) {
      CHECK(vision::detail::is_rotation(r->rotation(eye)));
      CHECK(so3::log(r->rotation(eye)).norm() < 0.2);
    }
  });
  StereoCalibration<double> plain;
  plain.eyes[0] = plain.eyes[1] = {640, 480, 500, 500, 319.5, 239.5, {}};
  plain.t_c1_c0_m = {-0.2, 0, 0};
  const auto r = vision::rectify(plain);
  REQUIRE(r.ok());
  CHECK(r->rotation(Eye::left).isIdentity(1e-12));
  CHECK(r->rotation(Eye::right).isIdentity(1e-12));
  CHECK((*r->rectified(Eye::right, {100, 200}) - Eigen::Vector2d{100, 200}).norm() < 1e-9);
  CHECK(r->camera().baseline_m == doctest::Approx(0.2));
}

TEST_CASE("a row of the remap table says what the map says, and marks what has no source") {
  const auto r = vision::rectify(euroc_pair());
  REQUIRE(r.ok());
  const auto width = static_cast<std::size_t>(r->camera().width_px);
  std::vector<float> u(width), v(width);
  int sources = 0;
  for (const Eye eye : {Eye::left, Eye::right})
    for (int row = 0; row < 480; row += 53) {
      const auto count = r->fill_row(eye, row, u, v);
      REQUIRE(count.ok());
      int counted = 0;
      for (std::size_t i = 0; i < width; ++i) {
        const auto source = r->raw_of(eye, {static_cast<double>(i), static_cast<double>(row)});
        const bool seen = source.ok() && r->raw(eye).inside(*source);
        CHECK((u[i] >= 0) == seen);
        if (!seen) continue;
        ++counted;
        CHECK(std::abs(static_cast<double>(u[i]) - (*source)[0]) < 1e-3);
        CHECK(std::abs(static_cast<double>(v[i]) - (*source)[1]) < 1e-3);
      }
      CHECK(*count == counted);
      sources += counted;
    }
  CHECK(sources > 0.9 * 2 * 10 * 752);  // barrel distortion: a view without it, of equal focal length, lies within the raw image
  CHECK(r->fill_row(Eye::left, 480, u, v).status().code == StatusCode::invalid_argument);
  CHECK(r->fill_row(Eye::left, -1, u, v).status().code == StatusCode::invalid_argument);
  CHECK(r->fill_row(Eye::left, 0, std::span<float>{u}.first(5), v).status().code == StatusCode::invalid_argument);
}

TEST_CASE("a real calibration: EuRoC's pair") {
  const auto r = vision::rectify(euroc_pair());
  REQUIRE(r.ok());
  CHECK(r->camera().baseline_m == doctest::Approx(0.110074).epsilon(1e-5));
  CHECK(r->camera().fx_px == doctest::Approx(457.418).epsilon(1e-4));
  CHECK(so3::log(r->rotation(Eye::left)).norm() < 0.02);
  CHECK(check(r->camera()).ok());
}

TEST_CASE("pairs that cannot be rectified are refused with what is wrong") {
  const StereoCalibration<double> good = euroc_pair();
  const auto status = [&](auto spoil) {
    StereoCalibration<double> pair = good;
    spoil(pair);
    return vision::rectify(pair).status();
  };
  const auto refused = [&](auto spoil) { return status(spoil).code == StatusCode::invalid_argument; };
  CHECK(status([](auto& p) { p.eyes[1].fx_px = 0; }).index == 1);
  CHECK(refused([](auto& p) { p.eyes[1].width_px = 760; }));
  CHECK(refused([](auto& p) { p.R_c1_c0 *= 1.1; }));
  CHECK(refused([](auto& p) { p.t_c1_c0_m.setZero(); }));
  CHECK(refused([](auto& p) { p.t_c1_c0_m *= -1; }));           // left and right swapped
  CHECK(refused([](auto& p) { p.t_c1_c0_m = {0, -0.1, 0}; }));  // one above the other
  CHECK(refused([](auto& p) { p.t_c1_c0_m[0] = std::nan(""); }));
  CHECK(refused([](auto& p) { p.R_c1_c0 = so3::exp(Eigen::Vector3d{0, 1.2, 0}); }));  // squinting
  CHECK(vision::rectify(good, {-1, 0.1}).status().code == StatusCode::invalid_argument);
  CHECK(vision::rectify(good, {1, 0}).status().code == StatusCode::invalid_argument);
}
