// Last stage: computes the envelope, time-varied gain, range rows and quantised samples (docs/acoustics.md, section 7).
#pragma once

#include <vector>

#include "core/pipeline/ping_plan.hpp"
#include "core/pipeline/signals.hpp"
#include "core/sonar/ping.hpp"

namespace sonar {

/// Buffers of receive, one object for each worker.
struct ReceiveScratch {
  std::vector<float> power;  // [rows][beams rounded up]
  std::vector<float> codes;  // codes of a row
  std::vector<std::uint8_t> bytes;
};

/// Sets the sizes of the parts of the ping that receive() fills.
void shape_ping(const PingPlan& plan, const Switches& switches, Ping& ping);
/// Computes the rows in the window of `beams`. The window must begin and end on whole rows.
void receive(const BeamSignals& beams, const PingPlan& plan, const simd::Kernels& kernels, ReceiveScratch& scratch, Ping& ping);

}  // namespace sonar
