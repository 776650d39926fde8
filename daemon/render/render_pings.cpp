#include "daemon/render/render_pings.hpp"

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "core/image/draw_fan.hpp"
#include "daemon/engine/choose_engine.hpp"
#include "daemon/engine/start_engine.hpp"
#include "daemon/render/npy.hpp"
#include "daemon/render/sidecar.hpp"
#include "daemon/render/sonar_version.hpp"

namespace sonar::render {
namespace {

using nlohmann::json;
using std::filesystem::path;

constexpr const char* about_file = "render.json";

std::string number_text(std::uint64_t number) {
  const std::string digits = std::to_string(number);
  return std::string(digits.size() < 6 ? 6 - digits.size() : 0, '0') + digits;
}

/// Names of a ping's files, the sidecar last.
std::vector<path> files_of(const OutputOptions& o, std::uint64_t number) {
  const path stem = o.folder / number_text(number);
  const auto with = [&](const char* end) { return path(stem.string() + end); };
  std::vector<path> files;
  if (o.npy) files.push_back(with("_pressure.npy"));
  if (o.npy) files.push_back(with("_samples.npy"));
  if (o.complex) files.push_back(with("_beams.npy"));
  if (o.raw) files.push_back(with("_samples.raw"));
  if (o.png) files.push_back(with(".png"));
  files.push_back(with(".json"));
  return files;
}

json read_json(const path& file) {
  std::ifstream in(file);
  return json::parse(in, nullptr, false);
}
std::string inputs_of(const path& file) {
  const json about = read_json(file);
  return about.is_object() && about.contains("inputs") && about["inputs"].is_string() ? about["inputs"].get<std::string>() : "";
}

bool is_finished(const OutputOptions& o, std::uint64_t number, const std::string& digest) {
  std::error_code ec;
  for (const path& file : files_of(o, number))
    if (!std::filesystem::is_regular_file(file, ec)) return false;
  return inputs_of(files_of(o, number).back()) == digest;
}

/// NNNNNN.json, NNNNNN_pressure.npy and so on: ours to remove.
bool is_of_a_ping(const path& file) {
  const std::string name = file.filename().string();
  const bool digits =
      name.size() > 6 && std::all_of(name.begin(), name.begin() + 6, [](unsigned char c) { return std::isdigit(c); });
  constexpr std::string_view ends[] = {"_pressure.npy", "_samples.npy", "_beams.npy", "_samples.raw", ".png", ".json"};
  return digits && std::any_of(std::begin(ends), std::end(ends), [&](std::string_view end) { return name.substr(6) == end; });
}

/// Makes the folder, and holds it to one set of inputs.
Result<void> claim_folder(const RenderInput& input, const OutputOptions& o, const std::string& digest) {
  std::error_code ec;
  std::filesystem::create_directories(o.folder, ec);
  if (ec)
    return failure(ErrorKind::io, "cannot make the folder " + o.folder.string() + ": " + ec.message() + "; choose another --out");
  const path about = o.folder / about_file;
  if (std::filesystem::exists(about, ec) && inputs_of(about) != digest) {
    if (!o.overwrite)
      return failure(ErrorKind::usage, o.folder.string() +
                                           " holds pings of other inputs (configuration, scene or switches); choose "
                                           "another --out, or give --overwrite to replace them");
    for (const auto& entry : std::filesystem::directory_iterator(o.folder, ec))
      if (is_of_a_ping(entry.path())) std::filesystem::remove(entry.path(), ec);
  }
  const json text{{"sonard", version}, {"inputs", digest}, {"from", input.source}};
  return write_file(about, {bytes_of(text.dump(2) + "\n")});
}

PolarImage picture_of(const Ping& ping) {
  const PingSettings& s = ping.request.settings;
  PolarImage image;
  image.rows = static_cast<std::size_t>(s.range_bin_count);
  image.beams = static_cast<std::size_t>(s.beam_count);
  image.row_spacing_m = s.range_bin_m;
  image.azimuth_rad.assign(ping.beam_azimuth_rad.begin(), ping.beam_azimuth_rad.end());
  const auto bytes = static_cast<std::size_t>(s.format.bits / 8);
  for (std::size_t i = 0; i < image.rows * image.beams; ++i) {
    std::uint32_t code = 0;
    for (std::size_t b = 0; b < bytes; ++b) code |= std::to_integer<std::uint32_t>(ping.samples[i * bytes + b]) << (8 * b);
    image.samples.push_back(static_cast<float>(code));
  }
  image.full_scale = static_cast<float>(s.format.max_code);
  if (bytes > 1) {  // wide samples rarely come near their maximum
    std::vector<float> sorted = image.samples;
    const auto place = sorted.begin() + static_cast<std::ptrdiff_t>((sorted.size() - 1) * 999 / 1000);
    std::nth_element(sorted.begin(), place, sorted.end());
    image.full_scale = std::max(1.0f, *place);
  }
  return image;
}

Result<void> write_picture(const Ping& ping, const path& file) {
  const auto colours = find_colour_map("viridis");
  if (!colours) return tl::make_unexpected(colours.error());
  if (ping.request.settings.beam_count < 2) return write_png(Raster(64, 64), file);  // one beam is no fan
  const auto fan = draw_fan(picture_of(ping), {.width_px = 1000, .colours = *colours, .rings = true});
  if (!fan) return tl::make_unexpected(fan.error());
  return write_png(*fan, file);
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
Result<std::uint64_t> write_ping(const RenderJob& job, const MadePing& made, const std::string& engine, const OutputOptions& o,
                                 const std::string& digest) {
  const Ping& ping = made.ping;
  const PingSettings& s = ping.request.settings;
  const auto rows = static_cast<std::size_t>(s.range_bin_count), beams = static_cast<std::size_t>(s.beam_count);
  const char* codes = s.format.bits == 8 ? "|u1" : s.format.bits == 16 ? "<u2" : "<u4";
  const std::string stem = (o.folder / number_text(made.number)).string();
  if (o.complex && ping.beam_signal_upa.empty())
    return failure(ErrorKind::usage,
                   "there is no complex beam signal in expected power and in the comparison modes; leave out --complex");
  Result<void> done;
  const auto put = [&](bool wanted, const char* end, const std::string& header, std::span<const std::byte> data) {
    if (wanted && done) done = write_file(stem + end, {bytes_of(header), data});
  };
  put(o.npy, "_pressure.npy", npy_header("<f4", {rows, beams}), std::as_bytes(std::span(ping.pressure_upa)));
  put(o.npy, "_samples.npy", npy_header(codes, {rows, beams}), ping.samples);
  put(o.complex, "_beams.npy", npy_header("<c8", {rows * static_cast<std::size_t>(s.samples_per_row), beams}),
      std::as_bytes(std::span(ping.beam_signal_upa)));
  put(o.raw, "_samples.raw", {}, ping.samples);
  if (done && o.png) done = write_picture(ping, stem + ".png");
  if (done) done = write_file(stem + ".json", {bytes_of(sidecar(job, ping, engine, made.count, digest).dump(1) + "\n")});
  if (!done) return tl::make_unexpected(done.error());
  std::uint64_t bytes = 0;
  std::error_code ec;
  for (const path& file : files_of(o, made.number)) bytes += std::filesystem::file_size(file, ec);
  return bytes;
}

/// Makes the pings in one go, which is what a device wants; the CPU takes them one after the other, each by all threads. They are
/// written side by side.
Result<void> render_batch(const RenderJob& job, PingEngine& engine, const OutputOptions& o, const std::string& digest,
                          Parallel& pool, std::vector<MadePing>& batch, Progress& progress) {
  std::vector<PingRequest> requests;
  for (const MadePing& made : batch) requests.push_back(made.request);
  std::vector<Ping> pings = engine.run(requests);
  const std::vector<PingStatistics> counts = engine.statistics_of_each();
  for (std::size_t i = 0; i < batch.size(); ++i) {
    batch[i].ping = std::move(pings.at(i));
    batch[i].count = counts.at(i);
  }
  const std::string description = engine.description();  // of all: what a device that fails had begun is made again
  pool.for_each(batch.size(), [&](std::size_t i, int) { batch[i].written = write_ping(job, batch[i], description, o, digest); });
  for (const MadePing& made : batch) {
    if (!made.written) return tl::make_unexpected(made.written.error());
    progress.bytes += *made.written;
  }
  batch.clear();
  return {};
}

}  // namespace

Result<std::vector<Time>> firing_times(const RenderJob& job, const OutputOptions& o) {
  const std::vector<Time> lines = times_of(job.path);
  const auto too_many = [&](const std::string& there_are) {
    return failure(ErrorKind::usage, "--pings " + std::to_string(*o.pings) + ": the poses are enough for " + there_are);
  };
  if (!lines.empty() && !o.rate_hz) {
    if (o.pings && *o.pings > lines.size()) return too_many(std::to_string(lines.size()) + ", one at each line; or give --rate");
    return std::vector<Time>(lines.begin(), lines.begin() + static_cast<std::ptrdiff_t>(o.pings.value_or(lines.size())));
  }
  const double usual_hz = job.settings.rate_hz > 0 ? static_cast<double>(job.settings.rate_hz) : 10;
  const double rate_hz = o.rate_hz.value_or(usual_hz);
  const Time begin = lines.empty() ? Time{} : lines.front();
  std::uint64_t n = o.pings.value_or(1);
  if (!lines.empty()) {
    const auto fit = static_cast<std::uint64_t>(std::floor(seconds(lines.back() - begin) * rate_hz + 1e-6)) + 1;
    if (o.pings && *o.pings > fit) return too_many(std::to_string(fit) + " at that rate");
    n = o.pings.value_or(fit);
  }
  std::vector<Time> times;
  for (std::uint64_t i = 0; i < n; ++i) times.push_back(begin + nanoseconds_from(static_cast<double>(i) / rate_hz));
  return times;
}

Result<Progress> render_pings(const RenderInput& input, const OutputOptions& o, Parallel& pool,
                              const std::function<void(const Progress&)>& told) {
  const std::string digest = digest_of(input, o.rate_hz.value_or(0));
  Progress progress;
  std::vector<std::vector<Time>> times;
  for (const RenderJob& job : input.jobs) {
    auto of_job = firing_times(job, o);
    if (!of_job) return tl::make_unexpected(of_job.error());
    progress.all += of_job->size();
    times.push_back(*std::move(of_job));
  }
  if (const auto claimed = claim_folder(input, o, digest); !claimed) return tl::make_unexpected(claimed.error());
  for (std::size_t j = 0; j < input.jobs.size(); ++j) {
    const RenderJob& job = input.jobs[j];
    std::unique_ptr<PingEngine> engine;  // not before it is needed: a finished folder costs no scene
    std::vector<MadePing> batch;
    for (std::size_t i = 0; i < times[j].size(); ++i) {
      const std::uint64_t number = progress.done + batch.size() + 1;
      const bool is_there = is_finished(o, number, digest);
      if (!is_there) {
        MadePing& made = batch.emplace_back();
        made.number = number;
        made.request = make_request(job, PingNumber{static_cast<std::uint32_t>(number)}, times[j][i]);
        made.request.switches.keep_pressure = o.npy;
        made.request.switches.keep_beams = o.complex;
        made.request.switches.keep_truth = true;
      }
      const bool full = batch.size() >= static_cast<std::size_t>(o.batch) || i + 1 == times[j].size() || is_there;
      if (full && !batch.empty()) {
        if (!engine) {
          const auto make = [&](std::shared_ptr<const Scene> s) {
            return choose_engine(job.engine.device, std::move(s), pool, {.simd = job.engine.simd},
                                 [](const std::string& what) { std::fprintf(stderr, "sonard: %s\n", what.c_str()); });
          };
          auto started = start_engine(make, job.scene);
          if (!started) return tl::make_unexpected(started.error());
          engine = *std::move(started);
        }
        const std::size_t made = batch.size();
        try {
          if (auto done = render_batch(job, *engine, o, digest, pool, batch, progress); !done)
            return tl::make_unexpected(done.error());
        } catch (const std::invalid_argument& refused) {
          return failure(ErrorKind::config, input.source + ": " + refused.what());
        } catch (const EngineUnavailable& gone) {
          return failure(ErrorKind::unavailable, gone.what());
        }
        progress.done += made;
        told(progress);
      }
      if (is_there) {
        ++progress.kept;
        ++progress.done;
        told(progress);
      }
    }
  }
  return progress;
}

}  // namespace sonar::render
