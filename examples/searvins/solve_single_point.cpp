// SPDX-License-Identifier: BSD-3-Clause
// The estimator of a run without a base: the single-point tracker.
#include <Eigen/Core>

#include <memory>
#include <optional>

#include <searvins/geodesy/wgs84.hpp>
#include <searvins/gnss/single_point_tracker.hpp>

#include "examples/searvins/solver_run.hpp"

namespace searvins::examples {
namespace {

class SinglePointRun final : public EpochRun {
 public:
  explicit SinglePointRun(const estimator::RtkOptions& options) : tracker_(options.tracker) {}

  Status add_ephemeris(const gnss::Ephemeris& ephemeris) override {
    return ephemerides_.insert(ephemeris) ? ok_status() : failure(StatusCode::capacity_exceeded, "the ephemeris store is full");
  }
  void set_ionosphere(const gnss::KlobucharCoefficients& coefficients) override { ephemerides_.ionosphere = coefficients; }
  Status set_base_position(const Eigen::Vector3d&) override { return failure(StatusCode::unsupported, "a single-point run has no base"); }
  Status add_base(const gnss::ObservationEpoch&) override { return failure(StatusCode::unsupported, "a single-point run has no base"); }

  [[nodiscard]] const gnss::DifferencedEpoch* differenced() const override { return nullptr; }
  [[nodiscard]] const gnss::SinglePointSolution& single_point() const override { return tracked_.single_point; }
  [[nodiscard]] std::optional<LaggedEstimate> oldest() const override { return std::nullopt; }

 private:
  Result<estimator::RtkSolution> update(const gnss::ObservationEpoch& rover) override {
    if (const Status s = tracker_.update(rover, ephemerides_, tracked_); !s.ok()) return s;
    estimator::RtkSolution out;
    out.tag = rover.tag, out.time = tracked_.time;
    out.status = tracked_.status == gnss::TrackStatus::coasted ? estimator::SolutionStatus::dr : estimator::SolutionStatus::spp;
    out.position_e_m = tracked_.position_e_m, out.velocity_e_mps = tracked_.velocity_e_mps;
    const Eigen::Matrix3d R_ew = geodesy::ecef_from_enu(geodesy::geodetic_from_ecef(tracked_.position_e_m));
    out.covariance_enu_m2 = R_ew.transpose() * tracked_.position_covariance_m2 * R_ew;
    out.velocity_covariance_enu = R_ew.transpose() * tracked_.velocity_covariance_m2ps2 * R_ew;
    out.clock_offset_s = seconds_between(tracked_.time, rover.tag);
    out.satellites = tracked_.single_point.used;
    out.verdict = ambiguity::ResolutionVerdict::off;
    out.restarted = tracked_.status == gnss::TrackStatus::started || tracked_.status == gnss::TrackStatus::restarted;
    return out;
  }

  gnss::SinglePointTracker tracker_;
  gnss::EphemerisStore<estimator::HostedCapacity::ephemerides> ephemerides_{};
  gnss::TrackedPosition tracked_{};
};

}  // namespace

std::unique_ptr<SolverRun> make_single_point_run(const estimator::RtkOptions& options) { return std::make_unique<SinglePointRun>(options); }

}  // namespace searvins::examples
