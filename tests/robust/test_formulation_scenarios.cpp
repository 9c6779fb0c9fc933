// SPDX-License-Identifier: BSD-3-Clause
// What each formulation is for: outliers on a candidate and on the pivot, choice of the pivot, order of rows, descent, start of the latent.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>
#include <vector>

#include "linear_batch.hpp"

using namespace searvins::robust;
using namespace searvins::test;

namespace {

/// Result of iteratively reweighted least squares over (x, n).
struct Snapshot {
  VectorX<double> x;
  double cost{0};
  double worst_rise{0};  ///< largest relative rise of the cost in one iteration
};

/// From x = 0 and the robust start of n until the step is below rounding, or `limit` iterations.
Snapshot iterate(const Form<double>& form, const Problem<double>& p, int limit) {
  const int columns = static_cast<int>(p.G.cols());
  Snapshot s;
  s.x = VectorX<double>::Zero(columns);
  double n = form.robust_start(p, s.x), previous = std::numeric_limits<double>::infinity();
  for (int iteration = 0; iteration < limit; ++iteration) {
    const Rows<double> at = form.at(p, s.x, n);
    s.cost = at.cost;
    if (iteration > 0) s.worst_rise = std::max(s.worst_rise, (s.cost - previous) / (1e-300 + previous));
    previous = s.cost;
    MatrixX<double> hessian = at.hessian();
    hessian.diagonal().array() += 1e-12 * hessian.trace() + 1e-300;  // rejected rows may leave a direction without information
    const VectorX<double> step = solve_dense<double>(hessian, -at.gradient()).col(0);
    s.x += step.head(columns);
    if (step.size() > columns) n += step[columns];
    if (step.norm() < 1e-13 * (1 + s.x.norm())) break;
  }
  return s;
}

/// Total cost at x, minimised over n.
double least_over_n(const Form<double>& form, const Problem<double>& p, const VectorX<double>& x) {
  Problem<double> frozen{p.cov, p.residual(x), MatrixX<double>(p.m(), 0)};
  return iterate(form, frozen, 1000).cost;
}

/// A sky of satellites, ranges linear in the position: undifferenced residuals v_k(x) = noise_k - u_k' x, u_k the direction to k.
struct Sky {
  MatrixX<double> minus_u;
  VectorX<double> v, variance;

  /// Elevations above 15 degrees, code sigma^2 = 2 a^2 + (b / sin el)^2 with a, b in metres, as for GPS C1C.
  Sky(Rng& rng, int satellites, double a_m = 0.9, double b_m = 1.95) : minus_u(satellites, 3), v(satellites), variance(satellites) {
    for (int k = 0; k < satellites; ++k) {
      const double sin_el = uniform(rng, 0.26, 1.0), cos_el = std::sqrt(1 - sin_el * sin_el), azimuth = uniform(rng, 0.0, 6.2832);
      minus_u(k, 0) = -cos_el * std::sin(azimuth);
      minus_u(k, 1) = -cos_el * std::cos(azimuth);
      minus_u(k, 2) = -sin_el;
      variance[k] = 2 * a_m * a_m + (b_m / sin_el) * (b_m / sin_el);
      v[k] = normal(rng, std::sqrt(variance[k]));
    }
  }

  [[nodiscard]] int highest() const {
    int best = 0;
    for (int k = 1; k < v.size(); ++k)
      if (minus_u(k, 2) < minus_u(best, 2)) best = k;
    return best;
  }

  /// Differences against the pivot, the other satellites in ascending or descending order.
  [[nodiscard]] Problem<double> differences(int pivot, bool descending = false) const {
    const int m = static_cast<int>(v.size()) - 1;
    Problem<double> p;
    p.r0.resize(m);
    p.G.resize(m, 3);
    VectorX<double> d(m);
    for (int i = 0; i < m; ++i) {
      const int rest = descending ? m - 1 - i : i, k = rest < pivot ? rest : rest + 1;
      p.r0[i] = v[k] - v[pivot];
      for (int c = 0; c < 3; ++c) p.G(i, c) = minus_u(k, c) - minus_u(pivot, c);
      d[i] = variance[k];
    }
    p.cov = Cov<double>::from(d.data(), m, variance[pivot]).value();
    return p;
  }
};

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

}  // namespace

