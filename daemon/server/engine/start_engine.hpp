// Builds the ping engine, and converts the exceptions of a ray tracer that does not work on this computer or with this scene to
// an error in one sentence.
#pragma once

#include <functional>
#include <memory>

#include "core/base/result.hpp"
#include "core/pipeline/ping_engine.hpp"

namespace sonar {

using EngineFactory = std::function<std::unique_ptr<PingEngine>(std::shared_ptr<const Scene>)>;

/// Builds the engine. Error unavailable: not enough memory, or a processor that the ray tracer does not support. Does not catch
/// std::logic_error, which is a bug of sonard.
Result<std::unique_ptr<PingEngine>> start_engine(const EngineFactory& make, std::shared_ptr<const Scene> scene);

}  // namespace sonar
