// The output folder of `sonard render`. It holds pings of one set of inputs, and one run may write to it at a time. Complete
// pings are kept, so that an interrupted run continues where it stopped.
#pragma once

#include <filesystem>
#include <initializer_list>
#include <span>
#include <string>
#include <vector>

#include "core/base/result.hpp"
#include "daemon/commands/render/render_job.hpp"

namespace sonar::render {

struct OutputOptions {
  std::filesystem::path folder;
  bool npy = true, png = true, raw = false, complex = false, labels = false;
  bool rings = true;                   // range rings in pictures
  int batch = 1;                       // number of pings that all threads make before any is written
  bool overwrite = false;              // true: remove pings of other inputs from the folder
  std::uint64_t first = 1;             // number of the first ping to make
  std::optional<std::uint64_t> pings;  // pings of each job; nullopt: one, or one for every pose of the file
  std::optional<double> rate_hz;       // pings per second; nullopt: the rate of the settings, or one ping at every pose
};

class OutputFolder {
 public:
  /// Creates the folder and locks it while this object lives. Errors: io; usage if the folder has pings of other inputs that may
  /// not be removed, or if another run writes into it.
  static Result<OutputFolder> claim(const RenderInput& input, const OutputOptions& options, std::string digest);
  OutputFolder(OutputFolder&& other) noexcept;
  OutputFolder& operator=(OutputFolder&&) = delete;
  ~OutputFolder();

  /// Returns the common start of the names of a ping's files, such as "folder/000001".
  std::string stem(std::uint64_t number) const;
  /// Returns whether all files of a ping exist and are of these inputs.
  bool holds(std::uint64_t number) const;
  std::uint64_t size_of(std::uint64_t number) const;
  const std::string& digest() const { return digest_; }
  const OutputOptions& options() const { return options_; }

 private:
  OutputFolder(OutputOptions options, std::string digest, int lock);
  std::vector<std::filesystem::path> files_of(std::uint64_t number) const;

  OutputOptions options_;
  std::string digest_;
  int lock_ = -1;  // descriptor of the locked folder; -1 if the file system has no locks
};

/// Writes the parts into one file, which is renamed when complete. Errors: io if the disk
/// is full, or the folder is missing or not writable.
Result<void> write_output(const std::filesystem::path& file, std::initializer_list<std::span<const std::byte>> parts);

}  // namespace sonar::render
