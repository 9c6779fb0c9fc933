// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Preintegration between arbitrary times from samples at whatever times they have: online (Preintegration) or of a range (preintegrate).
///
/// Sample k speaks for the segment (t_k-1, t_k]. The part of it inside the interval, from f to t, is integrated with its mean reading:
///
///     mean_to_stamp   the sample itself, since it is the mean of the segment (a part has the mean of the whole)
///     instantaneous   the straight line between samples k-1 and k at the middle of the part, (f + t) / 2, which is the line's mean over it
///
/// So a start or an end between two stamps interpolates or splits, and nothing is held or extrapolated: an interval must be covered by
/// stamps, one at or before its start and one at or after its end.
///
/// Noise is that of the densities over each segment's own length. A segment longer than `bridged_after_s` bridges missing samples; what
/// happened in it is unknown to a constant error of sigma `bridge_*`, so its densities grow by sigma^2 h (variance sigma^2 h^2 in velocity
/// and angle). Segments longer than `max_gap_s` are refused.
///
/// Both ways do the same operations in the same order: equal input, equal bits.
#pragma once

#include <Eigen/Core>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

#include <searvins/core/static_vector.hpp>
#include <searvins/core/status.hpp>
#include <searvins/imu/imu_sample.hpp>
#include <searvins/imu/motion_accumulator.hpp>
#include <searvins/imu/preintegrated_motion.hpp>

namespace searvins::imu {

/// How readings are to be understood, and when they are no longer enough.
struct PreintegrationOptions {
  SampleKind kind{SampleKind::instantaneous};
  ImuNoise noise{};
  double max_gap_s{0.5};         ///< longest segment that is integrated at all
  double bridged_after_s{0.05};  ///< longest segment that counts as sampled; beyond it noise grows, see the file comment
  double bridge_accel_sigma_mps2{1.0}, bridge_gyro_sigma_radps{0.1};
  /// A bias further than this from that of the integration: integrate again, first order no longer does.
  double max_accel_bias_change_mps2{0.05}, max_gyro_bias_change_radps{1e-3};
};

/// Errors: invalid_argument with what is wrong.
[[nodiscard]] inline Status check(const PreintegrationOptions& o) {
  const auto positive = [](double x) { return x > 0 && std::isfinite(x); };
  const auto not_negative = [](double x) { return x >= 0 && std::isfinite(x); };
  if (!positive(o.noise.accel_noise_mps2_sqrt_hz) || !positive(o.noise.gyro_noise_radps_sqrt_hz))
    return failure(StatusCode::invalid_argument, "IMU noise densities must be positive");
  if (!positive(o.max_gap_s) || !positive(o.bridged_after_s))
    return failure(StatusCode::invalid_argument, "IMU gap limits must be positive");
  if (!not_negative(o.bridge_accel_sigma_mps2) || !not_negative(o.bridge_gyro_sigma_radps))
    return failure(StatusCode::invalid_argument, "IMU bridge sigmas must not be negative");
  return ok_status();
}

namespace detail {

inline constexpr const char* kNotFinite = "IMU sample with a NaN or infinite reading";

/// A sample in the scalar of the integration.
template <class S>
struct Reading {
  GpsTime time{};
  Eigen::Matrix<S, 3, 1> gyro_b_radps{Eigen::Matrix<S, 3, 1>::Zero()};
  Eigen::Matrix<S, 3, 1> accel_b_mps2{Eigen::Matrix<S, 3, 1>::Zero()};

