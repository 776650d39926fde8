#include "daemon/server/http/http_rules.hpp"

#include <algorithm>
#include <array>

#include "core/base/letters.hpp"

namespace sonar {
namespace {

int hex_value(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  const char l = small_letter(c);
  return l >= 'a' && l <= 'f' ? l - 'a' + 10 : -1;
}

/// Decodes %xx. Refuses control characters, plain or encoded, so that they get into no log or answer.
std::optional<std::string> decoded(std::string_view text) {
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    char c = text[i];
    if (c == '%') {
      if (i + 2 >= text.size()) return std::nullopt;
      const int high = hex_value(text[i + 1]), low = hex_value(text[i + 2]);
      if (high < 0 || low < 0) return std::nullopt;
      c = static_cast<char>(16 * high + low);
      i += 2;
    }
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) return std::nullopt;
    out += c;
  }
  return out;
}

/// Removes the text up to `stop`, and `stop` itself. Returns the text before `stop`.
std::string_view cut(std::string_view& rest, char stop) {
  const std::size_t end = std::min(rest.find(stop), rest.size());
  const std::string_view part = rest.substr(0, end);
  rest.remove_prefix(std::min(end + 1, rest.size()));
  return part;
}

bool good_port(std::string_view port) {
  return !port.empty() && port.size() <= 5 && std::all_of(port.begin(), port.end(), [](char c) { return c >= '0' && c <= '9'; });
}

}  // namespace

std::optional<Target> parse_target(std::string_view text) {
  if (text.empty() || text.front() != '/') return std::nullopt;
  Target target;
  std::string_view query = text.substr(1);
  std::string_view path = cut(query, '?');
  while (!path.empty()) {
    const auto segment = decoded(cut(path, '/'));
    if (!segment) return std::nullopt;
    target.segments.push_back(*segment);
  }
  while (!query.empty()) {
    std::string_view value = cut(query, '&');
    const auto key = decoded(cut(value, '='));
    const auto value_text = decoded(value);
    if (!key || !value_text) return std::nullopt;
    target.query.emplace_back(*key, *value_text);
  }
  return target;
}

/// Compares the host with the allowed names. With DNS rebinding, a page of another site connects to this server with the name of
/// its site, which is not allowed.
bool host_allowed(std::string_view host, Ipv4 reached, const std::vector<std::string>& names) {
  std::string_view port = host;
  const std::string_view name = cut(port, ':');
  if (host.find(':') != std::string_view::npos && !good_port(port)) return false;
  if (const auto ip = parse_ipv4(name)) {
    if (*ip == reached || is_loopback(*ip)) return true;
  } else if (same_letters(name, "localhost")) {
    return true;
  }
  return !name.empty() && std::any_of(names.begin(), names.end(), [&](const std::string& n) { return same_letters(n, name); });
}

bool origin_allowed(std::string_view origin, Ipv4 reached, const std::vector<std::string>& names) {
  for (const std::string_view scheme : {"http://", "https://"})
    if (origin.size() > scheme.size() && same_letters(origin.substr(0, scheme.size()), scheme))
      return host_allowed(origin.substr(scheme.size()), reached, names);
  return false;  // the origin is "null" or has another scheme
}

bool begins_http_request(std::string_view bytes) {
  constexpr std::array<std::string_view, 9> methods{"GET ",     "HEAD ",    "POST ",  "PUT ",  "DELETE ",
                                                    "CONNECT ", "OPTIONS ", "TRACE ", "PATCH "};
  return std::any_of(methods.begin(), methods.end(), [bytes](std::string_view method) { return bytes.starts_with(method); });
}

/// Collects the first bytes, because a request may arrive in pieces.
bool HttpDetector::speaks_http(std::span<const std::byte> received) {
  for (std::size_t i = 0; i < received.size() && first_bytes_.size() < longest_http_method; ++i)
    first_bytes_ += static_cast<char>(received[i]);
  return begins_http_request(first_bytes_);
}

