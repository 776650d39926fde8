#include "core/scene/import/import_files.hpp"

#include <assimp/DefaultIOStream.h>

#include <assimp/IOStream.hpp>

#include <algorithm>
#include <array>
#include <cstring>
#include <memory>

#include "core/base/letters.hpp"
#include "core/base/regular_file.hpp"
#include "core/scene/files/mesh_steps.hpp"
#include "core/scene/import/check_mesh.hpp"
#include "core/scene/import/gltf_floats.hpp"

namespace sonar {
namespace {

// Assimp 5.2 searches a list for each object and copies the list: 8,000 objects take 0.3 s, 50,000 take minutes.
constexpr std::uint64_t most_objects = 10'000;

bool begins_object(char c) { return c == 'o' || c == 'g'; }  // no other statements of OBJ files begin with these

/// Reads the text of an OBJ file and finds the faces and the numbers of their vertices. Numbers of texture coordinates and
/// normals, which are not needed, become blanks, so that invalid ones do not matter.
class ObjText {
 public:
  struct Step {
    char c;  // the character to pass to the importer
    bool begins_object = false, begins_vertex = false, begins_face = false, begins_corner = false;
    bool is_index = false;  // part of the number of a corner's vertex
  };

  Step next(char c) {
    Step step{c};
    step.begins_vertex = after_v_ && is_blank(c);
    after_v_ = false;
    const bool goes_on =
        in_face_ && before_ == '\\' && (c == '\n' || c == '\r');  // the face continues in the next line; both become one line
    if (goes_on) {
      step.c = ' ';
      in_word_ = false;
    } else if (c == '\n') {
      line_begins_ = true;
      in_face_ = in_word_ = in_comment_ = false;
    } else if (line_begins_ && is_before_words(c)) {
      step.c = '\n';  // the importer ignores lines that begin with a blank, and a first line with a byte order mark
    } else if (line_begins_) {
      step.begins_object = begins_object(c) && before_ == '\n';
      after_v_ = c == 'v' && before_ == '\n';
      line_begins_ = false, in_face_ = step.begins_face = c == 'f', in_word_ = true, in_vertex_ = slashed_ = false;
    } else if (is_blank(c)) {
      in_word_ = false;
    } else if (in_face_ && (in_comment_ || c == '\\' || c == '#')) {
      in_comment_ = in_comment_ || c == '#';
      step.c = ' ';
    } else if (in_face_) {
      if (!in_word_) step.begins_corner = in_vertex_ = true;
      in_word_ = true;
      if (c == '/') in_vertex_ = false, slashed_ = true;
      if (!in_vertex_ && slashed_) step.c = ' ';
      if (in_vertex_) slashed_ = false, step.is_index = true;
    }
    if (c != '\r') before_ = goes_on ? ' ' : step.c == '\n' ? '\n' : c;
    first_ = first_ && is_mark(c);
    faces_ += step.begins_face;
    return step;
  }
  /// Number of faces that have begun.
  std::uint64_t faces() const { return faces_; }

 private:
  static bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r'; }
  static bool is_mark(char c) { return c == '\xEF' || c == '\xBB' || c == '\xBF'; }
  bool is_before_words(char c) const { return is_blank(c) || (first_ && is_mark(c)); }
  std::uint64_t faces_ = 0;
  char before_ = '\n';
  bool first_ = true, after_v_ = false, line_begins_ = true, in_face_ = false, in_word_ = false, in_vertex_ = false,
       slashed_ = false, in_comment_ = false;
};

struct ObjCounts {
  std::uint64_t objects = 0, triangles = 0, free_form = 0;  // free_form: curved surfaces without faces
  std::vector<std::uint64_t> bad_faces;  // numbers of faces with vertices that the file does not have, increasing
};

/// Counts the parts of an OBJ file and finds the faces for which the importer would reject the whole file.
class ObjCounter {
 public:
  void take(char c) {
    const ObjText::Step step = text_.next(c);
    find_surface(c);
    counts_.objects += step.begins_object;
    vertices_ += step.begins_vertex;
    if (!step.is_index) end_corner();  // before the next vertex, because negative numbers count back from here
    if (step.begins_face) {
      end_face();
      face_ = text_.faces();
    }
    if (step.begins_corner) {
      ++corners_;
      index_ = 0, is_negative_ = c == '-', is_number_ = true;
      if (is_negative_) return;
    }
    if (step.is_index && is_number_) {
      is_number_ = c >= '0' && c <= '9';
      if (is_number_) index_ = std::min<std::uint64_t>(10 * index_ + static_cast<std::uint64_t>(c - '0'), most_index);
    }
  }
  ObjCounts end() {
    end_face();
    for (const auto& [face, furthest] : later_)
      if (furthest > vertices_) counts_.bad_faces.push_back(face);
    std::sort(counts_.bad_faces.begin(), counts_.bad_faces.end());
    return std::move(counts_);
  }

