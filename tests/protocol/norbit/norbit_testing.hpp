// The side of a driver, for tests: a device, a ping, and a conversation.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "protocol/norbit/norbit.hpp"
#include "protocol/norbit/settings.hpp"

namespace sonar::norbit::tests {

inline Time at_s(double s) { return Time{} + nanoseconds_from(1.7e9 + s); }

inline protocol::DeviceState device() {
  protocol::DeviceState state;
  state.name = "bottom";
  state.id = 7001;
  state.model = models().front();
  state.water.sound_speed_mps = 1500;
  state.options = *protocol::check_options(vendor(), {});
  state.settings = vendor().initial_settings(state).vendor_settings;
  return state;
}

/// Returns a ping with these settings: silence, and in one row of one beam an echo 40 dB above it.
inline Ping ping_with(const Settings& settings, const protocol::DeviceState& state, int row, int beam) {
  Ping ping;
  ping.request.model = state.model;
  ping.request.number = PingNumber{7};
  ping.request.fired_at = at_s(0.25);
  ping.request.settings = ping_settings(settings, state);
  ping.request.vendor_settings = std::make_shared<HeldSettings>(settings);
  const PingSettings& s = ping.request.settings;
  for (int i = 0; i < s.beam_count; ++i)
    ping.beam_azimuth_rad.push_back(static_cast<float>((0.5 - (i + 0.5) / s.beam_count) * 140 * 3.14159265358979 / 180));
  const auto code = [&](double db) { return static_cast<unsigned>((db + 120) / 160 * 65535); };
  ping.samples.resize(static_cast<std::size_t>(2 * s.beam_count * s.range_bin_count));
  for (int r = 0; r < s.range_bin_count; ++r)
    for (int b = 0; b < s.beam_count; ++b) {
      const unsigned value = code(r == row && b == beam ? -20 : -60);
      const auto at = static_cast<std::size_t>(2 * (r * s.beam_count + b));
      ping.samples[at] = static_cast<std::byte>(value);
      ping.samples[at + 1] = static_cast<std::byte>(value >> 8);
    }
  return ping;
}

/// A conversation at one of the ports; the events of the device are applied as the daemon applies them.
struct Talk {
  explicit Talk(std::uint16_t number = command_port) {
    for (const protocol::Port& port : vendor().ports())
      if (port.number == number) dialogue = vendor().converse(port, state, at_s(0));
  }
  void say(std::string_view text, double at = 0) {
    const auto bytes = std::as_bytes(std::span(text));
    apply(dialogue->on_bytes(bytes, at_s(at)));
  }
  void tick(double at) { apply(dialogue->on_tick(at_s(at), false)); }
  void apply(const protocol::Reaction& reaction) {
    for (const Bytes& reply : reaction.replies)
      for (const std::byte b : reply) replies += std::to_integer<char>(b);
    for (const protocol::Event& event : reaction.events) {
      if (const auto* change = std::get_if<protocol::ChangeSettings>(&event)) {
        state.settings = change->vendor_settings;
        settings = change->settings;
      }
      if (std::get_if<protocol::Notice>(&event) != nullptr) ++notices;
      if (std::get_if<protocol::Close>(&event) != nullptr) closed = true;
    }
  }
  std::string take() { return std::exchange(replies, {}); }
  Settings held() const { return settings_from(state.settings.get()); }

  protocol::DeviceState state = device();
  std::unique_ptr<protocol::Dialogue> dialogue;
  PingSettings settings;
  std::string replies;
  int notices = 0;
  bool closed = false;
};

}  // namespace sonar::norbit::tests
