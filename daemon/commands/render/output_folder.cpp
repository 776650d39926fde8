#include "daemon/commands/render/output_folder.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <fstream>
#include <nlohmann/json.hpp>
#include <utility>

#include "core/image/raster.hpp"
#include "daemon/commands/options/sonar_version.hpp"
#include "daemon/commands/render/sidecar.hpp"

namespace sonar::render {
namespace {

using nlohmann::json;
using std::filesystem::path;

constexpr const char* about_file = "render.json";

std::string number_text(std::uint64_t number) {
  const std::string digits = std::to_string(number);
  return std::string(digits.size() < 6 ? 6 - digits.size() : 0, '0') + digits;
}

std::string inputs_of(const path& file) {
  std::ifstream in(file);
  const json about = json::parse(in, nullptr, false);
  return about.is_object() && about.contains("inputs") && about["inputs"].is_string() ? about["inputs"].get<std::string>() : "";
}

/// True for names such as NNNNNN.json and NNNNNN_pressure.npy, which sonard may remove.
bool is_of_a_ping(const path& file) {
  const std::string name = file.filename().string();
  const bool digits =
      name.size() > 6 && std::all_of(name.begin(), name.begin() + 6, [](unsigned char c) { return std::isdigit(c); });
  constexpr std::string_view ends[] = {"_pressure.npy", "_samples.npy", "_beams.npy",   "_samples.raw", "_labels.npy",
                                       "_share.npy",    "_caster.npy",  "_labels.json", ".png",         ".json"};
  return digits && std::any_of(std::begin(ends), std::end(ends), [&](std::string_view end) { return name.substr(6) == end; });
}

/// Returns whether NNNNNN.json was written by any version of sonard. Then files of that number are from sonard.
bool is_sidecar(const path& file) {
  std::ifstream in(file);
  const json side = json::parse(in, nullptr, false);
  constexpr const char* keys[] = {"sonard", "inputs", "ping", "settings"};
  return side.is_object() && std::all_of(std::begin(keys), std::end(keys), [&](const char* key) { return side.contains(key); });
}

Result<std::vector<path>> pings_in(const path& folder) {
  std::error_code ec;
  std::vector<path> found;
  for (std::filesystem::directory_iterator entry(folder, ec), end; !ec && entry != end; entry.increment(ec))
    if (is_of_a_ping(entry->path())) found.push_back(entry->path());
  if (ec) return failure(ErrorKind::io, "cannot read the folder " + folder.string() + ": " + ec.message());
  return found;
}

/// Locks the folder until the descriptor is closed, at the latest when the process ends; there is no lock file.
Result<int> lock(const path& folder) {
  const int fd = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd < 0 || ::flock(fd, LOCK_EX | LOCK_NB) == 0) return fd;
  const bool is_held = errno == EWOULDBLOCK;
  ::close(fd);
  if (!is_held) return -1;
  return failure(ErrorKind::usage,
                 "another sonard render is writing into " + folder.string() + ": wait until it ends, or choose another --out");
}

/// Removes the pings of other inputs, if that is allowed.
Result<void> make_way(const OutputOptions& o, const std::string& digest) {
  std::error_code ec;
  const path about = o.folder / about_file;
  const std::string inputs = inputs_of(about);
  if (inputs == digest) return {};
  const bool is_known = !inputs.empty();
  if (!is_known && std::filesystem::exists(about, ec))
    return failure(ErrorKind::usage, about.string() + " was not written by sonard, and is not overwritten; choose another --out");
  if (const path objects = o.folder / "objects.json"; o.labels && !is_known && std::filesystem::exists(objects, ec))
    return failure(ErrorKind::usage, objects.string() +
                                         " may not be from sonard: the folder has no render.json; it is not overwritten: choose "
                                         "another --out");
  const auto others = pings_in(o.folder);
  if (!others) return tl::make_unexpected(others.error());
  if (!is_known && others->empty()) return {};
  for (const path& file : *others)
    if (!is_known && !is_sidecar(file.parent_path() / (file.filename().string().substr(0, 6) + ".json")))
      return failure(ErrorKind::usage,
                     file.string() +
                         " may not be from sonard: the folder has no render.json, and no sidecar of sonard has that "
                         "number; it is not overwritten: choose another --out");
  if (!o.overwrite)
    return failure(ErrorKind::usage, o.folder.string() +
                                         (is_known ? " holds pings of other inputs (configuration, scene, poses or switches)"
                                                   : " holds pings, but no render.json that identifies their inputs") +
                                         "; choose another --out, or give --overwrite to replace them");
  for (const path& file : *others)
    if (!std::filesystem::remove(file, ec) && ec)
      return failure(ErrorKind::io, "cannot remove " + file.string() + ": " + ec.message() + "; choose another --out");
  return {};
}

}  // namespace

