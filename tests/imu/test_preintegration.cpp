// SPDX-License-Identifier: BSD-3-Clause
// Preintegration between arbitrary times: coverage, kinds of samples, range against online, re-integration, bad input.
#include <searvins/imu/preintegration.hpp>

#include <searvins/imu/preintegrated_motion.hpp>

#include <algorithm>
#include <cstring>
#include <limits>
#include <memory>
#include <vector>

#include "imu/simulated_motion.hpp"
#include "support/property.hpp"

using namespace searvins;
using namespace searvins::test;
using Eigen::Vector3d;
using imu::ImuSample;
using imu::SampleKind;

namespace {

template <class S>
using Motion = imu::PreintegratedMotion<S>;
template <class S>
using Online = imu::Preintegration<S, 512>;

/// Every number of two motions is the same bits.
template <class S>
bool same_bits(const Motion<S>& a, const Motion<S>& b) {
  return a.start == b.start && a.end == b.end && a.duration_s == b.duration_s && a.dR == b.dR && a.dp_m == b.dp_m && a.dv_mps == b.dv_mps &&
         a.covariance == b.covariance && a.d_R_d_gyro_bias == b.d_R_d_gyro_bias && a.d_p_d_accel_bias == b.d_p_d_accel_bias &&
         a.d_p_d_gyro_bias == b.d_p_d_gyro_bias && a.d_v_d_accel_bias == b.d_v_d_accel_bias && a.d_v_d_gyro_bias == b.d_v_d_gyro_bias &&
         a.bias.accel_b_mps2 == b.bias.accel_b_mps2 && a.bias.gyro_b_radps == b.bias.gyro_b_radps;
}

imu::PreintegrationOptions options_of(SampleKind kind) {
  imu::PreintegrationOptions o;
  o.kind = kind;
  return o;
}

SampleKind random_kind(Rng& rng) { return chance(rng, 0.5) ? SampleKind::instantaneous : SampleKind::mean_to_stamp; }

template <class S>
imu::ImuBias<S> random_bias(Rng& rng) {
  return imu::ImuBias<double>{random_vector<3>(rng, 0.1), random_vector<3>(rng, 0.01)}.cast<S>();
}

/// Largest difference of attitude, position and velocity.
double difference(const Motion<double>& a, const Motion<double>& b) {
  return std::max({so3::log(a.dR.transpose() * b.dR).norm(), (a.dp_m - b.dp_m).norm(), (a.dv_mps - b.dv_mps).norm()});
}

}  // namespace

TEST_CASE_TEMPLATE("a range and one sample at a time give the same bits, whatever else was asked in between", S, float, double) {
  for_all_seeds(60, [](Rng& rng) {
    const SimulatedMotion m = SimulatedMotion::random(rng);
    const SampleKind kind = random_kind(rng);
    const auto list = m.samples(random_times(rng, 2.0, 100), kind);
    const auto bias = random_bias<S>(rng);
    const GpsTime from = chance(rng, 0.3) ? list[3].time : m.time(uniform(rng, 0, 0.3)),
                  to = chance(rng, 0.3) ? list[list.size() - 2].time : m.time(uniform(rng, 1.5, 2));
    const auto range = imu::preintegrate<S>(list, from, to, bias, options_of(kind));
    REQUIRE(range.ok());
    const auto online = std::make_unique<Online<S>>();
    REQUIRE(online->start(from, bias, options_of(kind)).ok());
    for (const ImuSample& s : list) {
      REQUIRE(online->push(s).ok());
      if (chance(rng, 0.1)) (void)online->until(m.time(uniform(rng, -0.1, 2.1)));
      if (online->newest_time() >= to) {
        const auto now = online->until(to);
        REQUIRE(now.ok());
        CHECK(same_bits(*now, *range));
      }
    }
  });
}