  Reading() = default;
  explicit Reading(const ImuSample& s) : time(s.time), gyro_b_radps(s.gyro_b_radps.cast<S>()), accel_b_mps2(s.accel_b_mps2.cast<S>()) {}
  [[nodiscard]] bool finite() const { return gyro_b_radps.allFinite() && accel_b_mps2.allFinite(); }
};

/// later - earlier in seconds for earlier <= later, whatever the two stamps are: a garbage stamp must not overflow.
[[nodiscard]] inline double span_s(GpsTime earlier, GpsTime later) {
  constexpr std::uint64_t longest = std::numeric_limits<std::int64_t>::max();
  const std::uint64_t ns = static_cast<std::uint64_t>(later.ns) - static_cast<std::uint64_t>(earlier.ns);
  return static_cast<double>(static_cast<std::int64_t>(ns < longest ? ns : longest)) * 1e-9;
}

/// Whether a sample may follow one at `last`. Errors: duplicate, out_of_order.
[[nodiscard]] inline Status check_order(GpsTime last, GpsTime next) {
  if (next == last) return failure(StatusCode::duplicate, "IMU sample with the time of the one before");
  if (next < last)
    return failure(StatusCode::out_of_order, "IMU sample earlier than the one before: value, seconds", -1, -1, span_s(next, last));
  return ok_status();
}

/// Whether the segment between two samples may be integrated. Errors: no_data.
[[nodiscard]] inline Status check_gap(GpsTime last, GpsTime next, double max_gap_s) {
  const double gap_s = span_s(last, next);
  if (gap_s > max_gap_s)
    return failure(StatusCode::no_data, "gap in the IMU samples, longer than max_gap_s: value, seconds", -1, -1, gap_s);
  return ok_status();
}

/// Integrates the part from..to of the segment (a.time, b.time]: the rules of the file comment.
template <class S>
void advance(MotionAccumulator<S>& motion, const Reading<S>& a, const Reading<S>& b, GpsTime from, GpsTime to,
             const PreintegrationOptions& o) {
  const bool whole = from == a.time && to == b.time;
  const double segment_s = span_s(a.time, b.time);
  const S h = static_cast<S>(whole ? segment_s : span_s(from, to));
  double accel_psd = o.noise.accel_noise_mps2_sqrt_hz * o.noise.accel_noise_mps2_sqrt_hz;
  double gyro_psd = o.noise.gyro_noise_radps_sqrt_hz * o.noise.gyro_noise_radps_sqrt_hz;
  if (segment_s > o.bridged_after_s) {
    accel_psd += o.bridge_accel_sigma_mps2 * o.bridge_accel_sigma_mps2 * segment_s;
    gyro_psd += o.bridge_gyro_sigma_radps * o.bridge_gyro_sigma_radps * segment_s;
  }
  if (o.kind == SampleKind::mean_to_stamp) {
    motion.advance(h, b.gyro_b_radps, b.accel_b_mps2, static_cast<S>(accel_psd), static_cast<S>(gyro_psd));
    return;
  }
  const S share = static_cast<S>(whole ? 0.5 : (span_s(a.time, from) + span_s(a.time, to)) / (2 * segment_s));
  motion.advance(h, a.gyro_b_radps + share * (b.gyro_b_radps - a.gyro_b_radps), a.accel_b_mps2 + share * (b.accel_b_mps2 - a.accel_b_mps2),
                 static_cast<S>(accel_psd), static_cast<S>(gyro_psd));
}

/// The motion from..to. Errors: non_finite when the numbers have run away.
template <class S>
[[nodiscard]] Result<PreintegratedMotion<S>> finish(const MotionAccumulator<S>& motion, GpsTime from, GpsTime to) {
  PreintegratedMotion<S> m;
  motion.write(m);
  m.start = from, m.end = to, m.duration_s = static_cast<S>(span_s(from, to));
  if (!m.finite()) return failure(StatusCode::non_finite, "IMU readings too large to integrate");
  return m;
}

}  // namespace detail

/// Preintegration of a range of samples in chronological order, from `from` to `to`. Only the samples around and inside are read.
/// Errors: invalid_argument (to <= from; options; bias), no_data (not covered at a side, or a gap), non_finite, duplicate, out_of_order;
/// `index` is the sample where there is one.
template <class S>
[[nodiscard]] Result<PreintegratedMotion<S>> preintegrate(std::span<const ImuSample> samples, GpsTime from, GpsTime to,
                                                          const ImuBias<S>& bias, const PreintegrationOptions& options = {}) {
  if (const Status s = check(options); !s.ok()) return s;
  if (!bias.finite()) return failure(StatusCode::non_finite, "IMU bias with a NaN or infinite component");
  if (to <= from) return failure(StatusCode::invalid_argument, "an interval must end after its start");
  std::size_t k = 0;
  while (k < samples.size() && samples[k].time <= from) ++k;
  if (k == 0) return failure(StatusCode::no_data, "no IMU sample at or before the start of the interval");
  MotionAccumulator<S> motion{bias};
  detail::Reading<S> a{samples[k - 1]};
  if (!a.finite()) return failure(StatusCode::non_finite, detail::kNotFinite, static_cast<std::int32_t>(k - 1));
  for (; k < samples.size(); ++k) {
    const detail::Reading<S> b{samples[k]};
    Status s = b.finite() ? detail::check_order(a.time, b.time) : failure(StatusCode::non_finite, detail::kNotFinite);
    if (s.ok()) s = detail::check_gap(a.time, b.time, options.max_gap_s);
    if (!s.ok()) {
      s.index = static_cast<std::int32_t>(k);
      return s;
    }
    detail::advance(motion, a, b, a.time < from ? from : a.time, b.time < to ? b.time : to, options);
    if (to <= b.time) return detail::finish(motion, from, to);
    a = b;
  }
  return failure(StatusCode::no_data, "no IMU sample at or after the end of the interval");
}

/// Online preintegration that keeps its samples: Capacity of them from just before the start on. All but the newest segment are integrated
/// already, so `until` a time in the newest segment costs one segment, and an earlier one a pass over the samples. 64 Capacity bytes in
/// double.
template <class S, std::size_t Capacity>
class Preintegration {
  static_assert(Capacity >= 2, "a segment has two ends");

