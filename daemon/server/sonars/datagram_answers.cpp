#include "daemon/server/sonars/datagram_answers.hpp"

#include <span>

#include "daemon/server/system/listen.hpp"

namespace sonar {
namespace {

/// Several sonars of one network hear the same broadcasts.
bool bind_shared(udp::socket& socket, const udp::endpoint& at) {
  error_code ec;
  socket.open(udp::v4(), ec);
  if (!ec) socket.set_option(asio::socket_base::reuse_address(true), ec);
  if (!ec) socket.bind(at, ec);
  if (ec) socket.close();
  return !ec;
}

/// On the loopback, which is 127.0.0.0/8 whatever the netmask says, hosts of this machine ask 127.255.255.255.
Ipv4 broadcast_of(const SonarConfig& sonar) {
  if (sonar.bind_ip[0] == 127) return {127, 255, 255, 255};
  Ipv4 address{};
  for (std::size_t i = 0; i < address.size(); ++i)
    address[i] = static_cast<std::uint8_t>(sonar.bind_ip[i] | static_cast<std::uint8_t>(~sonar.netmask[i]));
  return address;
}

}  // namespace

Result<void> DatagramAnswers::open(const SonarConfig& sonar, std::uint16_t port) {
  Place& own = places_.emplace_back(io_);
  if (auto r = bind_udp(own.socket, {sonar.bind_ip, port}, false); !r) return r;
  const Ipv4 broadcast = broadcast_of(sonar);
  if (sonar.bind_ip == Ipv4{} || broadcast == sonar.bind_ip) return {};
  Place& all = places_.emplace_back(io_);
  if (!bind_shared(all.socket, {address_of(broadcast), port})) places_.pop_back();
  return {};
}

void DatagramAnswers::start() {
  for (Place& place : places_) receive(place);
}

void DatagramAnswers::stop() {
  stopping_ = true;
  error_code ec;
  for (Place& place : places_) place.socket.close(ec);
}

void DatagramAnswers::receive(Place& place) {
  place.socket.async_receive_from(asio::buffer(place.datagram), place.from,
                                  [this, &place](const error_code& ec, std::size_t size) {
                                    if (stopping_ || ec == asio::error::operation_aborted) return;
                                    if (!ec) {
                                      const protocol::Bytes answer = answer_(std::span(place.datagram).first(size));
                                      // From the sonar's own address: that is how a host learns it. One that cannot be reached is
                                      // not our worry.
                                      error_code ignored;
                                      if (!answer.empty())
                                        places_.front().socket.send_to(asio::buffer(answer), place.from, 0, ignored);
                                    }
                                    receive(place);
                                  });
}

}  // namespace sonar