 private:
  void find_surface(char c) {
    static constexpr std::string_view statement = "surf ";
    if (c == '\n' || c == '\r') {
      of_statement_ = 0;
    } else if (of_statement_ < statement.size()) {
      of_statement_ = c == statement[of_statement_] ? of_statement_ + 1 : statement.size() + 1;
      counts_.free_form += of_statement_ == statement.size();
    }
  }
  static constexpr std::uint64_t most_index = std::uint64_t{1} << 40;
  void end_corner() {
    if (!is_number_) return;
    is_bad_ |= is_negative_ ? index_ > vertices_ || index_ == 0 : index_ == 0;
    if (!is_negative_) furthest_ = std::max(furthest_, index_);
    is_number_ = false;
  }
  void end_face() {
    end_corner();
    counts_.triangles += std::max<std::uint64_t>(corners_, 2) - 2;
    if (is_bad_)
      counts_.bad_faces.push_back(face_);
    else if (furthest_ > vertices_)  // vertices may follow
      later_.emplace_back(face_, furthest_);
    corners_ = furthest_ = 0, is_bad_ = false;
  }

  ObjText text_;
  ObjCounts counts_;
  std::vector<std::pair<std::uint64_t, std::uint64_t>> later_;  // faces, each with its highest vertex number
  std::uint64_t vertices_ = 0, face_ = 0, corners_ = 0, index_ = 0, furthest_ = 0;
  std::size_t of_statement_ = 0;  // number of letters of "surf " that the line begins with
  bool is_negative_ = false, is_number_ = false, is_bad_ = false;
};

ObjCounts counts_of(std::FILE* file) {
  std::array<char, std::size_t{1} << 16> part;
  ObjCounter counter;
  while (const std::size_t n = std::fread(part.data(), 1, part.size(), file))
    for (std::size_t i = 0; i < n; ++i) counter.take(part[i]);
  return counter.end();
}

/// An OBJ file whose faces have only vertices. Bad faces become comments. If requested, lines that begin objects also become
/// comments, because surfaces and materials do not depend on objects.
class ObjStream final : public Assimp::IOStream {
 public:
  ObjStream(OpenFile file, std::size_t size, bool without_objects, const std::vector<std::uint64_t>& bad_faces)
      : file_(std::move(file)), size_(size), without_objects_(without_objects), bad_faces_(bad_faces) {}

  std::size_t Read(void* to, std::size_t size, std::size_t count) override {
    char* bytes = static_cast<char*>(to);
    const std::size_t n = size == 0 ? 0 : std::fread(bytes, 1, size * count, file_.get());
    for (std::size_t i = 0; i < n; ++i) {
      const ObjText::Step step = text_.next(bytes[i]);
      const bool left_out = (step.begins_object && without_objects_) ||
                            (step.begins_face && std::binary_search(bad_faces_.begin(), bad_faces_.end(), text_.faces()));
      bytes[i] = left_out ? '#' : step.c;
    }
    return size == 0 ? 0 : n / size;
  }
  /// Continues reading at a position, after reading the text before it. The importer also seeks its current position before each
  /// block.
  aiReturn Seek(std::size_t offset, aiOrigin origin) override {
    if (origin == aiOrigin_CUR) offset += Tell();
    if (origin == aiOrigin_END) offset = size_ - std::min(offset, size_);
    if (offset < Tell()) {
      if (std::fseek(file_.get(), 0, SEEK_SET) != 0) return aiReturn_FAILURE;
      text_ = {};
    }
    std::array<char, 4096> part;
    for (std::size_t left = offset - Tell(); left > 0;) {
      const std::size_t n = std::fread(part.data(), 1, std::min(left, part.size()), file_.get());
      if (n == 0) return aiReturn_FAILURE;
      for (std::size_t i = 0; i < n; ++i) text_.next(part[i]);
      left -= n;
    }
    return aiReturn_SUCCESS;
  }
  std::size_t Write(const void*, std::size_t, std::size_t) override { return 0; }
  std::size_t Tell() const override { return static_cast<std::size_t>(std::ftell(file_.get())); }
  std::size_t FileSize() const override { return size_; }
  void Flush() override {}

