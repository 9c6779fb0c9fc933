// SPDX-License-Identifier: BSD-3-Clause
// Rotations and preintegration in float and double: what they compute, how far float is from double, and what each costs.
#include <algorithm>
#include <cstdint>
#include <limits>
#include <span>

#include <searvins/imu/preintegration.hpp>
#include <searvins/math/block_cholesky.hpp>
#include <searvins/math/so3.hpp>

#include "examples/cortex_m/transcript.hpp"

namespace searvins::cortex_m {
namespace {

template <class S>
using Vector = Eigen::Matrix<S, 3, 1>;

/// The scalar's name and how many digits of a result must be alike on target and host.
template <class S>
inline constexpr bool kSingle = sizeof(S) == sizeof(float);
template <class S>
inline constexpr int kDigits = kSingle<S> ? 5 : 13;

/// Uniform in [-1, 1), the same numbers everywhere.
class Numbers {
 public:
  double next() {
    state_ = state_ * 6364136223846793005ULL + 1442695040888963407ULL;
    return static_cast<double>(static_cast<std::int64_t>(state_) >> 11) * 0x1p-52;
  }
  Eigen::Vector3d vector(double size) {
    const double x = next(), y = next();
    return size * Eigen::Vector3d{x, y, next()};
  }

 private:
  std::uint64_t state_{20260214};
};

constexpr int kVectors = 64;

/// A quarter of the rotation vectors is tiny, the others go up to 3.1 rad.
template <class S>
Vector<S> rotation_vector(Numbers& numbers, int k) {
  const Eigen::Vector3d v = numbers.vector(1);
  return (v * ((k % 4 == 0 ? 1e-5 : 3.1 * (k + 1) / kVectors) / v.norm())).cast<S>();
}

/// exp and log undo each other, Jacobians and their inverses too; all to some epsilon.
template <class S>
bool rotations(const char* name) {
  Numbers numbers;
  S worst = 0, worst_jacobian = 0;
  Vector<S> sum = Vector<S>::Zero();
  for (int k = 0; k < kVectors; ++k) {
    const Vector<S> v = rotation_vector<S>(numbers, k);
    const Vector<S> back = so3::log(so3::exp(v));
    worst = std::max(worst, (back - v).norm());
    const so3::Matrix3<S> product = so3::right_jacobian(v) * so3::right_jacobian_inverse(v);
    worst_jacobian = std::max(worst_jacobian, (product - so3::Matrix3<S>::Identity()).norm());
    sum += so3::quaternion_exp(v).vec() + so3::left_jacobian(v).col(k % 3);
  }
  for (int i = 0; i < 3; ++i) report_close(name, i, static_cast<double>(sum[i]), kDigits<S>);
  report_close(name, 3, static_cast<double>(worst), kDigits<S>);
  return worst < S(32) * std::numeric_limits<S>::epsilon() && worst_jacobian < S(64) * std::numeric_limits<S>::epsilon();
}

constexpr int kSamples = 401;  // two seconds at 200 Hz
constexpr GpsTime kStart{1'433'649'600'000'000'000};

/// A hard-driven second: polynomials in time and a little noise, so that no sine is asked of a library.
std::span<const imu::ImuSample> samples() {
  static imu::ImuSample list[kSamples];
  Numbers numbers;
  for (int k = 0; k < kSamples; ++k) {
    const double t = k / 200.0, wave = t * (1 - t) * (2 - t);
    list[k].time = GpsTime{kStart.ns + k * std::int64_t{5'000'000}};
    list[k].gyro_b_radps = Eigen::Vector3d{0.4 * wave, -0.3 * wave, 0.5 + 0.8 * wave} + numbers.vector(1e-3);
    list[k].accel_b_mps2 = Eigen::Vector3d{3 * wave, 2 - t, 9.8 + wave} + numbers.vector(2e-2);
  }
  return list;
}

template <class S>
imu::ImuBias<S> bias() {
  return imu::ImuBias<double>{{0.02, -0.01, 0.03}, {1e-3, 2e-3, -1e-3}}.cast<S>();
}

template <class S>
imu::PreintegratedMotion<S> motion_of(std::span<const imu::ImuSample> list) {
  const auto m = imu::preintegrate<S>(list, kStart.plus_seconds(0.0123), kStart.plus_seconds(1.9871), bias<S>());
  return m.ok() ? *m : imu::PreintegratedMotion<S>{};
}

template <class S>
imu::PreintegratedMotion<S> preintegration(const char* name) {
  const auto m = motion_of<S>(samples());
  const Vector<S> angle = so3::log(m.dR);
  for (int i = 0; i < 3; ++i) {
    report_close(name, i, static_cast<double>(angle[i]), kDigits<S>);
    report_close(name, 3 + i, static_cast<double>(m.dp_m[i]), kDigits<S>);
    report_close(name, 6 + i, static_cast<double>(m.dv_mps[i]), kDigits<S>);
    report_close(name, 9 + i, static_cast<double>(m.d_p_d_gyro_bias(i, i)), kDigits<S>);
  }
  report_close(name, 12, static_cast<double>(m.covariance.trace()), kDigits<S>);
  return m;
}

/// Float keeps a tenth of a millimetre, of a millimetre a second and of a milliradian over two seconds: far below the noise of any unit.
bool float_is_near(const imu::PreintegratedMotion<float>& f, const imu::PreintegratedMotion<double>& d) {
  const double angle = so3::log((f.dR.cast<double>().transpose() * d.dR).eval()).norm();
  const double position = (f.dp_m.cast<double>() - d.dp_m).norm(), velocity = (f.dv_mps.cast<double>() - d.dv_mps).norm();
  const double covariance = (f.covariance.cast<double>() - d.covariance).norm() / d.covariance.norm();
  report_close("float_minus_double", 0, angle, 6);
  report_close("float_minus_double", 1, position, 5);
  report_close("float_minus_double", 2, velocity, 5);
  return angle < 1e-5 && position < 1e-4 && velocity < 1e-4 && covariance < 1e-4;
}

/// Instructions of `work(k)` for k = 0 ... repeats - 1, per repeat.
template <class Work>
void cost(const char* name, int repeats, Work work) {
  const std::uint64_t before = instructions();
  for (int k = 0; k < repeats; ++k) work(k);
  remark(name, static_cast<std::int64_t>((instructions() - before) / static_cast<std::uint64_t>(repeats)), "instructions");
}

/// Somewhere to put results, so that they are computed.
volatile double sink;

template <class S>
void costs() {
  Numbers numbers;
  static Vector<S> vectors[kVectors];
  for (int k = 0; k < kVectors; ++k) vectors[k] = rotation_vector<S>(numbers, k);
  const so3::Matrix3<S> R = so3::exp(vectors[17]);
  write(kSingle<S> ? "# float\n" : "# double\n");
  cost("  rotation: exp", kVectors, [](int k) { sink = static_cast<double>(so3::exp(vectors[k])(0, 0)); });
  cost("  rotation: log", kVectors, [&R](int k) { sink = static_cast<double>(so3::log(R)[k % 3]); });
  cost("  rotation: inverse right Jacobian", kVectors,
       [](int k) { sink = static_cast<double>(so3::right_jacobian_inverse(vectors[k])(0, 0)); });
  const auto list = samples();
  const std::uint64_t before = instructions();
  sink = static_cast<double>(motion_of<S>(list).dp_m[0]);
  remark("  preintegration, a sample", static_cast<std::int64_t>((instructions() - before) / (kSamples - 5)), "instructions");

  constexpr int n = 45;
  static S matrix[n * n], reference[n];
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) matrix[j * n + i] = static_cast<S>(i == j ? n : 1 / (1.0 + i + j)), reference[i] = S(n);
  cost("  Cholesky of 45 x 45", 1, [](int) { sink = math::partial_cholesky(matrix, n, n, n, reference).ok() ? 1 : 0; });
}

bool run() {
  const bool float_holds = rotations<float>("rotations_float"), double_holds = rotations<double>("rotations_double");
  const auto f = preintegration<float>("preintegration_float");
  const auto d = preintegration<double>("preintegration_double");
  const bool near = float_is_near(f, d);
  costs<float>();
  costs<double>();
  return float_holds && double_holds && near && d.duration_s > 1.9;
}

}  // namespace
}  // namespace searvins::cortex_m

int main() { return searvins::cortex_m::finish(searvins::cortex_m::run()); }
