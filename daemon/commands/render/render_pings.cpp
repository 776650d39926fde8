#include "daemon/commands/render/render_pings.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "core/image/draw_fan.hpp"
#include "core/pipeline/labels.hpp"
#include "core/pipeline/ping_engine.hpp"
#include "core/pipeline/water_line.hpp"
#include "core/text/format.hpp"
#include "daemon/commands/render/sidecar.hpp"
#include "daemon/emulator/view/ping_payloads.hpp"
#include "daemon/emulator/world/plausibility.hpp"
#include "daemon/server/engine/choose_engine.hpp"
#include "daemon/server/engine/start_engine.hpp"

namespace sonar::render {
namespace {

using std::filesystem::path;

Result<void> write_picture(const Ping& ping, bool rings, const path& file) {
  const auto colours = find_colour_map("viridis");
  if (!colours) return tl::make_unexpected(colours.error());
  const bool is_fan = ping.request.settings.beam_count > 1;
  const auto picture =
      is_fan ? draw_fan(polar_image_of(ping), {.width_px = 1000, .colours = *colours, .rings = rings}) : Raster(64, 64);
  if (!picture) return tl::make_unexpected(picture.error());
  const auto png = encode_png(*picture);
  if (!png) return tl::make_unexpected(png.error());
  return write_output(file, {*png});
}

/// A ping that is computed and then written to files.
struct MadePing {
  std::uint64_t number = 0;
  PingRequest request;
  Ping ping;
  PingStatistics count;
  Result<std::uint64_t> written = std::uint64_t{0};  // bytes written, or the error
};

/// Writes the sidecar last, so that a ping with a sidecar is complete. Returns the bytes written.
Result<std::uint64_t> write_ping(const RenderJob& job, const MadePing& made, const std::string& engine,
                                 const OutputFolder& folder) {
  const OutputOptions& o = folder.options();
  const Ping& ping = made.ping;
  const PingSettings& s = ping.request.settings;
  const auto rows = static_cast<std::size_t>(s.range_bin_count), beams = static_cast<std::size_t>(s.beam_count);
  const char* codes = s.format.bits == 8 ? "|u1" : s.format.bits == 16 ? "<u2" : "<u4";
  const std::string stem = folder.stem(made.number);
  if (o.complex && ping.beam_signal_upa.empty())
    return failure(ErrorKind::usage,
                   "the expected-power mode and the comparison modes have no complex beam signal; leave out --complex");
  Result<void> done;
  const auto put = [&](bool wanted, const char* end, const std::string& header, std::span<const std::byte> data) {
    if (wanted && done) done = write_output(stem + end, {bytes_of(header), data});
  };
  put(o.npy, "_pressure.npy", npy_header("<f4", {rows, beams}), std::as_bytes(std::span(ping.pressure_upa)));
  put(o.npy, "_samples.npy", npy_header(codes, {rows, beams}), ping.samples);
  put(o.complex, "_beams.npy", npy_header("<c8", {rows * static_cast<std::size_t>(s.samples_per_row), beams}),
      std::as_bytes(std::span(ping.beam_signal_upa)));
  put(o.raw, "_samples.raw", {}, ping.samples);
  if (o.labels) {
    const PingLabels& labels = *ping.labels;
    put(true, "_labels.npy", npy_header("<u2", {rows, beams}), std::as_bytes(std::span(labels.instance)));
    put(true, "_share.npy", npy_header("|u1", {rows, beams}), std::as_bytes(std::span(labels.share)));
    put(true, "_caster.npy", npy_header("<u2", {rows, beams}), std::as_bytes(std::span(labels.caster)));
    const nlohmann::json words{{"layout", layout_of(ping)}, {"annotations", annotations_of(labels, ping, *job.scene)}};
    put(true, "_labels.json", words.dump(1) + "\n", {});
  }
  if (done && o.png) done = write_picture(ping, o.rings, stem + ".png");
  if (done)
    done = write_output(stem + ".json", {bytes_of(sidecar(job, ping, engine, made.count, folder.digest()).dump(1) + "\n")});
  if (!done) return tl::make_unexpected(done.error());
  return folder.size_of(made.number);
}

Result<std::unique_ptr<PingEngine>> engine_for(const RenderJob& job, Parallel& pool, bool labels) {
  const auto make = [&](std::shared_ptr<const Scene> s) -> std::unique_ptr<PingEngine> {
    const EngineOptions options{.simd = job.config.engine.simd};
    if (labels) return make_cpu_engine(std::move(s), pool, options);
    return choose_engine(job.config.engine.device, std::move(s), pool, options,
                         [](const std::string& what) { std::fprintf(stderr, "sonard: %s\n", what.c_str()); });
  };
  return start_engine(make, job.scene);
}

/// Makes the pings of one job in batches. A GPU computes a batch at once; the CPU computes one ping after the other, with all
/// threads. While the pings of a batch are written in parallel, the device computes the next batch.
class JobRun {
 public:
  JobRun(const std::string& source, const RenderJob& job, const OutputFolder& folder, Parallel& pool, Progress& progress,
         const std::function<void(const Progress&)>& on_progress)
      : source_(source), job_(job), folder_(folder), pool_(pool), progress_(progress), on_progress_(on_progress) {}

