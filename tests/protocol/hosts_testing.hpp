// A conversation of the host of a make with the device of the same make, in memory and virtual time.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "protocol/host.hpp"
#include "tests/protocol/stream_ports.hpp"

namespace sonar::protocol::hosts_test {

using namespace std::chrono_literals;

/// Returns true for a make whose drivers set nothing, because `sonarctl set sonar` does it.
inline bool sets_nothing(const Make& make) {
  Wanted range;
  range.settings.range_m = 3;
  return !make.host(range);
}

inline Wanted all_that_is_known(const Make& make, double range_m) {
  Wanted wanted;
  wanted.settings.range_m = range_m;
  if (sets_nothing(make)) {
    wanted.settings.rate_hz = 5;
    wanted.settings.gain_percent = 50;
    return wanted;
  }
  for (auto SettingsOverride::*setting : {&SettingsOverride::rate_hz, &SettingsOverride::gain_percent}) {
    Wanted more = wanted;
    more.settings.*setting = setting == &SettingsOverride::rate_hz ? 5 : 50;
    if (make.host(more)) wanted = more;
  }
  wanted.settings.mode = 0;
  return wanted;
}

/// Makes each byte 7 more than the previous, modulo 251. Blocks are copied, because single bytes take long without optimisation.
inline void fill_with_pattern(std::vector<std::byte>& samples) {
  std::array<std::byte, 251> period;
  for (std::size_t i = 0; i < period.size(); ++i) period[i] = static_cast<std::byte>(i * 7 % period.size());
  for (std::size_t at = 0; at < samples.size(); at += period.size())
    std::copy_n(period.begin(), std::min(period.size(), samples.size() - at), samples.begin() + static_cast<std::ptrdiff_t>(at));
}

class Talk {
 public:
  /// `piece`: streams arrive in pieces of this many bytes; 0: in the pieces that were written.
  Talk(const Make& of, const Wanted& wanted, std::size_t piece = 0, std::size_t model = 0)
      : make(of), device(*of.device), piece_(piece), host(*of.host(sets_nothing(of) ? Wanted{} : wanted)) {
    state.name = "front";
    state.id = 7001;
    state.model = device.models()[model];
    state.water = {12, 30, 8.0, 0};
    state.options = *check_options(device, {});
    const ChangeSettings first = device.initial_settings(state);
    state.settings = first.vendor_settings;
    settings = first.settings;
    if (sets_nothing(of)) apply({*device.apply_override(wanted.settings, state)});
    for (const auto& [at, port] : test::conversations_of(make)) lines_.push_back({at, port, device.converse(*port, state, now)});
    open(std::move(host));
    if (make.scans) run(10);  // the host may wait for a report that the head sends once per second
  }
  /// Replaces the present host and opens the new one.
  void open(std::unique_ptr<Host> next) {
    host = std::move(next);
    const std::vector<std::uint16_t> own(make.ports.size(), 40000);
    carry_out(host->on_open(own, now));
    tick();
  }

  /// Runs steps of a tenth of a second. Each has a ping, unless the device pings only on request.
  void run(int steps) {
    for (int i = 0; i < steps && !error; ++i) {
      now += 100ms;
      tick();
      carry_out(host->on_tick(now));
      carry_out(host->on_demand(now));
      const bool by_request = make.each_ping_requested || make.scans;
      if (!by_request && settings.rate_hz > 0 && host->is_open()) ping();
      while (requested_ > 0) --requested_, ping();
    }
  }

  void carry_out(HostActions actions) {
    for (HostAction& action : actions) {
      if (const auto* send = std::get_if<HostSend>(&action)) {
        const auto line = std::ranges::find(lines_, send->port, &Line::host_port);
        ASSERT_NE(line, lines_.end()) << "bytes for a port without a conversation";
        in_pieces(send->port, send->bytes, [&](BytesView part) { react(*line, line->dialogue->on_bytes(part, now)); });
      } else if (const auto* ask = std::get_if<ResourceRequest>(&action)) {
        const ResourceReply reply = device.on_http(*device.port(Port::Kind::http), *ask, state, now);
        apply(reply.events);
        carry_out(host->on_reply(reply, now));
      } else if (auto* ping = std::get_if<HostPing>(&action)) {
        pings.push_back(std::move(*ping));
      } else if (auto* failed = std::get_if<Error>(&action)) {
        error = *failed;
      }
    }
  }

  /// Delivers the messages that are held, and all later ones.
  void release() {
    held_after = SIZE_MAX;
    for (const auto& [port, bytes] : std::exchange(held_, {})) deliver(port, bytes);
  }
  /// Drops the held messages, as a lost connection does, and delivers the later ones.
  void forget_held() {
    held_after = SIZE_MAX;
    held_.clear();
  }

