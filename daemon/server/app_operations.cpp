#include "daemon/server/app_operations.hpp"

#include <cstdio>
#include <utility>

#include "daemon/config/config_parts.hpp"

namespace sonar {
namespace {

OperationResult refused(std::string text) { return {OperationResult::Code::refused, std::move(text), {}}; }
OperationResult result_of(const Error& error) {
  // What the asker got wrong is of these kinds; the rest is our trouble.
  const bool askers = error.kind == ErrorKind::usage || error.kind == ErrorKind::config;
  return {askers ? OperationResult::Code::refused : OperationResult::Code::failed, error.text, {}};
}
OperationResult result_of(const Result<void>& outcome) { return outcome ? OperationResult{} : result_of(outcome.error()); }

std::filesystem::path folder_of(const Config& config) { return std::filesystem::path(config.source).parent_path(); }

/// The scene there is when its turn comes, changed.
auto on_scene(std::function<Result<ScenePointer>(const Scene&)> edit) {
  return [edit = std::move(edit)](const ScenePointer& now) { return edit(*now); };
}

/// Moving objects are placed and hidden by the World, unless the scene itself hides this one.
bool is_the_worlds(const Scene& scene, const control::SetObject& asked) {
  const Object* const object = object_named(scene, asked.object);
  return body_named(scene, asked.object) >= 0 && (object == nullptr || object->visible || !asked.visible.value_or(false));
}

}  // namespace

void AppOperations::perform(const control::Operation& operation, const Sender& sender, Done done) {
  if (std::holds_alternative<control::GetStatus>(operation)) {
    done({OperationResult::Code::done, {}, status()});
  } else if (const auto* sample = std::get_if<control::PoseSample>(&operation)) {
    take(*sample, sender, std::move(done));
  } else if (const auto* asked = std::get_if<control::Step>(&operation)) {
    step(*asked, std::move(done));
  } else if (const auto* sonar = std::get_if<control::SetSonar>(&operation)) {
    done(carry_out(*sonar, sender));
  } else if (const auto* environment = std::get_if<control::SetEnvironment>(&operation)) {
    done(carry_out(*environment, sender));
  } else if (const auto* trajectory = std::get_if<control::SetTrajectory>(&operation)) {
    done(carry_out(*trajectory, sender));
  } else if (const auto* scene = std::get_if<control::LoadScene>(&operation)) {
    load(*scene, sender, std::move(done));
  } else if (const auto* start_of = std::get_if<control::StartRecording>(&operation)) {
    start(*start_of, sender, done);
  } else if (const auto* stop_of = std::get_if<control::StopRecording>(&operation)) {
    parts_.recordings.stop(*stop_of, [done = std::move(done)](const Result<void>& outcome) { done(result_of(outcome)); });
  } else if (const auto* added = std::get_if<control::AddObject>(&operation)) {
    edit([a = *added](const Scene& s) { return with_object(s, a); }, "object " + added->name + " added", sender, std::move(done));
  } else if (const auto* removed = std::get_if<control::RemoveObject>(&operation)) {
    edit([name = removed->object](const Scene& s) { return without_object(s, name); }, "object " + removed->object + " removed",
         sender, std::move(done));
  } else {
    set(std::get<control::SetObject>(operation), sender, std::move(done));
  }
}

// ---- poses and time

/// Where time follows the poses, the answer comes when the pings are out that this one made possible: who waits for it runs in
/// step with the sonars.
void AppOperations::take(const control::PoseSample& sample, const Sender& sender, Done done) {
  const std::string refusal = parts_.poses.take(sample, sender);
  if (!refusal.empty()) return done(refused(refusal));
  if (sample.of != control::PoseSample::Of::vehicle || parts_.config.clock != ClockMode::follow) return done({});
  if (parts_.time.is_full())
    return done(
        {OperationResult::Code::failed, "the pose counts, but too many wait for their pings already to wait for these", {}});
  parts_.time.wait([done = std::move(done)](Time) { done({}); });
}

void AppOperations::step(const control::Step& asked, Done done) {
  if (const std::string why = parts_.time.step(asked.dt_s); !why.empty()) return done(refused(why));
  parts_.time.wait([this, done = std::move(done)](Time then) {
    const std::uint64_t told = std::exchange(pings_told_, pings_made());
    // A sonar that a reload took away took its pings along.
    const std::uint64_t pings = pings_told_ - std::min(told, pings_told_);
    done({OperationResult::Code::done, {}, control::Stepped{then.time_since_epoch().count(), pings}});
  });
  parts_.on_change();
}

std::uint64_t AppOperations::pings_made() const {
  std::uint64_t made = 0;
  for (const Device& d : parts_.fleet.devices()) made += d.sonar().pings();
  return made;
}

// ---- sonars and water

Result<Device*> AppOperations::sonar_called(const std::string& name) const {
  std::list<Device>& sonars = parts_.fleet.devices();
  Device* const device = name.empty() && sonars.size() == 1 ? &sonars.front() : parts_.fleet.find(name);
  if (device != nullptr) return device;
  std::string names;
  for (const Device& d : sonars) names += (names.empty() ? "" : ", ") + d.config().name;
  return failure(ErrorKind::usage,
                 (name.empty() ? std::string("say which sonar") : "no sonar is called \"" + name.substr(0, 64) + "\"") +
                     "; there are: " + names);
}

OperationResult AppOperations::carry_out(const control::SetSonar& asked, const Sender& sender) {
  const auto device = sonar_called(asked.sonar);
  return device ? result_of((*device)->ask(asked, sender.id)) : result_of(device.error());
}

void AppOperations::start(const control::StartRecording& asked, const Sender& sender, const Done& done) {
  const auto device = sonar_called(asked.sonar);
  if (!device) return done(result_of(device.error()));
  parts_.recordings.start(asked, (*device)->recorded(), sender.id,
                          [done](const Result<void>& outcome) { done(result_of(outcome)); });
}

OperationResult AppOperations::carry_out(const control::SetEnvironment& asked, const Sender& sender) {
  Water water = parts_.config.water;
  water.temperature_c = asked.temperature_c.value_or(water.temperature_c);
  water.salinity_psu = asked.salinity_psu.value_or(water.salinity_psu);
  water.ph = asked.ph.value_or(water.ph);
  water.sound_speed_mps = asked.sound_speed_mps.value_or(water.sound_speed_mps);
  if (const std::string why = why_no_water(water, parts_.config.allow_hot); !why.empty()) return refused(why);
  if (water == parts_.config.water) return {};
  parts_.config.water = water;
  for (Device& d : parts_.fleet.devices()) d.use_water(water);
  char text[96];
  std::snprintf(text, sizeof text, "water: %g C, %g psu, pH %g, sound speed %s", water.temperature_c, water.salinity_psu,
                water.ph, water.sound_speed_mps == 0 ? "computed" : std::to_string(water.sound_speed_mps).c_str());
  parts_.log.info(text, {{"client", sender.id}});
  return {};
}

OperationResult AppOperations::carry_out(const control::SetTrajectory& asked, const Sender& sender) {
  if (const std::string why = parts_.world.steer(asked, parts_.clock.now()); !why.empty()) return refused(why);
  std::string text = "trajectory" + (asked.name.empty() ? std::string() : " of " + asked.name) + ":";
  if (asked.position_s) text += " at " + std::to_string(*asked.position_s) + " s";
  if (asked.speed) text += " speed " + std::to_string(*asked.speed);
  if (asked.paused) text += *asked.paused ? " paused" : " playing";
  parts_.log.info(text, {{"client", sender.id}});
  return {};
}

// ---- the scene

void AppOperations::say_change(const std::string& what, const Sender& sender) {
  parts_.log.info("scene: " + what, {{"scene", parts_.changes.scene()->name}, {"client", sender.id}});
  if (parts_.events.heard()) parts_.events.tell({control::SceneEvent{parts_.config.scene.name(), what}});
}

void AppOperations::edit(Edit edit, const std::string& what, const Sender& sender, Done done) {
  if (parts_.changes.is_full()) return done({OperationResult::Code::failed, "64 changes of the scene wait already", {}});
  parts_.changes.submit({on_scene(std::move(edit)), [this, what, sender, done = std::move(done)](const Result<void>& outcome) {
                           if (outcome) say_change(what, sender);
                           done(result_of(outcome));
                         }});
}

void AppOperations::load(const control::LoadScene& asked, const Sender& sender, Done done) {
  if (!parts_.load_scene) return done({OperationResult::Code::failed, "this program cannot load scenes", {}});
  if (parts_.changes.is_full()) return done({OperationResult::Code::failed, "64 changes of the scene wait already", {}});
  const std::filesystem::path folder = folder_of(parts_.config);
  if (!has_scene_name(asked.path))
    return done(refused("\"" + asked.path.substr(0, 256) + "\" is not a scene: their names end in .yaml or .yml"));
  const auto file = find_scene(asked.path, folder);
  if (!file) return done(refused("no scene file \"" + asked.path.substr(0, 256) + "\"; looked in " + scene_folders(folder)));
  parts_.changes.submit(
      {[load = parts_.load_scene, file = *file](const ScenePointer&) { return load(file); },
       [this, file = *file, quoted = may_be_quoted(*file, folder), sender, done = std::move(done)](const Result<void>& outcome) {
         if (!outcome && !quoted) return done(without_words(outcome.error(), file, sender));
         if (outcome) {
           parts_.config.scene = file;
           for (const std::string& note : parts_.changes.scene()->notes) parts_.log.info(note);
           say_change("loaded " + file.name(), sender);
         }
         done(result_of(outcome));
       }});
}

/// Does not return file contents to control clients: the details go to the log.
OperationResult AppOperations::without_words(const Error& error, const SceneFile& file, const Sender& sender) {
  parts_.log.warning("scene not loaded: " + error.text, {{"client", sender.id}});
  OperationResult result = result_of(error);
  if (error.kind == ErrorKind::unavailable || error.kind == ErrorKind::bug) return result;  // says nothing of the file
  result.text = file.name() + " could not be loaded: the scene file has errors, see sonard's log (docs/control.md)";
  return result;
}

/// Its turn comes after the changes before, also where nothing is to be built.
void AppOperations::set(const control::SetObject& asked, const Sender& sender, Done done) {
  if (parts_.changes.is_full()) return done({OperationResult::Code::failed, "64 changes of the scene wait already", {}});
  auto finish = [this, asked, sender, done = std::move(done)](const Result<void>& outcome) {
    const int body = body_named(*parts_.changes.scene(), asked.object);
    const OperationResult result =
        outcome && body >= 0 ? set_moving(asked, static_cast<std::size_t>(body), sender) : result_of(outcome);
    if (result.code == OperationResult::Code::done)
      say_change("object " + asked.object + (asked.visible ? (*asked.visible ? " shown" : " hidden") : " moved"), sender);
    done(result);
  };
  if (!parts_.changes.busy() && is_the_worlds(*parts_.changes.scene(), asked)) return finish({});
  parts_.changes.submit({[asked](const ScenePointer& now) -> Result<ScenePointer> {
                           if (is_the_worlds(*now, asked)) return now;
                           return with_object_set(*now, asked);
                         },
                         std::move(finish)});
}

OperationResult AppOperations::set_moving(const control::SetObject& asked, std::size_t body, const Sender& sender) {
  const bool hidden = !asked.visible.value_or(!parts_.world.is_hidden(body));
  if (asked.in_world) {
    control::PoseSample sample;
    sample.of = control::PoseSample::Of::object;
    sample.name = asked.object;
    sample.pose = *asked.in_world;
    sample.velocity_mps = sample.angular_velocity_radps = Vec3d{};  // it is put there: that is no movement to carry on
    sample.reset_counter = ++placements_;
    const std::string refusal = parts_.poses.take(sample, sender);
    if (!refusal.empty()) return refused(refusal);
  }
  parts_.world.hide(body, hidden);
  return {};
}

}  // namespace sonar
