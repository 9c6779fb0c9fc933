// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Everything but io/. For programs on a desktop; firmware and tests include the narrow headers.
/// The list is written by `cmake -DWRITE=ON -P cmake/umbrella.cmake`; a test compares it with the tree.
#pragma once

#include <searvins/ambiguity/continuation.hpp>
#include <searvins/ambiguity/decorrelation.hpp>
#include <searvins/ambiguity/lambda.hpp>
#include <searvins/ambiguity/resolution.hpp>
#include <searvins/ambiguity/success_rate.hpp>
#include <searvins/ambiguity/unimodular.hpp>

#include <searvins/core/pool.hpp>
#include <searvins/core/ring_buffer.hpp>
#include <searvins/core/spsc_queue.hpp>
#include <searvins/core/static_vector.hpp>
#include <searvins/core/status.hpp>
#include <searvins/core/time.hpp>

#include <searvins/estimator/camera_calibration.hpp>
#include <searvins/estimator/camera_predictor.hpp>
#include <searvins/estimator/estimator.hpp>
#include <searvins/estimator/free_motion.hpp>
#include <searvins/estimator/inertial_motion.hpp>
#include <searvins/estimator/noise_scale.hpp>
#include <searvins/estimator/rtk_estimator.hpp>
#include <searvins/estimator/rtk_options.hpp>
#include <searvins/estimator/rtk_problem.hpp>
#include <searvins/estimator/rtk_solution.hpp>
#include <searvins/estimator/snapshot.hpp>
#include <searvins/estimator/stereo_inertial_motion.hpp>

#include <searvins/geodesy/local_frame.hpp>
#include <searvins/geodesy/wgs84.hpp>

#include <searvins/gnss/atmosphere.hpp>
#include <searvins/gnss/base_buffer.hpp>
#include <searvins/gnss/common_motion.hpp>
#include <searvins/gnss/cycle_slip.hpp>
#include <searvins/gnss/differenced_epoch.hpp>
#include <searvins/gnss/doppler_velocity.hpp>
#include <searvins/gnss/double_difference.hpp>
#include <searvins/gnss/ephemeris.hpp>
#include <searvins/gnss/gnss_factors.hpp>
#include <searvins/gnss/gnss_variables.hpp>
#include <searvins/gnss/motion.hpp>
#include <searvins/gnss/observation.hpp>
#include <searvins/gnss/phase_continuity.hpp>
#include <searvins/gnss/pivot.hpp>
#include <searvins/gnss/range.hpp>
#include <searvins/gnss/reduction.hpp>
#include <searvins/gnss/satellite.hpp>
#include <searvins/gnss/signal.hpp>
#include <searvins/gnss/signal_pairing.hpp>
#include <searvins/gnss/single_point.hpp>
#include <searvins/gnss/single_point_problem.hpp>
#include <searvins/gnss/single_point_solution.hpp>
#include <searvins/gnss/single_point_tracker.hpp>
#include <searvins/gnss/undifferenced_epoch.hpp>
#include <searvins/gnss/weighting.hpp>

#include <searvins/imu/alignment.hpp>
#include <searvins/imu/attitude_angles.hpp>
#include <searvins/imu/centreline.hpp>
#include <searvins/imu/centreline_factor.hpp>
#include <searvins/imu/earth.hpp>
#include <searvins/imu/heading.hpp>
#include <searvins/imu/imu_factor.hpp>
#include <searvins/imu/imu_sample.hpp>
#include <searvins/imu/initializer.hpp>
#include <searvins/imu/lever_arm.hpp>
#include <searvins/imu/motion_accumulator.hpp>
#include <searvins/imu/navigation_prior.hpp>
#include <searvins/imu/navigation_state.hpp>
#include <searvins/imu/position_factor.hpp>
#include <searvins/imu/position_fix.hpp>
#include <searvins/imu/prediction.hpp>
#include <searvins/imu/preintegrated_motion.hpp>
#include <searvins/imu/preintegration.hpp>

#include <searvins/math/block_cholesky.hpp>
#include <searvins/math/deferred.hpp>
#include <searvins/math/quantiles.hpp>
#include <searvins/math/small_cholesky.hpp>
#include <searvins/math/so3.hpp>

#include <searvins/robust/formulation.hpp>
#include <searvins/robust/loss.hpp>
#include <searvins/robust/shared_pivot.hpp>

#include <searvins/smoother/covariance.hpp>
#include <searvins/smoother/elimination.hpp>
#include <searvins/smoother/elimination_sizes.hpp>
#include <searvins/smoother/factor.hpp>
#include <searvins/smoother/factor_assembly.hpp>
#include <searvins/smoother/fixed_lag_smoother.hpp>
#include <searvins/smoother/front_matrix.hpp>
#include <searvins/smoother/front_tree.hpp>
#include <searvins/smoother/local_elimination.hpp>
#include <searvins/smoother/marginal_prior.hpp>
#include <searvins/smoother/optimise.hpp>
#include <searvins/smoother/symmetric_products.hpp>
#include <searvins/smoother/tables.hpp>
#include <searvins/smoother/variable.hpp>
#include <searvins/smoother/window.hpp>

#include <searvins/stationary/detector.hpp>
#include <searvins/stationary/position_anchor.hpp>
#include <searvins/stationary/stationary_factors.hpp>

#include <searvins/version.hpp>

#include <searvins/vision/admission.hpp>
#include <searvins/vision/admission_report.hpp>
#include <searvins/vision/calibrating_stereo_factor.hpp>
#include <searvins/vision/camera_correction.hpp>
#include <searvins/vision/camera_model.hpp>
#include <searvins/vision/camera_motion.hpp>
#include <searvins/vision/frontend.hpp>
#include <searvins/vision/image_view.hpp>
#include <searvins/vision/landmark.hpp>
#include <searvins/vision/motion_consistency.hpp>
#include <searvins/vision/pnp.hpp>
#include <searvins/vision/rectification.hpp>
#include <searvins/vision/semantic_mask.hpp>
#include <searvins/vision/spread.hpp>
#include <searvins/vision/stereo_camera.hpp>
#include <searvins/vision/stereo_factor.hpp>
#include <searvins/vision/stereo_observation.hpp>
#include <searvins/vision/stop_cue.hpp>
#include <searvins/vision/three_point_alignment.hpp>
#include <searvins/vision/track.hpp>
#include <searvins/vision/triangulation.hpp>
