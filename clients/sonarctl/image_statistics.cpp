#include "clients/sonarctl/image_statistics.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "clients/sonarctl/ping_log.hpp"

namespace sonar::clients {
namespace {

std::vector<double> values_in(const PolarImage& image, const Window& w) {
  std::vector<double> values;
  for (std::size_t row = w.row_begin; row < w.row_end; ++row)
    for (std::size_t beam = w.beam_begin; beam < w.beam_end; ++beam) values.push_back(static_cast<double>(image.at(row, beam)));
  return values;
}

/// Parses "a:b", "a:", ":b" or "" to [begin, end). Returns false for other text or a window that does not fit.
bool parse_interval(const std::string& text, std::size_t limit, std::size_t& begin, std::size_t& end) {
  begin = 0, end = limit;
  if (text.empty()) return true;
  const std::size_t colon = text.find(':');
  if (colon == std::string::npos) return false;
  const auto number = [&text](std::size_t from, std::size_t to, std::size_t& value) {
    if (from == to) return true;
    const auto [stop, error] = std::from_chars(text.data() + from, text.data() + to, value);
    return error == std::errc{} && stop == text.data() + to;
  };
  return number(0, colon, begin) && number(colon + 1, text.size(), end) && begin < end && end <= limit;
}

}  // namespace

Window whole(const PolarImage& image) { return {0, image.rows, 0, image.beams}; }

Result<Window> parse_window(const std::string& text, const PolarImage& image) {
  Window w;
  const std::size_t comma = text.find(',');
  const std::string rows = text.substr(0, comma), beams = comma == std::string::npos ? "" : text.substr(comma + 1);
  if (parse_interval(rows, image.rows, w.row_begin, w.row_end) && parse_interval(beams, image.beams, w.beam_begin, w.beam_end))
    return w;
  return failure(ErrorKind::usage, "\"" + text + "\" is not a window of " + std::to_string(image.rows) + " rows by " +
                                       std::to_string(image.beams) + " beams; write ROW:ROW or ROW:ROW,BEAM:BEAM, ends excluded");
}

double mean(const PolarImage& image, const Window& window) {
  const std::vector<double> values = values_in(image, window);
  double sum = 0;
  for (const double v : values) sum += v;
  return values.empty() ? 0 : sum / static_cast<double>(values.size());
}

double correlation(const PolarImage& image, const Window& w, std::size_t rows, std::size_t beams) {
  double n = 0, sum_a = 0, sum_b = 0, sum_aa = 0, sum_bb = 0, sum_ab = 0;
  for (std::size_t row = w.row_begin; row + rows < w.row_end; ++row) {
    for (std::size_t beam = w.beam_begin; beam + beams < w.beam_end; ++beam) {
      const auto a = static_cast<double>(image.at(row, beam)), b = static_cast<double>(image.at(row + rows, beam + beams));
      n += 1, sum_a += a, sum_b += b, sum_aa += a * a, sum_bb += b * b, sum_ab += a * b;
    }
  }
  if (n == 0) return 0;
  const double variance_a = sum_aa - sum_a * sum_a / n, variance_b = sum_bb - sum_b * sum_b / n;
  const double both = std::sqrt(std::max(0.0, variance_a) * std::max(0.0, variance_b));
  return both > 0 ? (sum_ab - sum_a * sum_b / n) / both : 0;
}

double share_at_least(const PolarImage& image, const Window& window, float code) {
  const std::vector<double> values = values_in(image, window);
  const auto count = std::count_if(values.begin(), values.end(), [code](double v) { return v >= static_cast<double>(code); });
  return values.empty() ? 0 : static_cast<double>(count) / static_cast<double>(values.size());
}

std::vector<double> percentiles(const PolarImage& image, const Window& window, const std::vector<double>& shares) {
  const std::vector<double> values = values_in(image, window);
  std::vector<double> out;
  for (const double share : shares) out.push_back(percentile(values, share));
  return out;
}

std::vector<double> block_means(const PolarImage& image, std::size_t rows) {
  std::vector<double> means;
  for (std::size_t row = 0; row < image.rows; row += rows)
    means.push_back(mean(image, {row, std::min(row + rows, image.rows), 0, image.beams}));
  return means;
}

std::size_t first_echo_row(const PolarImage& image, double factor, double code) {
  constexpr std::size_t leak_rows = 8;
  std::vector<double> quiet;
  for (std::size_t row = leak_rows; row < image.rows; ++row) {
    const double median = percentile(values_in(image, {row, row + 1, 0, image.beams}), 0.5);
    if (row >= 2 * leak_rows && median > code && median > factor * percentile(quiet, 0.5)) return row;
    quiet.push_back(median);
  }
  return image.rows;
}

}  // namespace sonar::clients
