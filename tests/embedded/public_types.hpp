// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The types that a program hands to the library and takes from it, and those that a program holds: none may depend on machine flags.
#pragma once

#include <cstddef>

#include <searvins/ambiguity/lambda.hpp>
#include <searvins/ambiguity/resolution.hpp>
#include <searvins/estimator/rtk_options.hpp>
#include <searvins/estimator/rtk_solution.hpp>
#include <searvins/gnss/base_buffer.hpp>
#include <searvins/gnss/differenced_epoch.hpp>
#include <searvins/gnss/ephemeris.hpp>
#include <searvins/gnss/motion.hpp>
#include <searvins/gnss/observation.hpp>
#include <searvins/gnss/single_point_solution.hpp>
#include <searvins/gnss/single_point_tracker.hpp>
#include <searvins/imu/imu_factor.hpp>
#include <searvins/imu/imu_sample.hpp>
#include <searvins/imu/lever_arm.hpp>
#include <searvins/imu/navigation_state.hpp>
#include <searvins/imu/position_fix.hpp>
#include <searvins/imu/preintegrated_motion.hpp>
#include <searvins/imu/preintegration.hpp>
#include <searvins/vision/admission.hpp>
#include <searvins/vision/camera_model.hpp>
#include <searvins/vision/landmark.hpp>
#include <searvins/vision/stereo_camera.hpp>
#include <searvins/vision/stereo_observation.hpp>

namespace searvins::test {

/// visit(name, size, alignment) for each of them.
template <class Visit>
void for_each_public_type(Visit visit) {
#define SEARVINS_VISIT(...) visit(#__VA_ARGS__, sizeof(__VA_ARGS__), alignof(__VA_ARGS__))
  SEARVINS_VISIT(Status);
  SEARVINS_VISIT(GpsTime);
  SEARVINS_VISIT(gnss::SignalObservation);
  SEARVINS_VISIT(gnss::SatelliteObservation);
  SEARVINS_VISIT(gnss::ObservationEpoch);
  SEARVINS_VISIT(gnss::Ephemeris);
  SEARVINS_VISIT(gnss::EphemerisStore<8>);
  SEARVINS_VISIT(gnss::BaseBuffer<2>);
  SEARVINS_VISIT(gnss::DifferencedEpoch);
  SEARVINS_VISIT(gnss::SinglePointSolution);
  SEARVINS_VISIT(gnss::TrackedPosition);
  SEARVINS_VISIT(gnss::DopplerVelocity);
  SEARVINS_VISIT(gnss::SinglePointTracker);
  SEARVINS_VISIT(gnss::Pva);
  SEARVINS_VISIT(estimator::RtkOptions);
  SEARVINS_VISIT(estimator::RtkSolution);
  SEARVINS_VISIT(Result<estimator::RtkSolution>);
  SEARVINS_VISIT(ambiguity::FloatAmbiguities<16>);
  SEARVINS_VISIT(ambiguity::ResolutionOutcome<16>);
  SEARVINS_VISIT(ambiguity::Lambda<double, 16>);
  SEARVINS_VISIT(imu::ImuSample);
  SEARVINS_VISIT(imu::ImuBias<double>);
  SEARVINS_VISIT(imu::ImuBias<float>);
  SEARVINS_VISIT(imu::PreintegrationOptions);
  SEARVINS_VISIT(imu::PreintegratedMotion<double>);
  SEARVINS_VISIT(imu::PreintegratedMotion<float>);
  SEARVINS_VISIT(imu::Preintegration<double, 16>);
  SEARVINS_VISIT(imu::Preintegration<float, 16>);
  SEARVINS_VISIT(imu::NavigationState);
  SEARVINS_VISIT(imu::PositionFix);
  SEARVINS_VISIT(imu::LeverArm);
  SEARVINS_VISIT(imu::ImuFactor<>);
  SEARVINS_VISIT(vision::PinholeCamera<double>);
  SEARVINS_VISIT(vision::StereoCamera<double>);
  SEARVINS_VISIT(vision::StereoObservation);
  SEARVINS_VISIT(vision::StereoFrame<16>);
  SEARVINS_VISIT(vision::Landmark);
  SEARVINS_VISIT(vision::CameraMotion);
  SEARVINS_VISIT(vision::PredictedMotion);
  SEARVINS_VISIT(vision::AdmittedFrame<16>);
#undef SEARVINS_VISIT
}

}  // namespace searvins::test
