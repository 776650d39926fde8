// What hosts set on the heads of one sonar: read, checked, kept as bytes between pings (ChangeSettings::request), and turned into
// PingSettings. All hosts of a sonar share them, as they share the sonar.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/sonar/ping_settings.hpp"
#include "core/sonar/sonar_model.hpp"
#include "core/sonar/water.hpp"
#include "protocol/blueview/frames.hpp"
#include "protocol/vendor.hpp"

namespace sonar::blueview {

struct HeadSettings {
  float start_m = 2, stop_m = 10;
  std::int32_t sound_speed_mps = 1500;
  float gain_db = 0;
  float tvg_db_per_m = 0;
  std::int32_t fluid = 0;  // 0 salt, 1 fresh, 2 other
  std::int32_t transmit = 1;
  std::int32_t ping_interval_ms = 0;  // 0 = as fast as asked
  std::int32_t dynamic_power = 0;
  float source_level_db = 0;  // kept and read back; no effect
  bool operator==(const HeadSettings&) const = default;
};
template <class V, wire::Like<HeadSettings> M>
constexpr void fields(V& visit, M& m) {
  visit("start", m.start_m);
  visit("stop", m.stop_m);
  visit("sound_speed", m.sound_speed_mps);
  visit("gain", m.gain_db);
  visit("tvg", m.tvg_db_per_m);
  visit("fluid", m.fluid);
  visit("transmit", m.transmit);
  visit("ping_interval", m.ping_interval_ms);
  visit("dynamic_power", m.dynamic_power);
  visit("source_level", m.source_level_db);
}

/// Of the whole sonar.
struct SonarSettings {
  std::int32_t active_head = 0;  // index of the head that pinged, or was asked to, last
  std::int32_t local_clock = 0;
  std::string name;
  std::vector<HeadSettings> heads;
};
SonarSettings initial_sonar_settings(const protocol::DeviceState& device);
wire::Bytes bytes_of_settings(const SonarSettings& settings);
/// What bytes_of_settings wrote; the initial settings for anything else.
SonarSettings settings_from(wire::BytesView request, const protocol::DeviceState& device);

struct Refusal {
  Code code{};
  std::string text;
};
/// Sets one key of a head and returns the value that now holds, which may be a nearer one than asked.
struct Applied {
  std::optional<Value> value;
  Refusal refusal;  // when there is no value
};
Applied apply(SonarSettings& settings, int head, Key key, const Value& value, const protocol::DeviceState& device);
std::optional<Value> read_back(const SonarSettings& settings, int head, Key key);

/// The sample grid of a head: rows from the sonar on, of which the first `skipped` lie before the start range.
struct HeadGrid {
  double bin_m = 0;
  int skipped = 0, bins = 0;
  double row_centre = 0.5;
};
HeadGrid grid_of(const HeadSettings& head, double finest_bin_m);

PingSettings ping_settings(const SonarSettings& settings, const protocol::DeviceState& device);

/// One line for the log.
std::string describe(const SonarSettings& settings, const protocol::DeviceState& device);

}  // namespace sonar::blueview