TEST_CASE("P17 intervals at any rate against samples at any rate: each interval is covered, and together they are one") {
  for_all_seeds(10, [](Rng& rng) {
    const SimulatedMotion m = SimulatedMotion::random(rng);
    for (const double imu_hz : {50.0, 100.0, 200.0})
      for (const double epoch_hz : {1.0, 5.0, 10.0, 20.0, 30.0}) {
        CAPTURE(imu_hz);
        CAPTURE(epoch_hz);
        const SampleKind kind = random_kind(rng);
        const auto list = m.samples(uniform_times(2.2, imu_hz), kind);
        const double offset = uniform(rng, 0.01, 0.1);
        const auto online = std::make_unique<Online<double>>();
        REQUIRE(online->start(m.time(offset), {}, options_of(kind)).ok());
        Motion<double> sum;
        int epoch = 0;
        const int epochs = static_cast<int>(2 * epoch_hz);
        for (const ImuSample& s : list) {
          REQUIRE(online->push(s).ok());
          while (epoch < epochs && online->newest_time() >= m.time(offset + (epoch + 1) / epoch_hz)) {
            const GpsTime t = m.time(offset + ++epoch / epoch_hz);
            const auto part = online->until(t);
            REQUIRE(part.ok());
            sum.dp_m += part->duration_s * sum.dv_mps + sum.dR * part->dp_m;
            sum.dv_mps += sum.dR * part->dv_mps;
            sum.dR = (sum.dR * part->dR).eval();
            REQUIRE(online->restart(t, {}).ok());
          }
        }
        CHECK(epoch == epochs);
        const auto whole = imu::preintegrate<double>(list, m.time(offset), m.time(offset + epochs / epoch_hz), {}, options_of(kind));
        REQUIRE(whole.ok());
        CHECK(difference(sum, *whole) < 20 / (imu_hz * imu_hz) * 0.1);  // splitting a segment differs in the second order only
      }
  });
}

TEST_CASE("splitting at a stamp is exact") {
  for_all_seeds(60, [](Rng& rng) {
    const SimulatedMotion m = SimulatedMotion::random(rng);
    const SampleKind kind = random_kind(rng);
    const auto list = m.samples(random_times(rng, 1.0, 100), kind);
    const GpsTime a = m.time(0.05), c = list.back().time, b = list[list.size() / 2].time;
    const auto first = imu::preintegrate<double>(list, a, b, {}, options_of(kind)),
               second = imu::preintegrate<double>(list, b, c, {}, options_of(kind)),
               both = imu::preintegrate<double>(list, a, c, {}, options_of(kind));
    REQUIRE((first.ok() && second.ok() && both.ok()));
    Motion<double> sum = *first;
    sum.dp_m += second->duration_s * sum.dv_mps + sum.dR * second->dp_m;
    sum.dv_mps += sum.dR * second->dv_mps;
    sum.dR = (sum.dR * second->dR).eval();
    CHECK(difference(sum, *both) < 1e-13);
  });
}

TEST_CASE(
    "readings that are linear in time are met exactly by interpolation, piecewise constant ones by splitting; without rotation velocity "
    "has no error") {
  for_all_seeds(60, [](Rng& rng) {
    const Vector3d f0 = random_vector<3>(rng, 10), slope = random_vector<3>(rng, 5);
    const std::vector<double> times = random_times(rng, 1.0, 30);
    const GpsTime epoch{1'300'000'000'000'000'000};
    std::vector<ImuSample> linear, mean;
    for (std::size_t k = 0; k < times.size(); ++k) {
      const GpsTime t = epoch.plus_seconds(times[k]);
      const double here = seconds_between(epoch, t), before = k > 0 ? seconds_between(epoch, mean.back().time) : here - 0.01;
      linear.push_back({t, Vector3d::Zero(), f0 + here * slope});
      mean.push_back({t, Vector3d::Zero(), f0 + (here + before) / 2 * slope});
    }
    const double from = uniform(rng, 0, 0.3), to = uniform(rng, 0.7, 1);
    const GpsTime start = epoch.plus_seconds(from), end = epoch.plus_seconds(to);
    const auto m = imu::preintegrate<double>(linear, start, end, {}, options_of(SampleKind::instantaneous));
    REQUIRE(m.ok());
    CHECK((m->dv_mps - ((to - from) * f0 + (to * to - from * from) / 2 * slope)).norm() < 1e-7);  // stamps are whole nanoseconds
    // Means from stamp to stamp are exact between stamps.
    const auto n = imu::preintegrate<double>(mean, mean[1].time, mean.back().time, {}, options_of(SampleKind::mean_to_stamp));
    REQUIRE(n.ok());
    const double a = seconds_between(epoch, mean[1].time), b = seconds_between(epoch, mean.back().time);
    CHECK((n->dv_mps - ((b - a) * f0 + (b * b - a * a) / 2 * slope)).norm() < 1e-11);
  });
}

