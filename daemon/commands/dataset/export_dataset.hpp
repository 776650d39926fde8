// Exports a data set for training programs without WebDataset: as folders of pictures, or as COCO. The shards stay.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.hpp"
#include "daemon/commands/dataset/dataset_job.hpp"

namespace sonar::dataset {

enum class ExportForm { folder, coco };
inline constexpr std::array<std::string_view, 2> export_form_names{"folder", "coco"};

inline constexpr std::array<std::string_view, 3> split_names{"train", "val", "test"};

struct Split {
  std::array<double, 3> shares{80, 10, 10};  // shares of the scenes, in the order of split_names; with any sum
  std::vector<std::string> by;               // draws by whose values scenes are split; empty: by the scene itself
};
/// "80,10,10" and "bed_seed,coat". Error usage: the mistake in them.
Result<Split> parse_split(const std::string& shares, const std::string& by);

/// Returns the split of each scene, by its name. Every split with a share gets a scene if there are enough.
std::vector<std::size_t> splits_of(const std::vector<std::string>& scenes, const std::array<double, 3>& shares);

struct Exported {
  std::filesystem::path folder;
  std::size_t scenes = 0;
  std::array<std::uint64_t, 3> pings{};
};
/// Writes the folder `folder` or `coco` into a set that is complete. Errors: usage if the folder exists, or Split::by has an
/// unknown name; io; bad_data.
Result<Exported> export_dataset(const DatasetJob& job, const std::filesystem::path& set, ExportForm form, const Split& split);

}  // namespace sonar::dataset
