// The CPU engine for pings of many similar scenes, such as data sets.
#pragma once

#include <memory>

#include "core/pipeline/ping_engine.hpp"

namespace sonar {

class ChangingEngine : public PingEngine {
 public:
  /// Replaces the scene. It keeps the tables of the settings, and the trees and cells of meshes that both scenes share (the
  /// same object in memory, not only an equal one). The next pings equal those of a new engine.
  virtual void change_scene(const std::shared_ptr<const Scene>& scene) = 0;
};

/// Like make_cpu_engine().
std::unique_ptr<ChangingEngine> make_changing_engine(std::shared_ptr<const Scene> scene, Parallel& pool,
                                                     const EngineOptions& options = {});

}  // namespace sonar
