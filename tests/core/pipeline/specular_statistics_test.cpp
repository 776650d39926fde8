// Echoes of a slightly rough surface. The specular and the scattered part share the energy. Where a beam receives both, their
// sum is Rician (oracle 25).
#include <gtest/gtest.h>

#include <cmath>

#include "core/pipeline/scattering_law.hpp"
#include "core/pipeline/specular/specular.hpp"
#include "tests/core/pipeline/specular_worlds.hpp"
#include "tests/oracles/record.hpp"

namespace sonar::test {
namespace {

TEST(SpecularStatistics, EnergyThatIsNotMirroredIsScattered) {
  const double c = 1500, hz = 900e3;
  for (const double kh : {0.02, 0.1, 0.3, 0.7, 1.0, 1.4}) {
    Material m = mirror();
    m.roughness_m = static_cast<float>(kh * c / (2 * pi * hz));
    const double scattered = scattering_strength(m, 1, hz, c, true) / scattering_strength(m, 1, hz, c, false);
    const double mirrored = std::pow(coherent_reflection(m, c / hz), 2);
    EXPECT_NEAR(scattered + mirrored, 1, 1e-4) << kh;
    // Away from the perpendicular, roughness has less effect, and less energy is scattered.
    EXPECT_NEAR(scattering_strength(m, 0.5, hz, c, true) / scattering_strength(m, 0.5, hz, c, false), 1 - std::exp(-kh * kh),
                1e-4);
  }
}

TEST(SpecularStatistics, SmoothTurnsIntoRoughWithoutAStep) {
  const double c = 1500, hz = 900e3;
  Material m = mirror();
  m.roughness_m = static_cast<float>(0.999 * smooth_below_kh * c / (2 * pi * hz));
  EXPECT_NEAR(scattering_strength(m, 1, hz, c, true) / scattering_strength(m, 1, hz, c, false), 1, 2e-4);
  EXPECT_LT(std::abs(coherent_reflection(m, c / hz)), 0.012);
  m.roughness_m *= 1.01f;
  EXPECT_EQ(coherent_reflection(m, c / hz), 0);
  EXPECT_EQ(scattering_strength(m, 0.3, hz, c, true), scattering_strength(m, 0.3, hz, c, false));
}

/// A narrow sonar over a slightly rough plate, 1 m square, 2 m ahead.
class Plate {
 public:
  explicit Plate(double reflection) {
    Mirror plate = specular_plane(1, 1);
    plate.in_world = facing(2);
    plate.material.roughness_m = 1.5e-4f;
    plate.material.lambert_db = -10;
    plate.material.reflection = static_cast<float>(reflection);
    FrequencyMode mode = p900();
    mode.horizontal_aperture_rad = 0.06f;
    PingSettings settings = native_rows(2.3, 0.0254);
    settings.beam_count = 5;
    sounding_ = std::make_unique<Sounding>(world_of({plate}), mode, settings);
    sounding_->request.switches.specular = true;
    row_ = static_cast<int>(std::lround(sounding_->row_of_range(2)));
  }
  /// Returns |s|^2 of the sample nearest to the plate, in the middle beam.
  double intensity(std::uint64_t seed, bool expected = false) {
    sounding_->request.seed = Seed{seed};
    sounding_->request.switches.expected_power = expected;
    sounding_->ping_from({});
    return sounding_->power(row_, 2);
  }

 private:
  std::unique_ptr<Sounding> sounding_;
  int row_ = 0;
};

TEST(SpecularStatistics, Oracle25_RicianEcho) {
  // The reflection is chosen so that the mirror's power is four times that of the scattered echo in the same cell, both as
  // expected values.
  const double scattered = Plate(0).intensity(1, true);
  const double mirrored = Plate(0.1).intensity(1, true) - scattered;
  ASSERT_GT(scattered, 0);
  Plate plate(0.1 * std::sqrt(4 * scattered / mirrored));
  constexpr int n = 2400;
  double sum = 0, squares = 0;
  for (int i = 0; i < n; ++i) {
    const double intensity = plate.intensity(1000 + static_cast<std::uint64_t>(i));
    sum += intensity / n, squares += intensity * intensity / n;
  }
  record_oracle(25, "Rician K = 4, scintillation index of a slightly rough plate", 0.36, squares / (sum * sum) - 1, 0.04, "");
  record_oracle(25, "Rician K = 4, mean power over the scattered part's", 5, sum / scattered, 0.2, "");
}

}  // namespace
}  // namespace sonar::test
