// Converts a Ping to the datagrams of a frame (header, order of channels, parts), and datagrams to a frame.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "protocol/aris/frame_header.hpp"
#include "protocol/aris/settings.hpp"
#include "protocol/vendor.hpp"

namespace sonar::aris {

inline constexpr std::size_t longest_datagram = 1400;  // an older sample program has a buffer of that size

/// Converts from the picture, [samples][beams] with beam 0 farthest to starboard, to the order in which the device digitises:
/// [pings][samples][16 channels].
Bytes raw_from_picture(BytesView picture, std::size_t samples, int pings);
Bytes picture_from_raw(BytesView raw, std::size_t samples, int pings);

/// Makes the datagrams of a frame. The first has the header; all have samples. `longest`: largest size of a datagram in bytes, at
/// least 1400.
std::vector<Bytes> parts_of(std::int32_t frame_index, BytesView header, BytesView samples,
                            std::size_t longest = longest_datagram);
std::vector<Bytes> encode_frame(const Ping& ping, const protocol::DeviceState& device, const Settings& settings);

/// Finds a field in the first datagram of a frame.
std::optional<protocol::Field> locate(protocol::FieldName name, BytesView first_part);
std::optional<std::pair<std::size_t, std::size_t>> locate(protocol::Region region, BytesView first_part);

Bytes make_beacon(const protocol::DeviceState& device);

/// Implements Vendor::change_integer() for a datagram of a frame, for two fields: ping_id (FrameIndex, which counts from 0) and
/// image_size (total_data_size).
bool change_part(protocol::FieldName name, const std::function<std::int64_t(std::int64_t)>& change, Bytes& part);
/// Implements Vendor::change_integer() for a beacon, for these fields: device_id; connected_address (not 0: a controller is
/// connected); device_status (bits of an Oculus: 0x4000 too hot, 0x8000 stopped by heat).
bool change_beacon(protocol::FieldName name, const std::function<std::int64_t(std::int64_t)>& change, Bytes& beacon);

/// A frame, assembled from all its parts.
struct DecodedFrame {
  std::int32_t index = 0;
  FrameHeader header;
  Bytes picture;  // [samples][beams], beam 0 farthest to starboard
  std::size_t samples = 0, beams = 0;
};
/// Collects the datagrams of a frame until it is complete. If the next frame begins before that, the incomplete frame is dropped
/// and counted.
class FrameAssembler {
 public:
  std::optional<DecodedFrame> add(BytesView datagram);
  std::uint64_t incomplete() const { return incomplete_; }

 private:
  std::optional<DecodedFrame> whole();
  std::int32_t index_ = 0;
  std::size_t total_ = 0, received_ = 0;
  bool done_ = true;
  Bytes header_, samples_;
  std::vector<bool> has_;  // for each byte of the samples: true if it has arrived
  std::uint64_t incomplete_ = 0;
};

}  // namespace sonar::aris
