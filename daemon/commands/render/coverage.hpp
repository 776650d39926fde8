// Compares every bin of a rendered flat bed, in expected power, with the closed form of its level (docs/acoustics.md, section 3),
// which includes the beams' patterns. `sonard render --report coverage` prints the result.
#pragma once

#include <cstddef>
#include <vector>

#include "core/base/result.hpp"
#include "daemon/commands/render/render_job.hpp"

namespace sonar::render {

// The area that contributes to one sample of a beam, from the beam's pattern and the pulse. A predicted level is the scattering
// strength times this area (docs/acoustics.md, sections 3 and 4).

struct ResolutionCell {
  double beam_u = 0;         // theta_eff, the integral of W^2 over the direction's sine; 0 for the taper `unit`
  double energy_s = 0;       // tau_eff, the integral of |p|^2 over time
  double pulse_width_m = 0;  // -3 dB width in the device's metres, from the settings or of the measured pulse
};
ResolutionCell cell_of(const RenderJob& job);

struct Coverage {
  std::size_t bins = 0, good = 0;  // all compared bins; bins within 1 dB
  std::size_t empty = 0;           // bins that are 10 dB or more below the closed form
  double worst_db = 0;             // the largest deviation of a bin, signed
  double mean_db = 0;              // mean ratio of the power of a bin to its closed form
  double percent() const { return bins == 0 ? 0 : 100.0 * static_cast<double>(good) / static_cast<double>(bins); }
};

/// Returns the job with only the parts of the closed form: expected power, no noise, mirrors, texture, volume or motion. In
/// expected power surface cells are smaller (0.4 of the edge) than for pictures, so coverage does not measure the cells of
/// pictures.
RenderJob with_bed_only(RenderJob job);

/// Counts the bins; `ping` must come from with_bed_only(job). A bin counts if its whole footprint, plus two pulses and a beam on
/// either side, lies on the bed and the two-way pattern there is above -20 dB, because the closed form assumes an even pattern
/// over the footprint. Errors: no level plane below the sonar, a sonar that rolls, flat beams, the comparison modes, beams
/// without a width.
Result<Coverage> measure_coverage(const RenderJob& job, const Ping& ping);

/// Returns a job with the product over a level bed: the sonar's height is a fifth of the range, and it points down by 0.25 rad.
RenderJob over_a_level_bed(std::shared_ptr<const SonarModel> model, const PingSettings& settings, const std::string& name);
/// Returns jobs over a level bed for the acoustically different modes of all products without range images, at the stored range
/// of the product or, if shorter, the longest range of the mode.
std::vector<RenderJob> shipped_sonars_over_a_bed();

}  // namespace sonar::render