TEST_CASE("re-integration equals a fresh integration at the new bias, bit for bit; the threshold says when") {
  for_all_seeds(40, [](Rng& rng) {
    const SimulatedMotion m = SimulatedMotion::random(rng);
    const auto list = m.samples(random_times(rng, 1.0, 100), SampleKind::instantaneous);
    const auto a = random_bias<double>(rng), b = random_bias<double>(rng);
    const auto online = std::make_unique<Online<double>>(), fresh = std::make_unique<Online<double>>();
    REQUIRE((online->start(m.time(0.1), a).ok() && fresh->start(m.time(0.1), b).ok()));
    for (const ImuSample& s : list) REQUIRE((online->push(s).ok() && fresh->push(s).ok()));
    REQUIRE(online->reintegrate(b).ok());
    CHECK(same_bits(*online->until(m.time(0.9)), *fresh->until(m.time(0.9))));
    CHECK(same_bits(*online->until(m.time(0.9)), *imu::preintegrate<double>(list, m.time(0.1), m.time(0.9), b)));

    CHECK(!online->bias_moved(b));
    for (int axis = 0; axis < 3; ++axis)
      for (const double sign : {-1.0, 1.0}) {
        auto c = b;
        c.accel_b_mps2[axis] += sign * 0.0499;
        CHECK(!online->bias_moved(c));
        c.accel_b_mps2[axis] += sign * 0.0002;
        CHECK(online->bias_moved(c));
        c = b;
        c.gyro_b_radps[axis] += sign * 0.00099;
        CHECK(!online->bias_moved(c));
        c.gyro_b_radps[axis] += sign * 0.00002;
        CHECK(online->bias_moved(c));
      }
    auto lost = b;
    lost.gyro_b_radps[1] = std::numeric_limits<double>::quiet_NaN();
    CHECK(online->bias_moved(lost));
    CHECK(online->reintegrate(lost).code == StatusCode::non_finite);
    CHECK(same_bits(*online->until(m.time(0.9)), *fresh->until(m.time(0.9))));
  });
}

TEST_CASE("a restarted interval equals a fresh one from there, bit for bit") {
  for_all_seeds(40, [](Rng& rng) {
    const SimulatedMotion m = SimulatedMotion::random(rng);
    const SampleKind kind = random_kind(rng);
    const auto list = m.samples(random_times(rng, 2.0, 100), kind);
    const auto a = random_bias<double>(rng), b = random_bias<double>(rng);
    const auto online = std::make_unique<Online<double>>();
    REQUIRE(online->start(m.time(0.1), a, options_of(kind)).ok());
    const GpsTime next = chance(rng, 0.3) ? list[20].time : m.time(uniform(rng, 0.2, 1.5));
    const GpsTime when = m.time(uniform(rng, 1.5, 2));
    bool restarted = false;
    for (const ImuSample& s : list) {
      REQUIRE(online->push(s).ok());
      if (!restarted && s.time >= when) {
        REQUIRE(online->restart(next, b).ok());
        restarted = true;
        CHECK(online->start_time() == next);
      }
    }
    if (!restarted) REQUIRE(online->restart(next, b).ok());
    const auto fresh = imu::preintegrate<double>(list, next, list.back().time, b, options_of(kind));
    const auto now = online->until(list.back().time);
    REQUIRE((fresh.ok() && now.ok()));
    CHECK(same_bits(*now, *fresh));
    CHECK(online->restart(m.time(-1), a).code == StatusCode::no_data);  // before the first sample that is kept
    CHECK(same_bits(*online->until(list.back().time), *fresh));
  });
}

