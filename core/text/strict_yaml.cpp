#include "core/text/strict_yaml.hpp"

#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/exceptions.h>
#include <yaml-cpp/mark.h>
#include <yaml-cpp/parser.h>

#include <algorithm>
#include <new>
#include <sstream>
#include <unordered_set>

#include "core/base/letters.hpp"
#include "core/base/regular_file.hpp"
#include "core/text/yaml_tree.hpp"

namespace sonar::text {
namespace {

struct Refused {  // thrown out of yaml-cpp's parser, caught in parse_yaml
  int line, column;
  std::string path, what;
};

// Builds the tree while yaml-cpp parses. So limits apply before memory grows, and aliases are never expanded.
class TreeBuilder final : public YAML::EventHandler {
 public:
  TreeBuilder(YamlTree& tree, const YamlLimits& limits) : tree_(tree), limits_(limits) {}

  void OnDocumentStart(const YAML::Mark&) override {}
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    refuse_anchor(mark, anchor);
    if (expects_key()) refuse(mark, "a key is missing before the colon");
    add(mark, YamlKind::null);
  }
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t) override {
    refuse(mark, "aliases are not read here; write the value out");
  }
  void OnScalar(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor, const std::string& value) override {
    refuse_anchor(mark, anchor);
    refuse_tag(mark, tag);
    if (expects_key()) return take_key(mark, value);
    YamlNode* node = add(mark, YamlKind::scalar);
    node->scalar = value;
    node->quoted = tag == "!";
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                       YAML::EmitterStyle::value) override {
    open(mark, tag, anchor, YamlKind::sequence);
  }
  void OnSequenceEnd() override { stack_.pop_back(); }
  void OnMapStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor, YAML::EmitterStyle::value) override {
    open(mark, tag, anchor, YamlKind::map);
  }
  void OnMapEnd() override { stack_.pop_back(); }

 private:
  struct Level {
    YamlNode* node;
    bool have_key = false;
    std::string key;
    YAML::Mark key_mark;
    std::unordered_set<std::string> seen;
  };

  bool expects_key() const { return !stack_.empty() && stack_.back().node->kind == YamlKind::map && !stack_.back().have_key; }

  [[noreturn]] void refuse(const YAML::Mark& mark, std::string what) const {
    std::string path;
    if (!stack_.empty()) {
      const Level& level = stack_.back();
      path = level.have_key ? YamlTree::path_of(level.node, level.key) : YamlTree::path_of(level.node);
    }
    throw Refused{std::max(mark.line, 0) + 1, std::max(mark.column, 0) + 1, path, std::move(what)};
  }
  void refuse_anchor(const YAML::Mark& mark, YAML::anchor_t anchor) const {
    if (anchor != 0) refuse(mark, "anchors are not read here; write the value out where it is used");
  }
  void refuse_tag(const YAML::Mark& mark, const std::string& tag) const {
    if (!tag.empty() && tag != "?" && tag != "!") refuse(mark, "tags are not read here; remove \"" + tag.substr(0, 40) + "\"");
  }

  void take_key(const YAML::Mark& mark, const std::string& key) {
    Level& level = stack_.back();
    if (key.empty() || key.size() > 256) refuse(mark, "a key must have 1 to 256 characters");
    if (!level.seen.insert(key).second) {
      throw Refused{mark.line + 1, mark.column + 1, YamlTree::path_of(level.node, key), "key given twice; keep one"};
    }
    level.key = key;
    level.key_mark = mark;
    level.have_key = true;
  }

  YamlNode* add(const YAML::Mark& mark, YamlKind kind) {
    if (tree_.nodes.size() >= limits_.max_nodes)
      refuse(mark, "more than " + std::to_string(limits_.max_nodes) + " values in one file");
    YamlNode& node = tree_.nodes.emplace_back();
    node.kind = kind;
    node.line = std::max(mark.line, 0) + 1;
    node.column = std::max(mark.column, 0) + 1;
    if (stack_.empty()) {
      tree_.root = &node;
      return &node;
    }
    Level& level = stack_.back();
    node.parent = level.node;
    if (level.node->kind == YamlKind::map) {
      node.key = std::move(level.key);
      node.key_line = level.key_mark.line + 1;
      node.key_column = level.key_mark.column + 1;
      if (kind == YamlKind::null) node.line = node.key_line, node.column = node.key_column;
      level.have_key = false;
    } else {
      node.index = level.node->children.size();
    }
    level.node->children.push_back(&node);
    return &node;
  }

  void open(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor, YamlKind kind) {
    refuse_anchor(mark, anchor);
    refuse_tag(mark, tag);
    if (expects_key()) refuse(mark, "a key must be a plain word, not a list or a map");
    if (static_cast<int>(stack_.size()) >= limits_.max_depth) {
      refuse(mark, "nested deeper than " + std::to_string(limits_.max_depth) + " levels");
    }
    YamlNode* node = add(mark, kind);
    stack_.push_back(Level{.node = node, .have_key = false, .key = {}, .key_mark = {}, .seen = {}});
  }

  YamlTree& tree_;
  const YamlLimits& limits_;
  std::vector<Level> stack_;
};