/// Locks the folder first, so that two runs cannot both claim it.
Result<OutputFolder> OutputFolder::claim(const RenderInput& input, const OutputOptions& options, std::string digest) {
  std::error_code ec;
  std::filesystem::create_directories(options.folder, ec);
  if (ec)
    return failure(ErrorKind::io,
                   "cannot make the folder " + options.folder.string() + ": " + ec.message() + "; choose another --out");
  const auto held = lock(options.folder);
  if (!held) return tl::make_unexpected(held.error());
  OutputFolder folder(options, std::move(digest), *held);
  if (const auto r = make_way(options, folder.digest_); !r) return tl::make_unexpected(r.error());
  json about{{"sonard", version}, {"inputs", folder.digest_}, {"from", input.source}};
  if (!input.notes.empty()) about["notes"] = input.notes;
  const std::string text = about.dump(2) + "\n";
  if (const auto r = write_output(options.folder / about_file, {bytes_of(text)}); !r) return tl::make_unexpected(r.error());
  return folder;
}

OutputFolder::OutputFolder(OutputOptions options, std::string digest, int lock)
    : options_(std::move(options)), digest_(std::move(digest)), lock_(lock) {}

OutputFolder::OutputFolder(OutputFolder&& other) noexcept
    : options_(std::move(other.options_)), digest_(std::move(other.digest_)), lock_(std::exchange(other.lock_, -1)) {}

OutputFolder::~OutputFolder() {
  if (lock_ >= 0) ::close(lock_);
}

std::string OutputFolder::stem(std::uint64_t number) const { return (options_.folder / number_text(number)).string(); }

/// Lists the sidecar last. It is the last file written, so a ping whose sidecar exists is complete.
std::vector<path> OutputFolder::files_of(std::uint64_t number) const {
  const auto with = [&](const char* end) { return path(stem(number) + end); };
  std::vector<path> files;
  if (options_.npy) files.push_back(with("_pressure.npy"));
  if (options_.npy) files.push_back(with("_samples.npy"));
  if (options_.complex) files.push_back(with("_beams.npy"));
  if (options_.raw) files.push_back(with("_samples.raw"));
  if (options_.labels)
    for (const char* end : {"_labels.npy", "_share.npy", "_caster.npy", "_labels.json"}) files.push_back(with(end));
  if (options_.png) files.push_back(with(".png"));
  files.push_back(with(".json"));
  return files;
}

/// True if all files of the ping exist, and the sidecar, which is written last, has the digest of these inputs.
bool OutputFolder::holds(std::uint64_t number) const {
  std::error_code ec;
  for (const path& file : files_of(number))
    if (!std::filesystem::is_regular_file(file, ec)) return false;
  return inputs_of(files_of(number).back()) == digest_;
}

std::uint64_t OutputFolder::size_of(std::uint64_t number) const {
  std::uint64_t bytes = 0;
  std::error_code ec;
  for (const path& file : files_of(number)) bytes += std::filesystem::file_size(file, ec);
  return bytes;
}

Result<void> write_output(const path& file, std::initializer_list<std::span<const std::byte>> parts) {
  const auto done = write_whole_file(file, parts);
  if (done) return done;
  return failure(done.error().kind, done.error().text + "; what is finished is kept");
}

}  // namespace sonar::render
