// SPDX-License-Identifier: BSD-3-Clause
// Any bytes as a RINEX observation file: no crash, no endless loop, and whatever is delivered keeps what the reader promises.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

#include <searvins/io/rinex_info.hpp>

namespace {

using namespace searvins;

/// Ends the run where a promise is broken; libFuzzer keeps the input.
void promise(bool kept) {
  if (!kept) std::abort();
}

void check_signal(const gnss::SignalObservation& s, gnss::Constellation c) {
  promise(s.signal.constellation == c && gnss::frequency_hz(s.signal) > 0);
  promise(s.has_code() || s.has_phase() || s.has_doppler() || s.has_cn0());
  promise(!std::isinf(s.code_m) && !std::isinf(s.phase_cycles) && !std::isinf(s.doppler_hz));
  promise(!s.has_cn0() || (s.cn0_dbhz > 0 && s.cn0_dbhz <= 100));
}

void check_epoch(const gnss::ObservationEpoch& epoch) {
  for (std::size_t i = 0; i < epoch.satellites.size(); ++i) {
    const gnss::SatelliteObservation& satellite = epoch.satellites[i];
    promise(i == 0 || epoch.satellites[i - 1].satellite < satellite.satellite);
    promise(satellite.satellite.number >= 1 && satellite.satellite.number <= 63 && !satellite.signals.empty());
    for (const gnss::SignalObservation& s : satellite.signals) check_signal(s, satellite.satellite.constellation);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  io::RinexObservationReader reader;
  static gnss::ObservationEpoch epoch;
  long epochs = 0;
  if (reader.open_text(text)) {
    std::optional<GpsTime> last;
    while (reader.next(epoch)) {
      ++epochs;
      promise(!last || *last < epoch.tag);
      last = epoch.tag;
      check_epoch(epoch);
    }
  }
  promise(epochs == reader.summary().epochs);
  promise(epochs > 0 || reader.error().has_value());
  promise(reader.summary().skipped.items().size() <= io::SkipLog::kMaxReasons + 1);
  if (reader.error()) promise(!reader.error()->message.empty() && !io::to_string(*reader.error()).empty());

  io::RinexObservationReader again;
  if (again.open_text(text)) promise(io::scan_observations(again).summary.epochs == epochs);
  return 0;
}
