#include "daemon/commands/render/render_pings.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "core/image/draw_fan.hpp"
#include "core/pipeline/water_line.hpp"
#include "core/text/format.hpp"
#include "daemon/commands/render/npy.hpp"
#include "daemon/commands/render/sidecar.hpp"
#include "daemon/emulator/view/ping_payloads.hpp"
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

/// A ping on its way into files.
struct MadePing {
  std::uint64_t number = 0;
  PingRequest request;
  Ping ping;
  PingStatistics count;
  Result<std::uint64_t> written = std::uint64_t{0};  // bytes
};

/// Everything but the sidecar first: where that stands, the ping is whole. Returns how many bytes that was.
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
                   "there is no complex beam signal in expected power and in the comparison modes; leave out --complex");
  Result<void> done;
  const auto put = [&](bool wanted, const char* end, const std::string& header, std::span<const std::byte> data) {
    if (wanted && done) done = write_output(stem + end, {bytes_of(header), data});
  };
  put(o.npy, "_pressure.npy", npy_header("<f4", {rows, beams}), std::as_bytes(std::span(ping.pressure_upa)));
  put(o.npy, "_samples.npy", npy_header(codes, {rows, beams}), ping.samples);
  put(o.complex, "_beams.npy", npy_header("<c8", {rows * static_cast<std::size_t>(s.samples_per_row), beams}),
      std::as_bytes(std::span(ping.beam_signal_upa)));
  put(o.raw, "_samples.raw", {}, ping.samples);
  if (done && o.png) done = write_picture(ping, o.rings, stem + ".png");
  if (done)
    done = write_output(stem + ".json", {bytes_of(sidecar(job, ping, engine, made.count, folder.digest()).dump(1) + "\n")});
  if (!done) return tl::make_unexpected(done.error());
  return folder.size_of(made.number);
}

/// Makes the pings in one go, which is what a device wants; the CPU takes them one after the other, each by all threads. They are
/// written side by side.
Result<void> render_batch(const RenderJob& job, PingEngine& engine, const OutputFolder& folder, Parallel& pool,
                          std::vector<MadePing>& batch, Progress& progress) {
  std::vector<PingRequest> requests;
  for (const MadePing& made : batch) requests.push_back(made.request);
  std::vector<Ping> pings = engine.run(requests);
  const std::vector<PingStatistics> counts = engine.statistics_of_each();
  for (std::size_t i = 0; i < batch.size(); ++i) {
    batch[i].ping = std::move(pings.at(i));
    batch[i].count = counts.at(i);
  }
  const std::string description = engine.description();  // of all: what a device that fails had begun is made again
  pool.for_each(batch.size(), [&](std::size_t i, int) { batch[i].written = write_ping(job, batch[i], description, folder); });
  for (const MadePing& made : batch) {
    if (!made.written) return tl::make_unexpected(made.written.error());
    progress.bytes += *made.written;
  }
  batch.clear();
  return {};
}

Result<std::unique_ptr<PingEngine>> engine_for(const RenderJob& job, Parallel& pool) {
  const auto make = [&](std::shared_ptr<const Scene> s) {
    return choose_engine(job.config.engine.device, std::move(s), pool, {.simd = job.config.engine.simd},
                         [](const std::string& what) { std::fprintf(stderr, "sonard: %s\n", what.c_str()); });
  };
  return start_engine(make, job.scene);
}

}  // namespace

Result<std::vector<Time>> firing_times(const RenderJob& job, const OutputOptions& o) {
  const std::vector<Time> lines = pose_times(job);
  const std::uint64_t before = o.first - 1;
  // How many pings there are from the first wanted on, of the `all` pings that the poses cover.
  const auto count_of = [&](std::uint64_t all, const char* how) -> Result<std::uint64_t> {
    if (before < all && o.pings.value_or(1) <= all - before) return o.pings.value_or(all - before);
    const std::string asked = (before > 0 ? " --first " + std::to_string(o.first) : std::string()) +
                              (o.pings ? " --pings " + std::to_string(*o.pings) : std::string());
    return failure(ErrorKind::usage, asked.substr(1) + ": the poses cover only " + std::to_string(all) + how);
  };
  if (!lines.empty() && !o.rate_hz) {
    const auto n = count_of(lines.size(), ", one at each line; or give --rate");
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

std::string note_of_air(const RenderInput& input, const OutputOptions& o) {
  std::size_t all = 0, in_air = 0;
  for (const RenderJob& job : input.jobs) {
    const auto times = firing_times(job, o);
    if (!times) return {};
    all += times->size();
    const World world = world_of(job);
    const SonarConfig& sonar = job.sonar();
    for (const Time at : *times)
      in_air += is_in_air(compose(world.vehicle_at(sonar.vehicle, at), sonar.mount), *job.scene) ? 1 : 0;
  }
  if (in_air == 0) return {};
  return text::format(
      "%zu of %zu pings: the sonar is above the sea surface and receives noise only (z = 0 is the surface, lower is negative); "
      "was "
      "NED taken for ENU? Check the poses and their frame",
      in_air, all);
}

Result<Progress> render_pings(const RenderInput& input, const OutputOptions& o, Parallel& pool,
                              const std::function<void(const Progress&)>& on_progress) {
  if (o.first > 1 && input.jobs.size() > 1)
    return failure(ErrorKind::usage,
                   "--first: " + input.source + " sweeps values, and its pings are counted through all steps; leave it out");
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
  for (std::size_t j = 0; j < input.jobs.size(); ++j) {
    const RenderJob& job = input.jobs[j];
    const World world = world_of(job);
    std::unique_ptr<PingEngine> engine;  // not before it is needed: a finished folder costs no scene
    std::vector<MadePing> batch;
    for (std::size_t i = 0; i < times[j].size(); ++i) {
      const std::uint64_t number = o.first + progress.done + batch.size();
      const bool is_there = folder->holds(number);
      if (!is_there) {
        MadePing& made = batch.emplace_back();
        made.number = number;
        made.request = make_request(job, world, PingNumber{static_cast<std::uint32_t>(number)}, times[j][i]);
        made.request.switches.keep_pressure = o.npy;
        made.request.switches.keep_beams = o.complex;
        made.request.switches.keep_truth = true;
      }
      const bool full = batch.size() >= static_cast<std::size_t>(o.batch) || i + 1 == times[j].size() || is_there;
      if (full && !batch.empty()) {
        if (!engine) {
          auto started = engine_for(job, pool);
          if (!started) return tl::make_unexpected(started.error());
          engine = *std::move(started);
        }
        const std::size_t made = batch.size();
        try {
          if (auto done = render_batch(job, *engine, *folder, pool, batch, progress); !done)
            return tl::make_unexpected(done.error());
        } catch (const std::invalid_argument& refused) {
          return failure(ErrorKind::config, input.source + ": " + refused.what());
        } catch (const EngineUnavailable& gone) {
          return failure(ErrorKind::unavailable, gone.what());
        }
        progress.done += made;
        on_progress(progress);
      }
      if (is_there) {
        ++progress.kept;
        ++progress.done;
        on_progress(progress);
      }
    }
  }
  return progress;
}

}  // namespace sonar::render
