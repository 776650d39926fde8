#include "daemon/server/view/view_connection.hpp"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

#include <boost/beast/core/buffers_range.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/websocket/rfc6455.hpp>
#include <boost/beast/websocket/stream.hpp>

namespace sonar {
namespace {

namespace beast = boost::beast;
namespace websocket = beast::websocket;

// A WebSocket ping is sent after half of silence_limit without traffic.
constexpr std::chrono::seconds handshake_limit{10}, silence_limit{30};
// Pictures should wait in this program, where newer ones replace them, not in the kernel.
constexpr int most_unsent = 128 << 10;

}  // namespace

/// A socket that reports sent bytes and limits the rate of reading. Beast finds the friend functions below by
/// argument-dependent lookup.
struct ViewConnection::Watched {
  HttpConnection& from;
  Steady::time_point& moved_at;
  asio::steady_timer& rest;
  FrameWork work = {};

  using executor_type = tcp::socket::executor_type;
  executor_type get_executor() { return from.socket().get_executor(); }
  template <class Buffers, class Token>
  auto async_read_some(const Buffers& buffers, Token&& token) {
    return asio::async_compose<Token, void(error_code, std::size_t)>(Read<Buffers>{*this, buffers}, token, from.socket());
  }
  template <class Buffers, class Token>
  auto async_write_some(const Buffers& buffers, Token&& token) {
    moved_at = Steady::now();
    return from.socket().async_write_some(buffers, std::forward<Token>(token));
  }
  friend void teardown(beast::role_type role, Watched& watched, error_code& ec) {
    websocket::teardown(role, watched.from.socket(), ec);
  }
  template <class Handler>
  friend void async_teardown(beast::role_type role, Watched& watched, Handler&& handler) {
    websocket::async_teardown(role, watched.from.socket(), std::forward<Handler>(handler));
  }
  friend void beast_close_socket(Watched& watched) {
    error_code ec;
    watched.from.socket().close(ec);
  }

  /// Reads bytes and, if they exceed the allowed rate, waits before passing them to Beast.
  template <class Buffers>
  struct Read {
    Watched& watched;
    Buffers buffers;
    std::size_t size = 0;

