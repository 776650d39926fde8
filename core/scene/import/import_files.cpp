#include "core/scene/import/import_files.hpp"

#include <assimp/IOStream.hpp>

#include <algorithm>
#include <array>
#include <cstring>
#include <memory>

#include "core/base/regular_file.hpp"
#include "core/scene/files/mesh_steps.hpp"

namespace sonar {
namespace {

// Assimp 5.2 looks each of them up in a list and copies the list: 8,000 take 0.3 s, 50,000 take minutes.
constexpr std::uint64_t most_objects = 10'000;

bool begins_object(char c) { return c == 'o' || c == 'g'; }  // no other statement of an OBJ file does

/// Lines of an OBJ file that begin an object or a group.
bool has_many_objects(std::FILE* file) {
  std::array<char, std::size_t{1} << 16> part;
  std::uint64_t objects = 0;
  char before = '\n';
  while (const std::size_t n = std::fread(part.data(), 1, part.size(), file))
    for (std::size_t i = 0; i < n; before = part[i++])
      if (before == '\n' && begins_object(part[i]) && ++objects > most_objects) return true;
  return false;
}

/// Turns those lines into comments: the surface and its materials are the same without them.
class WithoutObjects final : public Assimp::IOStream {
 public:
  explicit WithoutObjects(OpenFile file, std::size_t size) : file_(std::move(file)), size_(size) {}

  std::size_t Read(void* to, std::size_t size, std::size_t count) override {
    char* bytes = static_cast<char*>(to);
    const std::size_t n = size == 0 ? 0 : std::fread(bytes, 1, size * count, file_.get());
    for (std::size_t i = 0; i < n; ++i) {
      const char c = bytes[i];
      if (before_ == '\n' && begins_object(c)) bytes[i] = '#';
      before_ = c;
    }
    return size == 0 ? 0 : n / size;
  }
  aiReturn Seek(std::size_t offset, aiOrigin origin) override {
    const int whence = origin == aiOrigin_SET ? SEEK_SET : origin == aiOrigin_CUR ? SEEK_CUR : SEEK_END;
    if (std::fseek(file_.get(), static_cast<long>(offset), whence) != 0) return aiReturn_FAILURE;
    const long now = std::ftell(file_.get());
    before_ = '\n';
    if (now == 0) return aiReturn_SUCCESS;
    if (std::fseek(file_.get(), now - 1, SEEK_SET) != 0) return aiReturn_FAILURE;
    before_ = static_cast<char>(std::fgetc(file_.get()));
    return aiReturn_SUCCESS;
  }
  std::size_t Write(const void*, std::size_t, std::size_t) override { return 0; }
  std::size_t Tell() const override { return static_cast<std::size_t>(std::ftell(file_.get())); }
  std::size_t FileSize() const override { return size_; }
  void Flush() override {}

 private:
  OpenFile file_;
  std::size_t size_;
  char before_ = '\n';
};

}  // namespace

ImportFiles::ImportFiles(const MeshFile& request, std::optional<Error>& fault, std::function<void(std::uintmax_t)> opened)
    : request_(request), fault_(fault), opened_(std::move(opened)) {
  if (!request.in_memory.empty()) return;
  std::error_code error;
  const auto add = [&](const std::filesystem::path& folder) {
    folders_.push_back(std::filesystem::canonical(folder.empty() ? "." : folder, error));
  };
  add(request.file.parent_path());
  if (request.folder) add(*request.folder);
  mesh_ = (folders_[0] / request.file.filename()).string();
  if (const auto file = open_regular(mesh_); file && mesh_extension(mesh_) == ".obj")
    without_objects_ = has_many_objects(file->get());
}

bool ImportFiles::is_ours(const std::filesystem::path& file) const {
  return std::any_of(folders_.begin(), folders_.end(), [&](const std::filesystem::path& folder) {
    return !folder.empty() && std::mismatch(folder.begin(), folder.end(), file.begin(), file.end()).first == folder.end();
  });
}

bool ImportFiles::Exists(const char* file) const {
  const std::filesystem::path place = std::filesystem::path(file).lexically_normal();
  return is_ours(place) && open_regular(place).has_value();
}

Assimp::IOStream* ImportFiles::Open(const char* file, const char* mode) {
  const std::filesystem::path place = std::filesystem::path(file).lexically_normal();
  if (!is_ours(place)) {
    fault_ = bad_mesh(request_, "names the file " + std::string(file).substr(0, 300) +
                                    ", which is outside of its folder and the scene's; put it beside the mesh")
                 .value();
    return nullptr;
  }
  auto opened = open_regular(place);
  std::error_code error;
  const std::uintmax_t bytes = opened ? std::filesystem::file_size(place, error) : 0;
  if (!opened || error || *mode != 'r') return nullptr;
  const bool is_mesh = place == mesh_;
  if (!is_mesh || bytes_ == 0) {  // the importer opens the mesh a few times
    if (bytes > max_mesh_bytes - bytes_) {
      fault_ = bad_mesh(request_, "is larger than 2 GiB with the files that it names; simplify it").value();
      return nullptr;
    }
    bytes_ += bytes;
    if (auto room = check_import_memory(request_, bytes_); !room) {
      fault_ = room.error();
      return nullptr;
    }
    opened_(bytes_);
  }
  if (is_mesh && without_objects_) return new WithoutObjects(std::move(*opened), bytes);
  return DefaultIOSystem::Open(place.c_str(), mode);
}

}  // namespace sonar
