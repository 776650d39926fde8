// The SDK's objects for a sonar and its heads. They implement BVTSonar_* and BVTHead_* of the interfaces 3.x and 4.x.
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "clients/bvtsdk/core/colour_maps.hpp"
#include "clients/bvtsdk/core/description.hpp"
#include "clients/bvtsdk/core/imaging.hpp"
#include "clients/bvtsdk/core/range_list.hpp"
#include "clients/bvtsdk/core/source.hpp"

namespace sonar::bvt {

// Handles that programs get instead of pointers. A handle is a number below 2^31 cast to the pointer type, so that a truncation
// to 32 bits (by Python's ctypes) does not change it. Stale and foreign handles are detected.

/// Base of all objects that have handles. The facades hold `mutex` while a call works on the object.
struct Object {
  virtual ~Object() = default;
  std::mutex mutex;
};

/// The table of handles. A handle has 20 bits of index and 11 bits of generation: up to 1 048 575 objects at a time.
class Handles {
 public:
  /// Adds an object and returns its handle; null if the table is full.
  void* add(std::shared_ptr<Object> object);
  /// Returns the object of a handle; null if the handle is null, stale, foreign, or of another type.
  template <class T>
  std::shared_ptr<T> find(const void* handle) {
    return std::dynamic_pointer_cast<T>(find_any(handle));
  }
  /// Invalidates the handle and returns its object; null where find() returns null.
  template <class T>
  std::shared_ptr<T> remove(const void* handle) {
    return find<T>(handle) ? std::dynamic_pointer_cast<T>(remove_any(handle)) : nullptr;
  }
  std::size_t live();

 private:
  struct Slot {
    std::shared_ptr<Object> object;
    std::uint32_t generation = 1;
  };
  Slot* slot_of(const void* handle);
  std::shared_ptr<Object> find_any(const void* handle);
  std::shared_ptr<Object> remove_any(const void* handle);

  std::mutex mutex_;
  std::vector<Slot> slots_;
  std::deque<std::uint32_t>
      free_;  // indices are reused in the order in which they were freed, so that stale handles are detected for a long time
  std::size_t live_ = 0;
};

/// The only table of this library. It is never destroyed, because programs destroy handles in destructors of global objects.
Handles& handles();

// The simpler objects that handles refer to: pings, images, range lists, navigation, generators, mappers, discovery agents.
// Sonars and heads are below. The facades lock an object's mutex around each call on it.

struct NavObject : Object {
  NavData nav;
};

struct MagImageObject : Object {
  MagImage image;
};

struct ColourImageObject : Object {
  ColourImage image;
};

struct RangeListObject : Object {
  RangeList list;
};

struct ColourMapperObject : Object {
  ColourMapper mapper;
};

struct DiscoveryObject : Object {
  DiscoveryAgent agent;
};

/// Image settings of a head. Each ping keeps a copy of the settings at its time, for BVTPing_GetImage and related functions.
struct HeadImaging {
  ImageType type = ImageType::xy;
  ImageSettings image;
  RangeListSettings ranges;
};

struct PingObject : Object {
  PolarPing polar;
  HeadDescription settings;  // settings of the head when this ping was made
  HeadImaging imaging;
  std::shared_ptr<Imager> imager;  // shared with the head, so that its tables are used again
  void* range_data = nullptr;      // 3.x: belongs to the ping and is destroyed with it
  ~PingObject() override {
    if (range_data) handles().remove<RangeListObject>(range_data);
  }
};

/// Makes images of pings; only the 4.x interface has it.
struct ImageGeneratorObject : Object {
  bool has_head = false;
  ImageSettings image;
  RangeListSettings ranges;
  Imager imager;
};

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
