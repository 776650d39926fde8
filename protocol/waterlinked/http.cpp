#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "core/text/ipv4.hpp"
#include "protocol/limits.hpp"
#include "protocol/waterlinked/settings.hpp"
#include "protocol/waterlinked/waterlinked.hpp"

namespace sonar::waterlinked {
namespace {

using Json = nlohmann::json;
using protocol::DeviceState;
using protocol::ResourceReply;

constexpr std::string_view base = "/api/v1/integration";
constexpr std::size_t longest_body = 1024;
constexpr double slowest_mps = 1000, fastest_mps = 2000;  // unknown: assumed
constexpr double electronics_warmer_c = 9.5;              // unknown: difference to the temperature of the water

struct Call {
  const DeviceState& device;
  Settings settings;  // present settings, which a POST changes
  Time now;
  bool synchronised() const { return text_option(device.options, option_name::clock) == "utc"; }
};
/// The outcome of a POST: the HTTP status, and the JSON of the answer or of an error.
struct Outcome {
  unsigned status = 204;
  Json body = {};
};
Outcome malformed(const std::string& why) { return {400, {{"error", why}}}; }

// ---- resources that GET reads

/// Returns a time such as "2026-01-31T23:58:15.123Z".
std::string rfc_3339(Time at) {
  const auto day = std::chrono::floor<std::chrono::days>(at);
  const std::chrono::year_month_day date(day);
  const auto ms = std::chrono::floor<std::chrono::milliseconds>(at - day).count();
  char text[64];
  std::snprintf(text, sizeof text, "%04d-%02u-%02uT%02d:%02d:%02d.%03dZ", static_cast<int>(date.year()),
                static_cast<unsigned>(date.month()), static_cast<unsigned>(date.day()), static_cast<int>(ms / 3'600'000),
                static_cast<int>(ms / 60'000 % 60), static_cast<int>(ms / 1000 % 60), static_cast<int>(ms % 1000));
  return text;
}

Json about(const Call& call) {
  char id[16];
  std::snprintf(id, sizeof id, "0x%08x", call.device.id);
  const std::string release(text_option(call.device.options, option_name::release));
  return {{"chipid", id},
          {"hardware_revision", 6},
          {"is_ready", true},
          {"product_id", call.device.model->part_number},
          {"product_name", "Sonar 3D-15"},
          {"variant", "standard"},
          {"version", release + " (sonard)"},
          {"version_short", release}};
}

double temperature_c(const Call& call) { return call.device.water.temperature_c + electronics_warmer_c; }

/// Makes the status. Release 1.7.0 renamed "severity" to "status" and "calibration" to "systems_check"; 1.7.1 added "time".
/// unknown: the ids.
Json status(const Call& call) {
  const std::string_view release = text_option(call.device.options, option_name::release);
  const bool older = release < "1.7.0";
  const auto entry = [older](const char* id, const char* message, const char* state = "ok", bool operational = true) {
    return Json{{"id", id}, {"message", message}, {"operational", operational}, {older ? "severity" : "status", state}};
  };
  const double t = temperature_c(call);
  Json all{{"api", entry("api-normal", "Integration API is operational.")},
           {"temperature", t >= 60   ? entry("temperature-critical", "Temperature is too high.", "error", false)
                           : t >= 55 ? entry("temperature-high", "Temperature is high.", "warning")
                                     : entry("temperature-normal", "Temperature is normal.")},
           {older ? "calibration" : "systems_check", entry("systems-check-normal", "All systems are operational.")}};
  if (release >= "1.7.1")
    all["time"] = call.synchronised() ? entry("time-synchronized", "Time is synchronized.")
                                      : entry("time-not-synchronized", "Time is not synchronized.", "warning");
  return all;
}

Json time_status(const Call& call) {
  const bool synchronised = call.synchronised();
  const auto since = std::chrono::duration_cast<std::chrono::seconds>(call.now - call.device.powered_up_at).count();
  return {{"system_time", rfc_3339(device_time(call.now, call.settings, call.device))},
          {"ntp_synced", synchronised},
          {"ntp_synced_to", synchronised ? call.settings.ntp_address : ""},
          {"ntp_seconds_since_last_sync", synchronised ? Json(since) : Json()}};
}

// ---- resources that POST writes

Outcome set_bool(bool& value, const Json& posted) {
  if (!posted.is_boolean()) return malformed("not a boolean");
  value = posted.get<bool>();
  return {};
}

Outcome set_range(Call& call, const Json& posted) {
  if (!posted.is_object() || !posted.value("min", Json()).is_number() || !posted.value("max", Json()).is_number())
    return malformed("not {\"min\": number, \"max\": number}");
  const double least = posted["min"].get<double>(), most = posted["max"].get<double>();
  if (!(least >= 0 && most - least >= least_window_m - protocol::rounding_m && most <= longest_range_m))
    return malformed(protocol::range_rule(least_window_m, longest_range_m, "min, max"));
  call.settings.range_min_m = least;
  call.settings.range_max_m = most;
  return {};
}

Outcome set_speed(Call& call, const Json& posted) {
  if (!posted.is_number()) return malformed("not a number");
  const auto speed = posted.get<double>();
  if (speed != 0 && !(speed >= slowest_mps && speed <= fastest_mps)) return malformed("0, or 1000 to 2000");
  call.settings.speed_of_sound_mps = speed;
  return {};
}

Outcome set_mode(Call& call, const Json& posted) {
  for (std::size_t i = 0; i < mode_rows().size(); ++i)
    if (posted == Json(mode_rows()[i].name)) return call.settings.mode = i, Outcome{};
  return malformed("\"low-frequency\" or \"high-frequency\"");
}

Outcome set_salinity(Call& call, const Json& posted) {
  if (posted != "salt" && posted != "fresh") return malformed("\"salt\" or \"fresh\"");
  call.settings.fresh = posted == "fresh";
  return {};
}

Outcome set_udp(Call& call, const Json& posted) {
  const Json mode = posted.is_object() ? posted.value("mode", Json()) : Json();
  if (mode != Json(multicast) && mode != Json(unicast) && mode != Json(disabled))
    return malformed("mode: \"multicast\", \"unicast\" or \"disabled\"");
  const Json ip = posted.value("unicast_destination_ip", Json("")), port = posted.value("unicast_destination_port", Json(0));
  if (!ip.is_string() || !port.is_number_integer() || port < 0 || port > 65535) return malformed("no such destination");
  if (mode == Json(unicast)) {  // the destination of other modes is stored without a check of its address
    const auto to = text::parse_ipv4(ip.get<std::string>());
    if (!to || port == 0) return malformed("unicast needs a destination");
    constexpr unsigned first_multicast = 224;
    if ((*to)[0] == 0 || (*to)[0] >= first_multicast) return malformed("a unicast destination is the address of one computer");
  }
  call.settings.udp = mode.get<std::string>();
  call.settings.unicast_ip = ip.get<std::string>();
  call.settings.unicast_port = port.get<std::uint16_t>();
  return {};
}

Outcome set_ntp(Call& call, const Json& posted) {
  const Json address = posted.is_object() ? posted.value("ntp_address", Json()) : Json();
  if (!address.is_string()) return malformed("not {\"ntp_address\": text}");
  call.settings.ntp_address = address.get<std::string>();
  return {};
}

/// Answers force-sync. The emulated sonar queries no time server; the result depends on option `clock`.
Outcome force_sync(Call& call, const Json& posted) {
  if (!posted.is_object() || !posted.value("timeout_seconds", Json(0)).is_number())
    return malformed("not {\"timeout_seconds\": number}");
  const bool done = call.synchronised();
  return {
      200,
      {{"success", done}, {"message", done ? "Time is synchronized." : "No server answered."}, {"status", time_status(call)}}};
}

/// Sets the clock of a device that is not synchronised. The offset counts from power-up, as in device_time().
Outcome set_time(Call& call, const Json& posted) {
  const Json now = posted.is_object() ? posted.value("now", Json()) : Json();
  int year = 0, hour = 0, minute = 0;
  unsigned month = 0, day = 0;
  double second = 0;
  int length = 0, zone_hour = 0, zone_minute = 0;
  char sign = '+';
  const std::string text = now.is_string() ? now.get<std::string>() : "";
  if (std::sscanf(text.c_str(), "%4d-%2u-%2uT%2d:%2d:%lf%n", &year, &month, &day, &hour, &minute, &second, &length) != 6)
    return malformed("not {\"now\": RFC 3339}");
  const std::string zone = text.substr(static_cast<std::size_t>(length));
  if (zone != "Z" && (std::sscanf(zone.c_str(), "%c%2d:%2d", &sign, &zone_hour, &zone_minute) != 3 ||
                      (sign != '+' && sign != '-') || zone_hour < 0 || zone_hour > 23 || zone_minute < 0 || zone_minute > 59))
    return malformed("not a time of RFC 3339, which ends in Z or as +01:00");
  const std::chrono::year_month_day date{std::chrono::year(year), std::chrono::month(month), std::chrono::day(day)};
  if (!date.ok() || hour < 0 || hour > 23 || minute < 0 || minute > 59 || !(second >= 0 && second < 61) || year < 1970 ||
      year > 2200)
    return malformed("not a time");
  if (call.synchronised()) return {409, {{"error", "synchronized by NTP"}}};
  const Time wanted = Time(std::chrono::sys_days(date)) + std::chrono::hours(hour) + std::chrono::minutes(minute) +
                      nanoseconds_from(second) -
                      (sign == '-' ? -1 : 1) * (std::chrono::hours(zone_hour) + std::chrono::minutes(zone_minute));
  call.settings.clock_offset = wanted - Time(call.now - call.device.powered_up_at);
  return {};
}

struct Path {
  std::string_view name, since;  // path, and the first release that has it
  Json (*get)(const Call&);
  Outcome (*post)(Call&, const Json&);
};
constexpr std::array<Path, 14> paths{{
    {"/about", "", about, nullptr},
    {"/status", "", status, nullptr},
    {"/temperature", "", [](const Call& c) { return Json(temperature_c(c)); }, nullptr},
    {"/acoustics/enabled", "", [](const Call& c) { return Json(c.settings.acoustics); },
     [](Call& c, const Json& posted) { return set_bool(c.settings.acoustics, posted); }},
    {"/acoustics/range", "",
     [](const Call& c) {
       return Json{{"min", c.settings.range_min_m}, {"max", c.settings.range_max_m}};
     },
     set_range},
    {"/acoustics/speed_of_sound", "", [](const Call& c) { return Json(c.settings.speed_of_sound_mps); }, set_speed},
    {"/acoustics/mode", "1.7.0", [](const Call& c) { return Json(mode_rows()[c.settings.mode].name); }, set_mode},
    {"/acoustics/salinity", "1.7.0", [](const Call& c) { return Json(c.settings.fresh ? "fresh" : "salt"); }, set_salinity},
    {"/udp", "",
     [](const Call& c) {
       return Json{{"mode", c.settings.udp},
                   {"unicast_destination_ip", c.settings.unicast_ip},
                   {"unicast_destination_port", c.settings.unicast_port}};
     },
     set_udp},
    {"/output/imu-batch/enabled", "1.8.0", [](const Call& c) { return Json(c.settings.imu); },
     [](Call& c, const Json& posted) { return set_bool(c.settings.imu, posted); }},
    {"/time/ntp", "1.7.1",
     [](const Call& c) {
       return Json{{"ntp_address", c.settings.ntp_address}};
     },
     set_ntp},
    {"/time/status", "1.7.1", time_status, nullptr},
    {"/time/ntp/force-sync", "1.7.1", nullptr, force_sync},
    {"/time/manual", "1.7.1", nullptr, set_time},
}};

ResourceReply reply_of(unsigned status, const Json& body) {
  return {status, status == 204 ? "" : body.dump(-1, ' ', false, Json::error_handler_t::replace)};
}

/// Makes the reply to a POST. Unchanged settings cause no event, so that repeated requests restart nothing.
ResourceReply changed(const Call& call, const Outcome& outcome) {
  ResourceReply reply = reply_of(outcome.status, outcome.body);
  const Settings before = settings_from(call.device.settings.get(), call.device);
  if (call.settings != before) reply.events.emplace_back(change_to(call.settings, call.device));
  return reply;
}

}  // namespace

ResourceReply answer(const protocol::ResourceRequest& request, const DeviceState& device, Time now) {
  if (request.path == "/" && request.method == "GET") return {200, device.model->name + ", emulated\n", "text/plain"};
  const bool inside = request.path.starts_with(base);
  const auto path = std::find_if(paths.begin(), paths.end(),
                                 [&](const Path& p) { return inside && request.path.substr(base.size()) == p.name; });
  // Releases compare as texts, because all have the form 1.x.y with one digit each.
  if (path == paths.end() || text_option(device.options, option_name::release) < path->since)
    return reply_of(404, {{"error", "unknown path"}});
  Call call{device, settings_from(device.settings.get(), device), now};
  if (request.method == "GET" && path->get != nullptr) return reply_of(200, path->get(call));
  if (request.method != "POST" || path->post == nullptr) {
    ResourceReply refused = reply_of(405, {{"error", "method not allowed"}});
    refused.allow = path->get == nullptr ? "POST" : path->post == nullptr ? "GET" : "GET, POST";
    return refused;
  }
  if (request.body.size() > longest_body) return reply_of(413, {{"error", "the body is longer than 1024 bytes"}});
  // A missing body counts as an empty object, which force-sync accepts, because its body is optional; other resources refuse it
  // and state what they need.
  const Json posted = request.body.empty() ? Json::object() : Json::parse(request.body, nullptr, false);
  if (posted.is_discarded()) return reply_of(400, {{"error", "not JSON"}});
  return changed(call, path->post(call, posted));
}

}  // namespace sonar::waterlinked
