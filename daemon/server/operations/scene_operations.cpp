#include "daemon/server/operations/scene_operations.hpp"

#include <utility>

#include "daemon/server/operations/operation_results.hpp"

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

}  // namespace sonar
