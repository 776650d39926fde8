#include "clients/sonarctl/control_client.hpp"

#include <array>
#include <cstring>

#include "clients/sonarctl/commands.hpp"
#include "core/base/regular_file.hpp"
#include "core/text/format.hpp"
#include "protocol/control/answers.hpp"

namespace sonar::clients {
namespace {

using Clock = std::chrono::steady_clock;

std::chrono::milliseconds left_until(Clock::time_point deadline) {
  return std::max(std::chrono::milliseconds(0), std::chrono::duration_cast<std::chrono::milliseconds>(deadline - Clock::now()));
}

/// Reads the token without surrounding blanks, as the daemon does.
Result<std::string> token_from(const std::filesystem::path& file) {
  if (file.empty()) return std::string();
  constexpr const char* blanks = " \t\r\n";
  constexpr std::size_t most_bytes = 4096;
  const auto text = read_regular(file, most_bytes);  // reading a FIFO or a device might never end
  if (!text && !is_absent(file)) return failure(ErrorKind::missing_file, "cannot read a token from " + text.error().text);
  const std::size_t first = text ? text->find_first_not_of(blanks) : std::string::npos;
  if (first == std::string::npos)
    return failure(ErrorKind::missing_file, "cannot read a token from " + file.string() +
                                                ": it should be the file that control.token_file of sonard names");
  return text->substr(first, text->find_last_not_of(blanks) - first + 1);
}

bool starts_as_http(std::span<const std::byte> received) {
  constexpr std::string_view http = "HTTP/";
  return received.size() >= http.size() && std::memcmp(received.data(), http.data(), http.size()) == 0;
}

Result<void> judge(const v1::Status& answer) {
  switch (answer.code()) {
    case v1::Status::OK:
      return {};
    case v1::Status::REFUSED:
    case v1::Status::UNAUTHENTICATED:
      return failure(ErrorKind::bad_data, "sonard refused: " + answer.text());
    case v1::Status::FAILED:
      return failure(ErrorKind::bad_data, "sonard failed: " + answer.text());
    default:  // UNSUPPORTED, and codes of later versions
      return failure(ErrorKind::unavailable, "this sonard does not support the request" +
                                                 (answer.text().empty() ? "" : " (" + answer.text() + ")") +
                                                 ": is it of another version? Compare sonard --version and sonarctl --version");
  }
}

/// The pointer keeps the whole Response alive.
std::shared_ptr<const v1::Event> event_of(const ControlClient::Response& response) { return {response, &response->event()}; }

}  // namespace

Result<ControlClient> ControlClient::open(const ControlOptions& options, bool* token_required) {
  const Result<Endpoint> at = parse_endpoint(options.address, {"127.0.0.1", control_port});
  if (!at) return tl::unexpected(at.error());
  const Result<std::string> token = token_from(options.token_file);
  if (!token) return tl::unexpected(token.error());
  auto socket = connect_tcp(*at, options.connect_patience);
  if (!socket && socket.error().kind == ErrorKind::unavailable)
    return failure(ErrorKind::unavailable,
                   "no sonard answers on the control stream, tcp " + text_from(*at) +
                       ". Is sonard running there? Its banner names the address (--control HOST:PORT; for poses --to)");
  if (!socket) return tl::unexpected(socket.error());
  ControlClient client(std::move(*socket), *at);
  const auto met = client.request(control::Hello{control::protocol_version, "sonarctl", *token}, options.greeting_patience);
  if (!met && token->empty() && client.unauthenticated_) {
    if (token_required != nullptr) *token_required = true;
    return failure(met.error().kind, "sonard at " + text_from(*at) +
                                         " requires a token: give --token-file FILE, the file that its control.token_file names");
  }
  if (!met) return tl::unexpected(met.error());
  return client;
}

Result<ControlClient::Response> ControlClient::request(Operation operation, std::chrono::milliseconds patience) {
  const std::uint64_t id = ++last_id_;
  const auto message = control::encode_request({id, std::move(operation)});
  if (Result<void> sent = write_all(socket_, control::delimited(message)); !sent) return tl::unexpected(sent.error());
  const auto deadline = Clock::now() + patience;
  for (;;) {
    const Result<Response> answer = next_message(deadline, true);
    if (!answer) return tl::unexpected(answer.error());
    if (!*answer && interrupted != 0)
      return failure(ErrorKind::unavailable, "interrupted before sonard at " + text_from(at_) +
                                                 " answered: sonard completes the request, sonarctl does not wait for it");
    if (!*answer && last_id_ == 1)  // the answer to Hello
      return tl::unexpected(
          no_control_stream("no greeting within " + text::format("%g s", 1e-3 * static_cast<double>(patience.count()))));
    if (!*answer)
      return failure(ErrorKind::unavailable, "sonard at " + text_from(at_) + " did not answer within " +
                                                 std::to_string(patience.count() / 1000) + " s: is it busy, or suspended?");
    const v1::Response& response = **answer;
    if (response.has_event() && response.id() == 0) {
      events_.push_back(event_of(*answer));
      continue;
    }
    if (response.id() != id && response.id() != 0) continue;  // answer to an earlier, abandoned request
    unauthenticated_ = response.status().code() == v1::Status::UNAUTHENTICATED;
    if (const Result<void> sound = judge(response.status()); !sound) return tl::unexpected(sound.error());
    if (response.id() == id) return *answer;
  }
}

Result<std::shared_ptr<const v1::DaemonStatus>> ControlClient::status(std::chrono::milliseconds patience) {
  const Result<Response> answer = request(control::GetStatus{}, patience);
  if (!answer) return tl::unexpected(answer.error());
  if (!(*answer)->has_daemon()) return failure(ErrorKind::bad_data, "sonard answered the status request without a status");
  return std::shared_ptr<const v1::DaemonStatus>(*answer, &(*answer)->daemon());
}

Result<std::shared_ptr<const v1::Event>> ControlClient::next_event(std::chrono::milliseconds patience) {
  const auto deadline = Clock::now() + patience;
  while (events_.empty()) {
    const Result<Response> message = next_message(deadline, true);
    if (!message) return tl::unexpected(message.error());
    if (!*message) return nullptr;
    if ((*message)->has_event()) events_.push_back(event_of(*message));
  }
  auto first = std::move(events_.front());
  events_.pop_front();
  return first;
}

Error ControlClient::no_control_stream(const std::string& why) const {
  return {ErrorKind::bad_data,
          "the service at tcp " + text_from(at_) + " does not answer as sonard's control stream (" + why +
              "): it is another service, or sonard is suspended. The control stream is on tcp " + std::to_string(control_port) +
              " unless configured otherwise; sonard's banner names it (--control HOST:PORT; for poses --to)"};
}

/// Returns null when the time is over or, with `until_signal`, after a signal.
Result<ControlClient::Response> ControlClient::next_message(Clock::time_point deadline, bool until_signal) {
  for (;;) {
    auto message = parser_.next();
    if (!message) return tl::unexpected(no_control_stream(message.error().text));
    if (*message) {
      auto response = control::decode_response(**message);
      if (!response) return tl::unexpected(no_control_stream(response.error().text));
      return response;
    }
    std::array<std::byte, 16384> chunk;
    const Read read = read_some(socket_, chunk, left_until(deadline));
    if (read.what == Wait::closed && !received_) return tl::unexpected(no_control_stream("it closes the connection"));
    if (read.what == Wait::closed)
      return failure(ErrorKind::unavailable, "sonard at " + text_from(at_) + " closed the control stream" +
                                                 (read.error.empty() ? "" : ": " + read.error) +
                                                 "; its log has the reason (a wrong token, or sonard was stopped)");
    if (read.what == Wait::timed_out || (read.what == Wait::interrupted && until_signal)) return nullptr;
    if (read.what != Wait::data) continue;
    const auto received = std::span<const std::byte>(chunk).first(read.size);
    if (!received_ && starts_as_http(received)) return tl::unexpected(no_control_stream("it speaks HTTP"));
    received_ = true;
    parser_.feed(received);
  }
}

}  // namespace sonar::clients
