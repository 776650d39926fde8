#include "clients/sonarctl/doctor/probes.hpp"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "clients/sonarctl/net.hpp"
#include "core/base/regular_file.hpp"
#include "core/text/ipv4.hpp"

namespace sonar::clients::doctor {
namespace {

std::optional<sockaddr_in> address_of(const Endpoint& at) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(at.port);
  if (::inet_pton(AF_INET, at.host.c_str(), &address.sin_addr) != 1) return std::nullopt;
  return address;
}

// The socket API requires these casts.
const sockaddr* generic(const sockaddr_in& address) { return reinterpret_cast<const sockaddr*>(&address); }

struct Datagram {
  std::string from;
  std::vector<std::byte> bytes;
};
/// Returns the next datagram that has arrived or arrives before the deadline.
std::optional<Datagram> receive(const Socket& socket, Steady::time_point deadline) {
  for (;;) {
    pollfd ready{socket.fd(), POLLIN, 0};
    const int polled = ::poll(&ready, 1, static_cast<int>(left_until(deadline).count()));
    if (polled < 0 && errno == EINTR) continue;
    if (polled != 1) return std::nullopt;
    std::array<std::byte, 2048> buffer;
    sockaddr_in from{};
    socklen_t size = sizeof from;
    const ssize_t received = ::recvfrom(socket.fd(), buffer.data(), buffer.size(), 0, reinterpret_cast<sockaddr*>(&from), &size);
    if (received < 0) continue;  // ICMP error of an earlier query
    char text[INET_ADDRSTRLEN] = "";
    ::inet_ntop(AF_INET, &from.sin_addr, text, sizeof text);
    return Datagram{text, {buffer.begin(), buffer.begin() + received}};
  }
}

constexpr int refusal_within_ms = 500;

Socket udp_socket() { return Socket(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)); }

std::string line_of(const std::string& file) {
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  return line;
}

/// Returns whether an interface has the address, or one in the same network.
bool has_interface(const std::string& ipv4, bool same_network) {
  const auto asked = address_of({ipv4, 0});
  ifaddrs* interfaces = nullptr;
  if (!asked || ::getifaddrs(&interfaces) != 0) return false;
  bool found = false;
  for (const ifaddrs* i = interfaces; i != nullptr && !found; i = i->ifa_next) {
    if (i->ifa_addr == nullptr || i->ifa_addr->sa_family != AF_INET) continue;
    sockaddr_in address{}, mask{};
    std::memcpy(&address, i->ifa_addr, sizeof address);
    mask.sin_addr.s_addr = ~in_addr_t{0};
    if (same_network && i->ifa_netmask != nullptr) std::memcpy(&mask, i->ifa_netmask, sizeof mask);
    found = ((address.sin_addr.s_addr ^ asked->sin_addr.s_addr) & mask.sin_addr.s_addr) == 0;
  }
  ::freeifaddrs(interfaces);
  return found;
}

}  // namespace

std::chrono::milliseconds left_until(Steady::time_point deadline) {
  return std::max(std::chrono::milliseconds(0), std::chrono::duration_cast<std::chrono::milliseconds>(deadline - Steady::now()));
}

Result<std::string> ipv4_of(const std::string& host) {
  const auto address = resolve({host, 0});
  if (!address) return tl::unexpected(address.error());
  char text[INET_ADDRSTRLEN] = "";
  ::inet_ntop(AF_INET, &address->sin_addr, text, sizeof text);
  return std::string(text);
}

bool is_on_this_host(const std::string& ipv4) { return ipv4.starts_with("127.") || has_interface(ipv4, false); }
bool is_in_our_network(const std::string& ipv4) { return ipv4.starts_with("127.") || has_interface(ipv4, true); }

Machine this_machine() {
  if (line_of("/proc/sys/kernel/osrelease").find("WSL2") != std::string::npos) return Machine::wsl2;
  std::error_code ec;
  const bool is_container = std::filesystem::exists("/.dockerenv", ec) || std::filesystem::exists("/run/.containerenv", ec);
  return is_container ? Machine::container : Machine::ordinary;
}