TEST_CASE("P8 duplicate, backward, non-finite and too late samples are refused, and nothing changes") {
  for_all_seeds(40, [](Rng& rng) {
    const SimulatedMotion m = SimulatedMotion::random(rng);
    const auto list = m.samples(uniform_times(1.0, 100), SampleKind::instantaneous);
    const auto clean = std::make_unique<Online<double>>(), dirty = std::make_unique<Online<double>>();
    REQUIRE((clean->start(m.time(0), {}).ok() && dirty->start(m.time(0), {}).ok()));
    constexpr double nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
    for (const ImuSample& s : list) {
      REQUIRE((clean->push(s).ok() && dirty->push(s).ok()));
      ImuSample bad = s;
      bad.accel_b_mps2.setConstant(100);
      CHECK(dirty->push(bad).code == StatusCode::duplicate);
      bad.time.ns = s.time.ns - integer(rng, 1, 1'000'000'000);
      CHECK(dirty->push(bad).code == StatusCode::out_of_order);
      bad.time.ns = std::numeric_limits<std::int64_t>::min();
      CHECK(dirty->push(bad).code == StatusCode::out_of_order);
      if (s.time > m.time(0)) {
        bad.time.ns = s.time.ns + 500'000'001;
        const Status gap = dirty->push(bad);
        CHECK(gap.code == StatusCode::no_data);
        CHECK(gap.value == doctest::Approx(0.500000001).epsilon(1e-12));
        bad.time.ns = std::numeric_limits<std::int64_t>::max();
        CHECK(dirty->push(bad).code == StatusCode::no_data);
      }
      bad = s, bad.time.ns += 1;
      (chance(rng, 0.5) ? bad.gyro_b_radps : bad.accel_b_mps2)[integer(rng, 0, 2)] = chance(rng, 0.5) ? nan : -infinity;
      CHECK(dirty->push(bad).code == StatusCode::non_finite);
    }
    CHECK(same_bits(*clean->until(m.time(1)), *dirty->until(m.time(1))));
  });
}

TEST_CASE("P8 dropped, doubled and shuffled stamps in a range: named with the sample, never integrated") {
  for_all_seeds(60, [](Rng& rng) {
    const SimulatedMotion m = SimulatedMotion::random(rng);
    auto list = m.samples(uniform_times(1.0, 100), SampleKind::instantaneous);
    const auto k = static_cast<std::size_t>(integer(rng, 20, 80));
    const auto result = [&] { return imu::preintegrate<double>(list, m.time(0.1), m.time(0.9), {}).status(); };
    CHECK(result().ok());
    const auto good = list;
    list.insert(list.begin() + static_cast<std::ptrdiff_t>(k), list[k]);
    CHECK(result().code == StatusCode::duplicate);
    CHECK(result().index == static_cast<std::int32_t>(k + 1));
    list = good;
    std::swap(list[k], list[k + 1]);
    CHECK(result().code == StatusCode::out_of_order);
    CHECK(result().index == static_cast<std::int32_t>(k + 1));
    list = good;
    list[k].gyro_b_radps.x() = std::numeric_limits<double>::infinity();
    CHECK(result().code == StatusCode::non_finite);
    CHECK(result().index == static_cast<std::int32_t>(k));
    list = good;
    list.erase(list.begin() + 20, list.begin() + 75);
    CHECK(result().code == StatusCode::no_data);
    CHECK(result().index == 20);
  });
}

TEST_CASE("P8 a bridged gap inflates the noise by sigma^2 h^2 and nothing else; both sides of the limits") {
  const GpsTime epoch{1'300'000'000'000'000'000};
  const auto at = [&](std::int64_t ms) { return ImuSample{{epoch.ns + ms * 1'000'000}, Vector3d::Zero(), Vector3d{0, 0, 9.8}}; };
  const auto sigma_v = [&](std::int64_t gap_ms) {
    const std::vector<ImuSample> list{at(0), at(10), at(10 + gap_ms), at(20 + gap_ms)};
    const auto m = imu::preintegrate<double>(list, list.front().time, list.back().time, {});
    return m.ok() ? std::sqrt(m->covariance(8, 8)) : -1.0;
  };
  const double q = 9.8e-4 * 9.8e-4;
  CHECK(sigma_v(50) == doctest::Approx(std::sqrt(q * 0.07)).epsilon(1e-9));
  CHECK(sigma_v(51) == doctest::Approx(std::sqrt(q * 0.071 + 0.051 * 0.051)).epsilon(1e-9));
  CHECK(sigma_v(500) == doctest::Approx(std::sqrt(q * 0.52 + 0.25)).epsilon(1e-9));
  CHECK(sigma_v(501) == -1.0);
}

TEST_CASE("coverage: a stamp at or before the start and one at or after the end, exactly at either is enough") {
  const GpsTime epoch{1'300'000'000'000'000'000};
  std::vector<ImuSample> list;
  for (int k = 0; k <= 10; ++k) list.push_back({{epoch.ns + k * 10'000'000}, Vector3d::Zero(), Vector3d{0, 0, 9.8}});
  const auto code = [&](std::int64_t from_ns, std::int64_t to_ns) {
    const auto range = imu::preintegrate<double>(list, {epoch.ns + from_ns}, {epoch.ns + to_ns}, {}).status().code;
    const auto online = std::make_unique<Online<double>>();
    REQUIRE(online->start({epoch.ns + from_ns}, {}).ok());
    for (const ImuSample& s : list)
      if (const Status pushed = online->push(s); !pushed.ok()) {
        CHECK(pushed.code == StatusCode::no_data);
        CHECK(online->empty());
      }
    CHECK(online->until({epoch.ns + to_ns}).status().code == range);
    return range;
  };
  CHECK(code(0, 100'000'000) == StatusCode::ok);
  CHECK(code(-1, 100'000'000) == StatusCode::no_data);
  CHECK(code(0, 100'000'001) == StatusCode::no_data);
  CHECK(code(1, 2) == StatusCode::ok);
  CHECK(code(99'999'999, 100'000'000) == StatusCode::ok);
  CHECK(code(50, 50) == StatusCode::invalid_argument);
  CHECK(code(50, 49) == StatusCode::invalid_argument);
  CHECK(code(100'000'000, 100'000'001) == StatusCode::no_data);
  list.clear();
  CHECK(code(0, 1) == StatusCode::no_data);
}

TEST_CASE("P27 an end among the samples that have arrived is served late, one before the start is refused") {
  Rng rng{27};
  const SimulatedMotion m = SimulatedMotion::random(rng);
  const auto list = m.samples(uniform_times(1.0, 100), SampleKind::mean_to_stamp);
  const auto online = std::make_unique<Online<double>>();
  REQUIRE(online->start(m.time(0.2), {}, options_of(SampleKind::mean_to_stamp)).ok());
  for (const ImuSample& s : list) REQUIRE(online->push(s).ok());
  for (const double late : {0.2001, 0.355, 0.5, 0.98, 0.9801, 0.99, 0.995, 1.0}) {
    const auto range = imu::preintegrate<double>(list, m.time(0.2), m.time(late), {}, options_of(SampleKind::mean_to_stamp));
    REQUIRE(range.ok());
    CHECK(same_bits(*online->until(m.time(late)), *range));
  }
  CHECK(online->until(m.time(0.2)).status().code == StatusCode::invalid_argument);
  CHECK(online->until(m.time(0.1)).status().code == StatusCode::invalid_argument);
  CHECK(online->until(m.time(1.0001)).status().code == StatusCode::no_data);
}

TEST_CASE("a full buffer refuses the next sample and keeps its motion; a restart makes room") {
  const GpsTime epoch{1'300'000'000'000'000'000};
  const auto at = [&](int k) { return ImuSample{{epoch.ns + k * 10'000'000}, {0.1, 0, 0}, Vector3d{0, 1, 9.8}}; };
  imu::Preintegration<double, 8> small;
  REQUIRE(small.start(epoch, {}).ok());
  for (int k = -5; k < 8; ++k) REQUIRE(small.push(at(k)).ok());  // of those up to the start only one is kept
  CHECK(small.size() == 8);
  const auto before = small.until(at(7).time);
  CHECK(small.push(at(8)).code == StatusCode::capacity_exceeded);
  CHECK(same_bits(*small.until(at(7).time), *before));
  REQUIRE(small.restart(at(5).time, {}).ok());
  CHECK(small.size() == 3);
  CHECK(small.push(at(8)).ok());
  CHECK(small.until(at(8).time).ok());
}

TEST_CASE("options and biases out of their domain are refused, and what was there goes on; runaway numbers are an error, not a result") {
  const GpsTime epoch{1'300'000'000'000'000'000};
  const std::vector<ImuSample> list{{epoch, {0, 0, 0}, {0, 0, 9.8}}, {{epoch.ns + 10'000'000}, {0, 0, 0}, {0, 0, 9.8}}};
  imu::Preintegration<double, 8> online;
  REQUIRE(online.start(epoch, {}).ok());
  for (const ImuSample& s : list) REQUIRE(online.push(s).ok());
  const auto before = online.until(list[1].time);
  const auto refuse = [&](auto change, StatusCode code) {
    imu::PreintegrationOptions o;
    imu::ImuBias<double> bias;
    change(o, bias);
    CHECK(online.start(epoch, bias, o).code == code);
    CHECK(imu::preintegrate<double>(list, epoch, list[1].time, bias, o).status().code == code);
    CHECK(same_bits(*online.until(list[1].time), *before));
  };
  constexpr double nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
  for (const double bad : {0.0, -1.0, nan, infinity}) {
    refuse([&](auto& o, auto&) { o.noise.accel_noise_mps2_sqrt_hz = bad; }, StatusCode::invalid_argument);
    refuse([&](auto& o, auto&) { o.noise.gyro_noise_radps_sqrt_hz = bad; }, StatusCode::invalid_argument);
    refuse([&](auto& o, auto&) { o.max_gap_s = bad; }, StatusCode::invalid_argument);
    refuse([&](auto& o, auto&) { o.bridged_after_s = bad; }, StatusCode::invalid_argument);
  }
  for (const double bad : {-1.0, nan, infinity}) {
    refuse([&](auto& o, auto&) { o.bridge_accel_sigma_mps2 = bad; }, StatusCode::invalid_argument);
    refuse([&](auto& o, auto&) { o.bridge_gyro_sigma_radps = bad; }, StatusCode::invalid_argument);
  }
  refuse([&](auto&, auto& b) { b.accel_b_mps2.x() = nan; }, StatusCode::non_finite);
  refuse([&](auto&, auto& b) { b.gyro_b_radps.z() = infinity; }, StatusCode::non_finite);
  std::vector<ImuSample> wild = list;
  wild[1].accel_b_mps2.setConstant(1e200);  // its square in the covariance is none
  CHECK(imu::preintegrate<double>(wild, epoch, wild[1].time, {}).status().code == StatusCode::non_finite);
  wild[1].accel_b_mps2.setConstant(1e39);  // infinite in float
  CHECK(imu::preintegrate<float>(wild, epoch, wild[1].time, {}).status().code == StatusCode::non_finite);
}

TEST_CASE("float against double: a second of driving within 0.1 mm/s, sigmas within one per cent") {
  for_all_seeds(40, [](Rng& rng) {
    const SimulatedMotion m = SimulatedMotion::random(rng);
    const auto list = m.samples(random_times(rng, 1.0, 100), SampleKind::instantaneous);
    const auto f = imu::preintegrate<float>(list, m.time(0.013), m.time(0.987), {});
    const auto d = imu::preintegrate<double>(list, m.time(0.013), m.time(0.987), {});
    REQUIRE((f.ok() && d.ok()));
    CHECK(difference(f->cast<double>(), *d) < 1e-4);
    for (int i = 0; i < 9; ++i) CHECK(static_cast<double>(f->covariance(i, i)) == doctest::Approx(d->covariance(i, i)).epsilon(0.01));
    CHECK(close(f->d_v_d_gyro_bias.cast<double>().eval(), d->d_v_d_gyro_bias, 1e-4));
  });
}
