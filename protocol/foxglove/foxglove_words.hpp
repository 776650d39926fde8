// Reads and writes the JSON messages of the Foxglove WebSocket protocol (source: foxglove_frames.hpp).
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "core/base/result.hpp"
#include "core/base/units.hpp"

namespace sonar::foxglove {

inline constexpr std::size_t longest_word = 64u << 10;  // longest JSON message of a viewer
inline constexpr std::size_t most_parameters = 64;      // limit for one request

/// A description of messages for viewers. `text` is base64 if the encoding is "protobuf".
struct Schema {
  std::string name, encoding, text;
};
struct Channel {
  std::uint32_t id = 0;
  std::string topic, encoding;  // topic of a channel; encoding of its messages: "protobuf", "cdr"
  Schema schema;
};
struct Service {
  std::uint32_t id = 0;
  std::string name, type;  // requests and answers are JSON objects
};

/// A parameter's value of a type that none of our parameters has. (In a Value, monostate = unset.)
struct OtherValue {
  bool operator==(const OtherValue&) const = default;
};
using Value = std::variant<std::monostate, bool, std::int64_t, double, std::string, OtherValue>;
struct Parameter {
  std::string name;
  Value value;
  bool operator==(const Parameter&) const = default;
};

struct ServerInfo {
  std::string name;
  std::vector<std::string> capabilities;
  std::map<std::string, std::string> metadata;
  std::string session;
  std::optional<std::pair<Time, Time>> data;  // first and last time, with playback
};
enum class StatusLevel { info, warning, error };

std::string text_of(const ServerInfo& info);
std::string advertise(std::span<const Channel> channels);
std::string unadvertise(std::span<const std::uint32_t> channels);
std::string status(StatusLevel level, const std::string& message, const std::string& id = {});
std::string remove_status(const std::string& id);
std::string parameter_values(std::span<const Parameter> parameters, const std::optional<std::string>& request);
std::string advertise_services(std::span<const Service> services);
std::string service_failure(std::uint32_t service, std::uint32_t call, const std::string& why);

struct Subscribe {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> subscriptions;  // id, channel
};
struct Unsubscribe {
  std::vector<std::uint32_t> subscriptions;
};
struct GetParameters {
  std::vector<std::string> names;  // none = all
  std::optional<std::string> request;
};
struct SetParameters {
  std::vector<Parameter> parameters;
  std::optional<std::string> request;
};
struct WatchParameters {
  std::vector<std::string> names;  // none = all
  bool on = true;
};
/// An operation that needs a capability that sonard does not offer.
struct Incapable {
  std::string op, capability;
};
struct UnknownWord {
  std::string op;
};
using ViewerWord = std::variant<UnknownWord, Subscribe, Unsubscribe, GetParameters, SetParameters, WatchParameters, Incapable>;
/// Reads a JSON message of a viewer. If `stray` is not null, it is set to the name of an unknown field, or to an empty text.
/// Errors: bad_data if the text is not a JSON object, is nested deeper than 16, or has no "op", a field of a wrong type, or too
/// many parameters.
Result<ViewerWord> word_of_viewer(std::string_view text, std::string* stray = nullptr);

}  // namespace sonar::foxglove