TEST_CASE("one gross outlier: latent forms keep the others, batch pulls all down, scalar depends on the row order") {
  for_all_seeds(50, [](Rng& rng) {
    const int m = 8, bad = integer(rng, 0, m - 1);
    std::array<double, kMost> d{};
    d.fill(4.0);
    Problem<double> p;
    p.cov = Cov<double>::from(d.data(), m, 4.0).value();
    p.G = MatrixX<double>::Zero(m, 1);
    p.r0.resize(m);
    const double pivot = uniform(rng, -1.5, 1.5);
    for (int i = 0; i < m; ++i) p.r0[i] = uniform(rng, -1.0, 1.0) - pivot;
    p.r0[bad] += 60;
    const VectorX<double> x = VectorX<double>::Zero(1);

    const auto least_of_others = [&](const VectorX<double>& w, int outlier) {
      double least = 1;
      for (int i = 0; i < m; ++i)
        if (i != outlier) least = std::min(least, w[i]);
      return least;
    };
    const auto check_latent = [&](const auto& f) {
      const Rows<double> at = linearise(f, p, x, f.robust_initial_latent(p.cov, p.r0.data()));
      CHECK(at.w[bad] < 1e-3);
      CHECK(least_of_others(at.w, bad) > 0.95);
      CHECK(at.w[m] > 0.95);
    };
    check_latent(LatentPivot<Dcs<double>>{});
    check_latent(LatentPivotSymmetric<Dcs<double>>{});

    const Rows<double> batch = linearise(Batch<Dcs<double>>{}, p, x, 0.0);
    CHECK(batch.w.maxCoeff() < 1e-3);
    CHECK(batch.w.minCoeff() == batch.w.maxCoeff());

    // The same batch, the outlier moved to the first or to the last row. First: only its own row contains it. Last: every row does.
    const auto scalar_weights = [&](int row) {
      Problem<double> q = p;
      std::swap(q.r0[bad], q.r0[row]);
      return linearise(ScalarRows<Dcs<double>>{}, q, x, 0.0).w;
    };
    const VectorX<double> first = scalar_weights(0), last = scalar_weights(m - 1);
    CHECK(first[0] < 1e-3);
    CHECK(least_of_others(first, 0) > 0.95);
    CHECK(last[m - 1] < 1e-3);
    CHECK(last.head(m - 1).maxCoeff() < 0.7);
    CHECK(last[m - 2] < 0.02);
  });
}

TEST_CASE("30 m on the pivot of ten satellites: only the symmetric form keeps the position") {
  Rng rng{7};
  const auto forms = forms_of(Dcs<double>{});
  std::vector<double> moved_m[5];
  for (int run = 0; run < 100; ++run) {
    const Sky clean(rng, 10, 0.45, 0.98);
    const int pivot = clean.highest();
    Sky faulty = clean;
    faulty.v[pivot] += 30;
    for (std::size_t k = 0; k < 5; ++k)
      moved_m[k].push_back(
          (iterate(*forms[k], faulty.differences(pivot), 1000).x - iterate(*forms[k], clean.differences(pivot), 1000).x).norm());
  }
  const double batch = median(moved_m[0]), scalar = median(moved_m[2]), latent = median(moved_m[3]), symmetric = median(moved_m[4]);
  MESSAGE("30 m on the pivot moves the position by (median of 100 skies, m): batch " << batch << ", scalar " << scalar << ", latent "
                                                                                     << latent << ", symmetric " << symmetric);
  CHECK(batch > 20);
  CHECK(scalar > 20);
  CHECK(latent > 20);
  CHECK(symmetric < 2.5);
  CHECK(symmetric > 0.5);  // it does lose the information of its pivot
}

TEST_CASE(
    "symmetric latent, like full-covariance batch: the choice of pivot changes neither cost nor solution; published latent: it does") {
  const auto dcs = forms_of(Dcs<double>{}), huber = forms_of(Huber<double>{});
  double latent_difference = 0, scalar_difference = 0;
  for_all_seeds(30, [&](Rng& rng) {
    Sky sky(rng, 10);
    sky.v[integer(rng, 0, 9)] += 30;
    if (chance(rng, 0.5)) sky.v[integer(rng, 0, 9)] -= 50;
    const int one = integer(rng, 0, 9), two = (one + integer(rng, 1, 9)) % 10;
    const Problem<double> p = sky.differences(one), q = sky.differences(two);
    for (const auto* forms : {&dcs, &huber}) {
      const Form<double>& symmetric = *(*forms)[4];
      INFO(symmetric.name);
      // The cost, at corresponding (x, n): b = v_o - n is common, so n' = n + v_o' - v_o.
      const VectorX<double> x{random_vector<3>(rng, 5.0)}, v = sky.v + times(sky.minus_u, x);
      const double n = normal(rng, 10.0), n_two = n + v[two] - v[one];
      CHECK(symmetric.at(p, x, n).cost == doctest::Approx(symmetric.at(q, x, n_two).cost).epsilon(1e-12));
      // The cost minimised over n at fixed x: the same function of x, whichever the pivot.
      const double least = least_over_n(symmetric, p, x), least_two = least_over_n(symmetric, q, x);
      CHECK(std::abs(least - least_two) <= 1e-9 * least);
      CHECK(least <= symmetric.at(p, x, n).cost);

      const Snapshot a = iterate(symmetric, p, 3000), b = iterate(symmetric, q, 3000);
      CHECK(close(a.x, b.x, 1e-9));
      CHECK(std::abs(a.cost - b.cost) <= 1e-9 * b.cost);
      CHECK(close(iterate(symmetric, sky.differences(one, true), 3000).x, a.x, 1e-9));
      for (std::size_t batch : {0U, 1U}) {
        CHECK((*forms)[batch]->at(p, x, 0.0).cost == doctest::Approx((*forms)[batch]->at(q, x, 0.0).cost).epsilon(1e-12));
        CHECK(close(iterate(*(*forms)[batch], p, 3000).x, iterate(*(*forms)[batch], q, 3000).x, 1e-9));
      }
      scalar_difference = std::max(scalar_difference, (iterate(*(*forms)[2], p, 3000).x - iterate(*(*forms)[2], q, 3000).x).norm());
      latent_difference = std::max(latent_difference, (iterate(*(*forms)[3], p, 3000).x - iterate(*(*forms)[3], q, 3000).x).norm());
    }
  });
  CHECK(latent_difference > 1.0);
  CHECK(scalar_difference > 1.0);
}

