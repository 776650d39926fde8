// The tree of a parsed text, to which Node and Map refer. The tree has no types of yaml-cpp, so that only strict_yaml.cpp
// includes them. Code outside core/text includes strict_yaml.hpp.
#pragma once

#include <cstddef>
#include <deque>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.hpp"

namespace sonar::text {

enum class YamlKind { null, scalar, sequence, map };

struct YamlNode {
  YamlKind kind = YamlKind::null;
  int line = 1, column = 1;          // position of the value, counted from 1
  int key_line = 0, key_column = 0;  // position of its key, if the parent is a map
  bool quoted = false;
  const YamlNode* parent = nullptr;
  std::string key;        // when the parent is a map
  std::size_t index = 0;  // when the parent is a sequence
  std::string scalar;
  std::vector<YamlNode*> children;

  // These are set when a reader uses this map.
  bool opened = false;
  bool any_key = false;  // its keys are names chosen by the user
  std::vector<std::string> requested, missing;
};

struct YamlTree {
  std::string name;  // the file, as errors print it
  ErrorKind error_kind = ErrorKind::config;
  std::deque<YamlNode> nodes;
  YamlNode* root = nullptr;
  std::optional<Error> first_error;

  static std::string path_of(const YamlNode* node);
  static std::string path_of(const YamlNode* map, std::string_view key);
  Error error_at(int line, int column, const std::string& path, std::string_view what) const;
  void record(int line, int column, const std::string& path, std::string_view what);
};

}  // namespace sonar::text
