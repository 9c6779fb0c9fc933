// SPDX-License-Identifier: BSD-3-Clause
// Probabilities against 40-digit references (mpmath), then round trips, monotonicity and the seams between series and sum.
#include <doctest/doctest.h>

#include <cmath>
#include <limits>

#include <searvins/math/quantiles.hpp>

#include "support/property.hpp"

namespace math = searvins::math;
using searvins::StatusCode;

namespace {

/// |a - b| <= tolerance |b|: doctest's Approx also forgives absolute errors, which hides a wrong tail.
bool relatively(double a, double b, double tolerance) { return std::abs(a - b) <= tolerance * std::abs(b); }

}  // namespace

TEST_CASE("normal distribution: reference values in both tails") {
  struct Row {
    double x, cdf;
  };
  const Row rows[] = {{-30, 4.90671392714818706e-198}, {-8, 6.22096057427178412e-16}, {-3, 0.00134989803163009453},
                      {-1, 0.158655253931457051},      {-0.5, 0.308537538725986896},  {0, 0.5},
                      {0.5, 0.691462461274013104},     {1, 0.841344746068542949},     {2, 0.977249868051820793},
                      {3, 0.998650101968369905},       {6, 0.999999999013412355}};
  for (const Row& row : rows) {
    CAPTURE(row.x);
    CHECK(relatively(math::normal_cdf(row.x), row.cdf, 2e-13));
  }
}

TEST_CASE("normal quantile: reference values to 1e-14, both tails") {
  struct Row {
    double probability, x;
  };
  const Row rows[] = {{1e-100, -21.2734535609653243}, {1e-20, -9.26234008979840757}, {1e-6, -4.75342430882289895},
                      {0.001, -3.09023230616781354},  {0.025, -1.95996398454005424}, {0.05, -1.64485362695147271},
                      {0.1, -1.28155156554460047},    {0.25, -0.674489750196081743}, {0.4, -0.253347103135799799}};
  for (const Row& row : rows) {
    CAPTURE(row.probability);
    CHECK(relatively(math::normal_quantile(row.probability).value(), row.x, 1e-14));
    if (row.probability > 1e-4) CHECK(relatively(math::normal_quantile(1 - row.probability).value(), -row.x, 1e-13));
  }
  CHECK(math::normal_quantile(0.5).value() == doctest::Approx(0).epsilon(1e-15));
}

TEST_CASE("normal quantile: inverse of the cdf over the whole range, odd about one half, increasing") {
  searvins::test::for_all_seeds(2000, [](searvins::test::Rng& rng) {
    const double tail = std::pow(10.0, searvins::test::uniform(rng, -100, std::log10(0.5)));
    const double x = math::normal_quantile(tail).value();
    CHECK(relatively(math::normal_cdf(x), tail, 1e-13 * (1 + x * x)));  // d log Phi / d log x is about x^2
    const double p = searvins::test::uniform(rng, 1e-6, 1 - 1e-6);
    CHECK(math::normal_quantile(p).value() == doctest::Approx(-math::normal_quantile(1 - p).value()).epsilon(1e-9));
    CHECK(math::normal_quantile(p).value() < math::normal_quantile(p + 1e-7).value());
  });
}

TEST_CASE("two-sided probability: small, middle and large arguments keep their relative precision") {
  struct Row {
    double x, log_probability;
  };
  const Row rows[] = {{1e-8, -18.6464720965970929},    {0.01, -4.83097820518837471}, {0.5, -0.959916333695622319},
                      {1, -0.381715146302126072},      {2, -0.0465679122923901635},  {5, -5.73303308096697955e-7},
                      {8.5, -1.89590696444066369e-17}, {12, -3.552964224155358e-33}, {30, -9.81342785429637412e-198}};
  for (const Row& row : rows) {
    CAPTURE(row.x);
    CHECK(relatively(math::log_two_sided_probability(row.x), row.log_probability, 2e-13));
  }
  CHECK(relatively(math::two_sided_probability(1e-200), 1e-200 * std::sqrt(2 / 3.141592653589793), 1e-15));
  CHECK(math::log_two_sided_probability(0) == -std::numeric_limits<double>::infinity());
  CHECK(std::isnan(math::log_two_sided_probability(-0.1)));
  CHECK(relatively(math::log_two_sided_probability(std::nextafter(1.0, 0.0)), math::log_two_sided_probability(1.0), 1e-14));
  searvins::test::for_all_seeds(1000, [](searvins::test::Rng& rng) {
    const double x = searvins::test::uniform(rng, 0, 6);
    CHECK(math::two_sided_probability(x) == doctest::Approx(2 * math::normal_cdf(x) - 1).epsilon(1e-14));
    CHECK(math::two_sided_probability(x) + math::two_sided_exceedance(x) == doctest::Approx(1).epsilon(1e-15));
    CHECK(std::exp(math::log_two_sided_probability(x)) == doctest::Approx(math::two_sided_probability(x)).epsilon(1e-14));
  });
}

