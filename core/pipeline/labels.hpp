// Finds the object whose echo is in each sample. It computes the expected energy of each object with the same cells, columns,
// pulse and beams as the picture (docs/datasets.md). Multipath, crosstalk, defocus and echoes of the water have no labels.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/pipeline/ping_context.hpp"
#include "core/pipeline/scatter.hpp"
#include "core/pipeline/signals.hpp"
#include "core/pipeline/trace_fan.hpp"
#include "core/sonar/ping.hpp"

namespace sonar {

/// The reason why samples of such pings cannot have labels; empty if they can have labels.
std::string why_unlabelled(const PingRequest& request, const Scene& scene);
/// Labels of a ping that receives nothing.
PingLabels no_labels(const PingRequest& request, const Scene& scene);

/// Computes the labels of one ping. The object is kept from ping to ping for its buffers.
class LabelWork {
 public:
  /// `context`, `tiles` and `by_group` must live until finish().
  void begin(const PingContext& context, const std::vector<PreparedTile>& tiles,
             const std::vector<std::vector<std::uint32_t>>& by_group, int group_columns);
  /// Stores the shadows in columns [first, last), whose rays are in `fan`. Any thread may call it, once for each column.
  void note_shadows(const FanScratch& fan, int first, int last);
  /// Prepares the group that begins at `group.first_column`. Any thread may call it, once for each group.
  void begin_group(const simd::GroupView& group);
  /// Adds the energy of the echoes to the objects of their cells, and clears Echoes::runs. It may be called several times for a
  /// group.
  void add_cells(const simd::GroupView& group, Echoes& echoes);
  /// Spreads the energy over the pulse, and adds what labelled objects of the group would return if nothing hid them. Call it
  /// after the last add_cells().
  void finish_group(const simd::GroupView& group, Echoes& scratch);
  PingLabels finish(std::span<const PointEcho> points);

 private:
  /// An object within a group of columns.
  struct Part {
    std::size_t object = 0;
    int first_column = 0, columns = 0;
    int first_sample = 0, last_sample = 0;     // half-open
    int first_row = 0, rows = 0;               // multiples of `window`
    std::vector<float> power = {};             // [columns][rows], spread over the length of the pulse
    std::vector<double> seen = {}, open = {};  // energy of labelled objects, by column; `open`: if nothing hid them
  };
  struct Gap {  // samples of a column in the shadow of an object, with or without echoes
    float from = 0, to = 0;
    std::uint32_t object = 0;
  };
  struct Point;  // position and energy of an echo without a surface

  void spread(Part& part, const std::vector<float>& by_sample) const;
  static int row_of(double sample, int per_row);
  void keep_weights();
  void find_noise();
  double noise_of(int row, std::size_t beam) const;
  double half_width(std::size_t beam) const;
  void label_window(std::size_t window_index, std::span<const Point> points, PingLabels& out) const;
  void find_dark(int column);
  void find_shadows(int beam, PingLabels& out) const;

  static constexpr int window = 32;  // rows

  const PingContext* context_ = nullptr;
  const std::vector<PreparedTile>* tiles_ = nullptr;
  const std::vector<std::vector<std::uint32_t>>* by_group_ = nullptr;
  int group_columns_ = 1;
  BeamWeights weights_;  // weights of powers, for these columns and beams
  std::vector<double> beam_sine_;
  std::vector<std::pair<Taper, double>> beam_widths_;  // taper and aperture of each beam
  double first_sine_ = 0, spacing_ = 0;
  std::vector<float> pulse_;  // |p|^2 at whole samples, the peak in the middle
  struct Group {
    std::vector<Part> parts;                    // the first `used` belong to this ping; all keep their memory
    std::vector<std::vector<float>> by_sample;  // values of each part: [columns][samples], before the pulse
    std::size_t used = 0;
    std::vector<std::size_t> part_of;  // index into `parts`, by object; SIZE_MAX: none
    std::span<const Part> of_this_ping() const { return std::span(parts).first(used); }
  };
  std::vector<Group> groups_;
  std::vector<std::vector<Gap>> gaps_;          // by column
  std::vector<std::uint16_t> dark_;             // [columns][rows]: instance that casts the shadow; 0: no shadow, or an echo
  std::vector<float> nothing_;                  // a depth map in which nothing was hit
  std::vector<float> from_points_;              // [rows][beams]: power of point echoes in main lobes; empty without any
  std::vector<double> noise_far_, noise_near_;  // by beam [uPa^2]
};

}  // namespace sonar
