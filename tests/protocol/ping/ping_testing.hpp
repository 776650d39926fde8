// The side of a host, for tests: requests as bytes, and a device that answers them.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "protocol/ping/messages.hpp"
#include "protocol/vendor.hpp"

namespace sonar::ping::tests {

inline Time at_s(double s) { return Time{} + nanoseconds_from(1.7e9 + s); }

inline protocol::DeviceState device(const std::string& profile, const protocol::OptionValues& options = {}) {
  const auto found = protocol::find_profile(profile);
  protocol::DeviceState d;
  d.name = "front";
  d.model = found->model;
  d.water.sound_speed_mps = 1500;
  d.mac = {0x02, 0x53, 0x4f, 0, 0, 1};
  d.advertise_ip = {192, 168, 2, 10};
  d.options = *protocol::check_options(*found->vendor, options);
  d.settings = found->vendor->initial_settings(d).vendor_settings;
  return d;
}

inline Bytes hex(std::string_view text) {
  Bytes bytes;
  for (std::size_t i = 0; i + 1 < text.size(); i += text[i] == ' ' ? 1 : 2)
    if (text[i] != ' ') bytes.push_back(static_cast<std::byte>(std::stoi(std::string(text.substr(i, 2)), nullptr, 16)));
  return bytes;
}

inline Bytes request(Id id, const Bytes& payload = {}) { return framed(id, 0, payload); }
inline Bytes general(Id wanted) {
  Bytes payload;
  wire::Writer write(payload);
  write("requested_id", wanted);
  return framed(Id::general_request, 0, payload);
}

inline std::vector<Frame> frames_in(const std::vector<Bytes>& datagrams) {
  std::vector<Frame> frames;
  for (const Bytes& bytes : datagrams) {
    Framer framer(65535);
    framer.append(bytes);
    while (auto frame = framer.next()) frames.push_back(std::move(*frame));
  }
  return frames;
}

template <class M>
M message_in(const Frame& frame) {
  M message;
  wire::Reader reader(frame.payload);
  fields(reader, message);
  EXPECT_TRUE(reader.ok()) << reader.failure_text();
  return message;
}

/// A conversation with a device, whose events are applied as the daemon applies them. By default, pings take no time.
struct Talk {
  explicit Talk(const std::string& profile, std::size_t port = 0, const protocol::OptionValues& options = {})
      : vendor(*protocol::find_profile(profile)->vendor), state(device(profile, options)) {
    settings = vendor.initial_settings(state).settings;
    dialogue = vendor.converse(vendor.ports()[port], state, at_s(0));
  }
  void say(const Bytes& bytes, double at = 0) { apply(dialogue->on_bytes(bytes, at_s(at))); }
  void apply(protocol::Reaction reaction) {
    for (Bytes& reply : reaction.replies) replies.push_back(std::move(reply));
    for (protocol::Event& event : reaction.events) {
      if (const auto* change = std::get_if<protocol::ChangeSettings>(&event)) {
        state.settings = change->vendor_settings;
        settings = change->settings;
      } else if (const auto* wanted = std::get_if<protocol::RequestPing>(&event)) {
        aim = *wanted;
        ++pings;
      } else if (const auto* close = std::get_if<protocol::Close>(&event)) {
        closed = close->why;
      }
    }
  }
  /// Runs all ticks until this time [s]; returns the time of the last tick, or -1 if there was none.
  double run_to(double at, double ping_takes = 0) {
    double last = -1;
    while (dialogue->next_tick() <= at_s(at)) {
      const Time now = dialogue->next_tick();
      const int before = pings;
      apply(dialogue->on_tick(now, false));
      last = seconds(now - at_s(0));
      if (pings > before) deliver(last + ping_takes);
    }
    return last;
  }
  void deliver(double at) {
    Ping ping;
    ping.request.settings = settings;
    ping.request.vendor_settings = aim.with;
    ping.samples.resize(static_cast<std::size_t>(settings.range_bin_count));
    if (dialogue->on_ping(aim.with.get(), 0, at_s(at)).prefixes.empty()) return;
    for (Bytes& datagram : vendor.datagrams(vendor.ports().front(), ping, state)) replies.push_back(std::move(datagram));
  }
  std::vector<Frame> take() { return frames_in(std::exchange(replies, {})); }

  const protocol::Vendor& vendor;
  protocol::DeviceState state;
  PingSettings settings;
  std::unique_ptr<protocol::Dialogue> dialogue;
  std::vector<Bytes> replies;
  protocol::RequestPing aim;
  int pings = 0;
  std::string closed;
};

}  // namespace sonar::ping::tests