TEST_CASE("chi-square: reference values of both tails") {
  struct Row {
    double x;
    int dof;
    double below, above;
  };
  const Row rows[] = {{0.5, 1, 0.520499877813046538, 0.479500122186953462},
                      {3, 1, 0.916735483336449598, 0.0832645166635504019},
                      {1e-6, 3, 2.65961440479179953e-10, 0.99999999973403856},
                      {7.8, 3, 0.949668902140146649, 0.0503310978598533506},
                      {16, 3, 0.998866015710214677, 0.00113398428978532266},
                      {9, 4, 0.938900519039667314, 0.0610994809603326857},
                      {100, 5, 1.0, 5.28514836094324006e-20},
                      {40, 50, 0.156772621826237726, 0.843227378173762274},
                      {60, 50, 0.842757972761608396, 0.157242027238391604},
                      {100, 99, 0.547041488679068627, 0.452958511320931373},
                      {30, 100, 9.05612554314813711e-13, 0.999999999999094387},
                      {150, 200, 0.00335244149818699189, 0.996647558501813008},
                      {200, 200, 0.513298798279148665, 0.486701201720851335},
                      {201, 200, 0.533171386247446612, 0.466828613752553388},
                      {300, 200, 0.999994075459664516, 5.92454033548391583e-6},
                      {1000, 200, 1.0, 1.50087941192508943e-106}};
  for (const Row& row : rows) {
    CAPTURE(row.x);
    CAPTURE(row.dof);
    CHECK(relatively(math::chi_square_cdf(row.x, row.dof).value(), row.below, 1e-13));
    CHECK(relatively(math::chi_square_exceedance(row.x, row.dof).value(), row.above, 1e-13));
  }
}

TEST_CASE("chi-square quantile: reference values") {
  struct Row {
    double probability;
    int dof;
    double x;
  };
  const Row rows[] = {{0.95, 1, 3.84145882069412596},     {0.95, 3, 7.81472790325117996},      {0.99, 2, 9.21034037197618274},
                      {0.999, 3, 16.2662361962381309},    {0.999, 1, 10.8275661706627323},     {0.5, 10, 9.34181776559196744},
                      {0.05, 10, 3.94029913611906003},    {0.95, 30, 43.772971825742188},      {0.99, 100, 135.806723171026781},
                      {0.01, 100, 70.0648949253997993},   {0.95, 200, 233.994268892324934},    {0.001, 200, 143.842794990000814},
                      {1e-6, 1, 1.57079632679571909e-12}, {1e-10, 1, 1.57079632679489662e-20}, {0.1, 1, 0.0157907740934312249},
                      {1e-20, 4, 2.82842712487952343e-10}};
  for (const Row& row : rows) {
    CAPTURE(row.probability);
    CAPTURE(row.dof);
    CHECK(relatively(math::chi_square_quantile(row.probability, row.dof).value(), row.x, 1e-13));
  }
  CHECK(relatively(math::chi_square_threshold(1e-7, 3).value(), 35.4057515799372666, 1e-13));
  CHECK(relatively(math::chi_square_threshold(1e-12, 1).value(), 50.8441279118181555, 1e-13));
  CHECK(relatively(math::chi_square_threshold(1e-30, 50).value(), 263.215996102420666, 1e-13));
  CHECK(relatively(math::chi_square_threshold(1e-3, 6).value(), 22.4577444848253253, 1e-13));
}

