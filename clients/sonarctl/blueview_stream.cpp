#include "clients/sonarctl/blueview_stream.hpp"

#include <algorithm>
#include <cmath>

#include "protocol/blueview/settings_override.hpp"

namespace sonar::clients {
namespace {

using namespace std::chrono_literals;
using blueview::FrameType;
using blueview::Put;

constexpr auto keep_alive_after = 2s;  // after the last message sent
constexpr std::uint16_t abi = 4;       // of the SDK; the answers do not depend on it

bvt::Bytes sdk_bytes(wire::BytesView bytes) {
  bvt::Bytes out(bytes.size());
  std::transform(bytes.begin(), bytes.end(), out.begin(), [](std::byte b) { return std::to_integer<std::uint8_t>(b); });
  return out;
}

/// "no head 3 (code 2010)"
std::string text_of_error(wire::BytesView payload) {
  wire::Reader reader(payload);
  std::int32_t code = 0;
  reader("code", code);
  return blueview::read_text(reader, "text") + " (code " + std::to_string(code) + ")";
}

}  // namespace

Result<BlueViewStream> BlueViewStream::open(Socket socket, const HeadRequest& request, std::chrono::milliseconds patience) {
  BlueViewStream stream(std::move(socket));
  if (Result<void> greeted = stream.greet(patience); !greeted) return tl::unexpected(greeted.error());
  if (Result<void> applied = stream.apply(request, patience); !applied) return tl::unexpected(applied.error());
  return stream;
}

Result<void> BlueViewStream::greet(std::chrono::milliseconds patience) {
  wire::Bytes hello;
  const Put write(hello);
  write("proto", blueview::protocol_version);
  write("abi", abi);
  blueview::put_text(hello, "sonarctl");
  const auto answer = ask(FrameType::hello, hello, patience);
  if (!answer) return tl::unexpected(answer.error());
  auto sonar = bvt::decode_description(sdk_bytes(*answer));
  if (!sonar || sonar->heads.empty()) return failure(ErrorKind::bad_data, "sends a greeting that describes no heads");
  sonar_ = *std::move(sonar);
  return {};
}

Result<void> BlueViewStream::apply(const HeadRequest& request, std::chrono::milliseconds patience) {
  if (!request.oculus_only.empty())
    return failure(ErrorKind::usage, request.oculus_only.front() + " applies to Oculus sonars; this is a " + sonar_.model +
                                         ": it accepts --mode (its heads, from 1), --range, --gain and --rate");
  const std::size_t wanted = request.head.value_or(0);
  if (wanted >= sonar_.heads.size())
    return failure(ErrorKind::usage, sonar_.model + " has " + std::to_string(sonar_.heads.size()) + " head(s), no mode " +
                                         std::to_string(wanted + 1));
  head_ = wanted;
  const bvt::HeadDescription& head = sonar_.heads[head_];
  if (request.range_m &&
      (*request.range_m <= static_cast<double>(head.start_m) || *request.range_m > static_cast<double>(head.max_range_m)))
    return failure(ErrorKind::usage, sonar_.model + " has a range of " + std::to_string(std::lround(head.start_m)) + " to " +
                                         std::to_string(std::lround(head.max_range_m)) + " m: give --range between");
  Result<void> done;
  if (request.range_m) done = set(blueview::Key::stop_range, static_cast<float>(*request.range_m), patience);
  if (done && request.gain_percent) done = set(blueview::Key::gain, blueview::gain_db_from(*request.gain_percent), patience);
  if (done && request.rate_hz)
    done = set(blueview::Key::ping_interval, static_cast<std::int32_t>(std::lround(1000 / *request.rate_hz)), patience);
  return done;
}

Result<void> BlueViewStream::set(blueview::Key key, const blueview::Value& value, std::chrono::milliseconds patience) {
  wire::Bytes payload;
  const Put write(payload);
  write("head", sonar_.heads[head_].id);
  write("key", key);
  blueview::put_value(payload, value);
  const auto answer = ask(FrameType::set, payload, patience);
  if (!answer) return tl::unexpected(answer.error());
  return {};
}

Result<wire::Bytes> BlueViewStream::ask(FrameType type, wire::BytesView payload, std::chrono::milliseconds patience) {
  const auto deadline = Clock::now() + patience;
  const std::uint32_t id = ++last_id_;
  if (Result<void> sent = send(type, id, payload); !sent) return tl::unexpected(sent.error());
  for (;;) {
    while (const auto frame = framer_.next()) {
      if (frame->header.request_id != id) continue;
      if (frame->header.type == FrameType::error)
        return failure(ErrorKind::bad_data, "refuses: " + text_of_error(frame->payload));
      return wire::Bytes(frame->payload.begin(), frame->payload.end());
    }
    if (!framer_.broken().empty()) return failure(ErrorKind::bad_data, framer_.broken());
    const Read read = receive(deadline);
    if (read.what == Wait::closed)
      return failure(ErrorKind::io,
                     sonar_.heads.empty()
                         ? "closed the connection before it answered: all its client slots are taken (clients.max)"
                         : "closed the connection before it answered: the daemon stopped, or closed it; see its log");
    if (read.what == Wait::timed_out) return failure(ErrorKind::unavailable, "does not answer on the BlueView link");
    if (read.what == Wait::interrupted) return failure(ErrorKind::io, "interrupted");
  }
}

Result<void> BlueViewStream::send(FrameType type, std::uint32_t id, wire::BytesView payload) {
  sent_at_ = Clock::now();
  return write_all(socket_, blueview::make_frame(type, id, payload));
}

Read BlueViewStream::receive(Clock::time_point deadline) {
  for (;;) {
    if (Clock::now() >= sent_at_ + keep_alive_after)
      if (Result<void> sent = send(FrameType::keep_alive, 0, {}); !sent) return {Wait::closed, 0, sent.error().text};
    const auto until = std::min(deadline, sent_at_ + keep_alive_after);
    const Read read = read_some(socket_, chunk_, std::chrono::ceil<std::chrono::milliseconds>(until - Clock::now()));
    if (read.what == Wait::timed_out && Clock::now() < deadline) continue;
    if (read.what == Wait::data) framer_.append(std::span<const std::byte>(chunk_).first(read.size));
    return read;
  }
}

BlueViewStream::Item BlueViewStream::next(std::chrono::milliseconds patience) {
  const auto deadline = Clock::now() + patience;
  for (;;) {
    if (!asked_) {
      wire::Bytes payload;
      const Put write(payload);
      write("head", sonar_.heads[head_].id);
      write("timeout_ms", std::uint32_t{0});  // no limit at the sonar
      if (Result<void> sent = send(FrameType::ping, ++last_id_, payload); !sent) return {Wait::closed, {}, sent.error().text};
      asked_ = true;
    }
    while (const auto frame = framer_.next())
      if (Item item = handle(*frame); item.what != Wait::timed_out) return item;
    if (!framer_.broken().empty()) return {Wait::closed, {}, framer_.broken()};
    if (!asked_) continue;
    if (const Read read = receive(deadline); read.what != Wait::data) return {read.what, {}, read.error};
  }
}

/// Wait::timed_out: a frame without data for the caller.
BlueViewStream::Item BlueViewStream::handle(const blueview::Frame& frame) {
  if (frame.header.request_id != last_id_) return {};
  if (frame.header.type == FrameType::error)
    return {Wait::closed, {}, "the sonar refuses to ping: " + text_of_error(frame.payload)};
  if (frame.header.type != FrameType::ping_data) return {};
  asked_ = false;
  std::string why;
  auto polar = bvt::decode_ping(sdk_bytes(frame.payload), &why);
  if (!polar) return {Wait::closed, {}, why};
  const double frequency_hz = sonar_.heads[head_].centre_hz;
  return {Wait::data, BlueViewPing{*std::move(polar), frequency_hz, blueview::header_size + frame.payload.size()}, {}};
}

}  // namespace sonar::clients
