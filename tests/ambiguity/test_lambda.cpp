// SPDX-License-Identifier: BSD-3-Clause
// LAMBDA: against enumeration that proves the optimum, exact integer algebra of Z, invariances, partial fixing, the 1220 problems
// with known answers, and what it says to bad input.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <numeric>
#include <utility>
#include <vector>

#include <searvins/ambiguity/lambda.hpp>

#include "support/ambiguity_problems.hpp"
#include "support/property.hpp"
#include "support/shared_data.hpp"

using namespace searvins;
using namespace searvins::ambiguity;
using namespace searvins::test;

namespace {

using Lambda80 = Lambda<double, 80>;
using IntegerMatrix = std::vector<std::vector<std::int64_t>>;  // rows

std::size_t at(int i) { return static_cast<std::size_t>(i); }

Status decompose(Lambda80& lambda, const Matrix& Q) { return lambda.decompose(Q.data(), Q.columns, Q.rows); }

/// A covariance with anything from no to strong correlation: a mild one seen through random integer shears.
Matrix sheared_covariance(Rng& rng, int n, int shears, int size) {
  Matrix B(n, n), Q(n, n);
  for (double& b : B.values) b = normal(rng);
  const double scale = std::exp(uniform(rng, -4, 0));
  for (int i = 0; i < n; ++i) Q(i, i) = 0.3 * scale;
  Q = sum(Q, scale / n, product(B, transposed(B)));
  for (int s = 0; s < shears && n > 1; ++s) {
    const int i = integer(rng, 0, n - 1), k = (i + integer(rng, 1, n - 1)) % n;
    const double multiple = integer(rng, -size, size);
    for (int c = 0; c < n; ++c) Q(i, c) += multiple * Q(k, c);
    for (int c = 0; c < n; ++c) Q(c, i) += multiple * Q(c, k);
  }
  return symmetric(Q);
}

std::vector<double> random_float(Rng& rng, int n) {
  std::vector<double> a(at(n));
  for (double& v : a) v = uniform(rng, -50, 50);
  return a;
}

/// Z' with one row per decorrelated ambiguity.
IntegerMatrix z_transposed(const Lambda80& lambda) {
  IntegerMatrix Z(at(lambda.size()), std::vector<std::int64_t>(at(lambda.size())));
  for (int k = 0; k < lambda.size(); ++k) lambda.combination(k, Z[at(k)].data());
  return Z;
}

/// Rows `first` and below of an integer matrix, as a real one.
Matrix real_rows(const IntegerMatrix& Z, int first = 0) {
  const auto n = static_cast<int>(Z.size());
  Matrix m(n - first, n);
  for (int i = first; i < n; ++i)
    for (int k = 0; k < n; ++k) m(i - first, k) = static_cast<double>(Z[at(i)][at(k)]);
  return m;
}

bool is_identity_product(const IntegerMatrix& a, const IntegerMatrix& b) {
  for (std::size_t i = 0; i < a.size(); ++i)
    for (std::size_t k = 0; k < a.size(); ++k) {
      std::int64_t v = 0;
      for (std::size_t m = 0; m < a.size(); ++m) v += a[i][m] * b[m][k];
      if (v != (i == k)) return false;
    }
  return true;
}

double largest(const Matrix& a) {
  double v = 0;
  for (const double x : a.values) v = std::max(v, std::abs(x));
  return v;
}

Matrix scaled(Matrix a, double factor) {
  for (double& v : a.values) v *= factor;
  return a;
}

/// Condition number in the row-sum norm.
double condition(const Matrix& a) {
  const auto norm = [](const Matrix& m) {
    double most = 0;
    for (int i = 0; i < m.rows; ++i) {
      double row_sum = 0;
      for (int k = 0; k < m.columns; ++k) row_sum += std::abs(m(i, k));
      most = std::max(most, row_sum);
    }
    return most;
  };
  return norm(a) * norm(inverse(a));
}

/// Q = L' D L of Q in its own order, without integers: the conditional variances.
std::vector<double> plain_conditional_variances(Matrix Q) {
  std::vector<double> d(at(Q.rows));
  for (int k = Q.rows - 1; k >= 0; --k) {
    d[at(k)] = Q(k, k);
    for (int i = 0; i < k; ++i)
      for (int c = 0; c < k; ++c) Q(i, c) -= Q(k, i) * Q(k, c) / d[at(k)];
  }
  return d;
}

/// Determinant of an integer matrix by fraction-free elimination (Bareiss): every division is exact.
std::int64_t exact_determinant(const IntegerMatrix& matrix) {
  __extension__ using Wide = __int128;
  const std::size_t n = matrix.size();
  std::vector<std::vector<Wide>> m;
  for (const auto& row : matrix) m.emplace_back(row.begin(), row.end());
  Wide previous = 1;
  int sign = 1;
  for (std::size_t p = 0; p + 1 < n; ++p) {
    std::size_t pivot = p;
    while (pivot < n && m[pivot][p] == 0) ++pivot;
    if (pivot == n) return 0;
    if (pivot != p) {
      std::swap(m[p], m[pivot]);
      sign = -sign;
    }
    for (std::size_t i = p + 1; i < n; ++i)
      for (std::size_t k = p + 1; k < n; ++k) m[i][k] = (m[i][k] * m[p][p] - m[i][p] * m[p][k]) / previous;
    previous = m[p][p];
  }
  return static_cast<std::int64_t>(sign * m[n - 1][n - 1]);
}

double squared_norm(const Matrix& Q, const std::vector<double>& a_hat, const std::int64_t* N) {
  const Matrix M = inverse(Q);
  double norm = 0;
  for (int i = 0; i < Q.rows; ++i)
    for (int k = 0; k < Q.rows; ++k)
      norm += (a_hat[at(i)] - static_cast<double>(N[i])) * M(i, k) * (a_hat[at(k)] - static_cast<double>(N[k]));
  return norm;
}

/// The `count` smallest norms among ALL integer vectors with norm <= limit. Proof of completeness: |N_i - a_i| <= sqrt(limit Q_ii)
/// for each of them, so the box is enumerated; in the last coordinate the norm is a parabola, of which every integer below the
/// limit is visited. Nothing is shared with the code under test. Empty when the box is too large to enumerate.
std::vector<double> enumerate_norms(const Matrix& Q, const std::vector<double>& a, double limit, std::size_t count) {
  const int n = Q.rows, last = n - 1;
  const Matrix M = inverse(Q);
  std::vector<double> low(at(n)), high(at(n));
  double boxes = 1;
  for (int i = 0; i < n; ++i) {
    const double radius = std::sqrt(limit * Q(i, i)) + 1e-6;
    low[at(i)] = std::ceil(a[at(i)] - radius);
    high[at(i)] = std::floor(a[at(i)] + radius);
    if (i < last) boxes *= std::max(0.0, high[at(i)] - low[at(i)] + 1);
  }
  if (boxes > 2e5) return {};
  std::vector<double> norms, N = low;
  for (bool more = boxes > 0; more;) {
    double rest = 0, slope = 0;  // norm = rest + 2 slope y + M_ll y^2 with y = N_last - a_last
    for (int i = 0; i < last; ++i) {
      const double e = N[at(i)] - a[at(i)];
      slope += M(i, last) * e;
      for (int k = 0; k < last; ++k) rest += M(i, k) * e * (N[at(k)] - a[at(k)]);
    }
    const double centre = a[at(last)] - slope / M(last, last), least = rest - slope * slope / M(last, last);
    const auto norm_at = [&](double z) { return least + M(last, last) * (z - centre) * (z - centre); };
    for (double z = std::floor(centre); norm_at(z) <= limit; --z) norms.push_back(norm_at(z));
    for (double z = std::floor(centre) + 1; norm_at(z) <= limit; ++z) norms.push_back(norm_at(z));
    int i = 0;
    while (i < last && ++N[at(i)] > high[at(i)]) {
      N[at(i)] = low[at(i)];
      ++i;
    }
    more = i < last;
  }
  std::sort(norms.begin(), norms.end());
  norms.resize(std::min(norms.size(), count));
  return norms;
}

void check_same_vector(const std::int64_t* found, const std::vector<std::int64_t>& expected) {
  CHECK(std::equal(expected.begin(), expected.end(), found));
}

}  // namespace

