#include "protocol/doctor/socket_table.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <optional>
#include <sstream>

#include "core/text/format.hpp"

namespace sonar::doctor {
namespace {

std::optional<std::uint32_t> hexadecimal(std::string_view text) {
  std::uint32_t value = 0;
  const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), value, 16);
  if (error != std::errc{} || stop != text.data() + text.size()) return std::nullopt;
  return value;
}

/// Returns the text of an IPv4 address. The kernel prints the four bytes of an address as a number of this computer, which is
/// little-endian, so the first byte is the lowest.
std::string ipv4_text(std::uint32_t word) {
  return std::to_string(word & 0xff) + "." + std::to_string(word >> 8 & 0xff) + "." + std::to_string(word >> 16 & 0xff) + "." +
         std::to_string(word >> 24);
}

/// Returns the text of an IPv6 address, "[fe80::1]" (RFC 5952). Each word is printed as a number of this computer, as in IPv4.
std::string ipv6_text(const std::array<std::uint32_t, 4>& words) {
  std::array<unsigned, 8> groups{};
  for (std::size_t i = 0; i < groups.size(); ++i) {
    const std::uint32_t half = words[i / 2] >> (i % 2 * 16);
    groups[i] = (half & 0xff) << 8 | (half >> 8 & 0xff);
  }
  std::size_t begin = groups.size(), length = 1;  // "::" stands for the first longest run of at least two zeros
  for (std::size_t i = 0, run = 0; i < groups.size(); ++i) {
    run = groups[i] == 0 ? run + 1 : 0;
    if (run > length) length = run, begin = i + 1 - run;
  }
  std::string text = "[";
  for (std::size_t i = 0; i < groups.size(); ++i) {
    if (i == begin) text += "::";
    if (i >= begin && i < begin + length) continue;
    text += text::format(i > 0 && i != begin + length ? ":%x" : "%x", groups[i]);
  }
  return text + "]";
}

/// Reads an address and a port such as "0200007F:CB84"; an IPv6 address has 32 digits.
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
  const bool mapped = words[0] == 0 && words[1] == 0 && words[2] == 0xffff0000;  // ::ffff:a.b.c.d, an IPv4 peer of an IPv6 socket
  if (colon == 8)
    host = ipv4_text(words[0]);
  else if (mapped)
    host = ipv4_text(words[3]);
  else
    host = ipv6_text(words);
  return true;
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
    for (int i = 0; i < 5; ++i) words >> skipped;  // skips queues, timer, retransmits, user, timeout
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

// /proc/net/snmp has two lines that begin with "Tcp:": the names, then the values in the same order.
std::uint64_t failed_attempts(std::string_view text) {
  std::istringstream lines{std::string(text)};
  std::string names, values;
  while (std::getline(lines, names) && !(names.starts_with("Tcp:") && std::getline(lines, values))) {
  }
  std::istringstream name_words(names), value_words(values);
  for (std::string name, value; name_words >> name && value_words >> value;) {
    std::uint64_t count = 0;
    if (name == "AttemptFails" && std::from_chars(value.data(), value.data() + value.size(), count).ec == std::errc{})
      return count;
  }
  return 0;
}

}  // namespace sonar::doctor
