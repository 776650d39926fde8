#include "daemon/read_trajectory.hpp"

namespace sonar {

using motion::Format;
using motion::Frame;

TrajectoryKeys::TrajectoryKeys(text::Map& map)
    : file(map.optional("file")),
      format(map.optional("format")),
      frame(map.optional("frame")),
      rate_hz(map.optional("rate_hz")),
      body(map.optional("body")) {}

NamedTrajectoryFile read_trajectory_file(const TrajectoryKeys& keys, const std::filesystem::path& folder) {
  NamedTrajectoryFile named;
  motion::ReadOptions options;
  options.format = keys.format.choice_or(
      Format::automatic, {{"csv", Format::csv}, {"tum", Format::tum}, {"euroc", Format::euroc}, {"kitti", Format::kitti}});
  if (keys.frame) options.frame = keys.frame.choice<Frame>({{"ENU_FLU", Frame::enu_flu}, {"NED_FRD", Frame::ned_frd}});
  if (keys.rate_hz) options.rate_hz = keys.rate_hz.number(text::Range::between(0.001, 1e6));
  named.body = keys.body.text_or({}, 64);
  const std::string name = keys.file.text(1024);
  if (name.empty()) return named;  // it said so
  named.path = folder / name;
  auto file = motion::load_trajectories(named.path, options);
  if (file)
    named.file = *std::move(file);
  else
    keys.file.fail(file.error().text);
  return named;
}

}  // namespace sonar
