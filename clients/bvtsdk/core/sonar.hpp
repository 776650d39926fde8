// A sonar of the SDK and its heads: implements BVTSonar_* and BVTHead_* of both interfaces.
#pragma once

#include <string>
#include <vector>

#include "clients/bvtsdk/core/objects.hpp"
#include "clients/bvtsdk/core/source.hpp"

namespace sonar::bvt {

/// The facades hold `mutex` during a call, also while a ping is waited for.
class Head : public Object {
 public:
  Head(std::shared_ptr<Source> source, const HeadDescription& description);

  /// Settings last applied, or held when the ping of a recording was made. Other hosts of the same sonar are not asked.
  HeadDescription now;
  HeadImaging imaging;
  int transmit = 1, ping_interval_ms = 0, dynamic_power = 0, mount = 0;  // mount is kept and read back only

  /// bad_parameter for a non-finite number; else the code of the sonar (bad_range). `now` receives the applied value.
  int set_range(float start_m, float stop_m);
  int set_start(float start_m);
  int set_stop(float stop_m);
  /// One integer setting of the sonar and where it is kept here.
  int set(Key key, int value, std::int32_t& kept);
  int set(Key key, float value, float& kept);

  int get_ping(int n, std::shared_ptr<PingObject>& ping);
  int put_ping(const PingObject& ping) { return source_->put_ping(now.id, ping.polar, ping.settings); }
  int ping_count() const { return source_->ping_count(now.id); }

  void* borrowed = nullptr;  // 3.x: the one handle, which belongs to the sonar

 private:
  const std::shared_ptr<Source> source_;
  const std::shared_ptr<Imager> imager_ = std::make_shared<Imager>();
};

class Sonar : public Object {
 public:
  ~Sonar() override { reset(); }

  /// "NET" and an address, or "FILE" and a path. What was open is closed: for NET first, also when it fails; for FILE once the
  /// file is open, because hosts look for the next part of a recording in this way and go on with what they have (verified).
  int open(const std::string& type, const std::string& parameter, int abi);
  /// Becomes a new recording of that sonar.
  int create_file(const std::string& path, const SonarDescription& of);
  /// Closes link or file; remaining heads then return errors, and 3.x handles of heads are invalid.
  void reset();
  /// no_head for a number it does not have, net_not_connected before it is open.
  int head(int number, std::shared_ptr<Head>& head) const;

  const Source* source() const { return source_.get(); }  // null: not open
  /// Its description, with the current settings. Waits for calls on its heads. Only while it is open.
  SonarDescription description() const;
  int put_event(const std::string& key, const std::string& text);
  int set_local_clock(int on);
  int local_clock() const { return local_clock_; }

 private:
  void use(std::shared_ptr<Source> source);

  std::shared_ptr<Source> source_;
  std::vector<std::shared_ptr<Head>> heads_;
  std::int32_t local_clock_ = 0;
};

}  // namespace sonar::bvt
