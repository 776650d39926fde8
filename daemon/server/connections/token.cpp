#include "daemon/server/connections/token.hpp"

#include <algorithm>
#include <system_error>

#include <boost/beast/core/string.hpp>

#include "core/base/regular_file.hpp"
#include "daemon/server/system/sha256.hpp"

namespace sonar {
namespace {

constexpr std::string_view blanks = " \t\r\n";

tl::unexpected<Error> unusable(const std::filesystem::path& file, const std::string& why) {
  return failure(ErrorKind::config, "control.token_file " + file.string() + ": " + why);
}

}  // namespace

/// Refuses tokens that are too short, because they can be guessed, and tokens with blanks, which a header would cut.
Result<Token> Token::read(const std::filesystem::path& file, std::string& warning) {
  const auto read = read_regular(file, 2 * longest);
  if (!read && is_absent(file))
    return unusable(file, "cannot be read; make one: (umask 077; openssl rand -hex 24 > " + file.string() + ")");
  if (!read) return failure(ErrorKind::config, "control.token_file " + read.error().text);
  std::string text = *read;
  const auto first = text.find_first_not_of(blanks);
  text = first == std::string::npos ? "" : text.substr(first, text.find_last_not_of(blanks) - first + 1);
  if (text.size() < shortest) return unusable(file, "a token has at least 16 characters: openssl rand -hex 24");
  if (text.size() > longest) return unusable(file, "a token has at most 1024 characters");
  if (std::any_of(text.begin(), text.end(), [](char c) { return c <= ' ' || c > '~'; }))
    return unusable(file, "a token has letters, digits and signs only, on one line");
  std::error_code ec;
  const auto others = std::filesystem::perms::others_read;
  if ((std::filesystem::status(file, ec).permissions() & others) == others)
    warning = "control.token_file " + file.string() + " is readable by all users of this computer: chmod o-r it";
  return Token(std::move(text));
}

/// Compares digests, because they have equal lengths and the time of the comparison reveals nothing about the secret.
bool Token::matches(std::string_view shown) const {
  if (!needed()) return true;
  const std::string ours = sha256_of(secret_), theirs = sha256_of(shown);
  unsigned difference = 0;
  for (std::size_t i = 0; i < ours.size(); ++i) difference |= static_cast<unsigned char>(ours[i] ^ theirs[i]);
  return difference == 0;
}

std::string_view bearer_token(std::string_view authorization) {
  constexpr std::string_view scheme = "Bearer ";
  if (authorization.size() <= scheme.size() ||
      !boost::beast::iequals({authorization.data(), scheme.size()}, {scheme.data(), scheme.size()}))
    return {};
  authorization.remove_prefix(scheme.size());
  const auto first = authorization.find_first_not_of(' ');
  return first == std::string_view::npos ? std::string_view{} : authorization.substr(first);
}

}  // namespace sonar
