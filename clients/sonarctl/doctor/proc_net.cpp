#include "clients/sonarctl/doctor/proc_net.hpp"

#include <charconv>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>

namespace sonar::clients::doctor {
namespace {

namespace fs = std::filesystem;

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
