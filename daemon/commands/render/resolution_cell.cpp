#include "daemon/commands/render/resolution_cell.hpp"

#include "core/pipeline/arithmetic/beam_pattern.hpp"
#include "core/pipeline/pulses/pulse.hpp"

namespace sonar::render {

ResolutionCell cell_of(const RenderJob& job) {
  const BeamPattern& pattern = job.mode().pattern;
  const double one_way_mps = 0.5 * static_cast<double>(job.settings.device_sound_speed_mps);
  const Pulse pulse(job.mode().waveform, static_cast<double>(job.settings.pulse_width_m) / one_way_mps);
  ResolutionCell cell;
  cell.energy_s = pulse.energy_width_s();
  cell.pulse_width_m = pulse.width_s() * one_way_mps;
  if (pattern.azimuth_taper != Taper::unit)
    cell.beam_u = effective_beam_width_u(
        pattern.azimuth_taper, aperture_in_wavelengths(pattern.azimuth_taper, static_cast<double>(pattern.azimuth_width_rad)));
  return cell;
}

}  // namespace sonar::render
