// Fuzzes trajectory files: the result is valid trajectories or a sentence that starts with the file's name.
#include <cmath>
#include <cstdlib>
#include <string_view>

#include "core/motion/trajectory_file.hpp"
#include "tests/fuzz/byte_script.hpp"

namespace {

using namespace sonar;
using namespace sonar::motion;

void check(const Trajectory& way) {
  const Points& p = way.points();
  fuzz::require(!p.times.empty() && p.times.front() >= Ns{0} && p.times.back() <= way.duration());
  fuzz::require(p.poses.size() == p.times.size());
  for (std::size_t i = 1; i < p.times.size(); ++i) fuzz::require(p.times[i - 1] < p.times[i]);
  for (const Ns t : {Ns{-1}, Ns{0}, p.times.front(), way.duration() / 3, way.duration() / 2, p.times.back(), way.duration()}) {
    const Moment m = way.at(t);
    fuzz::require(is_finite(m.body_in_world.position_m) && is_finite(m.moves.velocity_mps) &&
                  is_finite(m.moves.angular_velocity_radps));
    fuzz::require(std::abs(norm_squared(m.body_in_world.orientation) - 1) < 1e-6);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  ReadOptions options;
  options.format = static_cast<Format>(size % 7 < 5 ? 0 : size % 5);  // usually automatic
  if (size % 3 != 0) options.frame = size % 2 == 0 ? Frame::enu_flu : Frame::ned_frd;
  if (size % 4 == 0) options.rate_hz = 10;
  const std::string_view text = size == 0 ? std::string_view() : std::string_view(reinterpret_cast<const char*>(data), size);
  const auto file = parse_trajectories(text, "way", options);
  if (!file) {
    fuzz::require(file.error().text.starts_with("way:"));
    return 0;
  }
  fuzz::require(!file->bodies.empty());
  for (const TrajectoryFile::Body& body : file->bodies) {
    check(*body.trajectory);
    fuzz::require(trajectory_of(*file, "way", body.name).has_value());
  }
  return 0;
}
