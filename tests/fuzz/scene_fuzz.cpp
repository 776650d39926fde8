// Fuzzes scene files: the result is a scene or a sentence that starts with the file's name.
// Texts are short and use no other files.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "core/scene/files/load_scene.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size > 4096) return 0;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto scene = sonar::parse_scene(text, "s.yaml", "no-such-folder");
  if (!scene && !scene.error().text.starts_with("s.yaml:")) std::abort();
  return 0;
}
