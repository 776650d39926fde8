#include "protocol/foxglove/foxglove_words.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "protocol/control/control_json.hpp"

namespace sonar::foxglove {
namespace {

using Json = nlohmann::ordered_json;  // for writing: keeps the order of keys, but a look-up compares all keys
using Read = nlohmann::json;          // for reading messages of viewers, which may have thousands of keys
constexpr int most_nested = 16;

/// Writes JSON. Replaces bytes that are not UTF-8, which names may contain, so that no name makes a message fail.
std::string dump(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

Json json_of(Time at) {
  const auto since = at.time_since_epoch();
  const auto whole = std::chrono::floor<std::chrono::seconds>(since);
  return {{"sec", whole.count()}, {"nsec", (since - whole).count()}};
}

/// Returns a parameter in the form of the protocol. JSON has no NaN and no infinity, so such a value is sent as unset. Numbers
/// have the type "float64", because JSON does not distinguish 5.0 from 5.
Json json_of(const Parameter& parameter) {
  Json json{{"name", parameter.name}};
  std::visit(
      [&json](const auto& value) {
        using T = std::decay_t<decltype(value)>;
        if constexpr (std::is_same_v<T, double>) {
          if (!std::isfinite(value)) return;
          json["value"] = value;
          json["type"] = "float64";
        } else if constexpr (!std::is_same_v<T, std::monostate> && !std::is_same_v<T, OtherValue>) {
          json["value"] = value;
        }
      },
      parameter.value);
  return json;
}

// ---- messages of viewers

tl::unexpected<Error> refused(const std::string& why) { return failure(ErrorKind::bad_data, why); }

bool is_u32(const Read& json) {
  return json.is_number_unsigned() && json.get<std::uint64_t>() <= std::numeric_limits<std::uint32_t>::max();
}

/// Returns the items of a list, which `take` reads; nullopt if there is no list, or if an item has a wrong type.
template <class T, class Take>
std::optional<std::vector<T>> list(const Read& word, const char* key, Take take) {
  const auto found = word.find(key);
  if (found == word.end() || !found->is_array()) return std::nullopt;
  std::vector<T> all;
  for (const Read& item : *found) {
    std::optional<T> one = take(item);
    if (!one) return std::nullopt;
    all.push_back(*std::move(one));
  }
  return all;
}
std::optional<std::string> text(const Read& json) {
  return json.is_string() ? std::optional(json.get<std::string>()) : std::nullopt;
}
std::optional<std::uint32_t> number(const Read& json) {
  return is_u32(json) ? std::optional(json.get<std::uint32_t>()) : std::nullopt;
}
std::optional<std::pair<std::uint32_t, std::uint32_t>> subscription(const Read& json) {
  if (!json.is_object() || !json.contains("id") || !json.contains("channelId")) return std::nullopt;
  const auto id = number(json["id"]), channel = number(json["channelId"]);
  if (!id || !channel) return std::nullopt;
  return std::pair(*id, *channel);
}
/// Reads a value from a viewer, which may write a "float64" without a fraction. Integers beyond 63 bits become OtherValue.
Value value(const Read& json, bool is_float) {
  if (json.is_boolean()) return json.get<bool>();
  if (json.is_number_float() || (json.is_number() && is_float)) return json.get<double>();
  if (json.is_number_integer() && (!json.is_number_unsigned() || json.get<std::uint64_t>() >> 63 == 0))
    return json.get<std::int64_t>();
  if (json.is_string()) return json.get<std::string>();
  return OtherValue{};
}
std::optional<Parameter> parameter(const Read& json) {
  if (!json.is_object() || !json.contains("name") || !json["name"].is_string()) return std::nullopt;
  const bool is_float = json.contains("type") && json["type"] == "float64";
  return Parameter{json["name"].get<std::string>(), json.contains("value") ? value(json["value"], is_float) : Value{}};
}

std::string stray_field(const Read& object, std::span<const std::string_view> known) {
  for (const auto& [key, value] : object.items())
    if (std::find(known.begin(), known.end(), key) == known.end()) return key.substr(0, 64);
  return {};
}
/// Returns the name of the first unknown field of a message, or of an object in its lists; empty if all fields are known.
std::string stray_field(const Read& word) {
  constexpr std::array<std::string_view, 6> fields{"op",        "id", "subscriptions", "subscriptionIds", "parameterNames",
                                                   "parameters"};
  constexpr std::array<std::string_view, 2> of_subscriptions{"id", "channelId"};
  constexpr std::array<std::string_view, 3> of_parameters{"name", "value", "type"};
  std::string stray = stray_field(word, fields);
  const auto look_into = [&](const char* list, std::span<const std::string_view> known) {
    if (const auto found = word.find(list); found != word.end() && found->is_array())
      for (const Read& item : *found)
        if (stray.empty() && item.is_object()) stray = stray_field(item, known);
  };
  look_into("subscriptions", of_subscriptions);
  look_into("parameters", of_parameters);
  return stray;
}

template <class Word>
Result<ViewerWord> parameters_word(const Read& word, std::optional<std::vector<std::string>> names) {
  if (!names) return refused("parameterNames must be a list of names");
  if (names->size() > most_parameters) return refused("more than 64 parameters in one request");
  if constexpr (std::is_same_v<Word, GetParameters>) {
    const auto id = word.find("id");
    if (id != word.end() && !id->is_string()) return refused("id must be a string");
    return GetParameters{*std::move(names), id == word.end() ? std::nullopt : std::optional(id->template get<std::string>())};
  } else {
    return WatchParameters{*std::move(names), word["op"] == "subscribeParameterUpdates"};
  }
}

Result<ViewerWord> set_parameters(const Read& word) {
  auto parameters = list<Parameter>(word, "parameters", parameter);
  const auto id = word.find("id");
  if (!parameters) return refused("parameters must be a list of objects with a name and a value");
  if (id != word.end() && !id->is_string()) return refused("id must be a string");
  if (parameters->size() > most_parameters) return refused("more than 64 parameters in one request");
  return SetParameters{*std::move(parameters), id == word.end() ? std::nullopt : std::optional(id->get<std::string>())};
}

}  // namespace

std::string text_of(const ServerInfo& info) {
  Json json{{"op", "serverInfo"},
            {"name", info.name},
            {"capabilities", info.capabilities},
            {"supportedEncodings", {"json"}},
            {"metadata", info.metadata},
            {"sessionId", info.session}};
  if (info.data) {
    json["dataStartTime"] = json_of(info.data->first);
    json["dataEndTime"] = json_of(info.data->second);
  }
  return dump(json);
}

std::string advertise(std::span<const Channel> channels) {
  Json list = Json::array();
  for (const Channel& c : channels)
    list.push_back({{"id", c.id},
                    {"topic", c.topic},
                    {"encoding", c.encoding},
                    {"schemaName", c.schema.name},
                    {"schema", c.schema.text},
                    {"schemaEncoding", c.schema.encoding}});
  return dump({{"op", "advertise"}, {"channels", std::move(list)}});
}

std::string unadvertise(std::span<const std::uint32_t> channels) {
  return dump({{"op", "unadvertise"}, {"channelIds", std::vector(channels.begin(), channels.end())}});
}

std::string status(StatusLevel level, const std::string& message, const std::string& id) {
  Json json{{"op", "status"}, {"level", static_cast<int>(level)}, {"message", message}};
  if (!id.empty()) json["id"] = id;
  return dump(json);
}

std::string remove_status(const std::string& id) { return dump({{"op", "removeStatus"}, {"statusIds", Json::array({id})}}); }

std::string parameter_values(std::span<const Parameter> parameters, const std::optional<std::string>& request) {
  Json list = Json::array();
  for (const Parameter& p : parameters) list.push_back(json_of(p));
  Json json{{"op", "parameterValues"}, {"parameters", std::move(list)}};
  if (request) json["id"] = *request;
  return dump(json);
}

// Viewers need schemas of request and response; these schemas accept any object, because the daemon checks the content.
std::string advertise_services(std::span<const Service> services) {
  Json list = Json::array();
  for (const Service& s : services) {
    const auto side = [&s](const char* what) {
      return Json{{"encoding", "json"},
                  {"schemaName", s.type + what},
                  {"schemaEncoding", "jsonschema"},
                  {"schema", R"({"type":"object"})"}};
    };
    list.push_back({{"id", s.id}, {"name", s.name}, {"type", s.type}, {"request", side("")}, {"response", side("Response")}});
  }
  return dump({{"op", "advertiseServices"}, {"services", std::move(list)}});
}

std::string service_failure(std::uint32_t service, std::uint32_t call, const std::string& why) {
  return dump({{"op", "serviceCallFailure"}, {"serviceId", service}, {"callId", call}, {"message", why}});
}

// Ignores unknown fields, so that newer viewers work, but reports one of them in `stray`.
Result<ViewerWord> word_of_viewer(std::string_view message, std::string* stray) {
  if (control::nests_deeper(message, most_nested)) return refused("JSON nested deeper than 16");
  const Read word = Read::parse(message, nullptr, false);
  if (!word.is_object()) return refused("not a JSON object");
  const auto op = word.find("op");
  if (op == word.end() || !op->is_string()) return refused("a message needs a string \"op\"");
  if (stray != nullptr) *stray = stray_field(word);
  const auto is = [&op](const char* name) { return *op == name; };
  if (is("subscribe")) {
    auto wanted = list<std::pair<std::uint32_t, std::uint32_t>>(word, "subscriptions", subscription);
    if (!wanted) return refused("subscriptions must be a list of objects with a 32-bit id and channelId");
    return Subscribe{*std::move(wanted)};
  }
  if (is("unsubscribe")) {
    auto ids = list<std::uint32_t>(word, "subscriptionIds", number);
    if (!ids) return refused("subscriptionIds must be a list of 32-bit numbers");
    return Unsubscribe{*std::move(ids)};
  }
  if (is("setParameters")) return set_parameters(word);
  if (is("getParameters")) return parameters_word<GetParameters>(word, list<std::string>(word, "parameterNames", text));
  if (is("subscribeParameterUpdates") || is("unsubscribeParameterUpdates"))
    return parameters_word<WatchParameters>(word, list<std::string>(word, "parameterNames", text));
  for (const auto& [incapable, capability] :
       {std::pair("advertise", "clientPublish"), std::pair("unadvertise", "clientPublish"),
        std::pair("subscribeConnectionGraph", "connectionGraph"), std::pair("unsubscribeConnectionGraph", "connectionGraph"),
        std::pair("fetchAsset", "assets")})
    if (is(incapable)) return Incapable{incapable, capability};
  return UnknownWord{op->get<std::string>().substr(0, 64)};
}

}  // namespace sonar::foxglove
