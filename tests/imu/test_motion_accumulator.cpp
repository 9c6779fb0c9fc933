// SPDX-License-Identifier: BSD-3-Clause
// The kernel of preintegration: closed forms, bias Jacobians, covariance against sampled noise, the seam of its series, float against
// double.
#include <searvins/imu/motion_accumulator.hpp>

#include <Eigen/Cholesky>

#include <vector>

#include "support/property.hpp"

using namespace searvins;
using namespace searvins::test;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using Motion = imu::PreintegratedMotion<double>;
using Vector9 = Eigen::Matrix<double, 9, 1>;
using Matrix9 = Eigen::Matrix<double, 9, 9>;

namespace {

struct Segment {
  double h;
  Vector3d gyro, accel;
};

constexpr double kAccelPsd = 1e-4, kGyroPsd = 1e-6;

std::vector<Segment> random_segments(Rng& rng, int n, double duration, double turn_radps = 1.0) {
  std::vector<Segment> list;
  for (int k = 0; k < n; ++k)
    list.push_back(
        {duration / n * uniform(rng, 0.3, 1.7), random_vector<3>(rng, turn_radps), Vector3d{0, 0, 9.8} + random_vector<3>(rng, 5)});
  return list;
}

template <class S = double>
imu::PreintegratedMotion<S> integrate(const std::vector<Segment>& segments, const imu::ImuBias<double>& bias = {},
                                      double accel_psd = kAccelPsd, double gyro_psd = kGyroPsd) {
  imu::MotionAccumulator<S> sum{bias.cast<S>()};
  for (const Segment& s : segments)
    sum.advance(static_cast<S>(s.h), s.gyro.cast<S>(), s.accel.cast<S>(), static_cast<S>(accel_psd), static_cast<S>(gyro_psd));
  imu::PreintegratedMotion<S> m;
  sum.write(m);
  return m;
}

/// What must be added to `m` to get another motion: (phi, n_p, n_v).
Vector9 error_of(const Motion& m, const Motion& other) {
  Vector9 n;
  n << so3::log(m.dR.transpose() * other.dR), other.dp_m - m.dp_m, other.dv_mps - m.dv_mps;
  return n;
}

/// Sampled noise of the continuous densities on every segment (in `parts` parts) against the covariance: each element within five standard
/// deviations of its estimate, and the squared whitened errors within five of a chi-square with 9 degrees of freedom a run.
void check_against_monte_carlo(Rng& rng, const std::vector<Segment>& segments, int runs, int parts) {
  const Motion nominal = integrate(segments);
  const Eigen::LLT<Matrix9> root{nominal.covariance};
  REQUIRE(root.info() == Eigen::Success);
  std::vector<Segment> fine, noisy;
  for (const Segment& s : segments) fine.insert(fine.end(), static_cast<std::size_t>(parts), {s.h / parts, s.gyro, s.accel});
  const Motion truth = integrate(fine);
  Matrix9 sum = Matrix9::Zero();
  double chi2 = 0;
  for (int run = 0; run < runs; ++run) {
    noisy = fine;
    for (Segment& s : noisy) {
      const double sigma_g = std::sqrt(kGyroPsd / s.h), sigma_a = std::sqrt(kAccelPsd / s.h);
      s.gyro += Vector3d{normal(rng, sigma_g), normal(rng, sigma_g), normal(rng, sigma_g)};
      s.accel += Vector3d{normal(rng, sigma_a), normal(rng, sigma_a), normal(rng, sigma_a)};
    }
    const Vector9 n = error_of(truth, integrate(noisy));
    sum += n * n.transpose();
    chi2 += root.matrixL().solve(n).squaredNorm();
  }
  const Matrix9& Q = nominal.covariance;
  for (int i = 0; i < 9; ++i)
    for (int j = 0; j < 9; ++j) {
      CAPTURE(i);
      CAPTURE(j);
      CHECK(std::abs(sum(i, j) / runs - Q(i, j)) < 5 * std::sqrt((Q(i, i) * Q(j, j) + Q(i, j) * Q(i, j)) / runs));
    }
  CHECK(std::abs(chi2 / runs - 9) < 5 * std::sqrt(18.0 / runs));
}

}  // namespace