// Refuses control characters, text that is not UTF-8, and too many open brackets, of which yaml-cpp's scanner keeps a stack.
std::optional<Refused> check_characters(std::string_view text) {
  constexpr int open_brackets_at_most = 256;
  int line = 1, column = 1, open = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto c = static_cast<unsigned char>(text[i]);
    if ((c < 0x20 && c != '\n' && c != '\r' && c != '\t') || c == 0x7f) {
      return Refused{line, column, {}, "a control character; this is not a text file"};
    }
    const std::size_t length = utf8_length(text.substr(i));
    if (length == 0) return Refused{line, column, {}, "not UTF-8; save the file as UTF-8"};
    if (c == '[' || c == '{') ++open;
    if (c == ']' || c == '}') open = std::max(open - 1, 0);
    if (open > open_brackets_at_most)
      return Refused{line, column, {}, "more than 256 brackets ([ or {) are open here, also counted in comments and quotes"};
    i += length - 1;
    column += static_cast<int>(length);
    if (c == '\n') ++line, column = 1;
  }
  return std::nullopt;
}

tl::unexpected<Error> no_memory_for(const std::string& name) {
  return failure(ErrorKind::unavailable,
                 name + ": not enough memory to read it; raise the limits of memory (ulimit -v, LimitAS=, MemoryMax=)");
}

std::string first_line(std::string_view s) { return std::string(s.substr(0, std::min<std::size_t>(s.find('\n'), 200))); }

}  // namespace

Result<Document> parse_yaml(std::string_view text, std::string name, const YamlLimits& limits) {
  auto tree = std::make_unique<YamlTree>();
  tree->name = std::move(name);
  tree->error_kind = limits.error_kind;
  const auto refused = [&](const Refused& r) { return tl::make_unexpected(tree->error_at(r.line, r.column, r.path, r.what)); };
  if (text.size() > limits.max_bytes) {
    return refused(
        {1,
         1,
         {},
         "the file has " + std::to_string(text.size()) + " bytes, at most " + std::to_string(limits.max_bytes) + " are read"});
  }
  if (const auto bad = check_characters(text)) return refused(*bad);
  try {
    std::istringstream stream{std::string(text)};
    YAML::Parser parser(stream);
    TreeBuilder builder(*tree, limits);
    if (!parser.HandleNextDocument(builder) || tree->root == nullptr || tree->root->kind == YamlKind::null) {
      return refused({1, 1, {}, "the file is empty"});
    }
    YamlTree rest;
    TreeBuilder second(rest, limits);
    if (parser.HandleNextDocument(second)) {
      return refused({rest.root ? rest.root->line : 1, 1, {}, "a second document; only one per file is read"});
    }
  } catch (const Refused& r) {
    return refused(r);
  } catch (const YAML::Exception& e) {
    return refused({std::max(e.mark.line, 0) + 1, std::max(e.mark.column, 0) + 1, {}, "not valid YAML: " + first_line(e.msg)});
  } catch (const std::bad_alloc&) {
    return no_memory_for(tree->name);
  } catch (const std::exception& e) {
    return refused({1, 1, {}, std::string("not valid YAML: ") + e.what()});
  }
  return Document(std::move(tree));
}

Result<Document> parse_yaml_file(const std::filesystem::path& file, const YamlLimits& limits) {
  try {
    const auto text = read_regular(file, limits.max_bytes);
    if (!text) return tl::make_unexpected(text.error());
    return parse_yaml(*text, file.string(), limits);
  } catch (const std::bad_alloc&) {
    return no_memory_for(file.string());
  }
}

}  // namespace sonar::text
