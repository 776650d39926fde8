#include "core/pipeline/focused_array.hpp"

#include <algorithm>
#include <cmath>

#include "core/base/geometry.hpp"
#include "core/pipeline/arithmetic/kernel_math.hpp"

namespace sonar {
namespace {

constexpr int weightings = 3;  // weightings of a half: rising, as in the first half of a group; falling; constant
constexpr double most_radians = 3.5, interpolation_error = 4e-6;
constexpr std::size_t most_beams = 128;  // limit for a segment

/// Adding this number and subtracting it again rounds to a whole number.
constexpr float whole = 12582912;

/// e^{i 2 pi turns}
inline void turn(float turns, float& cosine, float& sine) {
  const float part = turns - ((turns + whole) - whole);
  cosine = sine_of_quarter(0.25f - std::fabs(part));
  sine = std::copysign(sine_of_quarter(0.25f - std::fabs(std::fabs(part) - 0.25f)), part);  // no branches, for vector code
}

void add(double weight, const float* __restrict from, std::size_t count, float* __restrict to) {
  const auto w = static_cast<float>(weight);
  for (std::size_t j = 0; j < count; ++j) to[j] += w * from[j];
}

}  // namespace

int chebyshev_count(double radians) {
  // 2 J_n(x) is about 2 (x / 2)^n / n!.
  int count = 1;
  for (double error = radians; error > interpolation_error; error *= radians / 2 / count) ++count;
  return count;
}

std::vector<double> chebyshev_points(double from, double to, int count) {
  std::vector<double> points;
  for (int k = 0; k < count; ++k) points.push_back((from + to) / 2 + (to - from) / 2 * std::cos(pi * (k + 0.5) / count));
  return points;
}

std::vector<double> chebyshev_weights(const std::vector<double>& points, const std::vector<double>& places) {
  std::vector<double> weights;
  for (const double point : points)
    for (const double place : places) {
      double w = 1;
      for (const double other : points)
        if (other != point) w *= (place - other) / (point - other);
      weights.push_back(w);
    }
  return weights;
}

FocusedArray::FocusedArray(const std::vector<double>& beam_sines, const SharedNoise& law)
    : u_(beam_sines.begin(), beam_sines.end()),
      channels_(law.channels),
      half_(law.group / 2),
      halves_(law.channels / half_),
      parts_(halves_ + 2),
      d_(1 / (2 * static_cast<double>(law.sine))) {
  for (const double u : beam_sines) widest_ = std::max(widest_, std::abs(u));
  sums_.resize(2 * static_cast<std::size_t>(parts_) * u_.size());
  lay_out_segments((half_ - 1) / 2.0 * d_);
  at_node_.resize(2 * weightings * node_u_.size());
  length_.resize(3 * node_u_.size());
}

double FocusedArray::middle(int half) const { return (half * half_ + 0.5 * (half_ - 1) - 0.5 * (channels_ - 1)) * d_; }

/// `reach`: distance from the middle of a half to its last channel, in wavelengths.
void FocusedArray::lay_out_segments(double reach) {
  const auto radians = [&](double a, double b) {
    // Near the array the phase changes faster with the sine than far away, by the factor (1 - q u) / (1 - 2 q u + q^2)^3/2, q =
    // x / range.
    const double most = std::min(std::max(std::abs(a), std::abs(b)), 1.0);
    return pi * reach * std::abs(a - b) / std::max(1 - most * most, 1e-6);
  };
  for (std::size_t first = 0; first < u_.size();) {
    Segment s{first, 1, node_u_.size(), 0, weights_.size()};
    double low = static_cast<double>(u_[first]), high = low;
    while (first + s.beams < u_.size() && s.beams < most_beams) {
      const auto next = static_cast<double>(u_[first + s.beams]);
      if (radians(std::min(low, next), std::max(high, next)) > most_radians) break;
      low = std::min(low, next), high = std::max(high, next);
      ++s.beams;
    }
    const std::vector<double> places(u_.begin() + static_cast<std::ptrdiff_t>(first),
                                     u_.begin() + static_cast<std::ptrdiff_t>(first + s.beams));
    const int needed = chebyshev_count(radians(low, high));
    std::vector<double> nodes = places;
    if (static_cast<std::size_t>(needed) < s.beams) {
      nodes = chebyshev_points(low, high, needed);
      for (const double w : chebyshev_weights(nodes, places)) weights_.push_back(static_cast<float>(w));
    }
    s.nodes = nodes.size();
    for (const double u : nodes) node_u_.push_back(static_cast<float>(u));
    segments_.push_back(s);
    first += s.beams;
  }
}

double FocusedArray::turns_between(double range, double other_range) const {
  double most = 0;
  for (const double x : {-0.5 * channels_ * d_, 0.5 * channels_ * d_})
    for (const double u : {0.0, widest_}) {
      const auto delay = [&](double r) { return std::sqrt(std::max(r * r - 2 * r * x * u + x * x, 0.0)) - r; };
      most = std::max(most, std::abs(delay(range) - delay(other_range)));
    }
  return most;
}

void FocusedArray::sum_at_nodes(int half, float range) {
  const std::size_t nodes = node_u_.size();
  std::fill(at_node_.begin(), at_node_.end(), 0.0f);
  const auto x0 = static_cast<float>(middle(half));
  const float* __restrict u = node_u_.data();
  float* __restrict length0 = length_.data(), * __restrict cosine = length0 + nodes, * __restrict sine = cosine + nodes;
  for (std::size_t j = 0; j < nodes; ++j) length0[j] = std::sqrt(larger(range * range + x0 * (x0 - 2 * range * u[j]), 0));
  for (int i = 0; i < half_; ++i) {
    const double from_middle = (i - 0.5 * (half_ - 1)) * d_;
    const auto step = static_cast<float>(from_middle), x = static_cast<float>(middle(half) + from_middle);
    for (std::size_t j = 0; j < nodes; ++j) {
      const float length = std::sqrt(larger(range * range + x * (x - 2 * range * u[j]), 0));
      turn(step * (x + x0 - 2 * range * u[j]) / larger(length + length0[j], 1e-20f), cosine[j], sine[j]);
    }
    const double sign = (half * half_ + i) % 2 == 0 ? 1 : -1, way = pi / 2 * (i + 0.5) / half_;
    const double weight[weightings] = {sign * std::sin(way), sign * std::cos(way), sign};
    for (std::size_t w = 0; w < weightings; ++w) {
      add(weight[w], cosine, nodes, at_node_.data() + 2 * w * nodes);
      add(weight[w], sine, nodes, at_node_.data() + (2 * w + 1) * nodes);
    }
  }
}

void FocusedArray::add_to_beams(int half, float range, const Segment& s) {
  float carrier_re[most_beams], carrier_im[most_beams];
  const float* __restrict u = u_.data() + s.first_beam;
  const auto x = static_cast<float>(middle(half));
  for (std::size_t j = 0; j < s.beams; ++j) {
    const float beyond = x * (x - 2 * range * u[j]);
    turn(beyond / (std::sqrt(larger(range * range + beyond, 0)) + range), carrier_re[j], carrier_im[j]);
  }
  const int to_part[weightings] = {half + 1, half, parts_ - 1};
  for (int w = 0; w < weightings; ++w) {
    const float* node_re = at_node_.data() + 2 * static_cast<std::size_t>(w) * node_u_.size() + s.first_node;
    const float* node_im = node_re + node_u_.size();
    float re[most_beams] = {}, im[most_beams] = {};
    if (s.is_direct()) {
      std::copy(node_re, node_re + s.beams, re);
      std::copy(node_im, node_im + s.beams, im);
    } else {
      for (std::size_t k = 0; k < s.nodes; ++k) {
        const float* __restrict weight = weights_.data() + s.weights + k * s.beams;
        const float a = node_re[k], b = node_im[k];
        for (std::size_t j = 0; j < s.beams; ++j) {
          re[j] += weight[j] * a;
          im[j] += weight[j] * b;
        }
      }
    }
    float* __restrict to_re = sums_.data() + 2 * static_cast<std::size_t>(to_part[w]) * u_.size() + s.first_beam;
    float* __restrict to_im = to_re + u_.size();
    for (std::size_t j = 0; j < s.beams; ++j) {
      to_re[j] += re[j] * carrier_re[j] - im[j] * carrier_im[j];
      to_im[j] += re[j] * carrier_im[j] + im[j] * carrier_re[j];
    }
  }
}

void FocusedArray::focus(double range_in_wavelengths) {
  std::fill(sums_.begin(), sums_.end(), 0.0f);
  const auto range = static_cast<float>(range_in_wavelengths);
  for (int half = 0; half < halves_; ++half) {
    sum_at_nodes(half, range);
    for (const Segment& segment : segments_) add_to_beams(half, range, segment);
  }
}

}  // namespace sonar
