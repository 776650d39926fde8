// The SDK's objects for a sonar and its heads. They implement BVTSonar_* and BVTHead_* of the interfaces 3.x and 4.x.
#pragma once

#include <string>
#include <vector>

#include "clients/bvtsdk/core/objects.hpp"
#include "clients/bvtsdk/core/source.hpp"

namespace sonar::bvt {

/// The facades hold Object::mutex during a call, also while the call waits for a ping.
class Head : public Object {
 public:
  Head(std::shared_ptr<Source> source, const HeadDescription& description);

  /// The settings that this program last applied, or those of the ping last read from a recording. Changes by other programs are
  /// not included.
  HeadDescription now;
  HeadImaging imaging;
  int transmit = 1, ping_interval_ms = 0, dynamic_power = 0, mount = 0;  // mount has no effect: it is stored and returned

  /// Returns bad_parameter if a number is not finite, else the code that the sonar returns, such as bad_range. `now` receives the
  /// applied value.
  int set_range(float start_m, float stop_m);
  int set_start(float start_m);
  int set_stop(float stop_m);
  /// Sets one setting of the sonar; `kept` receives the applied value.
  int set(Key key, int value, std::int32_t& kept);
  int set(Key key, float value, float& kept);

  int get_ping(int n, std::shared_ptr<PingObject>& ping);
  int put_ping(const PingObject& ping) { return source_->put_ping(now.id, ping.polar, ping.settings); }
  int ping_count() const { return source_->ping_count(now.id); }

  void* borrowed = nullptr;  // 3.x: the head's one handle, which the sonar owns

 private:
  const std::shared_ptr<Source> source_;
  const std::shared_ptr<Imager> imager_ = std::make_shared<Imager>();
};

class Sonar : public Object {
 public:
  ~Sonar() override { reset(); }

  /// `type` is "NET" with an address, or "FILE" with a path. NET closes the previous source first, even if opening then fails.
  /// FILE closes it only once the new file is open: programs try to open the next part of a recording in this way, and continue
  /// with the current part if there is none (verified).
  int open(const std::string& type, const std::string& parameter, int abi);
  /// Creates a recording of the sonar that `of` describes; this object then writes to it.
  int create_file(const std::string& path, const SonarDescription& of);
  /// Closes the link or file. After that, heads that the program still holds return errors, and 3.x handles of heads are invalid.
  void reset();
  /// Returns no_head if the sonar has no head of that number, and net_not_connected if the sonar is not open.
  int head(int number, std::shared_ptr<Head>& head) const;

  const Source* source() const { return source_.get(); }  // null: not open
  /// Returns the description with the current settings. Blocks until running calls on its heads have ended. Call it only while
  /// the sonar is open.
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
