#include "daemon/emulator/faults/alter_message.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <utility>

#include "core/sonar/ping.hpp"
#include "core/sonar/range_image.hpp"

namespace sonar {
namespace {

/// The samples as codes, [rows][beams].
class Image {
 public:
  explicit Image(Ping& ping)
      : ping_(ping),
        width_(static_cast<std::size_t>(ping.request.settings.format.bits) / 8),
        beams_(ping.beam_azimuth_rad.size()),
        rows_(beams_ == 0 ? 0 : ping.samples.size() / (width_ * beams_)) {}

  std::size_t rows() const { return rows_; }
  std::size_t beams() const { return beams_; }
  std::uint32_t full() const { return ping_.request.settings.format.max_code; }
  std::uint32_t get(std::size_t row, std::size_t beam) const { return sample_code(ping_.samples, row * beams_ + beam, width_); }
  void set(std::size_t row, std::size_t beam, std::uint32_t code) {
    const std::size_t at = (row * beams_ + beam) * width_;
    for (std::size_t i = 0; i < width_; ++i) ping_.samples[at + i] = static_cast<std::byte>(code >> (8 * i));
  }
  void fill(auto code) {
    for (std::size_t row = 0; row < rows_; ++row)
      for (std::size_t beam = 0; beam < beams_; ++beam) set(row, beam, code(row, beam));
  }
  /// Moves the complex beam signals (for messages with phases) like the samples. source(row, beam) returns the old position; rows
  /// beyond the last are empty.
  void move_signal(auto source) {
    auto& signal = ping_.beam_signal_upa;
    if (signal.size() != rows_ * beams_) return;
    const auto before = signal;
    for (std::size_t i = 0; i < signal.size(); ++i) {
      const auto [row, beam] = source(i / beams_, i % beams_);
      signal[i] = row < rows_ ? before[row * beams_ + beam] : std::complex<float>{};
    }
  }

 private:
  Ping& ping_;
  std::size_t width_, beams_, rows_;
};

std::uint32_t scaled(std::uint32_t code, double factor, std::uint32_t most) {
  return static_cast<std::uint32_t>(std::clamp(static_cast<double>(code) * factor, 0.0, static_cast<double>(most)));
}

/// Changes levels. A sample of a picture is a level; a sample of a range image has the level in the upper 16 bits and the range
/// in the lower 16. A pixel without a return is not changed.
class Levels {
 public:
  Levels(const Ping& ping, std::uint32_t full)
      : of_ranges_(range_image_of(ping.request)), full_(of_ranges_ ? full >> 16 : full) {}
  std::uint32_t of(std::uint32_t code) const { return of_ranges_ ? code >> 16 : code; }
  std::uint32_t with(std::uint32_t code, std::uint32_t level) const {
    if (of_ranges_ == nullptr) return level;
    return level == 0 || (code & most_range) == 0 ? 0 : level << 16 | (code & most_range);
  }
  std::uint32_t full() const { return full_; }
  bool are_of_ranges() const { return of_ranges_ != nullptr; }

  /// Returns the pixel's code after its range is multiplied by `factor`; 0 (no return) beyond `most_m`.
  std::uint32_t at_range(std::uint32_t code, double factor, double most_m) const {
    const double range = static_cast<double>(code & most_range) * factor;
    if (range < 1 || range > std::min<double>(most_range, most_m / of_ranges_->range_unit_m)) return 0;
    return (code & ~most_range) | static_cast<std::uint32_t>(range);
  }

