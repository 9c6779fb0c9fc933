// SPDX-License-Identifier: BSD-3-Clause
// Success rates: against figures known in closed form, Monte Carlo rounding, and the exact case of one ambiguity.
#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

#include <searvins/ambiguity/success_rate.hpp>

#include "support/property.hpp"

using namespace searvins::ambiguity;
using namespace searvins::test;

TEST_CASE("bootstrapped success rate: known orders of magnitude") {
  // Ten ambiguities of 0.06 cycles^2 give about 0.66, of 0.03 about 0.96.
  const std::vector<double> coarse(10, 0.06), fine(10, 0.03);
  CHECK(bootstrapped_success_rate(coarse.data(), 10) == doctest::Approx(0.66).epsilon(0.01));
  CHECK(bootstrapped_success_rate(fine.data(), 10) == doctest::Approx(0.96).epsilon(0.01));
  const double one_sigma = 0.25;  // half a cycle is one sigma
  CHECK(bootstrapped_success_rate(&one_sigma, 1) == doctest::Approx(0.682689492137086).epsilon(1e-12));
}

TEST_CASE_TEMPLATE("bootstrapped success rate: no digits are lost at either end", S, double, float) {
  const S tiny = S(1e-3);  // 1 - P = erfc(11.2), about 2e-56
  CHECK(bootstrapped_success_rate(&tiny, 1) == 1);
  if constexpr (std::numeric_limits<S>::digits > 50) {
    CHECK(bootstrapped_failure_rate(&tiny, 1) == doctest::Approx(std::erfc(1 / (2 * std::sqrt(2e-3)))).epsilon(1e-12));
    CHECK(bootstrapped_failure_rate(&tiny, 1) > 0);
  }

  // Poor ambiguities: erf(x) tends to 2 x / sqrt(pi), and eighty of them underflow as a product but not as a logarithm.
  const std::vector<S> poor(80, S(1e12));
  const double each = std::log(2 / std::sqrt(M_PI) / (2 * std::sqrt(2e12)));
  CHECK(static_cast<double>(log_bootstrapped_success_rate(poor.data(), 80)) == doctest::Approx(80 * each).epsilon(1e-5));

  // Both branches of the term agree where they meet, x = 1/2 or d = 1/2.
  const S below = S(0.5) * (1 - 4 * std::numeric_limits<S>::epsilon()), above = S(0.5) * (1 + 4 * std::numeric_limits<S>::epsilon());
  CHECK(std::abs(log_bootstrapped_success_rate(&below, 1) - log_bootstrapped_success_rate(&above, 1)) <
        20 * std::numeric_limits<S>::epsilon());
}

TEST_CASE("bootstrapped success rate: it is the frequency with which sequential rounding succeeds") {
  for_all_seeds(5, [](Rng& rng) {
    const int n = integer(rng, 1, 5);
    std::vector<double> d(static_cast<std::size_t>(n));
    for (double& v : d) v = uniform(rng, 0.02, 0.3);
    const double p = bootstrapped_success_rate(d.data(), n);
    const int trials = 20000;
    int hits = 0;
    for (int t = 0; t < trials; ++t) {
      bool hit = true;
      for (const double v : d) hit &= std::abs(normal(rng, std::sqrt(v))) < 0.5;  // conditional errors are independent
      hits += hit;
    }
    CHECK(std::abs(hits / double(trials) - p) < 5 * std::sqrt(p * (1 - p) / trials) + 1e-3);
  });
}

TEST_CASE("bootstrapped success rate: falls with every variance and with every further ambiguity, and is their product") {
  for_all_seeds(200, [](Rng& rng) {
    const int n = integer(rng, 1, 20);
    std::vector<double> d(static_cast<std::size_t>(n));
    for (double& v : d) v = std::exp(uniform(rng, -5, 2));
    double product = 1;
    for (const double& v : d) product *= bootstrapped_success_rate(&v, 1);
    const double p = bootstrapped_success_rate(d.data(), n);
    CHECK(p == doctest::Approx(product).epsilon(1e-10));
    CHECK(bootstrapped_success_rate(d.data(), n - 1) >= p);
    CHECK(bootstrapped_failure_rate(d.data(), n) == doctest::Approx(1 - p).epsilon(1e-9));
    d[static_cast<std::size_t>(integer(rng, 0, n - 1))] *= 1.5;
    CHECK(bootstrapped_success_rate(d.data(), n) <= p);
  });
}