TEST_CASE("chi-square quantile: round trip in both tails for every degree of freedom") {
  searvins::test::for_all_seeds(10, [](searvins::test::Rng& rng) {
    for (int dof = 1; dof <= math::kMaxChiSquareDof; ++dof) {
      CAPTURE(dof);
      const double tail = std::pow(10.0, searvins::test::uniform(rng, -100, 0));
      CAPTURE(tail);
      const auto low = math::chi_square_quantile(tail, dof);
      const auto high = math::chi_square_threshold(tail, dof);
      REQUIRE(low.ok());
      REQUIRE(high.ok());
      CHECK(relatively(math::chi_square_cdf(*low, dof).value(), tail, 1e-11));
      CHECK(relatively(math::chi_square_exceedance(*high, dof).value(), tail, 1e-11));
    }
  });
}

TEST_CASE("chi-square: the tails add up to one, grow with x, shrink with the degrees of freedom, and meet at the seam y = a") {
  searvins::test::for_all_seeds(1000, [](searvins::test::Rng& rng) {
    const int dof = searvins::test::integer(rng, 1, 199);
    CAPTURE(dof);
    const double x = dof * std::pow(10.0, searvins::test::uniform(rng, -2, 0.5));
    CAPTURE(x);
    const double below = math::chi_square_cdf(x, dof).value();
    CHECK(below + math::chi_square_exceedance(x, dof).value() == doctest::Approx(1).epsilon(1e-15));
    CHECK(below <= math::chi_square_cdf(x * 1.001, dof).value());
    CHECK(below >= math::chi_square_cdf(x, dof + 1).value());
    const double seam = dof, before = std::nextafter(seam, 0.0);
    CHECK(relatively(math::chi_square_cdf(before, dof).value(), math::chi_square_cdf(seam, dof).value(), 1e-13));
    CHECK(relatively(math::chi_square_exceedance(before, dof).value(), math::chi_square_exceedance(seam, dof).value(), 1e-13));
  });
}

TEST_CASE("chi-square with 1 and 2 degrees of freedom has closed forms") {
  searvins::test::for_all_seeds(500, [](searvins::test::Rng& rng) {
    const double x = std::pow(10.0, searvins::test::uniform(rng, -8, 2.5));
    CHECK(relatively(math::chi_square_cdf(x, 1).value(), math::two_sided_probability(std::sqrt(x)), 1e-13));
    CHECK(relatively(math::chi_square_exceedance(x, 1).value(), math::two_sided_exceedance(std::sqrt(x)), 1e-12));
    CHECK(relatively(math::chi_square_cdf(x, 2).value(), -std::expm1(-x / 2), 1e-13));
  });
}

TEST_CASE("quantiles refuse what has no answer") {
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  for (const double p : {0.0, 1.0, -0.1, 1.1, nan, inf, -inf, 1e-101}) {
    CAPTURE(p);
    CHECK(math::normal_quantile(p).status().code == StatusCode::invalid_argument);
    CHECK_FALSE(math::chi_square_quantile(p, 3).ok());
    CHECK_FALSE(math::chi_square_threshold(p, 3).ok());
  }
  CHECK(math::chi_square_quantile(nan, 3).status().code == StatusCode::non_finite);
  for (const int dof : {0, -1, 201, std::numeric_limits<int>::min(), std::numeric_limits<int>::max()}) {
    CHECK(math::chi_square_cdf(1, dof).status().code == StatusCode::invalid_argument);
    CHECK(math::chi_square_exceedance(1, dof).status().index == dof);
    CHECK_FALSE(math::chi_square_quantile(0.5, dof).ok());
    CHECK_FALSE(math::chi_square_threshold(0.5, dof).ok());
  }
  CHECK(math::chi_square_cdf(nan, 3).status().code == StatusCode::non_finite);
  CHECK(math::chi_square_cdf(-1, 3).value() == 0);
  CHECK(math::chi_square_exceedance(0, 3).value() == 1);
  CHECK(math::chi_square_cdf(inf, 3).value() == 1);
  CHECK(math::chi_square_exceedance(1e300, 200).value() == 0);
  CHECK(math::chi_square_cdf(std::numeric_limits<double>::denorm_min(), 7).value() >= 0);
}
