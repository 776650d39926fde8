// The layer of bubbles that breaking waves leave under the surface. It adds absorption on the part of a path inside it
// (docs/acoustics.md, section 3).
#pragma once

#include <algorithm>
#include <cmath>

#include "core/pipeline/arithmetic/scattering.hpp"
#include "core/scene/scene.hpp"

namespace sonar {

struct BubbleLayer {
  double thickness_m = 0;    // from z = 0 down
  double loss_np_per_m = 0;  // one way

  BubbleLayer() = default;
  explicit BubbleLayer(const SeaSurface& sea) {
    if (!sea.present) return;
    thickness_m = static_cast<double>(sea.bubble_layer_m);
    loss_np_per_m = nepers_from_db(static_cast<double>(sea.bubble_loss_db_per_m));
  }
  bool present() const { return thickness_m > 0 && loss_np_per_m > 0; }

  /// Pressure factor e^{-2 b l} (docs/acoustics.md, eq. 16) for the way out and back along a straight path between two heights.
  double two_way(double from_z_m, double to_z_m, double path_m) const {
    const double low = std::min(from_z_m, to_z_m), high = std::max(from_z_m, to_z_m), bottom = -thickness_m;
    const double inside = high - low > 1e-6 ? std::clamp((high - bottom) / (high - low), 0.0, 1.0) : low > bottom ? 1.0 : 0.0;
    return std::exp(-2 * loss_np_per_m * path_m * inside);
  }
};

}  // namespace sonar
