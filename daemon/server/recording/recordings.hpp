// Recordings in the daemon. Control starts and stops recordings, devices pass the pings that they send, and the writer thread
// writes the files. App owns the object. All functions are called on the I/O thread.
//
// Sending never waits for a file, because recorded pings wait in memory, up to a limit. Beyond the limit, or if a file fails, the
// recording ends with one log line; the file is still readable.
#pragma once

#include <functional>
#include <list>
#include <memory>
#include <string>
#include <vector>

#include "core/base/result.hpp"
#include "core/scene/scene.hpp"
#include "daemon/config/config.hpp"
#include "daemon/server/recording/recording_file.hpp"
#include "daemon/server/recording/writer_thread.hpp"
#include "daemon/server/system/log.hpp"
#include "protocol/control/operations.hpp"

namespace sonar {

namespace v1 {  // from control.pb.h
class RecordingStatus;
}  // namespace v1

class Recordings {
 public:
  static constexpr std::size_t most_at_once = 4, most_remembered = 8;
  static constexpr std::size_t default_most_waiting_bytes = 64u << 20;  // limit for all recordings together
  /// Called once when the recording has begun or ended, possibly before start() or stop() returns, but never after finish().
  using Done = std::function<void(const Result<void>&)>;

  /// `on_change` is called when a recording has ended.
  Recordings(WriterThread& writer, const Config& config, Log& log, std::function<void()> on_change,
             std::size_t most_waiting_bytes = default_most_waiting_bytes);
  ~Recordings();
  Recordings(const Recordings&) = delete;
  Recordings& operator=(const Recordings&) = delete;

  /// Lists the newest existing files of the folder as ended recordings.
  void find_earlier();
  /// Starts a recording. `who` is the requester's name for the log. Errors: usage (a bad file name, or recording is not
  /// configured), io, unavailable.
  void start(const control::StartRecording& asked, RecordedSonar sonar, const std::string& who, Done done);
  /// Stops a recording, or all if the name is empty.
  void stop(const control::StopRecording& asked, Done done);
  /// Ends the recordings of a sonar that stops.
  void end_of(const std::string& sonar, const std::string& why);
  /// Finishes all files when the daemon stops; no callback is called.
  void finish();

  bool takes(const std::string& sonar) const;
  /// True if a recording of the sonar needs the first hits of beams. Only MCAP files contain them.
  bool wants_truth(const std::string& sonar) const;
  bool wants_labels(const std::string& sonar) const;
  void take(const std::string& sonar, RecordedPing ping);

  /// Writes an entry of the journal of faults, in JSON, into MCAP files.
  void take_fault(const std::string& sonar, Time at, const std::string& json);

  /// Call it before anything is recorded, and whenever another scene is used.
  void use_scene(const Scene& scene);
  /// Returns the names of objects and bodies in the present scene.
  const std::shared_ptr<const SceneNames>& names() const { return names_; }

  /// Returns the open recordings and the last ones that have ended, oldest first.
  std::vector<v1::RecordingStatus> status() const;
  /// True if no recording is open.
  bool idle() const { return running() == 0; }

 private:
  struct Work {  // used by the writer thread only
    std::unique_ptr<RecordingFile> file;
    bool failed = false;
  };
  struct Recording;
  using Pointer = std::shared_ptr<Recording>;
  struct Outcome {
    Result<void> result;
    RecordingFile::Figures figures;
  };

  void on_thread(const std::shared_ptr<Work>& work, auto job, auto after);
  std::size_t running() const;
  /// True if `bytes` more bytes of this recording may wait. If not, ends the recording with most waiting bytes.
  bool has_room_for(const Pointer& recording, std::size_t bytes);
  Result<Pointer> begin(const control::StartRecording& asked, const RecordedSonar& sonar);
  /// Queues `job`, which writes `bytes` bytes, for the writer thread.
  void write(const Pointer& recording, std::size_t bytes, auto job);
  void end(const Pointer& recording, const std::string& why);
  void fail(const Pointer& recording, const std::string& why);
  void ended(const Pointer& recording, const Outcome& outcome);
  void remove_oldest();
  std::string why_none_to_stop(const std::string& file) const;

  WriterThread& writer_;
  const Config& config_;
  Log& log_;
  std::function<void()> on_change_;
  std::size_t most_waiting_bytes_;
  std::list<Pointer> recordings_;
  std::shared_ptr<const SceneNames> names_ = std::make_shared<const SceneNames>();
  bool finishing_ = false;
};

}  // namespace sonar
