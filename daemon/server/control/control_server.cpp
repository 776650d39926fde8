#include "daemon/server/control/control_server.hpp"

namespace sonar {

ControlServer::ControlServer(asio::io_context& io, const ControlConfig& config, const LimitConfig& limits, Admission& admission,
                             Operations& operations, Events& events, PoseIntake& poses, Log& log, ViewFeed* view)
    : config_(config),
      services_{io, limits, admission, log, "control"},
      targets_{operations, events, poses, SharedRate(limits.pose_bytes_per_s)},
      answers_(services_, config, targets_, view),
      stream_(services_, "protobuf",
              [this](tcp::socket socket, Sender sender) {
                return std::make_shared<StreamConnection>(services_, targets_, std::move(socket), std::move(sender));
              }),
      http_(services_, "http", [this](tcp::socket socket, const Sender& sender) {
        return std::make_shared<HttpConnection>(services_, answers_, std::move(socket), sender);
      }) {}

Result<void> ControlServer::read_token() {
  const ControlConfig& config = config_;
  if (config.token_file.empty()) return {};
  std::string warning;
  auto token = Token::read(config.token_file, warning);
  if (!token) return tl::make_unexpected(token.error());
  if (!warning.empty()) services_.log.warning(warning);
  services_.token = *std::move(token);
  return {};
}

template <class Connection>
Result<void> ControlServer::open(ConnectionListener<Connection>& listener, const PoseListener& wanted, bool given,
                                 const std::string& key) {
  if (!wanted.enabled) return {};
  const auto opened = listener.open(wanted.at);
  if (opened) return {};
  const std::string what = opened.error().text + "; " + key + " in the configuration can set another address, or off";
  if (given) return failure(opened.error().kind, what);
  services_.log.warning("continuing without " + key + ": " + what);
  return {};
}

Result<void> ControlServer::open() {
  if (auto r = read_token(); !r) return r;
  const ControlConfig& config = config_;
  if (auto r = open(stream_, config.stream, config.stream_given, "control.stream"); !r) return r;
  return open(http_, config.http, config.http_given, "control.http");
}

void ControlServer::start() {
  stream_.start();
  http_.start();
}

void ControlServer::stop() {
  stream_.stop();
  http_.stop();
}

}  // namespace sonar
