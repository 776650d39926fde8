// Makes a scene from another: adds, removes, hides or moves an object. Pure; SceneChanges calls these functions on its own
// thread. Unchanged objects keep their index in Scene::objects, and so their speckle and the coordinates of their rays. A removed
// object leaves an invisible object without a name; the next added object gets its index.
#pragma once

#include <memory>
#include <string_view>

#include "core/base/result.hpp"
#include "core/scene/scene.hpp"
#include "protocol/control/operations.hpp"

namespace sonar {

using ScenePointer = std::shared_ptr<const Scene>;

// Each returns the new scene, or an error (usage) with a sentence that names what the scene has.

Result<ScenePointer> with_object(const Scene& scene, const control::AddObject& wanted);
Result<ScenePointer> without_object(const Scene& scene, std::string_view name);
/// Hides, shows or moves a static object. A moving one is only hidden or shown, because the World has its poses.
Result<ScenePointer> with_object_set(const Scene& scene, const control::SetObject& wanted);

/// Returns the index of the moving body of that name, or -1.
int body_named(const Scene& scene, std::string_view name);
/// Returns the object of that name, or null.
const Object* object_named(const Scene& scene, std::string_view name);
/// Makes the error "there is no object ...; did you mean ...".
Error no_such_object(const Scene& scene, std::string_view name);

/// Returns whether both scenes give the same pings. Their names do not count.
bool is_same(const Scene& a, const Scene& b);

}  // namespace sonar
