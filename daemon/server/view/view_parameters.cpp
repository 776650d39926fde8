#include "daemon/server/view/view_parameters.hpp"

#include <algorithm>
#include <cmath>
#include <string_view>

#include "daemon/config/faults/fault.hpp"
#include "protocol/control/answers.hpp"
#include "protocol/fault_kinds.hpp"
#include "protocol/foxglove/foxglove_messages.hpp"

namespace sonar {
namespace {

ViewPayloadPointer payload_of(Time at, const google::protobuf::MessageLite& message) {
  wire::Bytes bytes(message.ByteSizeLong());
  message.SerializeToArray(bytes.data(), static_cast<int>(bytes.size()));
  return view_payload(at, std::move(bytes));
}

}  // namespace

ViewPayloadPointer ping_payload(const Device& of, const PingQueued& queued) {
  return payload_of(queued.ping->request.fired_at, of.event_of(queued));
}

ViewPayloadPointer figures_payload(const Device& of, const PingQueued& queued) {
  const PingRequest& r = queued.ping->request;
  const DeviceFigures f = of.figures();
  const Vec3d at = r.sonar_in_world.position_m;
  const RollPitchYaw turned = rpy_from_quat(r.sonar_in_world.orientation);
  const double heading_deg = std::fmod(450 - deg_from_rad(turned.yaw_rad), 360);  // clockwise from north
  return view_payload(
      r.fired_at,
      foxglove::figures({seconds(r.fired_at.time_since_epoch()), static_cast<double>(r.number), r.settings.range_m,
                         static_cast<double>(r.settings.rate_hz), 1e3 * queued.simulation_s, 1e3 * f.latency.quantile_s(0.5),
                         static_cast<double>(f.clients_now), static_cast<double>(f.served), static_cast<double>(f.dropped), at.x,
                         at.y, at.z, deg_from_rad(turned.roll_rad), deg_from_rad(turned.pitch_rad), heading_deg}));
}

ViewPayloadPointer faults_payload(Time now, const v1::FaultReport& report) { return payload_of(now, report); }
ViewPayloadPointer status_payload(Time now, const v1::DaemonStatus& status) { return payload_of(now, status); }

namespace {

using foxglove::Parameter;
using foxglove::Value;

tl::unexpected<Error> refused(const std::string& why) { return failure(ErrorKind::usage, why); }
tl::unexpected<Error> no_such_parameter() { return refused("there is no such parameter"); }

std::string fault_name(std::string_view trouble, const std::string& sonar) {
  return "view." + sonar + "." + std::string(trouble);
}
/// Returns the parameter of a trouble, such as "/faults/thin_tether"; with several sonars "/faults/front/thin_tether".
std::string fault_parameter(std::string_view trouble, const std::string& sonar, const Fleet& fleet) {
  std::string name = fleet.devices().size() > 1 ? "/faults/" + sonar + "/" : "/faults/";
  for (const char c : trouble) name += c == '-' ? '_' : c;
  return name;
}
/// Returns the seconds until the end of a trouble (a named group of faults) that a viewer started; 0 = it is not active.
double seconds_left(const Device& device, const std::string& fault, Time now) {
  double left = 0;
  for (const Faults::Listed& listed : device.sonar().faults().list())
    if (!listed.over && listed.expires != Time::max() &&
        (listed.fault->name == fault || listed.fault->name.starts_with(fault + ".")))
      left = std::max(left, seconds(listed.expires - now));
  return std::ceil(left * 10) / 10;
}

/// True if the product accepts a value of this setting. Products that determine their rate or gain themselves accept none.
template <class Value>
bool takes(const Device& device, std::optional<Value> protocol::SettingsOverride::*setting, Value value) {
  protocol::SettingsOverride wanted;
  wanted.*setting = value;
  return device.config().profile.vendor->apply_override(wanted, device.sonar().state()).has_value();
}

void add_sonar(std::vector<Parameter>& all, const Device& device, bool has_preview) {
  const PingSettings& s = device.sonar().settings();
  const std::string at = "/" + device.config().name + "/";
  // For a product with a turning head, the preview may have a longer range than the initial settings.
  const protocol::Vendor& vendor = *device.config().profile.vendor;
  const auto step = device.preview().on() ? vendor.scan_step(1, device.sonar().state()) : std::nullopt;
  all.push_back({at + "range_m", step ? step->settings.range_m : s.range_m});
  const auto rate_hz = static_cast<double>(s.rate_hz);
  using Setting = protocol::SettingsOverride;
  if (takes(device, &Setting::rate_hz, rate_hz > 0 ? rate_hz : 1.0)) all.push_back({at + "rate_hz", rate_hz});
  const double gain_percent = vendor.gain_percent(device.sonar().state());
  if (takes(device, &Setting::gain_percent, gain_percent)) all.push_back({at + "gain_percent", gain_percent});
  if (device.config().profile.model->modes.size() > 1) all.push_back({at + "mode", std::int64_t{s.mode}});
  if (takes(device, &Setting::beams, 256u) && takes(device, &Setting::beams, 512u))
    all.push_back({at + "beams", std::int64_t{s.beam_count}});
  all.push_back({at + "transmit", device.sonar().transmits()});
  if (has_preview) all.push_back({at + "preview", device.preview().on()});
}

void add_trajectory(std::vector<Parameter>& all, const std::string& name, const std::optional<World::Played>& played, Time now) {
  if (!played) return;
  const std::string at = "/" + name + "/trajectory/";
  all.push_back({at + "paused", played->playback.paused()});
  all.push_back({at + "position_s", seconds(played->playback.place(now).at)});
  all.push_back({at + "speed", played->playback.rules().speed.factor()});
}

// ---- writes

std::optional<std::uint32_t> count_of(const Value& value) {
  const auto number = number_of(value);
  if (!number || *number < 0 || *number > 1e9 || *number != std::floor(*number)) return std::nullopt;
  return static_cast<std::uint32_t>(*number);
}
std::optional<bool> flag_of(const Value& value) {
  const auto* flag = std::get_if<bool>(&value);
  return flag == nullptr ? std::nullopt : std::optional(*flag);
}

/// Sets one member of an operation: a number, a whole number or true/false. Refuses a value of another type.
template <class Op, class T>
Result<control::Operation> with(Op operation, std::optional<T> Op::*member, const std::optional<T>& value) {
  if (!value)
    return refused("must be " + std::string(std::is_same_v<T, bool>     ? "true or false"
                                            : std::is_same_v<T, double> ? "a number"
                                                                        : "a whole number"));
  operation.*member = value;
  return control::Operation(std::move(operation));
}

Result<control::Operation> set_sonar(const std::string& sonar, std::string_view key, const Value& value) {
  using Op = control::SetSonar;
  Op op;
  op.sonar = sonar;
  if (key == "range_m") return with(op, &Op::range_m, number_of(value));
  if (key == "rate_hz") return with(op, &Op::rate_hz, number_of(value));
  if (key == "gain_percent") return with(op, &Op::gain_percent, number_of(value));
  if (key == "mode") return with(op, &Op::mode, count_of(value));
  if (key == "beams") return with(op, &Op::beams, count_of(value));
  if (key == "transmit") return with(op, &Op::transmit, flag_of(value));
  return no_such_parameter();
}

Result<control::Operation> set_water(std::string_view key, const Value& value) {
  using Op = control::SetEnvironment;
  if (key == "temperature_c") return with(Op{}, &Op::temperature_c, number_of(value));
  if (key == "salinity_psu") return with(Op{}, &Op::salinity_psu, number_of(value));
  if (key == "ph") return with(Op{}, &Op::ph, number_of(value));
  if (key == "sound_speed_mps") return with(Op{}, &Op::sound_speed_mps, number_of(value));
  return no_such_parameter();
}

Result<control::Operation> set_trajectory(control::PoseSample::Of of, const std::string& name, std::string_view key,
                                          const Value& value) {
  using Op = control::SetTrajectory;
  Op op;
  op.of = of;
  op.name = name;
  if (key == "paused") return with(op, &Op::paused, flag_of(value));
  if (key == "position_s") return with(op, &Op::position_s, number_of(value));
  if (key == "speed") return with(op, &Op::speed, number_of(value));
  return no_such_parameter();
}

/// Makes the operation for a trouble's parameter, whose value is the duration in seconds; 0 ends the trouble. The operation
/// GetFaults means that nothing is to be done.
Result<control::Operation> set_fault(const Parameter& wanted, const ParameterSource& of) {
  if (wanted.name == "/faults/armed") return refused("cannot be set: start sonard with --faults");
  if (!of.config.faults.armed) return refused("start sonard with --faults");
  if (wanted.name == "/faults/clear_all") {
    if (!flag_of(wanted.value)) return refused("must be true or false");
    return *flag_of(wanted.value) ? control::Operation(control::EndFaults{}) : control::Operation(control::GetFaults{});
  }
  for (const Device& device : of.fleet.devices()) {
    for (const Trouble& trouble : troubles()) {
      const std::string& sonar = device.config().name;
      if (wanted.name != fault_parameter(trouble.name, sonar, of.fleet)) continue;
      const auto lasts = number_of(wanted.value);
      const auto longest = static_cast<double>(longest_manual_fault.count());
      if (!lasts || *lasts < 0 || *lasts > longest)
        return refused("must be a number of seconds from 0 to " + std::to_string(longest_manual_fault.count()));
      const std::string name = fault_name(trouble.name, sonar);
      if (*lasts == 0 && seconds_left(device, name, of.clock.now()) == 0) return control::Operation(control::GetFaults{});
      if (*lasts == 0) return control::Operation(control::EndFaults{name});
      control::FaultRecord record;
      record.name = name;
      record.what = trouble.name;
      record.sonar = sonar;
      record.lasts.seconds = lasts;
      return control::Operation(control::AddFault{std::move(record)});
    }
  }
  return no_such_parameter();
}

}  // namespace

std::optional<double> number_of(const Value& value) {
  if (const auto* number = std::get_if<double>(&value)) return std::isfinite(*number) ? std::optional(*number) : std::nullopt;
  if (const auto* whole = std::get_if<std::int64_t>(&value)) return static_cast<double>(*whole);
  return std::nullopt;
}

/// Returns all parameters with their present values, in the order in which viewers list them.
std::vector<Parameter> parameters_of(const ParameterSource& of) {
  const Time now = of.clock.now();
  std::vector<Parameter> all;
  for (const Device& device : of.fleet.devices()) add_sonar(all, device, !of.clock.stepped());
  all.push_back({"/water/temperature_c", of.config.water.temperature_c});
  all.push_back({"/water/salinity_psu", of.config.water.salinity_psu});
  all.push_back({"/water/ph", of.config.water.ph});
  all.push_back({"/water/sound_speed_mps", of.config.water.sound_speed_mps});
  for (std::size_t i = 0; i < of.config.vehicles.size(); ++i)
    add_trajectory(all, of.config.vehicles[i].name, of.world.vehicle_plays(i), now);
  all.push_back({"/faults/armed", of.config.faults.armed});
  if (of.config.faults.armed) {
    for (const Device& device : of.fleet.devices())
      for (const Trouble& trouble : troubles())
        all.push_back({fault_parameter(trouble.name, device.config().name, of.fleet),
                       seconds_left(device, fault_name(trouble.name, device.config().name), now)});
    all.push_back({"/faults/clear_all", false});
  }
  all.push_back({"/clock/mode", std::string(name_of(of.config.clock))});
  all.push_back({"/clock/now_s", seconds(now.time_since_epoch())});
  return all;
}

Result<control::Operation> operation_of(const Parameter& wanted, const ParameterSource& of) {
  if (std::holds_alternative<std::monostate>(wanted.value)) return refused("a parameter cannot be unset");
  std::string_view rest = wanted.name;
  if (!rest.starts_with("/")) return no_such_parameter();
  rest.remove_prefix(1);
  const std::size_t slash = std::min(rest.find('/'), rest.size());
  const std::string first(rest.substr(0, slash));
  rest.remove_prefix(std::min(slash + 1, rest.size()));
  if (first == "faults") return set_fault(wanted, of);
  if (first == "clock") return refused("cannot be set");
  if (first == "water") return set_water(rest, wanted.value);
  if (constexpr std::string_view trajectory = "trajectory/"; rest.starts_with(trajectory)) {
    const bool is_vehicle = std::any_of(of.config.vehicles.begin(), of.config.vehicles.end(),
                                        [&](const VehicleConfig& v) { return v.name == first; });
    if (!is_vehicle) return no_such_parameter();
    return set_trajectory(control::PoseSample::Of::vehicle, first, rest.substr(trajectory.size()), wanted.value);
  }
  return of.fleet.find(first) != nullptr ? set_sonar(first, rest, wanted.value) : Result<control::Operation>(no_such_parameter());
}

}  // namespace sonar
