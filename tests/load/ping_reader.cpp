#include "tests/load/ping_reader.hpp"

#include <arpa/inet.h>
#include <linux/filter.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>

#include "protocol/oculus/fire.hpp"
#include "protocol/oculus/framer.hpp"
#include "tests/load/premade_engine.hpp"

namespace sonar::load {

using std::chrono::milliseconds;

Socket::Socket(const std::string& address, std::uint16_t port, int receive_buffer) {
  fd_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (receive_buffer > 0) setsockopt(fd_, SOL_SOCKET, SO_RCVBUF, &receive_buffer, sizeof receive_buffer);
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(port);
  inet_pton(AF_INET, address.c_str(), &to.sin_addr);
  if (::connect(fd_, static_cast<const sockaddr*>(static_cast<const void*>(&to)), sizeof to) != 0) close();
}

bool Socket::send(const std::vector<std::byte>& bytes, milliseconds patience) {
  const auto deadline = Steady::now() + patience;
  std::size_t done = 0;
  while (done < bytes.size() && Steady::now() < deadline) {
    pollfd p{fd_, POLLOUT, 0};
    if (::poll(&p, 1, 100) <= 0) continue;
    const auto n = ::send(fd_, bytes.data() + done, bytes.size() - done, MSG_NOSIGNAL | MSG_DONTWAIT);
    if (n < 0 && errno != EAGAIN) return false;
    if (n > 0) done += static_cast<std::size_t>(n);
  }
  return done == bytes.size();
}

long Socket::receive(std::byte* into, std::size_t size, milliseconds patience) {
  pollfd p{fd_, POLLIN, 0};
  if (::poll(&p, 1, static_cast<int>(patience.count())) <= 0) return -1;
  return ::recv(fd_, into, size, 0);
}

void Socket::close() {
  if (fd_ >= 0) ::close(fd_);
  fd_ = -1;
}

void Socket::reset() {
  const linger now{1, 0};
  setsockopt(fd_, SOL_SOCKET, SO_LINGER, &now, sizeof now);
  close();
}

void Socket::die() {
  sock_filter drop_all{BPF_RET | BPF_K, 0, 0, 0};
  const sock_fprog filter{1, &drop_all};
  setsockopt(fd_, SOL_SOCKET, SO_ATTACH_FILTER, &filter, sizeof filter);
}

void Socket::close_one_way() { ::shutdown(fd_, SHUT_WR); }

std::vector<std::byte> fire(int hz) {
  oculus::FireRequest f;
  f.settings.mode = 2;
  f.settings.ping_rate = hz == 0 ? oculus::PingRate::standby : hz <= 10 ? oculus::PingRate::hz10 : oculus::PingRate::hz40;
  f.settings.flags = oculus::flag::range_in_metres | oculus::flag::simple_result;
  f.settings.range = 2;
  f.settings.gain_percent = 50;
  return oculus::make_fire(f);
}

bool PingReader::read_some() {
  if (ended) return false;
  const auto n = ::recv(socket_.fd(), buffer_.data() + filled_, buffer_.size() - filled_, MSG_DONTWAIT);
  if (n < 0 && errno == EAGAIN) return true;
  if (n <= 0) {
    ended = true;
    was_reset = n < 0;
    return false;
  }
  filled_ += static_cast<std::size_t>(n);
  while (filled_ >= oculus::header_size) {
    const auto header = oculus::header_of(std::span(buffer_).first(oculus::header_size));
    const std::size_t size = oculus::header_size + header.payload_size;
    if (header.oculus_id != oculus::magic || size > buffer_.size()) {
      ++garbled;
      ended = true;  // the rest of such a stream cannot be decoded
      return false;
    }
    if (filled_ < size) break;
    take_message(size);
    std::memmove(buffer_.data(), buffer_.data() + size, filled_ - size);
    filled_ -= size;
  }
  return true;
}

void PingReader::take_message(std::size_t size) {
  const auto message = std::span<const std::byte>(buffer_).first(size);
  if (oculus::header_of(message).type != oculus::MessageType::ping_result) return;
  oculus::PingResultV1 ping;
  wire::Reader reader(message);
  fields(reader, ping);
  const auto now = Steady::now();
  const auto picture = picture_of(ping.ping_id);
  const bool whole = ping.sizes.image_size == picture.size() && ping.sizes.image_offset + picture.size() <= size &&
                     std::memcmp(message.data() + ping.sizes.image_offset, picture.data(), picture.size()) == 0;
  if (!whole || ping.ping_id <= last_id) ++garbled;
  if (pings > 0) {
    ids_skipped += ping.ping_id - last_id - 1;
    longest_gap = std::max(longest_gap, std::chrono::duration<double>(now - last_at));
  }
  last_id = ping.ping_id;
  last_at = now;
  ++pings;
}

void read_all(std::vector<std::unique_ptr<PingReader>>& readers, Steady::time_point until) {
  std::vector<pollfd> watched;
  while (Steady::now() < until) {
    watched.clear();
    for (const auto& r : readers)
      if (!r->ended) watched.push_back({r->socket().fd(), POLLIN, 0});
    if (watched.empty()) return;
    ::poll(watched.data(), watched.size(), 100);
    for (const auto& r : readers)
      if (!r->ended && std::any_of(watched.begin(), watched.end(),
                                   [&](const pollfd& p) { return p.fd == r->socket().fd() && p.revents != 0; }))
        r->read_some();
  }
}

}  // namespace sonar::load
