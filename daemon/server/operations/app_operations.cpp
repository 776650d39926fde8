#include "daemon/server/operations/app_operations.hpp"

#include <algorithm>
#include <utility>

#include "core/base/overloaded.hpp"
#include "core/text/format.hpp"
#include "daemon/config/config_parts.hpp"
#include "daemon/server/operations/operation_results.hpp"
#include "protocol/control/answers.hpp"

namespace sonar {
namespace {

OperationResult too_many_changes() { return failed("64 changes of the scene wait already"); }

/// True if the World handles the request: it places and hides moving objects, except objects that the scene hides.
bool is_the_worlds(const Scene& scene, const control::SetObject& asked) {
  const Object* const object = object_named(scene, asked.object);
  return body_named(scene, asked.object) >= 0 && (object == nullptr || object->visible || !asked.visible.value_or(false));
}

}  // namespace

void SceneOperations::log_change(const std::string& what, const Sender& sender) {
  log_.info("scene: " + what, {{"scene", changes_.scene()->name}, {"client", sender.id}});
  events_.publish_scene(config_.scene.name(), what);
}

/// Submits an edit, which is applied to the result of the earlier changes, and shares an engine with other waiting edits.
void SceneOperations::edit(Edit edit, const std::string& what, const Sender& sender, Operations::Done done) {
  if (changes_.is_full()) return done(too_many_changes());
  changes_.submit({[edit = std::move(edit)](const ScenePointer& now) { return edit(*now); },
                   [this, what, sender, done = std::move(done)](const Result<void>& outcome) {
                     if (outcome) log_change(what, sender);
                     done(result_of(outcome));
                   },
                   true});
}

void SceneOperations::add(const control::AddObject& asked, const Sender& sender, Operations::Done done) {
  edit([asked](const Scene& s) { return with_object(s, asked); }, "object " + asked.name + " added", sender, std::move(done));
}

void SceneOperations::remove(const control::RemoveObject& asked, const Sender& sender, Operations::Done done) {
  edit([name = asked.object](const Scene& s) { return without_object(s, name); }, "object " + asked.object + " removed", sender,
       std::move(done));
}

/// Looks up the name at once, so that a wrong name is refused without waiting for other changes.
void SceneOperations::load(const control::LoadScene& asked, const Sender& sender, Operations::Done done) {
  if (!load_scene_) return done(failed("this program cannot load scenes"));
  if (changes_.is_full()) return done(too_many_changes());
  const std::filesystem::path folder = std::filesystem::path(config_.source).parent_path();
  if (!has_scene_name(asked.path))
    return done(refused("\"" + asked.path.substr(0, 256) + "\" is not a scene: the names of scenes end in .yaml or .yml"));
  const auto file = find_scene(asked.path, folder);
  if (!file) return done(refused("no scene file \"" + asked.path.substr(0, 256) + "\"; looked in " + scene_folders(folder)));
  changes_.submit(
      {[load = load_scene_, file = *file](const ScenePointer&) { return load(file); },
       [this, file = *file, quoted = may_be_quoted(*file, folder), sender, done = std::move(done)](const Result<void>& outcome) {
         if (!outcome && !quoted) return done(without_details(outcome.error(), file, sender));
         if (outcome) {
           config_.scene = file;
           for (const std::string& note : changes_.scene()->notes) log_.info(note);
           log_change("loaded " + file.name(), sender);
         }
         done(result_of(outcome));
       }});
}

/// Removes details from an error, so that control clients do not get file contents; the log has the details.
OperationResult SceneOperations::without_details(const Error& error, const SceneFile& file, const Sender& sender) {
  log_.warning("scene not loaded: " + error.text, {{"client", sender.id}});
  OperationResult result = result_of(error);
  if (error.kind == ErrorKind::unavailable || error.kind == ErrorKind::bug) return result;  // the error does not quote the file
  result.text = file.name() + " could not be loaded: the scene file has errors, see sonard's log (docs/control.md)";
  return result;
}

/// Sets an object after the earlier changes, even if no engine must be built.
void SceneOperations::set(const control::SetObject& asked, const Sender& sender, Operations::Done done) {
  if (changes_.is_full()) return done(too_many_changes());
  auto finish = [this, asked, sender, done = std::move(done)](const Result<void>& outcome) {
    const int body = body_named(*changes_.scene(), asked.object);
    const OperationResult result =
        outcome && body >= 0 ? done_or_refused(poses_.place(asked, static_cast<std::size_t>(body), sender)) : result_of(outcome);
    if (result.code == OperationResult::Code::done)
      log_change("object " + asked.object + (asked.visible ? (*asked.visible ? " shown" : " hidden") : " moved"), sender);
    done(result);
  };
  if (!changes_.busy() && is_the_worlds(*changes_.scene(), asked)) return finish({});
  changes_.submit({[asked](const ScenePointer& now) -> Result<ScenePointer> {
                     if (is_the_worlds(*now, asked)) return now;
                     return with_object_set(*now, asked);
                   },
                   std::move(finish)});
}

Result<Device*> SonarOperations::find(const std::string& name) {
  std::list<Device>& sonars = fleet_.devices();
  Device* const device = name.empty() && sonars.size() == 1 ? &sonars.front() : fleet_.find(name);
  if (device != nullptr) return device;
  return failure(ErrorKind::usage,
                 (name.empty() ? std::string("name the sonar") : "no sonar is called \"" + name.substr(0, 64) + "\"") +
                     "; there are: " + text::joined(sonars, ", ", [](const Device& d) { return d.config().name; }));
}

OperationResult SonarOperations::set(const control::SetSonar& asked, const Sender& sender) {
  const auto device = find(asked.sonar);
  return device ? result_of((*device)->ask(asked, sender.id)) : result_of(device.error());
}

/// Changes the values that are set. All sonars are in the same water.
OperationResult SonarOperations::set(const control::SetEnvironment& asked, const Sender& sender) {
  Water water = config_.water;
  water.temperature_c = asked.temperature_c.value_or(water.temperature_c);
  water.salinity_psu = asked.salinity_psu.value_or(water.salinity_psu);
  water.ph = asked.ph.value_or(water.ph);
  water.sound_speed_mps = asked.sound_speed_mps.value_or(water.sound_speed_mps);
  if (std::string why = why_no_water(water, config_.allow_hot); !why.empty()) return refused(std::move(why));
  if (water == config_.water) return {};
  config_.water = water;
  for (Device& d : fleet_.devices()) d.use_water(water);
  log_.info(text::format("water: %g C, %g psu, pH %g, sound speed %s", water.temperature_c, water.salinity_psu, water.ph,
                         water.sound_speed_mps == 0 ? "computed" : std::to_string(water.sound_speed_mps).c_str()),
            {{"client", sender.id}});
  return {};
}

void SonarOperations::start(const control::StartRecording& asked, const Sender& sender, Operations::Done done) {
  const auto device = find(asked.sonar);
  if (!device) return done(result_of(device.error()));
  recordings_.start(asked, (*device)->recorded(), sender.id,
                    [done = std::move(done)](const Result<void>& outcome) { done(result_of(outcome)); });
}

void SonarOperations::stop(const control::StopRecording& asked, Operations::Done done) {
  recordings_.stop(asked, [done = std::move(done)](const Result<void>& outcome) { done(result_of(outcome)); });
}

/// Passes on a pose. If time follows the poses, the answer comes after the pings that the pose made possible have been sent, so
/// that a client that waits for answers runs in step with the sonars.
void TimeOperations::take(const control::PoseSample& sample, const Sender& sender, Operations::Done done) {
  std::string refusal = poses_.take(sample, sender);
  if (!refusal.empty()) return done(refused(std::move(refusal)));
  if (sample.of != control::PoseSample::Of::vehicle || !time_.follows_poses()) return done({});
  if (time_.is_full())
    return done(
        failed("the pose was accepted, but too many earlier poses wait for their pings, so this answer "
               "does not wait for the pings of the pose"));
  time_.wait([done = std::move(done)](Time, bool) { done({}); });
}

/// Advances time. The answer comes when the step is over, and has the number of pings since the previous answer. A client that
/// has shut down only its half of the connection still gets an answer.
void TimeOperations::step(const control::Step& asked, Operations::Done done, HasLeft has_left) {
  if (std::string why = time_.step(asked.dt_s); !why.empty()) return done(refused(std::move(why)));
  const auto reached = [this, done = std::move(done)](Time then, bool is_whole) {
    if (!is_whole)
      return done(
          failed(text::format("the step ended early, at %.9g s: its client closed the connection; keep it open until the "
                              "answer",
                              seconds(then.time_since_epoch()))));
    const std::uint64_t before = std::exchange(pings_reported_, pings_made());
    // If a reload removed a sonar, its pings are no longer counted.
    const std::uint64_t pings = pings_reported_ - std::min(before, pings_reported_);
    const auto stepped = std::make_shared<v1::Stepped>();
    stepped->set_now_ns(then.time_since_epoch().count());
    stepped->set_pings(pings);
    done({.stepped = stepped});
  };
  time_.wait(reached, std::move(has_left));
  on_change_();
}

std::uint64_t TimeOperations::pings_made() const {
  std::uint64_t made = 0;
  for (const Device& d : fleet_.devices()) made += d.sonar().pings();
  return made;
}

OperationResult TimeOperations::steer(const control::SetTrajectory& asked, const Sender& sender) {
  return done_or_refused(poses_.steer(asked, sender));
}

void AppOperations::perform(const control::Operation& operation, const Sender& sender, Done done, HasLeft has_left) {
  std::visit(Overloaded{[&](const control::GetStatus&) { done({.status = monitoring_.status()}); },
                        [&](const control::PoseSample& asked) { time_.take(asked, sender, std::move(done)); },
                        [&](const control::Step& asked) { time_.step(asked, std::move(done), std::move(has_left)); },
                        [&](const control::SetTrajectory& asked) { done(time_.steer(asked, sender)); },
                        [&](const control::SetSonar& asked) { done(sonars_.set(asked, sender)); },
                        [&](const control::SetEnvironment& asked) { done(sonars_.set(asked, sender)); },
                        [&](const control::StartRecording& asked) { sonars_.start(asked, sender, std::move(done)); },
                        [&](const control::StopRecording& asked) { sonars_.stop(asked, std::move(done)); },
                        [&](const control::LoadScene& asked) { scene_.load(asked, sender, std::move(done)); },
                        [&](const control::AddObject& asked) { scene_.add(asked, sender, std::move(done)); },
                        [&](const control::RemoveObject& asked) { scene_.remove(asked, sender, std::move(done)); },
                        [&](const control::SetObject& asked) { scene_.set(asked, sender, std::move(done)); },
                        [&](const control::AddFault& asked) { done(faults_.add(asked, sender)); },
                        [&](const control::EndFaults& asked) { done(faults_.end(asked, sender)); },
                        [&](const control::GetFaults& asked) { done(faults_.report(asked)); }},
             operation);
}

}  // namespace sonar
