// SPDX-License-Identifier: BSD-3-Clause
// Admission on the tracks of a simulated urban drive whose faults are known: what each piece of screening keeps out.
#include <searvins/vision/admission.hpp>

#include <algorithm>
#include <cstddef>
#include <memory>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "recorded_tracks.hpp"
#include "support/property.hpp"
#include "support/shared_data.hpp"

using namespace searvins;
using namespace searvins::test;
using namespace searvins::vision;

namespace {

using TwinAdmission = StereoAdmission<kTwinTracks>;
constexpr SemanticClass kVegetation = 3, kVehicle = 4;  // reject_classes of the rig

struct Outcome {
  std::size_t admitted{0}, faulty{0}, mismatched{0}, vehicles{0};
  std::size_t at_rest{0}, cue_at_rest{0}, cue_fast{0};  ///< frames; fast: above 0.3 m/s
  std::vector<double> way_errors_m;
  AdmissionCounts counts;

  [[nodiscard]] double faulty_percent() const { return 100.0 * static_cast<double>(faulty) / static_cast<double>(admitted); }
};

AdmissionOptions twin_options() {
  AdmissionOptions options;
  options.pnp.sigma_px = 0.7;
  options.semantic.dynamic = {kVehicle};
  options.semantic.unstable = {kVegetation};
  return options;
}

Outcome admit(const TwinDrive& drive, const AdmissionOptions& options) {
  Outcome outcome;
  const auto admission = std::make_unique<TwinAdmission>(twin_camera(), options);
  const auto out = std::make_unique<TwinAdmission::Admitted>();
  for (std::size_t i = 0; i < drive.frames.size(); ++i) {
    const TwinFrame& frame = drive.frames[i];
    const std::optional<CameraMotion>& truth = drive.motions[i];
    const auto predicted = truth ? std::optional(PredictedMotion{*truth, Eigen::Matrix<double, 6, 6>::Zero()}) : std::nullopt;
    REQUIRE(admission->add(frame, predicted, *out).ok());
    for (std::size_t k = 0; k < frame.observations.size(); ++k) {
      if (out->fates[k] != ObservationFate::admitted) continue;
      const int fault = drive.fault(frame, frame.observations[k].track);
      ++outcome.admitted;
      outcome.faulty += fault != 0;
      outcome.mismatched += fault == 3 || fault == 4;
      outcome.vehicles += frame.observations[k].semantic_class == kVehicle;
    }
    if (!truth) continue;
    const double step_m = truth->t_prev_cur_m.norm();
    outcome.at_rest += step_m < 0.002;
    outcome.cue_at_rest += out->stands_still && step_m < 0.002;
    outcome.cue_fast += out->stands_still && step_m > 0.03;
    if (out->has_motion) outcome.way_errors_m.push_back((out->motion.t_prev_cur_m - truth->t_prev_cur_m).norm());
  }
  outcome.counts = admission->counts();
  std::sort(outcome.way_errors_m.begin(), outcome.way_errors_m.end());
  return outcome;
}

std::string row(const char* name, const Outcome& o) {
  std::ostringstream text;
  text << name << ": admitted " << o.admitted << ", faulty " << o.faulty_percent() << " %, stereo mismatches and gross errors "
       << o.mismatched << ", on labelled vehicles " << o.vehicles << ", landmarks " << o.counts.landmarks;
  return text.str();
}

}  // namespace

TEST_CASE("admission on a simulated urban drive: what each piece of screening keeps out") {
  const auto shared = shared_data();
  if (!shared) {
    MESSAGE("SKIPPED: shared data not found");
    return;
  }
  const TwinDrive drive = read_twin(*shared / "data/twin/a-urban", 554200, 554400);
  REQUIRE(drive.frames.size() > 1900);
  std::size_t offered = 0;
  for (const TwinFrame& frame : drive.frames) offered += frame.observations.size();

  AdmissionOptions options = twin_options();
  const Outcome all = admit(drive, options);
  const auto without = [&](bool AdmissionOptions::*piece) {
    AdmissionOptions changed = options;
    changed.*piece = false;
    return admit(drive, changed);
  };
  const Outcome no_geometric = without(&AdmissionOptions::use_geometric), no_semantic = without(&AdmissionOptions::use_semantic),
                no_motion = without(&AdmissionOptions::use_motion), no_maturity = without(&AdmissionOptions::use_maturity);
  MESSAGE(row("everything", all));
  MESSAGE(row("no geometric", no_geometric));
  MESSAGE(row("no semantic", no_semantic));
  MESSAGE(row("no motion", no_motion));
  MESSAGE(row("no maturity", no_maturity));

  CHECK(all.counts.offered() == offered);
  CHECK(all.mismatched == 0);
  CHECK(all.vehicles == 0);
  CHECK(no_semantic.vehicles > 100);
  CHECK(no_motion.mismatched > 100);
  CHECK(all.faulty_percent() < 0.6 * no_motion.faulty_percent());
  CHECK(all.faulty_percent() < no_maturity.faulty_percent());
  CHECK(all.counts.landmarks < no_maturity.counts.landmarks);
  CHECK(all.counts.of(FrameFate::full) > 0.8 * static_cast<double>(drive.frames.size()));

  const double median_m = all.way_errors_m[all.way_errors_m.size() / 2], most_m = all.way_errors_m[all.way_errors_m.size() * 99 / 100];
  MESSAGE("motion of a frame: median error " << median_m << " m, 99 % below " << most_m << " m; stop cue in " << all.cue_at_rest << " of "
                                             << all.at_rest << " frames at rest, in " << all.cue_fast << " above 0.3 m/s");
  CHECK(median_m < 0.01);
  CHECK(most_m < 0.1);
  CHECK(all.cue_fast == 0);
  CHECK(static_cast<double>(all.cue_at_rest) > 0.7 * static_cast<double>(all.at_rest));
}
