#include "core/scene/files/mesh_exchange.hpp"

#include <sys/stat.h>
#include <unistd.h>
#include <algorithm>
#include <array>
#include <charconv>
#include <cstdlib>
#include <cstring>
#include <span>

namespace sonar {
namespace {

constexpr const char* version = "sonard-mesh-4";
constexpr std::uint64_t magic = 0x3168'7365'6d64'7273;
constexpr std::uint64_t most_text = std::uint64_t{256} << 20;  // limit in bytes of an error or of the names of materials

struct Head {
  std::uint64_t magic = 0;
  std::uint64_t error = 0;  // an ErrorKind; 0: the answer is a mesh
  std::uint64_t text = 0;   // bytes of the error text, or of the names of materials with a zero after each
  std::uint64_t vertices = 0, triangles = 0, left_out = 0, lost = 0, hidden = 0;
  Vec3d centre_m{};
};

template <class T>
std::span<const std::byte> bytes_of(const std::vector<T>& values) {
  return std::as_bytes(std::span(values));
}

bool write_at(int descriptor, std::span<const std::byte> bytes, std::uint64_t& at) {
  while (!bytes.empty()) {
    const ssize_t n = ::pwrite(descriptor, bytes.data(), bytes.size(), static_cast<off_t>(at));
    if (n <= 0) return false;
    bytes = bytes.subspan(static_cast<std::size_t>(n));
    at += static_cast<std::uint64_t>(n);
  }
  return true;
}

template <class T>
bool read_at(int descriptor, std::span<T> values, std::uint64_t& at) {
  auto bytes = std::as_writable_bytes(values);
  while (!bytes.empty()) {
    const ssize_t n = ::pread(descriptor, bytes.data(), bytes.size(), static_cast<off_t>(at));
    if (n <= 0) return false;
    bytes = bytes.subspan(static_cast<std::size_t>(n));
    at += static_cast<std::uint64_t>(n);
  }
  return true;
}

bool write_head(int descriptor, Head head) {
  std::uint64_t at = 0;
  head.magic = magic;
  return write_at(descriptor, std::as_bytes(std::span(&head, 1)), at);
}

Result<LoadedMesh> broken() {
  return failure(ErrorKind::bug, "the program that imports meshes gave an invalid answer (this is a bug, please report it)");
}

/// True if the mesh is valid. Every user of a mesh relies on this.
bool is_sound(const LoadedMesh& mesh) {
  const Mesh& m = mesh.centred.mesh;
  return is_finite(mesh.centred.centre_m) &&
         std::all_of(m.vertices.begin(), m.vertices.end(), [](Vec3 v) { return length(to_double(v)) <= 4e7; }) &&
         std::all_of(m.triangles.begin(), m.triangles.end(),
                     [&](const auto& t) {
                       return std::max({t[0], t[1], t[2]}) < m.vertices.size();
                     }) &&
         std::all_of(m.material.begin(), m.material.end(), [&](std::uint16_t k) { return k < mesh.material_names.size(); });
}

}  // namespace

std::vector<std::string> arguments_of(const ImportRequest& request) {
  std::array<char, 64> scale{};
  *std::to_chars(scale.data(), scale.data() + scale.size(), request.mesh.scale).ptr = '\0';
  const MeshFile& mesh = request.mesh;
  return {version,
          std::to_string(request.parent),
          mesh.file.string(),
          scale.data(),
          mesh.up ? *mesh.up == UpAxis::y ? "y" : "z" : "-",
          request.on_disk ? "file" : "input",
          mesh.folder ? "in" + mesh.folder->string() : "",
          request.readable.string(),
          request.memory_root.string(),
          mesh.part};
}

std::optional<ImportRequest> request_from(const std::vector<std::string>& arguments) {
  if (arguments.size() != 10 || arguments[0] != version) return std::nullopt;
  ImportRequest request;
  request.parent = std::atoi(arguments[1].c_str());
  request.mesh.file = arguments[2];
  request.mesh.scale = std::strtod(arguments[3].c_str(), nullptr);
  if (arguments[4] != "-") request.mesh.up = arguments[4] == "y" ? UpAxis::y : UpAxis::z;
  request.on_disk = arguments[5] == "file";
  if (!arguments[6].empty()) request.mesh.folder = arguments[6].substr(2);
  request.readable = arguments[7];
  request.memory_root = arguments[8];
  request.mesh.part = arguments[9];
  return request;
}

bool write_refusal(int descriptor, ErrorKind kind, std::string_view text) {
  std::uint64_t at = sizeof(Head);
  return ::ftruncate(descriptor, 0) == 0 && write_at(descriptor, std::as_bytes(std::span(text)), at) &&
         write_head(descriptor, {.error = static_cast<std::uint64_t>(kind), .text = text.size()});
}

bool write_answer(int descriptor, const Result<LoadedMesh>& mesh) {
  if (!mesh) return write_refusal(descriptor, mesh.error().kind, mesh.error().text);
  std::string names;
  for (const std::string& name : mesh->material_names) names.append(name.c_str()) += '\0';
  const CentredMesh& centred = mesh->centred;
  std::uint64_t at = sizeof(Head);
  return write_at(descriptor, std::as_bytes(std::span(names)), at) && write_at(descriptor, bytes_of(centred.mesh.vertices), at) &&
         write_at(descriptor, bytes_of(centred.mesh.triangles), at) &&
         write_at(descriptor, bytes_of(centred.mesh.material), at) &&
         write_head(descriptor, {.text = names.size(),
                                 .vertices = centred.mesh.vertices.size(),
                                 .triangles = centred.mesh.triangles.size(),
                                 .left_out = centred.left_out,
                                 .lost = mesh->lost,
                                 .hidden = mesh->hidden,
                                 .centre_m = centred.centre_m});
}

std::optional<Result<LoadedMesh>> read_answer(int descriptor) {
  Head head;
  struct stat status {};
  std::uint64_t at = 0;
  if (::fstat(descriptor, &status) != 0 || !read_at(descriptor, std::span(&head, 1), at) || head.magic != magic)
    return std::nullopt;
  const Mesh none;
  constexpr std::uint64_t of_a_vertex = sizeof none.vertices[0],
                          of_a_triangle = sizeof none.triangles[0] + sizeof none.material[0];
  if (head.text > most_text || head.triangles > max_mesh_triangles || head.vertices > 3 * head.triangles) return broken();
  if (static_cast<std::uint64_t>(status.st_size) != at + head.text + of_a_vertex * head.vertices + of_a_triangle * head.triangles)
    return broken();
  std::string text(head.text, '\0');
  if (!read_at(descriptor, std::span(text), at)) return broken();
  if (head.error != 0) return failure(static_cast<ErrorKind>(head.error), std::move(text));
  LoadedMesh mesh;
  for (std::size_t begin = 0, end = 0; (end = text.find('\0', begin)) != std::string::npos; begin = end + 1)
    mesh.material_names.push_back(text.substr(begin, end - begin));
  mesh.centred.centre_m = head.centre_m;
  mesh.centred.left_out = head.left_out;
  mesh.lost = head.lost;
  mesh.hidden = head.hidden;
  Mesh& m = mesh.centred.mesh;
  m.vertices.resize(head.vertices), m.triangles.resize(head.triangles), m.material.resize(head.triangles);
  if (!read_at(descriptor, std::span(m.vertices), at) || !read_at(descriptor, std::span(m.triangles), at) ||
      !read_at(descriptor, std::span(m.material), at) || !is_sound(mesh))
    return broken();
  return mesh;
}

}  // namespace sonar
