// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// threaded_frontend [FOLDER]: a frontend in a thread of its own, an estimator's side that stays single-threaded, and the proof that the
/// second thread changes no bit.
///
///     thread 1    pictures -> CheckedFrontend<OrbFrontend> --\                       read, rectify, detect, match: most of the time
///                                            SpscQueue of StereoFrames              bounded, no lock
///     thread 2                                               \--> StereoAdmission    order and content of the frames decide, nothing else
///
/// FOLDER has the EuRoC layout; without one a few pairs of a simulated street are rendered. The pairs are worked off once in one thread and
/// once in two; a table shows both. Exit codes: 0, 1 the two differ (or admitted nothing), 2 usage, 3 files.
#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <searvins/core/spsc_queue.hpp>
#include <searvins/io/file_result.hpp>
#include <searvins/vision/admission.hpp>
#include <searvins/vision/frontend.hpp>
#include <searvins/vision/rectification.hpp>

#include "examples/datasets/euroc.hpp"
#include "examples/orb_frontend/orb_frontend.hpp"
#include "examples/orb_frontend/remap.hpp"
#include "examples/simulator/renderer.hpp"
#include "examples/simulator/simulation.hpp"
#include "examples/support/table.hpp"

namespace {

using namespace searvins;

constexpr std::size_t kObservations = 512, kQueueLength = 3;
using Orb = orb::OrbFrontend<kObservations>;
using Frame = Orb::Frame;
using Queue = SpscQueue<Frame, kQueueLength>;

/// A rectified pair.
struct Pair {
  GpsTime time{};
  examples::GrayImage left, right;
};

/// Where pairs come from; `read` is called by one thread at a time.
struct Source {
  vision::StereoCamera<double> camera{};
  std::size_t count{0};
  std::function<io::FileResult<Pair>(std::size_t)> read;
};

io::FileResult<Source> open_recording(const std::string& folder) {
  auto parsed = examples::read_euroc(folder);
  if (parsed.error) return *parsed.error;
  const auto recording = std::make_shared<const examples::EurocRecording>(std::move(parsed.value));
  const auto remaps = std::make_shared<std::array<orb::Remap, 2>>();
  const auto wrong = [&](const Status& status) {
    return io::Diagnostic{folder, 0, std::string{"the pair cannot be rectified: "} + status.what, "see the cameras' sensor.yaml"};
  };
  const auto rectification = vision::rectify(examples::stereo_calibration(recording->left, recording->right));
  if (!rectification) return wrong(rectification.status());
  for (const vision::Eye eye : {vision::Eye::left, vision::Eye::right})
    if (const Status s = (*remaps)[static_cast<std::size_t>(eye)].build(*rectification, eye); !s) return wrong(s);
  return Source{rectification->camera(), recording->pairs.size(), [=](std::size_t i) -> io::FileResult<Pair> {
                  const auto raw = examples::read_euroc_pair(*recording, recording->pairs[i]);
                  if (!raw) return raw.error();
                  Pair pair;
                  pair.time = recording->pairs[i].time;
                  const Status left = (*remaps)[0].apply(raw->left.view(), pair.left);
                  const Status right = (*remaps)[1].apply(raw->right.view(), pair.right);
                  if (!left || !right) return io::Diagnostic{recording->pairs[i].left_path, 0, (left ? right : left).what, {}};
                  return pair;
                }};
}

/// A second and a half of a simulated street, 10 Hz.
Source render_street() {
  constexpr int kPairs = 16;
  constexpr double kFirstS = 30, kRateHz = 10;
  constexpr std::uint64_t kSeed = 3;
  simulator::SimulationOptions drive;
  drive.profile = "urban", drive.duration_s = 60, drive.seed = kSeed;
  const simulator::Simulation simulation(drive);
  simulator::RenderOptions size;
  size.width_px = 480, size.height_px = 180;
  simulator::Renderer renderer(simulation.city(), simulation.way(), kSeed, size);
  const auto pairs = std::make_shared<std::vector<Pair>>();
  for (int k = 0; k < kPairs; ++k) {
    const double t_s = kFirstS + k / kRateHz;
    simulator::StereoFrame frame = renderer.frame(t_s, simulation.vehicle().state(t_s));
    pairs->push_back({drive.start.plus_seconds(t_s), std::move(frame.left), std::move(frame.right)});
  }
  const simulator::StereoRig& rig = renderer.rig();
  vision::StereoCamera<double> camera;
  camera.fx_px = rig.fx_px, camera.fy_px = rig.fy_px, camera.cx_px = rig.cx_px, camera.cy_px = rig.cy_px;
  camera.baseline_m = rig.baseline_m, camera.width_px = size.width_px, camera.height_px = size.height_px;
  camera.R_bc = rig.R_bc, camera.p_bc_m = rig.t_bc_m;
  return {camera, pairs->size(), [pairs](std::size_t i) -> io::FileResult<Pair> { return (*pairs)[i]; }};
}

/// The frontend's side: everything that it touches belongs to whichever thread calls it.
class FrameMaker {
 public:
  explicit FrameMaker(const Source& source)
      : source_(source), orb_(source.camera), checked_(orb_, {source.camera.width_px, source.camera.height_px}) {}
  FrameMaker(const FrameMaker&) = delete;
  FrameMaker& operator=(const FrameMaker&) = delete;

