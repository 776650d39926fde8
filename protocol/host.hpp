// The driver's side of a make's protocol, the counterpart of Dialogue: it makes the messages of a driver, and decodes pings from
// the bytes of a sonar. It has no sockets, clock or log. The caller opens the ports, passes on the bytes that arrive, and carries
// out the HostActions.
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "core/base/geometry.hpp"
#include "core/base/result.hpp"
#include "core/image/sonar_picture.hpp"
#include "protocol/recorded/codec.hpp"
#include "protocol/vendor.hpp"

namespace sonar::protocol {

/// A setting that a host changes in a sonar that keeps settings, in the words of the make. The host asks for it before and after
/// the change, and when it leaves.
struct ChangedSetting {
  std::string before, ours;  // empty: not known yet
  int answers = 0;
  /// Returns the value to put back, after the third answer; nullopt if another driver has changed the setting.
  std::optional<std::string> on_answer(const std::string& value);
  /// For a host that leaves before it has set anything: the next answer counts as the third if a host that has lost the sonar has
  /// set something. Returns whether this is so.
  bool ends_early();
};
using ChangedSettings = std::map<std::string, ChangedSetting, std::less<>>;  // by name

/// The settings that a user requests. For an unset value the sonar keeps its own, or the host sends that of a usual driver.
struct Wanted {
  bool as_it_is = false;                         // true: sends no settings, and requests pings only if the make needs it
  bool stamped = false;                          // true: prefers messages that state when a ping was fired
  SettingsOverride settings;                     // settings that all makes share
  std::map<std::string, std::string> more = {};  // settings of one make: name of sonarctl's option without dashes, and value
  ChangedSettings changed = {};                  // Host::changed() of a host that has lost the sonar
};

struct PingFacts {
  std::uint32_t number = 0;
  unsigned beams = 0, rows = 0, bits = 0;
  double row_m = 0, range_m = 0;  // range_m: far end of the last row
  double frequency_hz = 0;
  std::size_t message_size = 0;  // total size of the messages of the ping [bytes]
  std::string note = {};         // text at the end of a ping's line, such as its distance
};
/// A ping as a host decoded it.
struct HostPing {
  PingFacts facts;
  std::function<Result<PolarImage>()> picture;  // for a mechanical scan: the sector scanned so far
  /// For a picture of many pings (scan lines): the number of lines so far, and of a complete picture.
  std::size_t lines = 1, whole_lines = 1;
  std::vector<std::string> errors = {};           // violated identities, and errors of the sequence
  std::vector<std::string> echo_mismatches = {};  // settings that do not have the requested value yet
  std::vector<std::string> limited = {};          // settings that the ping echoes as requested, but that the sonar limited
  std::optional<double> fired_s = {};             // time of the ping in the device's clock
  /// Makes the drawing for users; empty: a fan of `picture` is drawn.
  std::function<SonarPicture()> drawing = {};
  bool is_whole() const { return lines >= whole_lines; }
};
/// Draws a ping of any make.
Result<SonarPicture> drawing_of(const HostPing& ping);

/// Bytes for a port of the host, counted from 0.
struct HostSend {
  std::size_t port = 0;
  Bytes bytes;
};
/// Actions that the caller carries out in order. A ResourceRequest is for port 0, of kind http; its reply is passed to
/// on_reply(). After an Error the host cannot continue. The text of the error begins with a verb whose subject is the sonar
/// ("refuses a request: ..."); with ErrorKind::usage it is a whole sentence.
using HostAction = std::variant<HostSend, ResourceRequest, HostPing, Notice, Error>;
using HostActions = std::vector<HostAction>;

/// A port that a host opens. A user may change the number of the first port.
struct HostPort {
  enum class Kind {
    tcp,         // connects to `number` of the device
    udp,         // sends to `number` of the device, and receives its answers
    udp_listen,  // receives at `number` (0: any free port), and as a member of the multicast group `group`, if there is one
    http,        // requests resources at `number`
  } kind{};
  std::uint16_t number = 0;
  Ipv4 group{};
};

class Host {
 public:
  virtual ~Host() = default;
  /// Called when the ports are open. `own`: local numbers of the ports.
  virtual HostActions on_open(std::span<const std::uint16_t> own, Time now) = 0;
  /// Reads a piece of a stream, of any size, or a datagram, with any content. It never throws, and limits the bytes that it
  /// keeps.
  virtual HostActions on_bytes(std::size_t port, BytesView received, Time now) = 0;
  virtual HostActions on_reply(const ResourceReply& /*reply*/, Time /*now*/) { return {}; }
  /// Sends keep-alives and repeats requests. Called at or after next_tick().
  virtual HostActions on_tick(Time /*now*/) { return {}; }
  virtual std::optional<Time> next_tick() const { return std::nullopt; }
  /// Called whenever the caller waits for a ping. Hosts that must request each ping then send a request.
  virtual HostActions on_demand(Time /*now*/) { return {}; }
  /// Called before the ports are closed. The host puts back the settings that it has changed, except for those that another
  /// driver has changed since. If it must ask for the present ones first, has_left() is false until it has the answers.
  virtual HostActions on_leave() { return {}; }
  virtual bool has_left() const { return true; }
  virtual ChangedSettings changed() const { return {}; }