TEST_CASE("constant acceleration without turning, and turning without acceleration, are exact") {
  for_all_seeds(100, [](Rng& rng) {
    const Vector3d f = random_vector<3>(rng, 10), w = random_vector<3>(rng, 2);
    std::vector<Segment> straight = random_segments(rng, 20, 1), turning = straight;
    double T = 0;
    for (Segment& s : straight) s.gyro.setZero(), s.accel = f, T += s.h;
    for (Segment& s : turning) s.gyro = w, s.accel.setZero();
    const Motion a = integrate(straight), b = integrate(turning);
    CHECK(close(a.dv_mps, (T * f).eval(), 1e-14));
    CHECK(close(a.dp_m, (T * T / 2 * f).eval(), 1e-14));
    CHECK(close(a.dR, Matrix3d::Identity().eval(), 1e-15));
    CHECK(close(b.dR, so3::exp((T * w).eval()), 1e-14));
    CHECK(b.dp_m == Vector3d::Zero());
  });
}

TEST_CASE("a constant body-fixed force in a turn: the midpoint rule is within theta^2 / 24 of the arc") {
  for_all_seeds(50, [](Rng& rng) {
    const Vector3d f = random_vector<3>(rng, 10), w = random_vector<3>(rng, 2);
    const double h = std::pow(10.0, uniform(rng, -3, -1));
    const std::vector<Segment> segments(50, {h, w, f});
    const double T = 50 * h, theta = w.norm() * h;
    const Vector3d exact = so3::left_jacobian((T * w).eval()) * f * T;
    CHECK((integrate(segments).dv_mps - exact).norm() <= 1.1 * theta * theta / 24 * f.norm() * T + 1e-12);
  });
}

TEST_CASE("the series of a half turn and its closed form meet: attitude, motion and bias Jacobians run through the seam") {
  for_all_seeds(50, [](Rng& rng) {
    const Vector3d axis = random_vector<3>(rng).normalized(), f = random_vector<3>(rng, 10);
    const auto at = [&](double angle) { return integrate({{0.1, axis * (angle / 0.1), f}}); };  // |eta| = 1/4 at 0.5 rad
    for (const double angle : {0.4999, 0.4999999999, 0.5000000001, 0.5001, 2.0, 0.0, 1e-9}) {
      CAPTURE(angle);
      const Motion m = at(angle);
      CHECK(close(m.dR, Matrix3d{Eigen::AngleAxisd{angle, axis}.toRotationMatrix()}, 1e-15));
      CHECK(close(m.dv_mps, (0.1 * (Eigen::AngleAxisd{angle / 2, axis} * f)).eval(), 1e-15));
      CHECK(close(m.d_R_d_gyro_bias, (-0.1 * so3::right_jacobian((axis * angle).eval())).eval(), 1e-15));
    }
    CHECK(close(at(0.4999999999).d_v_d_gyro_bias, at(0.5000000001).d_v_d_gyro_bias, 1e-10));
  });
}

TEST_CASE("P7 bias Jacobians equal differences of integrations at other biases") {
  for_all_seeds(100, [](Rng& rng) {
    const std::vector<Segment> segments = random_segments(rng, 25, 1, 3);
    const imu::ImuBias<double> bias{random_vector<3>(rng, 0.2), random_vector<3>(rng, 0.05)};
    const Motion m = integrate(segments, bias);
    for (int axis = 0; axis < 3; ++axis) {
      const double step = 1e-4;
      const Vector3d d = step * Vector3d::Unit(axis);
      const Motion ap = integrate(segments, {bias.accel_b_mps2 + d, bias.gyro_b_radps}),
                   am = integrate(segments, {bias.accel_b_mps2 - d, bias.gyro_b_radps});
      const Motion gp = integrate(segments, {bias.accel_b_mps2, bias.gyro_b_radps + d}),
                   gm = integrate(segments, {bias.accel_b_mps2, bias.gyro_b_radps - d});
      CHECK(close(((ap.dv_mps - am.dv_mps) / (2 * step)).eval(), m.d_v_d_accel_bias.col(axis).eval(), 1e-9));
      CHECK(close(((ap.dp_m - am.dp_m) / (2 * step)).eval(), m.d_p_d_accel_bias.col(axis).eval(), 1e-9));
      CHECK(close(((gp.dv_mps - gm.dv_mps) / (2 * step)).eval(), m.d_v_d_gyro_bias.col(axis).eval(), 1e-7));
      CHECK(close(((gp.dp_m - gm.dp_m) / (2 * step)).eval(), m.d_p_d_gyro_bias.col(axis).eval(), 1e-7));
      const Vector3d turn = (so3::log(m.dR.transpose() * gp.dR) - so3::log(m.dR.transpose() * gm.dR)) / (2 * step);
      CHECK(close(turn, m.d_R_d_gyro_bias.col(axis).eval(), 1e-7));
      CHECK(ap.dR == m.dR);
    }
  });
}