TEST_CASE("order of candidates: batch and latent forms do not see it, scalar does") {
  const auto forms = forms_of(Dcs<double>{});
  double scalar_difference = 0;
  for_all_seeds(30, [&](Rng& rng) {
    Sky sky(rng, 10);
    sky.v[integer(rng, 0, 9)] += 30;
    const int pivot = sky.highest();
    const Problem<double> up = sky.differences(pivot), down = sky.differences(pivot, true);
    const VectorX<double> x{random_vector<3>(rng, 5.0)};
    for (std::size_t k : {0U, 1U, 3U, 4U}) {
      INFO(forms[k]->name);
      const Rows<double> a = forms[k]->at(up, x, 1.0), b = forms[k]->at(down, x, 1.0);
      CHECK(a.cost == doctest::Approx(b.cost).epsilon(1e-12));
      CHECK(close(VectorX<double>(a.w.head(9).reverse()), VectorX<double>(b.w.head(9)), 1e-12));
      CHECK(close(a.gradient(), b.gradient(), 1e-11));
    }
    const VectorX<double> a = forms[2]->at(up, x, 0.0).w, b = forms[2]->at(down, x, 0.0).w;
    scalar_difference = std::max(scalar_difference, (a.reverse() - b).cwiseAbs().maxCoeff());
  });
  CHECK(scalar_difference > 0.5);
}

TEST_CASE("P6: every IRLS step lowers the total cost, for every formulation and loss: weights and cost belong together") {
  const auto forms = all_forms<double>();
  for_all_seeds(15, [&](Rng& rng) {
    const Problem<double> p = random_problem<double>(rng, integer(rng, 5, 15), 3, 0.5, 6.0);
    for (const auto& form : forms) {
      INFO(form->name);
      const Snapshot s = iterate(*form, p, 60);
      CHECK(s.worst_rise <= 1e-12);
      CHECK(s.cost <= form->at(p, VectorX<double>::Zero(3), form->robust_start(p, VectorX<double>::Zero(3))).cost);
    }
  });
}

TEST_CASE("the robust start of the latent is no worse than any sample or the Gaussian optimum, and nearly always in the deepest basin") {
  const auto forms = all_forms<double>();
  int deepest = 0, tried = 0;
  for_all_seeds(40, [&](Rng& rng) {
    Sky sky(rng, 10);
    for (int k = 0; k < 10; ++k)
      if (chance(rng, 0.3)) sky.v[k] += normal(rng, 30.0);
    const Problem<double> p = sky.differences(sky.highest());
    const VectorX<double> x = VectorX<double>::Zero(3);
    for (const auto& form : forms) {
      if (!form->has_latent) continue;
      INFO(form->name);
      const double cost = form->at(p, x, form->robust_start(p, x)).cost, slack = 1e-9 * cost;
      CHECK(cost <= form->at(p, x, form->gaussian_start(p, x)).cost + slack);
      CHECK(cost <= form->at(p, x, 0.0).cost + slack);
      for (int i = 0; i < p.m(); ++i) CHECK(cost <= form->at(p, x, -p.r0[i]).cost + slack);
      double least = std::numeric_limits<double>::infinity();
      for (double n = -100; n < 100; n += 0.5) least = std::min(least, form->at(p, x, n).cost);
      deepest += cost <= least + 0.02 ? 1 : 0;
      ++tried;
    }
  });
  MESSAGE("robust start in the deepest basin: " << deepest << " of " << tried);
  CHECK(deepest >= 0.97 * tried);
}

TEST_CASE_TEMPLATE("the robust start finds the consensus in float as in double: ten agree on n, the pivot or a third of the rest is wrong",
                   S, float, double) {
  for_all_seeds(100, [](Rng& rng) {
    const int m = 12;
    const double n = uniform(rng, -40.0, 40.0);
    std::array<S, kMost> d{}, r{};
    for (int i = 0; i < m; ++i) {
      const auto at = static_cast<std::size_t>(i);
      d[at] = S(1);
      r[at] = static_cast<S>(uniform(rng, -0.8, 0.8) - n + (i < 4 ? uniform(rng, 60.0, 90.0) : 0.0));
    }
    const Cov<S> cov = Cov<S>::from(d.data(), m, S(1)).value();
    const auto start = static_cast<double>(LatentPivotSymmetric<Dcs<S>>{}.robust_initial_latent(cov, r.data()));
    CHECK(std::abs(start - n) < 0.9);
    CHECK(start == static_cast<double>(LatentPivotSymmetric<Dcs<S>>{}.robust_initial_latent(cov, r.data())));
  });
}
