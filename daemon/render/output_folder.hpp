// The folder that `sonard render` writes into: it belongs to one set of inputs, and to one run at a time. What is whole in it is
// kept, so that a run that was broken off goes on where it stopped.
#pragma once

#include <filesystem>
#include <initializer_list>
#include <span>
#include <string>
#include <vector>

#include "core/base/result.hpp"
#include "daemon/render/render_job.hpp"

namespace sonar::render {

struct OutputOptions {
  std::filesystem::path folder;
  bool npy = true, png = true, raw = false, complex = false;
  bool rings = true;                   // in pictures
  int batch = 1;                       // pings that are made before they are written, by all threads at once
  bool overwrite = false;              // pings of other inputs in the folder are removed
  std::uint64_t first = 1;             // number of the first ping; those before it are left out
  std::optional<std::uint64_t> pings;  // of each job; nothing: one, or one for every pose of the file
  std::optional<double> rate_hz;       // nothing: as the settings say, or at every pose
};

class OutputFolder {
 public:
  /// Makes the folder and holds it until this object goes. Errors: io; usage where it has pings of other inputs that may not be
  /// removed, or another run writes into it.
  static Result<OutputFolder> claim(const RenderInput& input, const OutputOptions& options, std::string digest);
  OutputFolder(OutputFolder&& other) noexcept;
  OutputFolder& operator=(OutputFolder&&) = delete;
  ~OutputFolder();

  /// What the names of a ping's files begin with: "folder/000001".
  std::string stem(std::uint64_t number) const;
  /// Whether all files of a ping are there, of these inputs.
  bool holds(std::uint64_t number) const;
  std::uint64_t size_of(std::uint64_t number) const;
  const std::string& digest() const { return digest_; }
  const OutputOptions& options() const { return options_; }

 private:
  OutputFolder(OutputOptions options, std::string digest, int lock);
  std::vector<std::filesystem::path> files_of(std::uint64_t number) const;

  OutputOptions options_;
  std::string digest_;
  int lock_ = -1;  // an open folder with the lock on it; -1 where the file system has no locks
};

/// One after the other into one file, which gets its name when it is whole. io: a full disk, a folder that is not there or not
/// ours.
Result<void> write_output(const std::filesystem::path& file, std::initializer_list<std::span<const std::byte>> parts);

}  // namespace sonar::render
