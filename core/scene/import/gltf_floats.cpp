#include "core/scene/import/gltf_floats.hpp"

#include <algorithm>
#include <cstring>
#include <nlohmann/json.hpp>
#include <vector>

#include "core/base/base64.hpp"
#include "core/scene/import/check_mesh.hpp"

namespace sonar {
namespace {

using Json = nlohmann::json;

constexpr int type_float = 5126;
constexpr std::size_t bytes_of_float = 4;

tl::unexpected<Error> bad_gltf(const std::string& what) { return failure(ErrorKind::bad_data, what); }

/// How an accessor stores a number.
struct Component {
  std::size_t bytes = 0;
  double full = 1;  // divisor of normalised numbers
  double (*number)(const char* at) = nullptr;
};
template <class T>
double stored_number(const char* at) {
  T value;
  std::memcpy(&value, at, sizeof value);
  return static_cast<double>(value);
}
Component component_of(std::int64_t type) {
  switch (type) {
    case 5120:
      return {1, 127, stored_number<std::int8_t>};
    case 5121:
      return {1, 255, stored_number<std::uint8_t>};
    case 5122:
      return {2, 32767, stored_number<std::int16_t>};
    case 5123:
      return {2, 65535, stored_number<std::uint16_t>};
    default:
      return {};
  }
}

/// An unsigned number in a JSON object; nullopt if the value is missing or of another type.
std::optional<std::uint64_t> number_in(const Json& object, const char* key) {
  const auto found = object.find(key);
  return found != object.end() && found->is_number_unsigned() ? std::optional(found->get<std::uint64_t>()) : std::nullopt;
}
const Json& list_in(const Json& object, const char* key) {
  static const Json empty = Json::array();
  const auto found = object.find(key);
  return found != object.end() && found->is_array() ? *found : empty;
}

class Rewriter {
 public:
  Rewriter(std::string_view file, const ReadBeside& beside, std::uint64_t most_bytes)
      : file_(file), beside_(beside), most_bytes_(most_bytes) {}

  Result<std::string> rewrite() {
    in_ = Json::parse(json_of_gltf(file_), nullptr, false);
    if (!in_.is_object()) return bad_gltf("has JSON that is damaged; export it again");
    if (auto r = take_buffers(); !r) return tl::make_unexpected(r.error());
    take_views();
    out_["accessors"] = list_in(in_, "accessors");
    if (auto r = take_meshes(); !r) return tl::make_unexpected(r.error());
    out_["asset"] = {{"version", "2.0"}};
    for (const char* key : {"scene", "scenes", "nodes", "skins"})
      if (const auto found = in_.find(key); found != in_.end()) out_[key] = *found;
    if (auto r = complete_skins(); !r) return tl::make_unexpected(r.error());
    if (out_.contains("nodes") && out_["nodes"].is_array())
      for (Json& node : out_["nodes"])
        if (node.is_object())
          for (const char* key : {"camera", "extensions", "extras", "weights"}) node.erase(key);
    for (const Json& material : list_in(in_, "materials")) {
      Json named = Json::object();
      if (material.is_object() && material.contains("name") && material["name"].is_string()) named["name"] = material["name"];
      out_["materials"].push_back(std::move(named));
    }
    out_["buffers"] = {{{"byteLength", data_.size()}}};
    const std::string text = out_.dump();
    if (auto r = make_room(text.size()); !r) return tl::make_unexpected(r.error());
    return glb(text);
  }

 private:
  struct Buffer {
    std::size_t at = 0, bytes = 0;  // in data_
  };

  static constexpr std::size_t head = 12, chunk_head = 8;

  /// Returns an error if the file exceeds its limit with this many more bytes.
  Result<void> make_room(std::uint64_t more) const {
    constexpr std::size_t filling = 2 * 3;
    if (data_.size() <= most_bytes_ && more + head + 2 * chunk_head + filling <= most_bytes_ - data_.size()) return {};
    return bad_gltf("has vertices that take more than " + std::to_string(most_bytes_) +
                    " bytes as floating-point numbers; split it into several files");
  }

  void align() { data_.resize((data_.size() + 3) / 4 * 4); }