  const Make& make;
  const Vendor& device;
  std::size_t piece_;
  std::unique_ptr<Host> host;
  DeviceState state;
  PingSettings settings;
  Time now = Time(1'700'000'000s);
  std::vector<HostPing> pings;
  std::vector<std::pair<std::size_t, Bytes>> sent;  // bytes that the device sent, with the index of the host's port
  std::optional<Error> error;
  std::size_t held_after = SIZE_MAX;  // number of messages to the host that are still delivered at once
  bool only_port = false;             // echoes are in some rows of the outermost quarter of the beams to port
  double head_rad = 0;                // head angle of the last request

 private:
  struct Line {
    std::size_t host_port;
    const Port* port;
    std::unique_ptr<Dialogue> dialogue;
  };
  void tick() {
    for (Line& line : lines_)
      while (line.dialogue->next_tick() <= now) react(line, line.dialogue->on_tick(now, false));
  }
  void react(const Line& line, const Reaction& reaction) {
    for (const Bytes& reply : reaction.replies) deliver(line.host_port, reply);
    apply(reaction.events);
  }
  void apply(const std::vector<Event>& events) {
    for (const Event& event : events) {
      if (const auto* change = std::get_if<ChangeSettings>(&event)) {
        state.settings = change->vendor_settings;
        settings = change->settings;
      }
      if (const auto* request = std::get_if<RequestPing>(&event)) {
        ++requested_;
        with_ = request->with;
        head_rad = request->head_rad;
      }
      if (const auto* close = std::get_if<Close>(&event)) error = Error{ErrorKind::io, close->why};
    }
  }

  void deliver(std::size_t port, const Bytes& bytes) {
    if (held_after == 0) return held_.emplace_back(port, bytes), void();
    if (held_after != SIZE_MAX) --held_after;
    sent.emplace_back(port, bytes);
    in_pieces(port, bytes, [&](BytesView part) { carry_out(host->on_bytes(port, part, now)); });
  }
  /// Passes streams in pieces, and datagrams whole, to `give`.
  void in_pieces(std::size_t port, const Bytes& bytes, const std::function<void(BytesView)>& give) const {
    const std::size_t step = piece_ == 0 || make.ports[port].kind != HostPort::Kind::tcp ? bytes.size() : piece_;
    for (std::size_t at = 0; at < bytes.size(); at += step) give(BytesView(bytes).subspan(at, std::min(step, bytes.size() - at)));
  }

  void ping() {
    Ping made;
    PingRequest& request = made.request;
    request.model = state.model;
    request.number = PingNumber{++state.last_ping};
    request.fired_at = now;
    request.settings = settings;
    request.vendor_settings = with_ ? with_ : state.settings;
    request.water = state.water;
    const auto beams = static_cast<std::size_t>(settings.beam_count), rows = static_cast<std::size_t>(settings.range_bin_count);
    for (std::size_t i = 0; i < beams; ++i)
      made.beam_azimuth_rad.push_back(beams < 2 ? 0.0f : 0.5f - static_cast<float>(i) / static_cast<float>(beams - 1));
    const std::size_t sample_bytes = static_cast<std::size_t>(std::max(settings.format.bits / 8, 1));
    made.samples.resize(beams * rows * sample_bytes);
    if (!only_port) fill_with_pattern(made.samples);
    for (std::size_t row = 8; only_port && row < rows; row += 16)
      std::fill_n(made.samples.begin() + static_cast<std::ptrdiff_t>(row * beams * sample_bytes), beams / 4 * sample_bytes,
                  std::byte{100});
    const Port* const stream = device.port(Port::Kind::udp_stream);
    bool by_stream = false;
    Ping looked_at = made;
    look_at(looked_at);
    for (Line& line : lines_) {
      const auto framed = test::bytes_at(make, *line.port, made, state);
      const auto framed_later = test::bytes_at(make, *line.port, looked_at, state);
      EXPECT_EQ(framed_later ? *framed_later : Bytes{}, framed ? *framed : Bytes{}) << "look_at() changes the bytes";
      by_stream = by_stream || (framed && line.port->kind == Port::Kind::tcp_stream);
      const auto delivery = line.dialogue->on_ping(request.vendor_settings.get(), framed ? framed->size() : 0, now);
      for (const Bytes& prefix : delivery.prefixes) {
        if (!framed) continue;
        Bytes whole = prefix;
        whole.insert(whole.end(), framed->begin(), framed->end());
        deliver(line.host_port, whole);
      }
      apply(delivery.events);
    }
    const std::size_t to = make.ports.size() - 1;
    if (!by_stream)
      for (const Bytes& datagram : device.datagrams(stream != nullptr ? *stream : *lines_.front().port, made, state))
        deliver(to, datagram);
    state.framed_at = made.request.fired_at;
  }

  std::vector<Line> lines_;
  std::vector<std::pair<std::size_t, Bytes>> held_;
  std::shared_ptr<const VendorSettings> with_;
  int requested_ = 0;
};

inline constexpr double range_m = 3;
inline std::size_t model_of(const Make& make) { return make.name() == "aris" ? 2 : 0; }  // ARIS 3000, which can show 3 m

class Hosts : public testing::TestWithParam<Make> {};

}  // namespace sonar::protocol::hosts_test
