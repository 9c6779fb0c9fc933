// SPDX-License-Identifier: BSD-3-Clause
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <type_traits>
#include <utility>

#include "searvins/robust/loss.hpp"
#include "support/property.hpp"

using namespace searvins::robust;
using searvins::test::chance;
using searvins::test::for_all_seeds;
using searvins::test::Rng;
using searvins::test::uniform;

namespace {

/// Calls body(loss, same loss in long double, z of its seam or scale) for every loss, its constant multiplied by `factor`.
template <class S, class Body>
void for_each_loss(double factor, Body body) {
  const auto s = [&](double v) { return static_cast<S>(v * factor); };
  const auto wide = [&](double v) { return static_cast<long double>(static_cast<S>(v * factor)); };
  body(Gaussian<S>{}, Gaussian<long double>{}, 1.0);
  body(Huber<S>{s(1.345)}, Huber<long double>{wide(1.345)}, 1.345 * factor);
  body(Dcs<S>{s(1.5)}, Dcs<long double>{wide(1.5)}, std::sqrt(1.5 * factor));
  body(Cauchy<S>{s(2.3849)}, Cauchy<long double>{wide(2.3849)}, 2.3849 * factor);
  body(GemanMcClure<S>{s(3.7874)}, GemanMcClure<long double>{wide(3.7874)}, 3.7874 * factor);
  body(Tukey<S>{s(4.6851)}, Tukey<long double>{wide(4.6851)}, 4.6851 * factor);
}

template <class L>
long double slope_by_differences(const L& loss, long double z) {
  const long double h = 1e-5L * z;
  return (loss.rho((z + h) * (z + h)) - loss.rho((z - h) * (z - h))) / (2 * h);
}

/// Asymptotic efficiency at the Gaussian of the estimate with weight w: (E psi')^2 / E psi^2, psi = z w, E psi' = E z psi (Stein).
template <class L>
double efficiency(const L& loss) {
  double slope = 0, power = 0;
  const int n = 20000;
  const double h = 20.0 / n;
  for (int i = 0; i < n; ++i) {
    const double z = (i + 0.5) * h, density = std::exp(-z * z / 2), w = loss.weight(z * z);
    slope += z * z * w * density;
    power += z * z * w * w * density;
  }
  return slope * slope / power * h * std::sqrt(2 / std::numbers::pi);
}

}  // namespace

TEST_CASE_TEMPLATE("P6: the weight of a loss is rho'(z)/z, also at the seams and for constants other than the default", S, float, double) {
  const double epsilon = static_cast<double>(std::numeric_limits<S>::epsilon());
  for_all_seeds(20, [&](Rng& rng) {
    const double factor = uniform(rng, 0.2, 5.0);
    for_each_loss<S>(factor, [&](const auto& loss, const auto& wide, double seam) {
      INFO(std::decay_t<decltype(loss)>::name);
      double worst = 0;
      for (int i = 0; i < 500; ++i) {  // 20 seeds x 500: 10^4 points a loss; a fifth of them within 1e-3 of the seam
        const double z = chance(rng, 0.2) ? seam * (1 + uniform(rng, -1e-3, 1e-3)) : std::pow(10.0, uniform(rng, -3.0, 3.0));
        const S z2 = static_cast<S>(z * z);
        const long double exact_z = std::sqrt(static_cast<long double>(z2));
        const long double numeric = slope_by_differences(wide, exact_z) / exact_z;
        const double error = static_cast<double>(std::abs(static_cast<long double>(loss.weight(z2)) - numeric));
        // Across a seam the curvature jumps and central differences are off by up to h w' z ~ 1e-5 w; elsewhere by h^2. Relative to w,
        // so the far tails count too; the last term is for Tukey's double zero at c.
        const double floor = std::decay_t<decltype(loss)>::name == Tukey<S>::name ? 1e-8 + 20 * epsilon : 0.0;
        worst = std::max(worst, error / ((3e-5 + 20 * epsilon) * static_cast<double>(numeric) + floor + 1e-300));
      }
      CHECK(worst <= 1.0);
    });
  });
}

TEST_CASE_TEMPLATE("P6: the cost equals its long double value", S, float, double) {
  const double epsilon = static_cast<double>(std::numeric_limits<S>::epsilon());
  for_all_seeds(100, [&](Rng& rng) {
    for_each_loss<S>(uniform(rng, 0.2, 5.0), [&](const auto& loss, const auto& wide, double) {
      INFO(std::decay_t<decltype(loss)>::name);
      const S z2 = static_cast<S>(std::pow(10.0, uniform(rng, -12.0, 8.0)));
      const double exact = static_cast<double>(wide.rho(static_cast<long double>(z2)));
      CHECK(std::abs(static_cast<double>(loss.rho(z2)) - exact) <= 16 * epsilon * exact);
    });
  });
}

