#include "clients/bvtsdk/core/link.hpp"

#include <poll.h>
#include <pthread.h>
#include <signal.h>
#include <sys/socket.h>

#include <algorithm>
#include <cstdlib>

#include "clients/bvtsdk/core/log.hpp"

namespace sonar::bvt {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::size_t chunk_bytes = 256u << 10;

std::string default_port() {
  const char* port = std::getenv("BVE_PORT");
  return port && *port ? port : std::to_string(blueview::tcp_port);
}

/// Returns the code of an error reply, and logs its text.
int refusal(const Bytes& payload) {
  Reader reader(payload);
  const auto code = reader.read<std::int32_t>();
  const std::string text = reader.text();
  if (!reader.ok() || code == success) return failed;
  log(LogLevel::status, "the sonar refused: " + text);
  return code;
}

/// Blocks all signals while a thread is started, so that signals go to the threads of the program that loaded this library.
class SignalsBlocked {
 public:
  SignalsBlocked() {
    sigset_t all;
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before_);
  }
  ~SignalsBlocked() { pthread_sigmask(SIG_SETMASK, &before_, nullptr); }

 private:
  sigset_t before_;
};

}  // namespace

Code Link::open(const std::string& endpoint, int abi, std::unique_ptr<Link>& link, SonarDescription& sonar,
                const Patience& patience) {
  std::string host, port = default_port(), why;
  const auto refuse = [&](int code, const std::string& reason) {
    log(LogLevel::warning, "cannot open the sonar at \"" + endpoint + "\": " + reason);
    return static_cast<Code>(code);
  };
  if (!split_endpoint(endpoint, host, port))
    return refuse(bad_parameter, "write HOST or HOST:PORT; the port, given there or in BVE_PORT, must be from 1 to 65535");
  Descriptor socket;
  const Code code = connect_to(host, port, Clock::now() + patience.connect, socket, why);
  if (code == lookup_host) return refuse(code, why + "; check the host's name, or give its IPv4 address");
  const std::string there = "TCP port " + port;
  if (code != success)
    return refuse(
        code, there + ": " + why +
                  "; check that sonard runs a BlueView sonar at that address; if it uses another port, give it as HOST:PORT or "
                  "in BVE_PORT");
  std::unique_ptr<Link> fresh(new Link(std::move(socket), patience));
  Bytes hello, answer;
  put(hello, blueview::protocol_version);
  put(hello, static_cast<std::uint16_t>(abi));
  put_text(hello, "libbvtsdk");
  const int greeted = fresh->ask(FrameType::hello, hello, answer, patience.connect);
  if (greeted == bad_packet_type)
    return refuse(greeted, "the program at " + there + " does not use sonard's BlueView link; check the port");
  if (greeted == bad_packet_version)
    return refuse(greeted,
                  "sonard at " + there + " uses another version of the link; use the library and sonard of the same release");
  // Programs retry after connection_timed_out and give up after any other code. Therefore this code is returned for a sonar that
  // is starting or shutting down.
  if (greeted != success)
    return refuse(connection_timed_out,
                  there +
                      (greeted == socket_read_timeout ? " accepts the connection but sends no greeting"
                                                      : " accepts the connection and closes it at once") +
                      "; sonard is starting, shutting down or suspended: check its log, then open the sonar again");
  std::optional<SonarDescription> description = decode_description(answer);
  if (!description)
    return refuse(bad_packet_type,
                  "the program at " + there + " does not describe a sonar; use the library and sonard of the same release");
  fresh->may_be_silent_ = description->may_be_silent();
  sonar = std::move(*description);
  link = std::move(fresh);
  return success;
}

Link::Link(Descriptor socket, const Patience& patience)
    : patience_(patience), socket_(std::move(socket)), last_sent_(Clock::now()), last_received_(Clock::now()) {
  const SignalsBlocked blocked;
  reader_ = std::thread([this] { read_until_lost(); });
}

Link::~Link() {
  close();
  reader_.join();
}

struct Link::Forget {
  Link& link;
  std::uint32_t id;
  ~Forget() {
    const std::lock_guard lock(link.waiting_mutex_);
    link.waiting_.erase(id);
  }
};

