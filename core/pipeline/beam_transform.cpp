// Class BeamTransformTables (core/pipeline/plan_tables.hpp): tables for forming all beams from all columns at once.
#include <algorithm>
#include <cmath>
#include <initializer_list>

#include "core/pipeline/plan_tables.hpp"

namespace sonar {
namespace {

// The convolution s_j = sum_k W(u_j - u_k) g_k over uniform columns is computed as a product of discrete Fourier transforms.
// The line of columns is padded to twice its length, so that the convolution does not wrap around. simd/transform.inl has the
// passes.
/// The smallest size of at least n whose only prime factors are 2 and 3.
int smooth_size(int n) {
  for (int size = std::max(n, 4);; ++size) {
    int rest = size;
    for (const int factor : {2, 3})
      while (rest % factor == 0) rest /= factor;
    if (rest == 1) return size;
  }
}

/// Appends the twiddle factors of a pass: e^{-j 2 pi i m / size} for i = 0 ... count - 1 and m = 1 ... most.
void append_twiddles(int size, int count, int most, std::vector<float>& turns) {
  for (int i = 0; i < count; ++i)
    for (int m = 1; m <= most; ++m) {
      const double angle = -2 * pi * static_cast<double>(static_cast<long>(i) * m % size) / size;
      turns.push_back(static_cast<float>(std::cos(angle)));
      turns.push_back(static_cast<float>(std::sin(angle)));
    }
}

/// Solves a x = b for a symmetric positive definite a, by Gaussian elimination without pivoting.
std::vector<double> solve(std::vector<double> a, std::vector<double> b) {
  const std::size_t n = b.size();
  for (std::size_t k = 0; k < n; ++k)
    for (std::size_t i = k + 1; i < n; ++i) {
      const double f = a[i * n + k] / a[k * n + k];
      for (std::size_t j = k; j < n; ++j) a[i * n + j] -= f * a[k * n + j];
      b[i] -= f * b[k];
    }
  for (std::size_t k = n; k-- > 0;) {
    for (std::size_t j = k + 1; j < n; ++j) b[k] -= a[k * n + j] * b[j];
    b[k] /= a[k * n + k];
  }
  return b;
}

/// Weights of `taps` values at 0, 1, ... that give the value at `place`, by least squares, for any signal whose spectrum lies
/// within +-band / 2 cycles per step.
std::vector<double> weights_between(int taps, double place, double band) {
  constexpr double ridge = 1e-13;  // oversampling, for which a few taps are enough, makes the matrix nearly singular
  std::vector<double> matrix, right;
  for (int a = 0; a < taps; ++a) {
    for (int b = 0; b < taps; ++b) matrix.push_back(sinc(band * (a - b)) + (a == b ? ridge : 0));
    right.push_back(sinc(band * (a - place)));
  }
  return solve(std::move(matrix), std::move(right));
}

}  // namespace

BeamTransformTables::BeamTransformTables(const ReceivePattern& pattern, const Columns& columns,
                                         const std::vector<double>& beam_sines) {
  // W at all distances of whole columns, du = d * spacing.
  lay_out(columns.count, static_cast<int>(beam_sines.size()));
  std::vector<double> of_distance;
  for (int d = 0; d < columns.count; ++d) of_distance.push_back(pattern(d * columns.spacing));
  transform_weights(of_distance);
  compute_interpolation(pattern.aperture_wavelengths * columns.spacing, columns, beam_sines);
  point_at_tables();
}

BeamTransformTables::BeamTransformTables(const std::vector<double>& of_distance) {
  const int count = static_cast<int>(of_distance.size());
  lay_out(count, count);
  transform_weights(of_distance);
  tables_.taps = 1;
  between_.assign(of_distance.size(), 1.0f);
  for (int j = 0; j < count; ++j) first_column_.push_back(j);
  point_at_tables();
}

void BeamTransformTables::lay_out(int columns, int beams) {
  tables_.columns = columns;
  tables_.beams = beams;
  tables_.quarter = smooth_size((columns + 1) / 2);
  plan_passes();
}

void BeamTransformTables::point_at_tables() {
  tables_.split = split_.data();
  tables_.response = response_.data();
  tables_.first_column = first_column_.data();
  tables_.between = between_.data();
}

void BeamTransformTables::plan_passes() {
  append_twiddles(4 * tables_.quarter, tables_.quarter, 3, split_);
  // The last pass has no factors and is combined with the first inverse pass. Radix 4 needs the fewest operations per value.
  // Radix 6 replaces passes of 2 and 3, because loads and stores limit the speed of every pass.
  const auto largest = [](int size, std::initializer_list<int> radices) {
    return *std::find_if(radices.begin(), radices.end(), [&](int radix) { return size % radix == 0; });
  };
  const int last = largest(tables_.quarter, {4, 3, 2});
  for (int size = tables_.quarter; size > 1;) {
    const int radix = size == last ? last : largest(size / last, {4, 6, 3, 2});
    append_twiddles(size, size / radix, radix - 1, turns_.emplace_back());
    tables_.level[tables_.levels++] = {radix, size, nullptr};
    size /= radix;
  }
  for (int l = 0; l < tables_.levels; ++l) tables_.level[l].turns = turns_[static_cast<std::size_t>(l)].data();
}

/// Computes the transform of the weights, which is real because the weights are symmetric. Distances beyond
/// those in `of_distance` do not occur.
void BeamTransformTables::transform_weights(const std::vector<double>& of_distance) {
  const int size = 4 * tables_.quarter;
  std::vector<double> cosine, weight;
  for (int i = 0; i < size; ++i) cosine.push_back(std::cos(2 * pi * i / size));
  // W is even: its transform is W_0 + 2 sum_d W_d cos(2 pi d f / size).
  for (std::size_t d = 0; d < of_distance.size(); ++d) weight.push_back(of_distance[d] * (d == 0 ? 1 : 2));
  response_.resize(static_cast<std::size_t>(size));
  for (int place = 0; place < tables_.quarter; ++place) {
    // The passes leave the frequencies in mixed-radix digit-reversed order. The response is stored in the same order.
    int frequency = 0, step = 1, rest = place;
    for (int l = 0; l < tables_.levels; ++l) {
      const int part = tables_.level[l].size / tables_.level[l].radix;
      frequency += step * (rest / part);
      rest %= part;
      step *= tables_.level[l].radix;
    }
    // Computes four sums at once, because each addition waits for the last one of the same sum.
    double sum[4] = {};
    int turn[4] = {};  // d * frequency, modulo size
    for (const double w : weight)
      for (int k = 0; k < 4; ++k) {
        sum[k] += w * cosine[static_cast<std::size_t>(turn[k])];
        turn[k] += 4 * frequency + k;
        turn[k] -= turn[k] < size ? 0 : size;
      }
    for (int k = 0; k < 4; ++k)
      response_[static_cast<std::size_t>(k * tables_.quarter + place)] = static_cast<float>(sum[k] / size);
  }
}

void BeamTransformTables::compute_interpolation(double aperture_in_spacings, const Columns& columns,
                                                const std::vector<double>& beam_sines) {
  const auto place_of = [&](double sine) { return (columns.first_sine - sine) / columns.spacing; };
  const bool on_columns = std::all_of(beam_sines.begin(), beam_sines.end(),
                                      [&](double sine) { return std::abs(place_of(sine) - std::round(place_of(sine))) < 1e-6; });
  // Beams between columns are interpolated with the fewest taps that have the accuracy stated in the header.
  tables_.taps = on_columns ? 1 : aperture_in_spacings < 0.25 ? 8 : 10;
  for (const double sine : beam_sines) {
    const double place = place_of(sine);
    const int first = on_columns ? static_cast<int>(std::lround(place))
                                 : std::clamp(static_cast<int>(std::floor(place)) - tables_.taps / 2 + 1, 0,
                                              std::max(0, columns.count - tables_.taps));
    first_column_.push_back(first);
    if (on_columns)
      between_.push_back(1);
    else
      for (const double w : weights_between(tables_.taps, place - first, aperture_in_spacings))
        between_.push_back(static_cast<float>(w));
  }
}

std::size_t BeamTransformTables::bytes() const {
  std::size_t floats = split_.capacity() + response_.capacity() + between_.capacity();
  for (const auto& turns : turns_) floats += turns.capacity();
  return sizeof(float) * floats + sizeof(std::int32_t) * first_column_.capacity();
}

double BeamTransformTables::cost() const {
  // Number of operations in simd/transform.inl: two transforms, the product, and the interpolation of the beams.
  const double q = tables_.quarter;
  double pass = 0;
  for (int l = 0; l < tables_.levels; ++l) pass += q * (tables_.level[l].radix == 4 ? 7 : tables_.level[l].radix == 2 ? 4 : 9);
  return 4 * (2 * pass + 2 * q) + 40 * q + 2.0 * tables_.taps * tables_.beams;
}

}  // namespace sonar