TEST_CASE("first-order correction: exact in the accelerometer bias, second-order small in the gyro bias") {
  for_all_seeds(100, [](Rng& rng) {
    const std::vector<Segment> segments = random_segments(rng, 25, 1);
    const Motion m = integrate(segments);
    const Vector3d da = random_vector<3>(rng, 0.05), dg = random_vector<3>(rng, 1e-3);
    const auto a = m.corrected({da, Vector3d::Zero()});
    const Motion exact = integrate(segments, {da, Vector3d::Zero()});
    CHECK(close(a.dv_mps, exact.dv_mps, 1e-13));
    CHECK(close(a.dp_m, exact.dp_m, 1e-13));
    const Motion turned = integrate(segments, {da, dg});
    const auto b = m.corrected({da, dg});
    double T = 0;
    for (const Segment& each : segments) T += each.h;
    const double turn = dg.norm() * T;  // second order: |a| turn^2 / 2 and |da| turn, both over T
    CHECK((b.dv_mps - turned.dv_mps).norm() < T * (18 * turn * turn / 2 + da.norm() * turn));
    CHECK(so3::log(b.dR.transpose() * turned.dR).norm() < 2e-6);
    CHECK((m.dv_mps - turned.dv_mps).norm() > 1e-4);
  });
}

TEST_CASE("P7 covariance against 100 000 sampled motions, block by block") {
  Rng rng{7};
  check_against_monte_carlo(rng, random_segments(rng, 8, 0.6, 1.5), static_cast<int>(property_runs(100000)), 2);
}

TEST_CASE("P7 one segment: the covariance is positive definite and that of continuous noise") {
  for_all_seeds(3, [](Rng& rng) { check_against_monte_carlo(rng, random_segments(rng, 1, 0.01), 4000, 12); });
  for_all_seeds(100, [](Rng& rng) {
    const double h = std::pow(10.0, uniform(rng, -4, 0));
    const Motion m = integrate({{h, random_vector<3>(rng, 2), random_vector<3>(rng, 20)}}, {}, 1e-6, 3e-8);
    const Vector9 s = m.covariance.diagonal().cwiseSqrt();
    const Matrix9 correlation = s.cwiseInverse().asDiagonal() * m.covariance * s.cwiseInverse().asDiagonal();
    CHECK(Eigen::LLT<Matrix9>{correlation}.info() == Eigen::Success);
    CHECK(m.covariance == m.covariance.transpose());
    // White noise of density q over h: q h in velocity, q h^3 / 3 in position (the gyro's share comes on top).
    CHECK(m.covariance(8, 8) >= 1e-6 * h * (1 - 1e-12));
    CHECK(m.covariance(5, 5) >= 1e-6 * h * h * h / 3 * (1 - 1e-12));
  });
}

