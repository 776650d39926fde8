#include "daemon/server/recording/recordings.hpp"

#include <algorithm>
#include <utility>

#include "core/scene/instances.hpp"
#include "protocol/control/answers.hpp"

namespace sonar {
namespace {

constexpr const char* stop_requested = "stop requested";

std::vector<LogField> fields_of(const v1::RecordingStatus& status) {
  return {{"sonar", status.sonar()}, {"file", status.file()}, {"pings", status.pings()}, {"bytes", status.bytes()}};
}

std::string why_without_labels(RecordingFile::Kind kind, const RecordedSonar& sonar, const Switches& switches) {
  if (kind != &RecordingFile::mcap) return "labels are recorded in MCAP only: end the name in .mcap";
  if (sonar.has_range_images) return "range images have no labels; the truth in the file has what each column hits";
  if (switches.mode != Mode::canonical || switches.fixed_fan > 0)
    return "labels need the canonical model: sonard was started with another mode or a fixed fan";
  return {};
}

}  // namespace

/// The state of a recording is `opening` until the file is created, `running` until end(), then `ending` until the file is
/// closed. Only the I/O thread uses this struct, except `work`, which belongs to the writer thread.
struct Recordings::Recording {
  enum class State { opening, running, ending, ended } state = State::opening;
  std::string name;  // file name in the folder
  RecordingFile::Kind kind{};
  bool labels = false;
  v1::RecordingStatus status;
  std::size_t waiting_bytes = 0;
  bool failed = false;    // true: the recording failed, and the failure was logged
  std::string ends_with;  // reason, if the sonar stopped while the file was being opened
  std::vector<Done> at_end;
  std::shared_ptr<Work> work = std::make_shared<Work>();
};

Recordings::Recordings(WriterThread& writer, const Config& config, Log& log, std::function<void()> on_change,
                       std::size_t most_waiting_bytes)
    : writer_(writer), config_(config), log_(log), on_change_(std::move(on_change)), most_waiting_bytes_(most_waiting_bytes) {}

Recordings::~Recordings() = default;

// Runs `job` on the writer thread, then `after` on this thread with the result and the size of the file. All changes of state
// happen on this thread.
void Recordings::on_thread(const std::shared_ptr<Work>& work, auto job, auto after) {
  const auto figures = std::make_shared<RecordingFile::Figures>();
  writer_.run(
      [work, figures, job = std::move(job)]() mutable {
        const Result<void> result = WriterThread::attempt([&] { return job(*work); });
        work->failed |= !result;
        if (work->file) *figures = work->file->figures();
        return result;
      },
      [figures, after = std::move(after)](const Result<void>& result) mutable {
        after(Outcome{result, *figures});
      });
}

std::size_t Recordings::running() const {
  return static_cast<std::size_t>(std::count_if(recordings_.begin(), recordings_.end(),
                                                [](const Pointer& r) { return r->state != Recording::State::ended; }));
}

// ---- requests of the control interface

void Recordings::start(const control::StartRecording& asked, RecordedSonar sonar, const std::string& who, Done done) {
  const auto begun = begin(asked, sonar);
  if (!begun) return done(tl::make_unexpected(begun.error()));
  const Pointer recording = *begun;
  on_thread(
      recording->work,
      [folder = config_.recording.is_made ? config_.recording.folder : std::filesystem::path(),
       file = std::filesystem::path(recording->status.file()), kind = recording->kind, labels = recording->labels,
       sonar = std::move(sonar)](Work& work) -> Result<void> {
        if (std::error_code ec; !folder.empty() && !std::filesystem::create_directory(folder, ec) && ec)
          return failure(ErrorKind::io, folder.string() + ": cannot be made: " + ec.message());
        auto made = RecordingFile::create(file, kind, sonar, labels);
        if (!made) return tl::make_unexpected(made.error());
        work.file = std::move(*made);
        return {};
      },
      [this, recording, who, done = std::move(done)](const Outcome& outcome) {
        if (!outcome.result) {
          recordings_.remove(recording);
        } else {
          recording->state = Recording::State::running;
          log_.info("recording begun",
                    {{"sonar", recording->status.sonar()}, {"file", recording->status.file()}, {"client", who}});
          if (finishing_) return end(recording, "sonard stops");
        }
        if (!finishing_) done(outcome.result);
        if (outcome.result && !recording->ends_with.empty()) end(recording, recording->ends_with);
        on_change_();
      });
}

void Recordings::find_earlier() {
  struct Found {
    std::filesystem::file_time_type at;
    Pointer recording;
  };
  std::vector<Found> found;
  std::error_code ec;
  for (std::filesystem::directory_iterator file(config_.recording.folder, ec), end; !ec && file != end; file.increment(ec)) {
    std::error_code one;
    const std::string name = file->path().filename().string();
    if (!RecordingFile::is_recording(name) || !file->is_regular_file(one)) continue;
    if (file->is_symlink(one) && !RecordingFile::is_inside(config_.recording.folder, file->path())) continue;
    auto recording = std::make_shared<Recording>();
    recording->state = Recording::State::ended;
    recording->name = name;
    recording->status.set_file(file->path().string());
    recording->status.set_bytes(file->file_size(one));
    found.push_back({file->last_write_time(one), recording});
  }
  std::sort(found.begin(), found.end(), [](const Found& a, const Found& b) { return a.at < b.at; });
  for (const Found& one : found) {
    remove_oldest();
    recordings_.push_back(one.recording);
  }
}

/// Checks a request and adds the recording in state `opening`. The I/O thread does not access the file.
Result<Recordings::Pointer> Recordings::begin(const control::StartRecording& asked, const RecordedSonar& sonar) {
  if (config_.recording.folder.empty())
    return failure(ErrorKind::usage,
                   "sonard has no folder for recordings: set recording: {folder: DIR} in its configuration (docs/recording.md)");
  const auto kind = RecordingFile::kind_of(asked.file, sonar.vendor);
  if (!kind) return tl::make_unexpected(kind.error());
  if (const std::string why = asked.labels ? why_without_labels(*kind, sonar, config_.engine.switches) : ""; !why.empty())
    return failure(ErrorKind::usage, why);
  if (running() >= most_at_once)
    return failure(ErrorKind::unavailable, std::to_string(most_at_once) + " recordings are under way already: stop one");
  remove_oldest();
  auto recording = std::make_shared<Recording>();
  recording->name = asked.file;
  recording->kind = *kind;
  recording->labels = asked.labels;
  recording->status.set_sonar(sonar.name);
  recording->status.set_file((config_.recording.folder / asked.file).string());
  recording->status.set_running(true);
  recordings_.push_back(recording);
  return recording;
}

/// Removes the oldest ended recording from the list that the status shows.
void Recordings::remove_oldest() {
  while (recordings_.size() >= most_remembered) {
    const auto ended = [](const Pointer& r) { return r->state == Recording::State::ended; };
    recordings_.erase(std::find_if(recordings_.begin(), recordings_.end(), ended));  // one has ended, because few run at once
  }
}

/// Returns a sentence with the newest matching recording and the reason why it has already ended, for example a full disk.
std::string Recordings::why_none_to_stop(const std::string& file) const {
  const auto last = std::find_if(recordings_.rbegin(), recordings_.rend(), [&](const Pointer& r) {
    return (file.empty() || r->name == file) && !r->status.why().empty() && r->status.why() != stop_requested;
  });
  const std::string ended = last == recordings_.rend() ? "" : (*last)->name + " has ended: " + (*last)->status.why();
  if (file.empty()) return "nothing is being recorded" + (ended.empty() ? "" : "; " + ended);
  return ended.empty() ? "no recording is called \"" + file.substr(0, 128) + "\"" : ended;
}

/// Stops recordings. Calls `done` once, with the first error, when the last of the recordings is closed.
void Recordings::stop(const control::StopRecording& asked, Done done) {
  std::vector<Pointer> meant;
  for (const Pointer& r : recordings_)
    if (r->state != Recording::State::ended && (asked.file.empty() || asked.file == r->name)) meant.push_back(r);
  if (meant.empty()) return done(failure(ErrorKind::usage, why_none_to_stop(asked.file)));
  if (std::any_of(meant.begin(), meant.end(), [](const Pointer& r) { return r->state == Recording::State::opening; }))
    return done(failure(ErrorKind::unavailable, "the recording is being started: stop it after the answer to its start"));
  struct All {
    std::size_t left = 0;
    Result<void> first_error;
  };
  const auto all = std::make_shared<All>();
  all->left = meant.size();
  for (const Pointer& r : meant) {
    r->at_end.emplace_back([all, done](const Result<void>& outcome) {
      if (!outcome && all->first_error) all->first_error = outcome;
      if (--all->left == 0) done(all->first_error);
    });
    end(r, stop_requested);
  }
}

/// Ends the recordings of a sonar. A recording that is still opening cannot end yet, so start() ends it when the file is open.
void Recordings::end_of(const std::string& sonar, const std::string& why) {
  for (const Pointer& r : recordings_) {
    if (r->status.sonar() != sonar) continue;
    if (r->state == Recording::State::opening) r->ends_with = why;
    end(r, why);
  }
}

void Recordings::finish() {
  finishing_ = true;
  for (const Pointer& r : recordings_) {
    r->at_end.clear();
    end(r, "sonard stops");
  }
}

// ---- pings

bool Recordings::takes(const std::string& sonar) const {
  return std::any_of(recordings_.begin(), recordings_.end(),
                     [&](const Pointer& r) { return r->state == Recording::State::running && r->status.sonar() == sonar; });
}

bool Recordings::wants_truth(const std::string& sonar) const {
  return std::any_of(recordings_.begin(), recordings_.end(), [&](const Pointer& r) {
    return r->state == Recording::State::running && r->status.sonar() == sonar && r->kind == &RecordingFile::mcap;
  });
}

bool Recordings::wants_labels(const std::string& sonar) const {
  return std::any_of(recordings_.begin(), recordings_.end(), [&](const Pointer& r) {
    return r->state == Recording::State::running && r->status.sonar() == sonar && r->labels;
  });
}

void Recordings::use_scene(const Scene& scene) {
  auto names = std::make_shared<SceneNames>();
  for (const Object& object : scene.objects) names->objects.push_back(object.name);
  names->bodies = scene.body_names;
  for (std::size_t i = 0; i < instance_count(scene); ++i)
    names->instances.push_back({instance_name(scene, i), instance_class(scene, i)});
  names_ = std::move(names);
}

void Recordings::take(const std::string& sonar, RecordedPing ping) {
  for (const Pointer& r : recordings_)
    if (r->state == Recording::State::running && r->status.sonar() == sonar)
      write(r, ping.size(), [ping](RecordingFile& file) { return file.write(ping); });
}

void Recordings::take_fault(const std::string& sonar, Time at, const std::string& json) {
  for (const Pointer& r : recordings_)
    if (r->state == Recording::State::running && r->status.sonar() == sonar)
      write(r, json.size(), [at, json](RecordingFile& file) { return file.write_fault(at, json); });
}

/// Checks the limit of all recordings together. If it is exceeded, the recording with the most data in memory ends, which may be
/// another than `recording`.
bool Recordings::has_room_for(const Pointer& recording, std::size_t bytes) {
  const auto is_running = [](const Pointer& r) { return r->state == Recording::State::running; };
  std::size_t waiting = 0;
  Pointer most = recording;
  for (const Pointer& r : recordings_) {
    waiting += r->waiting_bytes;  // includes recordings that are ending, because their data are still in memory
    if (is_running(r) && r->waiting_bytes > most->waiting_bytes) most = r;
  }
  if (waiting > 0 && waiting + bytes > most_waiting_bytes_)
    fail(most,
         "its file is written too slowly: " + std::to_string(most->waiting_bytes / 1000000) + " MB of pings wait for the disk");
  return is_running(recording);
}

void Recordings::write(const Pointer& recording, std::size_t size, auto job) {
  if (!has_room_for(recording, size)) return;
  recording->waiting_bytes += size;
  on_thread(
      recording->work, [job = std::move(job)](Work& work) { return work.failed ? Result<void>{} : job(*work.file); },
      [this, recording, size](const Outcome& outcome) {
        recording->waiting_bytes -= size;
        recording->status.set_pings(outcome.figures.pings);
        recording->status.set_messages(outcome.figures.messages);
        recording->status.set_bytes(outcome.figures.bytes);
        if (!outcome.result) fail(recording, outcome.result.error().text);
      });
}

// ---- the end

/// Logs the first failure of a recording, which is also its result; ignores later failures.
void Recordings::fail(const Pointer& recording, const std::string& why) {
  if (recording->state != Recording::State::running && !(recording->state == Recording::State::ending && !recording->failed))
    return;
  recording->failed = true;
  recording->status.set_why(why);
  log_.error("recording stopped: " + why, fields_of(recording->status));
  end(recording, why);
}

/// Ends a recording. Waiting messages are written before the file is closed.
void Recordings::end(const Pointer& recording, const std::string& why) {
  if (recording->state != Recording::State::running) return;
  recording->state = Recording::State::ending;
  recording->status.set_running(false);
  recording->status.set_why(why);
  on_thread(
      recording->work, [](Work& work) { return work.file->close(); },
      [this, recording](const Outcome& outcome) { ended(recording, outcome); });
}

/// Called when the file is closed. Answers the requests to end the recording.
void Recordings::ended(const Pointer& recording, const Outcome& outcome) {
  if (!outcome.result) fail(recording, outcome.result.error().text);
  recording->state = Recording::State::ended;
  recording->status.set_bytes(outcome.figures.bytes);
  if (!recording->failed) log_.info("recording ended: " + recording->status.why(), fields_of(recording->status));
  const Result<void> result =
      recording->failed ? failure(ErrorKind::io, "the recording stopped before: " + recording->status.why()) : Result<void>{};
  for (const Done& done : std::exchange(recording->at_end, {})) done(result);
  on_change_();
}

std::vector<v1::RecordingStatus> Recordings::status() const {
  std::vector<v1::RecordingStatus> all;
  for (const Pointer& r : recordings_) all.push_back(r->status);
  return all;
}

}  // namespace sonar
