// Completes pings from the results that a batch has copied from the device.
#pragma once

#include "cuda/prepare_ping.hpp"

namespace sonar::cuda {

/// Adds the times of a batch's steps to the statistics of its pings, in equal shares.
void share_times(const StepSeconds& seconds, BatchRoom& room);
/// Completes a ping from its downloaded results.
void take_results(BatchRoom::Ping& from, const PingView& view);

}  // namespace sonar::cuda
