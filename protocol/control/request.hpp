// A request of the control protocol as a plain struct, and the codes of its answers.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "protocol/control/operations.hpp"
#include "protocol/control/pose_sample.hpp"

namespace sonar::control {

using Bytes = std::vector<std::byte>;
using BytesView = std::span<const std::byte>;

inline constexpr std::uint32_t protocol_version = 1;
inline constexpr std::size_t largest_datagram = 1200;
inline constexpr std::size_t largest_json = std::size_t{1} << 20;

struct Hello {
  std::uint32_t protocol_version = control::protocol_version;
  std::string name;
  std::string token = {};  // the content of control.token_file
};
struct Unsupported {  // a request that this version does not know
};
struct Request {
  std::uint64_t id = 0;
  std::variant<Unsupported, Hello, PoseSample, GetStatus, SetSonar, SetEnvironment, LoadScene, AddObject, RemoveObject, SetObject,
               SetTrajectory, Step, StartRecording, StopRecording, AddFault, EndFaults, GetFaults, Subscribe>
      op;
};
/// Numbers of v1::Status::Code.
enum class StatusCode { ok = 1, refused, unsupported, failed, unauthenticated };

struct RefusedRequest {  // a refused message, with the id that the Response repeats
  std::uint64_t id = 0;
  std::string why;
  bool pose = false;        // true for a malformed pose
  bool is_protobuf = true;  // true: a Request with wrong content; false: the bytes cannot be parsed
};

}  // namespace sonar::control
