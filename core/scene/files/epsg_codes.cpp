// The systems of the EPSG data set that are UTM, and those that agree with WGS 84. Source: the EPSG Geodetic Parameter Dataset
// 10, in the version of PROJ 9.1: every transverse Mercator projection with UTM's scale on the ellipsoids GRS 80 and WGS 84.
#include <algorithm>
#include <array>
#include <cmath>

#include "core/scene/files/height_values.hpp"

namespace sonar {
namespace {

constexpr bool north = false, south = true;

struct Zones {
  std::uint16_t first, last;
  int zone;  // UTM zone of `first`
  bool south;
};

constexpr auto utm_codes = std::to_array<Zones>({
    {2037, 2038, 19, north},   {2133, 2135, 58, south},  {2148, 2148, 21, north},   {2149, 2149, 18, north},
    {2150, 2150, 17, north},   {2151, 2151, 13, north},  {2152, 2152, 12, north},   {2153, 2153, 11, north},
    {2156, 2156, 59, south},   {2158, 2158, 29, north},  {2195, 2195, 2, south},    {2955, 2957, 11, north},
    {2958, 2962, 17, north},   {2972, 2972, 22, north},  {2975, 2975, 40, south},   {3006, 3006, 33, north},
    {3038, 3051, 26, north},   {3064, 3065, 32, north},  {3067, 3067, 35, north},   {3097, 3101, 51, north},
    {3154, 3157, 7, north},    {3158, 3160, 14, north},  {3169, 3171, 57, south},   {3178, 3189, 18, north},
    {3296, 3299, 5, south},    {3313, 3313, 21, north},  {3372, 3373, 59, north},   {3449, 3450, 17, north},
    {3706, 3707, 59, north},   {3708, 3726, 1, north},   {3740, 3749, 10, north},   {3750, 3751, 4, north},
    {3761, 3761, 22, north},   {3767, 3768, 33, north},  {3890, 3892, 37, north},   {4082, 4083, 27, north},
    {4467, 4467, 21, north},   {4471, 4471, 38, south},  {4484, 4489, 11, north},   {4559, 4559, 20, north},
    {4647, 4647, 32, north},   {5014, 5015, 25, north},  {5016, 5016, 28, north},   {5048, 5048, 35, north},
    {5361, 5361, 19, south},   {5362, 5362, 18, south},  {5382, 5383, 21, south},   {5396, 5396, 26, south},
    {5490, 5490, 20, north},   {5550, 5552, 54, south},  {5649, 5649, 31, north},   {5650, 5650, 33, north},
    {5651, 5653, 31, north},   {5700, 5700, 1, south},   {6210, 6211, 23, north},   {6328, 6329, 59, north},
    {6330, 6348, 1, north},    {6366, 6371, 11, north},  {6634, 6635, 4, north},    {6636, 6636, 2, south},
    {6688, 6692, 51, north},   {6707, 6709, 32, north},  {6732, 6735, 41, south},   {6736, 6737, 46, south},
    {6738, 6738, 59, south},   {7374, 7376, 39, north},  {7791, 7793, 32, north},   {7799, 7800, 34, north},
    {7803, 7803, 34, north},   {7805, 7805, 36, north},  {9391, 9391, 35, north},   {7846, 7859, 46, south},
    {8682, 8682, 34, north},   {8687, 8687, 33, north},  {8692, 8693, 54, north},   {9295, 9297, 39, north},
    {9356, 9360, 36, north},   {9476, 9482, 46, north},  {9487, 9494, 47, south},   {9709, 9709, 23, north},
    {9712, 9712, 24, north},   {9713, 9713, 24, north},  {9716, 9716, 34, north},   {22207, 22222, 7, north},
    {22307, 22322, 7, north},  {22407, 22422, 7, north}, {22607, 22622, 7, north},  {22707, 22722, 7, north},
    {25828, 25838, 28, north}, {26901, 26923, 1, north}, {28348, 28358, 48, south}, {31965, 31976, 11, north},
    {31977, 31985, 17, south}, {32601, 32660, 1, north}, {32701, 32760, 1, south},
});

struct Codes {
  std::uint16_t first, last;
};

/// Latitudes and longitudes on datums that agree with WGS 84 within 2 m: WGS 84, ITRF, ETRS89, NAD83, GDA94 and GDA2020, JGD,
/// NZGD2000, SIRGAS, and those that countries derive from them.
constexpr auto modern_codes = std::to_array<Codes>(
    {{3888, 3889}, {4040, 4040}, {4080, 4081}, {4126, 4126}, {4140, 4140}, {4152, 4152}, {4163, 4163}, {4167, 4167}, {4170, 4171},
     {4173, 4173}, {4180, 4180}, {4189, 4189}, {4258, 4258}, {4269, 4269}, {4283, 4283}, {4326, 4327}, {4329, 4329}, {4341, 4341},
     {4345, 4345}, {4347, 4347}, {4351, 4351}, {4353, 4353}, {4359, 4359}, {4361, 4361}, {4363, 4363}, {4369, 4369}, {4463, 4463},
     {4466, 4466}, {4469, 4470}, {4482, 4483}, {4557, 4558}, {4612, 4612}, {4617, 4617}, {4619, 4619}, {4624, 4624}, {4627, 4627},
     {4640, 4640}, {4659, 4659}, {4661, 4661}, {4669, 4670}, {4674, 4674}, {4687, 4687}, {4747, 4747}, {4749, 4749}, {4755, 4755},
     {4758, 4759}, {4761, 4761}, {4765, 4765}, {4883, 4883}, {4889, 4889}, {4893, 4893}, {4895, 4895}, {4898, 4898}, {4907, 4907},
     {4909, 4909}, {4935, 4951}, {4955, 4959}, {4963, 4967}, {4970, 4983}, {4988, 4989}, {4999, 4999}, {5012, 5013}, {5323, 5324},
     {5353, 5354}, {5359, 5360}, {5372, 5373}, {5380, 5381}, {5488, 5489}, {5545, 5546}, {6318, 6325}, {6364, 6365}, {6667, 6668},
     {6705, 6706}, {6782, 6783}, {7036, 7042}, {7084, 7084}, {7372, 7373}, {7656, 7665}, {7797, 7798}, {7815, 7816}, {7842, 7844},
     {7900, 7931}, {8085, 8086}, {8231, 8255}, {8399, 8403}, {8426, 8427}, {8542, 8545}, {8684, 8685}, {8817, 8818}, {8988, 9019},
     {9053, 9075}, {9754, 9755}, {9989, 9990}});

struct Meridian {
  std::uint16_t code;
  double degrees;
};

/// Prime meridians other than Greenwich, in degrees east of it.
constexpr auto meridians = std::to_array<Meridian>({
    {8901, 0},                 // Greenwich
    {8902, -9.131906111111},   // Lisbon
    {8903, 2.337229166667},    // Paris
    {8904, -74.080916666667},  // Bogota
    {8905, -3.687375},         // Madrid
    {8906, 12.452333333333},   // Rome
    {8907, 7.439583333333},    // Bern
    {8908, 106.807719444444},  // Jakarta
    {8909, -17.666666666667},  // Ferro
    {8910, 4.367975},          // Brussels
    {8911, 18.058277777778},   // Stockholm
    {8912, 23.7163375},        // Athens
    {8913, 10.722916666667},   // Oslo
    {8914, 2.337208333333},    // Paris, by the Royal Greenwich Observatory
});
struct OfSystem {
  std::uint16_t system, meridian;
};
/// Geographic systems whose longitudes do not begin at Greenwich.
constexpr auto systems_of_meridians =
    std::to_array<OfSystem>({{4801, 8907}, {4802, 8904}, {4803, 8902}, {4804, 8908}, {4805, 8909}, {4806, 8906}, {4807, 8903},
                             {4808, 8908}, {4809, 8910}, {4810, 8903}, {4811, 8903}, {4813, 8908}, {4814, 8911}, {4815, 8912},
                             {4816, 8903}, {4817, 8913}, {4818, 8909}, {4819, 8903}, {4820, 8908}, {4821, 8903}, {4901, 8914},
                             {4902, 8914}, {4903, 8905}, {4904, 8902}, {5229, 8909}, {8042, 8909}, {8043, 8909}});

template <class Rows>
const auto* row_of(const Rows& rows, std::uint32_t code) {
  const auto row = std::find_if(rows.begin(), rows.end(), [&](const auto& r) { return code >= r.first && code <= r.last; });
  return row == rows.end() ? nullptr : &*row;
}

}  // namespace

std::optional<UtmZone> utm_of_epsg(std::uint32_t code) {
  const Zones* const row = row_of(utm_codes, code);
  return row == nullptr ? std::nullopt : std::optional(UtmZone{row->zone + static_cast<int>(code - row->first), row->south});
}

std::optional<double> degrees_of_prime_meridian(std::uint32_t code) {
  const auto row = std::find_if(meridians.begin(), meridians.end(), [&](const Meridian& m) { return m.code == code; });
  return row == meridians.end() ? std::nullopt : std::optional(row->degrees);
}

double prime_meridian_of_epsg(std::uint32_t code) {
  const auto row =
      std::find_if(systems_of_meridians.begin(), systems_of_meridians.end(), [&](const OfSystem& s) { return s.system == code; });
  return row == systems_of_meridians.end() ? 0 : degrees_of_prime_meridian(row->meridian).value_or(0);
}

bool agrees_with_wgs84(std::uint32_t code) { return row_of(modern_codes, code) != nullptr; }

bool is_modern_ellipsoid(double semi_major_m, double inverse_flattening) {
  return std::abs(semi_major_m - earth_semi_major_m) < 0.01 && std::abs(inverse_flattening - 1 / earth_flattening) < 0.001;
}

std::optional<UtmZone> utm_of_parameters(const TransverseMercator& by) {
  constexpr double easting_m = 500'000, a_million_m = 1e6, northing_of_south_m = 1e7;
  const double zone = std::round((by.central_meridian_deg + 183) / 6);
  const bool south = by.false_northing_m == northing_of_south_m;
  const auto is = [](double a, double b) { return std::abs(a - b) < 1e-7; };
  if (!(zone >= 1 && zone <= 60) || !is(by.central_meridian_deg, 6 * zone - 183) || !is(by.scale, 0.9996) ||
      !is(by.latitude_deg, 0))
    return std::nullopt;
  if ((by.false_northing_m != 0 && !south) ||
      !(is(by.false_easting_m, easting_m) || is(by.false_easting_m, zone * a_million_m + easting_m)))
    return std::nullopt;
  return UtmZone{static_cast<int>(zone), south};
}

}  // namespace sonar
