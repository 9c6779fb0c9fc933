// SPDX-License-Identifier: BSD-3-Clause
// The landmark variable and its weak prior.
#include <searvins/vision/landmark.hpp>

#include <cmath>
#include <limits>

#include "support/factor_values.hpp"
#include "support/property.hpp"

using namespace searvins;
using namespace searvins::test;
using vision::Landmark;
using vision::LandmarkPriorFactor;

TEST_CASE("a landmark is a vector space") {
  for_all_seeds(50, [](Rng& rng) {
    const Landmark a{random_vector<3>(rng, 100)}, b{random_vector<3>(rng, 100)};
    CHECK(close(a.retract(a.local(b)).p_w_m, b.p_w_m, 1e-14));
  });
  CHECK(Landmark::role == smoother::Role::local);
  CHECK(std::string{Landmark::axis_name(2)} == "up");
  CHECK(std::string{Landmark::axis_name(3)} == "?");
}

TEST_CASE("the prior: one sigma off is a row of one, and the Jacobian is the weight") {
  for_all_seeds(50, [](Rng& rng) {
    FactorValuesOf<Landmark> values;
    const Eigen::Vector3d mean = random_vector<3>(rng, 100);
    const double sigma = uniform(rng, 0.1, 100);
    const auto key = values.add(Landmark{mean + sigma * Eigen::Vector3d::UnitY()});
    const auto f = LandmarkPriorFactor::make(key, mean, sigma);
    REQUIRE(f.ok());
    double e[3]{}, w[3]{}, plain[3]{};
    Eigen::Matrix3d J = Eigen::Matrix3d::Zero();
    f->linearise(values, e, {J.data(), 3});
    f->evaluate(values, plain);
    CHECK((Eigen::Map<Eigen::Vector3d>(e) - Eigen::Vector3d::UnitY()).norm() < 1e-10);
    CHECK(Eigen::Map<Eigen::Vector3d>(e) == Eigen::Map<Eigen::Vector3d>(plain));
    CHECK(J.isApprox(Eigen::Matrix3d::Identity() / sigma, 1e-15));
    CHECK(f->weigh(e, w) == doctest::Approx(0.5));
    CHECK(w[0] == 1);
  });
}

TEST_CASE("the default is 30 m; a sigma or a mean that is none is refused") {
  const smoother::Key<Landmark> key{0, 1};
  CHECK(1 / LandmarkPriorFactor::make(key, {1, 2, 3})->weight_1pm == doctest::Approx(30));
  const double nan = std::nan(""), infinity = std::numeric_limits<double>::infinity();
  for (const double sigma : {0.0, -1.0, nan, infinity, 1e-320})
    CHECK(LandmarkPriorFactor::make(key, {1, 2, 3}, sigma).status().code == StatusCode::invalid_argument);
  CHECK(LandmarkPriorFactor::make(key, {1, nan, 3}).status().code == StatusCode::non_finite);
}
