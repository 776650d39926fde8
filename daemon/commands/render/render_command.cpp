#include "daemon/commands/options/commands.hpp"

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <optional>
#include <set>
#include <stdexcept>
#include <thread>
#include <utility>

#include "core/paper/paper_engine.hpp"
#include "daemon/commands/options/load_progress.hpp"
#include "daemon/commands/render/coverage.hpp"
#include "daemon/commands/render/render_job.hpp"
#include "daemon/commands/render/render_pings.hpp"
#include "daemon/config/products.hpp"
#include "daemon/emulator/world/plausibility.hpp"
#include "daemon/server/engine/start_engine.hpp"

namespace sonar::render {
namespace {

int threads_of(const EngineConfig& engine) {
  return engine.threads > 0 ? engine.threads : std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

/// Shows a bar on a terminal; elsewhere prints a line per second.
class ProgressLine {
 public:
  explicit ProgressLine(bool quiet) : quiet_(quiet) {}

  /// Prints the summary of the whole run.
  void conclude(const Progress& p) const {
    if (quiet_ || p.done == p.kept) return;
    const double taken_s = std::max(std::chrono::duration<double>(Clock::now() - begin_).count(), 1e-3);
    std::fprintf(stderr, "%llu pings in %.1f s: %.1f pings/s, %.1f MB/s written\n",
                 static_cast<unsigned long long>(p.done - p.kept), taken_s, static_cast<double>(p.done - p.kept) / taken_s,
                 static_cast<double>(p.bytes) / 1e6 / taken_s);
  }

  void show(const Progress& p) {
    const auto now = Clock::now();
    // The last line is always shown.
    const bool last = p.done == p.all;
    if (quiet_ || (!last && now - shown_ < (terminal_ ? std::chrono::milliseconds(100) : std::chrono::milliseconds(1000))))
      return;
    shown_ = now;
    const double taken_s = std::chrono::duration<double>(now - begin_).count();
    const double rate = static_cast<double>(p.done - p.kept) / std::max(taken_s, 1e-3);
    std::string bar;
    if (terminal_) {
      constexpr std::uint64_t width = 30;
      const auto full = static_cast<std::size_t>(width * p.done / std::max<std::uint64_t>(p.all, 1));
      bar = "\r[" + std::string(full, '#') + std::string(width - full, ' ') + "] ";
    }
    const std::string kept = p.kept > 0 ? ", " + std::to_string(p.kept) + " were there already" : "";
    std::fprintf(stderr, "%s%llu of %llu pings, %.1f a second%s%s", bar.c_str(), static_cast<unsigned long long>(p.done),
                 static_cast<unsigned long long>(p.all), rate, kept.c_str(), terminal_ && !last ? "" : "\n");
  }

 private:
  using Clock = std::chrono::steady_clock;
  bool quiet_, terminal_ = ::isatty(STDERR_FILENO) == 1;
  Clock::time_point begin_ = Clock::now(), shown_ = begin_;
};

Result<motion::TrajectoryFile> poses_of(const RenderCommand& command) {
  motion::ReadOptions options;
  if (!command.pose_frame.empty())
    options.frame = command.pose_frame == "NED_FRD" ? motion::Frame::ned_frd : motion::Frame::enu_flu;
  options.rate_hz = command.pose_rate_hz;
  return motion::load_trajectories(command.poses, options);
}

bool is_given_on(const EngineOptionsGiven& given, bool Switches::*part) {
  for (std::size_t i = 0; i < named_switches.size(); ++i)
    if (named_switches[i].is_on == part) return given.switches[i] == "on";
  return false;
}

Result<RenderInput> input_of(const RenderCommand& command) {
  auto input = load_render_input(command.config, command.sonar);
  if (!input) return input;
  for (RenderJob& job : input->jobs)
    if (const auto r = override_engine(job.config.engine, job.config.seed, command.engine); !r)
      return tl::make_unexpected(r.error());
  if (!command.poses.empty()) {
    const auto file = poses_of(command);
    if (!file) return tl::make_unexpected(file.error());
    for (RenderJob& job : input->jobs) {  // uses the body with the vehicle's name if there are several, as in the daemon
      const std::string body = file->bodies.size() > 1 ? job.vehicle().name : "";
      if (const auto r = follow(job, *file, command.poses, body); !r) return tl::make_unexpected(r.error());
    }
  }
  std::set<std::string> once;  // each note once, although a sweep repeats it for every step
  for (const RenderJob& job : input->jobs) {
    for (const std::string& note : {note_of_range(job), job.poses_note})
      if (!note.empty()) once.insert(note);
    for (std::string& note : notes_of_config(job.config)) once.insert(std::move(note));
    if (const motion::Plan& plan = job.vehicle().plan)
      for (const Note& note : notes_on_attitudes(carriers_of(job.config).at(job.sonar().vehicle), plan))
        once.insert(text_of(note));
  }
  input->notes.insert(input->notes.end(), once.begin(), once.end());
  bool is_noted = false;
  for (RenderJob& job : input->jobs) {
    // Motion that was requested is computed even if the poses look like snapshots.
    if (job.wants_motion || is_given_on(command.engine, &Switches::motion)) job.snapshots = false;
    if (job.snapshots && !std::exchange(is_noted, true))
      input->notes.push_back(note_of_snapshots(*job.vehicle().plan.trajectory));
  }
  return input;
}

Result<Coverage> coverage_of(const RenderJob& given, Parallel& pool) {
  // Only the bed is measured. keep_pressure keeps the pressures, because samples are rounded and limited.
  const RenderJob job = with_bed_only(given);
  const auto make = [&](std::shared_ptr<const Scene> s) {
    return make_engine(std::move(s), pool, {.simd = job.config.engine.simd});
  };
  const auto engine = start_engine(make, job.scene);
  if (!engine) return tl::make_unexpected(engine.error());
  PingRequest request = make_request(job, world_of(job), PingNumber{1}, Time{});
  request.switches.keep_pressure = true;
  try {
    return measure_coverage(job, (*engine)->run({&request, 1}).at(0));
  } catch (const std::invalid_argument& refused) {
    return failure(ErrorKind::config, job.name + ": " + refused.what());
  }
}

Result<void> report_coverage(const std::vector<RenderJob>& jobs) {
  Parallel pool(threads_of(jobs.front().config.engine));
  std::printf("%-32s %5s %8s %6s %9s %9s %9s %9s\n", "sonar", "beams", "range m", "rows", "bins", "within 1dB", "worst dB",
              "mean dB");
  for (const RenderJob& job : jobs) {
    const auto c = coverage_of(job, pool);
    if (!c) return tl::make_unexpected(c.error());
    std::printf("%-32s %5d %8.2f %6d %9zu %8.3f %% %+9.2f %+9.3f\n", job.name.c_str(), job.settings.beam_count,
                job.settings.range_m, job.settings.range_bin_count, c->bins, c->percent(), c->worst_db, c->mean_db);
    std::fflush(stdout);
  }
  return {};
}

/// Prints each note once, although a sweep repeats it for every step.
void print_notes(const RenderInput& input) {
  std::set<std::string> notes{note_of_parts_left_out(input.jobs.front().config.engine.switches)};
  for (const RenderJob& job : input.jobs) notes.insert(job.scene->notes.begin(), job.scene->notes.end());
  for (const std::string& note : notes)
    if (!note.empty()) std::fprintf(stderr, "sonard: %s\n", note.c_str());
}

OutputOptions output_options(const RenderCommand& command) {
  const auto wanted = [&](const char* format) {
    return std::find(command.formats.begin(), command.formats.end(), format) != command.formats.end();
  };
  OutputOptions options;
  options.folder = command.out;
  options.npy = wanted("npy");
  options.png = wanted("png");
  options.raw = wanted("raw");
  options.complex = command.complex;
  options.labels = command.labels;
  options.overwrite = command.overwrite;
  options.rings = command.image_rings != "off";
  options.batch = command.batch;
  options.first = command.first;
  options.pings = command.pings;
  options.rate_hz = command.rate_hz;
  return options;
}

}  // namespace

Result<void> run_render(const RenderCommand& command) {
  if (command.config.empty()) {
    std::vector<RenderJob> jobs = shipped_sonars_over_a_bed();
    for (RenderJob& job : jobs)
      if (const auto r = override_engine(job.config.engine, job.config.seed, command.engine); !r)
        return tl::make_unexpected(r.error());
    return report_coverage(jobs);
  }
  std::optional<LoadProgress> loading;
  if (!command.quiet) loading.emplace(LoadProgress::to_console);
  auto input = input_of(command);
  if (!input) return tl::make_unexpected(input.error());
  if (!command.report.empty()) {
    loading.reset();
    return report_coverage(input->jobs);
  }
  if (std::string note = note_of_air(*input, output_options(command)); !note.empty()) input->notes.push_back(std::move(note));
  if (!command.quiet) print_notes(*input);
  for (const std::string& note : input->notes) std::fprintf(stderr, "sonard: %s\n", note.c_str());
  ProgressLine line(command.quiet);
  Parallel pool(threads_of(input->jobs.front().config.engine));
  const auto done = render_pings(*input, output_options(command), pool, [&](const Progress& p) {
    loading.reset();  // the first ping is made
    line.show(p);
  });
  loading.reset();
  if (!done) return tl::make_unexpected(done.error());
  line.conclude(*done);
  return {};
}

}  // namespace sonar::render