int Link::ask(FrameType request, const Bytes& payload, Bytes& answer, std::chrono::milliseconds patience) {
  const Deadline deadline = Clock::now() + patience;
  Waiter waiter;
  waiter.request = request;
  std::uint32_t id;
  {
    const std::lock_guard lock(waiting_mutex_);
    if (lost_ != success) return lost_;
    do ++last_id_;
    while (last_id_ == 0 || waiting_.count(last_id_) != 0);
    id = last_id_;
    waiting_[id] = &waiter;
  }
  const Forget forget{*this, id};
  const Code sent = send(request, id, payload);
  if (sent != success) lose(sent);
  std::unique_lock lock(waiting_mutex_);
  answered_.wait_until(lock, deadline, [&] { return waiter.answered || lost_ != success; });
  if (waiter.answered) {
    answer = std::move(waiter.answer);
    return waiter.code;
  }
  return lost_ != success ? lost_.load() : socket_read_timeout;
}

void Link::read_until_lost() {
  try {
    const auto glance = std::min(patience_.silence, patience_.lifeless) / 4;
    while (connected()) {
      if (wait_for(socket_.fd(), POLLIN, Clock::now() + glance) == success) receive();
      if (!may_be_silent_ && Clock::now() - last_received_ > patience_.lifeless) lose(socket_read_timeout);
      keep_alive();
    }
  } catch (const std::exception& e) {  // out of memory
    log(LogLevel::critical, std::string("the link ends: ") + e.what());
    lose(socket_read);
  }
}

// Receives one chunk; delivers the frame when it is complete.
void Link::receive() {
  FrameHeader header;
  std::size_t wanted = frame_header_size;
  if (received_.size() >= frame_header_size) {
    read_header(received_, header);
    wanted += header.payload_size;
  }
  const std::size_t before = received_.size();
  const Code code = receive_some(socket_.fd(), received_, std::min(wanted - before, chunk_bytes));
  if (code != success) return lose(code);
  if (received_.size() > before) last_received_ = Clock::now();
  if (received_.size() == frame_header_size && before < frame_header_size) {
    if (!read_header(received_, header)) {
      log(LogLevel::critical, "the peer is not a sonar: not a BVE1 frame");
      return lose(bad_packet_type);
    }
    wanted += header.payload_size;
  }
  if (received_.size() < frame_header_size || received_.size() < wanted) return;
  read_header(received_, header);
  received_.erase(received_.begin(), received_.begin() + frame_header_size);
  deliver(header, std::move(received_));
  received_ = {};
}

void Link::deliver(const FrameHeader& header, Bytes payload) {
  const std::lock_guard lock(waiting_mutex_);
  const auto found = waiting_.find(header.request_id);
  if (found == waiting_.end()) return;  // a keep-alive, an unsolicited frame, or a late answer
  Waiter& waiter = *found->second;
  const auto expected = static_cast<FrameType>(static_cast<std::uint16_t>(waiter.request) | 0x8000);
  waiter.code = header.type == expected ? success : header.type == FrameType::error ? refusal(payload) : bad_packet_type;
  waiter.answer = std::move(payload);
  waiter.answered = true;
  answered_.notify_all();
}

Code Link::send(FrameType type, std::uint32_t id, const Bytes& payload) {
  Bytes frame;
  put_header(frame, {type, 0, id, static_cast<std::uint32_t>(payload.size())});
  frame.insert(frame.end(), payload.begin(), payload.end());
  const std::lock_guard lock(send_mutex_);
  last_sent_ = Clock::now();
  return send_all(socket_.fd(), frame, last_sent_ + patience_.request);
}

void Link::keep_alive() {
  {
    const std::unique_lock lock(send_mutex_, std::try_to_lock);
    if (!lock || Clock::now() - last_sent_ < patience_.silence) return;  // the owner of the lock is sending
  }
  const Code code = send(FrameType::keep_alive, 0, {});
  if (code != success) lose(code);
}

void Link::lose(Code why) {
  const std::lock_guard lock(waiting_mutex_);
  if (lost_ != success) return;
  lost_ = why;
  shutdown(socket_.fd(), SHUT_RDWR);  // wakes the reader; the descriptor stays valid until the link is destroyed
  answered_.notify_all();
}

}  // namespace sonar::bvt
