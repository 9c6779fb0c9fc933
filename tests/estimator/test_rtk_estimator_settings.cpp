// SPDX-License-Identifier: BSD-3-Clause
// P12 every settings field changes some output of a drive that has something for each of them; and no update allocates.
#include "estimator/simulated_drive.hpp"
#include "support/allocation_counter.hpp"

using namespace searvins;
using namespace searvins::test;
using estimator::RtkOptions;

namespace {

/// Noise, slips, late codes, weak and low satellites, half cycles, missing Doppler, base outage, few satellites, gaps.
Drive eventful_drive() {
  Rng rng{21};
  Drive d = simulated_drive(rng, 100, {7, 6, 5}, 1, {{6, {gnss::Constellation::gps, 2}, signal("G1C"), 1}, {9, {gnss::Constellation::beidou, 2}, signal("C2I"), 1}},
                            {0.8, 0.003, 0.05});
  for (std::size_t k = 0; k < d.rover.size(); ++k)
    for (auto& satellite : d.rover[k].satellites)
      for (auto& s : satellite.signals) {
        s.cn0_dbhz = 48 - 6.0 * (satellite.satellite.number % 5) + normal(rng, 2);
        if (chance(rng, 0.1)) s.code_m += uniform(rng, 2, 60);
        if (chance(rng, 0.03)) s.half_cycle = true;
        if (chance(rng, 0.05)) s.doppler_hz += uniform(rng, -20, 20);
        if (k >= 12 && k < 15) s.doppler_hz = gnss::kMissing;
        if (k >= 60 && k < 66) s.code_m += satellite.satellite.number % 2 == 0 ? 40 : 0;
      }
  for (std::size_t k = 40; k < 42; ++k)
    while (d.rover[k].satellites.size() > 5) d.rover[k].satellites.pop_back();
  return d;
}

/// All positions, sigmas and labels of a run; base epochs 20..56 are missing, rover epochs 70..94 too.
std::vector<double> outputs(const Drive& d, const RtkOptions& options) {
  RtkUnderTest rtk = estimator_for(d, options);
  std::vector<double> all;
  for (std::size_t k = 0; k < d.rover.size(); ++k) {
    if (k < 20 || k > 56) (void)rtk.add_base(d.base[k]);
    if (k >= 70 && k < 95) continue;
    const auto s = rtk.update(d.rover[k]);
    if (!s.ok()) {
      all.push_back(-1);
      continue;
    }
    for (int i = 0; i < 3; ++i) all.push_back(s->position_e_m[i]), all.push_back(s->covariance_enu_m2(i, i));
    all.push_back(static_cast<double>(s->status)), all.push_back(s->satellites), all.push_back(s->phases), all.push_back(s->restarted);
    all.push_back(static_cast<double>(s->verdict)), all.push_back(s->held_integers), all.push_back(s->iterations);
  }
  return all;
}

struct RtkFlip {
  const char* name;
  void (*change)(RtkOptions&);
};

const RtkFlip kRtkFlips[] = {
    {"continuity", [](RtkOptions& o) { o.continuity = ambiguity::ContinuityMode::instantaneous; }},
    {"arc_epochs", [](RtkOptions& o) { o.arc_epochs = 5; }},
    {"walk_sigma_cycles", [](RtkOptions& o) { o.walk_sigma_cycles = 0.01; }},
    {"datum_sigma_cycles", [](RtkOptions& o) { o.datum_sigma_cycles = 30; }},
    {"handover", [](RtkOptions& o) { o.handover = estimator::PivotHandover::restart; }},
    {"resolution.mode", [](RtkOptions& o) { o.resolution.mode = ambiguity::ResolutionMode::off; }},
    {"resolution.min_success_rate", [](RtkOptions& o) { o.resolution.min_success_rate = 0.9999999; }},
    {"resolution.min_ratio", [](RtkOptions& o) { o.resolution.min_ratio = 20; }},
    {"resolution.min_ratio_partial", [](RtkOptions& o) { o.resolution.norm_confidence = 0.5, o.resolution.min_ratio_partial = 1e9; }},
    {"resolution.min_share_partial", [](RtkOptions& o) { o.resolution.norm_confidence = 0.5, o.resolution.min_share_partial = 1; }},
    {"resolution.norm_confidence", [](RtkOptions& o) { o.resolution.norm_confidence = 1e-6; }},
    {"resolution.min_ambiguities", [](RtkOptions& o) { o.resolution.min_ambiguities = 24; }},
    {"resolution.max_sigma_horizontal_m", [](RtkOptions& o) { o.resolution.max_sigma_horizontal_m = 0.002; }},
    {"resolution.max_sigma_vertical_m", [](RtkOptions& o) { o.resolution.max_sigma_vertical_m = 0.004; }},
    {"resolution.max_innovation_statistic", [](RtkOptions& o) { o.resolution.max_innovation_statistic = 0.5; }},
    {"fix_sigma_cycles", [](RtkOptions& o) { o.fix_sigma_cycles = 0.05; }},
    {"fix_memory", [](RtkOptions& o) { o.fix_memory = estimator::FixMemory::epoch; }},
    {"release_sigmas", [](RtkOptions& o) { o.release_sigmas = 0.5; }},
    {"max_suspect_share", [](RtkOptions& o) { o.max_suspect_share = -1; }},
    {"code_correlation_s", [](RtkOptions& o) { o.code_correlation_s = 1; }},
    {"code_correlation_m", [](RtkOptions& o) { o.code_correlation_m = 1; }},
    {"code_noise.on", [](RtkOptions& o) { o.code_noise.on = false; }},
    {"code_noise.max_scale", [](RtkOptions& o) { o.code_noise.max_scale = 1.05; }},
    {"code_noise.memory_epochs", [](RtkOptions& o) { o.code_noise.memory_epochs = 2; }},
    {"use_phase", [](RtkOptions& o) { o.use_phase = false; }},
    {"code_gate_sigmas", [](RtkOptions& o) { o.code_gate_sigmas = 0.5; }},
    {"use_doppler", [](RtkOptions& o) { o.use_doppler = false; }},
    {"lag_s", [](RtkOptions& o) { o.lag_s = 10; }},
    {"jerk_psd_m2ps5", [](RtkOptions& o) { o.jerk_psd_m2ps5 = 0.1; }},
    {"min_satellites", [](RtkOptions& o) { o.min_satellites = 7; }},
    {"start_sigma_m", [](RtkOptions& o) { o.start_sigma_m = 3; }},
    {"start_velocity_sigma_mps", [](RtkOptions& o) { o.start_velocity_sigma_mps = 1; }},
    {"start_acceleration_sigma_mps2", [](RtkOptions& o) { o.start_acceleration_sigma_mps2 = 0.1; }},
    {"max_gap_s", [](RtkOptions& o) { o.max_gap_s = 10; }},
    {"solver.max_iterations", [](RtkOptions& o) { o.solver.max_iterations = 2; }},
    {"solver.step_tolerance", [](RtkOptions& o) { o.solver.step_tolerance = 1e-6; }},
    {"solver.relinearise_threshold", [](RtkOptions& o) { o.solver.relinearise_threshold = 0; }},
    {"solver.prior", [](RtkOptions& o) { o.solver.prior = smoother::PriorLinearisation::first_estimate; }},
    {"differencing.selection.wanted", [](RtkOptions& o) { (void)o.differencing.selection.wanted.push_back(signal("G1C")); }},
    {"differencing.screening.elevation_mask_rad", [](RtkOptions& o) { o.differencing.screening.elevation_mask_rad = 0.6; }},
    {"differencing.screening.min_cn0_dbhz", [](RtkOptions& o) { o.differencing.screening.min_cn0_dbhz = 35; }},
    {"differencing.ephemeris.max_age_s", [](RtkOptions& o) { o.differencing.ephemeris.max_age_s = 600; }},
    {"differencing.sigmas", [](RtkOptions& o) { o.differencing.sigmas = gnss::geodetic_profile(); }},
    {"differencing.sigmas.doppler_mps", [](RtkOptions& o) { o.differencing.sigmas.doppler_mps = 0.1; }},
    {"differencing.cn0_weighting", [](RtkOptions& o) { o.differencing.cn0_weighting = true; }},
    {"differencing.base.mode", [](RtkOptions& o) { o.differencing.base.mode = gnss::BaseMode::exact; }},
    {"differencing.base.max_age_s", [](RtkOptions& o) { o.differencing.base.max_age_s = 5; }},
    {"differencing.slips.geometry_free_m", [](RtkOptions& o) { o.differencing.slips.geometry_free_m = 1e-3; }},
    {"differencing.slips.common_motion", [](RtkOptions& o) { o.differencing.slips.common_motion = false; }},
    {"differencing.slips.common_motion_m", [](RtkOptions& o) { o.differencing.slips.common_motion_m = 1e-3; }},
    {"differencing.slips.single_frequency", [](RtkOptions& o) { o.differencing.slips.single_frequency = gnss::SingleFrequencyPolicy::always_fresh; }},
    {"differencing.slips.half_cycle", [](RtkOptions& o) { o.differencing.slips.half_cycle = gnss::HalfCyclePolicy::use_broken; }},
    {"differencing.pivot.min_elevation_rad", [](RtkOptions& o) { o.differencing.pivot.min_elevation_rad = 1.3, o.differencing.pivot.allow_fallback = false; }},
    {"differencing.pivot.min_cn0_dbhz", [](RtkOptions& o) { o.differencing.pivot.min_cn0_dbhz = 60, o.differencing.pivot.allow_fallback = false; }},
    {"differencing.pivot.hysteresis", [](RtkOptions& o) { o.differencing.pivot.hysteresis = false; }},
    {"differencing.troposphere", [](RtkOptions& o) { o.differencing.troposphere = false; }},
    {"differencing.min_group_size", [](RtkOptions& o) { o.differencing.min_group_size = 6; }},
    {"tracker.horizontal_acceleration_mps2", [](RtkOptions& o) { o.tracker.horizontal_acceleration_mps2 = 0.1; }},
    {"tracker.correlation_s", [](RtkOptions& o) { o.tracker.correlation_s = 1; }},
    {"tracker.start_sigma_m", [](RtkOptions& o) { o.tracker.start_sigma_m = 50; }},
    {"tracker.systematic_sigma_m", [](RtkOptions& o) { o.tracker.systematic_sigma_m = 10; }},
    {"tracker.single_point.screening", [](RtkOptions& o) { o.tracker.single_point.screening.elevation_mask_rad = 0.6; }},
    {"tracker.single_point.outlier_sigmas", [](RtkOptions& o) { o.tracker.single_point.outlier_sigmas = 1.5; }},
    {"tracker.doppler.sigma_mps", [](RtkOptions& o) { o.tracker.doppler.sigma_mps = 1; }},
};

}  // namespace