    void operator()(auto& self) {
      auto& socket = watched.from.socket();
      const Buffers own = buffers;  // a copy, because the member belongs to `self`, which is moved
      socket.async_read_some(own, std::move(self));
    }
    void operator()(auto& self, const error_code& ec, std::size_t read) {
      if (ec || read == 0) return self.complete(ec, read);
      size = read;
      const auto pause = watched.from.pause_after(watched.work_of(buffers, read));
      if (pause.count() == 0) return self.complete(ec, read);
      asio::steady_timer& rest = watched.rest;
      rest.expires_after(pause);
      rest.async_wait(std::move(self));
    }
    /// Called at the end of the pause or of the connection.
    void operator()(auto& self, const error_code&) {
      self.complete(watched.from.over() ? error_code(asio::error::operation_aborted) : error_code(), size);
    }
  };
  std::size_t work_of(const auto& buffers, std::size_t read) {
    std::size_t sum = 0;
    for (const asio::const_buffer piece : beast::buffers_range_ref(buffers)) {
      const std::size_t count = std::min(read, piece.size());
      sum += work.of({static_cast<const std::byte*>(piece.data()), count});
      read -= count;
    }
    return sum;
  }
};

struct ViewConnection::Socket {
  websocket::stream<Watched> stream;
  explicit Socket(Watched watched) : stream(watched) {}
};

ViewConnection::ViewConnection(ConnectionServices& services, HttpConnection& from, ViewerHost& host, const HttpRequest& request,
                               const ViewWelcome& welcome, std::function<void(const std::shared_ptr<ViewConnection>&)> on_open)
    : services_(services),
      from_(from),
      request_(request),
      protocol_(welcome.protocol),
      address_(from.sender().source),
      playback_(welcome.playback),
      on_open_(std::move(on_open)),
      viewer_(host, {welcome.may_steer, welcome.most_hz}, from.sender().source),
      socket_(std::make_unique<Socket>(Watched{from, moved_at_, rest_})),
      wake_(services.io, never),
      stall_(services.io, never),
      rest_(services.io, never) {
  error_code ec;
  if (const auto peer = from.socket().remote_endpoint(ec); !ec) address_ += ":" + std::to_string(peer.port());
}
ViewConnection::~ViewConnection() = default;

// Answers the handshake (RFC 6455, 4.2) with Beast, which also checks the key.
asio::awaitable<bool> ViewConnection::begin() {
  auto& stream = socket_->stream;
  stream.auto_fragment(false);  // a picture is one frame
  stream.read_message_max(foxglove::longest_word);
  stream.set_option(websocket::stream_base::timeout{handshake_limit, silence_limit, true});
  stream.set_option(websocket::stream_base::decorator([this](websocket::response_type& response) {
    response.set(beast::http::field::server, "sonard");
    response.set(beast::http::field::sec_websocket_protocol, protocol_);
  }));
  const int unsent = most_unsent;
  ::setsockopt(from_.socket().native_handle(), IPPROTO_TCP, TCP_NOTSENT_LOWAT, &unsent, sizeof unsent);
  // HttpConnection has already read the request, so the headers of the handshake are copied into a request for Beast.
  beast::http::request<beast::http::empty_body> request(beast::http::verb::get, "/", 11);
  request.set(beast::http::field::host, request_.host);
  request.set(beast::http::field::connection, request_.connection);
  request.set(beast::http::field::upgrade, request_.upgrade);
  request.set(beast::http::field::sec_websocket_key, request_.socket_key);
  request.set(beast::http::field::sec_websocket_version, request_.socket_version);
  error_code ec;
  co_await stream.async_accept(request, into(ec));
  over_ = static_cast<bool>(ec);
  if (!over_) on_open_(shared_from_this());
  co_return !over_;
}

asio::awaitable<void> ViewConnection::read() {
  beast::flat_buffer buffer;
  while (!over_ && viewer_.close_code() == Viewer::CloseCode::none) {
    error_code ec;
    co_await socket_->stream.async_read(buffer, into(ec));
    if (ec || over_) break;
    from_.active_at = Steady::now();
    const auto* const bytes = static_cast<const std::byte*>(buffer.data().data());
    const wire::BytesView message(bytes, buffer.size());
    if (socket_->stream.got_text())
      viewer_.on_text({static_cast<const char*>(buffer.data().data()), buffer.size()}, now());
    else
      viewer_.on_binary(message, now());
    buffer.consume(buffer.size());
    wake();
  }
  // Without a close code, the viewer has left. With a code, write() sends it and ends the connection.
  if (viewer_.close_code() == Viewer::CloseCode::none) over_ = true;
  wake();
}

asio::awaitable<void> ViewConnection::write() {
  while (!over_) {
    // Sends a close code first, then messages that are due. If none is due, waits until the next message is due, or for wake().
    if (const auto code = viewer_.close_code(); code != Viewer::CloseCode::none) {
      co_await say_goodbye(static_cast<std::uint16_t>(code),
                           code == Viewer::CloseCode::policy ? "too many or malformed messages" : "too slow");
      break;
    }
    error_code ec;
    if (const auto message = viewer_.next(now())) {
      if (!co_await write(*message)) break;
    } else {
      const auto due = viewer_.next_due(now());
      wake_.expires_at(due ? Steady::time_point(std::chrono::duration_cast<Steady::duration>(*due)) : never);
      co_await wake_.async_wait(into(ec));
    }
  }
  over_ = true;
}

asio::awaitable<bool> ViewConnection::write(const ViewMessage& message) {
  std::vector<asio::const_buffer> buffers{asio::buffer(message.head)};
  for (const ViewBytes& piece : message.pieces) buffers.push_back(asio::buffer(*piece));
  socket_->stream.text(message.is_text);
  writing_ = true;
  moved_at_ = Steady::now();
  look_for_progress();
  error_code ec;
  co_await socket_->stream.async_write(buffers, into(ec));
  writing_ = false;
  stall_.expires_at(never);
  from_.active_at = Steady::now();
  co_return !ec;
}

/// Closes the socket when the viewer has accepted no byte of a message for `limits.stall`.
void ViewConnection::look_for_progress() {
  stall_.expires_at(moved_at_ + services_.limits.stall);
  stall_.async_wait([weak = weak_from_this()](const error_code& ec) {
    const auto self = weak.lock();
    if (!self || ec || !self->writing_) return;
    if (Steady::now() < self->moved_at_ + self->services_.limits.stall) return self->look_for_progress();
    log_refusal(self->services_, "viewer does not read", self->viewer_.who());
    error_code ignored;
    self->from_.socket().close(ignored);
  });
}

asio::awaitable<void> ViewConnection::say_goodbye(std::uint16_t code, const char* why) {
  log_refusal(services_, std::string("viewer: ") + why, viewer_.who());
  websocket::close_reason reason(static_cast<websocket::close_code>(code));
  reason.reason = why;
  error_code ec;
  co_await socket_->stream.async_close(reason, into(ec));
}

/// Sends a close frame, unless a message (which is one frame) is being written; then the connection ends without it.
void ViewConnection::on_closing() {
  wake_.cancel();
  stall_.cancel();
  rest_.cancel();
  // A frame must not be inserted into a message that is being written.
  if (!std::exchange(over_, true) && !writing_) {
    const std::array<std::uint8_t, 4> going_away{0x88, 2, 1001 >> 8, 1001 & 0xFF};  // a frame of RFC 6455, 5.5.1
    if (::send(from_.socket().native_handle(), going_away.data(), going_away.size(), MSG_DONTWAIT | MSG_NOSIGNAL) < 0) return;
  }
}

}  // namespace sonar