 public:
  /// Forgets everything and begins at `t`. Errors: invalid_argument, non_finite; then nothing was changed.
  Status start(GpsTime t, const ImuBias<S>& bias, const PreintegrationOptions& options = {}) {
    if (const Status s = check(options); !s.ok()) return s;
    if (!bias.finite()) return failure(StatusCode::non_finite, "IMU bias with a NaN or infinite component");
    options_ = options, start_ = t, bias_ = bias, motion_ = MotionAccumulator<S>{bias};
    readings_.clear();
    return ok_status();
  }

  /// The next sample. Up to the start only the newest is kept. Errors, with nothing changed: non_finite, duplicate, out_of_order, no_data
  /// (a gap, or no sample at or before the start), capacity_exceeded (restart, or take the motion and start anew).
  Status push(const ImuSample& sample) {
    const detail::Reading<S> next{sample};
    if (!next.finite()) return failure(StatusCode::non_finite, detail::kNotFinite);
    if (!readings_.empty())
      if (const Status s = detail::check_order(readings_.back().time, next.time); !s.ok()) return s;
    if (next.time <= start_) {
      readings_.clear();
      readings_.push_back(next);
      return ok_status();
    }
    if (readings_.empty()) return failure(StatusCode::no_data, "no IMU sample at or before the start of the interval");
    if (const Status s = detail::check_gap(readings_.back().time, next.time, options_.max_gap_s); !s.ok()) return s;
    if (readings_.full())
      return failure(StatusCode::capacity_exceeded, "too many IMU samples in one interval: raise Capacity",
                     static_cast<std::int32_t>(Capacity));
    commit_newest();
    readings_.push_back(next);
    return ok_status();
  }

