#include "protocol/ping/ping_host.hpp"

#include <array>
#include <cmath>
#include <utility>

#include "core/sonar/ping.hpp"
#include "core/text/format.hpp"
#include "protocol/limits.hpp"
#include "protocol/ping/products.hpp"

namespace sonar::ping {

using protocol::HostActions;
using protocol::HostPing;

namespace {

/// Returns the id of the request that a nack refuses.
Id refused_in(const Frame& nack) {
  Id id{};
  wire::Reader reader(nack.payload);
  reader("nacked_id", id);
  return id;
}

}  // namespace

double period_ms_of(const protocol::SettingsOverride& wanted) {
  const double rate_hz = wanted.rate_hz.value_or(0);
  return rate_hz > 0 ? period_ms(rate_hz) : 0;
}

Bytes request_for(Id wanted) {
  const auto number = static_cast<std::uint16_t>(wanted);
  const std::array payload{static_cast<std::byte>(number & 0xff), static_cast<std::byte>(number >> 8)};
  return framed(Id::general_request, 0, payload);
}

Line powers_in(BytesView rest, std::size_t count, float lowest_db, float highest_db) {
  Line line(std::min(count, rest.size() / 2));
  for (std::size_t i = 0; i < line.size(); ++i)
    line[i] = lowest_db + static_cast<float>(sample_code(rest, i, 2)) / 65535 * (highest_db - lowest_db);
  return line;
}

Result<void> check_wanted(std::string_view title, std::optional<float> fastest_hz, std::initializer_list<std::string_view> known,
                          const protocol::Wanted& wanted) {
  if (auto accepted = protocol::accept_settings(wanted, title, known); !accepted) return accepted;
  if (wanted.settings.mode.value_or(0) > 0) return failure(ErrorKind::usage, std::string(title) + " has one mode only");
  const std::string why =
      fastest_hz ? protocol::rate_complaint(wanted.settings, title, *fastest_hz) : protocol::rate_complaint(wanted.settings);
  if (!why.empty()) return protocol::refused(why);
  return {};
}

void PingHost::compare_gain(int step, int most, HostPing& ping) const {
  const double percent = 100.0 * step / most;
  if (wanted_gain_percent_ && std::abs(percent - *wanted_gain_percent_) > 0.5)
    ping.limited.push_back(text::format("gain %.0f %% (step %d of %d), not %g %%", percent, step, most, *wanted_gain_percent_));
}

HostActions PingHost::on_open(std::span<const std::uint16_t>, Time) {
  HostActions actions;
  ask(actions);
  return actions;
}

HostActions PingHost::on_bytes(std::size_t, BytesView received, Time now) {
  HostActions actions;
  framer_.append(received);
  while (const auto frame = framer_.next()) {
    if (!frame->sum_is_right) continue;
    on_frame(*frame, actions);
    if (frame->header.id == Id::nack) {
      std::string text;  // the text after the id of the request
      for (std::size_t i = 2; i < frame->payload.size(); ++i) text += static_cast<char>(frame->payload[i]);
      if (const auto why = on_nack(refused_in(*frame), std::move(text), actions))
        actions.emplace_back(Error{ErrorKind::usage, about() + " refuses a request: " + *why});
    }
    if (auto ping = ping_from(*frame, now)) {
      ping->facts.message_size = header_size + frame->payload.size() + sum_size;
      actions.emplace_back(*std::move(ping));
    }
  }
  return actions;
}

}  // namespace sonar::ping