std::vector<std::string> words_of_header(std::string_view list) {
  std::vector<std::string> words;
  while (!list.empty()) {
    const std::size_t end = std::min(list.find(','), list.size());
    std::string_view word = list.substr(0, end);
    list.remove_prefix(std::min(end + 1, list.size()));
    const auto first = word.find_first_not_of(" \t");
    if (first == std::string_view::npos) continue;
    word = word.substr(first, word.find_last_not_of(" \t") - first + 1);
    words.emplace_back(word);
  }
  return words;
}

bool header_names(std::string_view list, std::string_view wanted) {
  const std::vector<std::string> words = words_of_header(list);
  return std::any_of(words.begin(), words.end(), [&](const std::string& word) { return same_letters(word, wanted); });
}

bool is_json(std::string_view content_type) {
  std::string_view type = cut(content_type, ';');
  while (!type.empty() && (type.back() == ' ' || type.back() == '\t')) type.remove_suffix(1);
  return same_letters(type, "application/json");
}

namespace {

/// Returns the route for a path below /api/v1/faults; these paths are like those of Toxiproxy.
Route fault_route(const std::vector<std::string>& s, std::string_view method) {
  if (s.size() == 3)
    return method == "POST" ? Route{Route::Kind::operation, "POST", "add_fault"} : Route{Route::Kind::faults, "GET", "faults"};
  if (s.size() != 4) return {};
  if (s[3] == "kinds" || s[3] == "journal") return {Route::Kind::faults, "GET", s[3]};
  if (s[3] == "reset") return {Route::Kind::operation, "POST", "end_faults"};
  return {Route::Kind::end_fault, "DELETE", "end_faults", s[3]};
}

}  // namespace

Route route_of(const Target& target, std::string_view method) {
  const auto& s = target.segments;
  if (s.empty()) return {Route::Kind::help, "GET", ""};
  if (s.size() == 1 && s[0] == "healthz") return {Route::Kind::health, "GET", ""};
  if (s.size() == 1 && s[0] == "metrics") return {Route::Kind::metrics, "GET", ""};
  if (s.size() < 3 || s[0] != "api" || s[1] != "v1") return {};
  if (s[2] == "faults") return fault_route(s, method);
  if (s.size() == 4 && s[2] == "sonars" && !s[3].empty()) return {Route::Kind::operation, "POST", "sonar", s[3]};
  if (s.size() == 4 && s[2] == "objects" && !s[3].empty()) return {Route::Kind::operation, "POST", "set_object", s[3]};
  if (s.size() != 3) return {};
  if (s[2] == "status") return {Route::Kind::status, "GET", "status"};
  if (s[2] == "view_ticket") return {Route::Kind::ticket, "POST", ""};
  if (s[2] == "events") return {Route::Kind::events, "GET", ""};
  constexpr std::array<std::string_view, 12> operations = {
      "sonar",         "environment", "load",           "pose", "object",          "add_object",
      "remove_object", "set_object",  "set_trajectory", "step", "start_recording", "stop_recording"};
  if (std::find(operations.begin(), operations.end(), s[2]) != operations.end()) return {Route::Kind::operation, "POST", s[2]};
  return {};
}

Result<control::Subscribe> subscription_of(const Target& target) {
  control::Subscribe wanted;
  if (target.query.empty()) return control::Subscribe{true, true, true, true, true};
  for (const auto& [key, value] : target.query) {
    bool* kind = key == "pings"     ? &wanted.pings
                 : key == "clients" ? &wanted.clients
                 : key == "poses"   ? &wanted.poses
                 : key == "scene"   ? &wanted.scene
                 : key == "faults"  ? &wanted.faults
                                    : nullptr;
    if (kind == nullptr)
      return failure(ErrorKind::bad_data,
                     '"' + key.substr(0, 64) + "\": unknown; events are pings, clients, poses, scene, faults");
    if (value != "1" && value != "0" && value != "true" && value != "false")
      return failure(ErrorKind::bad_data, key + " must be 1 or 0");
    *kind = value == "1" || value == "true";
  }
  if (!wanted.pings && !wanted.clients && !wanted.poses && !wanted.scene && !wanted.faults)
    return failure(ErrorKind::bad_data, "no events requested: pings=1, clients=1, poses=1, scene=1, faults=1");
  return wanted;
}

}  // namespace sonar
