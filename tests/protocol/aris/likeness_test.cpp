// Compares frames of an emulated ARIS 1200 with those of a real one, by statistics that do not depend on the scene. The model was
// fitted to frames 1 to 3 of the recording; this test compares with frames 4 to 6.
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <numeric>

#include "tests/core/pipeline/scenes.hpp"
#include "tests/core/pipeline/sounding.hpp"
#include "tests/protocol/aris/aris_testing.hpp"

namespace sonar::aris::likeness_test {
namespace {

constexpr int rows = 2000, beams = 48;
constexpr double db_per_code = 80.0 / 255;

/// Levels [dB] of some rows. Beam 0 is the outermost one to starboard, as in frames.
struct Levels {
  std::vector<std::vector<double>> db;

  /// Returns the levels less their mean in a window of this height and width.
  Levels less_local_mean(int high, int wide) const {
    Levels out = *this;
    const int n = static_cast<int>(db.size());
    for (int r = 0; r < n; ++r)
      for (int b = 0; b < beams; ++b) {
        double sum = 0, count = 0;
        for (int i = std::max(r - high / 2, 0); i <= std::min(r + high / 2, n - 1); ++i)
          for (int j = std::max(b - wide / 2, 0); j <= std::min(b + wide / 2, beams - 1); ++j) sum += at(i, j), ++count;
        out.db[static_cast<std::size_t>(r)][static_cast<std::size_t>(b)] -= sum / count;
      }
    return out;
  }
  double at(int row, int beam) const { return db[static_cast<std::size_t>(row)][static_cast<std::size_t>(beam)]; }
  /// Returns the mean of (a - mean)^power over all levels.
  double moment(int power) const {
    double sum = 0, count = 0;
    for (const auto& row : db)
      for (const double v : row) sum += std::pow(v, power), ++count;
    return sum / count;
  }
  double next_beam() const {
    double sum = 0;
    for (const auto& row : db) sum += std::inner_product(row.begin(), row.end() - 1, row.begin() + 1, 0.0);
    return sum / static_cast<double>(db.size() * (beams - 1)) / moment(2);
  }
  /// Returns the mean over the beams of each inner channel, less the mean of its two neighbours.
  std::vector<double> stripes() const {
    std::vector<double> gains(channels);
    for (const auto& row : db)
      for (std::size_t b = 0; b < beams; ++b)
        gains[b * channels / beams] += row[b] * channels / beams / static_cast<double>(db.size());
    return stripes_of(gains);
  }
  static std::vector<double> stripes_of(const std::vector<double>& gains) {
    std::vector<double> stripes;
    for (std::size_t c = 1; c + 1 < gains.size(); ++c) stripes.push_back(gains[c] - (gains[c - 1] + gains[c + 1]) / 2);
    return stripes;
  }
  double next_row() const {
    double sum = 0;
    for (std::size_t r = 0; r + 1 < db.size(); ++r) sum += std::inner_product(db[r].begin(), db[r].end(), db[r + 1].begin(), 0.0);
    return sum / static_cast<double>((db.size() - 1) * beams) / moment(2);
  }
};

struct Statistics {
  double spread_db, skew, next_row, next_beam;
  std::vector<double> stripes_db;
};
Statistics statistics_of(const Levels& levels) {
  const Levels wide = levels.less_local_mean(41, 9);
  const double spread = std::sqrt(wide.moment(2));
  return {spread, wide.moment(3) / (spread * spread * spread), levels.less_local_mean(15, 15).next_row(),
          levels.less_local_mean(15, 15).next_beam(), levels.stripes()};
}
void expect_like_recording(const Statistics& s) {
  EXPECT_NEAR(s.spread_db, 4.01, 0.15 * 4.01);  // recording: 4.00 to 4.02; with one look per sample: 5.5
  EXPECT_NEAR(s.skew, -0.39, 0.15);             // recording: -0.37 to -0.40; with one look: -1.06
  EXPECT_NEAR(s.next_row, 0.16, 0.08);          // recording: 0.15 to 0.17
  EXPECT_NEAR(s.next_beam, 0.02, 0.06);         // recording: 0.02 to 0.03; with all beams of one ping: 0.14
  const std::vector<double> table = Levels::stripes_of({channel_gain_db.begin(), channel_gain_db.end()});
  EXPECT_GT(test::correlation(s.stripes_db, table), 0.95);
  double error = 0;
  for (std::size_t c = 0; c < table.size(); ++c) error += std::pow(s.stripes_db[c] - table[c], 2);
  EXPECT_LT(std::sqrt(error / static_cast<double>(table.size())), 0.35);  // the table itself has 1.2 dB rms
}

/// Returns a frame with the settings of the recording, of a bed 2 m below the sonar, which moves at 0.5 m/s. If not
/// `interleaved`, all beams are of one ping.
Levels emulated(bool interleaved = true) {
  const auto state = tests::device("aris-1200");
  Settings settings;
  settings.acoustics = {1, 6.5f, rows, 4593, 32953, 14, 12, 1, true, Frequency::high, true, 24};
  settings.telephoto = true;
  PingSettings ping = ping_settings(settings, state);
  const FrequencyMode mode = state.model->modes[static_cast<std::size_t>(ping.mode)];
  ping.mode = 0;
  const Mesh bed = test::height_field(-1, 30, -8, 8, 1, [](double, double) { return 0.0; });
  test::Sounding sounding(test::SceneMaker().add(bed, -27).make(), mode, ping);
  sounding.request.sonar_moves.velocity_mps = {0.5, 0, 0};
  sounding.request.switches.interleave = interleaved;
  const Ping& frame = sounding.ping_from({0, 0, 2}, {0, rad_from_deg(9), 0});
  Levels levels;
  for (std::size_t r = 750; r < 1350; ++r) {
    std::vector<double>& row = levels.db.emplace_back();
    for (std::size_t b = 0; b < beams; ++b)
      row.push_back(db_per_code * std::to_integer<int>(frame.samples[r * beams + beams - 1 - b]));
  }
  return levels;
}

/// Returns a frame, 0 to 5, of the recording; no rows without the recording.
Levels recorded(int frame) {
  const char* const folder = std::getenv("SONARD_CAPTURES");
  if (folder == nullptr) return {};
  std::ifstream file(std::filesystem::path(folder) / "aris/sample.aris", std::ios::binary);
  std::string bytes((std::istreambuf_iterator<char>(file)), {});
  const std::size_t first =
      padded_header_size + static_cast<std::size_t>(frame) * (padded_header_size + rows * beams) + padded_header_size;
  if (bytes.size() < first + rows * beams) return {};
  Levels levels;
  for (std::size_t r = 50; r < 1250; ++r) {
    std::vector<double>& row = levels.db.emplace_back();
    for (std::size_t b = 0; b < beams; ++b)
      row.push_back(db_per_code * static_cast<double>(static_cast<unsigned char>(bytes[first + r * beams + b])));
  }
  return levels;
}

TEST(ArisLikeness, EmulatedSamplesHaveTheStatisticsOfTheRecording) { expect_like_recording(statistics_of(emulated())); }

TEST(ArisLikeness, BeamsOfOnePingWouldBeMoreAlike) { EXPECT_GT(statistics_of(emulated(false)).next_beam, 0.1); }

TEST(ArisLikeness, TheRecordingHasThoseStatistics) {
  for (int frame = 3; frame < 6; ++frame) {
    const Levels levels = recorded(frame);
    if (levels.db.empty()) GTEST_SKIP() << "SONARD_CAPTURES names no folder with aris/sample.aris";
    expect_like_recording(statistics_of(levels));
  }
}

}  // namespace
}  // namespace sonar::aris::likeness_test
