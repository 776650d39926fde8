// Includes Boost.Asio for the daemon. Only this file includes it, so that <utility> comes first (awaitable.hpp of Boost 1.74
// needs std::exchange and does not include it) and every await handles its error code in the same way.
#pragma once

#include <chrono>
#include <exception>
#include <string>
#include <utility>

#include <boost/asio.hpp>

namespace sonar {

namespace asio = boost::asio;
using asio::ip::tcp;
using asio::ip::udp;
using boost::system::error_code;

/// Prevents exceptions in coroutines: co_await socket.async_...(..., into(ec)).
inline auto into(error_code& ec) { return asio::redirect_error(asio::use_awaitable, ec); }

/// Expiry of a timer that only waits for an event.
inline constexpr auto never = std::chrono::steady_clock::time_point::max();

/// Returns the text of an exception that ended a coroutine.
inline std::string text_of(const std::exception_ptr& fault) {
  try {
    std::rethrow_exception(fault);
  } catch (const std::exception& e) {
    return e.what();
  } catch (...) {
    return "an exception of no known kind";
  }
}

/// Runs the coroutine that `loop` returns. After an exception it calls `survives` with the text and runs the coroutine again if
/// that returns true, so that one message cannot end a listener.
void keep_running(const asio::any_io_executor& executor, auto loop, auto survives) {
  asio::co_spawn(executor, loop, [executor, loop, survives](const std::exception_ptr& fault) {
    if (fault && survives(text_of(fault))) keep_running(executor, loop, survives);
  });
}

}  // namespace sonar
