// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The learned noise scale finds the true one, whatever was assumed, with parameters estimated and outliers among the residuals.
#include <doctest/doctest.h>

#include <array>
#include <cmath>

#include <searvins/estimator/noise_scale.hpp>

#include "support/property.hpp"

namespace {

using searvins::estimator::NoiseAdaptation;
using searvins::estimator::NoiseScale;
using searvins::test::Rng;

constexpr std::size_t kRows = 64;

/// One epoch of `rows` residuals of a mean (one parameter) with standard deviation `sigma`, whitened by the scale's own belief; the first few reflected.
void feed(NoiseScale<kRows>& scale, Rng& rng, int rows, double sigma, int outliers, const NoiseAdaptation& options) {
  std::array<double, kRows> x{};
  double mean = 0;
  for (int i = 0; i < rows; ++i) {
    x[static_cast<std::size_t>(i)] = sigma * searvins::test::normal(rng);
    mean += x[static_cast<std::size_t>(i)] / rows;
  }
  const double used = std::sqrt(scale.variance_factor());
  scale.begin();
  scale.add_parameters(1);
  for (int i = 0; i < rows; ++i) scale.add((x[static_cast<std::size_t>(i)] - mean + (i < outliers ? 50.0 : 0.0)) / used);
  scale.finish(options);
}

}  // namespace

TEST_CASE("the scale converges to the true noise from either side") {
  searvins::test::for_all_seeds(20, [](Rng& rng) {
    const double truth = searvins::test::uniform(rng, 0.4, 3.0);
    const int rows = 12 + static_cast<int>(searvins::test::uniform(rng, 0, 30));
    const NoiseAdaptation options{true, 0.1, 10, 200};
    NoiseScale<kRows> scale;
    for (int epoch = 0; epoch < 400; ++epoch) feed(scale, rng, rows, truth, 0, options);
    // The median of few squares lies a little high: up to 8 % of sigma at 12 rows.
    CHECK(std::sqrt(scale.variance_factor()) > 0.92 * truth);
    CHECK(std::sqrt(scale.variance_factor()) < 1.15 * truth);
  });
}

TEST_CASE("a quarter of reflected signals moves the scale by less than half") {
  searvins::test::for_all_seeds(20, [](Rng& rng) {
    const NoiseAdaptation options{true, 0.1, 10, 200};
    NoiseScale<kRows> scale;
    for (int epoch = 0; epoch < 200; ++epoch) feed(scale, rng, 32, 1, 8, options);
    CHECK(std::sqrt(scale.variance_factor()) < 1.6);
    CHECK(std::sqrt(scale.variance_factor()) > 1.0);
  });
}

TEST_CASE("bounds hold, and an epoch without redundancy or a switched-off scale changes nothing") {
  Rng rng{3};
  NoiseScale<kRows> scale;
  for (int epoch = 0; epoch < 50; ++epoch) feed(scale, rng, 20, 30, 0, {true, 0.5, 2, 30});
  CHECK(scale.variance_factor() == doctest::Approx(4));
  for (int epoch = 0; epoch < 300; ++epoch) feed(scale, rng, 20, 0.01, 0, {true, 0.5, 2, 30});
  CHECK(scale.variance_factor() == doctest::Approx(0.25).epsilon(1e-3));
  const double before = scale.variance_factor();
  feed(scale, rng, 4, 5, 0, {true, 0.5, 2, 30});
  feed(scale, rng, 20, 5, 0, {false, 0.5, 2, 30});
  CHECK(scale.variance_factor() == before);
}

TEST_CASE("the first epoch counts fully") {
  Rng rng{5};
  NoiseScale<kRows> scale;
  feed(scale, rng, 60, 2, 0, {true, 0.1, 10, 30});
  CHECK(std::sqrt(scale.variance_factor()) > 1.4);
}
