#include "clients/sonarctl/ping_stream.hpp"

#include <algorithm>
#include <array>
#include <iterator>

#include "core/text/ipv4.hpp"

namespace sonar::clients {

namespace {

constexpr std::chrono::milliseconds probe_patience(300);
constexpr std::chrono::milliseconds answer_patience(3000);  // minimum for a head, which may be computing

}  // namespace

Result<PingStream> PingStream::open(const Endpoint& device, SonarKind kind, Settings settings,
                                    std::chrono::milliseconds patience) {
  const std::optional<HeadRequest> wanted = settings.oculus ? std::optional(settings.head) : std::nullopt;
  const auto stream_at = [](const Endpoint& place, auto opened) -> Result<PingStream> {
    if (!opened) return tl::unexpected(opened.error());
    return PingStream(place, Other(*std::move(opened)));
  };
  const Endpoint ping360{device.host, brping_ports[0]}, http{device.host, waterlinked_port};
  if (kind == SonarKind::waterlinked) return stream_at(device, WaterlinkedStream::open(device, wanted, patience));
  if (kind == SonarKind::brping && device.port == ping360.port) {
    auto socket = BrpingStream::find_ping360(ping360, patience);
    if (!socket) return tl::unexpected(socket.error());
    return stream_at(ping360, BrpingStream::open(*std::move(socket), BrpingDevice::ping360, wanted));
  }
  std::vector<Endpoint> places{device};
  if (kind == SonarKind::either)
    for (const std::uint16_t port : {blueview::tcp_port, aris::command_port, brping_ports[1], brping_ports[2]})
      places.push_back({device.host, port});
  auto connected = connect_first(places, patience);
  if (!connected && kind == SonarKind::either) {
    if (auto socket = BrpingStream::find_ping360(ping360, probe_patience))
      return stream_at(ping360, BrpingStream::open(*std::move(socket), BrpingDevice::ping360, wanted));
    if (connect_first({http}, probe_patience))
      return stream_at(http, WaterlinkedStream::open(http, wanted, std::max(patience, answer_patience)));
  }
  if (!connected) return tl::unexpected(connected.error());
  const Endpoint& place = places[connected->which];
  if (kind == SonarKind::brping || connected->which > 2)
    return stream_at(place, BrpingStream::open(std::move(connected->socket),
                                               brping_device_at(place.port).value_or(BrpingDevice::surveyor), wanted));
  if (kind == SonarKind::blueview || connected->which == 1) {
    auto head = BlueViewStream::open(std::move(connected->socket), settings.head, std::max(patience, answer_patience));
    if (!head && head.error().kind != ErrorKind::usage)
      return failure(head.error().kind, "tcp " + text_from(place) + " " + head.error().text);
    return stream_at(place, std::move(head));
  }
  if (kind == SonarKind::aris || connected->which == 2)
    return stream_at(place, ArisStream::open(std::move(connected->socket), wanted));
  PingStream stream(place, std::move(connected->socket), std::move(settings.oculus));
  if (stream.asked_)
    if (Result<void> sent = stream.ask_again(); !sent) return tl::unexpected(sent.error());
  return stream;
}

Result<void> PingStream::ask_again() {
  return asked_ && is_oculus() ? write_all(socket_, oculus::make_fire(*asked_)) : Result<void>{};
}

bool PingStream::is_rejected(std::chrono::milliseconds patience) const {
  if (const auto* aris = std::get_if<ArisStream>(&other_)) return aris->is_rejected(patience);
  if (const auto* brping = std::get_if<BrpingStream>(&other_)) return brping->is_rejected(patience);
  return is_oculus() && ends_without_a_byte(socket_, patience);
}

std::string PingStream::about() const {
  std::string what;
  if (const auto* blueview = std::get_if<BlueViewStream>(&other_)) what = blueview->about();
  if (std::holds_alternative<ArisStream>(other_)) what = "an ARIS";
  if (const auto* brping = std::get_if<BrpingStream>(&other_)) what = brping->about();
  if (std::holds_alternative<WaterlinkedStream>(other_)) what = "a Sonar 3D-15";
  return text_from(device_) + (what.empty() ? "" : ", " + what);
}

Result<void> PingStream::record_to(const std::filesystem::path& file) {
  if (is_blueview())
    return failure(ErrorKind::usage, "only Oculus sonars are recorded; this is a BlueView head at " + text_from(device_) +
                                         "; hosts record it with BVTSonar_CreateFile");
  if (!is_oculus()) return failure(ErrorKind::usage, "only Oculus sonars are recorded; this is " + about());
  record_.open(file, std::ios::binary | std::ios::trunc);
  if (!record_) return failure(ErrorKind::io, "cannot write " + file.string() + ": is the folder there and writable?");
  return {};
}

PingStream::Item PingStream::next(std::chrono::milliseconds patience) {
  if (!is_oculus())
    return std::visit(
        [patience](auto& stream) -> Item {
          if constexpr (std::is_same_v<std::decay_t<decltype(stream)>, std::monostate>) {
            return {};
          } else {
            auto item = stream.next(patience);
            Item out{item.what, {}, {}, std::move(item.error)};
            if (item.ping) out.ping = *std::move(item.ping);
            return out;
          }
        },
        other_);
  const auto deadline = std::chrono::steady_clock::now() + patience;
  for (;;) {
    if (auto message = decoder_.next()) {
      if (auto* ping = std::get_if<oculus::DecodedPing>(&*message)) return {Wait::data, std::move(*ping), {}, {}};
      return {Wait::data, {}, std::move(message), {}};
    }
    std::array<std::byte, 65536> chunk;
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now());
    const Read read = read_some(socket_, chunk, left);
    if (read.what != Wait::data) return {read.what, {}, {}, read.error};
    const auto received = std::span<const std::byte>(chunk).first(read.size);
    if (record_.is_open()) {
      for (const std::byte b : received) record_.put(static_cast<char>(b));
      if (!record_) return {Wait::closed, {}, {}, "the recording cannot be written any further: is the disk full?"};
    }
    decoder_.append(received);
  }
}

