// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// A common workload for fixed-lag smoothers: a drive of 120 s with stereo tracks at 10 Hz, an inertial unit at 100 Hz and a position a
/// second, for which the answers of other solvers are at hand (peers/fixed_lag of the shared data, README.md there). Its problem, in
/// ours:
///
///     states       one a frame; a window of 61 after each update (ages 0 .. 6 s)
///     inertial     ImuFactor with gravity that is constant and a world that does not turn; 1e-8 m^2/s of integration noise on position
///     stereo       StereoFactor, 0.7 px, Huber 1.345
///     landmarks    from the first look at the predicted pose, with a prior of 30 m; they leave with the first frame that saw them
///     positions    PositionFactor with its lever arm, 0.5 m, without a robust loss
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <sstream>
#include <string>
#include <unordered_map>
#include <vector>

#include <searvins/imu/imu_factor.hpp>
#include <searvins/imu/navigation_prior.hpp>
#include <searvins/imu/position_factor.hpp>
#include <searvins/imu/prediction.hpp>
#include <searvins/imu/preintegration.hpp>
#include <searvins/smoother/fixed_lag_smoother.hpp>
#include <searvins/vision/stereo_factor.hpp>
#include <searvins/vision/triangulation.hpp>

namespace searvins::test {

/// A point of a trajectory.
struct WorkloadPose {
  double t_s{0};
  Eigen::Vector3d p_w_m{Eigen::Vector3d::Zero()};
  Eigen::Quaterniond q_wb{Eigen::Quaterniond::Identity()};
};

/// Root mean square of the distances between two trajectories at their common times, m; NaN without any.
inline double rms_distance_m(const std::vector<WorkloadPose>& a, const std::vector<WorkloadPose>& b) {
  double sum = 0;
  int n = 0;
  for (std::size_t i = 0, j = 0; i < a.size() && j < b.size();) {
    if (a[i].t_s < b[j].t_s - 1e-3) {
      ++i;
    } else if (b[j].t_s < a[i].t_s - 1e-3) {
      ++j;
    } else {
      sum += (a[i++].p_w_m - b[j++].p_w_m).squaredNorm();
      ++n;
    }
  }
  return std::sqrt(sum / n);
}

/// What the files say.
struct FixedLagWorkload {
  struct Sighting {
    int landmark;
    Eigen::Vector3d pixel;
  };
  struct Position {
    double t_s;
    Eigen::Vector3d antenna_w_m;
    double sigma_m;
  };
  std::vector<imu::ImuSample> readings;  ///< with one more at the start of the drive, to begin the first segment
  std::vector<std::vector<Sighting>> frames;
  std::vector<double> frame_times_s;
  std::vector<Position> positions;
  std::vector<WorkloadPose> truth;
  vision::StereoCamera<double> camera;
  double pixel_sigma_px{0};
  Eigen::Vector3d lever_arm_b_m;
  imu::ConstantGravity earth;
  imu::ImuNoise noise;
  imu::NavigationState start;
  Eigen::Matrix<double, 15, 15> start_covariance;
};

namespace detail {

/// Rows of numbers of a CSV file, without its head; empty when it cannot be read.
inline std::vector<std::vector<double>> read_table(const std::filesystem::path& file) {
  std::vector<std::vector<double>> rows;
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  while (std::getline(in, line)) {
    std::vector<double> row;
    for (const char* at = line.c_str(); *at != '\0';) {
      char* end = nullptr;
      row.push_back(std::strtod(at, &end));
      at = *end == ',' ? end + 1 : end;
      if (end == at && *end != '\0') break;
    }
    rows.push_back(row);
  }
  return rows;
}

/// `count` numbers after a key of a JSON text, from position `from` on; brackets and commas between them are passed over.
inline std::vector<double> numbers_after(const std::string& text, const std::string& key, std::size_t count, std::size_t from = 0) {
  std::vector<double> numbers;
  std::size_t at = text.find("\"" + key + "\"", from);
  if (at == std::string::npos) return std::vector<double>(count, std::nan(""));
  at = text.find(':', at) + 1;
  while (numbers.size() < count) {
    at = text.find_first_of("-0123456789", at);
    if (at == std::string::npos) return std::vector<double>(count, std::nan(""));
    char* end = nullptr;
    numbers.push_back(std::strtod(text.c_str() + at, &end));
    at = static_cast<std::size_t>(end - text.c_str());
  }
  return numbers;
}

}  // namespace detail

/// A trajectory with columns t, px, py, pz, qw, qx, qy, qz.
inline std::vector<WorkloadPose> read_workload_poses(const std::filesystem::path& file) {
  std::vector<WorkloadPose> poses;
  for (const auto& r : detail::read_table(file))
    if (r.size() >= 8) poses.push_back({r[0], {r[1], r[2], r[3]}, Eigen::Quaterniond{r[4], r[5], r[6], r[7]}.normalized()});
  return poses;
}

inline GpsTime workload_time(double t_s) { return {1'300'000'000'000'000'000 + std::llround(t_s * 1e9)}; }

/// Reads a folder of the workload; nothing when a file is missing.
inline std::optional<FixedLagWorkload> read_fixed_lag_workload(const std::filesystem::path& folder) {
  FixedLagWorkload w;
  std::ifstream in(folder / "params.json");
  std::stringstream buffer;
  buffer << in.rdbuf();
  const std::string text = buffer.str();
  const auto number = [&](const char* key) { return detail::numbers_after(text, key, 1)[0]; };
  const auto vector = [&](const char* key, std::size_t from = 0) {
    const auto n = detail::numbers_after(text, key, 3, from);
    return Eigen::Vector3d{n[0], n[1], n[2]};
  };
  w.camera.fx_px = number("fx"), w.camera.fy_px = number("fy"), w.camera.cx_px = number("cx"), w.camera.cy_px = number("cy");
  w.camera.baseline_m = number("baseline");
  w.camera.width_px = static_cast<int>(number("width")), w.camera.height_px = static_cast<int>(number("height"));
  const auto R = detail::numbers_after(text, "R_rowmajor", 9);
  w.camera.R_bc = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(R.data());
  w.camera.p_bc_m = vector("t");
  w.pixel_sigma_px = number("pixel_sigma");
  w.lever_arm_b_m = vector("lever_arm_body");
  w.earth.gravity_w_mps2 = vector("gravity_world");
  w.noise.gyro_noise_radps_sqrt_hz = number("gyro_noise_density"), w.noise.accel_noise_mps2_sqrt_hz = number("accel_noise_density");
  w.noise.gyro_bias_walk_radps2_sqrt_hz = number("gyro_bias_rw"), w.noise.accel_bias_walk_mps3_sqrt_hz = number("accel_bias_rw");
  const std::size_t guess = text.find("initial_guess"), sigmas = text.find("initial_sigmas");
  if (guess == std::string::npos || sigmas == std::string::npos || !check(w.camera).ok()) return std::nullopt;
  const auto q = detail::numbers_after(text, "q_wxyz", 4, guess);
  w.start.R_wb = Eigen::Quaterniond{q[0], q[1], q[2], q[3]}.normalized().toRotationMatrix();
  w.start.p_wb_m = vector("p", guess), w.start.v_wb_mps = vector("v", guess);
  const auto sigma = [&](const char* key) { return Eigen::Vector3d::Constant(detail::numbers_after(text, key, 1, sigmas)[0]); };
  Eigen::Matrix<double, 15, 1> s;
  s << vector("rot_xyz_body", sigmas), sigma("p"), sigma("v"), sigma("ba"), sigma("bg");
  w.start_covariance = s.cwiseAbs2().asDiagonal();

  for (const auto& r : detail::read_table(folder / "imu.csv")) {
    if (w.readings.empty()) w.readings.push_back({workload_time(0), {r.at(1), r.at(2), r.at(3)}, {r.at(4), r.at(5), r.at(6)}});
    w.readings.push_back({workload_time(r.at(0)), {r.at(1), r.at(2), r.at(3)}, {r.at(4), r.at(5), r.at(6)}});
  }
  for (const auto& r : detail::read_table(folder / "stereo.csv")) {
    const auto k = static_cast<std::size_t>(r.at(1));
    if (w.frames.size() <= k) w.frames.resize(k + 1), w.frame_times_s.resize(k + 1);
    w.frame_times_s[k] = r[0];
    w.frames[k].push_back({static_cast<int>(r[2]), {r.at(3), r.at(4), r.at(5)}});
  }
  for (const auto& r : detail::read_table(folder / "gnss.csv")) w.positions.push_back({r.at(0), {r.at(1), r.at(2), r.at(3)}, r.at(4)});
  w.truth = read_workload_poses(folder / "truth.csv");
  if (w.readings.empty() || w.frames.empty() || w.positions.empty() || w.truth.empty()) return std::nullopt;
  return w;
}

/// The smoother's capacities for it: 62 frames, tracks of 25 frames at most.
struct FixedLagProblem {
  using Scalar = double;
  using State = imu::NavigationState;
  using ImuFactor = imu::ImuFactor<imu::ConstantGravity>;
  using StereoFactor = vision::StereoFactor<>;
  using Variables = smoother::Types<smoother::Capacity<State, 62>, smoother::Capacity<vision::Landmark, 640>>;
  using Factors = smoother::Types<smoother::Capacity<imu::NavigationPriorFactor, 1>, smoother::Capacity<ImuFactor, 61>,
                                  smoother::Capacity<StereoFactor, 4608>, smoother::Capacity<vision::LandmarkPriorFactor, 640>,
                                  smoother::Capacity<imu::PositionFactor, 8>>;
  static constexpr int max_front_dimension = 390;
  static constexpr int member_capacity = 62 * 26;
  static constexpr std::size_t arena_scalars = std::size_t{62} * (391 * 15 + 376 * 376 + 375);
};

/// Runs the workload frame by frame. `Problem`: FixedLagProblem, or one with its types and other capacities.
template <class Problem>
class BasicFixedLagRun {
 public:
  using Smoother = smoother::FixedLagSmoother<Problem>;
  using Options = typename Smoother::Options;
  static constexpr std::size_t kWindow = 61;  ///< states that stay after an update, unless the constructor is told otherwise

