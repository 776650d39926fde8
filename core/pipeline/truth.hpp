// Ground truth for a picture: the first hit of each beam, from the rays that were traced for the picture.
#pragma once

#include <span>
#include <vector>

#include "core/pipeline/trace_fan.hpp"
#include "core/sonar/ping.hpp"

namespace sonar {

/// Half the -3 dB width of the two-way elevation pattern.
float truth_half_width_rad(const PingPlan& plan);

/// Finds the nearest hit within the -3 dB elevation width in every column of [first, last). `fan` has traced these columns.
void note_first_hits(const FanScratch& fan, const PingPlan& plan, int first, int last, std::span<BeamTruth> by_column);
/// Does the same with the hits of a fixed fan.
void note_first_hits(std::span<const FanHit> hits, const PingPlan& plan, std::span<BeamTruth> by_column);

/// Gives each beam the first hit of the column nearest to it.
std::vector<BeamTruth> truth_of_beams(const PingPlan& plan, std::span<const BeamTruth> by_column);

}  // namespace sonar
