// The shared secret of control clients, from the file control.token_file of the configuration. It is read once at the start,
// compared in constant time, and never logged.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "core/base/result.hpp"

namespace sonar {

class Token {
 public:
  static constexpr std::size_t shortest = 16, longest = 1024;

  Token() = default;  // without a token, all clients are authorized
  explicit Token(std::string secret) : secret_(std::move(secret)) {}
  /// Reads the text of the file without surrounding blanks. Sets `warning` if other users can read the file.
  static Result<Token> read(const std::filesystem::path& file, std::string& warning);

  bool needed() const { return !secret_.empty(); }
  /// Compares in constant time. Returns true if no token is required.
  bool matches(std::string_view shown) const;

 private:
  std::string secret_;
};

/// Returns the token in "Authorization: Bearer abc"; empty for another text.
std::string_view bearer_token(std::string_view authorization);

}  // namespace sonar
