// SPDX-License-Identifier: BSD-3-Clause
// The base buffer: order, matching modes, age, phase arcs.
#include <doctest/doctest.h>

#include <memory>

#include <searvins/gnss/base_buffer.hpp>

#include "support/property.hpp"

using namespace searvins;
using namespace searvins::gnss;
using namespace searvins::test;

namespace {

const Eigen::Vector3d kPlace{-3817681.1, 3562839.4, 3650159.2};
const SatelliteId kSatellite{Constellation::gps, 7};
const SignalCode kSignal{Constellation::gps, '1', 'C'};

GpsTime at(double s) { return GpsTime::from_week_sow(2300, 1000 + s); }

ObservationEpoch epoch(double s, bool phase = true, bool lost = false) {
  ObservationEpoch e;
  e.tag = at(s);
  SatelliteObservation o{kSatellite, {}};
  SignalObservation signal;
  signal.signal = kSignal, signal.code_m = 2.2e7, signal.loss_of_lock = lost;
  if (phase) signal.phase_cycles = 1e8;
  o.signals.push_back(signal);
  e.satellites.push_back(o);
  return e;
}

std::unique_ptr<BaseBuffer<>> buffer(std::initializer_list<double> tags) {
  auto b = std::make_unique<BaseBuffer<>>();
  CHECK(b->set_position(kPlace).ok());
  for (const double s : tags) CHECK(b->push(epoch(s)).ok());
  return b;
}

BaseArc newest_arc(const BaseBuffer<>& b) { return b.epochs().back().arc_of(kSatellite, kSignal); }

}  // namespace

TEST_CASE("positions that cannot be a base are refused; a new one forgets the epochs") {
  auto b = std::make_unique<BaseBuffer<>>();
  CHECK(b->match(at(0), {}).status().code == StatusCode::no_data);
  CHECK(b->set_position(Eigen::Vector3d::Zero()).code == StatusCode::invalid_argument);
  CHECK(b->set_position(Eigen::Vector3d{kPlace / 2}).code == StatusCode::invalid_argument);
  CHECK(b->set_position(Eigen::Vector3d::Constant(kMissing)).code == StatusCode::non_finite);
  CHECK(!b->positioned());
  CHECK(b->set_position(kPlace).ok());
  CHECK(b->push(epoch(0)).ok());
  CHECK(b->set_position(kPlace).ok());
  CHECK(b->epochs().size() == 1);
  CHECK(b->position_revision() == 1);
  CHECK(b->set_position(kPlace + Eigen::Vector3d::UnitX()).ok());
  CHECK(b->epochs().empty());
  CHECK(b->position_revision() == 2);
}

TEST_CASE("epochs come in order, the oldest leave") {
  auto b = buffer({0, 1, 2, 3, 4, 5});
  CHECK(b->epochs().size() == 4);
  CHECK(b->epochs()[0].observation.tag == at(2));
  CHECK(b->push(epoch(5)).code == StatusCode::duplicate);
  CHECK(b->push(epoch(4.5)).code == StatusCode::out_of_order);
  CHECK(b->epochs().size() == 4);
  CHECK(b->match(at(1.5), {}).status().code == StatusCode::no_data);
}

TEST_CASE("exact, carry forward, interpolate: who serves, how old, with what weight") {
  BaseOptions exact, carry, between;
  exact.mode = BaseMode::exact, between.mode = BaseMode::interpolate;
  for_all_seeds(100, [&](Rng& rng) {
    const double step = uniform(rng, 0.5, 20), t = uniform(rng, 0.06, step - 0.06), skew = uniform(rng, -0.05, 0.05);
    const auto b = buffer({0, step});
    for (const BaseOptions& o : {exact, carry, between}) {  // tags a few ms apart are one epoch in every mode
      const auto m = b->match(at(step + skew), o);
      REQUIRE(m.ok());
      CHECK(m->first == &b->epochs()[1]);
      CHECK(m->second == nullptr);
      CHECK(m->age_s == doctest::Approx(skew).epsilon(1e-6));
      CHECK(m->effective_age_s >= 0);
    }
    CHECK(b->match(at(t), exact).status().code == StatusCode::stale);
    const auto forward = b->match(at(t), carry);
    REQUIRE(forward.ok());
    CHECK(forward->first == &b->epochs()[0]);
    CHECK(forward->age_s == doctest::Approx(t).epsilon(1e-6));
    const auto middle = b->match(at(t), between);
    REQUIRE(middle.ok());
    CHECK(middle->second == &b->epochs()[1]);
    CHECK(middle->fraction == doctest::Approx(t / step).epsilon(1e-6));
    CHECK(middle->effective_age_s == doctest::Approx(t * (step - t) / step).epsilon(1e-6));
    CHECK(middle->effective_age_s <= step / 4 + 1e-9);
    const auto beyond = b->match(at(step + t), between);  // nothing later yet: carried forward
    REQUIRE(beyond.ok());
    CHECK(beyond->second == nullptr);
  });
}

TEST_CASE("age limit and latency, both sides of the seam") {
  const auto b = buffer({0});
  CHECK(b->match(at(29.99), {}).ok());
  const auto old = b->match(at(30.01), {});
  CHECK(old.status().code == StatusCode::stale);
  CHECK(old.status().value == doctest::Approx(30.01));
  BaseOptions between;
  between.mode = BaseMode::interpolate;
  between.latency_s = 5;
  const auto c = buffer({0, 10});
  CHECK(c->match(at(4.9), between)->second == nullptr);
  CHECK(c->match(at(5.1), between)->second != nullptr);
}

TEST_CASE("arcs: one number while the phase lives; LLI, a missing phase, a gap and a power failure begin another") {
  auto b = buffer({0, 1, 2});
  const BaseArc first = newest_arc(*b);
  CHECK(first.number != 0);
  CHECK(first.cause == SlipCause::first_epoch);
  const auto expect_new = [&](SlipCause cause) {
    static thread_local std::uint32_t last = 0;
    CHECK(newest_arc(*b).number > std::max(last, first.number));
    CHECK(newest_arc(*b).cause == cause);
    last = newest_arc(*b).number;
  };
  CHECK(b->push(epoch(3, true, true)).ok());
  expect_new(SlipCause::lli_base);
  CHECK(b->push(epoch(4, false)).ok());
  CHECK(newest_arc(*b).number == 0);
  CHECK(b->push(epoch(5)).ok());
  expect_new(SlipCause::gap);
  const std::uint32_t kept = newest_arc(*b).number;
  CHECK(b->push(epoch(6)).ok());
  CHECK(newest_arc(*b).number == kept);
  CHECK(b->push(epoch(8)).ok());
  expect_new(SlipCause::gap);
  ObservationEpoch failed = epoch(9);
  failed.power_failure = true;
  CHECK(b->push(failed).ok());
  expect_new(SlipCause::power_failure);
  ObservationEpoch half = epoch(10);
  half.satellites[0].signals[0].half_cycle = true;
  CHECK(b->push(half).ok());
  CHECK(newest_arc(*b).number == 0);
  CHECK(b->epochs().back().arc_of({Constellation::gps, 8}, kSignal).number == 0);
}
