#include "daemon/server/http/page.hpp"

#include <algorithm>
#include <string>

#include "core/base/letters.hpp"

namespace sonar {
namespace {

// The page may use only files of this server: no inline code, and no other hosts. Other pages cannot contain it in frames.
constexpr const char* policy =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob:; connect-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

constexpr std::string_view blanks = " \t";

/// Calls take(name, parameters) for each element of a list such as "text/html;q=0.9, */*", until it returns true.
bool any_of_list(std::string_view list, auto take) {
  while (!list.empty()) {
    const auto comma = std::min(list.find(','), list.size());
    const std::string_view element = list.substr(0, comma);
    list.remove_prefix(std::min(comma + 1, list.size()));
    const auto semicolon = std::min(element.find(';'), element.size());
    if (take(trimmed(element.substr(0, semicolon), blanks),
             trimmed(element.substr(std::min(semicolon + 1, element.size())), blanks)))
      return true;
  }
  return false;
}

/// True for "q=0" and "q=0.000", which mean that the type is not acceptable.
bool excluded(std::string_view parameters) {
  return parameters.starts_with("q=0") && parameters.find_first_not_of("0.", 3) == std::string_view::npos;
}

bool names(std::string_view list, std::string_view wanted) {
  return any_of_list(list, [&](std::string_view name, std::string_view parameters) {
    return same_letters(name, wanted) && !excluded(parameters);
  });
}

}  // namespace

std::optional<HttpAnswer> page_answer(const PageRequest& request, std::span<const PageFile> files) {
  const auto file = std::find_if(files.begin(), files.end(), [&](const PageFile& f) { return f.path == request.path; });
  const bool is_root = request.path == "/";
  if (file == files.end() || (is_root && !names(request.accept, "text/html"))) return std::nullopt;
  if (!names(request.accept_encoding, "gzip"))
    return HttpAnswer{406, "the page is served compressed only: send Accept-Encoding: gzip\n", "text/plain; charset=utf-8"};

  const std::string tag = '"' + std::string(file->hash) + '"';
  HttpAnswer answer;
  answer.type = file->type;
  answer.headers = {{"ETag", tag},
                    {"Cache-Control", is_root ? "no-cache" : "public, max-age=31536000, immutable"},
                    {"Vary", is_root ? "Accept, Accept-Encoding" : "Accept-Encoding"},
                    {"Content-Security-Policy", policy},
                    {"Referrer-Policy", "no-referrer"},
                    {"Cross-Origin-Opener-Policy", "same-origin"},
                    {"Cross-Origin-Resource-Policy", "same-origin"}};
  const bool known = any_of_list(request.if_none_match, [&](std::string_view name, std::string_view) {
    return name == tag || name == "W/" + tag || name == "*";
  });
  if (known) {
    answer.status = 304;
    return answer;
  }
  answer.headers.emplace_back("Content-Encoding", "gzip");
  answer.body.assign(file->bytes.begin(), file->bytes.end());
  return answer;
}

}  // namespace sonar
