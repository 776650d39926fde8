#include "clients/bvtsdk/core/recording.hpp"

#include <sys/types.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <new>

namespace sonar::bvt {
namespace {

constexpr std::uint16_t newest_version = 2;
constexpr std::size_t file_header_size = 8;
constexpr std::size_t crc_size = 4;
constexpr std::size_t index_entry_size = 2 + 4 + 8 + 8;
constexpr std::size_t most_lanes = 256;                // one for each type and head; a damaged index may name any number of heads
constexpr std::size_t index_tail_size = 8 + crc_size;  // the index frame's own offset, and its checksum

std::uint32_t checksum(BytesView header, BytesView payload) {
  auto crc = crc32(0, header.data, static_cast<uInt>(header.size));
  if (payload.size > 0) crc = crc32(crc, payload.data, static_cast<uInt>(payload.size));  // crc32(..., nullptr, 0) would return 0
  return static_cast<std::uint32_t>(crc);
}

bool seek(std::FILE* file, std::uint64_t offset) { return fseeko(file, static_cast<off_t>(offset), SEEK_SET) == 0; }

bool read_all(std::FILE* file, std::uint8_t* to, std::size_t size) { return std::fread(to, 1, size, file) == size; }

bool write_all(std::FILE* file, const Bytes& bytes) { return std::fwrite(bytes.data(), 1, bytes.size(), file) == bytes.size(); }

/// Fills in the index entry of a frame, except its offset. Returns false if frames of that type are not in the index, or the
/// payload is too short.
bool place_of(FrameType type, BytesView payload, FramePlace& place) {
  Reader reader(payload);
  place.type = type;
  if (type == FrameType::ping_data) {
    place.head = reader.read<std::int32_t>();
    reader.read<std::uint32_t>();
    place.time_s = reader.read<double>();
  } else if (type == FrameType::nav_data) {
    decode_nav(reader);
    place.time_s = reader.read<double>();
  } else if (type == FrameType::event_mark) {
    place.time_s = reader.read<double>();
  } else if (type != FrameType::hello_ok) {
    return false;
  }
  return reader.ok();
}

}  // namespace

Code RecordingWriter::create(const std::string& path, BytesView hello) {
  close();
  places_.clear();
  size_ = 0;
  file_.reset(std::fopen(path.c_str(), "wb"));
  if (!file_) return file_create;
  Bytes header{'B', 'V', 'E', 'R'};
  put(header, newest_version);
  put(header, std::uint16_t{0});
  if (!write_all(file_.get(), header)) return file_write;
  size_ = header.size();
  hello_.assign(hello.data, hello.data + hello.size);
  return put_frame(FrameType::hello_ok, hello_, 0, 0);
}

Code RecordingWriter::put_frame(FrameType type, BytesView payload, std::int32_t head, double time_s) {
  if (!file_) return file_not_open;
  if (payload.size > longest_payload) return bad_parameter;
  Bytes header, crc;
  put_header(header, {type, 0, 0, static_cast<std::uint32_t>(payload.size)});
  put(crc, checksum(header, payload));
  const bool written = write_all(file_.get(), header) &&
                       std::fwrite(payload.data, 1, payload.size, file_.get()) == payload.size && write_all(file_.get(), crc) &&
                       std::fflush(file_.get()) == 0;
  if (!written) {
    file_.reset();  // readers stop at a partial frame; the frames before it can be read
    return file_write;
  }
  if (size_ > file_header_size && type != FrameType::index) places_.push_back({type, head, time_s, size_});
  size_ += header.size() + payload.size + crc.size();
  return success;
}

Code RecordingWriter::put_ping(std::int32_t head, const PolarPing& ping, BytesView hello) {
  if (!file_) return file_not_open;
  if (!std::equal(hello_.begin(), hello_.end(), hello.data, hello.data + hello.size)) {
    hello_.assign(hello.data, hello.data + hello.size);
    if (const Code code = put_frame(FrameType::hello_ok, hello_, 0, 0); code != success) return code;
  }
  Bytes payload = encode_ping(ping, Packing::planes);
  Bytes number;
  put(number, head);
  std::copy(number.begin(), number.end(), payload.begin());  // the head's number is the first field
  return put_frame(FrameType::ping_data, payload, head, ping.time_s);
}

Code RecordingWriter::put_nav(const NavData& nav, double time_s) {
  Bytes payload;
  bvt::put_nav(payload, nav);
  put(payload, time_s);
  return put_frame(FrameType::nav_data, payload, 0, time_s);
}

Code RecordingWriter::put_event(const EventMark& mark) {
  Bytes payload;
  put(payload, mark.time_s);
  put_text(payload, mark.key);
  put_text(payload, mark.text);
  return put_frame(FrameType::event_mark, payload, 0, mark.time_s);
}

Code RecordingWriter::close() {
  if (!file_) return success;
  Bytes index;
  put(index, static_cast<std::uint32_t>(places_.size()));
  for (const FramePlace& place : places_) {
    put(index, static_cast<std::uint16_t>(place.type));
    put(index, place.head);
    put(index, place.time_s);
    put(index, place.offset);
  }
  put(index, size_);
  Code code = put_frame(FrameType::index, index, 0, 0);
  if (code == bad_parameter) code = success;  // more than about three million frames: no index, readers scan the file
  if (file_ && std::fclose(file_.release()) != 0) code = file_write;
  return code;
}

RecordingWriter::~RecordingWriter() {
  try {
    close();
  } catch (const std::bad_alloc&) {  // without an index the file is scanned
  }
}

int RecordingWriter::count(FrameType type) const {
  return static_cast<int>(std::count_if(places_.begin(), places_.end(), [=](const FramePlace& p) { return p.type == type; }));
}

int RecordingWriter::ping_count(std::int32_t head) const {
  return static_cast<int>(std::count_if(places_.begin(), places_.end(),
                                        [=](const FramePlace& p) { return p.type == FrameType::ping_data && p.head == head; }));
}

Code RecordingReader::open(const std::string& path, std::string* why) {
  File file(std::fopen(path.c_str(), "rb"));
  std::string reason = "cannot be opened; check that it exists and that you may read it";
  const Code code = file ? open(std::move(file), &reason) : file_open;
  if (why && code != success) *why = path + " " + reason;
  return code;
}

Code RecordingReader::open(File file, std::string* why) {
  *this = RecordingReader();
  const auto refuse = [&](Code code, const std::string& what) {
    *this = RecordingReader();
    if (why) *why = what;
    return code;
  };
  file_ = std::move(file);
  std::uint8_t start[file_header_size];
  if (!file_ || fseeko(file_.get(), 0, SEEK_END) != 0) return refuse(file_open, "cannot be read: it is not a regular file");
  const off_t end = ftello(file_.get());
  size_ = end > 0 ? static_cast<std::uint64_t>(end) : 0;
  if (!seek(file_.get(), 0) || !read_all(file_.get(), start, sizeof start) || std::memcmp(start, "BVER", 4) != 0)
    return refuse(file_header_bad,
                  "is not a recording of this library; the vendor's .son files are proprietary and cannot be read");
  const int version = start[4] | start[5] << 8;
  if (version > newest_version)
    return refuse(file_too_new, "is a recording of version " + std::to_string(version) + "; this library reads versions 1 and 2");
  FrameHeader header;
  if (version < 1 || !read_frame(file_header_size, header, hello_) || header.type != FrameType::hello_ok)
    return refuse(file_header_bad, "has no valid description of its sonar at its start; it is probably damaged");
  const std::uint64_t first = file_header_size + frame_header_size + hello_.size() + crc_size;
  has_index_ = read_index();
  if (!has_index_) scan(first);
  for (Lane& lane : lanes_)
    // hello_of_ping() searches these by bisection, and a damaged index may have them in any order.
    if (lane.type == FrameType::hello_ok) std::sort(lane.offsets.begin(), lane.offsets.end());
  return success;
}

bool RecordingReader::read_frame(std::uint64_t offset, FrameHeader& header, Bytes& payload) {
  Bytes head(frame_header_size);
  if (!file_ || offset > size_ || size_ - offset < frame_header_size + crc_size) return false;
  if (!seek(file_.get(), offset) || !read_all(file_.get(), head.data(), head.size()) || !read_header(head, header)) return false;
  // Checked first, so that a damaged size does not cause a huge allocation.
  if (size_ - offset - frame_header_size - crc_size < header.payload_size) return false;
  payload.resize(header.payload_size);
  std::uint8_t crc[crc_size];
  if (!read_all(file_.get(), payload.data(), payload.size()) || !read_all(file_.get(), crc, sizeof crc)) return false;
  return Reader({crc, sizeof crc}).read<std::uint32_t>() == checksum(head, payload);
}

bool RecordingReader::read_index() {
  std::uint8_t tail[index_tail_size];
  if (size_ < file_header_size + index_tail_size || !seek(file_.get(), size_ - index_tail_size) ||
      !read_all(file_.get(), tail, sizeof tail))
    return false;
  const auto offset = Reader({tail, sizeof tail}).read<std::uint64_t>();
  FrameHeader header;
  Bytes payload;
  if (!read_frame(offset, header, payload) || header.type != FrameType::index) return false;
  if (offset + frame_header_size + payload.size() + crc_size != size_) return false;
  Reader reader(payload);
  const std::size_t count = reader.read<std::uint32_t>();
  if (!reader.ok() || reader.left() != count * index_entry_size + 8) return false;
  for (std::size_t i = 0; i < count; ++i) {
    FramePlace place;
    place.type = static_cast<FrameType>(reader.read<std::uint16_t>());
    place.head = reader.read<std::int32_t>();
    place.time_s = reader.read<double>();
    place.offset = reader.read<std::uint64_t>();
    add(place);
  }
  return true;
}

void RecordingReader::scan(std::uint64_t from) {
  FrameHeader header;
  Bytes payload;
  while (read_frame(from, header, payload)) {
    FramePlace place;
    if (place_of(header.type, payload, place)) {
      place.offset = from;
      add(place);
    }
    from += frame_header_size + payload.size() + crc_size;
  }
}

void RecordingReader::add(const FramePlace& place) {
  const std::int32_t head = place.type == FrameType::ping_data ? place.head : 0;
  auto lane = std::find_if(lanes_.begin(), lanes_.end(), [&](const Lane& l) { return l.type == place.type && l.head == head; });
  if (lane == lanes_.end() && lanes_.size() == most_lanes) return;
  if (lane == lanes_.end()) lane = lanes_.insert(lane, Lane{place.type, head, {}});
  lane->offsets.push_back(place.offset);
}

const std::vector<std::uint64_t>& RecordingReader::places(FrameType type, std::int32_t head) const {
  static const std::vector<std::uint64_t> none;
  const auto lane = std::find_if(lanes_.begin(), lanes_.end(), [&](const Lane& l) { return l.type == type && l.head == head; });
  return lane == lanes_.end() ? none : lane->offsets;
}

Bytes RecordingReader::hello_of_ping(std::int32_t head, int n) {
  const auto& pings = places(FrameType::ping_data, head);
  const auto& hellos = places(FrameType::hello_ok);
  if (n < 0 || static_cast<std::size_t>(n) >= pings.size()) return hello_;
  const auto after = std::lower_bound(hellos.begin(), hellos.end(), pings[static_cast<std::size_t>(n)]);
  FrameHeader header;
  Bytes payload;
  if (after == hellos.begin() || !read_frame(*(after - 1), header, payload) || header.type != FrameType::hello_ok) return hello_;
  return payload;
}

Code RecordingReader::read_ping(std::int32_t head, int n, PolarPing& ping, std::string* why) {
  ping = PolarPing();
  const auto& offsets = places(FrameType::ping_data, head);
  if (n < 0) return ping_number_too_small;
  if (static_cast<std::size_t>(n) >= offsets.size()) return ping_number_too_large;
  FrameHeader header;
  Bytes payload;
  const auto refuse = [&](Code code, const std::string& what) {
    if (why)
      *why = "ping " + std::to_string(n) + " of head " + std::to_string(head) + " cannot be read: " + what +
             "; other pings may still be readable";
    return code;
  };
  if (!read_frame(offsets[static_cast<std::size_t>(n)], header, payload))
    return refuse(file_read, "its frame is cut off, or does not match its checksum");
  std::string reason = "the index points to a frame that is not this ping";
  auto decoded = header.type == FrameType::ping_data ? decode_ping(payload, &reason) : std::nullopt;
  if (!decoded || decoded->head != head) return refuse(bad_ping, reason);
  ping = std::move(*decoded);
  return success;
}

Code RecordingReader::read_nav(int n, NavData& nav, double& time_s) {
  nav = NavData();
  time_s = 0;
  const auto& offsets = places(FrameType::nav_data);
  if (n < 0 || static_cast<std::size_t>(n) >= offsets.size()) return index_out_of_bounds;
  FrameHeader header;
  Bytes payload;
  if (!read_frame(offsets[static_cast<std::size_t>(n)], header, payload) || header.type != FrameType::nav_data) return file_read;
  Reader reader(payload);
  nav = decode_nav(reader);
  time_s = reader.read<double>();
  return reader.ok() && std::isfinite(time_s) ? success : file_read;
}

Code RecordingReader::read_event(int n, EventMark& mark) {
  mark = EventMark();
  const auto& offsets = places(FrameType::event_mark);
  if (n < 0 || static_cast<std::size_t>(n) >= offsets.size()) return index_out_of_bounds;
  FrameHeader header;
  Bytes payload;
  if (!read_frame(offsets[static_cast<std::size_t>(n)], header, payload) || header.type != FrameType::event_mark)
    return file_read;
  Reader reader(payload);
  EventMark read;
  read.time_s = reader.read<double>();
  read.key = reader.text();
  read.text = reader.text();
  if (!reader.ok() || !std::isfinite(read.time_s)) return file_read;
  mark = std::move(read);
  return success;
}

}  // namespace sonar::bvt
