// YamlTree, Node, Map and Document: read values from the tree, and report errors in them.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <tuple>
#include <unordered_map>

#include "core/text/decimal.hpp"
#include "core/text/format.hpp"
#include "core/text/nearest.hpp"
#include "core/text/strict_yaml.hpp"
#include "core/text/yaml_tree.hpp"

namespace sonar::text {
namespace {

std::string shown(double v) {
  std::array<char, 40> out{};
  std::snprintf(out.data(), out.size(), "%.10g", v);
  return out.data();
}

std::string describe(const YamlNode& node) {
  switch (node.kind) {
    case YamlKind::null:
      return "nothing";
    case YamlKind::sequence:
      return "a list";
    case YamlKind::map:
      return "a map";
    case YamlKind::scalar:
      break;
  }
  std::string text = node.scalar.substr(0, 60);
  for (char& c : text) {
    if (static_cast<unsigned char>(c) < 0x20) c = ' ';
  }
  return (node.quoted ? "the quoted text \"" : "\"") + text + (node.scalar.size() > 60 ? "...\"" : "\"");
}

bool add_once(std::vector<std::string>& names, std::string_view name) {
  if (std::find(names.begin(), names.end(), name) != names.end()) return false;
  names.emplace_back(name);
  return true;
}

std::string allowed(Range r) {
  const double open = std::numeric_limits<double>::max();
  const bool low = r.min > -open, high = r.max < open;
  if (low && high && !r.min_excluded) return "between " + shown(r.min) + " and " + shown(r.max);
  std::string out;
  if (low) out = (r.min_excluded ? "above " : "at least ") + shown(r.min);
  if (high) out += (out.empty() ? "at most " : " and at most ") + shown(r.max);
  return out;
}

bool inside(double v, Range r) {
  if (std::isinf(v)) {
    const double open = std::numeric_limits<double>::max();
    return r.infinity && (v > 0 ? r.max >= open : r.min <= -open);
  }
  return v >= r.min && v <= r.max && !(r.min_excluded && v == r.min);
}

}  // namespace

// ---- the tree ----

std::string YamlTree::path_of(const YamlNode* node) {
  if (node == nullptr || node->parent == nullptr) return {};
  if (node->parent->kind == YamlKind::map) return path_of(node->parent, node->key);
  return path_of(node->parent) + "[" + std::to_string(node->index) + "]";
}
std::string YamlTree::path_of(const YamlNode* map, std::string_view key) {
  const std::string parent = path_of(map);
  return parent.empty() ? std::string(key) : parent + "." + std::string(key);
}
Error YamlTree::error_at(int line, int column, const std::string& path, std::string_view what) const {
  return Error{error_kind, name + ":" + std::to_string(line) + ":" + std::to_string(column) + ": " +
                               (path.empty() ? "" : path + ": ") + std::string(what)};
}
void YamlTree::record(int line, int column, const std::string& path, std::string_view what) {
  if (!first_error) first_error = error_at(line, column, path, what);
}

// ---- Node ----

bool Node::is_null() const { return node_ && node_->kind == YamlKind::null; }
bool Node::is_scalar() const { return node_ && node_->kind == YamlKind::scalar; }
bool Node::is_sequence() const { return node_ && node_->kind == YamlKind::sequence; }
bool Node::is_map() const { return node_ && node_->kind == YamlKind::map; }

std::string Node::path() const { return node_ ? YamlTree::path_of(node_) : YamlTree::path_of(parent_, key_); }
std::string Node::key() const { return node_ ? node_->key : key_; }
std::string Node::location() const {
  const YamlNode* at = node_ ? node_ : parent_;
  if (!at || !tree_) return {};
  return tree_->name + ":" + std::to_string(at->line) + ":" + std::to_string(at->column);
}
void Node::fail(std::string_view what) const {
  const YamlNode* at = node_ ? node_ : parent_;
  // finish() reports a missing required key, and names an unknown key that resembles it.
  if (!node_ && at && std::find(at->missing.begin(), at->missing.end(), key_) != at->missing.end()) return;
  if (at && tree_) tree_->record(at->line, at->column, path(), what);
}
bool Node::expect_scalar(std::string_view wanted) const {
  if (!node_) return false;
  if (node_->kind == YamlKind::scalar) return true;
  fail("must be " + std::string(wanted) + ", found " + describe(*node_));
  return false;
}

std::string Node::text(std::size_t max_length, bool allow_empty) const {
  if (!expect_scalar("a text")) return {};
  if (node_->scalar.empty() && !allow_empty) return fail("must not be empty"), std::string{};
  if (node_->scalar.size() > max_length) {
    fail("has " + std::to_string(node_->scalar.size()) + " bytes, at most " + std::to_string(max_length) + " are allowed");
    return {};
  }
  return node_->scalar;
}
std::string Node::text_or(std::string fallback, std::size_t max_length) const {
  return present() ? text(max_length) : std::move(fallback);
}

double Node::number(Range range) const {
  if (!expect_scalar("a number")) return 0;
  auto value = node_->quoted ? std::nullopt : parse_decimal(node_->scalar);
  if (!value && !node_->quoted && range.infinity) value = parse_infinity(node_->scalar);
  if (!value) {
    fail("must be a finite decimal number, found " + describe(*node_) + std::string(number_hint(node_->scalar)));
    return 0;
  }
  if (!inside(*value, range)) return fail("must be " + allowed(range) + ", found " + node_->scalar.substr(0, 40)), 0.0;
  return *value;
}
double Node::number_or(double fallback, Range range) const {
  if (!present()) return fallback;
  return number(range);
}

std::int64_t Node::integer(std::int64_t min, std::int64_t max) const {
  if (!expect_scalar("a whole number")) return 0;
  const auto value = node_->quoted ? std::nullopt : parse_integer(node_->scalar);
  const bool too_long =
      !value && !node_->quoted && parse_decimal(node_->scalar) && node_->scalar.find_first_of(".eE") == std::string::npos;
  if (!value && !too_long) {
    fail("must be a whole decimal number, found " + describe(*node_) + std::string(number_hint(node_->scalar)));
    return 0;
  }
  if (too_long || *value < min || *value > max) {
    fail("must be between " + std::to_string(min) + " and " + std::to_string(max) + ", found " + node_->scalar.substr(0, 40));
    return 0;
  }
  return *value;
}
std::int64_t Node::integer_or(std::int64_t fallback, std::int64_t min, std::int64_t max) const {
  return present() ? integer(min, max) : fallback;
}
std::uint64_t Node::unsigned_integer_or(std::uint64_t fallback, std::uint64_t max) const {
  if (!present()) return fallback;
  if (!expect_scalar("a whole number")) return fallback;
  const auto value = node_->quoted ? std::nullopt : parse_unsigned(node_->scalar);
  if (!value || *value > max) {
    fail("must be a whole decimal number between 0 and " + std::to_string(max) + ", found " + describe(*node_) +
         std::string(number_hint(node_->scalar)));
    return fallback;
  }
  return *value;
}

bool Node::boolean() const {
  if (!expect_scalar("true or false")) return false;
  if (!node_->quoted && node_->scalar == "true") return true;
  if (node_->quoted || node_->scalar != "false") fail("must be true or false, found " + describe(*node_));
  return false;
}
bool Node::boolean_or(bool fallback) const { return present() ? boolean() : fallback; }

std::size_t Node::choice_index(std::vector<std::string_view> names) const {
  if (!expect_scalar("one of " + joined(names))) return 0;
  const auto found = std::find(names.begin(), names.end(), node_->scalar);
  if (found != names.end()) return static_cast<std::size_t>(found - names.begin());
  fail("unknown value " + describe(*node_) + suggestion(node_->scalar, names, "valid values"));
  return 0;
}

void Node::fill_numbers(double* out, std::size_t count, Range range) const {
  if (!node_) return;
  if (node_->kind != YamlKind::sequence || node_->children.size() != count) {
    const std::string found =
        node_->kind == YamlKind::sequence ? std::to_string(node_->children.size()) + " of them" : describe(*node_);
    return fail("must be a list of " + std::to_string(count) + " numbers, found " + found);
  }
  const auto elements = items();
  for (std::size_t i = 0; i < count; ++i) out[i] = elements[i].number(range);
}

std::vector<std::string> Node::texts(std::size_t min_count, std::size_t max_count) const {
  std::vector<std::string> out;
  for (const Node& item : items(min_count, max_count)) out.push_back(item.text());
  return out;
}

std::vector<Node> Node::items(std::size_t min_count, std::size_t max_count) const {
  if (!node_) return {};
  if (node_->kind != YamlKind::sequence) return fail("must be a list, found " + describe(*node_)), std::vector<Node>{};
  const std::size_t n = node_->children.size();
  if (n < min_count) fail("must have at least " + std::to_string(min_count) + (min_count == 1 ? " element" : " elements"));
  if (n > max_count) {
    fail("has " + std::to_string(n) + " elements, at most " + std::to_string(max_count) + " are allowed");
    return {};
  }
  std::vector<Node> out;
  out.reserve(n);
  for (YamlNode* child : node_->children) out.push_back(Node(tree_, child, node_, {}));
  return out;
}

Map Node::map() const {
  if (node_ && node_->kind != YamlKind::map) {
    fail("must be a map of keys and values, found " + describe(*node_));
    return Map(tree_, nullptr);
  }
  if (node_) node_->opened = true;
  return Map(tree_, node_);
}

// ---- Map ----

bool Map::has(std::string_view key) const {
  return node_ && std::any_of(node_->children.begin(), node_->children.end(), [&](const YamlNode* c) { return c->key == key; });
}
Node Map::optional(std::string_view key) {
  if (!node_) return Node(tree_, nullptr, nullptr, std::string(key));
  add_once(node_->requested, key);
  for (YamlNode* child : node_->children) {
    if (child->key == key) return Node(tree_, child, node_, {});
  }
  return Node(tree_, nullptr, node_, std::string(key));
}
Node Map::required(std::string_view key) {
  Node found = optional(key);
  if (node_ && !found.present()) add_once(node_->missing, key);
  return found;
}
std::vector<std::pair<std::string, Node>> Map::entries() {
  std::vector<std::pair<std::string, Node>> out;
  if (!node_) return out;
  node_->any_key = true;
  for (YamlNode* child : node_->children) {
    out.emplace_back(child->key, Node(tree_, child, node_, {}));
  }
  return out;
}
void Map::fail(std::string_view what) const {
  if (node_) tree_->record(node_->line, node_->column, path(), what);
}
std::string Map::path() const { return YamlTree::path_of(node_); }

// ---- Document ----

Document::Document(std::unique_ptr<YamlTree> tree) : tree_(std::move(tree)) {}
Document::Document(Document&&) noexcept = default;
Document& Document::operator=(Document&&) noexcept = default;
Document::~Document() = default;

Result<Document> Document::changed(const std::function<Result<std::string>(const std::string& text, int line)>& change) const {
  auto tree = std::make_unique<YamlTree>();
  tree->name = tree_->name, tree->error_kind = tree_->error_kind;
  std::unordered_map<const YamlNode*, YamlNode*> copies;
  for (const YamlNode& node : tree_->nodes) {  // in document order: each parent comes before its children
    YamlNode& copy = tree->nodes.emplace_back();
    copies[&node] = &copy;
    copy.kind = node.kind, copy.line = node.line, copy.column = node.column, copy.quoted = node.quoted;
    copy.key_line = node.key_line, copy.key_column = node.key_column, copy.index = node.index;
    for (const auto& [from, line, to] :
         {std::tuple{&node.key, node.key_line, &copy.key}, {&node.scalar, node.line, &copy.scalar}}) {
      auto text = change(*from, line);
      if (!text) return tl::make_unexpected(text.error());
      *to = *std::move(text);
    }
    if (node.parent == nullptr) continue;
    YamlNode* parent = copies.at(node.parent);
    copy.parent = parent;
    parent->children.push_back(&copy);
  }
  tree->root = copies.at(tree_->root);
  return Document(std::move(tree));
}

Map Document::root() const { return Node(tree_.get(), tree_->root, nullptr, {}).map(); }
std::optional<Error> Document::error() const { return tree_->first_error; }

namespace {

// If an unknown key resembles a missing key, the error is about the unknown key, because it explains more.
std::optional<Error> check_keys(const YamlTree& tree, const YamlNode& map) {
  std::vector<std::string_view> valid(map.requested.begin(), map.requested.end());
  std::vector<std::string_view> missing(map.missing.begin(), map.missing.end());
  const YamlNode* unknown = nullptr;
  for (const YamlNode* child : map.children) {
    if (std::find(valid.begin(), valid.end(), child->key) != valid.end()) continue;
    const bool near_missing = !nearest(child->key, missing).empty();
    if (near_missing || (!unknown && missing.empty())) unknown = child;
    if (near_missing) break;
  }
  if (unknown) {
    const auto& candidates = missing.empty() ? valid : missing;
    return tree.error_at(unknown->key_line, unknown->key_column, YamlTree::path_of(unknown),
                         "unknown key" + suggestion(unknown->key, candidates, "valid keys"));
  }
  if (missing.empty()) return std::nullopt;
  return tree.error_at(map.line, map.column, YamlTree::path_of(&map, missing.front()), "required key is missing");
}

}  // namespace

std::optional<Error> Document::finish() const {
  if (tree_->first_error) return tree_->first_error;
  for (const YamlNode& node : tree_->nodes) {  // in document order
    if (node.kind != YamlKind::map || !node.opened || node.any_key) continue;
    if (auto error = check_keys(*tree_, node)) return error;
  }
  return std::nullopt;
}

}  // namespace sonar::text