Result<std::vector<oculus::DecodedPing>> read_recording(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) return failure(ErrorKind::missing_file, "cannot read " + file.string() + ": no such file, or no permission");
  oculus::Decoder decoder;
  std::vector<oculus::DecodedPing> pings;
  std::vector<char> chunk(1 << 16);
  while (in.read(chunk.data(), static_cast<std::streamsize>(chunk.size())), in.gcount() > 0) {
    wire::Bytes bytes;
    for (std::streamsize i = 0; i < in.gcount(); ++i) bytes.push_back(static_cast<std::byte>(chunk[static_cast<std::size_t>(i)]));
    decoder.append(bytes);
    while (auto message = decoder.next())
      if (auto* ping = std::get_if<oculus::DecodedPing>(&*message)) pings.push_back(std::move(*ping));
  }
  if (pings.empty())
    return failure(ErrorKind::bad_data, file.string() + " holds no Oculus ping: it must be the raw bytes of the TCP stream");
  return pings;
}

Result<Discovered> discover(std::chrono::milliseconds patience) {
  auto socket = listen_udp(oculus::status_port);
  if (!socket) return tl::unexpected(socket.error());
  const auto deadline = std::chrono::steady_clock::now() + patience;
  for (;;) {
    std::array<std::byte, 2048> datagram;
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now());
    const Read read = read_some(*socket, datagram, left);
    if (read.what != Wait::data)
      return failure(ErrorKind::unavailable, "no status datagram on udp " + std::to_string(oculus::status_port) +
                                                 ": is a sonar running, and does its status_to reach this machine?");
    const auto status = oculus::decode_status(std::span<const std::byte>(datagram).first(read.size));
    if (!status) continue;  // not a status message
    Discovered found;
    found.status = *status;
    found.device.host = text::format_ipv4(status->ip_address);
    found.device.port = oculus::tcp_port;
    found.complaints = oculus::status_violations(*status, read.size);
    return found;
  }
}

}  // namespace sonar::clients