  /// Joins all buffers, in their order.
  Result<void> take_buffers() {
    for (const Json& buffer : list_in(in_, "buffers")) {
      const auto uri = buffer.is_object() ? buffer.find("uri") : buffer.end();
      const std::string number = std::to_string(buffers_.size());
      align();
      const std::size_t at = data_.size();
      if (!buffer.is_object() || uri == buffer.end() || !uri->is_string()) {
        if (buffers_.empty()) data_ += binary_part_of_glb(file_);
      } else if (const std::string& name = uri->get_ref<const std::string&>(); name.starts_with("data:")) {
        const std::size_t comma = name.find(',');
        const bool is_base64 = comma != name.npos && name.substr(0, comma).ends_with(";base64");
        const auto bytes = is_base64 ? from_base64(std::string_view(name).substr(comma + 1)) : std::nullopt;
        if (!bytes) return bad_gltf("has a buffer (" + number + ") that is not base64; export it again");
        data_ += *bytes;
      } else {
        const auto bytes = beside_(name);
        if (!bytes) return bad_gltf("names the file " + name.substr(0, 200) + ", which cannot be read; put it beside the mesh");
        data_ += *bytes;
      }
      buffers_.push_back({at, data_.size() - at});
      if (buffer.is_object() && number_in(buffer, "byteLength").value_or(0) > buffers_.back().bytes)
        return bad_gltf("has a buffer (" + number + ") that is cut short; fetch or export it again");
    }
    align();
    return {};
  }

  /// Moves all views to buffer 0. A view beyond the end of its buffer gets a buffer that does not exist, so the importer rejects
  /// this view if it needs it.
  void take_views() {
    out_["bufferViews"] = list_in(in_, "bufferViews");
    for (Json& view : out_["bufferViews"]) {
      sound_.push_back(false);
      if (!view.is_object()) continue;
      view.erase("extensions");
      const auto number = number_in(view, "buffer");
      const Buffer buffer = number && *number < buffers_.size() ? buffers_[*number] : Buffer();
      const std::uint64_t offset = number_in(view, "byteOffset").value_or(0);
      const bool inside = offset <= buffer.bytes && number_in(view, "byteLength").value_or(0) <= buffer.bytes - offset;
      view["buffer"] = inside ? 0 : 1;  // the result has only buffer 0
      if (!inside) continue;
      view["byteOffset"] = buffer.at + offset;
      sound_.back() = true;
    }
  }

  Result<void> take_meshes() {
    out_["meshes"] = list_in(in_, "meshes");
    for (Json& mesh : out_["meshes"]) {
      if (!mesh.is_object()) continue;
      for (const char* key : {"extensions", "extras", "weights"}) mesh.erase(key);
      if (!mesh.contains("primitives") || !mesh["primitives"].is_array()) continue;
      for (Json& primitive : mesh["primitives"]) {
        if (!primitive.is_object()) continue;
        if (primitive.contains("extensions") && primitive["extensions"].is_object() &&
            primitive["extensions"].contains("KHR_draco_mesh_compression"))
          return bad_gltf(
              "has vertices that are compressed (KHR_draco_mesh_compression), which are not read; convert it: "
              "gltf-transform dequantize IN OUT.glb");
        for (const char* key : {"extensions", "extras", "targets"}) primitive.erase(key);
        Json kept = Json::object();
        const Json attributes = primitive.value("attributes", Json::object());
        if (!attributes.is_object()) continue;
        for (const auto& [name, accessor] : attributes.items()) {
          const bool is_weight = name.starts_with("WEIGHTS_");
          if (name != "POSITION" && !is_weight && !name.starts_with("JOINTS_")) continue;
          kept[name] = accessor;
          if (name == "POSITION" || is_weight)
            if (auto r = make_floats(accessor, is_weight ? "VEC4" : "VEC3"); !r) return r;
        }
        primitive["attributes"] = std::move(kept);
      }
    }
    return {};
  }

  /// Gives unit matrices to skins without matrices, as glTF requires. The importer would crash on these skins.
  Result<void> complete_skins() {
    if (!out_.contains("skins") || !out_["skins"].is_array()) return {};
    for (Json& skin : out_["skins"]) {
      if (!skin.is_object() || number_in(skin, "inverseBindMatrices")) continue;
      const std::size_t joints = list_in(skin, "joints").size(), numbers = 16;
      align();
      const std::size_t at = data_.size();
      if (auto r = make_room(bytes_of_float * numbers * joints); !r) return r;
      data_.resize(at + bytes_of_float * numbers * joints);
      constexpr float one = 1;
      for (std::size_t k = 0; k < numbers * joints; ++k)
        if (k % numbers % 5 == 0) std::memcpy(data_.data() + at + bytes_of_float * k, &one, bytes_of_float);
      skin["inverseBindMatrices"] = out_["accessors"].size();
      out_["accessors"].push_back(accessor_of(at, joints, "MAT4"));
    }
    return {};
  }

  /// Returns an accessor of the numbers that were written from `at` to the end of the data.
  Json accessor_of(std::size_t at, std::uint64_t count, const std::string& kind) {
    out_["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", at}, {"byteLength", data_.size() - at}});
    return {{"bufferView", out_["bufferViews"].size() - 1}, {"componentType", type_float}, {"count", count}, {"type", kind}};
  }