  /// True if the sonar has answered and its settings have been requested.
  virtual bool is_open() const { return true; }
  /// Returns a text such as "an ARIS" or "a BlueView P900-90, serial 7001".
  virtual std::string about() const = 0;
  /// Counts of skipped bytes and missing pings, for protocols with framed messages and numbered pings.
  struct Counts {
    std::uint64_t messages = 0, dummies = 0, junk_bytes = 0, missing_pings = 0;
  };
  virtual std::optional<Counts> counts() const { return std::nullopt; }
  /// True if pings echo the sent settings, so that HostPing::echo_mismatches is meaningful.
  virtual bool expects_echo() const { return false; }
};

/// The content of a beacon that hosts need.
struct Announcement {
  Ipv4 address{}, client{};  // address to which hosts connect; address of the connected host (0.0.0.0 = none)
  std::uint32_t device_id = 0;
  std::vector<std::string> complaints;  // errors because of which hosts would reject the beacon
};
/// The broadcast with which hosts find sonars, and its answer.
struct Search {
  struct Answer {
    std::uint16_t port = 0;
    std::string about;  // such as "BlueView head P900-90 (7001)"
  };
  std::uint16_t port = 0;
  Bytes (*question)() = nullptr;
  std::optional<Answer> (*answer)(BytesView datagram) = nullptr;  // nullopt: it is not an answer
};

/// A make of sonar: the device's side and the driver's side. A new make is one folder and one row of makes.cpp.
struct Make {
  const Vendor* device = nullptr;
  std::string_view title;    // such as "an ARIS"
  std::string_view request;  // the message that requests pings, for the text "no valid ... among them"
  std::string_view remedy;   // such as "send a fire message (type 0x15)"
  std::span<const HostPort> ports;
  /// Errors: usage for a setting that this make does not have.
  Result<std::unique_ptr<Host>> (*host)(const Wanted& wanted) = nullptr;
  recording::Codec codec;
  std::optional<Announcement> (*announced)(BytesView beacon) = nullptr;  // nullopt: not a beacon; null: hosts need no beacon
  const Search* search = nullptr;                                        // null: hosts do not search

  std::string_view usual_settings = {};  // settings that a host sends if none are given, as options of sonarctl: "--rate 10"
  std::string_view driver_call = {};     // call that opens the sonar at {at}, for makes whose drivers use one of our libraries
  char own_faults = 0;                   // first letter of the codes of faults that only this make has
  bool each_ping_requested = false;      // true: hosts request each ping; the rate is only a limit
  bool own_numbers = false;              // true: ping numbers in messages differ from those in sonard's events
  bool shares_port = false;              // true: another make uses the same port, and the hosts of both accept both makes
  bool scans = false;                    // true: the turning head determines the ping rate
  std::string_view demo_name = {};       // NAME of `sonard --demo NAME`; empty: name()
  std::string_view demo_profile = {};    // product of the demo; empty: the first model
  std::optional<RollPitchYaw> demo_mount = {};  // mount in the demo; nullopt: the sonar points ahead
  PictureKind picture = PictureKind::fan;
  Shades shades = {};  // shades of its pictures

  std::string_view name() const { return device->name(); }
  bool has_several_streams() const { return std::ranges::count(ports, HostPort::Kind::tcp, &HostPort::kind) > 1; }
  bool is_by_udp() const { return ports.front().kind == HostPort::Kind::udp; }  // true: hosts send over UDP
  /// Returns the unit of the ping rate. In some kinds of pictures a ping is one line.
  std::string_view rate_unit() const {
    return picture == PictureKind::sweep || picture == PictureKind::waterfall ? "lines/s" : "Hz";
  }
  std::string_view name_in_demo() const { return demo_name.empty() ? name() : demo_name; }
};
/// Returns the rows of makes.cpp.
std::vector<Make> product_makes();
/// Returns all makes of the program, in the order of their rows.
std::span<const Make> makes();
/// Returns the make with this name, or null.
const Make* find_make(std::string_view name);
/// Returns the make of a product; for an unknown product the first make.
const Make& make_of_profile(std::string_view profile);

/// Checks that all requested settings are among `known`, the names of sonarctl's options: "range", "rate", "gain", "mode", ...
/// Errors: usage for another setting.
Result<void> accept_settings(const Wanted& wanted, std::string_view title, std::initializer_list<std::string_view> known);

}  // namespace sonar::protocol