TEST_CASE("LAMBDA finds the k best vectors: proved by enumeration for n <= 4") {
  int proved = 0;
  for_all_seeds(300, [&proved](Rng& rng) {
    Lambda80 lambda;
    const int n = integer(rng, 1, 4), k_best = integer(rng, 1, 4);
    const Matrix Q = sheared_covariance(rng, n, integer(rng, 0, 6), 4);
    const std::vector<double> a_hat = random_float(rng, n);
    CAPTURE(n);
    REQUIRE(decompose(lambda, Q).ok());
    const auto found = lambda.search(a_hat.data(), k_best);
    REQUIRE(found.ok());
    REQUIRE(found->count == k_best);
    const double worst = found->squared_norm[at(k_best - 1)];
    for (int c = 0; c < k_best; ++c) {
      const auto& N = found->integers[at(c)];
      CHECK(squared_norm(Q, a_hat, N.data()) == doctest::Approx(found->squared_norm[at(c)]).epsilon(1e-7));
      for (int b = 0; b < c; ++b) {
        CHECK(found->squared_norm[at(b)] <= found->squared_norm[at(c)]);
        CHECK_FALSE(std::equal(N.begin(), N.begin() + n, found->integers[at(b)].begin()));
      }
    }
    const std::vector<double> all = enumerate_norms(Q, a_hat, worst * (1 + 1e-6), at(k_best));
    if (all.empty()) return;
    ++proved;
    REQUIRE(all.size() == at(k_best));
    for (std::size_t c = 0; c < all.size(); ++c) CHECK(found->squared_norm[c] == doctest::Approx(all[c]).epsilon(1e-6));
  });
  CHECK(proved > 0);
  MESSAGE("proved optimal by enumeration: " << proved);
}