bool refuses(const Endpoint& at) {
  const auto to = address_of(at);
  const Socket socket(::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (!to || ::connect(socket.fd(), generic(*to), sizeof *to) == 0) return false;
  if (errno != EINPROGRESS) return errno == ECONNREFUSED;
  pollfd decided{socket.fd(), POLLOUT, 0};
  int error = 0;
  socklen_t size = sizeof error;
  return ::poll(&decided, 1, refusal_within_ms) == 1 && ::getsockopt(socket.fd(), SOL_SOCKET, SO_ERROR, &error, &size) == 0 &&
         error == ECONNREFUSED;
}

StatusListener::StatusListener(const Endpoint& on) {
  facts_.on = on;
  const auto address = address_of(on);
  Socket socket = udp_socket();
  const int yes = 1;
  ::setsockopt(socket.fd(), SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  if (address && ::bind(socket.fd(), generic(*address), sizeof *address) == 0) {
    socket_.emplace(std::move(socket));
    return;
  }
  facts_.error = address ? std::strerror(errno) : "\"" + on.host + "\" is not an IPv4 address";
  const auto programs = programs_by_socket();
  for (const SocketLine& line : udp_sockets())
    if (line.local_port == on.port) facts_.holders.push_back(holder_of(line, programs));
}

bool StatusListener::has_received(const std::string& host) const {
  return std::any_of(facts_.received.begin(), facts_.received.end(),
                     [&host](const ReceivedStatus& h) { return host.empty() || h.advertised == host || h.from == host; });
}

void StatusListener::listen(const std::string& host, Steady::time_point deadline) {
  if (!socket_) return;
  while (const auto datagram = receive(*socket_, Steady::now())) add(datagram->from, datagram->bytes);
  while (!has_received(host)) {
    const auto datagram = receive(*socket_, deadline);
    if (!datagram) return;
    add(datagram->from, datagram->bytes);
  }
}

void StatusListener::add(const std::string& from, std::span<const std::byte> datagram) {
  std::optional<protocol::Announcement> status;
  for (const protocol::Make& make : protocol::makes())
    if (!status && make.announced != nullptr) status = make.announced(datagram);
  if (!status) return;  // not a status message
  ReceivedStatus received;
  received.from = from;
  received.advertised = text::format_ipv4(status->address);
  if (status->client != protocol::Ipv4{}) received.client = text::format_ipv4(status->client);
  received.device_id = status->device_id;
  received.size = datagram.size();
  received.complaints = status->complaints;
  const auto known = std::find_if(facts_.received.begin(), facts_.received.end(), [&received](const ReceivedStatus& h) {
    return h.from == received.from && h.advertised == received.advertised;
  });
  if (known == facts_.received.end())
    facts_.received.push_back(std::move(received));
  else
    *known = std::move(received);
}

void StatusListener::finish() { facts_.waited_s = std::chrono::duration<double>(Steady::now() - since_).count(); }

DiscoveryQuestion::DiscoveryQuestion(const std::vector<std::string>& hosts) {
  socket_.emplace(udp_socket());
  const int yes = 1;
  ::setsockopt(socket_->fd(), SOL_SOCKET, SO_BROADCAST, &yes, sizeof yes);
  const std::vector<std::string> everywhere{"127.255.255.255", "255.255.255.255"};
  for (const protocol::Make& make : protocol::makes()) {
    if (make.search == nullptr) continue;
    const wire::Bytes question = make.search->question();
    for (const std::string& host : hosts.empty() ? everywhere : hosts)
      if (const auto to = address_of({host, make.search->port}))
        ::sendto(socket_->fd(), question.data(), question.size(), 0, generic(*to),
                 sizeof *to);  // fails without a network: then no answer arrives
  }
}

void DiscoveryQuestion::receive_answers(std::vector<FoundSonar>& found, Steady::time_point deadline) const {
  while (const auto datagram = receive(*socket_, found.empty() ? deadline : Steady::now())) {
    for (const protocol::Make& make : protocol::makes()) {
      const auto answer = make.search != nullptr ? make.search->answer(datagram->bytes) : std::nullopt;
      if (!answer) continue;
      const std::string at = datagram->from + ":" + std::to_string(answer->port);
      if (std::none_of(found.begin(), found.end(), [&at](const FoundSonar& f) { return f.at == at; }))
        found.push_back({&make, at, answer->about});
    }
  }
}

HttpFacts ask_health(const Endpoint& at, bool given, std::chrono::milliseconds patience) {
  HttpFacts facts;
  facts.at = at;
  facts.given = given;
  const auto reply = http_ask(at, "GET", "/healthz", "", patience);
  if (!reply) return facts;
  facts.code = static_cast<int>(reply->status);
  facts.text = reply->body.substr(0, reply->body.find('\n'));
  while (!facts.text.empty() && (facts.text.back() == '\r' || facts.text.back() == ' ')) facts.text.pop_back();
  return facts;
}

KernelPorts kernel_ports() {
  KernelPorts ports;
  std::ifstream range("/proc/sys/net/ipv4/ip_local_port_range");
  ports.known = static_cast<bool>(range >> ports.low >> ports.high);
  ports.reserved = line_of("/proc/sys/net/ipv4/ip_local_reserved_ports");
  return ports;
}

namespace {

namespace fs = std::filesystem;

/// Returns an empty text for the file of a process that has ended.
std::string content_of(const fs::path& file) { return read_regular(file, std::size_t{64} << 20).value_or(std::string()); }

std::vector<SocketLine> sockets_of(const char* protocol) {
  std::vector<SocketLine> all;
  for (const char* family : {"", "6"}) {
    const std::vector<SocketLine> some = parse_proc_net(content_of(std::string("/proc/net/") + protocol + family));
    all.insert(all.end(), some.begin(), some.end());
  }
  return all;
}

/// Parses "socket:[12345]" to 12345.
std::optional<std::uint64_t> socket_inode(const std::string& link) {
  std::uint64_t inode = 0;
  if (!link.starts_with("socket:[")) return std::nullopt;
  const auto [stop, error] = std::from_chars(link.data() + 8, link.data() + link.size(), inode);
  return error == std::errc{} && *stop == ']' ? std::optional(inode) : std::nullopt;
}

void add_program(const fs::path& process, int pid, std::map<std::uint64_t, Program>& programs) {
  std::string name = content_of(process / "comm");
  while (!name.empty() && name.back() == '\n') name.pop_back();
  std::error_code ec;
  for (fs::directory_iterator fd(process / "fd", ec), end; !ec && fd != end; fd.increment(ec)) {
    std::error_code unread;
    const auto inode = socket_inode(fs::read_symlink(fd->path(), unread).string());
    if (!unread && inode) programs.insert({*inode, {pid, name}});
  }
}

}  // namespace

std::vector<SocketLine> tcp_sockets() { return sockets_of("tcp"); }
std::vector<SocketLine> udp_sockets() { return sockets_of("udp"); }

std::map<std::uint64_t, Program> programs_by_socket() {
  std::map<std::uint64_t, Program> programs;
  std::error_code ec;
  for (fs::directory_iterator process("/proc", ec), end; !ec && process != end; process.increment(ec)) {
    const std::string name = process->path().filename().string();
    int pid = 0;
    const auto [stop, error] = std::from_chars(name.data(), name.data() + name.size(), pid);
    if (error == std::errc{} && stop == name.data() + name.size()) add_program(process->path(), pid, programs);
  }
  return programs;
}

PortHolder holder_of(const SocketLine& socket, const std::map<std::uint64_t, Program>& programs) {
  PortHolder holder{socket.local_host + ":" + std::to_string(socket.local_port), 0, {}};
  const auto found = programs.find(socket.inode);
  if (found == programs.end()) return holder;
  holder.pid = found->second.pid;
  holder.program = found->second.name;
  return holder;
}

}  // namespace sonar::clients::doctor
