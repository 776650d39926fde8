// Finds the device, or one decoded ping, for a user's source (address, discovery, recording, settings).
#pragma once

#include <algorithm>
#include <chrono>
#include <functional>
#include <optional>

#include "clients/sonarctl/commands.hpp"
#include "clients/sonarctl/control_client.hpp"

namespace sonar::clients {

std::chrono::milliseconds milliseconds_from(double s);

/// Returns an error if an output file is the recording that is being read.
Result<void> check_output(const SourceOptions& source, const std::filesystem::path& output);

/// Returns the given address, or that of a status broadcast; `say` prints the result.
Result<Endpoint> find_device(const SourceOptions& source, bool say);

/// A connection to a device, as a client with the requested settings or as an observer.
struct OpenedStream {
  PingStream stream;
  std::chrono::steady_clock::time_point connected_at;
  bool observes;   // true: no settings are sent, so pings are as the sonar's clients requested them
  Endpoint again;  // for open_again(): the sonar's own address, because its port for observers may change
};
/// Connects as an observer if source.observe is set. It also does so, with a note on standard error, if the sonar has no free
/// client slot and its sonard reports an address for observers.
Result<OpenedStream> open_stream(const SourceOptions& source, const Endpoint& device);

/// A connection to a sonard, and name and profile of one of its sonars.
struct Served {
  ControlClient control;
  std::string sonar, profile;
};
/// Finds the only sonar that the sonard at `control` serves at the device's address (port 0: any port). `make`: null = any.
/// Error usage: there are several; unavailable: there is none.
Result<Served> served_at(const ControlOptions& control, const Make* make, const Endpoint& device);

/// Calls find_device() and open_stream().
Result<OpenedStream> connect(const SourceOptions& source, bool say);

/// The time without a message, in a run of many pings.
class Silence {
 public:
  /// Keeps a reference to `source`.
  Silence(const SourceOptions& source, const OpenedStream& opened);
  void ends() { since_ = std::chrono::steady_clock::now(); }
  double left_s() const;  // time until the limit; if it is 0 or less, is_over() decides
  /// Returns true after source.silence_limit_s. An observer may get no pings because the sonar has no client: if sonard answers
  /// that it serves the connection, the time begins again.
  bool is_over();

 private:
  const SourceOptions& source_;
  bool observes_;
  Endpoint device_;     // as OpenedStream::again
  std::uint16_t port_;  // to which the stream is connected
  std::chrono::steady_clock::time_point since_ = std::chrono::steady_clock::now();
};

/// A time without pings. A new connection alone does not end it, because over UDP a connection can always be opened.
class Outage {
 public:
  using Clock = std::chrono::steady_clock;

  /// The time begins now, unless there is an outage already. The lost stream then waits less when it is destroyed.
  void begins(PingStream& lost);
  void ends() { since_.reset(); }
  double left_s(const SourceOptions& source) const;                      // time until source.return_limit_s is over
  const protocol::ChangedSettings& changed() const { return changed_; }  // by the host that has lost the sonar
  /// Returns when the next attempt may begin: at most once a second, also if the device ends each connection at once.
  Clock::time_point next_attempt() { return last_attempt_ = std::max(Clock::now(), last_attempt_ + std::chrono::seconds(1)); }

 private:
  std::optional<Clock::time_point> since_;
  protocol::ChangedSettings changed_;
  Clock::time_point last_attempt_;
};

/// Connects again after the stream was lost (`why`), within the remaining time of the outage; reports loss and return to `say`.
/// After Ctrl-C the error is `why`; otherwise it states that the device did not return.
Result<OpenedStream> open_again(SourceOptions source, const Endpoint& device, Outage& outage, const Error& why,
                                const std::function<void(const std::string&)>& say);

/// Writes to standard error.
void print_notices(const std::vector<std::string>& notices);

/// Returns the error for a connection that was closed (`item`) after `pings` pings. Kind usage: sonar or host refuse a setting.
Error closed(const PingStream::Item& item, std::uint64_t pings);

/// Returns the error if `what` did not arrive within source.silence_limit_s. `received`: some message of the make arrived.
Error silence(const SourceOptions& source, const OpenedStream& opened, bool received, const std::string& what,
              const std::string& hint);

/// Returns ping `number` (from 0) of a recording; nullopt: the first complete ping, else the last. `sonar`: selects one of
/// several sonars. Error usage: there are fewer pings.
Result<HostPing> read_ping(const std::filesystem::path& file, std::optional<std::size_t> number, const std::string& sonar = {});

/// Returns read_ping() of a recording, or the first ping of a device with the requested settings. If a picture consists of many
/// pings, it waits until the picture is complete or source.picture_limit_s is over; with `of_samples` it does not wait if single
/// pings have no picture.
Result<HostPing> fetch_ping(const SourceOptions& source, std::optional<std::size_t> number, bool of_samples = false);

}  // namespace sonar::clients
