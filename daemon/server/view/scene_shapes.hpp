// The objects of the scene as viewers get them, each with its mesh: made once on the thread of the live view, again when an
// object changes. Called on the I/O thread, except for make().
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
  static constexpr std::size_t most_triangles = 2000000;  // beyond it an object is its bounding box

  struct Job {
    std::shared_ptr<const Scene> scene;
    std::vector<std::size_t> objects;  // objects of the scene that are still to be made
    Time at{};
  };
  struct Made {
    std::string name;
    Object object;
    ViewBytes bytes;
  };
  /// Takes long; any thread.
  static std::vector<Made> make(const Job& job);

  /// Compares the scene with the last call: returns the pieces to offer, and in `job` what must be made, empty while a job is
  /// under way.
  std::vector<ViewPayload::Piece> update(const std::shared_ptr<const Scene>& scene, const World& world, Time now, Job& job);
  /// Pieces to offer.
  std::vector<ViewPayload::Piece> take(std::vector<Made> made);
  /// Everything that is shown, for a new subscriber.
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
