// A material's scattering law at the frequency of a ping: the backscattering strength of a unit of surface for each cosine of
// incidence. Lambert's law needs one number. For other laws the kernels need a table (docs/acoustics.md, section 3).
#pragma once

#include <vector>

#include "core/pipeline/arithmetic/kernel_math.hpp"
#include "core/scene/scene.hpp"

namespace sonar {

struct LawTable {
  double mu = 0;            // 1/sr; with an empty table sigma_b = mu cos^2
  std::vector<float> root;  // sqrt(sigma_b / mu) over sqrt(1 - cosine), law_steps + 2 values; or empty

  const float* table() const { return root.empty() ? nullptr : root.data(); }
  /// sqrt(sigma_b / mu), cosine at least 0.
  float relative_root(float cosine) const { return root.empty() ? cosine : law_root(root.data(), cosine); }
  /// sqrt(sigma_b), cosine at least 0.
  float root_strength(float cosine) const;
};

/// A surface is smooth if its roughness k h [rad of phase] is below this limit. A smooth surface reflects a part of the energy
/// and scatters the rest.
inline constexpr double smooth_below_kh = 1.5;

/// sigma_b [1/sr] of a material at a frequency, cosine in [0, 1]. `specular`: true subtracts the reflected energy from the
/// diffuse part.
double scattering_strength(const Material& material, double cosine, double centre_hz, double sound_speed_mps, bool specular);
LawTable make_law(const Material& material, double centre_hz, double sound_speed_mps, bool specular);

}  // namespace sonar
