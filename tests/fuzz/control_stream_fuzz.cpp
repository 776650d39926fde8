// Fuzzes the control stream. The first byte gives the length of the pieces; the rest is the stream, with lengths and requests.
// Checks that the messages do not depend on the pieces, that accepted ones are usable, and that every request gets an answer.
#include <algorithm>
#include <cmath>
#include <vector>

#include "protocol/control/answers.hpp"
#include "protocol/control/control.hpp"
#include "tests/fuzz/byte_script.hpp"

namespace {

using namespace sonar;
using fuzz::require;

void answer(std::span<const std::byte> message) {
  const auto request = control::decode_request(message);
  // No client can wait for the answer to a message that is skipped without being decoded.
  if (control::is_unasked_pose(message))
    require(request ? request->id == 0 && std::holds_alternative<control::PoseSample>(request->op) : request.error().id == 0);
  if (!request) {
    require(!request.error().why.empty());
  } else if (const auto* sample = std::get_if<control::PoseSample>(&request->op)) {
    require(is_finite(sample->pose.position_m) && is_finite(sample->pose.orientation));
    require(std::abs(norm_squared(sample->pose.orientation) - 1) < 1e-9);
  }
  const v1::Response response = request
                                    ? control::response_of(request->id, control::StatusCode::ok)
                                    : control::response_of(request.error().id, control::StatusCode::refused, request.error().why);
  const auto back = control::decode_response(control::encode_response(response));
  require(back && (*back)->id() == response.id() && (*back)->status().code() == response.status().code());
}

/// The messages of a stream; broken: the stream ended in an error.
struct Taken {
  std::vector<std::vector<std::byte>> messages;
  bool broken = false;
  bool operator==(const Taken&) const = default;
};
Taken take(std::span<const std::byte> stream, std::size_t piece) {
  Taken taken;
  control::DelimitedParser parser;
  for (std::size_t at = 0; at < stream.size() && !taken.broken; at += piece) {
    parser.feed(stream.subspan(at, std::min(piece, stream.size() - at)));
    auto message = parser.next();
    for (; message && *message; message = parser.next()) taken.messages.push_back(std::move(**message));
    taken.broken = !message;
  }
  return taken;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const auto stream = std::as_bytes(std::span(data, size)).subspan(1);
  const Taken whole = take(stream, std::max<std::size_t>(1, stream.size()));
  require(whole == take(stream, data[0] + std::size_t{1}));
  for (const auto& message : whole.messages) answer(message);
  return 0;
}
