// SPDX-License-Identifier: BSD-3-Clause
// The correction of a camera's clock and axes as a variable, its prior and its walk.
#include <searvins/vision/camera_correction.hpp>

#include <cmath>
#include <string>

#include "support/factor_values.hpp"
#include "support/property.hpp"

using namespace searvins;
using namespace searvins::test;
using vision::CameraCorrection;
using vision::CameraCorrectionOptions;
using vision::CameraCorrectionPriorFactor;
using vision::CameraCorrectionWalk;

namespace {

CameraCorrection random_correction(Rng& rng, double turn_rad = 1.5) { return {uniform(rng, -0.05, 0.05), so3::exp(random_vector<3>(rng, turn_rad))}; }

/// Largest difference between the analytic and the numeric Jacobian by the listed variables, against the largest entry.
template <int Columns, class F, class Keys>
double jacobian_error(const F& f, FactorValuesOf<CameraCorrection>& values, const Keys& keys) {
  constexpr double step = 1e-6;
  Eigen::Matrix<double, 4, Columns> J = Eigen::Matrix<double, 4, Columns>::Zero(), numeric = J;
  double e[4]{}, plus[4]{}, minus[4]{};
  f.linearise(values, e, {J.data(), 4});
  int column = 0;
  for (const auto& key : keys)
    for (int i = 0; i < 4; ++i, ++column) {
      const CameraCorrection before = values.at(key);
      const CameraCorrection::Step d = step * CameraCorrection::Step::Unit(i);
      values.at(key) = before.retract(d), f.evaluate(values, plus);
      values.at(key) = before.retract(-d), f.evaluate(values, minus);
      values.at(key) = before;
      numeric.col(column) = (Eigen::Map<Eigen::Vector4d>(plus) - Eigen::Map<Eigen::Vector4d>(minus)) / (2 * step);
    }
  double plain[4]{};
  f.evaluate(values, plain);
  CHECK((Eigen::Map<Eigen::Vector4d>(plain) - Eigen::Map<Eigen::Vector4d>(e)).norm() <= 1e-12 * (1 + Eigen::Map<Eigen::Vector4d>(e).norm()));
  return (J - numeric).cwiseAbs().maxCoeff() / J.cwiseAbs().maxCoeff();
}

}  // namespace

TEST_CASE("a correction is a number and a rotation: (+) undoes (-), on the right") {
  for_all_seeds(100, [](Rng& rng) {
    const CameraCorrection a = random_correction(rng), b = random_correction(rng);
    const CameraCorrection c = a.retract(a.local(b));
    CHECK(c.time_offset_s == doctest::Approx(b.time_offset_s));
    CHECK(close(c.R_nc, b.R_nc, 1e-12));
    const Eigen::Vector3d turn = random_vector<3>(rng, 0.5);
    CameraCorrection::Step d;
    d << 0.01, turn;
    CHECK(close(a.retract(d).R_nc, a.R_nc * so3::exp(turn), 1e-13));
    CHECK(close(CameraCorrection{}.retract(d).boresight_rad(), turn, 1e-12));
  });
  CHECK(CameraCorrection::role == smoother::Role::chain);
  CHECK(std::string{CameraCorrection::axis_name(0)} == "time offset");
  CHECK(std::string{CameraCorrection::axis_name(4)} == "?");
}

TEST_CASE("the prior: Mahalanobis length, Jacobian, refusals") {
  for_all_seeds(100, [](Rng& rng) {
    FactorValuesOf<CameraCorrection> values;
    const CameraCorrection mean = random_correction(rng);
    const Eigen::Matrix4d P = 1e-4 * random_spd(rng, 4, 50);
    CameraCorrection::Step off;
    off << uniform(rng, -0.02, 0.02), random_vector<3>(rng, 0.6);
    const auto key = values.add(mean.retract(off));
    const auto f = CameraCorrectionPriorFactor::make(key, mean, P);
    REQUIRE(f.ok());
    double e[4]{}, w[4]{};
    f->evaluate(values, e);
    CHECK(2 * f->weigh(e, w) == doctest::Approx(off.dot(P.inverse() * off)).epsilon(1e-6));
    CHECK(jacobian_error<4>(*f, values, std::array{key}) < 1e-6);
  });
  CHECK(CameraCorrectionPriorFactor::make({0, 1}, {}, Eigen::Matrix4d::Zero()).status().code == StatusCode::not_positive_definite);
  CHECK(CameraCorrectionPriorFactor::make({0, 1}, {}, Eigen::Matrix4d::Constant(std::nan(""))).status().code == StatusCode::not_positive_definite);
}

TEST_CASE("the walk: a step of one sigma is a row of one, sigma grows with the root of time; Jacobian, refusals") {
  for_all_seeds(100, [](Rng& rng) {
    FactorValuesOf<CameraCorrection> values;
    const CameraCorrection a = random_correction(rng);
    CameraCorrectionOptions options;
    options.offset_walk_s_sqrt_s = uniform(rng, 1e-5, 1e-3), options.boresight_walk_rad_sqrt_s = uniform(rng, 1e-4, 1e-2);
    const double duration_s = uniform(rng, 1, 100), root = std::sqrt(duration_s);
    CameraCorrection::Step sigma;
    sigma << options.offset_walk_s_sqrt_s * root, 0, options.boresight_walk_rad_sqrt_s * root, 0;
    const auto from = values.add(a), to = values.add(a.retract(sigma));
    const auto f = CameraCorrectionWalk::make(from, to, options, duration_s);
    REQUIRE(f.ok());
    double e[4]{};
    f->evaluate(values, e);
    CHECK(close(Eigen::Vector4d{Eigen::Map<Eigen::Vector4d>(e)}, Eigen::Vector4d{1, 0, 1, 0}, 1e-8));
    CHECK(close(Eigen::Vector4d{vision::walk_covariance(options, duration_s).diagonal().cwiseSqrt()}.cwiseProduct(Eigen::Vector4d{1, 0, 1, 0}), sigma, 1e-12));
    values.at(to) = random_correction(rng, 0.4);
    values.at(from).R_nc = so3::exp(random_vector<3>(rng, 0.4));
    CHECK(jacobian_error<8>(*f, values, std::array{from, to}) < 1e-5);
  });
  CHECK(CameraCorrectionWalk::make({0, 1}, {1, 1}, {}, 0).status().code == StatusCode::invalid_argument);
  CHECK(CameraCorrectionWalk::make({0, 1}, {1, 1}, {}, std::nan("")).status().code == StatusCode::invalid_argument);
  CameraCorrectionOptions none;
  none.boresight_walk_rad_sqrt_s = 0;
  CHECK(CameraCorrectionWalk::make({0, 1}, {1, 1}, none, 1).status().code == StatusCode::invalid_argument);
}