  /// Fills `frame` with the next pair that is not refused; false at the end, or at an error.
  bool make(Frame& frame) {
    while (!error_ && next_ < source_.count) {
      const auto pair = source_.read(next_++);
      if (!pair) {
        error_ = pair.error();
        break;
      }
      // No predicted motion: one that the estimator gave would depend on how far it has come. One that is integrated from the gyros here,
      // in this thread, would not.
      if (checked_.process({pair->left.view(), pair->right.view(), pair->time, pair->time}, std::nullopt, frame)) return true;
      ++refused_;
    }
    return false;
  }

  [[nodiscard]] std::size_t refused() const { return refused_; }
  [[nodiscard]] const std::optional<io::Diagnostic>& error() const { return error_; }

 private:
  const Source& source_;
  Orb orb_;
  vision::CheckedFrontend<Orb> checked_;
  std::size_t next_{0}, refused_{0};
  std::optional<io::Diagnostic> error_;
};

/// The estimator's side: admission, and a checksum over every bit of what it admits [FNV-1a, Fowler, Noll, Vo].
class Estimator {
 public:
  explicit Estimator(const vision::StereoCamera<double>& camera) : admission_(std::make_unique<Admission>(camera)) {}

  void take(const Frame& frame) {
    if (!admission_->add(frame, std::nullopt, *admitted_)) return;
    ++frames_;
    admitted_count_ += admitted_->observations.size();
    mix(static_cast<std::uint64_t>(frame.time.ns));
    for (const vision::AdmittedObservation& o : admitted_->observations) {
      mix(o.track), mix(o.landmark), mix(o.begins ? 1 : 0), mix(std::bit_cast<std::uint64_t>(o.sigma_px));
      for (const double pixel : {o.pixel_px[0], o.pixel_px[1], o.pixel_px[2]}) mix(std::bit_cast<std::uint64_t>(pixel));
    }
  }

  [[nodiscard]] std::size_t frames() const { return frames_; }
  [[nodiscard]] std::size_t admitted() const { return admitted_count_; }
  [[nodiscard]] std::uint64_t checksum() const { return checksum_; }

 private:
  using Admission = vision::StereoAdmission<kObservations>;

  void mix(std::uint64_t word) {
    for (int byte = 0; byte < 8; ++byte) checksum_ = (checksum_ ^ (word >> (8 * byte) & 255U)) * 0x100000001B3ULL;
  }

  std::unique_ptr<Admission> admission_;
  std::unique_ptr<Admission::Admitted> admitted_{std::make_unique<Admission::Admitted>()};
  std::size_t frames_{0}, admitted_count_{0};
  std::uint64_t checksum_{0xCBF29CE484222325ULL};
};

/// What a run shows.
struct Run {
  std::size_t frames{0}, refused{0}, admitted{0};
  std::size_t full{0}, empty{0}, deepest{0};  ///< frames that had to wait for room; times that there was nothing to take; frames on the way
  std::uint64_t checksum{0};
  double seconds{0};
  std::optional<io::Diagnostic> error;
};

class Stopwatch {
 public:
  [[nodiscard]] double seconds() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count(); }

 private:
  std::chrono::steady_clock::time_point start_{std::chrono::steady_clock::now()};
};

