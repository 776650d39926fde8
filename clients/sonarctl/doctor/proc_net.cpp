#include "clients/sonarctl/doctor/proc_net.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <sstream>

namespace sonar::clients::doctor {
namespace {

namespace fs = std::filesystem;

std::optional<std::uint32_t> hexadecimal(std::string_view text) {
  std::uint32_t value = 0;
  const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), value, 16);
  if (error != std::errc{} || stop != text.data() + text.size()) return std::nullopt;
  return value;
}

/// A word of an address as the kernel prints it: the bytes of the network in the order of this computer, which is little-endian.
std::string ipv4_text(std::uint32_t word) {
  return std::to_string(word & 0xff) + "." + std::to_string(word >> 8 & 0xff) + "." + std::to_string(word >> 16 & 0xff) + "." +
         std::to_string(word >> 24);
}

/// "0200007F:CB84", or 32 digits for IPv6.
bool read_endpoint(std::string_view text, std::string& host, std::uint16_t& port) {
  const std::size_t colon = text.find(':');
  if (colon != 8 && colon != 32) return false;
  const auto number = hexadecimal(text.substr(colon + 1));
  if (!number || *number > 0xffff) return false;
  port = static_cast<std::uint16_t>(*number);
  std::array<std::uint32_t, 4> words{};
  for (std::size_t i = 0; i < colon / 8; ++i) {
    const auto word = hexadecimal(text.substr(8 * i, 8));
    if (!word) return false;
    words[i] = *word;
  }
  const bool mapped = words[0] == 0 && words[1] == 0 && words[2] == 0xffff0000;
  if (colon == 8)
    host = ipv4_text(words[0]);
  else if (mapped)
    host = ipv4_text(words[3]);
  else
    host = words == std::array<std::uint32_t, 4>{} ? "[::]" : "[IPv6]";
  return true;
}

std::string content_of(const fs::path& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

std::vector<SocketLine> sockets_of(const char* protocol) {
  std::vector<SocketLine> all;
  for (const char* family : {"", "6"}) {
    const std::vector<SocketLine> some = parse_proc_net(content_of(std::string("/proc/net/") + protocol + family));
    all.insert(all.end(), some.begin(), some.end());
  }
  return all;
}

/// "socket:[12345]" into 12345.
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

std::vector<SocketLine> parse_proc_net(std::string_view text) {
  std::vector<SocketLine> sockets;
  std::istringstream lines{std::string(text)};
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string slot, local, remote, state, skipped;
    SocketLine socket;
    if (!(words >> slot >> local >> remote >> state)) continue;
    for (int i = 0; i < 5; ++i) words >> skipped;  // queues, timer, retransmits, user, timeout
    if (!(words >> socket.inode)) continue;
    const auto state_number = hexadecimal(state);
    if (!state_number || !read_endpoint(local, socket.local_host, socket.local_port) ||
        !read_endpoint(remote, socket.remote_host, socket.remote_port))
      continue;
    socket.state = static_cast<int>(*state_number);
    sockets.push_back(std::move(socket));
  }
  return sockets;
}

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