  /// Everything that went wrong or was unusual.
  struct Counts {
    int refused{0};    ///< operations that failed
    int kept_back{0};  ///< updates of which no step lowered the cost
    int damped_steps{0}, iterations{0}, fronts_factored{0};
  };

  explicit BasicFixedLagRun(const FixedLagWorkload& workload, const Options& options, std::size_t window = kWindow)
      : workload_(workload), options_(options), window_(window), smoother_(std::make_unique<Smoother>()) {
    imu::PreintegrationOptions o;
    o.kind = imu::SampleKind::mean_to_stamp, o.noise = workload.noise;
    expect(motion_.start(workload_time(0), imu::ImuBias<double>{}, o).ok());
  }

  /// So many Gauss-Newton steps an update; the solvers to compare with did two. A step that an outlier's track makes too long is halved rather
  /// than damped: no update costs several factorisations.
  static Options options_of(int iterations) {
    Options o;
    o.max_iterations = iterations, o.max_step_halvings = 2;
    return o;
  }

  [[nodiscard]] bool done() const { return frame_ == workload_.frames.size(); }
  [[nodiscard]] std::size_t frame() const { return frame_; }
  [[nodiscard]] const std::vector<WorkloadPose>& newest() const { return newest_; }
  [[nodiscard]] const Counts& counts() const { return counts_; }
  [[nodiscard]] Smoother& smoother() { return *smoother_; }