Run conclude(Run run, const FrameMaker& maker, const Estimator& estimator, const Stopwatch& watch) {
  run.seconds = watch.seconds();
  run.frames = estimator.frames(), run.admitted = estimator.admitted(), run.checksum = estimator.checksum();
  run.refused = maker.refused(), run.error = maker.error();
  return run;
}

Run run_in_one_thread(const Source& source) {
  const Stopwatch watch;
  FrameMaker maker(source);
  Estimator estimator(source.camera);
  const auto frame = std::make_unique<Frame>();
  while (maker.make(*frame)) estimator.take(*frame);
  return conclude({}, maker, estimator, watch);
}

/// Every fourth frame the estimator is made to be late, so that the queue fills up.
void be_late(std::size_t frame) {
  constexpr std::chrono::milliseconds kLate{150};
  if (frame % 4 == 1) std::this_thread::sleep_for(kLate);
}

Run run_in_two_threads(const Source& source) {
  constexpr std::chrono::microseconds kPause{200};
  const Stopwatch watch;
  FrameMaker maker(source);
  Estimator estimator(source.camera);
  const auto queue = std::make_unique<Queue>();  // some 35 kB a frame: not for a stack
  std::atomic<bool> finished{false};
  Run run;

  // Writes run.full and run.deepest and uses `maker`; the other thread reads them after join().
  std::thread frontend([&] {
    for (bool more = true; more;) {
      Frame* slot = queue->back();
      // A full queue holds the frontend up: pairs wait where they come from. To leave frames out instead would let the clock decide what
      // the estimator sees.
      if (!slot) ++run.full;
      for (; !slot; slot = queue->back()) std::this_thread::sleep_for(kPause);
      more = maker.make(*slot);  // in place: a frame is never copied
      if (!more) break;
      queue->publish();
      run.deepest = std::max(run.deepest, queue->size());
    }
    finished.store(true, std::memory_order_release);
  });

  std::size_t empty = 0;
  for (bool was_empty = false;;) {
    const bool last = finished.load(std::memory_order_acquire);  // before the look into the queue: what is published last is seen
    if (const Frame* const frame = queue->front()) {
      estimator.take(*frame);
      queue->pop();
      be_late(estimator.frames());
      was_empty = false;
    } else if (last) {
      break;
    } else {
      empty += was_empty ? 0U : 1U;
      was_empty = true;
      std::this_thread::sleep_for(kPause);
    }
  }
  frontend.join();
  run.empty = empty;
  return conclude(run, maker, estimator, watch);
}

std::string text_of(const std::vector<std::pair<const char*, const Run*>>& runs) {
  examples::Table table({"run", "frames", "refused", "waits, full", "waits, empty", "most queued", "admitted", "checksum", "s"});
  for (const auto& [name, run] : runs) {
    std::array<char, 20> checksum{};
    std::snprintf(checksum.data(), checksum.size(), "%016llx", static_cast<unsigned long long>(run->checksum));
    table.row({name, std::to_string(run->frames), std::to_string(run->refused), std::to_string(run->full), std::to_string(run->empty),
               std::to_string(run->deepest), std::to_string(run->admitted), checksum.data(), examples::cell(run->seconds, 2)});
  }
  return table.text();
}

}  // namespace

int main(int argc, char** argv) {
  if (argc > 2) {
    std::fprintf(stderr, "usage: threaded_frontend [FOLDER]\n");
    return 2;
  }
  const io::FileResult<Source> source = argc == 2 ? open_recording(argv[1]) : io::FileResult<Source>{render_street()};
  if (!source) {
    std::fprintf(stderr, "error: %s\n", io::to_string(source.error()).c_str());
    return 3;
  }
  const Run one = run_in_one_thread(*source), two = run_in_two_threads(*source);
  for (const Run* run : {&one, &two})
    if (run->error) {
      std::fprintf(stderr, "error: %s\n", io::to_string(*run->error).c_str());
      return 3;
    }
  std::printf("%s", text_of({{"one thread", &one}, {"two threads", &two}}).c_str());
  const bool same = one.frames == two.frames && one.admitted == two.admitted && one.checksum == two.checksum;
  std::printf("\n%s\n", same ? "The same bits." : "The two runs differ.");
  return same && one.admitted > 0 ? 0 : 1;
}
