#include "protocol/dvl/dialogue.hpp"

#include <algorithm>
#include <cmath>
#include <string_view>
#include <utility>

#include "core/text/format.hpp"
#include "protocol/dvl/dvl.hpp"
#include "protocol/dvl/reports.hpp"

namespace sonar::dvl {
namespace {

using protocol::Reaction;

constexpr int most_waiting = 15;  // limit for waiting triggered pings (DOC)
constexpr std::chrono::nanoseconds report_period = std::chrono::milliseconds(200);
constexpr auto longest_wait = std::chrono::seconds(2);  // a triggered ping that takes longer is lost and requested again

constexpr const char* version = "2.7.2";  // a version of the software with protocol json_v3.3

std::string time_text(Time at) {
  const auto day = std::chrono::floor<std::chrono::days>(at);
  const std::chrono::year_month_day date(day);
  const auto s = std::chrono::floor<std::chrono::seconds>(at - day).count();
  return text::format("%04d-%02u-%02uT%02d:%02d:%02dZ", static_cast<int>(date.year()), static_cast<unsigned>(date.month()),
                      static_cast<unsigned>(date.day()), static_cast<int>(s / 3600), static_cast<int>(s / 60 % 60),
                      static_cast<int>(s % 60));
}

/// True for a text that the sentences of the serial line can contain as one word.
bool is_address(std::string_view text) {
  return text.size() <= 255 && std::all_of(text.begin(), text.end(), [](char c) { return c > ' ' && c < 0x7F && c != ','; });
}

Json time_status(const protocol::DeviceState& device, Time now, const Settings& settings) {
  return {{"system_time", time_text(now)},
          {"ntp_synced", true},
          {"ntp_synced_to", settings.ntp_address},
          {"ntp_seconds_since_last_sync", std::chrono::duration_cast<std::chrono::seconds>(now - device.powered_up_at).count()}};
}

Json configuration(const Settings& s) {
  return {{"speed_of_sound", s.speed_of_sound_mps},
          {"acoustic_enabled", s.acoustics},
          {"dark_mode_enabled", s.dark},
          {"mounting_rotation_offset", s.mounting_rotation_deg},
          {"range_mode", s.range_mode},
          {"periodic_cycling_enabled", s.cycles}};
}

/// Sets a value, or returns the text of an error. unknown: the texts of the device; these are ours.
std::string set_number(const Json& value, const std::string& name, double lowest, double highest, double& to) {
  if (!value.is_number() || !(value.get<double>() >= lowest && value.get<double>() <= highest))
    return text::format("%s must be a number from %g to %g", name.c_str(), lowest, highest);
  to = value.get<double>();
  return {};
}
std::string set_truth(const Json& value, const std::string& name, bool& to) {
  if (!value.is_boolean()) return name + " must be true or false";
  to = value.get<bool>();
  return {};
}
/// Sets a parameter of set_config, or returns the text of an error.
std::string set_value(const std::string& name, const Json& value, Settings& s) {
  if (name == "speed_of_sound") return set_number(value, name, 1000, 2000, s.speed_of_sound_mps);
  if (name == "mounting_rotation_offset") return set_number(value, name, 0, 360, s.mounting_rotation_deg);
  if (name == "acoustic_enabled") {
    s.is_triggered = false;
    return set_truth(value, name, s.acoustics);
  }
  if (name == "dark_mode_enabled") return set_truth(value, name, s.dark);
  if (name == "periodic_cycling_enabled") return set_truth(value, name, s.cycles);
  if (name != "range_mode") return "there is no parameter " + name;
  if (value == "wt") return "water tracking is not emulated";
  if (!value.is_string() || !allow_modes(value.get<std::string>(), s))
    return "range_mode must be auto, =a or a<=b, with modes 0 to 4";
  return {};
}

/// Sets all parameters, or none if one of them is invalid.
Outcome set_config(const Json& parameters, Settings& settings) {
  if (!parameters.is_object()) return {.error = "set_config needs parameters"};
  Settings changed = settings;
  for (const auto& [name, value] : parameters.items())
    if (std::string why = set_value(name, value, changed); !why.empty()) return {.error = std::move(why)};
  settings = changed;
  return {};
}

}  // namespace

/// Returns the time of the next report of dead reckoning, a multiple of the period, so that all clients get reports at the same
/// times.
Time Session::next_report_after(Time now) { return now - now.time_since_epoch() % report_period + report_period; }

Reaction Session::on_tick(Time now, bool ping_pending) {
  Reaction reaction;
  if (now < due_) return reaction;
  due_ = next_report_after(now);
  protocol::Bytes report = device_.model == replayed_model(*device_.model) ? protocol::Bytes{} : position_report(stamp_of(now));
  if (!report.empty()) reaction.replies.push_back(std::move(report));
  if (waiting_ > 0 && now - requested_at_ > longest_wait && !ping_pending) {
    requested_at_ = now;
    reaction.events.emplace_back(protocol::RequestPing{});
  }
  return reaction;
}

// Every client gets every ping, also pings that another client has triggered. Each ping counts as one that this client triggered.
protocol::Delivery Session::on_ping(const VendorSettings*, std::size_t, Time now) {
  protocol::Delivery delivery{{protocol::Bytes{}}, {}};
  if (waiting_ > 0 && --waiting_ > 0) {
    requested_at_ = now;
    delivery.events.emplace_back(protocol::RequestPing{});
  }
  return delivery;
}

std::optional<Outcome> Session::execute(const std::string& command, const Json& parameters, Time now, Reaction& reaction) {
  Settings s = settings_after(reaction);
  if (command == "trigger_ping") return trigger(std::move(s), now, reaction);
  const auto before = s.configured();
  auto outcome = carry_out(command, parameters, device_, stamp_of(now), s);
  if (s.configured() != before || command == "reset_dead_reckoning") reaction.events.emplace_back(change_to(s, device_));
  if (s.acoustics) waiting_ = 0;  // enabled acoustics drop the triggers that wait
  return outcome;
}

Outcome Session::trigger(Settings s, Time now, Reaction& reaction) {
  if (s.acoustics) return {.error = "acoustic_enabled must be false"};
  if (waiting_ >= most_waiting) return {.error = "the queue is full"};
  if (!s.is_triggered) {  // the rate of the settings is 0 while acoustics are disabled; a triggered ping needs another rate
    s.is_triggered = true;
    reaction.events.emplace_back(change_to(s, device_));
  }
  if (++waiting_ == 1) {
    requested_at_ = now;
    reaction.events.emplace_back(protocol::RequestPing{});
  }
  return {};
}

Json version_info(const protocol::DeviceState& device) {
  return {{"chipid", text::format("0x%014x", unsigned{device.id})},
          {"hardware_revision", 4},
          {"product_id", device.model->part_number},
          {"product_name", device.model->name},
          {"variant", "standard"},
          {"version_short", version},
          {"version", std::string(version) + " (sonard)"},
          {"is_ready", true}};
}

std::optional<Outcome> carry_out(const std::string& command, const Json& parameters, const protocol::DeviceState& device,
                                 Time now, Settings& settings) {
  if (command == "get_config") return Outcome{configuration(settings)};
  if (command == "set_config") return set_config(parameters, settings);
  if (command == "reset_dead_reckoning") return settings.reckoning = {}, Outcome{};
  if (command == "calibrate_gyro") return Outcome{};
  if (command == "get_version_info") return Outcome{version_info(device)};
  if (command == "get_time_status") return Outcome{time_status(device, now, settings)};
  if (command == "get_time_ntp") return Outcome{{{"ntp_address", settings.ntp_address}}};
  if (command == "set_time_ntp") {
    const auto address = parameters.is_object() ? parameters.find("ntp_address") : parameters.end();
    if (address == parameters.end() || !address->is_string() || !is_address(address->get_ref<const std::string&>()))
      return Outcome{.error = "ntp_address must be a text of up to 255 letters, digits and signs, without commas and spaces"};
    settings.ntp_address = address->get<std::string>();
    return Outcome{};
  }
  // The emulated clock is always synchronised, so setting it fails.
  if (command == "set_time_manual") return Outcome{.error = "Manual time not allowed when NTP is synchronized"};
  if (command == "force_sync_ntp")
    return Outcome{{{"success", true}, {"message", "NTP force-sync successful"}, {"status", time_status(device, now, settings)}}};
  return std::nullopt;
}

protocol::Bytes response_line(const std::string& to, const Outcome& outcome) {
  const Json message{{"response_to", to},
                     {"success", outcome.error.empty()},
                     {"error_message", outcome.error},
                     {"result", outcome.result},
                     {"format", format_name},
                     {"type", "response"}};
  // `to` is a text of the client and may not be UTF-8. Without `replace`, dump() would throw then.
  return line_of(message.dump(-1, ' ', false, Json::error_handler_t::replace));
}

namespace {

using protocol::Reaction;

constexpr std::size_t longest_command = 4096;
constexpr int deepest_command = 8;  // nested braces (our choice)

/// Finds the JSON objects in a stream by counting braces, because libwaterlinked sends no line ends between objects.
class ObjectSplitter {
 public:
  /// Returns the object that ends with this byte.
  std::optional<std::string> add(char c) {
    if (depth_ == 0) {
      if (c == '{') {
        object_ = c;
        depth_ = 1;
        in_text_ = escapes_ = false;
      } else if (c != '\n' && c != '\r' && c != ' ' && c != '\t') {
        ++junk_;
      }
      return std::nullopt;
    }
    object_ += c;
    if (in_text_) {  // braces within a text do not count, and an escaped quote does not end it
      if (!std::exchange(escapes_, !escapes_ && c == '\\') && c == '"') in_text_ = false;
    } else if (c == '"') {
      in_text_ = true;
    } else if (c == '{') {
      ++depth_;
    } else if (c == '}' && --depth_ == 0) {
      return std::exchange(object_, {});
    }
    // An object that is too long or too deep is dropped. The following bytes are read as a new stream.
    if (object_.size() < longest_command && depth_ <= deepest_command) return std::nullopt;
    junk_ += object_.size();
    depth_ = 0;
    object_.clear();
    return std::nullopt;
  }
  std::size_t take_junk() { return std::exchange(junk_, 0); }