 private:
  OpenFile file_;
  std::size_t size_;
  bool without_objects_;
  const std::vector<std::uint64_t>& bad_faces_;  // belongs to the ImportFiles that opened this stream
  ObjText text_;
};

/// The beginning of a file as the importer compares it: in small letters, without leading blank lines.
struct PlainText {
  std::size_t blank_bytes = 0, text_bytes = 0;
};

class PlainStream final : public Assimp::DefaultIOStream {
 public:
  PlainStream(OpenFile file, const std::string& name, PlainText text) : DefaultIOStream(file.release(), name), text_(text) {}

  std::size_t Read(void* to, std::size_t size, std::size_t count) override {
    const std::size_t from = Tell(), n = DefaultIOStream::Read(to, size, count);
    char* const bytes = static_cast<char*>(to);
    for (std::size_t i = 0; i < n * size && from + i < text_.text_bytes; ++i)
      bytes[i] = from + i < text_.blank_bytes ? ' ' : small_letter(bytes[i]);
    return n;
  }

 private:
  PlainText text_;
};

/// Selects the header of a PLY file, or all of a text STL file; binary STL files on disk are read elsewhere.
PlainText plain_text_of(const std::filesystem::path& file, std::uintmax_t bytes) {
  const std::string head = read_regular(file, ply_head_bytes).value_or("");
  if (mesh_extension(file) == ".ply") return {0, ply_head_of(head).bytes};
  const std::size_t word = head.find_first_not_of(" \t\r\n");
  return word != head.npos && same_letters(head.substr(word, 5), "solid") ? PlainText{word, static_cast<std::size_t>(bytes)}
                                                                          : PlainText();
}

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
  if (mesh_extension(mesh_) != ".obj") return;
  is_obj_ = true;
  if (const auto file = open_regular(mesh_)) {
    ObjCounts counts = counts_of(file->get());
    without_objects_ = counts.objects > most_objects;
    obj_triangles_ = counts.triangles;
    bad_faces_ = std::move(counts.bad_faces);
    free_form_ = counts.free_form;
  }
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

std::optional<std::string> ImportFiles::bytes_of(const std::string& file) {
  if (folders_.empty()) return std::nullopt;
  const std::unique_ptr<Assimp::IOStream> stream(Open((folders_[0] / file).c_str(), "rb"));
  if (!stream) return std::nullopt;
  std::string bytes(stream->FileSize(), '\0');
  bytes.resize(stream->Read(bytes.data(), 1, bytes.size()));
  return bytes;
}

/// Decodes a URI of glTF, which has %20 for a blank. The name of the folder is not encoded.
std::string ImportFiles::plain_name(const std::string& file) const {
  const std::string folder = folders_.empty() ? std::string() : folders_[0].string();
  return file.starts_with(folder) ? folder + without_percents(file.substr(folder.size())) : file;
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
  if (const std::string plain = plain_name(file); !opened && plain != file) return Open(plain.c_str(), mode);
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
  if (const std::string kind = mesh_extension(place); is_mesh && (kind == ".ply" || kind == ".stl"))
    return new PlainStream(std::move(*opened), place.string(), plain_text_of(place, bytes));
  if (is_mesh && is_obj_) return new ObjStream(std::move(*opened), bytes, without_objects_, bad_faces_);
  return DefaultIOSystem::Open(place.c_str(), mode);
}

}  // namespace sonar
