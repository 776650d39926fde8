#include "protocol/aris/models.hpp"

#include <algorithm>
#include <cassert>
#include <string>

#include "core/base/geometry.hpp"

namespace sonar::aris {
namespace {

// Sources. DOC: the vendor's SDK document 2.1. NET: limits in the vendor's .NET library. LIB: its frame-rate code. CON: settings
// of its program `connect`. FIL: its file SDK, tables of measured beams. SMP: its sample recording of an ARIS 1200.

/// Beam centres along the lens: a x + b x^3 degrees, x from -1 (starboard) to 1. Fitted to FIL; worst error 0.15 degrees.
struct LensRow {
  int beams = 0;
  double a_deg = 0, b_deg = 0;
};
constexpr LensRow lens_3000[] = {{64, 15.024, -0.128}, {128, 15.145, -0.125}};
constexpr LensRow lens_1800[] = {{48, 15.879, -2.384}, {96, 16.135, -2.404}};
constexpr LensRow telephoto_lens[] = {{48, 7.522, -0.179}, {96, 7.603, -0.180}};

constexpr double elevation_1800_deg = 14, elevation_3000_deg = 15, telephoto_elevation_deg = 3;  // recalled from data sheets
constexpr double frequencies_hz[3][2] = {{1.108e6, 1.8e6}, {1.8e6, 3.0e6}, {0.692e6, 1.2e6}};    // DOC, by SystemType

// unknown: levels. Assumed: TVG of 20 log r without absorption, because the level of SMP falls over the whole range. Full scale
// is chosen so that, with SMP's settings, the demo scene has SMP's level on an ARIS 1200 and a similar level on other products.
constexpr float source_level_db = 210, tvg_slope_db = 20, tvg_ceiling_db = 60;
constexpr float full_scale_upa[3] = {2.5e4f, 1e4f, 4e4f};  // by SystemType

const std::vector<Product>& products() {
  using F = Frequency;
  static const std::vector<Product> all{
      // pulse limits and energy: DOC; window: NET; margins: LIB; initial: CON
      {"aris-1200",
       SystemType::aris_1200,
       {{1, 3}},
       true,
       {80, 60},
       400,
       100,
       0.011,
       0.011,
       {0, 8, 512, 1333, 3750, 4, 5, 1, true, F::high, true, 20}},
      {"aris-1800",
       SystemType::aris_1800,
       {{1, 3}, {3, 6}},
       true,
       {40, 30},
       300,
       50,
       0.053,
       0.026,
       {0, 12, 1000, 1360, 5720, 4, 6, 3, true, F::high, true, 18}},
      {"aris-3000",
       SystemType::aris_3000,
       {{6, 4}, {9, 8}},
       false,
       {24, 16},
       240,
       20,
       0.076,
       0.026,
       {0, 12, 800, 1360, 4920, 4, 6, 9, true, F::high, true, 12}},
  };
  return all;
}

/// Returns the -3 dB widths of the beams; each beam reaches half way to its neighbours. unknown: widths at the low frequency;
/// `factor` increases them with the wavelength, as with any lens.
std::vector<float> beam_widths(const std::vector<double>& azimuths, double factor) {
  std::vector<float> widths;
  const auto n = azimuths.size();
  for (std::size_t j = 0; j < n; ++j) {
    const std::size_t before = j == 0 ? 0 : j - 1, after = std::min(j + 1, n - 1);
    widths.push_back(static_cast<float>(factor * (azimuths[before] - azimuths[after]) / static_cast<double>(after - before)));
  }
  return widths;
}

FrequencyMode mode_of(const Product& product, const ModeChoice& choice) {
  const auto frequency = static_cast<std::size_t>(choice.frequency);
  const double* const hz = frequencies_hz[static_cast<std::size_t>(product.system)];
  const int beams = find_ping_mode(product, choice.ping_mode)->beams();
  FrequencyMode mode;
  mode.name = std::to_string(beams) + (frequency == 0 ? " LF" : " HF") + (choice.telephoto ? " telephoto" : "");
  mode.centre_hz = static_cast<float>(hz[frequency]);
  mode.max_range_m = static_cast<float>(product.window_end_m);
  mode.min_range_m = 0.7f;  // DOC: the shortest start delay, 930 us
  mode.source_level_db = source_level_db;
  mode.beam_spacing = BeamSpacing::listed;
  mode.beam_azimuths_rad = beam_azimuths(product, beams, choice.telephoto);
  mode.beam_widths_rad = beam_widths(mode.beam_azimuths_rad, hz[1] / hz[frequency]);
  // unknown; assumed: a tone after its matched filter, which fits the correlation of neighbouring rows in SMP.
  mode.waveform.shape = Waveform::Shape::cw;
  mode.horizontal_aperture_rad = static_cast<float>(2 * mode.beam_azimuths_rad.front()) + mode.beam_widths_rad.front();
  const double elevation_deg = choice.telephoto                          ? telephoto_elevation_deg
                               : product.system == SystemType::aris_3000 ? elevation_3000_deg
                                                                         : elevation_1800_deg;
  mode.pattern.elevation_width_rad = static_cast<float>(rad_from_deg(elevation_deg));
  mode.pattern.azimuth_width_rad = mode.beam_widths_rad[mode.beam_widths_rad.size() / 2];
  mode.pattern.azimuth_taper = Taper::hann;  // a lens has low side lobes
  mode.receiver.tvg_slope_db = tvg_slope_db;
  mode.receiver.tvg_ceiling_db = tvg_ceiling_db;
  mode.receiver.full_scale_upa = full_scale_upa[static_cast<std::size_t>(product.system)];
  mode.receiver.channel_gain_db.assign(channel_gain_db.rbegin(), channel_gain_db.rend());
  mode.interleaved_pings = beams / channels;  // LIB: ping p of n forms the beams p, p + n, .. from starboard
  return mode;
}

std::vector<ModeChoice> choices(const Product& product) {
  std::vector<ModeChoice> all;
  for (const bool telephoto : {false, true})
    for (const PingMode& ping_mode : product.ping_modes)
      for (const Frequency frequency : {Frequency::low, Frequency::high})
        if (!telephoto || product.has_telephoto) all.push_back({ping_mode.number, frequency, telephoto});
  return all;
}

}  // namespace

// A cubic fits the vendor's tables of measured beams within 0.15 degrees (docs/protocols/aris.md, "Frames").
std::vector<double> beam_azimuths(const Product& product, int beams, bool telephoto) {
  const bool is_3000 = product.system == SystemType::aris_3000;
  const auto& lens = telephoto ? telephoto_lens : is_3000 ? lens_3000 : lens_1800;
  const auto row = std::find_if(std::begin(lens), std::end(lens), [&](const LensRow& r) { return r.beams == beams; });
  assert(row != std::end(lens));
  std::vector<double> azimuths;
  for (int j = 0; j < beams; ++j) {
    const double x = 1 - 2.0 * j / (beams - 1);
    azimuths.push_back(rad_from_deg(row->a_deg * x + row->b_deg * x * x * x));
  }
  return azimuths;
}

std::span<const std::shared_ptr<const SonarModel>> models() {
  static const std::vector<std::shared_ptr<const SonarModel>> built = [] {
    std::vector<std::shared_ptr<const SonarModel>> all;
    for (const Product& product : products()) {
      SonarModel model;
      model.profile = product.profile;
      model.name = "ARIS " + std::string(product.profile.substr(5));
      model.max_rate_hz = 15;  // DOC
      for (const ModeChoice& choice : choices(product)) model.modes.push_back(mode_of(product, choice));
      all.push_back(std::make_shared<const SonarModel>(std::move(model)));
    }
    return all;
  }();
  return built;
}

const Product& product_of(const SonarModel& model) {
  const auto& all = products();
  const auto it = std::find_if(all.begin(), all.end(), [&](const Product& p) { return p.profile == model.profile; });
  return it == all.end() ? all.front() : *it;
}

const PingMode* find_ping_mode(const Product& product, std::uint32_t number) {
  const auto it = std::find_if(product.ping_modes.begin(), product.ping_modes.end(),
                               [&](const PingMode& mode) { return mode.number == number; });
  return it == product.ping_modes.end() ? nullptr : &*it;
}

std::optional<int> mode_index(const Product& product, const ModeChoice& choice) {
  const std::vector<ModeChoice> all = choices(product);
  const auto it = std::find(all.begin(), all.end(), choice);
  return it == all.end() ? std::nullopt : std::optional(static_cast<int>(it - all.begin()));
}

ModeChoice choice_of(const Product& product, int mode_index) { return choices(product).at(static_cast<std::size_t>(mode_index)); }

}  // namespace sonar::aris
