// Texture: the Gamma field by itself, in the surface cells, and its effect on echoes (docs/acoustics.md, section 3).
#include "core/scene/cells/texture.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "core/scene/cells/surface_cells.hpp"
#include "tests/core/pipeline/scenes.hpp"
#include "tests/core/pipeline/sounding.hpp"
#include "tests/oracles/record.hpp"

namespace sonar::test {
namespace {

constexpr double height_m = 2, tilt_rad = 0.3, bed_db = -15;

std::shared_ptr<const Scene> bed(Texture texture) {
  Scene scene = *SceneMaker().add(height_field(-4, 14, -10, 10, 2, [](double, double) { return 0.0; }), bed_db).make();
  scene.materials.at(0).texture = texture;
  return std::make_shared<const Scene>(std::move(scene));
}

struct Moments {
  double sum = 0, squares = 0, products = 0;
  int n = 0;
  void add(double a, double b) { sum += 0.5 * (a + b), squares += 0.5 * (a * a + b * b), products += a * b, ++n; }
  double mean() const { return sum / n; }
  double variance() const { return squares / n - mean() * mean(); }
  double correlation() const { return (products / n - mean() * mean()) / variance(); }
};

/// Pairs of values `apart_m` apart in one direction. Different pairs are far enough from each other to be independent.
Moments pairs(const Texture& texture, Vec3d along, double apart_m) {
  const TextureField field(texture, 5, Seed{11});
  TexturePatch patch(field, 2);
  Moments m;
  const double step = 3.77 * static_cast<double>(texture.correlation_m);  // not a multiple of the lattice spacing
  for (int i = 0; i < 40; ++i)
    for (int j = 0; j < 40; ++j)
      for (int k = 0; k < 15; ++k) {
        const Vec3d p{i * step - 20, j * step + 3, k * step};
        const auto value = [&](Vec3d at) { return std::pow(static_cast<double>(patch.root_at(at)), 2); };
        m.add(value(p), value(p + apart_m * along));
      }
  return m;
}

TEST(Texture, AValueDoesNotDependOnEarlierCalls) {
  const TextureField field({1, 0.5f}, 5, Seed{11});
  TexturePatch patch(field, 2);
  for (int n = 0; n < 2000; ++n) {
    const Vec3d p{3 * std::sin(0.1 * n), 2 * std::cos(0.37 * n), 0.3 * std::sin(1.7 * n)};
    EXPECT_EQ(patch.root_at(p), TexturePatch(field, 2).root_at(p)) << n;
  }
}

/// Returns the Gamma variable at the quantile of a standard normal, which all lattice points have.
double power_at(const TextureField& field, float normal) {
  cell_lanes::Splines splines{};
  for (auto& weights : splines.weight) std::fill_n(weights[0], cell_lanes::block, 1.0f);
  float normals[27][cell_lanes::block];
  std::fill_n(&normals[0][0], 27 * cell_lanes::block, normal);
  double root[cell_lanes::block] = {1};
  cell_lanes::multiply_by_field(splines, normals, field.roots(), root);
  return root[0] * root[0];
}

TEST(Texture, TheFieldIsGammaOfMeanOne) {
  for (const float shape : {0.5f, 1.0f, 4.0f, 20.0f}) {
    const Moments m = pairs({shape, 0.5f}, {1, 0, 0}, 0);
    EXPECT_NEAR(m.mean(), 1, 0.03) << shape;
    EXPECT_NEAR(m.variance() * static_cast<double>(shape), 1, 0.1) << shape;
  }
  // Shape 1 is the exponential distribution. Its median is ln 2, its 90th percentile ln 10.
  const TextureField field({1, 0.5f}, 0, Seed{1});
  EXPECT_NEAR(power_at(field, 0), std::log(2.0), 2e-3);
  EXPECT_NEAR(power_at(field, 1.2815516f), std::log(10.0), 5e-3);
}

TEST(Texture, CorrelationFallsToOneEthAtItsLengthInEveryDirection) {
  for (const float length : {0.1f, 0.5f, 1.0f})
    for (const Vec3d along : {Vec3d{1, 0, 0}, Vec3d{0, 0, 1}, Vec3d{0.6, 0.8, 0}, Vec3d{0.48, 0.6, 0.64}}) {
      const Texture texture{4, length};
      EXPECT_NEAR(pairs(texture, along, static_cast<double>(length)).correlation(), std::exp(-1.0), 0.07) << length;
      EXPECT_GT(pairs(texture, along, 0.1 * static_cast<double>(length)).correlation(), 0.97) << length;
      EXPECT_NEAR(pairs(texture, along, 2.6 * static_cast<double>(length)).correlation(), 0, 0.04) << length;
    }
}

TEST(Texture, IsContinuousAndBelongsToSeedMaterialAndObject) {
  const TextureField field({1, 0.3f}, 5, Seed{11}), same({1, 0.3f}, 5, Seed{11}), other_seed({1, 0.3f}, 5, Seed{12}),
      other_material({1, 0.3f}, 6, Seed{11});
  TexturePatch patch(field, 0), again(same, 0), by_seed(other_seed, 0), by_material(other_material, 0), by_object(field, 1);
  std::vector<double> here, seed, material, object;
  float last = patch.root_at({-0.001, 0.7, 0.2});
  for (int i = 0; i < 40000; ++i) {
    const Vec3d p{0.001 * i, 0.7, 0.2};
    const float value = patch.root_at(p);
    ASSERT_LT(std::abs(value - last), 0.03f) << p.x;
    last = value;
    if (i % 300) continue;
    EXPECT_EQ(again.root_at(p), value);
    here.push_back(static_cast<double>(value));
    seed.push_back(static_cast<double>(by_seed.root_at(p)));
    material.push_back(static_cast<double>(by_material.root_at(p)));
    object.push_back(static_cast<double>(by_object.root_at(p)));
  }
  EXPECT_LT(std::abs(correlation(here, seed)), 0.35);
  EXPECT_LT(std::abs(correlation(here, material)), 0.35);
  EXPECT_LT(std::abs(correlation(here, object)), 0.35);
}

TEST(Texture, CellsOfEveryLevelCarryTheSameField) {
  const auto scene = bed({0.8f, 0.4f});
  SurfaceCells with(scene, Seed{3}, 1u << 30), without(scene, Seed{3}, 1u << 30, {.texture = false});
  EXPECT_TRUE(with.serves(Seed{3}, {}));
  EXPECT_FALSE(with.serves(Seed{3}, {.texture = false}));
  const TextureField field(scene->materials[0].texture, 0, Seed{3});
  Parallel pool(2);
  for (const int level : {3, 4, 5}) {
    CellView view;
    view.sonar_in_world.position_m = {-200, 0, 0};
    view.max_range_m = 1000;
    view.max_elevation_rad = 1.4f;
    view.levels = {{level, 0, 0, 1e6f, 1e6f}};
    const std::vector<TileInView> a = with.in_view(view, pool), b = without.in_view(view, pool);
    ASSERT_EQ(a.size(), b.size());
    int compared = 0;
    for (std::size_t n = 0; n < a.size(); n += 5) {
      const CellTile &t = *a[n].tile, &u = *b[n].tile;
      ASSERT_EQ(t.count, u.count);
      TexturePatch patch(field, 0);
      for (int i = 0; i < t.count; i += 3) {
        const auto unit = static_cast<double>(t.position_unit_m);
        const Vec3d place = t.centre_m + unit * Vec3d{1.0 * t.column(CellTile::x)[i], 1.0 * t.column(CellTile::y)[i],
                                                      1.0 * t.column(CellTile::z)[i]};
        const int plain = u.column(CellTile::weight_re)[i];
        if (std::abs(plain) < 2000) continue;  // counts that are too small for a quotient
        const double ratio =
            t.column(CellTile::weight_re)[i] * static_cast<double>(t.weight_unit) / (plain * static_cast<double>(u.weight_unit));
        EXPECT_NEAR(ratio, static_cast<double>(patch.root_at(place)), 5e-3) << level;
        ++compared;
      }
    }
    EXPECT_GT(compared, 100) << level;
  }
}

TEST(Texture, WithoutTheSwitchAndInExpectedPowerTheMeanIsUsed) {
  Sounding plain(bed({}), p900(), default_rows(10, 394)), patchy(bed({1, 0.5f}), p900(), default_rows(10, 394));
  const RollPitchYaw attitude{0, tilt_rad, 0};
  const std::vector<float> none = plain.ping_from({0, 0, height_m}, attitude).pressure_upa;
  const std::vector<float> on = patchy.ping_from({0, 0, height_m}, attitude).pressure_upa;
  EXPECT_NE(on, none);
  patchy.request.switches.texture = false;
  EXPECT_EQ(patchy.ping().pressure_upa, none);
  patchy.request.switches.texture = true;
  EXPECT_EQ(patchy.ping().pressure_upa, on) << "the cells' memory must not mix the two";
  plain.request.switches.expected_power = patchy.request.switches.expected_power = true;
  EXPECT_EQ(patchy.ping().pressure_upa, plain.ping().pressure_upa);
}

/// Visits the intensity divided by its mean, where the beams hit the bed.
template <class Visit>
void visit_intensities(const Sounding& s, const reference::SeabedLevel& level, int beam_step, int row_step, Visit&& visit) {
  const auto pulse = static_cast<double>(s.request.settings.pulse_width_m);
  for (int j = 0; j < s.beams(); j += beam_step)
    for (int row = 0; row < s.rows(); row += row_step) {
      const double r = s.range_of_row(row), u = s.beam_sine(j);
      if (!(r - 2 * pulse > 1.3 * height_m / std::sqrt(1 - u * u)) || !(level.pattern(r - 2 * pulse, u) > 0.2)) continue;
      visit(row, j, s.power(row, j) / power_from_db(level.db(r, u)));
    }
}

// K-distribution: Gamma patches much larger than beam and pulse, times exponential speckle.
TEST(Texture, EchoesAreKDistributed) {
  for (const float shape : {2.0f, 8.0f}) {
    const FrequencyMode mode = oculus_high();
    Sounding s(bed({shape, 0.35f}), mode, default_rows(8, 640));
    double sum = 0, squares = 0;
    int n = 0;
    for (std::uint64_t seed = 1; seed <= 14; ++seed) {
      s.request.seed = Seed{seed};
      s.ping_from({0, 0, height_m}, {0, tilt_rad, 0});
      const reference::SeabedLevel level(mode, s.medium(), s.envelope_hz(), bed_db, height_m, tilt_rad);
      visit_intensities(s, level, 8, 3, [&](int, int, double i) { sum += i, squares += i * i, ++n; });
    }
    ASSERT_GT(n, 20000);
    const std::string name = "texture of shape " + std::to_string(static_cast<int>(shape));
    record_oracle(no_number, name + ", mean level", 0, 10 * std::log10(sum / n), 0.2, "dB");
    const double index = squares / n / std::pow(sum / n, 2) - 1;
    record_oracle(no_number, name + ", scintillation index", 1 + 2 / static_cast<double>(shape), index, shape < 4 ? 0.2 : 0.1,
                  "");
  }
}

// A grain is a separate field. If it is as long as a patch, echoes are as with a texture. Both fields together multiply.
TEST(Grain, IsAddedToTheTexture) {
  const FrequencyMode mode = oculus_high();
  Scene scene = *bed({});
  scene.materials[0].grain = {2, 0.35f};
  Sounding s(std::make_shared<const Scene>(scene), mode, default_rows(8, 640));
  double sum = 0, squares = 0;
  int n = 0;
  for (std::uint64_t seed = 1; seed <= 14; ++seed) {
    s.request.seed = Seed{seed};
    s.ping_from({0, 0, height_m}, {0, tilt_rad, 0});
    const reference::SeabedLevel level(mode, s.medium(), s.envelope_hz(), bed_db, height_m, tilt_rad);
    visit_intensities(s, level, 8, 3, [&](int, int, double i) { sum += i, squares += i * i, ++n; });
  }
  record_oracle(no_number, "grain of shape 2, mean level", 0, 10 * std::log10(sum / n), 0.2, "dB");
  record_oracle(no_number, "grain of shape 2, scintillation index", 2, squares / n / std::pow(sum / n, 2) - 1, 0.2, "");
  const std::vector<float> grain = s.last().pressure_upa;
  Sounding texture(bed({2, 0.35f}), mode, default_rows(8, 640)), plain(bed({}), mode, default_rows(8, 640));
  texture.request.seed = plain.request.seed = s.request.seed;
  EXPECT_NE(texture.ping_from({0, 0, height_m}, {0, tilt_rad, 0}).pressure_upa, grain)
      << "grain and texture have different draws";
  s.request.switches.grain = false;
  EXPECT_EQ(s.ping().pressure_upa, plain.ping_from({0, 0, height_m}, {0, tilt_rad, 0}).pressure_upa);
}

// The patches are fixed to the bed. Seen from a position where the speckle is completely different, they are at the same
// points.
TEST(Texture, PatchesStayWhereTheyAre) {
  const FrequencyMode mode = oculus_high();
  for (const bool on : {true, false}) {
    Sounding s(bed({1, 0.8f}), mode, default_rows(8, 640));
    s.request.switches.texture = on;
    std::map<std::pair<int, int>, std::pair<double, int>> seen[2];
    const Vec3d places[2] = {{0, 0, height_m}, {0.6, 0.5, height_m}};
    for (int ping = 0; ping < 2; ++ping) {
      s.ping_from(places[ping], {0, tilt_rad, 0});
      const reference::SeabedLevel level(mode, s.medium(), s.envelope_hz(), bed_db, height_m, tilt_rad);
      visit_intensities(s, level, 1, 1, [&](int row, int j, double intensity) {
        const double r = s.range_of_row(row), y = r * s.beam_sine(j), x = std::sqrt(r * r - height_m * height_m - y * y);
        auto& [total, count] = seen[ping][{static_cast<int>(std::floor((x + places[ping].x) / 0.25)),
                                           static_cast<int>(std::floor((y + places[ping].y) / 0.25))}];
        total += intensity, ++count;
      });
    }
    std::vector<double> first, second;
    for (const auto& [where, a] : seen[0]) {
      const auto b = seen[1].find(where);
      if (b == seen[1].end() || a.second < 100 || b->second.second < 100) continue;
      first.push_back(a.first / a.second), second.push_back(b->second.first / b->second.second);
    }
    ASSERT_GT(first.size(), 80u);
    if (on)
      EXPECT_GT(correlation(first, second), 0.9);
    else
      EXPECT_LT(std::abs(correlation(first, second)), 0.4);
  }
}

}  // namespace
}  // namespace sonar::test
