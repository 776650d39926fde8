// The area that contributes to one sample of a beam, from the beam's pattern and the pulse. A predicted level is the scattering
// strength times this area (docs/acoustics.md, sections 3 and 4).
#pragma once

#include "daemon/commands/render/render_job.hpp"

namespace sonar::render {

struct ResolutionCell {
  double beam_u = 0;         // theta_eff, the integral of W^2 over the direction's sine; 0 for the taper `unit`, which has none
  double energy_s = 0;       // tau_eff, the integral of |p|^2 over time
  double pulse_width_m = 0;  // -3 dB width in the device's metres: the settings', or a measured pulse's own
};
ResolutionCell cell_of(const RenderJob& job);

}  // namespace sonar::render
