#include "protocol/waterlinked/messages.hpp"

#include <algorithm>
#include <cstring>
#include <string>

#include "waterlinked.pb.h"

namespace sonar::waterlinked {
namespace {

namespace pb = ::waterlinked::sonar::protocol;

void set_time(google::protobuf::Timestamp& to, Time at) {
  const auto whole = std::chrono::floor<std::chrono::seconds>(at);
  to.set_seconds(whole.time_since_epoch().count());
  to.set_nanos(static_cast<std::int32_t>((at - whole).count()));
}
Time time_of(const google::protobuf::Timestamp& stamp) {
  return Time(std::chrono::seconds(stamp.seconds()) + std::chrono::nanoseconds(stamp.nanos()));
}

template <class Message>
void set_shot(Message& m, const Shot& shot) {
  set_time(*m.mutable_header()->mutable_timestamp(), shot.at);
  m.mutable_header()->set_sequence_id(shot.sequence);
  m.set_speed_of_sound(shot.speed_of_sound_mps);
  m.set_range(shot.range_m);
  m.set_frequency(shot.frequency);
  m.set_width(shot.width);
  m.set_height(shot.height);
  m.set_fov_horizontal(shot.horizontal_deg);
  m.set_fov_vertical(shot.vertical_deg);
}
template <class Message>
Shot shot_of(const Message& m) {
  return {time_of(m.header().timestamp()),
          m.header().sequence_id(),
          m.speed_of_sound(),
          m.range(),
          m.frequency(),
          m.width(),
          m.height(),
          m.fov_horizontal(),
          m.fov_vertical()};
}

template <class Message>
Bytes packed(const Message& message) {
  pb::Packet packet;
  packet.mutable_msg()->PackFrom(message);
  const std::string text = packet.SerializeAsString();
  Bytes bytes(text.size());
  if (!text.empty()) std::memcpy(bytes.data(), text.data(), text.size());
  return bytes;
}

}  // namespace

Bytes packet_of(const RangeMessage& message) {
  pb::RangeImage m;
  set_shot(m, message.shot);
  m.set_image_pixel_scale(message.pixel_scale_m);
  m.mutable_image_pixel_data()->Add(message.pixels.begin(), message.pixels.end());  // protobuf 3.12 has no Assign()
  return packed(m);
}

Bytes packet_of(const StrengthMessage& message) {
  pb::BitmapImageGreyscale8 m;
  set_shot(m, message.shot);
  m.set_image_pixel_data(message.pixels.data(), message.pixels.size());
  return packed(m);
}

// Vectors of all samples lie one after the other in one list of floats.
Bytes packet_of(const ImuMessage& message) {
  pb::ImuBatch m;
  m.set_batch_sequence_id(message.sequence);
  m.set_samples(static_cast<std::uint32_t>(message.samples.size()));
  for (const ImuMessage::Sample& sample : message.samples) {
    set_time(*m.add_timestamps(), sample.at);
    for (const float v : sample.specific_force_mps2) m.add_specific_force(v);
    for (const float v : sample.rate_radps) m.add_rate_of_turn(v);
  }
  return packed(m);
}

// A packet holds a google.protobuf.Any, whose type identifies one of the three messages.
Decoded decode(BytesView bytes) {
  Decoded out;
  pb::Packet packet;
  if (!packet.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) return out;
  pb::RangeImage ranges;
  pb::BitmapImageGreyscale8 strengths;
  pb::ImuBatch imu;
  if (packet.msg().UnpackTo(&ranges)) {
    out.ranges = RangeMessage{
        shot_of(ranges), ranges.image_pixel_scale(), {ranges.image_pixel_data().begin(), ranges.image_pixel_data().end()}};
  } else if (packet.msg().UnpackTo(&strengths)) {
    out.strengths = StrengthMessage{shot_of(strengths), {}};
    for (const char c : strengths.image_pixel_data()) out.strengths->pixels.push_back(static_cast<std::uint8_t>(c));
  } else if (packet.msg().UnpackTo(&imu)) {
    out.imu = ImuMessage{imu.batch_sequence_id(), {}};
    const int samples = std::min({imu.timestamps_size(), imu.specific_force_size() / 3, imu.rate_of_turn_size() / 3});
    for (int i = 0; i < samples; ++i) {
      ImuMessage::Sample& sample = out.imu->samples.emplace_back();
      sample.at = time_of(imu.timestamps(i));
      for (int axis = 0; axis < 3; ++axis) {
        sample.specific_force_mps2[static_cast<std::size_t>(axis)] = imu.specific_force(3 * i + axis);
        sample.rate_radps[static_cast<std::size_t>(axis)] = imu.rate_of_turn(3 * i + axis);
      }
    }
  }
  return out;
}

}  // namespace sonar::waterlinked
