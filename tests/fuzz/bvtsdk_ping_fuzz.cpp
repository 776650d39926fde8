// Feeds the BlueView libraries bytes as from a sonar or a recording. No input may crash the decoders, and accepted pings give
// images and range lists of limited size. The first byte selects a ping's payload, a recording (R), or a recording whose
// checksums are corrected first (r), so that the code after the checks is reached.
#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>

#include "clients/bvtsdk/core/imaging.hpp"
#include "clients/bvtsdk/core/range_list.hpp"
#include "clients/bvtsdk/core/recording.hpp"

using namespace sonar::bvt;

namespace {

void require(bool holds) {
  if (!holds) std::abort();
}

void use(const PolarPing& ping, std::uint8_t wishes) {
  require(ping.samples.size() == static_cast<std::size_t>(ping.beams) * static_cast<std::size_t>(ping.bins));
  for (const Packing packing : {Packing::plain, Packing::planes}) require(decode_ping(encode_ping(ping, packing)).has_value());
  ImageSettings settings;  // images are small, so that thousands are made per second
  settings.requested_height = 1 + wishes % 40;
  settings.r_theta_width = wishes % 3 == 0 ? 0 : 1 + wishes % 50;
  settings.filter_flags = wishes % 5 == 0 ? 2 : wishes % 5 == 1 ? 16 : 0;
  settings.noise_threshold = wishes % 7 == 0 ? 0.3f : 0;
  settings.sound_speed_override_mps = wishes % 11 == 0 ? 1600 : 0;
  Imager imager;
  MagImage image;
  for (const ImageType type : {ImageType::xy, ImageType::r_theta}) {
    const Code code = imager.make(ping, type, settings, image);
    require(code == success || (code == no_ping_signal && !ping.has_signal()));
    require(image.pixels.size() == image.pixel_count());
    require(std::isfinite(image.pixel_range_m(image.height, image.width)));
    ImageGeometry geometry;
    require(plan_image(ping, type, {}, geometry) == code && geometry.pixel_count() <= 32000000);
  }
  RangeList list;
  RangeListSettings how;
  how.start_range_m = wishes;
  if (make_range_list(ping, how, list) == success) require(list.count() == ping.beams && list.valid_count() <= ping.beams);
}

void put_checksums_right(Bytes& bytes) {
  FrameHeader header;
  for (std::size_t at = 8; at + 20 <= bytes.size() && read_header({bytes.data() + at, bytes.size() - at}, header);) {
    const std::size_t size = frame_header_size + header.payload_size;
    if (bytes.size() - at < size + 4) return;
    Bytes crc;
    put(crc, static_cast<std::uint32_t>(crc32(0, bytes.data() + at, static_cast<uInt>(size))));
    std::copy(crc.begin(), crc.end(), bytes.begin() + static_cast<std::ptrdiff_t>(at + size));
    at += size + 4;
  }
}

void play_back(const std::uint8_t* data, std::size_t size, bool put_right) {
  if (size == 0) return;
  Bytes bytes(data, data + size);
  if (put_right) put_checksums_right(bytes);
  RecordingReader reader;
  if (reader.open(File(fmemopen(bytes.data(), bytes.size(), "rb"))) != success) return;
  PolarPing ping;
  for (int n = 0; n < std::min(reader.ping_count(0), 20); ++n) {
    if (reader.read_ping(0, n, ping) == success) use(ping, data[size - 1]);
    require(reader.hello_of_ping(0, n).size() <= size);
  }
  NavData nav;
  double time_s = 0;
  for (int n = 0; n < std::min(reader.nav_count(), 20); ++n)
    if (reader.read_nav(n, nav, time_s) == success) require(std::isfinite(time_s));
  EventMark mark;
  for (int n = 0; n < std::min(reader.event_count(), 20); ++n) reader.read_event(n, mark);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 2) return 0;
  if (data[0] == 'R' || data[0] == 'r') {
    play_back(data + 1, size - 1, data[0] == 'r');
  } else if (const auto ping = decode_ping({data + 1, size - 1})) {
    use(*ping, data[0]);
  }
  return 0;
}