  Result<void> make(std::uint64_t number, PingRequest request) {
    if (folder_.options().labels) {
      if (const std::string why = why_unlabelled(request, *job_.scene); !why.empty())
        return failure(ErrorKind::config, source_ + ": " + why);
      request.switches.keep_labels = true;
    }
    batch_.push_back({number, std::move(request), {}, {}, {}});
    return batch_.size() < static_cast<std::size_t>(folder_.options().batch) ? Result<void>{} : take_turns();
  }
  /// Counts a ping whose files exist already. Such a ping ends the batch.
  Result<void> keep() {
    if (!batch_.empty())
      if (auto done = take_turns(); !done) return done;
    ++progress_.kept;
    ++progress_.done;
    on_progress_(progress_);
    return {};
  }
  Result<void> finish() {
    auto done = batch_.empty() ? Result<void>{} : take_turns();
    return done ? take_turns() : done;
  }

 private:
  /// Submits the batch, and writes the previous one.
  Result<void> take_turns() {
    try {
      if (!batch_.empty())
        if (auto begun = submit(); !begun) return begun;
      std::swap(batch_, under_way_);
      return batch_.empty() ? Result<void>{} : write();
    } catch (const std::invalid_argument& refused) {
      return failure(ErrorKind::config, source_ + ": " + refused.what());
    } catch (const EngineUnavailable& gone) {
      return failure(ErrorKind::unavailable, gone.what());
    }
  }
  Result<void> submit() {
    if (!engine_) {  // the engine is started only when needed: a finished folder needs none
      auto started = engine_for(job_, pool_, folder_.options().labels);
      if (!started) return tl::make_unexpected(started.error());
      engine_ = *std::move(started);
    }
    std::vector<PingRequest> requests;
    for (const MadePing& made : batch_) requests.push_back(made.request);
    engine_->submit(requests);
    return {};
  }
  Result<void> write() {
    std::vector<Ping> pings = engine_->collect();
    const std::vector<PingStatistics> counts = engine_->statistics_of_each();
    for (std::size_t i = 0; i < batch_.size(); ++i) {
      batch_[i].ping = std::move(pings.at(i));
      batch_[i].count = counts.at(i);
    }
    // One description is valid for all pings, because the pings of a failed device are made again on the other device.
    const std::string description = engine_->description();
    pool_.for_each(batch_.size(),
                   [&](std::size_t i, int) { batch_[i].written = write_ping(job_, batch_[i], description, folder_); });
    for (const MadePing& made : batch_) {
      if (!made.written) return tl::make_unexpected(made.written.error());
      progress_.bytes += *made.written;
    }
    progress_.done += batch_.size();
    batch_.clear();
    on_progress_(progress_);
    return {};
  }

