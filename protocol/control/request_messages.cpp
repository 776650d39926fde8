// Converts requests between protobuf and plain structs, with the rules for names, numbers and choices.
#include <google/protobuf/struct.pb.h>

#include <algorithm>
#include <array>
#include <charconv>

#include "protocol/control/answers.hpp"
#include "protocol/control/messages.hpp"

namespace sonar::control {
namespace {

constexpr std::size_t longest_name = 256, longest_path = 4096;

/// Checks a name. Names are printed in log lines and answers, so control characters, which could forge lines, are refused.
Result<std::string> checked_text(const std::string& text, const char* key, bool needed, std::size_t longest = longest_name) {
  if (needed && text.empty()) return refused(std::string(key) + " is missing");
  if (text.size() > longest) return refused(std::string(key) + " is longer than " + std::to_string(longest) + " bytes");
  const bool control = std::any_of(text.begin(), text.end(), [](unsigned char c) { return c < 0x20 || c == 0x7f; });
  if (control) return refused(std::string(key) + " has control characters");
  return text;
}

Result<Pose> placed(const v1::Placement& message) {
  auto pose = control::from(message);
  if (!pose) pose.error().text.insert(0, "at: ");
  return pose;
}

Result<PoseSample> with_checked_name(Result<PoseSample> sample) {
  if (!sample) return sample;
  const char* key = sample->of == PoseSample::Of::object ? "object" : "vehicle";
  if (const auto name = checked_text(sample->name, key, false); !name) return tl::make_unexpected(name.error());
  return sample;
}

Result<SetSonar> from(const v1::SetSonar& m) {
  SetSonar set;
  const auto name = checked_text(m.sonar(), "sonar", false);
  if (!name) return tl::make_unexpected(name.error());
  set.sonar = *name;
  if (m.has_range_m()) set.range_m = m.range_m().value();
  if (m.has_rate_hz()) set.rate_hz = m.rate_hz().value();
  if (m.has_gain_percent()) set.gain_percent = m.gain_percent().value();
  if (m.has_mode()) set.mode = m.mode().value();
  if (m.has_beams()) set.beams = m.beams().value();
  if (m.has_transmit()) set.transmit = m.transmit().value();
  if (m.has_mount()) {
    const auto mount = control::from(m.mount());
    if (!mount) return tl::make_unexpected(mount.error());
    set.mount = *mount;
  }
  return set;
}

SetEnvironment from(const v1::Environment& m) {
  SetEnvironment set;
  if (m.has_temperature_c()) set.temperature_c = m.temperature_c().value();
  if (m.has_salinity_psu()) set.salinity_psu = m.salinity_psu().value();
  if (m.has_ph()) set.ph = m.ph().value();
  if (m.has_sound_speed_mps()) set.sound_speed_mps = m.sound_speed_mps().value();
  return set;
}

Result<LoadScene> from(const v1::LoadScene& m) {
  const auto path = checked_text(m.path(), "path", true, longest_path);
  if (!path) return tl::make_unexpected(path.error());
  return LoadScene{*path};
}

Result<AddObject> from(const v1::AddObject& m) {
  AddObject add;
  for (const auto& [key, text, needed, to] :
       {std::tuple{"name", &m.name(), true, &add.name}, std::tuple{"like", &m.like(), true, &add.like},
        std::tuple{"material", &m.material(), false, &add.material}}) {
    const auto good = checked_text(*text, key, needed);
    if (!good) return tl::make_unexpected(good.error());
    *to = *good;
  }
  if (!m.has_at()) return refused("at is missing: frame, position and orientation of the object");
  const auto pose = placed(m.at());
  if (!pose) return tl::make_unexpected(pose.error());
  add.in_world = *pose;
  add.moving = m.moving();
  return add;
}

Result<RemoveObject> from(const v1::RemoveObject& m) {
  const auto name = checked_text(m.object(), "object", true);
  if (!name) return tl::make_unexpected(name.error());
  return RemoveObject{*name};
}

Result<SetObject> from(const v1::SetObject& m) {
  SetObject set;
  const auto name = checked_text(m.object(), "object", true);
  if (!name) return tl::make_unexpected(name.error());
  set.object = *name;
  if (m.has_visible()) set.visible = m.visible().value();
  if (!m.has_at()) return set;
  const auto pose = placed(m.at());
  if (!pose) return tl::make_unexpected(pose.error());
  set.in_world = *pose;
  return set;
}

// If neither a vehicle nor an object is named, the only vehicle is meant, as with poses.
Result<SetTrajectory> from(const v1::SetTrajectory& m) {
  SetTrajectory set;
  const bool object = !m.object().empty();
  if (object && !m.vehicle().empty()) return refused("give a vehicle or an object, not both");
  const auto name = object ? checked_text(m.object(), "object", true) : checked_text(m.vehicle(), "vehicle", false);
  if (!name) return tl::make_unexpected(name.error());
  set.of = object ? PoseSample::Of::object : PoseSample::Of::vehicle;
  set.name = *name;
  if (m.has_paused()) set.paused = m.paused().value();
  if (m.has_position_s()) set.position_s = m.position_s().value();
  if (m.has_speed()) set.speed = m.speed().value();
  return set;
}

Result<StartRecording> from(const v1::StartRecording& m) {
  const auto file = checked_text(m.file(), "file", true);
  if (!file) return tl::make_unexpected(file.error());
  const auto sonar = checked_text(m.sonar(), "sonar", false);
  if (!sonar) return tl::make_unexpected(sonar.error());
  return StartRecording{*file, *sonar, m.labels()};
}

Result<StopRecording> from(const v1::StopRecording& m) {
  const auto file = checked_text(m.file(), "file", false);
  if (!file) return tl::make_unexpected(file.error());
  return StopRecording{*file};
}

Subscribe from(const v1::Subscribe& m) { return {m.pings(), m.clients(), m.poses(), m.scene(), m.faults()}; }

/// Returns a parameter of a fault as text. In JSON and protobuf it may be a number, a string or a boolean.
Result<std::string> text_from(const std::string& key, const google::protobuf::Value& value) {
  if (value.kind_case() == google::protobuf::Value::kStringValue) return checked_text(value.string_value(), key.c_str(), false);
  if (value.kind_case() == google::protobuf::Value::kBoolValue) return std::string(value.bool_value() ? "yes" : "no");
  if (value.kind_case() == google::protobuf::Value::kNumberValue) {
    std::array<char, 32> digits;
    const auto end = std::to_chars(digits.begin(), digits.end(), value.number_value(), std::chars_format::general, 12).ptr;
    return std::string(digits.begin(), end);
  }
  return refused("with." + key + " must be a number or a word");
}

// Only the form is checked here. daemon/config/faults, which also reads the configuration, checks kinds, parameters and times.
Result<AddFault> from(const v1::Fault& f) {
  FaultRecord record;
  for (const auto& [key, text, needed, to] :
       {std::tuple{"name", &f.name(), false, &record.name}, std::tuple{"do", &f.do_(), true, &record.what},
        std::tuple{"sonar", &f.sonar(), false, &record.sonar}, std::tuple{"client", &f.client(), false, &record.client},
        std::tuple{"at.on", &f.at().on(), false, &record.at.on}}) {
    const auto good = checked_text(*text, key, needed);
    if (!good) return tl::make_unexpected(good.error());
    *to = *good;
  }
  for (const auto& [key, value] : f.with()) {
    const auto name = checked_text(key, "a parameter of with", true);
    if (!name) return tl::make_unexpected(name.error());
    const auto text = text_from(key, value);
    if (!text) return tl::make_unexpected(text.error());
    record.with[key] = *text;
  }
  if (f.at().has_ping()) record.at.ping = f.at().ping().value();
  if (f.at().has_every()) record.at.every = f.at().every().value();
  record.at.phase = f.at().phase();
  if (f.at().has_time_s()) record.at.time_s = f.at().time_s().value();
  if (f.at().has_probability()) record.at.probability = f.at().probability().value();
  if (f.for_().has_seconds()) record.lasts.seconds = f.for_().seconds().value();
  if (f.for_().has_pings()) record.lasts.pings = f.for_().pings().value();
  if (f.for_().has_count()) record.lasts.count = f.for_().count().value();
  return AddFault{std::move(record)};
}

Result<EndFaults> from(const v1::EndFaults& m) {
  const auto name = checked_text(m.name(), "name", false);
  if (!name) return tl::make_unexpected(name.error());
  return EndFaults{*name};
}

using Operation = decltype(Request::op);

template <class Op>
Result<Operation> checked(Result<Op> op) {
  if (!op) return tl::make_unexpected(op.error());
  return Operation{*std::move(op)};
}

/// Returns the operation of a request; for an unknown operation, for example of a newer client, returns Unsupported, not an
/// error.
Result<Operation> operation_of(const v1::Request& message) {
  switch (message.op_case()) {
    case v1::Request::kHello:
      return Hello{message.hello().protocol_version(), message.hello().name(), message.hello().token()};
    case v1::Request::kStatus:
      return GetStatus{};
    case v1::Request::kLoad:
      return checked(from(message.load()));
    case v1::Request::kSonar:
      return checked(from(message.sonar()));
    case v1::Request::kEnvironment:
      return from(message.environment().environment());
    case v1::Request::kSubscribe:
      return from(message.subscribe());
    case v1::Request::kPose:
      return checked(with_checked_name(control::from(message.pose())));
    case v1::Request::kObject:
      return checked(with_checked_name(control::from(message.object())));
    case v1::Request::kAddObject:
      return checked(from(message.add_object()));
    case v1::Request::kRemoveObject:
      return checked(from(message.remove_object()));
    case v1::Request::kSetObject:
      return checked(from(message.set_object()));
    case v1::Request::kSetTrajectory:
      return checked(from(message.set_trajectory()));
    case v1::Request::kStep:
      return Step{message.step().dt_s()};
    case v1::Request::kStartRecording:
      return checked(from(message.start_recording()));
    case v1::Request::kStopRecording:
      return checked(from(message.stop_recording()));
    case v1::Request::kAddFault:
      return checked(from(message.add_fault()));
    case v1::Request::kEndFaults:
      return checked(from(message.end_faults()));
    case v1::Request::kFaults:
      return GetFaults{message.faults().kinds(), message.faults().journal_after()};
    case v1::Request::OP_NOT_SET:
      break;
  }
  return Unsupported{};
}

/// Converts a struct back to the message of its operation, for clients and tests.
struct FillRequest {
  v1::Request& out;
  void operator()(const Unsupported&) const {}
  void operator()(const Hello& op) const {
    out.mutable_hello()->set_protocol_version(op.protocol_version);
    out.mutable_hello()->set_name(op.name);
    out.mutable_hello()->set_token(op.token);
  }
  void operator()(const PoseSample& op) const {
    if (op.of == PoseSample::Of::vehicle)
      fill(*out.mutable_pose(), op);
    else
      fill(*out.mutable_object(), op);
  }
  void operator()(const GetStatus&) const { out.mutable_status(); }
  void operator()(const SetSonar& op) const {
    v1::SetSonar& m = *out.mutable_sonar();
    m.set_sonar(op.sonar);
    if (op.range_m) m.mutable_range_m()->set_value(*op.range_m);
    if (op.rate_hz) m.mutable_rate_hz()->set_value(*op.rate_hz);
    if (op.gain_percent) m.mutable_gain_percent()->set_value(*op.gain_percent);
    if (op.mode) m.mutable_mode()->set_value(*op.mode);
    if (op.beams) m.mutable_beams()->set_value(*op.beams);
    if (op.transmit) m.mutable_transmit()->set_value(*op.transmit);
    if (op.mount) fill(*m.mutable_mount(), *op.mount);
  }
  void operator()(const SetEnvironment& op) const {
    v1::Environment& m = *out.mutable_environment()->mutable_environment();
    if (op.temperature_c) m.mutable_temperature_c()->set_value(*op.temperature_c);
    if (op.salinity_psu) m.mutable_salinity_psu()->set_value(*op.salinity_psu);
    if (op.ph) m.mutable_ph()->set_value(*op.ph);
    if (op.sound_speed_mps) m.mutable_sound_speed_mps()->set_value(*op.sound_speed_mps);
  }
  void operator()(const LoadScene& op) const { out.mutable_load()->set_path(op.path); }
  void operator()(const AddObject& op) const {
    v1::AddObject& m = *out.mutable_add_object();
    m.set_name(op.name);
    m.set_like(op.like);
    m.set_material(op.material);
    fill(*m.mutable_at(), op.in_world);
    m.set_moving(op.moving);
  }
  void operator()(const RemoveObject& op) const { out.mutable_remove_object()->set_object(op.object); }
  void operator()(const SetObject& op) const {
    v1::SetObject& m = *out.mutable_set_object();
    m.set_object(op.object);
    if (op.visible) m.mutable_visible()->set_value(*op.visible);
    if (op.in_world) fill(*m.mutable_at(), *op.in_world);
  }
  void operator()(const SetTrajectory& op) const {
    v1::SetTrajectory& m = *out.mutable_set_trajectory();
    (op.of == PoseSample::Of::object ? *m.mutable_object() : *m.mutable_vehicle()) = op.name;
    if (op.paused) m.mutable_paused()->set_value(*op.paused);
    if (op.position_s) m.mutable_position_s()->set_value(*op.position_s);
    if (op.speed) m.mutable_speed()->set_value(*op.speed);
  }
  void operator()(const Step& op) const { out.mutable_step()->set_dt_s(op.dt_s); }
  void operator()(const StartRecording& op) const {
    out.mutable_start_recording()->set_file(op.file);
    out.mutable_start_recording()->set_sonar(op.sonar);
    out.mutable_start_recording()->set_labels(op.labels);
  }
  void operator()(const StopRecording& op) const { out.mutable_stop_recording()->set_file(op.file); }
  void operator()(const AddFault& op) const {
    v1::Fault& m = *out.mutable_add_fault();
    m.set_name(op.fault.name);
    m.set_do_(op.fault.what);
    for (const auto& [key, value] : op.fault.with) (*m.mutable_with())[key].set_string_value(value);
    m.set_sonar(op.fault.sonar);
    m.set_client(op.fault.client);
    const FaultRecord::At& at = op.fault.at;
    if (at.ping) m.mutable_at()->mutable_ping()->set_value(*at.ping);
    if (at.every) m.mutable_at()->mutable_every()->set_value(*at.every);
    if (at.phase != 0) m.mutable_at()->set_phase(at.phase);
    if (at.time_s) m.mutable_at()->mutable_time_s()->set_value(*at.time_s);
    if (at.probability) m.mutable_at()->mutable_probability()->set_value(*at.probability);
    if (!at.on.empty()) m.mutable_at()->set_on(at.on);
    const FaultRecord::For& lasts = op.fault.lasts;
    if (lasts.seconds) m.mutable_for_()->mutable_seconds()->set_value(*lasts.seconds);
    if (lasts.pings) m.mutable_for_()->mutable_pings()->set_value(*lasts.pings);
    if (lasts.count) m.mutable_for_()->mutable_count()->set_value(*lasts.count);
  }
  void operator()(const EndFaults& op) const { out.mutable_end_faults()->set_name(op.name); }
  void operator()(const GetFaults& op) const {
    out.mutable_faults()->set_kinds(op.kinds);
    out.mutable_faults()->set_journal_after(op.journal_after);
  }
  void operator()(const Subscribe& op) const {
    v1::Subscribe& m = *out.mutable_subscribe();
    m.set_pings(op.pings);
    m.set_clients(op.clients);
    m.set_poses(op.poses);
    m.set_scene(op.scene);
    m.set_faults(op.faults);
  }
};

}  // namespace

// The operation is read first, because its refusals are more helpful than "is NaN".
tl::expected<Request, RefusedRequest> from(const v1::Request& message) {
  const auto refused_here = [&](std::string why) {
    return tl::unexpected(RefusedRequest{message.id(), std::move(why), message.has_pose() || message.has_object()});
  };
  auto op = operation_of(message);
  if (!op) return refused_here(op.error().text);
  if (const auto where = first_unreal_number(message)) return refused_here(*where + " is NaN or infinite");
  return Request{message.id(), *std::move(op)};
}

void fill(v1::Request& out, const Request& request) {
  out.set_id(request.id);
  std::visit(FillRequest{out}, request.op);
  repair_texts(out);
}

}  // namespace sonar::control