TEST_CASE("bootstrapped success rate: nothing to fix is certain, a worthless variance never is") {
  CHECK(bootstrapped_success_rate<double>(nullptr, 0) == 1.0);
  for (const double bad : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
    const std::array<double, 2> d{0.01, bad};
    CHECK(bootstrapped_success_rate(d.data(), 2) == 0.0);
    CHECK(std::isnan(ambiguity_dilution_of_precision(d.data(), 2)));
  }
  const double endless = std::numeric_limits<double>::infinity();
  CHECK(bootstrapped_success_rate(&endless, 1) == 0.0);
}

TEST_CASE("ratio of norms: its corner cases") {
  CHECK(ratio_of_norms(2.0, 5.0) == 2.5);
  CHECK(ratio_of_norms(0.0, 5.0) == std::numeric_limits<double>::infinity());
  CHECK(ratio_of_norms(0.0, 0.0) == 1.0);
}

TEST_CASE("ADOP: the geometric mean of the conditional standard deviations") {
  const std::array<double, 3> d{0.01, 0.04, 0.16};
  CHECK(ambiguity_dilution_of_precision(d.data(), 3) == doctest::Approx(0.2).epsilon(1e-12));
  CHECK(std::isnan(ambiguity_dilution_of_precision(d.data(), 0)));
}

TEST_CASE("upper bound from ADOP: exact for one ambiguity, textbook chi-square values for more") {
  for (const double sigma : {0.05, 0.2, 0.5, 2.0}) {
    const double d = sigma * sigma;
    CHECK(integer_least_squares_success_bound(sigma, 1) == doctest::Approx(bootstrapped_success_rate(&d, 1)).epsilon(1e-12));
  }
  // P(chi^2_n <= x) tables, with the ADOP that makes c_n / ADOP^2 = x. c_2 = 1/pi, c_3 = (3 sqrt(pi)/4)^(2/3) / pi, c_4 = sqrt(2)/pi.
  CHECK(integer_least_squares_success_bound(std::sqrt(1 / M_PI / 5.991464547), 2) == doctest::Approx(0.95).epsilon(1e-8));
  CHECK(integer_least_squares_success_bound(std::sqrt(std::pow(0.75 * std::sqrt(M_PI), 2.0 / 3) / M_PI / 7.814727903), 3) ==
        doctest::Approx(0.95).epsilon(1e-8));
  CHECK(integer_least_squares_success_bound(std::sqrt(std::sqrt(2) / M_PI / 9.487729037), 4) == doctest::Approx(0.95).epsilon(1e-8));
  CHECK(std::isnan(integer_least_squares_success_bound(0.0, 3)));
  CHECK(std::isnan(integer_least_squares_success_bound(0.1, 0)));
}

TEST_CASE("upper bound from ADOP: never below the bootstrapped rate, within [0, 1], falling with ADOP") {
  for_all_seeds(300, [](Rng& rng) {
    const int n = integer(rng, 1, 80);
    std::vector<double> d(static_cast<std::size_t>(n));
    for (double& v : d) v = std::exp(uniform(rng, -8, 0));
    const double adop = ambiguity_dilution_of_precision(d.data(), n), bound = integer_least_squares_success_bound(adop, n);
    CHECK(bound >= bootstrapped_success_rate(d.data(), n) - 1e-12);
    CHECK((bound >= 0 && bound <= 1));
    CHECK(integer_least_squares_success_bound(1.1 * adop, n) <= bound);
  });
}
