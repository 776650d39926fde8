// Mesh files. Bytes that begin like PLY, glTF, GLB or COLLADA are used as they are; other bytes are a script that gives Wavefront
// lines, with faces whose corners may not exist. The result is a valid mesh, or a sentence that starts with the file's name. The
// checks before the importer run in this program. For files the importer runs in its own program, as in sonard, because its
// library does not survive all of them; for lines it runs here. This is slow, because the importer starts again for each file.
#include <cstdio>
#include <string>

#include "core/scene/import/check_mesh.hpp"
#include "core/scene/import/import_mesh.hpp"
#include "tests/fuzz/mesh_script.hpp"

namespace {

using namespace sonar;
using fuzz::coordinate;
using fuzz::require;
using fuzz::Script;

std::string wavefront(Script& script) {
  std::string text;
  char line[128];
  while (!script.ended() && text.size() < 8192) {
    const std::uint8_t kind = script.byte();
    if (kind % 8 < 5) {
      const double x = coordinate(script), y = coordinate(script), z = coordinate(script);
      std::snprintf(line, sizeof line, "v %.9g %.9g %.9g\n", x, y, z);
      text += line;
    } else if (kind % 8 < 7) {
      text += 'f';
      for (int k = 0; k < 1 + kind / 32; ++k) text.append(" ").append(std::to_string(static_cast<int>(script.byte()) - 40));
      text += '\n';
    } else {
      static constexpr const char* others[]{"g a\n",    "o b\n",   "usemtl c\n", "vn 0 0 1\n",
                                            "vt 0 1\n", "l 1 2\n", "p 1\n",      "s off\n"};
      text += others[script.byte() % 8];
    }
  }
  return text;
}

void check(const MeshFile& request, const Result<LoadedMesh>& made) {
  if (!made) return require(made.error().text.starts_with(request.file.string() + ": "));
  for (const std::uint16_t m : made->centred.mesh.material) require(m < made->material_names.size());
  fuzz::check(made->centred, made->centred.mesh.triangles.size() + made->centred.left_out);
}

/// Returns a file name for bytes with this beginning; null if no format has this beginning.
const char* name_of(std::string_view text) {
  if (text.starts_with("ply")) return "m.ply";
  if (text.starts_with("glTF")) return "m.glb";
  if (text.starts_with("{") || text.starts_with("[")) return "m.gltf";
  return text.starts_with("<") ? "m.dae" : nullptr;
}

void read(std::string_view text, const char* name) {
  for (const MeshFault& fault : {check_ply(ply_head_of(text), text.size()), check_gltf(text), check_collada(text)})
    require(!fault || !fault->empty());
  const MeshFile request{.file = name, .in_memory = text};
  check(request, load_mesh(request));
}

void import(Script& script) {
  static constexpr double scales[]{1, 0.001, 1e6, 1e-6, -1};
  const double scale = scales[script.byte() % 5];
  const std::uint8_t up = script.byte() % 3;
  const std::string text = wavefront(script);
  if (text.empty()) return;
  MeshFile request{.file = "m.obj", .scale = scale, .up = {}, .in_memory = text};
  if (up > 0) request.up = up == 1 ? UpAxis::y : UpAxis::z;
  check(request, import_mesh(request));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  if (const char* name = name_of(text)) return read(text, name), 0;
  Script script(data, size);
  import(script);
  return 0;
}
