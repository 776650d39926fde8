// Makes a data set: the missing shards and, when no shard is missing, the manifest, the COCO file and the card.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.hpp"
#include "core/pipeline/ping_engine.hpp"
#include "daemon/commands/dataset/dataset_job.hpp"

namespace sonar::dataset {

struct DatasetOptions {
  std::filesystem::path out;
  std::uint64_t part = 0, parts = 1;   // the part has the shards whose number modulo `parts` is `part`
  int threads = 1;                     // pings computed in parallel
  std::optional<SimdLevel> simd = {};  // replaces the instruction set of the job
  // When *stop becomes true, the pings being made are finished, and those of the incomplete shard are kept for the next run.
  const std::atomic<bool>* stop = nullptr;
};

struct DatasetProgress {
  std::uint64_t shards = 0, all_shards = 0, kept_shards = 0;  // shards of this part
  std::uint64_t pings = 0, all_pings = 0;                     // pings made so far by this run; all pings of this run
  std::uint64_t bytes = 0;                                    // bytes of finished shards
  std::uint64_t set_aside = 0;                                // pings of an incomplete shard, when stopped
  bool stopped = false;                                       // stopped before all pings were made
  bool whole = false;                                         // the manifest has been written
  std::optional<std::uint64_t> missing = {};                  // the first shard that another part has not made yet
};

using OnProgress = std::function<void(const DatasetProgress&)>;  // called after every few pings

/// The folder of a job's shards. Processes of several machines may work in one.
class DatasetFolder {
 public:
  virtual ~DatasetFolder() = default;
  virtual const std::string& inputs() const = 0;           // digest of all that the bytes depend on
  virtual const std::string& instruction_set() const = 0;  // a name of simd_level_names
  /// True if the shard exists and is unchanged. Error bad_data: it differs from its digest.
  virtual Result<bool> holds(std::uint64_t shard) = 0;
  /// Makes the shard. If another process has made it in the meantime, its shard is kept; error bad_data if the bytes differ.
  /// Other errors: io; config, as draw_ping().
  virtual Result<void> make(std::uint64_t shard) = 0;
  /// True if the last error is that a shard's bytes differ, because of another program or a damaged disk or memory.
  virtual bool differs() const = 0;
  /// Writes the manifest, the COCO file and the card, if no shard is missing; sets `whole` or `missing`.
  virtual Result<DatasetProgress> conclude() = 0;
};

/// Makes the folder. `job` must outlive it. Errors: io; usage if it contains another job's shards; config, as draw_ping().
Result<std::unique_ptr<DatasetFolder>> open_dataset(const DatasetJob& job, const DatasetOptions& options, OnProgress on_progress);

/// Makes all missing shards of this part, and the manifest if no shard is missing.
Result<DatasetProgress> make_dataset(const DatasetJob& job, const DatasetOptions& options, OnProgress on_progress);

// Exports a data set for training programs without WebDataset: as folders of pictures, or in COCO's format. The shards are kept.

enum class ExportForm { folder, coco };
inline constexpr std::array<std::string_view, 2> export_form_names{"folder", "coco"};

inline constexpr std::array<std::string_view, 3> split_names{"train", "val", "test"};

struct Split {
  std::array<double, 3> shares{80, 10, 10};  // shares of the scenes, in the order of split_names; the sum may be any number
  std::vector<std::string> by;  // names of draws; pings with equal values (if empty: with equal scenes) are in one split
};
/// Parses texts such as "80,10,10" and "bed_seed,coat". Error usage: a mistake in one of them.
Result<Split> parse_split(const std::string& shares, const std::string& by);

/// Returns the split of each scene, which depends on the names. Every split with a share gets a scene if there are enough scenes.
std::vector<std::size_t> splits_of(const std::vector<std::string>& scenes, const std::array<double, 3>& shares);

struct Exported {
  std::filesystem::path folder;
  std::size_t scenes = 0, divided_scenes = 0;  // divided: with pings in two or three splits, because Split::by permits it
  std::array<std::uint64_t, 3> pings{};
};
/// Checks what can be checked before the set is made. Error usage: the folder exists, or Split::by has an unknown name.
Result<void> check_export(const DatasetJob& job, const std::filesystem::path& set, ExportForm form, const Split& split);
/// Writes the folder `folder` or `coco` into a set that is complete. Errors: those of check_export(), io, bad_data.
Result<Exported> export_dataset(const DatasetJob& job, const std::filesystem::path& set, ExportForm form, const Split& split);

}  // namespace sonar::dataset