TEST_CASE("P12 every settings field changes some output") {
  const Drive d = eventful_drive();
  const std::vector<double> reference = outputs(d, {});
  CHECK(reference == outputs(d, {}));
  for (const RtkFlip& flip : kRtkFlips) {
    RtkOptions options;
    flip.change(options);
    const std::string name = flip.name;
    CAPTURE(name);
    const bool changed = outputs(d, options) != reference;
    CHECK(changed);
  }
  RtkOptions alone, alone_and_wary;  // below 1 the noise scale counts in instantaneous mode only
  alone.continuity = alone_and_wary.continuity = ambiguity::ContinuityMode::instantaneous;
  alone_and_wary.code_noise.min_scale = alone_and_wary.phase_noise.min_scale = 1;
  CHECK(outputs(d, alone) != outputs(d, alone_and_wary));
  RtkOptions noisy;  // phases noisier than assumed
  noisy.differencing.sigmas.other.phase = {1e-3, 1e-3};
  const std::vector<double> learned = outputs(d, noisy);
  for (void (*change)(estimator::NoiseAdaptation&) : {+[](estimator::NoiseAdaptation& n) { n.on = false; }, +[](estimator::NoiseAdaptation& n) { n.max_scale = 1.05; },
                                                      +[](estimator::NoiseAdaptation& n) { n.memory_epochs = 2; }}) {
    RtkOptions options = noisy;
    change(options.phase_noise);
    CHECK(outputs(d, options) != learned);
  }
  RtkOptions lazy, lazier;  // weights are kept only where the linearisation is
  lazy.solver.relinearise_threshold = lazier.solver.relinearise_threshold = 100;
  lazier.solver.weight_threshold = 0.9;
  CHECK(outputs(d, lazy) != outputs(d, lazier));
}

TEST_CASE("1000 updates without one heap allocation") {
  Rng rng{22};
  const Drive d = simulated_drive(rng, 1000, {5, 4, 0}, 1);
  RtkUnderTest rtk = estimator_for(d);
  const auto before = heap_allocations();
  std::size_t answered = 0;
  for (std::size_t k = 0; k < d.rover.size(); ++k) answered += feed(rtk, d, k).ok() ? std::size_t{1} : std::size_t{0};
  const auto allocations = heap_allocations() - before;
  CHECK(allocations == 0);
  CHECK(answered == d.rover.size());
}
