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

wire::Bytes with_stamp(wire::BytesView figures, const std::function<Time(Time)>& stamp) {
  constexpr std::size_t at = 4;  // offset of the first field, stamp_s: behind the head of CDR
  wire::Reader reader(figures.subspan(at));
  double stamp_s = 0;
  reader("stamp_s", stamp_s);
  stamp_s = seconds(stamp(Time(nanoseconds_from(stamp_s))).time_since_epoch());
  wire::Bytes out(figures.begin(), figures.begin() + at);
  wire::Writer writer(out);
  writer("stamp_s", stamp_s);
  out.insert(out.end(), figures.begin() + at + sizeof stamp_s, figures.end());
  return out;
}

}  // namespace sonar::foxglove