 private:
  std::string object_;
  int depth_ = 0;
  bool in_text_ = false, escapes_ = false;
  std::size_t junk_ = 0;
};

class JsonDialogue final : public Session {
 public:
  using Session::Session;

  Reaction on_bytes(BytesView received, Time now) override {
    Reaction reaction;
    for (const std::byte b : received)
      if (const auto object = splitter_.add(static_cast<char>(b))) on_object(*object, now, reaction);
    if (const std::size_t junk = splitter_.take_junk(); junk > 0)
      reaction.events.emplace_back(protocol::Notice{std::to_string(junk) + " bytes that are not a command"});
    return reaction;
  }

 private:
  Bytes position_report(Time stamp) const override { return position_line(extrapolated(settings().reckoning, stamp), stamp); }

  void on_object(const std::string& object, Time now, Reaction& reaction) {
    const Json message = Json::parse(object, nullptr, false);
    const auto named = message.is_object() ? message.find("command") : message.end();
    if (named == message.end() || !named->is_string()) {
      reaction.replies.push_back(response_line("", {.error = "the message is not a command"}));
      return;
    }
    const std::string command = named->get<std::string>();
    const auto parameters = message.find("parameters");
    const auto outcome = execute(command, parameters != message.end() ? *parameters : Json(), now, reaction);
    reaction.replies.push_back(response_line(command, outcome.value_or(Outcome{.error = "there is no such command"})));
  }

  ObjectSplitter splitter_;
};

}  // namespace

std::unique_ptr<protocol::Dialogue> converse_in_json(const protocol::DeviceState& device, Time now) {
  return std::make_unique<JsonDialogue>(device, now);
}

}  // namespace sonar::dvl
