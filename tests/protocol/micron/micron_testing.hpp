// The side of a driver, for tests: a device, commands to it, and its messages.
#pragma once

#include <gtest/gtest.h>

#include <utility>
#include <vector>

#include "protocol/micron/micron.hpp"
#include "protocol/micron/settings.hpp"

namespace sonar::micron::tests {

inline Time at_s(double s) { return Time{} + nanoseconds_from(1.7e9 + s); }

inline protocol::DeviceState device(const protocol::OptionValues& options = {}) {
  protocol::DeviceState state;
  state.name = "front";
  state.id = 7001;
  state.model = models().front();
  state.water.sound_speed_mps = 1500;
  state.options = *protocol::check_options(vendor(), options);
  state.settings = vendor().initial_settings(state).vendor_settings;
  return state;
}

/// Parameters of a scan: 200 bins of 9.6 mm, steps of 1 grad from 45 degrees to port to 45 degrees to starboard.
inline HeadCommand sector() {
  HeadCommand c;
  c.control = 0x2305;
  c.left = 2400;
  c.right = 4000;
  c.interval = 20;
  c.bins = 200;
  return c;
}
inline Bytes command(const HeadCommand& c) { return from_host(Id::head_command, wire::bytes_of(c)); }
inline Bytes request() { return from_host(Id::send_data, Bytes(4)); }

/// A conversation with a device, whose events are applied as the daemon applies them.
struct Talk {
  explicit Talk(const char* option = nullptr, const char* value = nullptr)
      : state(device(option != nullptr ? protocol::OptionValues{{option, value}} : protocol::OptionValues{})) {
    dialogue = vendor().converse(vendor().ports().front(), state, at_s(0));
  }
  void say(const Bytes& bytes, double at = 0) { apply(dialogue->on_bytes(bytes, at_s(at))); }
  void apply(protocol::Reaction reaction) {
    for (Bytes& reply : reaction.replies) replies.push_back(std::move(reply));
    for (protocol::Event& event : reaction.events) {
      if (const auto* change = std::get_if<protocol::ChangeSettings>(&event)) state.settings = change->vendor_settings;
      if (const auto* wanted = std::get_if<protocol::RequestPing>(&event)) aim = *wanted, ++pings;
      if (std::get_if<protocol::Notice>(&event) != nullptr) ++notices;
    }
  }
  /// Runs all ticks until this time [s]; pings take no time.
  void run_to(double at) {
    while (dialogue->next_tick() <= at_s(at)) {
      const Time now = dialogue->next_tick();
      const int before = pings;
      apply(dialogue->on_tick(now, false));
      if (pings > before) deliver(now);
    }
  }
  void deliver(Time now) {
    Ping ping;
    const auto& with = settings_from(aim.with.get());
    ping.request.settings = ping_settings(with, state);
    ping.request.vendor_settings = aim.with;
    for (int i = 0; i < ping.request.settings.range_bin_count; ++i)
      ping.samples.push_back(static_cast<std::byte>(static_cast<unsigned>(i) % (ping.request.settings.format.max_code + 1)));
    last_ping_s = seconds(now - at_s(0));
    if (!dialogue->on_ping(aim.with.get(), 0, now).prefixes.empty()) replies.push_back(*vendor().frame(ping, state));
  }
  std::vector<Bytes> take() { return std::exchange(replies, {}); }
  /// Returns the bearings of the received scan lines.
  std::vector<int> bearings() {
    std::vector<int> all;
    for (const Bytes& reply : take())
      if (const auto message = read_frame(reply); message && message->header.id == Id::head_data)
        all.push_back(read_front<HeadData>(message->payload)->bearing);
    return all;
  }
  /// Returns the head information of the received alive messages.
  std::vector<int> head_infos() {
    std::vector<int> all;
    for (const Bytes& reply : take())
      if (const auto message = read_frame(reply); message && message->header.id == Id::alive)
        all.push_back(read_front<Alive>(message->payload)->head_info);
    return all;
  }

  protocol::DeviceState state;
  std::unique_ptr<protocol::Dialogue> dialogue;
  std::vector<Bytes> replies;
  protocol::RequestPing aim;
  int pings = 0, notices = 0;
  double last_ping_s = 0;
};

}  // namespace sonar::micron::tests