TEST_CASE_TEMPLATE("two intervals compose to one: motion, covariance and Jacobians", S, float, double) {
  const double tolerance = std::is_same_v<S, float> ? 2e-5 : 1e-12;
  for_all_seeds(100, [&](Rng& rng) {
    const std::vector<Segment> first = random_segments(rng, 20, 1), second = random_segments(rng, 30, 0.7);
    std::vector<Segment> both = first;
    both.insert(both.end(), second.begin(), second.end());
    double T = 0;
    for (const Segment& s : second) T += s.h;
    const Motion a = integrate<S>(first).template cast<double>(), b = integrate<S>(second).template cast<double>(),
                 c = integrate<S>(both).template cast<double>();
    CHECK(close((a.dR * b.dR).eval(), c.dR, tolerance));
    CHECK(close((a.dv_mps + a.dR * b.dv_mps).eval(), c.dv_mps, tolerance));
    CHECK(close((a.dp_m + T * a.dv_mps + a.dR * b.dp_m).eval(), c.dp_m, tolerance));
    // Errors: phi = R_b' phi_a + phi_b;  n_v = n_va - R_a [dv_b]x phi_a + R_a n_vb;  n_p = n_pa + T n_va - R_a [dp_b]x phi_a + R_a n_pb.
    Matrix9 F = Matrix9::Identity(), G = Matrix9::Identity();
    F.block<3, 3>(0, 0) = b.dR.transpose();
    F.block<3, 3>(3, 0) = -a.dR * so3::skew(b.dp_m);
    F.block<3, 3>(3, 6) = T * Matrix3d::Identity();
    F.block<3, 3>(6, 0) = -a.dR * so3::skew(b.dv_mps);
    G.block<3, 3>(3, 3) = a.dR;
    G.block<3, 3>(6, 6) = a.dR;
    const Matrix9 composed = F * a.covariance * F.transpose() + G * b.covariance * G.transpose();
    const Vector9 s = c.covariance.diagonal().cwiseSqrt().cwiseInverse();
    CHECK((s.asDiagonal() * (composed - c.covariance) * s.asDiagonal()).cwiseAbs().maxCoeff() < tolerance);
    CHECK(close((b.dR.transpose() * a.d_R_d_gyro_bias + b.d_R_d_gyro_bias).eval(), c.d_R_d_gyro_bias, tolerance));
    const Matrix3d dv = a.d_v_d_gyro_bias - a.dR * so3::skew(b.dv_mps) * a.d_R_d_gyro_bias + a.dR * b.d_v_d_gyro_bias;
    CHECK(close(dv, c.d_v_d_gyro_bias, tolerance));
    CHECK(close((a.d_p_d_accel_bias + T * a.d_v_d_accel_bias + a.dR * b.d_p_d_accel_bias).eval(), c.d_p_d_accel_bias, tolerance));
  });
}

TEST_CASE("float follows double over a minute: attitude stays orthonormal, motion and sigmas agree") {
  for_all_seeds(3, [](Rng& rng) {
    const std::vector<Segment> segments = random_segments(rng, 12000, 60, 0.5);
    const auto f = integrate<float>(segments);
    const Motion d = integrate(segments);
    const Eigen::Matrix3f defect = f.dR.transpose() * f.dR - Eigen::Matrix3f::Identity();
    CHECK(defect.norm() < 2e-5f);
    CHECK(so3::log(d.dR.transpose() * f.dR.cast<double>()).norm() < 1e-4);
    CHECK((f.dv_mps.cast<double>() - d.dv_mps).norm() < 2e-3 * 60);
    for (int i = 0; i < 9; ++i) CHECK(static_cast<double>(f.covariance(i, i)) == doctest::Approx(d.covariance(i, i)).epsilon(5e-3));
    const std::vector<Segment> second(segments.begin(), segments.begin() + 200);
    const auto f1 = integrate<float>(second);
    const Motion d1 = integrate(second);
    CHECK((f1.dv_mps.cast<double>() - d1.dv_mps).norm() < 5e-5);  // m/s after one second
    CHECK((f1.dp_m.cast<double>() - d1.dp_m).norm() < 5e-5);
    CHECK(so3::log(d1.dR.transpose() * f1.dR.cast<double>()).norm() < 5e-6);
    const Matrix9 P = f1.covariance.cast<double>();
    CHECK(Eigen::LLT<Matrix9>{P}.info() == Eigen::Success);
  });
}
