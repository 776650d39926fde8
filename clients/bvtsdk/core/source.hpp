// The source or target of a sonar's pings: a live link, a recording being played, or a recording being written.
// Sonar and Head use it; any thread may call it.
#pragma once

#include <memory>
#include <string>

#include "clients/bvtsdk/core/codes.hpp"
#include "clients/bvtsdk/core/description.hpp"
#include "clients/bvtsdk/core/link.hpp"
#include "clients/bvtsdk/core/polar_ping.hpp"
#include "clients/bvtsdk/core/recording.hpp"
#include "protocol/blueview/link.hpp"

namespace sonar::bvt {

using blueview::Key;

struct RangeLimits {
  float start_m = 0, stop_m = 0;
};

class Source {
 public:
  explicit Source(SonarDescription sonar) : sonar_(std::move(sonar)) {}
  virtual ~Source() = default;
  const SonarDescription& sonar() const { return sonar_; }

  virtual bool is_file() const { return true; }
  virtual bool connected() const { return false; }
  /// `value` receives the applied value, which may be the nearest valid one. Recordings accept every value.
  virtual int set(int /*head*/, Key, std::int32_t& /*value*/) { return success; }
  virtual int set(int /*head*/, Key, float& /*value*/) { return success; }
  virtual int set(int /*head*/, RangeLimits&) { return success; }
  virtual int get(int /*head*/, RangeLimits&) { return success; }

  /// A recording gives ping n, or the next one if n < 0. A live sonar makes a new ping, whatever n is; the sonar waits at most
  /// `patience` for it, and the link 5 s longer. `settings` holds the settings of the head; a recording replaces them with those
  /// of the recorded ping.
  virtual int get_ping(int /*head*/, int /*n*/, std::chrono::milliseconds /*patience*/, PolarPing&,
                       HeadDescription& /*settings*/) {
    return not_implemented;
  }
  virtual int put_ping(int /*head*/, const PolarPing&, const HeadDescription& /*settings*/) { return read_only_file; }
  virtual int put_event(const EventMark&) { return read_only_file; }
  virtual int ping_count(int /*head*/) const { return 1; }
  virtual int ping_count() const { return 0; }  // pings of all heads in a recording
  virtual int nav_count() const { return 0; }
  virtual int kilobytes() const { return 0; }  // size of a recording
  virtual void close() {}

 private:
  const SonarDescription sonar_;
};

/// Returns the codes of Link::open.
Code open_live(const std::string& endpoint, int abi, std::shared_ptr<Source>& source);
/// Returns the codes of RecordingReader::open.
Code open_recording(const std::string& path, std::shared_ptr<Source>& source);
/// Returns the codes of RecordingWriter::create. The recording has the description of that sonar.
Code create_recording(const std::string& path, const SonarDescription& sonar, std::shared_ptr<Source>& source);

}  // namespace sonar::bvt
