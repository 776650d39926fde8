#include "clients/sonarctl/http.hpp"

#include <algorithm>
#include <array>
#include <charconv>

namespace sonar::clients {

namespace {
constexpr std::size_t longest_answer = 65536;
}

Result<HttpReply> http_ask(const Endpoint& at, const std::string& method, const std::string& path, const std::string& body,
                           std::chrono::milliseconds patience) {
  const auto deadline = std::chrono::steady_clock::now() + patience;
  const auto socket = connect_tcp(at, patience);
  if (!socket) return tl::unexpected(socket.error());
  std::string request = method + " " + path + " HTTP/1.0\r\nHost: " + text_from(at) +
                        "\r\nConnection: close\r\n";  // HTTP/1.0 has no chunked answers
  if (!body.empty()) request += "Content-Type: application/json\r\nContent-Length: " + std::to_string(body.size()) + "\r\n";
  request += "\r\n" + body;
  if (auto sent = write_all(*socket, std::as_bytes(std::span(request.data(), request.size()))); !sent)
    return tl::unexpected(sent.error());
  std::string answer;
  std::array<std::byte, 4096> chunk;
  while (answer.size() < longest_answer) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now());
    const Read read = read_some(*socket, chunk, std::clamp(left, std::chrono::milliseconds(0), longest_step));
    if (read.what == Wait::timed_out && left.count() > 0 && interrupted == 0) continue;
    if (read.what != Wait::data) break;
    for (std::size_t i = 0; i < read.size; ++i) answer += static_cast<char>(chunk[i]);
  }
  HttpReply reply;
  if (answer.starts_with("HTTP/1.") && answer.size() > 12) std::from_chars(answer.data() + 9, answer.data() + 12, reply.status);
  const std::size_t end = answer.find("\r\n\r\n");
  if (reply.status == 0 || end == std::string::npos)
    return failure(ErrorKind::bad_data, "no answer of HTTP came from tcp " + text_from(at));
  reply.body = answer.substr(end + 4);
  return reply;
}

}  // namespace sonar::clients
