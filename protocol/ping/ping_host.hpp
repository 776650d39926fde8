// The part that all hosts of the family share: frames, refusals, the settings that a user requests, and the powers of one
// beam.
#pragma once

#include <memory>
#include <optional>

#include "protocol/host.hpp"
#include "protocol/line_pictures.hpp"
#include "protocol/ping/messages.hpp"

namespace sonar::ping {

using protocol::Line;
using protocol::Waterfall;

inline constexpr double usual_range_m = 10;

/// Returns the period for the requested rate [ms]; 0 if no rate, or the rate 0, is requested.
double period_ms_of(const protocol::SettingsOverride& wanted);

/// Makes a request for a message, which does not change the device's settings.
Bytes request_for(Id wanted);

/// Reads a message from the front of the payload; returns the rest.
template <class M>
std::optional<BytesView> read_front(const Frame& frame, M& message) {
  wire::Reader reader(frame.payload);
  fields(reader, message);
  if (!reader.ok()) return std::nullopt;
  return BytesView(frame.payload).subspan(wire::wire_size<M>());
}

/// Reads at most `count` powers of two bytes each; 0 to 65535 is lowest_db to highest_db.
Line powers_in(BytesView rest, std::size_t count, float lowest_db, float highest_db);

class PingHost : public protocol::Host {
 public:
  PingHost(std::string_view title, std::optional<Bytes> request, const protocol::SettingsOverride& wanted = {})
      : title_(title), request_(std::move(request)), wanted_gain_percent_(wanted.gain_percent) {}

  protocol::HostActions on_open(std::span<const std::uint16_t>, Time) override;
  protocol::HostActions on_bytes(std::size_t, BytesView received, Time now) override;
  std::string about() const override { return std::string(title_); }

 protected:
  bool asks() const { return request_.has_value(); }
  void ask(protocol::HostActions& actions) const {
    if (request_) actions.emplace_back(protocol::HostSend{0, *request_});
  }
  /// Adds a text to HostPing::limited if the gain of the ping, step `step` of 0 to `most`, is not the requested gain. There are
  /// only a few steps.
  void compare_gain(int step, int most, protocol::HostPing& ping) const;
  virtual void on_frame(const Frame&, protocol::HostActions&) {}
  /// Returns the reason of the error; nullopt = no error, for example if the host sends another request. `why`: the sonar's text.
  virtual std::optional<std::string> on_nack(Id /*refused*/, std::string why, protocol::HostActions&) { return why; }
  virtual std::optional<protocol::HostPing> ping_from(const Frame& frame, Time now) = 0;

 private:
  std::string_view title_;
  std::optional<Bytes> request_;  // the request for pings; empty: the host requests none
  std::optional<double> wanted_gain_percent_;
  Framer framer_{65535};
};

/// Checks the wanted settings of a sonar with one mode, this highest rate (nullopt: not known yet) and these options of sonarctl.
/// Errors: usage for a setting that the sonar does not have.
Result<void> check_wanted(std::string_view title, std::optional<float> fastest_hz, std::initializer_list<std::string_view> known,
                          const protocol::Wanted& wanted);

template <class Product>
Result<std::unique_ptr<protocol::Host>> host_of(std::string_view title, const protocol::Vendor& device,
                                                Bytes (*request)(const protocol::SettingsOverride&),
                                                std::initializer_list<std::string_view> known, const protocol::Wanted& wanted) {
  if (auto fits = check_wanted(title, device.models().front()->max_rate_hz, known, wanted); !fits)
    return tl::unexpected(fits.error());
  return std::make_unique<Product>(title, wanted.as_it_is ? std::nullopt : std::optional(request(wanted.settings)),
                                   wanted.as_it_is ? protocol::SettingsOverride{} : wanted.settings);
}

}  // namespace sonar::ping