 private:
  static constexpr std::uint32_t most_range = RangePixel::most_range;
  const RangeImageSettings* of_ranges_;
  std::uint32_t full_;
};

/// Moves, scales or removes rows and beams.
void alter_rows(const Fault& fault, Image& image, const Ping& ping) {
  const Levels levels(ping, image.full());
  const double most_m = ping.request.settings.range_m;
  // Parameters are read once, because finding one by name takes longer than processing a sample.
  const double fraction = fault.number("fraction"), factor = fault.number("factor");
  const std::size_t from = static_cast<std::size_t>(fraction * static_cast<double>(image.rows()));
  using E = FaultEffect;
  switch (fault.kind->effect) {
    case E::gain_step:
      return image.fill([&](std::size_t row, std::size_t beam) {
        const std::uint32_t code = image.get(row, beam);
        return row < from ? code : levels.with(code, scaled(levels.of(code), factor, levels.full()));
      });
    case E::missing_rows:
      if (levels.are_of_ranges())
        return image.fill(
            [&](std::size_t row, std::size_t beam) { return levels.at_range(image.get(row, beam), 1, most_m * fraction); });
      return image.fill([&](std::size_t row, std::size_t beam) { return row < from ? image.get(row, beam) : 0; });
    case E::mirror: {
      Ping before = ping;
      const Image old(before);
      image.move_signal([&](std::size_t row, std::size_t beam) { return std::pair(row, old.beams() - 1 - beam); });
      return image.fill([&](std::size_t row, std::size_t beam) { return old.get(row, image.beams() - 1 - beam); });
    }
    case E::scale_range: {
      if (levels.are_of_ranges())
        return image.fill(
            [&](std::size_t row, std::size_t beam) { return levels.at_range(image.get(row, beam), factor, most_m); });
      Ping before = ping;
      const Image old(before);
      const auto source_of = [&](std::size_t row) { return static_cast<std::size_t>((static_cast<double>(row) + 0.5) / factor); };
      image.move_signal([&](std::size_t row, std::size_t beam) { return std::pair(source_of(row), beam); });
      return image.fill([&](std::size_t row, std::size_t beam) {
        const std::size_t source = source_of(row);
        return source < old.rows() ? old.get(source, beam) : 0;
      });
    }
    default:
      return;
  }
}

}  // namespace

void alter_ping(const Fault& fault, const FaultDraws& draws, const Ping* kept, std::uint64_t begun, Ping& ping) {
  Image image(ping);
  const Levels levels(ping, image.full());
  const double share = fault.number("share");
  // Dead beams depend on the fault, not on the ping, so they are the same in every ping.
  FaultDraws of_fault = draws;
  of_fault.ping = 0;
  const auto chosen_beam = [&](std::size_t beam) {
    return share >= 1 || of_fault.uniform(static_cast<std::uint32_t>(beam)) < share;
  };
  const auto draw = [&](std::size_t row, std::size_t beam) {
    return draws.bits(static_cast<std::uint32_t>(row * image.beams() + beam));
  };
  using E = FaultEffect;
  switch (fault.kind->effect) {
    case E::stuck:
      if (kept == nullptr || kept->samples.size() != ping.samples.size()) return;
      ping.samples = kept->samples;
      ping.beam_signal_upa = kept->beam_signal_upa;
      ping.row_gain = kept->row_gain;
      return;
    case E::intermittent: {
      const auto on = static_cast<std::uint64_t>(fault.number("on")), off = static_cast<std::uint64_t>(fault.number("off"));
      if (begun % (on + off) < off) std::fill(ping.samples.begin(), ping.samples.end(), std::byte{0});
      return;
    }
    case E::blank:
      return std::fill(ping.samples.begin(), ping.samples.end(), std::byte{0});
    case E::saturate:
      return image.fill([&](std::size_t row, std::size_t beam) {
        const std::uint32_t code = image.get(row, beam);
        return uniform_open(draw(row, beam)) < static_cast<float>(share) ? levels.with(code, levels.full()) : code;
      });
    case E::noise:
      return image.fill([&](std::size_t row, std::size_t beam) {
        const auto level = static_cast<std::uint32_t>(draw(row, beam) % (std::uint64_t{levels.full()} + 1));
        return levels.with(image.get(row, beam), level);
      });
    case E::dead_beams:
      return image.fill([&](std::size_t row, std::size_t beam) { return chosen_beam(beam) ? 0 : image.get(row, beam); });
    case E::spokes:
      return image.fill([&](std::size_t row, std::size_t beam) {
        const std::uint32_t code = image.get(row, beam);
        return draws.uniform(static_cast<std::uint32_t>(beam)) < share ? levels.with(code, levels.full()) : code;
      });
    default:
      return alter_rows(fault, image, ping);
  }
}

}  // namespace sonar
