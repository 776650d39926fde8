// A log line as data, so that code that reports does not depend on the logger.
#pragma once

#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "daemon/config/runtime_options.hpp"

namespace sonar {

struct LogField {
  std::string key, value;
  LogField(std::string_view k, std::string_view v) : key(k), value(v) {}
  template <class T, class = std::enable_if_t<std::is_arithmetic_v<T>>>
  LogField(std::string_view k, T v) : key(k), value(std::to_string(v)) {}
};

struct LogLine {
  LogLevel level = LogLevel::info;
  std::string phrase;
  std::vector<LogField> fields;
};

}  // namespace sonar
