#include "protocol/foxglove/ros_cdr.hpp"

namespace sonar::foxglove {

Schema figures_schema() {
  std::string text;
  for (const std::string_view name : figure_names) text.append("float64 ").append(name).append("\n");
  return {"sonard_msgs/msg/SonarFigures", "ros2msg", text};
}

wire::Bytes figures(const std::array<double, figure_names.size()>& values) {
  wire::Bytes out{std::byte{0}, std::byte{1}, std::byte{0}, std::byte{0}};  // plain CDR, little-endian
  wire::Writer writer(out);
  for (const double value : values) writer("figure", value);
  return out;
}

}  // namespace sonar::foxglove
