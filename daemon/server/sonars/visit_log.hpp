// Logs clients that connect and leave: one line per visit, but for frequent visits only a periodic line with their number,
// because any client can cause such lines. Only the I/O thread uses it.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "daemon/server/system/asio.hpp"
#include "daemon/server/system/log.hpp"

namespace sonar {

class VisitLog {
 public:
  enum class Kind { connected, gone, refused, waits, kinds };
  static constexpr int lines_a_spell = 8;

  /// `spell`: length of a period, in which up to lines_a_spell visits are logged individually.
  VisitLog(asio::io_context& io, Log& log, std::string sonar, std::chrono::milliseconds spell = std::chrono::seconds(10));
  void say(Kind kind, const std::string& what, std::vector<LogField> fields);
  /// Writes the held lines. Later lines are written at once.
  void end();

 private:
  void begin_spell();
  void sum_up();

  Log& log_;
  std::string sonar_;
  std::chrono::milliseconds spell_;
  asio::steady_timer timer_;
  bool in_spell_ = false, ended_ = false;
  bool crowded_ = false;  // true: the previous spell had too many visits, so this one is only summarised
  int visits_ = 0;        // visits in this spell
  std::array<std::uint64_t, static_cast<std::size_t>(Kind::kinds)> suppressed_{};
  std::string last_suppressed_;
};

}  // namespace sonar
