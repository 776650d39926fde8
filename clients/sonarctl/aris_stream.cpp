#include "clients/sonarctl/aris_stream.hpp"

#include <netinet/in.h>
#include <sys/socket.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <utility>

#include "protocol/aris/models.hpp"

namespace sonar::clients {
namespace {

constexpr auto ping_after = std::chrono::seconds(1);
constexpr int receive_buffer_bytes = 4 << 20;  // a few frames
constexpr double nominal_sound_speed_mps = 1490;
constexpr std::uint32_t longest_pulse_us = 80;

/// The settings for a product, or none: it does not reach the range.
std::optional<aris::Acoustics> acoustics_for(const aris::Product& product, const HeadRequest& request) {
  aris::Acoustics a = product.initial;
  if (request.gain_percent) a.gain_db = static_cast<float>(aris::highest_gain_db * *request.gain_percent / 100);
  if (request.range_m) {
    if (*request.range_m > product.window_end_m) return std::nullopt;
    const double window_us = 2e6 * *request.range_m / nominal_sound_speed_mps - a.start_delay_us;
    a.sample_period_us = static_cast<std::uint32_t>(std::clamp(std::ceil(window_us / 2000), 4.0, 100.0));
    a.samples_per_beam =
        static_cast<std::uint32_t>(std::clamp<double>(window_us / a.sample_period_us, aris::least_samples, aris::most_samples));
    a.cycle_us = aris::shortest_cycle_us(a);
    a.pulse_us = std::max(a.pulse_us, std::min(a.sample_period_us, longest_pulse_us));
  }
  const double rate_hz = request.rate_hz.value_or(static_cast<double>(a.frame_rate_hz));
  a.frame_rate_hz = static_cast<float>(std::clamp(rate_hz, 1.0, aris::highest_frame_rate_hz(product, a, std::nullopt)));
  a.cookie = 1;
  return aris::judge(a, product, false).used;  // with the longest pulse of the product
}

std::uint32_t peer_ip_of(const Socket& socket) {
  sockaddr_in at{};
  socklen_t size = sizeof at;
  ::getpeername(socket.fd(), reinterpret_cast<sockaddr*>(&at), &size);
  return at.sin_addr.s_addr;
}

std::uint16_t local_port_of(const Socket& socket) {
  sockaddr_in at{};
  socklen_t size = sizeof at;
  ::getsockname(socket.fd(), reinterpret_cast<sockaddr*>(&at), &size);
  return ntohs(at.sin_port);
}

/// What the frame says of its mode; none: a product or mode that we do not know.
std::optional<ArisPing> ping_from(aris::DecodedFrame frame, std::size_t bytes) {
  for (const auto& model : aris::models()) {
    const aris::Product& product = aris::product_of(*model);
    if (static_cast<std::uint32_t>(product.system) != frame.header.system) continue;
    const auto mode = aris::mode_index(
        product, {frame.header.ping_mode, static_cast<aris::Frequency>(frame.header.frequency), frame.header.large_lens != 0});
    if (!mode) return std::nullopt;
    const FrequencyMode& of = model->modes[static_cast<std::size_t>(*mode)];
    if (of.beam_azimuths_rad.size() != frame.beams) return std::nullopt;
    return ArisPing{std::move(frame), of.beam_azimuths_rad, static_cast<double>(of.centre_hz), bytes};
  }
  return std::nullopt;
}

}  // namespace

Result<ArisStream> ArisStream::open(Socket commands, const std::optional<HeadRequest>& request) {
  auto frames = listen_udp(Endpoint{"0.0.0.0", 0});
  if (!frames) return tl::unexpected(frames.error());
  ::setsockopt(frames->fd(), SOL_SOCKET, SO_RCVBUF, &receive_buffer_bytes, sizeof receive_buffer_bytes);
  ArisStream stream(std::move(commands), std::move(*frames));
  stream.sonar_ip_ = peer_ip_of(stream.commands_);
  // The device does not say what it is, except in beacons that may not come here. It refuses the settings of other products; the
  // order matters to an ARIS 1800, which also takes those of a 1200. Frames begin with the receiver.
  aris::Command command;
  std::uint32_t cookie = 0;
  for (const auto& model : aris::models()) {
    auto acoustics = request ? acoustics_for(aris::product_of(*model), *request) : std::nullopt;
    if (!acoustics) continue;
    acoustics->cookie = stream.asked_[aris::product_of(*model).system] = ++cookie;
    command = {};
    command.type = aris::CommandType::set_acoustics;
    command.acoustics = *acoustics;
    if (auto sent = stream.send(command); !sent) return tl::unexpected(sent.error());
  }
  if (request && cookie == 0) return failure(ErrorKind::usage, "no ARIS reaches so far: the ARIS 1200 shows up to 100 m");
  command = {};
  command.type = aris::CommandType::set_receiver;
  command.receiver = aris::Receiver{local_port_of(stream.frames_), ""};
  if (auto sent = stream.send(command); !sent) return tl::unexpected(sent.error());
  return stream;
}

Result<void> ArisStream::send(const aris::Command& command) {
  sent_at_ = Clock::now();
  return write_all(commands_, aris::framed(command));
}

/// Once each: settings that the sonar does not use, frames of which datagrams were lost.
void ArisStream::warn_of(const aris::DecodedFrame& frame) {
  constexpr int settled = 3;  // the first frames may still have the settings of before
  const aris::FrameHeader& h = frame.header;
  if (frame.index >= settled && !asked_.empty() && !warned_of_settings_) {
    const auto cookie = asked_.find(static_cast<aris::SystemType>(h.system));
    warned_of_settings_ =
        cookie == asked_.end() || (h.applied_cookie != cookie->second && h.constrained_cookie != cookie->second);
    if (warned_of_settings_) std::fprintf(stderr, "sonarctl: the sonar does not use the settings that were sent to it\n");
  }
  if (assembler_.incomplete() > 0 && !std::exchange(warned_of_losses_, true))
    std::fprintf(stderr, "sonarctl: a frame before number %d is left out: datagrams were lost\n", frame.index);
}

ArisStream::Item ArisStream::next(std::chrono::milliseconds patience) {
  const auto deadline = Clock::now() + patience;
  for (;;) {
    if (Clock::now() - sent_at_ >= ping_after) {
      aris::Command command;
      command.type = aris::CommandType::ping;
      command.ping.emplace();
      if (const auto sent = send(command); !sent) return {Wait::closed, {}, sent.error().text};
    }
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(deadline - Clock::now());
    const Datagram read =
        receive_from(frames_, chunk_, std::clamp(left, std::chrono::milliseconds(0), std::chrono::milliseconds(200)));
    if (read.what == Wait::interrupted || read.what == Wait::closed) return {read.what, {}, read.error};
    const std::size_t size = read.ip == sonar_ip_ ? read.size : 0;  // others' datagrams are nothing to us
    bytes_ += size;
    if (auto frame = assembler_.add(std::span<const std::byte>(chunk_).first(size))) {
      warn_of(*frame);
      if (auto ping = ping_from(std::move(*frame), std::exchange(bytes_, 0))) return {Wait::data, std::move(ping), {}};
    }
    if (ends_without_a_byte(commands_, std::chrono::milliseconds(0))) return {Wait::closed, {}, {}};
    if (Clock::now() >= deadline) return {Wait::timed_out, {}, {}};
  }
}

}  // namespace sonar::clients
