// The secret that control clients show when the configuration names a token_file. Read once at start, compared in constant time,
// never written anywhere.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "core/base/result.hpp"

namespace sonar {

class Token {
 public:
  static constexpr std::size_t shortest = 16, longest = 1024;

  Token() = default;  // none: whoever reaches the listener may ask
  explicit Token(std::string secret) : secret_(std::move(secret)) {}
  /// The file's text without blanks round it. Errors say what to do; `warning` is filled when others can read the file.
  static Result<Token> read(const std::filesystem::path& file, std::string& warning);

  bool needed() const { return !secret_.empty(); }
  /// True when none is needed, too. Takes as long for a wrong one as for the right one.
  bool matches(std::string_view shown) const;

 private:
  std::string secret_;
};

}  // namespace sonar
