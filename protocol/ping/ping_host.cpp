#include "protocol/ping/ping_host.hpp"

#include <utility>

namespace sonar::ping {

using protocol::HostActions;
using protocol::HostPing;

double period_ms_of(const protocol::SettingsOverride& wanted) {
  const double rate_hz = wanted.rate_hz.value_or(0);
  return rate_hz > 0 ? std::clamp(1000 / rate_hz, 1.0, 30000.0) : 0;
}

HostActions PingHost::on_open(std::span<const std::uint16_t>, Time) {
  HostActions actions;
  ask(actions);
  return actions;
}

HostActions PingHost::on_bytes(std::size_t, BytesView received, Time) {
  HostActions actions;
  framer_.append(received);
  while (const auto frame = framer_.next()) {
    if (!frame->sum_is_right) continue;
    on_frame(*frame, actions);
    if (frame->header.id == Id::nack) {
      std::string why;
      for (std::size_t i = 2; i < frame->payload.size(); ++i) why += static_cast<char>(frame->payload[i]);
      actions.emplace_back(Error{ErrorKind::bad_data, "refused a request: " + why});
    }
    if (auto ping = ping_from(*frame)) {
      ping->facts.message_size = header_size + frame->payload.size() + sum_size;
      actions.emplace_back(*std::move(ping));
    }
  }
  return actions;
}

}  // namespace sonar::ping
