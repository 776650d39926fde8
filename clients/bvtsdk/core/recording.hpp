// Recordings in sonard's own format, BVER: pings, navigation and event marks as frames of the link, so that FILE mode plays back
// the data of NET mode. The vendor's .son files are proprietary and are refused.
//
// File: "BVER", u16 version = 2 (1: samples are not packed), u16 0; then frames (frame.hpp), each followed by the CRC-32 of its
// header and payload. The first frame is HELLO_OK. PING_DATA, NAV_DATA (u16 bitmap, values, f64 time) and EVENT_MARK (f64 time,
// text key, text) follow in order of arrival. Another HELLO_OK precedes each ping with other settings than the ping before. A
// closed file ends with an index frame: u32 entries, per entry u16 type, i32 head, f64 time, u64 offset of the frame, and at the
// end the u64 offset of the index frame itself. Without the index, readers scan up to the first damaged frame.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "clients/bvtsdk/core/bytes.hpp"
#include "clients/bvtsdk/core/codes.hpp"
#include "clients/bvtsdk/core/frame.hpp"
#include "clients/bvtsdk/core/polar_ping.hpp"

namespace sonar::bvt {

struct EventMark {
  double time_s = 0;  // seconds since 1970 UTC
  std::string key, text;
};

/// The position of a frame in the file.
struct FramePlace {
  FrameType type{};
  std::int32_t head = 0;  // pings only
  double time_s = 0;
  std::uint64_t offset = 0;
};

/// Writes a recording. Only one thread at a time may use it.
class RecordingWriter {
 public:
  /// Creates or overwrites the file. `hello`: payload of HELLO_OK. Returns file_create or file_write on failure.
  Code create(const std::string& path, BytesView hello);
  /// Every call writes whole frames to the file, so that it can be read while it grows. Returns file_not_open, file_write, or
  /// bad_parameter (too long) on failure. `head` replaces the head of the ping. `hello`: payload of HELLO_OK with the settings of
  /// the ping.
  Code put_ping(std::int32_t head, const PolarPing& ping, BytesView hello);
  Code put_nav(const NavData& nav, double time_s);
  Code put_event(const EventMark& mark);
  /// Appends the index and closes the file. The destructor does the same.
  Code close();
  ~RecordingWriter();
  RecordingWriter() = default;
  RecordingWriter(const RecordingWriter&) = delete;
  RecordingWriter& operator=(const RecordingWriter&) = delete;

  bool is_open() const { return file_ != nullptr; }
  std::uint64_t size_bytes() const { return size_; }
  int count(FrameType type) const;
  int ping_count(std::int32_t head) const;

 private:
  Code put_frame(FrameType type, BytesView payload, std::int32_t head, double time_s);

  File file_;
  std::uint64_t size_ = 0;
  Bytes hello_;  // the last one written
  std::vector<FramePlace> places_;
};

/// Reads a recording. Only one thread at a time may use it.
class RecordingReader {
 public:
  /// Errors: file_open, file_too_new, and file_header_bad (a damaged beginning, or a file of another kind, such as the vendor's
  /// .son). `why` is a line for the log.
  Code open(const std::string& path, std::string* why = nullptr);
  Code open(File file, std::string* why = nullptr);

  const Bytes& hello() const { return hello_; }  // payload of the first HELLO_OK
  /// Returns the payload of the HELLO_OK that applies to ping n of a head; without such, of the first HELLO_OK.
  Bytes hello_of_ping(std::int32_t head, int n);
  std::uint64_t size_bytes() const { return size_; }
  /// False if the writer did not close the file, or if its end is damaged.
  bool has_index() const { return has_index_; }

  /// Frames are numbered in order of arrival.
  int ping_count(std::int32_t head) const { return static_cast<int>(places(FrameType::ping_data, head).size()); }
  int nav_count() const { return static_cast<int>(places(FrameType::nav_data).size()); }
  int event_count() const { return static_cast<int>(places(FrameType::event_mark).size()); }
  /// Returns ping_number_too_small or ping_number_too_large, and file_read or bad_ping for a damaged ping; `why` is then a line
  /// for the log.
  Code read_ping(std::int32_t head, int n, PolarPing& ping, std::string* why = nullptr);
  /// Returns index_out_of_bounds or file_read on failure. `time_s`: time of the recording, seconds since 1970 UTC.
  Code read_nav(int n, NavData& nav, double& time_s);
  Code read_event(int n, EventMark& mark);

 private:
  struct Lane {  // the frames of one type; pings: also of one head
    FrameType type{};
    std::int32_t head = 0;
    std::vector<std::uint64_t> offsets;
  };
  const std::vector<std::uint64_t>& places(FrameType type, std::int32_t head = 0) const;
  void add(const FramePlace& place);
  bool read_frame(std::uint64_t offset, FrameHeader& header, Bytes& payload);
  bool read_index();
  void scan(std::uint64_t from);

  File file_;
  std::uint64_t size_ = 0;
  bool has_index_ = false;
  Bytes hello_;
  std::vector<Lane> lanes_;
};

}  // namespace sonar::bvt
