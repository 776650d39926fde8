// Builds the ping engine. A ray tracer that does not work on this computer or with this scene throws here. `sonard run` and
// `sonard_bench` use this, so that such a failure is one sentence and not "a bug".
#pragma once

#include <functional>
#include <memory>

#include "core/base/result.hpp"
#include "core/pipeline/ping_engine.hpp"

namespace sonar {

using EngineFactory = std::function<std::unique_ptr<PingEngine>(std::shared_ptr<const Scene>)>;

/// Unavailable (69): not enough memory, a processor the ray tracer cannot use. Mistakes of ours (std::logic_error) pass through.
Result<std::unique_ptr<PingEngine>> start_engine(const EngineFactory& make, std::shared_ptr<const Scene> scene);

}  // namespace sonar
