#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "clients/sonarctl/image_statistics.hpp"
#include "clients/sonarctl/source.hpp"
#include "core/text/format.hpp"

namespace sonar::clients {
namespace {

/// Returns the lowest saturated code. An Oculus with 8 bits stops at 254.
float saturation_of(const PingFacts& ping) { return ping.bits == 8 ? 254.0f : std::ldexp(1.0f, static_cast<int>(ping.bits)) - 1; }

nlohmann::json speckle_stats(const PolarImage& image, const Window& w, float saturation) {
  return {
      {"rows", {w.row_begin, w.row_end}},
      {"beams", {w.beam_begin, w.beam_end}},
      {"mean", mean(image, w)},
      {"percentiles_1_5_25_50_75_95_99", percentiles(image, w, {0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99})},
      {"saturated_share", share_at_least(image, w, saturation)},
      {"correlation_of_adjacent_beams", {correlation(image, w, 0, 1), correlation(image, w, 0, 2), correlation(image, w, 0, 3)}},
      {"correlation_of_adjacent_rows", {correlation(image, w, 1, 0), correlation(image, w, 2, 0), correlation(image, w, 3, 0)}}};
}

/// The near field ends at the first echo; its first eight rows are the transmit leak.
nlohmann::json range_stats(const PolarImage& image) {
  const std::size_t echo = first_echo_row(image), leak = std::min<std::size_t>(8, image.rows);
  const std::size_t tail = image.rows > 50 ? image.rows - 50 : 0;
  return {{"first_echo_row", echo},
          {"near_field_mean", mean(image, {leak, std::max(leak, echo), 0, image.beams})},
          {"last_50_rows_mean", mean(image, {tail, image.rows, 0, image.beams})},
          {"mean_of_each_50_rows", block_means(image, 50)}};
}

void print_plain(const nlohmann::json& stats, const std::string& prefix) {
  for (const auto& [name, value] : stats.items()) {
    if (value.is_object()) {
      print_plain(value, prefix + name + ".");
      continue;
    }
    std::string text;
    for (const auto& v : value.is_array() ? value : nlohmann::json::array({value}))
      text += text::format("%s%.4g", text.empty() ? "" : " ", v.get<double>());
    std::printf("%-50s %s\n", (prefix + name).c_str(), text.c_str());
  }
}

}  // namespace

Result<void> stats(const StatsOptions& options) {
  const Result<HostPing> ping = fetch_ping(options.source, options.ping, true);
  if (!ping) return tl::unexpected(ping.error());
  const Result<PolarImage> image = ping->picture();
  if (!image) return tl::unexpected(image.error());
  const Result<Window> window = parse_window(options.window, *image);
  if (!window) return tl::unexpected(window.error());
  nlohmann::json stats{{"window", speckle_stats(*image, *window, saturation_of(ping->facts))}, {"range", range_stats(*image)}};
  if (!options.shadow.empty()) {
    const Result<Window> shadow = parse_window(options.shadow, *image), around = parse_window(options.surroundings, *image);
    if (!shadow) return tl::unexpected(shadow.error());
    if (!around) return tl::unexpected(around.error());
    const double dark = mean(*image, *shadow), bright = mean(*image, *around);
    stats["shadow"] = {{"mean", dark}, {"surroundings_mean", bright}, {"ratio", bright > 0 ? dark / bright : 0.0}};
  }
  if (options.json) {
    std::puts(stats.dump().c_str());
  } else {
    print_plain(stats, "");
  }
  return {};
}

}  // namespace sonar::clients
