// Scenes made from scenes: with an object more, less, hidden or elsewhere. Pure; SceneChanges calls them on its own thread.
// What is not changed keeps its place in Scene::objects and so its speckle, and its rays' coordinates: an object that is removed
// leaves an invisible place without a name, which the next one added takes.
#pragma once

#include <memory>
#include <string_view>

#include "core/base/result.hpp"
#include "core/scene/scene.hpp"
#include "protocol/control/operations.hpp"

namespace sonar {

using ScenePointer = std::shared_ptr<const Scene>;

// Each refuses with one sentence that names what the scene has (usage), and then nothing is changed.

Result<ScenePointer> with_object(const Scene& scene, const control::AddObject& wanted);
Result<ScenePointer> without_object(const Scene& scene, std::string_view name);
/// Hides, shows or moves an object that stands still. A moving one is only hidden or shown; its poses are the World's.
Result<ScenePointer> with_object_set(const Scene& scene, const control::SetObject& wanted);

/// The moving body of that name, or -1.
int body_named(const Scene& scene, std::string_view name);
/// The object of that name, or null.
const Object* object_named(const Scene& scene, std::string_view name);
/// "there is no object ...; did you mean ...".
Error no_such_object(const Scene& scene, std::string_view name);

/// Whether pings of both are the same, whatever the scenes are called.
bool is_same(const Scene& a, const Scene& b);

}  // namespace sonar
