#include "core/text/format.hpp"

#include <cstdarg>
#include <cstdio>

namespace sonar::text {

std::string format(const char* pattern, ...) {
  va_list arguments, again;
  va_start(arguments, pattern);
  va_copy(again, arguments);
  const int size = std::vsnprintf(nullptr, 0, pattern, arguments);
  std::string out(size > 0 ? static_cast<std::size_t>(size) : 0, '\0');
  if (size > 0) std::vsnprintf(out.data(), out.size() + 1, pattern, again);
  va_end(again);
  va_end(arguments);
  return out;
}

std::string frequency_text(double hz) { return hz >= 1e6 ? format("%.3g MHz", hz / 1e6) : format("%.3g kHz", hz / 1e3); }

}  // namespace sonar::text
