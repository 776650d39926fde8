#include "clients/bvtsdk/core/description.hpp"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <memory>

#include "protocol/blueview/link.hpp"

namespace sonar::bvt {

void copy_settings(HeadDescription& to, const HeadDescription& from) {
  to.start_m = from.start_m;
  to.stop_m = from.stop_m;
  to.sound_speed_mps = from.sound_speed_mps;
  to.gain_db = from.gain_db;
  to.tvg_db_per_m = from.tvg_db_per_m;
  to.fluid = from.fluid;
}

const HeadDescription* SonarDescription::head(int number) const {
  for (const HeadDescription& h : heads)
    if (h.id == number) return &h;
  const bool alias = heads.size() == 1 && !strict_heads() && (number == 0 || number == 1);
  return alias ? &heads.front() : nullptr;
}

std::optional<SonarDescription> decode_description(BytesView payload) {
  Reader reader(payload);
  SonarDescription sonar;
  sonar.version = reader.read<std::uint16_t>();
  sonar.model = reader.text();
  sonar.name = reader.text();
  sonar.serial = reader.text();
  sonar.firmware = reader.text();
  sonar.temperature_c = reader.read<float>();
  sonar.capabilities = reader.read<std::uint32_t>();
  const int heads = reader.read<std::uint8_t>();
  for (int i = 0; i < heads && reader.ok(); ++i) {
    HeadDescription h;
    h.id = reader.read<std::int32_t>();
    h.name = reader.text();
    for (float* value : {&h.min_range_m, &h.max_range_m, &h.start_m, &h.stop_m}) *value = reader.read<float>();
    h.centre_hz = reader.read<std::int32_t>();
    h.fov_min_deg = reader.read<float>();
    h.fov_max_deg = reader.read<float>();
    h.beams = reader.read<std::uint16_t>();
    h.sound_speed_mps = reader.read<std::int32_t>();
    h.gain_db = reader.read<float>();
    h.tvg_db_per_m = reader.read<float>();
    h.fluid = reader.read<std::int32_t>();
    sonar.heads.push_back(std::move(h));
  }
  if (!reader.ok()) return std::nullopt;
  return sonar;
}

Bytes encode_description(const SonarDescription& sonar) {
  Bytes out;
  put(out, sonar.version);
  for (const std::string* text : {&sonar.model, &sonar.name, &sonar.serial, &sonar.firmware}) put_text(out, *text);
  put(out, sonar.temperature_c);
  put(out, sonar.capabilities);
  const std::size_t heads = sonar.heads.size() < 255 ? sonar.heads.size() : 255;
  put(out, static_cast<std::uint8_t>(heads));
  for (std::size_t i = 0; i < heads; ++i) {
    const HeadDescription& h = sonar.heads[i];
    put(out, h.id);
    put_text(out, h.name);
    for (const float value : {h.min_range_m, h.max_range_m, h.start_m, h.stop_m}) put(out, value);
    put(out, h.centre_hz);
    put(out, h.fov_min_deg);
    put(out, h.fov_max_deg);
    put(out, h.beams);
    put(out, h.sound_speed_mps);
    put(out, h.gain_db);
    put(out, h.tvg_db_per_m);
    put(out, h.fluid);
  }
  return out;
}

namespace {

using Clock = std::chrono::steady_clock;
constexpr in_addr_t loopback_broadcast = 0x7FFFFFFF;  // 127.255.255.255: sonars of this machine at any 127.x.y.z

in_addr_t ipv4_of(const sockaddr* address) {
  sockaddr_in in;
  std::memcpy(&in, address, sizeof in);
  return in.sin_addr.s_addr;
}

/// Returns the addresses to which the question is sent, in network byte order.
std::vector<in_addr_t> addresses_to_ask() {
  std::vector<in_addr_t> out{htonl(INADDR_LOOPBACK), htonl(loopback_broadcast), htonl(INADDR_BROADCAST)};
  ifaddrs* list = nullptr;
  if (getifaddrs(&list) == 0) {
    const std::unique_ptr<ifaddrs, decltype(&freeifaddrs)> owner(list, &freeifaddrs);
    for (const ifaddrs* i = list; i; i = i->ifa_next)
      if (i->ifa_addr && i->ifa_addr->sa_family == AF_INET && (i->ifa_flags & IFF_BROADCAST) && i->ifa_broadaddr)
        out.push_back(ipv4_of(i->ifa_broadaddr));
  }
  const char* more = std::getenv("BVE_DISCOVERY");
  std::string names = more ? more : "";
  std::replace(names.begin(), names.end(), ',', ' ');
  for (std::size_t at = 0; at < names.size();) {
    const std::size_t end = std::min(names.find(' ', at), names.size());
    in_addr address{};
    if (inet_pton(AF_INET, names.substr(at, end - at).c_str(), &address) == 1) out.push_back(address.s_addr);
    at = end + 1;
  }
  std::sort(out.begin(), out.end());
  out.erase(std::unique(out.begin(), out.end()), out.end());
  return out;
}

}  // namespace

Code DiscoveryAgent::start() {
  found_.clear();
  socket_ = Descriptor(socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (!socket_) return failed;
  const int on = 1;
  setsockopt(socket_.fd(), SOL_SOCKET, SO_BROADCAST, &on, sizeof on);
  ask();
  return success;
}

void DiscoveryAgent::stop() {
  if (!socket_) return;
  receive_answers();
  socket_ = Descriptor();
}

const std::vector<std::string>& DiscoveryAgent::sonars() {
  if (socket_) {
    receive_answers();
    if (Clock::now() - last_asked_ > std::chrono::seconds(1)) ask();
  }
  return found_;
}

void DiscoveryAgent::ask() {
  last_asked_ = Clock::now();
  Bytes question(blueview::discovery_question.begin(), blueview::discovery_question.end());
  put(question, blueview::protocol_version);
  for (const in_addr_t address : addresses_to_ask()) {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(blueview::discovery_port);
    to.sin_addr.s_addr = address;
    sockaddr generic;
    std::memcpy(&generic, &to, sizeof to);
    sendto(socket_.fd(), question.data(), question.size(), MSG_NOSIGNAL, &generic, sizeof to);  // no receiver is not an error
  }
}

void DiscoveryAgent::receive_answers() {
  for (int i = 0; i < 1000; ++i) {
    std::uint8_t answer[1024];
    sockaddr from{};
    socklen_t from_size = sizeof from;
    const ssize_t n = recvfrom(socket_.fd(), answer, sizeof answer, 0, &from, &from_size);
    if (n < 0) return;
    if (n < 6 || std::memcmp(answer, blueview::discovery_answer.data(), 4) != 0 || from.sa_family != AF_INET) continue;
    const in_addr_t address = ipv4_of(&from);
    char text[INET_ADDRSTRLEN] = "";
    inet_ntop(AF_INET, &address, text, sizeof text);
    if (std::find(found_.begin(), found_.end(), text) == found_.end()) found_.push_back(text);
  }
}

}  // namespace sonar::bvt
