// Ground truth for a picture: the first hit of each beam, from rays that the picture needs, too.
#pragma once

#include <span>
#include <vector>

#include "core/pipeline/trace_fan.hpp"
#include "core/sonar/ping.hpp"

namespace sonar {

/// Half the -3 dB width of the two-way elevation pattern.
float truth_half_width_rad(const PingPlan& plan);

/// The nearest hit within the -3 dB elevation width of every column of [first, last), which `fan` has traced.
void note_first_hits(const FanScratch& fan, const PingPlan& plan, int first, int last, std::span<BeamTruth> by_column);
/// The same from the fixed fan's hits.
void note_first_hits(std::span<const FanHit> hits, const PingPlan& plan, std::span<BeamTruth> by_column);

/// Each beam gets the first hit of the column nearest to it.
std::vector<BeamTruth> truth_of_beams(const PingPlan& plan, std::span<const BeamTruth> by_column);

}  // namespace sonar
