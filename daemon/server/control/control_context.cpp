#include "daemon/server/control/control_context.hpp"

namespace sonar {

void log_refusal(ControlContext& context, const std::string& why, const std::string& from) {
  say_at_times(context.log, context.refusals, LogLevel::warning, "control refused: " + why, {{"from", from}});
}

void log_fault(ControlContext& context, const std::exception_ptr& fault, const std::string& at) {
  say_fault(context.log, context.faults, text_of(fault), {"at", at});
}

asio::awaitable<bool> write_whole(ControlContext& context, tcp::socket& socket, Deadline& stall, const Sender& to,
                                  asio::const_buffer bytes) {
  while (bytes.size() > 0) {
    error_code ec;
    stall.within(context.limits.stall);
    bytes += co_await socket.async_write_some(asio::buffer(bytes), into(ec));
    if (stall.passed()) log_refusal(context, "client does not read", to.id);
    if (ec || !socket.is_open()) co_return false;
  }
  stall.none();
  co_return true;
}

}  // namespace sonar
