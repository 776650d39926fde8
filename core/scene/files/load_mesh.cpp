#include "core/scene/files/load_mesh.hpp"

#include <signal.h>
#include <unistd.h>
#include <algorithm>
#include <array>
#include <bit>
#include <cstdlib>
#include <cstring>
#include <vector>

#include "core/base/child_process.hpp"
#include "core/base/letters.hpp"
#include "core/base/load_step.hpp"
#include "core/base/memory_left.hpp"
#include "core/base/regular_file.hpp"
#include "core/scene/files/mesh_steps.hpp"
#include "core/text/file_kind.hpp"

namespace sonar {
namespace {

/// The path of the importer: the environment's, else one relative to this program (so that a moved installation works), else
/// the installed one.
std::filesystem::path importer() {
  if (const char* given = std::getenv("SONARD_IMPORT_MESH"); given && *given) return given;
  std::error_code error;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", error);
  if (!error)
    if (auto near = (program.parent_path() / SONARD_IMPORTER_FROM_PROGRAM).lexically_normal();
        std::filesystem::exists(near, error))
      return near;
  return SONARD_IMPORTER_INSTALLED;
}

/// The first line of the failed program's error output, such as a message of the dynamic loader, after ": ".
std::string first_error_line(int descriptor) {
  std::array<char, 300> text{};
  const ssize_t n = ::pread(descriptor, text.data(), text.size() - 1, 0);
  std::string line(text.data(), n > 0 ? static_cast<std::size_t>(n) : 0);
  line.resize(std::min(line.find('\n'), line.size()));
  return line.empty() ? "" : ": " + line;
}

tl::unexpected<Error> without_answer(const MeshFile& request, const ChildEnd& end, const std::string& words) {
  const std::string program = "the program that imports meshes (" + importer().string() + ")";
  if (end.signal == SIGKILL)
    return failure(ErrorKind::unavailable,
                   request.file.filename().string() + ": cannot be read: " + program +
                       " was killed, most likely because memory was short; use a smaller mesh, or give it more");
  if (end.signal == SIGXFSZ)
    return failure(ErrorKind::unavailable,
                   request.file.filename().string() +
                       ": cannot be read: the size of files is limited to less than the mesh takes in memory; "
                       "raise the limit (ulimit -f, LimitFSIZE=)");
  if (end.signal != 0)
    return bad_mesh(request, std::string("cannot be read: the importer crashed on it (") + ::strsignal(end.signal) +
                                 "); it is damaged or nested too deep, export it again" + words);
  return failure(ErrorKind::unavailable, request.file.filename().string() + ": cannot be read: " + program + " ended with code " +
                                             std::to_string(end.exit_code) + words +
                                             "; check that it has the version of this program");
}

Result<LoadedMesh> import_in_a_child(const MeshFile& request) {
  auto input = MemoryFile::make("mesh"), output = MemoryFile::make("imported"), errors = MemoryFile::make("errors");
  for (const auto* file : {&input, &output, &errors})
    if (!*file) return tl::make_unexpected(file->error());
  for (std::string_view left = request.in_memory; !left.empty();) {
    const ssize_t n = ::write(input->descriptor(), left.data(), left.size());
    if (n <= 0) return failure(ErrorKind::io, request.file.filename().string() + ": cannot be handed to the importer");
    left.remove_prefix(static_cast<std::size_t>(n));
  }
  const auto end = run_child(importer(),
                             arguments_of({.mesh = request,
                                           .on_disk = request.in_memory.empty(),
                                           .parent = ::getpid(),
                                           .readable = readable_folder(),
                                           .memory_root = memory_root()}),
                             *input, *output, *errors);
  if (!end)
    return failure(ErrorKind::unavailable, request.file.filename().string() + ": cannot be read: " + end.error().text +
                                               "; it reads meshes for sonard and is installed with it");
  auto answer = read_answer(output->descriptor());
  if (end->signal != 0 || !answer) return without_answer(request, *end, first_error_line(errors->descriptor()));
  return *std::move(answer);
}

}  // namespace

Result<LoadedMesh> load_mesh(const MeshFile& request) {
  const bool on_disk = request.in_memory.empty();
  std::error_code error;
  if (on_disk && is_absent(request.file)) {
    return failure(ErrorKind::missing_file,
                   "no mesh file at " + request.file.string() + "; paths are relative to the scene file");
  }
  auto opened = on_disk ? open_regular(request.file) : OpenFile();
  if (!opened) return tl::make_unexpected(opened.error());
  const std::uintmax_t bytes = on_disk ? std::filesystem::file_size(request.file, error) : request.in_memory.size();
  if (error || bytes > max_mesh_bytes) return bad_mesh(request, "is larger than 2 GiB; simplify it");
  const std::string begin = on_disk ? read_regular(request.file, text::kind_bytes).value_or("") : std::string();
  if (const auto kind = text::unusable_kind(begin, text::FileUse::mesh); !kind.empty()) return bad_mesh(request, kind);
  const std::string extension = mesh_extension(request.file);
  if (!is_mesh_extension(extension))
    return bad_mesh(request,
                    "unknown mesh format; use OBJ, STL, PLY, glTF, GLB or DAE; others, such as FBX, X3D and 3DS: assimp export "
                    "IN OUT.glb; STEP "
                    "and IGES: export STL from the CAD program");
  if (on_disk && extension == ".stl") {
    if (const auto stl = binary_stl(opened->get())) {
      bool whole = true;
      auto mesh = finish_mesh(request, false, stl->triangles, {"DefaultMaterial"}, [&](const TriangleSink& take) {
        whole = whole && each_triangle_of_binary_stl(opened->get(), stl->triangles, take);
      });
      if (!whole) return bad_mesh(request, "cannot be read to its end");
      if (mesh) mesh->lost = stl->bytes_behind / bytes_of_stl_triangle;
      return mesh;
    }
    // Binary files may begin with the word solid, too, but texts have no zero bytes.
    const std::string more = read_regular(request.file, 512).value_or("");
    if (small_letters(begin).find("solid") == std::string::npos || more.find('\0') != std::string::npos)
      return bad_mesh(
          request,
          "is not an STL file, or cut short: a text begins with the word solid, and a binary file has 84 bytes and 50 for "
          "each triangle that its header counts; export it again");
  }
  opened->reset();
  if (auto room = check_import_memory(request, bytes); !room) return tl::make_unexpected(room.error());
  // The greatest possible number of triangles: one takes 20 bytes in PLY, and more in other formats.
  begin_load_step("reading " + request.file.filename().string(), bytes / 20);
  return import_in_a_child(request);
}

// Layout: 80 bytes of any kind, the count, then for each triangle its normal, three corners and two bytes of attributes; all
// little-endian.

namespace {

constexpr std::size_t header_bytes = 84, triangle_bytes = bytes_of_stl_triangle;

static_assert(std::endian::native == std::endian::little);
template <class T>
T value_at(const char* bytes) {
  T value;
  std::memcpy(&value, bytes, sizeof value);
  return value;
}

}  // namespace

std::optional<BinaryStl> binary_stl(std::FILE* file) {
  std::array<char, header_bytes> header{};
  if (std::fseek(file, 0, SEEK_SET) != 0 || std::fread(header.data(), 1, header.size(), file) != header.size()) return {};
  const std::uint64_t count = value_at<std::uint32_t>(&header[80]);
  if (std::fseek(file, 0, SEEK_END) != 0) return {};
  const long size = std::ftell(file);
  const std::uint64_t whole = header_bytes + triangle_bytes * count;
  if (count == 0 || size < 0 || static_cast<std::uint64_t>(size) < whole) return {};
  return BinaryStl{count, static_cast<std::uint64_t>(size) - whole};
}

bool each_triangle_of_binary_stl(std::FILE* file, std::uint64_t count, const TriangleSink& take) {
  constexpr std::uint64_t at_once = 4096;
  std::vector<char> block(triangle_bytes * at_once);
  if (std::fseek(file, header_bytes, SEEK_SET) != 0) return false;
  for (std::uint64_t given = 0; given < count; given += at_once) {
    const std::size_t wanted = std::min(at_once, count - given);
    if (std::fread(block.data(), triangle_bytes, wanted, file) != wanted) return false;
    for (std::size_t t = 0; t < wanted; ++t) {
      std::array<Vec3d, 3> corners;
      for (std::size_t k = 0; k < 3; ++k) {
        const auto p = value_at<std::array<float, 3>>(&block[triangle_bytes * t + 12 + 12 * k]);
        corners[k] = to_double(Vec3{p[0], p[1], p[2]});
      }
      take(corners, 0);
    }
  }
  return true;
}

}  // namespace sonar