  const std::string& source_;
  const RenderJob& job_;
  const OutputFolder& folder_;
  Parallel& pool_;
  Progress& progress_;
  const std::function<void(const Progress&)>& on_progress_;
  std::unique_ptr<PingEngine> engine_;
  std::vector<MadePing> batch_, under_way_;  // the batch that is filled or written; the batch that is computed
};

PingRequest request_of(const RenderJob& job, const World& world, std::uint64_t number, Time at, const OutputOptions& o) {
  PingRequest request = make_request(job, world, PingNumber{static_cast<std::uint32_t>(number)}, at);
  request.switches.keep_pressure = o.npy;
  request.switches.keep_beams = o.complex;
  request.switches.keep_truth = true;
  return request;
}

}  // namespace

/// Returns the times of pings. Without --rate, each pose of a file gets a ping; otherwise pings have a constant rate, within the
/// time of the poses.
Result<std::vector<Time>> firing_times(const RenderJob& job, const OutputOptions& o) {
  const std::vector<Time> lines = pose_times(job);
  const std::uint64_t before = o.first - 1;
  // The number of pings to make, from --first on. `all`: number of pings that the poses cover;
  // `how`: end of the error's sentence.
  const auto count_of = [&](std::uint64_t all, const char* how) -> Result<std::uint64_t> {
    if (before < all && o.pings.value_or(1) <= all - before) return o.pings.value_or(all - before);
    const std::string asked = (before > 0 ? " --first " + std::to_string(o.first) : std::string()) +
                              (o.pings ? " --pings " + std::to_string(*o.pings) : std::string());
    return failure(ErrorKind::usage, asked.substr(1) + ": the poses cover only " + std::to_string(all) + how);
  };
  if (!lines.empty() && !o.rate_hz) {
    const auto n = count_of(lines.size(), ", one at each line; request fewer, or give --rate");
    if (!n) return tl::make_unexpected(n.error());
    const auto begin = lines.begin() + static_cast<std::ptrdiff_t>(before);
    return std::vector<Time>(begin, begin + static_cast<std::ptrdiff_t>(*n));
  }
  const double usual_hz = job.settings.rate_hz > 0 ? static_cast<double>(job.settings.rate_hz) : 10;
  const double rate_hz = o.rate_hz.value_or(usual_hz);
  const Time begin = lines.empty() ? Time{} : lines.front();
  std::uint64_t n = o.pings.value_or(1);
  if (!lines.empty()) {
    const auto fit =
        count_of(static_cast<std::uint64_t>(std::floor(seconds(lines.back() - begin) * rate_hz + 1e-6)) + 1, " at that rate");
    if (!fit) return tl::make_unexpected(fit.error());
    n = *fit;
  }
  std::vector<Time> times;
  for (std::uint64_t i = before; i < before + n; ++i) times.push_back(begin + nanoseconds_from(static_cast<double>(i) / rate_hz));
  return times;
}

/// Counts the pings of all jobs in air before any is rendered, because poses in the wrong frame are a common mistake.
std::string note_of_air(const RenderInput& input, const OutputOptions& o) {
  std::size_t all = 0, in_air = 0, above = 0;
  for (const RenderJob& job : input.jobs) {
    const auto times = firing_times(job, o);
    if (!times) return {};
    all += times->size();
    const World world = world_of(job);
    const SonarConfig& sonar = job.sonar();
    const Extent scene = surroundings_of(job.config, *job.scene).scene;
    const bool lies_above = !scene.empty() && scene.low_m.z >= 0;  // in such a scene z = 0 is not a water surface
    for (const Time at : *times) {
      const Pose sonar_in_world = compose(world.vehicle_at(sonar.vehicle, at), sonar.mount);
      const bool is_above = sonar_in_world.position_m.z > least_depth_m, gets_noise_only = is_in_air(sonar_in_world, *job.scene);
      in_air += gets_noise_only ? 1 : 0;
      above += is_above && !gets_noise_only && !lies_above ? 1 : 0;
    }
  }
  constexpr const char* cure = "were NED poses read as ENU? Check the poses and their frame";
  if (in_air > 0)
    return text::format(
        "%zu of %zu pings: the sonar is above the sea surface and receives noise only (z = 0 is the surface, lower is negative); "
        "%s",
        in_air, all, cure);
  if (above == 0) return {};
  return text::format(
      "%zu of %zu pings: the sonar is above z = 0, the usual sea surface; the scene has no sea_surface, so these pings are "
      "computed as in water; %s",
      above, all, cure);
}

/// Computes the times of all jobs first, so that an impossible request is refused before the folder changes.
Result<Progress> render_pings(const RenderInput& input, const OutputOptions& o, Parallel& pool,
                              const std::function<void(const Progress&)>& on_progress) {
  if (o.first > 1 && input.jobs.size() > 1)
    return failure(ErrorKind::usage,
                   "--first: " + input.source + " has a sweep, whose pings are numbered through all steps; leave out --first");
  Progress progress;
  std::vector<std::vector<Time>> times;
  for (const RenderJob& job : input.jobs) {
    auto of_job = firing_times(job, o);
    if (!of_job) return tl::make_unexpected(of_job.error());
    progress.all += of_job->size();
    times.push_back(*std::move(of_job));
  }
  const auto folder = OutputFolder::claim(input, o, digest_of(input, o.rate_hz.value_or(0), o.png && !o.rings));
  if (!folder) return tl::make_unexpected(folder.error());
  if (o.labels) {
    const std::string objects = instances_of(*input.jobs.front().scene).dump(1) + "\n";
    if (const auto done = write_output(o.folder / "objects.json", {bytes_of(objects)}); !done)
      return tl::make_unexpected(done.error());
  }
  std::uint64_t number = o.first;
  for (std::size_t j = 0; j < input.jobs.size(); ++j) {
    const RenderJob& job = input.jobs[j];
    const World world = world_of(job);
    JobRun run(input.source, job, *folder, pool, progress, on_progress);
    for (const Time at : times[j]) {
      const auto done = folder->holds(number) ? run.keep() : run.make(number, request_of(job, world, number, at, o));
      if (!done) return tl::make_unexpected(done.error());
      ++number;
    }
    if (const auto done = run.finish(); !done) return tl::make_unexpected(done.error());
  }
  return progress;
}

}  // namespace sonar::render