  /// The motion from the start to `t`. Errors: invalid_argument (t not after the start), no_data (no sample at or after t yet), non_finite.
  [[nodiscard]] Result<PreintegratedMotion<S>> until(GpsTime t) const {
    if (t <= start_) return failure(StatusCode::invalid_argument, "an interval must end after its start");
    const std::size_t n = readings_.size();
    if (n < 2 || readings_.back().time < t) return failure(StatusCode::no_data, "no IMU sample at or after the end of the interval");
    if (readings_[n - 2].time < t) {
      MotionAccumulator<S> motion = motion_;
      advance(motion, n - 1, t);
      return detail::finish(motion, start_, t);
    }
    MotionAccumulator<S> motion{bias_};
    for (std::size_t k = 1;; ++k) {
      advance(motion, k, t);
      if (t <= readings_[k].time) return detail::finish(motion, start_, t);
    }
  }

  /// Begins the next interval at `t` with another bias, keeping the samples that it needs. Errors, with nothing changed: non_finite (bias),
  /// no_data (no sample at or before t).
  Status restart(GpsTime t, const ImuBias<S>& bias) {
    if (!bias.finite()) return failure(StatusCode::non_finite, "IMU bias with a NaN or infinite component");
    std::size_t before = 0;
    while (before < readings_.size() && readings_[before].time <= t) ++before;
    if (before == 0) return failure(StatusCode::no_data, "no IMU sample at or before the start of the interval");
    std::size_t k = 0;
    readings_.erase_if([&](const detail::Reading<S>&) { return k++ + 1 < before; });
    start_ = t;
    integrate(bias);
    return ok_status();
  }

  /// Integrates the samples again with another bias. Errors, with nothing changed: non_finite.
  Status reintegrate(const ImuBias<S>& bias) {
    if (!bias.finite()) return failure(StatusCode::non_finite, "IMU bias with a NaN or infinite component");
    integrate(bias);
    return ok_status();
  }

  /// Whether a bias is beyond the reach of the first-order correction (limits in the options, per axis).
  [[nodiscard]] bool bias_moved(const ImuBias<S>& bias) const {
    const auto near = [](const auto& difference, double limit) { return (difference.cwiseAbs().array() <= static_cast<S>(limit)).all(); };
    return !(near(bias.accel_b_mps2 - bias_.accel_b_mps2, options_.max_accel_bias_change_mps2) &&
             near(bias.gyro_b_radps - bias_.gyro_b_radps, options_.max_gyro_bias_change_radps));  // a NaN is not near
  }

  [[nodiscard]] GpsTime start_time() const { return start_; }
  [[nodiscard]] std::size_t size() const { return readings_.size(); }
  [[nodiscard]] bool empty() const { return readings_.empty(); }
  /// Time of the newest sample: until() reaches no further. The start when there is none.
  [[nodiscard]] GpsTime newest_time() const { return readings_.empty() ? start_ : readings_.back().time; }
  [[nodiscard]] const ImuBias<S>& bias() const { return bias_; }
  [[nodiscard]] const PreintegrationOptions& options() const { return options_; }

 private:
  /// Integrates segment k up to `t` at most.
  void advance(MotionAccumulator<S>& motion, std::size_t k, GpsTime t) const {
    const detail::Reading<S>&a = readings_[k - 1], &b = readings_[k];
    detail::advance(motion, a, b, a.time < start_ ? start_ : a.time, b.time < t ? b.time : t, options_);
  }
  void commit_newest() {
    if (readings_.size() >= 2) advance(motion_, readings_.size() - 1, readings_.back().time);
  }
  void integrate(const ImuBias<S>& bias) {
    bias_ = bias, motion_ = MotionAccumulator<S>{bias};
    for (std::size_t k = 1; k + 1 < readings_.size(); ++k) advance(motion_, k, readings_[k].time);
  }

  PreintegrationOptions options_{};
  GpsTime start_{};
  ImuBias<S> bias_{};
  StaticVector<detail::Reading<S>, Capacity> readings_{};
  MotionAccumulator<S> motion_{};  ///< from the start to the last but one sample
};

}  // namespace searvins::imu
