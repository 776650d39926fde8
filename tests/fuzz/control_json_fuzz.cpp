// Fuzzes control requests in JSON, as sent over HTTP. The first line is the operation, and after a colon the sonar or object; the
// rest is the message. An accepted message is converted to protobuf and back. A refusal is one sentence of our own, not of
// protobuf.
#include <cmath>
#include <string_view>

#include "protocol/control/control.hpp"
#include "tests/fuzz/byte_script.hpp"

namespace {

using namespace sonar;
using fuzz::require;

bool usable(const Pose& pose) {
  return is_finite(pose.position_m) && is_finite(pose.orientation) && std::abs(norm_squared(pose.orientation) - 1) < 1e-9;
}
bool finite(const std::optional<double>& number) { return !number || std::isfinite(*number); }

struct Check {
  void operator()(const control::PoseSample& op) const { require(usable(op.pose)); }
  void operator()(const control::AddObject& op) const { require(usable(op.in_world)); }
  void operator()(const control::SetObject& op) const { require(!op.in_world || usable(*op.in_world)); }
  void operator()(const control::SetSonar& op) const {
    require(finite(op.range_m) && finite(op.rate_hz) && finite(op.gain_percent));
    const control::MountChange mount = op.mount.value_or(control::MountChange{});
    require(usable(Pose{mount.position_m.value_or(Vec3d{}), mount.orientation.value_or(Quatd{})}));
  }
  void operator()(const control::SetEnvironment& op) const {
    require(finite(op.temperature_c) && finite(op.salinity_psu) && finite(op.ph) && finite(op.sound_speed_mps));
  }
  void operator()(const control::Step& op) const { require(std::isfinite(op.dt_s)); }
  void operator()(const control::SetTrajectory& op) const { require(finite(op.position_s) && finite(op.speed)); }
  template <class Op>
  void operator()(const Op&) const {}
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const std::size_t end = std::min(text.find('\n'), size);
  const std::string_view line = text.substr(0, end), json = text.substr(std::min(end + 1, size));
  const std::size_t colon = std::min(line.find(':'), line.size());
  const auto request = control::request_from_json(line.substr(0, colon), json, line.substr(std::min(colon + 1, line.size())));
  if (!request) {
    const std::string& why = request.error().text;
    require(!why.empty() && why.find('\n') == std::string::npos && !why.starts_with("protobuf refuses it"));
    require(!control::json_of(control::StatusCode::refused, why).empty());
    return 0;
  }
  std::visit(Check{}, request->op);
  const auto again = control::decode_request(control::encode_request(*request));
  require(again && again->op.index() == request->op.index());
  return 0;
}
