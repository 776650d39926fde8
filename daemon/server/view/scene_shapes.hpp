// Makes the messages of the scene's objects, with their meshes, for viewers: once, on the thread of the live view, and again
// when an object changes. All functions except make() are called on the I/O thread.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "core/scene/scene.hpp"
#include "daemon/emulator/view/viewer.hpp"
#include "daemon/emulator/world/world.hpp"

namespace sonar {

class SceneShapes {
 public:
  static constexpr std::size_t most_triangles = 2000000;  // larger objects are shown as their bounding box

  struct Job {
    std::shared_ptr<const Scene> scene;
    std::vector<std::size_t> objects;  // objects to make
    Time at{};
  };
  struct Made {
    std::string name;
    Object object;
    ViewBytes bytes;
  };
  /// Makes the messages; slow. May be called on any thread.
  static std::vector<Made> make(const Job& job);

  /// Compares the scene with that of the last call. Returns the pieces to offer, and sets `job` to the objects to make (empty
  /// while a job runs).
  std::vector<ViewPayload::Piece> update(const std::shared_ptr<const Scene>& scene, const World& world, Time now, Job& job);
  /// Returns the pieces to offer.
  std::vector<ViewPayload::Piece> take(std::vector<Made> made);
  /// Returns all pieces, for a new subscriber.
  std::vector<ViewPayload::Piece> all() const;
  void clear() { shown_.clear(); }

 private:
  struct Shown {
    Object object;
    ViewBytes bytes;
    bool visible = true;
  };
  std::map<std::string, Shown> shown_;
  bool under_way_ = false;
};

}  // namespace sonar