TEST_CASE("LAMBDA: Z is unimodular, exactly, and L' D L is the covariance of Z' a") {
  for_all_seeds(200, [](Rng& rng) {
    Lambda80 lambda;
    const int n = integer(rng, 1, 8);
    const Matrix Q = n >= 5 && chance(rng, 0.5) ? double_difference_problem(rng, n).Q : sheared_covariance(rng, n, 2 * n, 5);
    REQUIRE(decompose(lambda, Q).ok());
    CHECK(lambda.decorrelated());
    const IntegerMatrix Z = z_transposed(lambda);
    CHECK(std::abs(exact_determinant(Z)) == 1);

    Matrix DL(n, n), L(n, n), magnitude = Q;
    for (int i = 0; i < n; ++i)
      for (int k = 0; k <= i; ++k) {
        L(i, k) = i == k ? 1 : lambda.factor(i, k);
        DL(i, k) = lambda.conditional_variances()[i] * L(i, k);
      }
    Matrix Zr = real_rows(Z);
    const Matrix difference = sum(product(transposed(L), DL), -1, product(Zr, product(Q, transposed(Zr))));
    for (double& v : Zr.values) v = std::abs(v);
    for (double& v : magnitude.values) v = std::abs(v);
    CHECK(largest(difference) <= 1e-9 * largest(product(Zr, product(magnitude, transposed(Zr)))));
  });
}

TEST_CASE("LAMBDA: Z' and its inverse undo each other exactly at any size") {
  for_all_seeds(20, [](Rng& rng) {
    const auto lambda = std::make_unique<Lambda80>(LambdaSettings<double>{0.9, 100, chance(rng, 0.5)});
    const int n = integer(rng, 8, 80);
    REQUIRE(decompose(*lambda, double_difference_problem(rng, n).Q).ok());
    CHECK(lambda->decorrelated());
    const IntegerMatrix Z = z_transposed(*lambda);
    IntegerMatrix inverse_of_Z(at(n), std::vector<std::int64_t>(at(n)));
    for (int k = 0; k < n; ++k) {
      std::vector<std::int64_t> unit(at(n)), column(at(n));
      unit[at(k)] = 1;
      lambda->to_ambiguities(unit.data(), column.data());
      for (int i = 0; i < n; ++i) inverse_of_Z[at(i)][at(k)] = column[at(i)];
    }
    CHECK(is_identity_product(Z, inverse_of_Z));
    CHECK(is_identity_product(inverse_of_Z, Z));
  });
}

TEST_CASE("LAMBDA: no neighbouring pair gains by exchange, and the spread of d shrinks") {
  for_all_seeds(60, [](Rng& rng) {
    const LambdaSettings<double> settings{uniform(rng, 0.5, 0.999), 5'000'000, chance(rng, 0.5)};
    Lambda80 lambda{settings};
    const int n = integer(rng, 6, 40);
    const Matrix Q = double_difference_problem(rng, n).Q;
    REQUIRE(decompose(lambda, Q).ok());
    const double* d = lambda.conditional_variances();
    for (int k = 0; k + 1 < n; ++k) {
      const double l = lambda.factor(k + 1, k), r = l - std::round(l);
      CHECK(d[k] + r * r * d[k + 1] >= settings.exchange_factor * d[k + 1] * (1 - 1e-12));
    }

    const std::vector<double> plain = plain_conditional_variances(Q);
    double log_det = 0, plain_log_det = 0;
    for (int k = 0; k < n; ++k) {
      log_det += std::log(d[k]);
      plain_log_det += std::log(plain[at(k)]);
    }
    CHECK(log_det == doctest::Approx(plain_log_det).epsilon(1e-8));  // det Z = +-1
    const auto [least, most] = std::minmax_element(plain.begin(), plain.end());
    CHECK(*std::max_element(d, d + n) / *std::min_element(d, d + n) < 0.1 * *most / *least);
    CHECK(lambda.success_rate() > bootstrapped_success_rate(plain.data(), n));
  });
}

