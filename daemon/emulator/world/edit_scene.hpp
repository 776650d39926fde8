// Makes a scene from another: adds, removes, hides or moves an object. SceneChanges calls these functions on its own thread.
// Unchanged objects keep their index in Scene::objects, so their speckle and rays do not change. A removed object is replaced by
// an invisible object without a name; the next added object gets that index.
#pragma once

#include <memory>
#include <string_view>

#include "core/base/result.hpp"
#include "core/scene/scene.hpp"
#include "protocol/control/operations.hpp"

namespace sonar {

using ScenePointer = std::shared_ptr<const Scene>;

// Each function returns the new scene, or an error (usage) that lists the objects of the scene.

Result<ScenePointer> with_object(const Scene& scene, const control::AddObject& wanted);
Result<ScenePointer> without_object(const Scene& scene, std::string_view name);
/// Hides, shows or moves a static object. A moving object can only be hidden or shown, because the World has its poses.
Result<ScenePointer> with_object_set(const Scene& scene, const control::SetObject& wanted);

/// Returns the index of the moving body with this name, or -1.
int body_named(const Scene& scene, std::string_view name);
/// Returns the object with this name, or null.
const Object* object_named(const Scene& scene, std::string_view name);
/// Makes the error "there is no object ...; did you mean ...".
Error no_such_object(const Scene& scene, std::string_view name);

/// True if both scenes give the same pings; the scenes' names are not compared.
bool is_same(const Scene& a, const Scene& b);

}  // namespace sonar