  /// Converts the numbers of an accessor, unless they are floating-point numbers already.
  Result<void> make_floats(const Json& index, const std::string& kind) {
    Json& accessors = out_["accessors"];
    if (!index.is_number_unsigned() || index.get<std::size_t>() >= accessors.size()) return {};  // the importer rejects it
    Json& accessor = accessors[index.get<std::size_t>()];
    if (!accessor.is_object() || number_in(accessor, "componentType") == type_float) return {};
    const std::string of = "accessor " + std::to_string(index.get<std::size_t>());
    if (accessor.contains("sparse"))
      return bad_gltf("has sparse vertices that are whole numbers (" + of +
                      "), which are not read; convert it: gltf-transform dequantize IN OUT.glb");
    const Component component = component_of(static_cast<std::int64_t>(number_in(accessor, "componentType").value_or(0)));
    const std::uint64_t count = number_in(accessor, "count").value_or(0), per_vertex = kind == "VEC4" ? 4 : 3;
    const auto view_index = number_in(accessor, "bufferView");
    const Json& views = out_["bufferViews"];
    if (component.number == nullptr || accessor.value("type", Json()) != kind || !view_index || *view_index >= sound_.size())
      return bad_gltf("has vertices in a form that glTF does not have (" + of + "); export it again");
    const Json& view = views[*view_index];
    const std::uint64_t element = component.bytes * per_vertex, stride = number_in(view, "byteStride").value_or(element);
    const std::uint64_t begin = number_in(view, "byteOffset").value_or(0), length = number_in(view, "byteLength").value_or(0),
                        offset = number_in(accessor, "byteOffset").value_or(0);
    const bool inside = sound_[*view_index] && offset <= length && stride >= element &&
                        (count == 0 || (element <= length - offset && count - 1 <= (length - offset - element) / stride));
    if (!inside) return bad_gltf("has vertices beyond the end of their data (" + of + "); fetch or export it again");
    const bool normalized = accessor.value("normalized", Json(false)) == true;
    const std::size_t at = data_.size();
    if (auto r = make_room(bytes_of_float * per_vertex * count); !r) return r;
    data_.resize(at + bytes_of_float * per_vertex * static_cast<std::size_t>(count));
    for (std::uint64_t v = 0; v < count; ++v)
      for (std::uint64_t k = 0; k < per_vertex; ++k) {
        const double stored = component.number(data_.data() + begin + offset + v * stride + k * component.bytes);
        const auto value = static_cast<float>(normalized ? std::max(stored / component.full, -1.0) : stored);
        std::memcpy(data_.data() + at + bytes_of_float * (v * per_vertex + k), &value, bytes_of_float);
      }
    accessor = accessor_of(at, count, kind);
    return {};
  }

  std::string glb(std::string text) const {
    text.resize((text.size() + 3) / 4 * 4, ' ');
    const auto word = [](std::size_t v) {
      std::string bytes;
      for (int k = 0; k < 4; ++k) bytes += static_cast<char>(v >> 8 * k & 0xFF);
      return bytes;
    };
    std::string file = "glTF" + word(2) + word(head + 2 * chunk_head + text.size() + (data_.size() + 3) / 4 * 4);
    file += word(text.size()) + "JSON" + text + word((data_.size() + 3) / 4 * 4) + std::string("BIN\0", 4);
    file += data_;
    file.resize((file.size() + 3) / 4 * 4);
    return file;
  }

  std::string_view file_;
  const ReadBeside& beside_;
  std::uint64_t most_bytes_;
  Json in_, out_ = Json::object();
  std::vector<Buffer> buffers_;
  std::vector<bool> sound_;  // by view of the file: true if it lies within its buffer
  std::string data_;         // bytes of all buffers, and of the new numbers
};

}  // namespace

std::string without_percents(const std::string& uri) {
  std::string plain;
  const auto digit = [](char c) { return std::string_view("0123456789abcdef").find(static_cast<char>(c | 32)); };
  for (std::size_t at = 0; at < uri.size(); ++at) {
    const bool escaped = uri[at] == '%' && at + 2 < uri.size() && digit(uri[at + 1]) < 16 && digit(uri[at + 2]) < 16 &&
                         uri.compare(at, 3, "%00") != 0;  // a name ends at a zero byte
    plain += escaped ? static_cast<char>(16 * digit(uri[at + 1]) + digit(uri[at + 2])) : uri[at];
    if (escaped) at += 2;
  }
  return plain;
}

Result<std::string> gltf_with_floats(std::string_view file, const ReadBeside& beside, std::uint64_t most_bytes) {
  return Rewriter(file, beside, most_bytes).rewrite();
}

}  // namespace sonar