TEST_CASE("LAMBDA: full reduction lowers the condition number and shortens Z, and leaves d and the answers alone") {
  for_all_seeds(40, [](Rng& rng) {
    Lambda80 lazy, full{{0.9, 5'000'000, true}};
    const int n = integer(rng, 6, 30);
    const AmbiguityProblem problem = double_difference_problem(rng, n);
    REQUIRE(decompose(lazy, problem.Q).ok());
    REQUIRE(decompose(full, problem.Q).ok());
    CHECK(full.decorrelated());
    for (int i = 0; i < n; ++i)
      for (int k = 0; k < i; ++k) CHECK(std::abs(full.factor(i, k)) <= 0.5 + 1e-9);
    CHECK(std::equal(full.conditional_variances(), full.conditional_variances() + n, lazy.conditional_variances()));
    const Matrix Z = real_rows(z_transposed(full));
    CHECK(condition(product(Z, product(problem.Q, transposed(Z)))) < 0.2 * condition(problem.Q));
    const auto one = lazy.search(problem.a_hat.data(), 2), two = full.search(problem.a_hat.data(), 2);
    REQUIRE((one.ok() && two.ok()));
    CHECK(one->nodes == two->nodes);
    CHECK(one->integers == two->integers);
  });
}

TEST_CASE("LAMBDA: a shift of the float by whole cycles, also by 1e9, shifts the integers and nothing else") {
  for_all_seeds(60, [](Rng& rng) {
    Lambda80 lambda;
    const int n = integer(rng, 2, 20);
    REQUIRE(decompose(lambda, double_difference_problem(rng, n % 2 ? n + 5 : n + 4).Q).ok());
    const int size = lambda.size();
    std::vector<double> a(at(size)), shifted(a);
    std::vector<std::int64_t> shift(a.size());
    for (std::size_t i = 0; i < a.size(); ++i) {
      a[i] = std::round(uniform(rng, -0.49, 0.49) * 1048576) / 1048576;  // on a grid that leaves a + shift exact
      shift[i] = std::uniform_int_distribution<std::int64_t>{-1'000'000'000, 1'000'000'000}(rng);
      shifted[i] = a[i] + static_cast<double>(shift[i]);
    }
    const auto here = lambda.search(a.data(), 3), there = lambda.search(shifted.data(), 3);
    REQUIRE((here.ok() && there.ok()));
    CHECK(here->squared_norm == there->squared_norm);
    CHECK(here->nodes == there->nodes);
    for (std::size_t c = 0; c < 3; ++c)
      for (std::size_t i = 0; i < a.size(); ++i) CHECK(there->integers[c][i] - here->integers[c][i] == shift[i]);
    const auto part = lambda.search_partial(a.data(), size / 2, 1), far = lambda.search_partial(shifted.data(), size / 2, 1);
    REQUIRE((part.ok() && far.ok()));
    std::vector<std::int64_t> row(a.size());
    for (int k = size / 2; k < size; ++k) {
      lambda.combination(k, row.data());
      const std::int64_t moved = std::inner_product(row.begin(), row.end(), shift.begin(), std::int64_t{0});
      CHECK(far->values[0][static_cast<std::size_t>(k - size / 2)] - part->values[0][static_cast<std::size_t>(k - size / 2)] == moved);
    }
  });
}

TEST_CASE("LAMBDA: the order of the ambiguities does not change the optimum") {
  for_all_seeds(60, [](Rng& rng) {
    Lambda80 lambda;
    const int n = integer(rng, 6, 30);
    const AmbiguityProblem problem = double_difference_problem(rng, n);
    std::vector<int> order(at(n));
    std::iota(order.begin(), order.end(), 0);
    std::shuffle(order.begin(), order.end(), rng);
    Matrix Q(n, n);
    std::vector<double> a_hat(at(n));
    for (int i = 0; i < n; ++i) {
      a_hat[at(i)] = problem.a_hat[at(order[at(i)])];
      for (int k = 0; k < n; ++k) Q(i, k) = problem.Q(order[at(i)], order[at(k)]);
    }
    REQUIRE(decompose(lambda, problem.Q).ok());
    const auto straight = lambda.search(problem.a_hat.data(), 2);
    REQUIRE(decompose(lambda, Q).ok());
    const auto shuffled = lambda.search(a_hat.data(), 2);
    REQUIRE((straight.ok() && shuffled.ok()));
    for (std::size_t c = 0; c < 2; ++c) CHECK(shuffled->squared_norm[c] == doctest::Approx(straight->squared_norm[c]).epsilon(1e-7));
    if (straight->ratio() < 1 + 1e-6) return;  // a tie has two optima
    for (int i = 0; i < n; ++i) CHECK(shuffled->integers[0][at(i)] == straight->integers[0][static_cast<std::size_t>(order[at(i)])]);
  });
}

