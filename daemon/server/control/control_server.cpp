#include "daemon/server/control/control_server.hpp"

namespace sonar {

ControlServer::ControlServer(asio::io_context& io, const ControlConfig& config, const LimitConfig& limits, Admission& admission,
                             Operations& operations, Events& events, PoseIntake& poses, Log& log)
    : context_{io, config, limits, admission, operations, events, poses, log},
      stream_(context_, "protobuf"),
      http_(context_, "http") {}

Result<void> ControlServer::read_token() {
  const ControlConfig& config = context_.config;
  if (config.token_file.empty()) return {};
  std::string warning;
  auto token = Token::read(config.token_file, warning);
  if (!token) return tl::make_unexpected(token.error());
  if (!warning.empty()) context_.log.warning(warning);
  context_.token = *std::move(token);
  return {};
}

template <class Connection>
Result<void> ControlServer::open(ControlListener<Connection>& listener, const PoseListener& wanted, bool given,
                                 const std::string& key) {
  if (!wanted.enabled) return {};
  const auto opened = listener.open(wanted.at);
  if (opened) return {};
  const std::string what = opened.error().text + "; " + key + " in the configuration takes another address, or off";
  if (given) return failure(opened.error().kind, what);
  context_.log.warning("continuing without " + key + ": " + what);
  return {};
}

Result<void> ControlServer::open() {
  if (auto r = read_token(); !r) return r;
  const ControlConfig& config = context_.config;
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
