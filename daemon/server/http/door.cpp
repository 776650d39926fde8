#include "daemon/server/http/door.hpp"

#include <algorithm>
#include <array>
#include <optional>
#include <random>

#include "core/text/decimal.hpp"
#include "daemon/server/http/http_router.hpp"

namespace sonar {
namespace {

using control::StatusCode;
constexpr std::array<std::string_view, 2> protocols = {"foxglove.websocket.v1", "foxglove.sdk.v1"};

HttpAnswer socket_refusal(unsigned status, const std::string& text) { return answer_of(status, StatusCode::refused, text); }
/// Makes a refusal. `cure`: the configuration that would allow the connection, for the log only.
HttpAnswer socket_refusal(unsigned status, const std::string& text, const std::string& cure) {
  HttpAnswer answer = socket_refusal(status, text);
  answer.why = text + "; " + cure;
  return answer;
}

/// True if a text is 16 bytes in base64.
bool is_key(std::string_view key) {
  constexpr std::size_t length = 24;
  return key.size() == length && key.ends_with("==") && std::all_of(key.begin(), key.end() - 2, [](char c) {
           return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '+' || c == '/';
         });
}

std::string random_digits() {
  std::random_device random;
  std::string digits;
  for (int i = 0; i < 32; ++i) digits += "0123456789abcdef"[random() % 16];
  return digits;
}

std::string value_of(const std::vector<std::pair<std::string, std::string>>& query, std::string_view key) {
  const auto found = std::find_if(query.begin(), query.end(), [&](const auto& pair) { return pair.first == key; });
  return found == query.end() ? std::string() : found->second;
}

std::optional<HttpAnswer> wrong_handshake(const HttpRequest& request) {
  if (request.http_1_0) return socket_refusal(400, "a WebSocket needs HTTP/1.1");
  if (!header_names(request.connection, "upgrade")) return socket_refusal(400, "a WebSocket needs Connection: Upgrade");
  if (request.socket_version != "13") {
    HttpAnswer answer = socket_refusal(426, "send Sec-WebSocket-Version: 13");
    answer.headers.emplace_back("Sec-WebSocket-Version", "13");
    return answer;
  }
  if (!is_key(request.socket_key)) return socket_refusal(400, "Sec-WebSocket-Key must be 16 bytes in base64");
  if (request.bytes_behind) return socket_refusal(400, "bytes after the request, before the answer");
  return std::nullopt;
}

/// True if the request has a secret: a ticket, which is for one connection; the token; or, if no token is configured, the key of
/// this run.
bool shows_secret(const HttpRequest& request, const std::vector<std::pair<std::string, std::string>>& query, const ViewDoor& door,
                  ViewSecrets::Steady::time_point now) {
  if (const std::string ticket = value_of(query, "ticket"); !ticket.empty() && door.secrets.take_ticket(ticket, now)) return true;
  if (door.token.needed())
    return door.token.matches(bearer_token(request.authorization)) || door.token.matches(value_of(query, "token"));
  const std::string key = value_of(query, "key");
  return !key.empty() && !door.secrets.key().empty() && Token(door.secrets.key()).matches(key);
}

}  // namespace

void ViewSecrets::make_key() { key_ = random_digits(); }

std::string ViewSecrets::new_ticket(Steady::time_point now) {
  tickets_.emplace_back(random_digits(), now + ticket_lasts);
  if (tickets_.size() > most_tickets) tickets_.pop_front();
  return tickets_.back().first;
}

bool ViewSecrets::take_ticket(std::string_view shown, Steady::time_point now) {
  std::erase_if(tickets_, [now](const auto& ticket) { return ticket.second < now; });
  const auto found =
      std::find_if(tickets_.begin(), tickets_.end(), [&](const auto& ticket) { return Token(ticket.first).matches(shown); });
  if (found == tickets_.end()) return false;
  tickets_.erase(found);
  return true;
}

/// Checks handshake, protocol, query, secret and origin in this order. With a secret, any page is allowed. Without a secret, the
/// client is refused if a token is configured; otherwise the origin must be allowed.
std::variant<HttpAnswer, ViewWelcome> open_view(const HttpRequest& request,
                                                const std::vector<std::pair<std::string, std::string>>& query,
                                                const ViewDoor& door, ViewSecrets::Steady::time_point now) {
  if (auto answer = wrong_handshake(request)) return *std::move(answer);
  ViewWelcome welcome;
  for (const std::string& offered : words_of_header(request.socket_protocols))
    if (welcome.protocol.empty() && std::find(protocols.begin(), protocols.end(), offered) != protocols.end())
      welcome.protocol = offered;
  if (welcome.protocol.empty())
    return socket_refusal(400, "send Sec-WebSocket-Protocol: foxglove.sdk.v1 or foxglove.websocket.v1");
  if (const std::string most = value_of(query, "max_hz"); !most.empty()) {
    const auto number = text::parse_decimal(most);
    if (!number || !(*number > 0 && *number <= 1000)) return socket_refusal(400, "max_hz must be a number above 0, at most 1000");
    welcome.most_hz = *number;
  }
  welcome.playback = value_of(query, "playback");
  welcome.recording = value_of(query, "recording");

  welcome.may_steer = true;
  if (shows_secret(request, query, door, now)) return welcome;
  if (door.token.needed())
    return socket_refusal(401, "token required: open ws://...?token=TOKEN, or send Authorization: Bearer TOKEN",
                          "it is in control.token_file");
  if (!request.has_origin || origin_allowed(request.origin, door.reached, door.config.hosts)) return welcome;
  const auto& listed = door.config.view_origins;
  const auto found = std::find_if(listed.begin(), listed.end(), [&](const ViewOrigin& o) { return o.origin == request.origin; });
  if (found == listed.end()) {
    const std::string origin = request.origin.substr(0, 200);
    return socket_refusal(403, "pages of other sites need the key that sonard prints at its start",
                          origin.starts_with("http") ? "this would allow it: control: {view_origins: [\"" + origin + "\"]}"
                                                     : "Origin " + origin + " cannot be listed in control.view_origins");
  }
  welcome.may_steer = found->steer;
  return welcome;
}

}  // namespace sonar