TEST_CASE("LAMBDA: an integer float is its own best vector, with norm zero") {
  Lambda80 lambda;
  Rng rng{7};
  REQUIRE(decompose(lambda, double_difference_problem(rng, 12).Q).ok());
  const std::vector<double> a_hat(12, 5.0);
  const auto found = lambda.search(a_hat.data(), 2);
  REQUIRE(found.ok());
  check_same_vector(found->integers[0].data(), std::vector<std::int64_t>(12, 5));
  CHECK(found->squared_norm[0] == 0.0);
  CHECK(found->squared_norm[1] > 0.0);
  CHECK(found->ratio() == std::numeric_limits<double>::infinity());
}

TEST_CASE("LAMBDA: halves are tried on both sides") {
  const double Q = 0.04, half = 0.5, minus_half = -2.5;
  Lambda<double, 1> lambda;
  REQUIRE(lambda.decompose(&Q, 1, 1).ok());
  for (const auto& [a_hat, below] : {std::pair{half, 0}, std::pair{minus_half, -3}}) {
    const auto found = lambda.search(&a_hat, 4);
    REQUIRE(found.ok());
    CHECK(found->integers[0][0] + found->integers[1][0] == 2 * below + 1);
    CHECK(found->squared_norm[0] == doctest::Approx(6.25));
    CHECK(found->squared_norm[1] == doctest::Approx(6.25));
    CHECK(found->squared_norm[2] == doctest::Approx(56.25));
    CHECK(found->squared_norm[3] == doctest::Approx(56.25));
  }
}

TEST_CASE("LAMBDA partial: fixing them all is the full search") {
  for_all_seeds(60, [](Rng& rng) {
    Lambda80 lambda;
    const int n = integer(rng, 6, 30);
    const AmbiguityProblem problem = double_difference_problem(rng, n);
    REQUIRE(decompose(lambda, problem.Q).ok());
    const auto full = lambda.search(problem.a_hat.data(), 2);
    const auto part = lambda.search_partial(problem.a_hat.data(), 0, 2);
    REQUIRE((full.ok() && part.ok()));
    CHECK(part->size == n);
    CHECK(part->squared_norm == full->squared_norm);
    CHECK(part->ratio() == full->ratio());
    std::vector<std::int64_t> row(at(n));
    for (int k = 0; k < n; ++k) {
      lambda.combination(k, row.data());
      for (std::size_t c = 0; c < 2; ++c) {
        const std::int64_t combined = std::inner_product(row.begin(), row.end(), full->integers[c].begin(), std::int64_t{0});
        CHECK(part->values[c][at(k)] == combined);
      }
      CHECK(part->conditional[at(k)] == doctest::Approx(static_cast<double>(full->integers[0][at(k)])).epsilon(1e-9));
    }
  });
}

TEST_CASE("LAMBDA partial: the subset is the optimum of its own covariance, the rest its conditional mean") {
  for_all_seeds(60, [](Rng& rng) {
    Lambda80 lambda, alone;
    const int n = integer(rng, 6, 24), first = integer(rng, 1, n - 1), size = n - first;
    const AmbiguityProblem problem = double_difference_problem(rng, n);
    REQUIRE(decompose(lambda, problem.Q).ok());
    const auto part = lambda.search_partial(problem.a_hat.data(), first, 2);
    REQUIRE(part.ok());
    REQUIRE(part->size == size);

    const Matrix Zs = real_rows(z_transposed(lambda), first);
    const Matrix Qs = symmetric(product(Zs, product(problem.Q, transposed(Zs))));
    const auto combined = [&](const double* a) {  // Zs a
      std::vector<double> z(at(size));
      for (int k = 0; k < size; ++k) z[at(k)] = std::inner_product(a, a + n, Zs.data() + k * n, 0.0);
      return z;
    };
    const std::vector<double> zs_hat = combined(problem.a_hat.data());
    REQUIRE(decompose(alone, Qs).ok());
    const auto subset = alone.search(zs_hat.data(), 2);
    REQUIRE(subset.ok());
    for (std::size_t c = 0; c < 2; ++c) CHECK(part->squared_norm[c] == doctest::Approx(subset->squared_norm[c]).epsilon(1e-6));
    if (subset->ratio() > 1 + 1e-6)
      CHECK(std::equal(subset->integers[0].begin(), subset->integers[0].begin() + size, part->values[0].begin()));

    Matrix offset(size, 1);
    for (int k = 0; k < size; ++k) offset(k, 0) = static_cast<double>(part->values[0][at(k)]) - zs_hat[at(k)];
    const Matrix correction = product(problem.Q, product(transposed(Zs), product(inverse(Qs), offset)));
    for (int i = 0; i < n; ++i)
      CHECK(std::abs(part->conditional[at(i)] - (problem.a_hat[at(i)] + correction(i, 0))) <= 1e-6 * (1 + largest(correction)));
    const std::vector<double> held = combined(part->conditional.data());  // the constraint holds
    for (int k = 0; k < size; ++k) CHECK(std::abs(held[at(k)] - static_cast<double>(part->values[0][at(k)])) <= 1e-6);
  });
}

