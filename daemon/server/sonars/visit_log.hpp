// Log lines on clients that connect and leave: one line for each, and for frequent visits one line from time to time with their
// number. Used by Device, because any client can cause such lines again and again. I/O thread only.
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

  /// `spell`: up to lines_a_spell visits within one are logged as they happen.
  VisitLog(asio::io_context& io, Log& log, std::string sonar, std::chrono::milliseconds spell = std::chrono::seconds(10));
  void say(Kind kind, const std::string& what, std::vector<LogField> fields);
  /// Writes what has been held back; from now on every line is written at once.
  void end();

 private:
  void begin_spell();
  void sum_up();

  Log& log_;
  std::string sonar_;
  std::chrono::milliseconds spell_;
  asio::steady_timer timer_;
  bool in_spell_ = false, ended_ = false;
  bool crowded_ = false;  // the previous spell had more visits than lines, so this one is only summed up
  int visits_ = 0;        // visits in this spell
  std::array<std::uint64_t, static_cast<std::size_t>(Kind::kinds)> unsaid_{};
  std::string last_unsaid_;
};

}  // namespace sonar
