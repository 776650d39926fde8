// Response of a focused array to a signal that all its channels share with alternating signs. The response is a sum over the
// channels (docs/acoustics.md, eq. 47).
#pragma once

#include <cstddef>
#include <vector>

#include "core/sonar/sonar_model.hpp"

namespace sonar {

/// Computes the sums over channels of w_m (-1)^m e^{i 2 pi d / lambda}. Here d is the path from a point to channel m, minus the
/// path from the point to the array's middle. focus() sets the range of the point, and the point has the sine of the beam. Each
/// sum is over one part, a group of channels. Neighbouring groups overlap by half, and their w^2 add to 1 in every channel. The
/// last part contains all channels with equal weights.
///
/// Half a group is short, so its sum hardly changes with the sine, except for the delay of its middle. Therefore the sum is
/// computed at a few Chebyshev points of a segment of beams and interpolated. The error is 1e-5 of the largest value, like that
/// of rounded phases.
class FocusedArray {
 public:
  FocusedArray(const std::vector<double>& beam_sines, const SharedNoise& law);
  int parts() const { return parts_; }
  std::size_t beams() const { return u_.size(); }
  void focus(double range_in_wavelengths);
  /// The sums, [parts][2][beams], real and imaginary parts.
  const std::vector<float>& sums() const { return sums_; }
  /// The largest change of a channel's phase between two focal ranges, in turns.
  double turns_between(double range, double other_range) const;

 private:
  /// A segment of neighbouring beams, and the sines at which its sums are computed: the sines of the beams if there are few.
  struct Segment {
    std::size_t first_beam = 0, beams = 0, first_node = 0, nodes = 0, weights = 0;  // weights: index of [nodes][beams]
    bool is_direct() const { return nodes == beams; }
  };
  void lay_out_segments(double reach);
  void sum_at_nodes(int half, float range);
  void add_to_beams(int half, float range, const Segment& segment);
  double middle(int half) const;  // in wavelengths

  std::vector<float> u_, node_u_, weights_;
  std::vector<Segment> segments_;
  std::vector<float> sums_;     // [parts][2][beams]
  std::vector<float> at_node_;  // [weightings][2][nodes]
  std::vector<float> length_;   // buffer: path lengths to the middle of a half, then cosines and sines of a channel
  int channels_, half_, halves_, parts_;
  double d_;  // spacing of the channels, in wavelengths
  double widest_ = 0;
};

/// Chebyshev points of [from, to], and the weights that interpolate from these points to other places: [points][places].
std::vector<double> chebyshev_points(double from, double to, int count);
std::vector<double> chebyshev_weights(const std::vector<double>& points, const std::vector<double>& places);
/// Number of points for an error below about 5e-6 if the phase changes by `radians` on either side of the middle.
int chebyshev_count(double radians);

}  // namespace sonar