TEST_CASE("LAMBDA partial: the success rate grows as fewer are fixed, and first_reliable() is where it passes the mark") {
  for_all_seeds(60, [](Rng& rng) {
    Lambda80 lambda;
    const int n = integer(rng, 6, 30);
    REQUIRE(decompose(lambda, scaled(double_difference_problem(rng, n).Q, 10)).ok());
    CHECK(lambda.success_rate_of_last(0) == 1.0);
    CHECK(lambda.success_rate_of_last(n) == lambda.success_rate());
    CHECK(lambda.success_rate_of_last(n + 1) == 0.0);
    for (int k = 0; k < n; ++k) CHECK(lambda.success_rate_of_last(k) >= lambda.success_rate_of_last(k + 1));
    const double mark = uniform(rng, 0.3, 0.999);
    const int first = lambda.first_reliable(mark);
    CHECK(lambda.success_rate_of_last(n - first) >= mark);
    if (first > 0) CHECK(lambda.success_rate_of_last(n - first + 1) < mark);
  });
}

TEST_CASE("LAMBDA: the 1220 problems with known answers") {
  const auto shared = shared_data();
  if (!shared || !std::filesystem::is_directory(*shared / "peers/lambda")) {
    MESSAGE("SKIPPED: the shared problems (peers/lambda) are not here");
    return;
  }
  const auto lambda = std::make_unique<Lambda80>();
  int problems = 0;
  std::uint64_t most_nodes = 0;
  for (const char* set : {"n6", "n12", "n20", "n30", "n40", "n60", "hard"}) {
    const auto all = read_ambiguity_problems(*shared / "peers/lambda", set);
    REQUIRE(all.has_value());
    for (const AmbiguityProblem& p : *all) {
      CAPTURE(set);
      CAPTURE(problems);
      ++problems;
      REQUIRE(decompose(*lambda, p.Q).ok());
      CHECK(lambda->decorrelated());
      const auto found = lambda->search(p.a_hat.data(), 2);
      REQUIRE(found.ok());
      check_same_vector(found->integers[0].data(), p.best);
      check_same_vector(found->integers[1].data(), p.second);
      CHECK(found->squared_norm[0] == doctest::Approx(p.best_norm).epsilon(1e-6));
      CHECK(found->squared_norm[1] == doctest::Approx(p.second_norm).epsilon(1e-6));
      most_nodes = std::max(most_nodes, found->nodes);
    }
  }
  CHECK(problems == 1220);
  MESSAGE("problems: " << problems << ", most nodes: " << most_nodes);
}

TEST_CASE("LAMBDA: a decorrelation cut short gives the same answers with more nodes") {
  std::uint64_t full_nodes = 0, cut_nodes = 0;
  int cut_short = 0;
  for_all_seeds(20, [&](Rng& rng) {
    Lambda80 lambda;
    Lambda<double, 12, 24> cut;
    const AmbiguityProblem problem = double_difference_problem(rng, 12);
    REQUIRE(decompose(lambda, problem.Q).ok());
    REQUIRE(cut.decompose(problem.Q.data(), 12, 12).ok());
    cut_short += !cut.decorrelated();
    CHECK(cut.steps() <= 24);
    const auto expected = lambda.search(problem.a_hat.data(), 2);
    const auto found = cut.search(problem.a_hat.data(), 2);
    REQUIRE((expected.ok() && found.ok()));
    CHECK(std::equal(found->integers[0].begin(), found->integers[0].end(), expected->integers[0].begin()));
    CHECK(found->squared_norm[1] == doctest::Approx(expected->squared_norm[1]).epsilon(1e-7));
    full_nodes += expected->nodes;
    cut_nodes += found->nodes;
  });
  CHECK(cut_short > 0);
  CHECK(cut_nodes > full_nodes);
}

