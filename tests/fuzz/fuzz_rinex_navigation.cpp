// SPDX-License-Identifier: BSD-3-Clause
// Any bytes as a RINEX navigation file: no crash, no endless loop, and every record that is delivered is finite and plausible.
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

void check_record(const gnss::Ephemeris& e) {
  promise(e.satellite.number >= 1 && e.satellite.number <= 63);
  promise(e.eccentricity >= 0 && e.eccentricity < 1 && e.sqrt_a >= 2000 && e.sqrt_a <= 8000);
  promise(std::abs(seconds_between(e.toc, e.toe)) <= 302400.0 + 1e-6);
  promise(std::abs(seconds_between(e.toe, e.transmitted)) <= 14400.0 + 1e-6);
  for (const double v : {e.i0, e.omega0, e.omega, e.m0, e.delta_n, e.i_dot, e.omega_dot, e.cuc, e.cus, e.crc, e.crs, e.cic, e.cis, e.af0,
                         e.af1, e.af2, e.group_delay_s[0], e.group_delay_s[1], e.accuracy_m})
    promise(std::isfinite(v));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto parsed = io::read_rinex_navigation_text(std::string(reinterpret_cast<const char*>(data), size));
  for (const gnss::Ephemeris& e : parsed.value.ephemerides) check_record(e);
  promise(!parsed.value.ephemerides.empty() || parsed.error.has_value());
  const io::NavigationFileInfo info = io::summarise_navigation(parsed.value);
  promise(info.records == static_cast<long>(parsed.value.ephemerides.size()));
  for (const double v : parsed.value.ionosphere.alpha) promise(std::isfinite(v));
  return 0;
}
