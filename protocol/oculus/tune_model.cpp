#include "protocol/oculus/tune_model.hpp"

#include "core/base/geometry.hpp"
#include "protocol/oculus/options.hpp"

namespace sonar::oculus {
namespace {

float& aperture(FrequencyMode& mode) { return mode.horizontal_aperture_rad; }
float& azimuth_width(FrequencyMode& mode) { return mode.pattern.azimuth_width_rad; }
float& elevation_width(FrequencyMode& mode) { return mode.pattern.elevation_width_rad; }

struct Figure {
  std::string_view option;
  std::size_t mode;
  float& (*of)(FrequencyMode&);
};
constexpr Figure figures[] = {
    {option_name::lf_aperture_deg, 0, aperture},
    {option_name::hf_aperture_deg, 1, aperture},
    {option_name::lf_azimuth_width_deg, 0, azimuth_width},
    {option_name::hf_azimuth_width_deg, 1, azimuth_width},
    {option_name::lf_elevation_width_deg, 0, elevation_width},
    {option_name::hf_elevation_width_deg, 1, elevation_width},
};

}  // namespace

// A product of one frequency has only the lf_ options. An hf_ option would be ignored without a word, so it is an error.
Result<std::shared_ptr<const SonarModel>> tuned(std::shared_ptr<const SonarModel> model, const protocol::OptionValues& options) {
  SonarModel changed = *model;
  bool any = false;
  for (const Figure& figure : figures) {
    const auto deg = given_number(options, figure.option);
    if (!deg) continue;
    if (figure.mode >= changed.modes.size())
      return failure(ErrorKind::config, "option " + std::string(figure.option) + ": " + changed.name +
                                            " has one frequency only, set the lf_ figure instead");
    figure.of(changed.modes[figure.mode]) = static_cast<float>(rad_from_deg(*deg));
    any = true;
  }
  if (text_option(options, option_name::elevation_width_is) == "one_way") {
    for (FrequencyMode& mode : changed.modes) mode.pattern.elevation_width_is = ElevationWidthIs::one_way;
    any = true;
  }
  if (!any) return model;
  return std::make_shared<const SonarModel>(std::move(changed));
}

}  // namespace sonar::oculus
