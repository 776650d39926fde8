#include "daemon/server/sonars/visit_log.hpp"

#include <numeric>
#include <utility>

namespace sonar {

VisitLog::VisitLog(asio::io_context& io, Log& log, std::string sonar, std::chrono::milliseconds spell)
    : log_(log), sonar_(std::move(sonar)), spell_(spell), timer_(io) {}

/// Logs the first few visits of a spell individually; counts the other visits and summarises them in one line.
void VisitLog::say(Kind kind, const std::string& what, std::vector<LogField> fields) {
  if (!ended_ && !in_spell_) begin_spell();
  ++visits_;
  if (ended_ || (!crowded_ && visits_ <= lines_a_spell)) {
    fields.insert(fields.begin(), {"sonar", sonar_});
    return log_.info(what, fields);
  }
  ++suppressed_[static_cast<std::size_t>(kind)];
  last_suppressed_ = what;
}

/// Begins a spell. After a crowded spell the next one begins at once, and its visits are only counted.
void VisitLog::begin_spell() {
  in_spell_ = true;
  visits_ = 0;
  timer_.expires_after(spell_);
  timer_.async_wait([this](const error_code& ec) {
    if (ec || ended_) return;
    sum_up();
    crowded_ = visits_ > lines_a_spell;
    in_spell_ = false;
    if (crowded_) begin_spell();
  });
}

void VisitLog::sum_up() {
  const auto suppressed = std::exchange(suppressed_, {});
  if (std::accumulate(suppressed.begin(), suppressed.end(), std::uint64_t{0}) == 0) return;
  const auto count = [&](Kind kind) { return suppressed[static_cast<std::size_t>(kind)]; };
  log_.info("clients connect and leave often", {{"sonar", sonar_},
                                                {"connected", count(Kind::connected)},
                                                {"gone", count(Kind::gone)},
                                                {"refused", count(Kind::refused)},
                                                {"wait", count(Kind::waits)},
                                                {"within_s", spell_.count() / 1000},
                                                {"last", last_suppressed_}});
}

void VisitLog::end() {
  if (std::exchange(ended_, true)) return;
  timer_.cancel();
  sum_up();
}

}  // namespace sonar