TEST_CASE("every loss: starts as z^2/2, grows, never exceeds it, weight falls from one, tangent quadratic majorises") {
  for_all_seeds(300, [](Rng& rng) {
    for_each_loss<double>(uniform(rng, 0.2, 5.0), [&](const auto& loss, const auto&, double seam) {
      INFO(std::decay_t<decltype(loss)>::name);
      CHECK(loss.rho(0.0) == 0.0);
      CHECK(loss.weight(0.0) == 1.0);
      const double tiny = 1e-8 * seam * seam;
      CHECK(loss.rho(tiny) == doctest::Approx(tiny / 2).epsilon(1e-7));

      double a = seam * seam * std::pow(10.0, uniform(rng, -2.0, 2.0)), b = seam * seam * std::pow(10.0, uniform(rng, -2.0, 2.0));
      if (a > b) std::swap(a, b);
      CHECK(loss.rho(a) <= loss.rho(b) * (1 + 1e-14));
      CHECK(loss.rho(b) <= b / 2 * (1 + 1e-14));
      CHECK(loss.weight(b) <= loss.weight(a));
      CHECK(loss.weight(a) <= 1.0);
      CHECK(loss.weight(b) >= 0.0);
      const double slack = 1e-12 * (a + b);
      CHECK(loss.rho(b) <= loss.rho(a) + loss.weight(a) * (b - a) / 2 + slack);
      CHECK(loss.rho(a) <= loss.rho(b) + loss.weight(b) * (a - b) / 2 + slack);
    });
  });
}

TEST_CASE_TEMPLATE("cost and weight are continuous at the seam, seen from both sides", S, float, double) {
  const S epsilon = std::numeric_limits<S>::epsilon();
  const auto check = [&](const auto& loss, S seam2) {
    INFO(std::decay_t<decltype(loss)>::name);
    const S below = seam2 * (1 - 8 * epsilon), above = seam2 * (1 + 8 * epsilon);
    CHECK(std::abs(loss.rho(above) - loss.rho(below)) <= 32 * epsilon * seam2);
    CHECK(std::abs(loss.weight(above) - loss.weight(below)) <= 64 * epsilon);
  };
  for (const S c : {S(0.3), S(1), S(1.5), S(4)}) {
    check(Huber<S>{c}, c * c);
    check(Dcs<S>{c}, c);
    check(Tukey<S>{c}, c * c);
  }
}

TEST_CASE("far away: quadratic, linear, logarithmic, or a documented ceiling; nothing overflows where z^2 is finite") {
  const double z = 1e4, far = z * z;
  CHECK(Gaussian<double>{}.rho(far) == far / 2);
  CHECK(Huber<double>{}.rho(far) == doctest::Approx(1.345 * z - 1.345 * 1.345 / 2).epsilon(1e-14));
  CHECK(Cauchy<double>{}.rho(far) == doctest::Approx(2.3849 * 2.3849 / 2 * std::log1p(far / (2.3849 * 2.3849))).epsilon(1e-14));
  CHECK(Dcs<double>{}.rho(far) == doctest::Approx(2.25).epsilon(1e-7));
  CHECK(GemanMcClure<double>{}.rho(far) == doctest::Approx(3.7874 * 3.7874 / 2).epsilon(1e-6));
  CHECK(Tukey<double>{}.rho(far) == doctest::Approx(4.6851 * 4.6851 / 6).epsilon(1e-14));
  CHECK(Tukey<double>{}.weight(far) == 0.0);
  for_each_loss<float>(1.0, [](const auto& loss, const auto&, double) {
    CHECK(std::isfinite(loss.rho(1e37F)));
    CHECK(std::isfinite(loss.weight(1e37F)));
    CHECK(std::isnan(loss.rho(std::numeric_limits<float>::quiet_NaN())));
  });
}

TEST_CASE("the default constants have the documented efficiency at the Gaussian") {
  CHECK(efficiency(Gaussian<double>{}) == doctest::Approx(1.0).epsilon(1e-6));
  CHECK(efficiency(Huber<double>{}) == doctest::Approx(0.95).epsilon(1e-4));
  CHECK(efficiency(Cauchy<double>{}) == doctest::Approx(0.95).epsilon(1e-4));
  CHECK(efficiency(GemanMcClure<double>{}) == doctest::Approx(0.95).epsilon(1e-4));
  CHECK(efficiency(Tukey<double>{}) == doctest::Approx(0.95).epsilon(1e-4));
  CHECK(efficiency(Dcs<double>{}) == doctest::Approx(0.763).epsilon(1e-3));
  CHECK(efficiency(Dcs<double>{3.6}) == doctest::Approx(0.95).epsilon(1e-3));
}

TEST_CASE("DCS: the information weight is the paper's equation, its square included") {
  for_all_seeds(200, [](Rng& rng) {
    const double c = uniform(rng, 0.1, 10.0), z2 = uniform(rng, 0.0, 100.0);
    const double inner = std::min(1.0, 2 * c / (c + z2));
    CHECK(Dcs<double>{c}.weight(z2) == doctest::Approx(inner * inner).epsilon(1e-14));
  });
}

TEST_CASE("every setting changes weight and cost") {
  const double z2 = 9.0;
  const auto differ = [&](const auto& a, const auto& b) {
    INFO(std::decay_t<decltype(a)>::name);
    CHECK(a.rho(z2) != b.rho(z2));
    CHECK(a.weight(z2) != b.weight(z2));
  };
  differ(Huber<double>{}, Huber<double>{2.0});
  differ(Dcs<double>{}, Dcs<double>{2.0});
  differ(Cauchy<double>{}, Cauchy<double>{2.0});
  differ(Tukey<double>{}, Tukey<double>{4.0});
  differ(GemanMcClure<double>{}, GemanMcClure<double>{2.0});
}