  /// One update: preintegration, factors, optimisation, the newest state read, marginalisation.
  void update() {
    const double t_s = workload_.frame_times_s[frame_];
    add_state(workload_time(t_s));
    for (const auto& sighting : workload_.frames[frame_]) add_sighting(sighting, workload_time(t_s));
    add_position(t_s);
    const auto report = smoother_->optimise(options_);
    const bool stepped = report.status.ok() || report.last_step > 0;
    expect(report.status.ok() || report.status.code == StatusCode::not_converged);
    counts_.kept_back += stepped ? 0 : 1;
    counts_.damped_steps += report.damped_steps, counts_.iterations += report.iterations, counts_.fronts_factored += report.fronts_factored;
    if (const auto* x = smoother_->find(states_.back())) newest_.push_back({t_s, x->p_wb_m, so3::quaternion_from_matrix(x->R_wb)});
    if (states_.size() > window_) leave();
    ++frame_;
  }

 private:
  using State = imu::NavigationState;

  void expect(bool ok) { counts_.refused += ok ? 0 : 1; }
  template <class T>
  bool taken(const Result<T>& result) {
    expect(result.ok());
    return result.ok();
  }
  template <class F>
  void add(const Result<F>& factor) {
    if (taken(factor)) expect(smoother_->add_factor(*factor).ok());
  }

