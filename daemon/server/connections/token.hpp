// The shared secret of control clients, from the configuration's control.token_file. Read once at start, compared in constant
// time, never logged.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "core/base/result.hpp"

namespace sonar {

class Token {
 public:
  static constexpr std::size_t shortest = 16, longest = 1024;

  Token() = default;  // none: all clients are authorized
  explicit Token(std::string secret) : secret_(std::move(secret)) {}
  /// The file's text without surrounding blanks. `warning` is set when other users can read the file.
  static Result<Token> read(const std::filesystem::path& file, std::string& warning);

  bool needed() const { return !secret_.empty(); }
  /// Takes constant time. Also true if no token is required.
  bool matches(std::string_view shown) const;

 private:
  std::string secret_;
};

/// The token in "Authorization: Bearer abc"; empty for anything else.
std::string_view bearer_token(std::string_view authorization);

}  // namespace sonar