TEST_CASE("LAMBDA: max_nodes ends the search with what was found, exchange_factor changes the decorrelation") {
  Rng rng{3};
  const AmbiguityProblem problem = double_difference_problem(rng, 12);
  Lambda80 lambda;
  REQUIRE(decompose(lambda, problem.Q).ok());
  const auto full = lambda.search(problem.a_hat.data(), 2);
  REQUIRE(full.ok());

  Lambda80 short_of_time{{0.9, 14}};
  REQUIRE(decompose(short_of_time, problem.Q).ok());
  Lambda80::SearchOutcome outcome;
  const Status status = short_of_time.search(problem.a_hat.data(), 2, outcome);
  CHECK(status.code == StatusCode::not_converged);
  CHECK(outcome.nodes == 14);
  REQUIRE(outcome.count == 2);
  CHECK(outcome.squared_norm[0] >= full->squared_norm[0]);
  CHECK(squared_norm(problem.Q, problem.a_hat, outcome.integers[0].data()) == doctest::Approx(outcome.squared_norm[0]).epsilon(1e-7));
  CHECK(short_of_time.search(problem.a_hat.data(), 2).status().code == StatusCode::not_converged);

  Lambda80 one_look{{0.9, 1}};
  REQUIRE(decompose(one_look, problem.Q).ok());
  CHECK(one_look.search(problem.a_hat.data(), 2, outcome).code == StatusCode::not_converged);
  CHECK(outcome.count == 0);

  Lambda80 hasty{{0.4, 5'000'000}};
  REQUIRE(decompose(hasty, problem.Q).ok());
  CHECK(hasty.steps() < lambda.steps());
  for (const double factor : {0.25, 1.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
    Lambda80 wrong{{factor, 100}};
    CHECK(decompose(wrong, problem.Q).code == StatusCode::invalid_argument);
  }
}

TEST_CASE("LAMBDA: bad input is refused with its place, and leaves nothing behind") {
  Rng rng{11};
  const AmbiguityProblem problem = double_difference_problem(rng, 12);
  const double nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
  Lambda80 lambda;
  CHECK(lambda.search(problem.a_hat.data(), 2).status().code == StatusCode::no_data);
  CHECK(lambda.success_rate() == 0.0);

  CHECK(lambda.decompose(problem.Q.data(), 12, 0).code == StatusCode::invalid_argument);
  CHECK(lambda.decompose(problem.Q.data(), 11, 12).code == StatusCode::invalid_argument);
  Lambda<double, 11> small;
  CHECK(small.decompose(problem.Q.data(), 12, 12).code == StatusCode::capacity_exceeded);

  for (const double bad : {nan, infinity, -infinity}) {
    for (const auto& [i, k] : {std::pair{4, 4}, std::pair{7, 2}, std::pair{2, 7}}) {
      Matrix Q = problem.Q;
      Q(i, k) = bad;
      const Status status = decompose(lambda, Q);
      CHECK(status.code == StatusCode::non_finite);
      CHECK(status.index == std::max(i, k));
      CHECK(status.detail == std::min(i, k));
    }
    Matrix Q = problem.Q;
    Q(7, 2) = Q(2, 7) = bad;
    CHECK(decompose(lambda, Q).code == StatusCode::non_finite);
  }
  CHECK(lambda.size() == 0);
  CHECK(lambda.search(problem.a_hat.data(), 2).status().code == StatusCode::no_data);

  for (const double bad : {0.0, -1.0}) {
    Matrix Q = problem.Q;
    Q(5, 5) = bad;
    const Status status = decompose(lambda, Q);
    CHECK(status.code == StatusCode::not_positive_definite);
    CHECK(status.index == 5);
  }

  Matrix half_filled = problem.Q;
  half_filled(9, 1) = 0;
  const Status status = decompose(lambda, half_filled);
  CHECK(status.code == StatusCode::invalid_argument);
  CHECK((status.index == 9 && status.detail == 1));

  REQUIRE(decompose(lambda, problem.Q).ok());
  for (const int k_best : {0, 5, -1}) CHECK(lambda.search(problem.a_hat.data(), k_best).status().code == StatusCode::invalid_argument);
  for (const int first : {-1, 12})
    CHECK(lambda.search_partial(problem.a_hat.data(), first, 2).status().code == StatusCode::invalid_argument);
  for (const double bad : {nan, infinity, 1e16}) {
    std::vector<double> a_hat = problem.a_hat;
    a_hat[3] = bad;
    const auto refused = lambda.search(a_hat.data(), 2);
    CHECK(refused.status().code == (bad == 1e16 ? StatusCode::invalid_argument : StatusCode::non_finite));
    CHECK(refused.status().index == 3);
  }
  CHECK(lambda.search(problem.a_hat.data(), 2).ok());  // a refused request does no harm
}

TEST_CASE("LAMBDA: singular and indefinite covariances name an ambiguity, whatever the scale") {
  for_all_seeds(100, [](Rng& rng) {
    Lambda80 lambda;
    const int n = integer(rng, 2, 20);
    const double scale = std::exp(uniform(rng, -10, 10));
    CAPTURE(n);
    Matrix Q = scaled(sheared_covariance(rng, n, n, 3), scale);
    REQUIRE(decompose(lambda, Q).ok());

    Matrix twice = Q;  // the same ambiguity given twice
    const int one = integer(rng, 0, n - 2), other = one + 1;
    for (int i = 0; i < n; ++i) twice(other, i) = twice(one, i);
    for (int i = 0; i < n; ++i) twice(i, other) = twice(i, one);
    const Status singular = decompose(lambda, twice);
    CHECK(singular.code == StatusCode::not_positive_definite);
    CHECK((singular.index == one || singular.index == other));

    Matrix B(n, 1);  // rank one
    for (double& b : B.values) b = normal(rng);
    const Status deficient = decompose(lambda, scaled(product(B, transposed(B)), scale));
    CHECK(deficient.code == StatusCode::not_positive_definite);
    CHECK((deficient.index >= 0 && deficient.index < n));

    Q(one, other) = Q(other, one) = 1.5 * std::sqrt(Q(one, one) * Q(other, other));  // indefinite
    CHECK(decompose(lambda, Q).code == StatusCode::not_positive_definite);
  });
}

TEST_CASE("LAMBDA: extreme but valid covariances end in a result or a status, never in undefined behaviour") {
  int decomposed = 0;
  for_all_seeds(300, [&decomposed](Rng& rng) {
    Lambda80 lambda{{0.9, 2000}};
    const int n = integer(rng, 1, 10);
    Matrix Q = sheared_covariance(rng, n, 3 * n, 100000);
    if (chance(rng, 0.5)) {
      std::vector<double> scale(at(n));
      for (double& v : scale) v = std::exp(uniform(rng, -150, 150));
      for (int i = 0; i < n; ++i)
        for (int k = 0; k < n; ++k) Q(i, k) *= scale[at(i)] * scale[at(k)];
    }
    if (!decompose(lambda, Q).ok()) return;
    ++decomposed;
    std::vector<double> a_hat = random_float(rng, n);
    for (double& a : a_hat) a *= std::exp(uniform(rng, 0, 30));
    Lambda80::SearchOutcome outcome;
    const Status status = lambda.search(a_hat.data(), 2, outcome);
    CHECK((status.ok() ? outcome.count == 2 : outcome.count <= 2));
    CHECK(outcome.nodes <= 2000);
    const auto part = lambda.search_partial(a_hat.data(), n / 2, 2);
    CHECK((part.ok() || part.status().code == StatusCode::not_converged || part.status().code == StatusCode::invalid_argument));
  });
  CHECK(decomposed > 0);
  MESSAGE("decomposed: " << decomposed);
}

TEST_CASE("LAMBDA: float finds what double finds on small, well-conditioned problems") {
  for_all_seeds(100, [](Rng& rng) {
    const int n = integer(rng, 1, 6);
    const Matrix Q = sheared_covariance(rng, n, 2, 2);
    const std::vector<double> a_hat = random_float(rng, n);
    std::vector<float> Q_float, a_float;
    for (const double q : Q.values) Q_float.push_back(static_cast<float>(q));
    for (const double a : a_hat) a_float.push_back(static_cast<float>(a));
    const auto expected = integer_least_squares<double, 8>(Q.data(), n, a_hat.data(), n, 3);
    const auto found = integer_least_squares<float, 8>(Q_float.data(), n, a_float.data(), n, 3);
    REQUIRE((expected.ok() && found.ok()));
    CHECK(static_cast<double>(found->squared_norm[0]) == doctest::Approx(expected->squared_norm[0]).epsilon(0.02).scale(0.1));
    if (expected->ratio() > 1.2)
      CHECK(std::equal(found->integers[0].begin(), found->integers[0].begin() + n, expected->integers[0].begin()));
  });
}

TEST_CASE("LAMBDA: same input, same bits; two objects do not disturb each other") {
  Rng rng{5};
  const AmbiguityProblem one = double_difference_problem(rng, 20), two = double_difference_problem(rng, 14);
  Lambda80 a, b;
  REQUIRE(decompose(a, one.Q).ok());
  const auto before = a.search(one.a_hat.data(), 2);
  REQUIRE(decompose(b, two.Q).ok());
  REQUIRE(b.search(two.a_hat.data(), 4).ok());
  const auto after = a.search(one.a_hat.data(), 2);
  REQUIRE(decompose(b, one.Q).ok());  // an object that has held something else
  const auto reused = b.search(one.a_hat.data(), 2);
  REQUIRE((before.ok() && after.ok() && reused.ok()));
  CHECK((before->squared_norm == after->squared_norm && before->integers == after->integers && before->nodes == after->nodes));
  CHECK((before->squared_norm == reused->squared_norm && before->integers == reused->integers));
}