  void add_state(GpsTime time) {
    State x = workload_.start;
    std::optional<imu::PreintegratedMotion<double>> motion;
    if (!states_.empty()) {
      const State before = *smoother_->find(states_.back());
      expect(motion_.restart(times_.back(), imu::bias_of(before)).ok());
      while (next_reading_ < workload_.readings.size() && motion_.newest_time() < time)
        expect(motion_.push(workload_.readings[next_reading_++]).ok());
      const auto integrated = motion_.until(time);
      if (!taken(integrated)) return;
      motion = *integrated;
      motion->covariance.block<3, 3>(State::position, State::position).diagonal().array() += 1e-8 * motion->duration_s;
      x = imu::predict(before, *motion, workload_.earth);
    } else {
      expect(motion_.push(workload_.readings[next_reading_++]).ok());
    }
    const auto key = smoother_->add_variable(x, time);
    if (!taken(key)) return;
    if (motion)
      add(Problem::ImuFactor::make(states_.back(), *key, *motion, workload_.noise, workload_.earth, x.p_wb_m));
    else
      add(imu::NavigationPriorFactor::make(*key, x, workload_.start_covariance));
    states_.push_back(*key), times_.push_back(time);
  }

  void add_sighting(const FixedLagWorkload::Sighting& s, GpsTime time) {
    const auto& camera = workload_.camera;
    auto known = landmarks_.find(s.landmark);
    if (known == landmarks_.end()) {
      const State& x = *smoother_->find(states_.back());
      const Eigen::Vector3d pixel{s.pixel[0], s.pixel[0] - std::max(s.pixel[0] - s.pixel[1], 1.0), s.pixel[2]};
      const Eigen::Vector3d p_w_m = x.p_wb_m + x.R_wb * camera.body_from_camera(vision::point_at(camera, pixel));
      const auto key = smoother_->add_variable(vision::Landmark{p_w_m}, time);
      if (!taken(key)) return;
      add(vision::LandmarkPriorFactor::make(*key, p_w_m));
      known = landmarks_.emplace(s.landmark, *key).first;
    }
    add(Problem::StereoFactor::make(states_.back(), known->second, camera, s.pixel,
                                    vision::pixel_covariance_px2(workload_.pixel_sigma_px)));
  }

  void add_position(double t_s) {
    while (next_position_ < workload_.positions.size() && workload_.positions[next_position_].t_s < t_s - 1e-6) ++next_position_;
    if (next_position_ == workload_.positions.size() || workload_.positions[next_position_].t_s > t_s + 1e-6) return;
    const auto& fix = workload_.positions[next_position_];
    auto factor = imu::PositionFactor::make(states_.back(), imu::LeverArm{workload_.lever_arm_b_m, {0, 0, 0}, {0, 0, 0}}, fix.antenna_w_m,
                                            fix.sigma_m * fix.sigma_m * Eigen::Matrix3d::Identity(), 0);
    factor->loss.k = 1e9;  // the workload's positions are Gaussian
    add(factor);
  }

  void leave() {
    expect(smoother_->marginalise_oldest(options_).status.ok());
    states_.erase(states_.begin()), times_.erase(times_.begin());
    for (auto it = landmarks_.begin(); it != landmarks_.end();) it = smoother_->find(it->second) ? std::next(it) : landmarks_.erase(it);
  }

  const FixedLagWorkload& workload_;
  Options options_;
  std::size_t window_;
  std::unique_ptr<Smoother> smoother_;
  imu::Preintegration<double, 32> motion_{};
  std::size_t frame_{0}, next_reading_{0}, next_position_{0};
  std::vector<smoother::Key<State>> states_;
  std::vector<GpsTime> times_;
  std::unordered_map<int, smoother::Key<vision::Landmark>> landmarks_;
  std::vector<WorkloadPose> newest_;
  Counts counts_;
};

using FixedLagRun = BasicFixedLagRun<FixedLagProblem>;

}  // namespace searvins::test
