// Decibel arithmetic, the type for points in time, and separate types for numbers that are easily confused.
#pragma once

#include <chrono>
#include <cmath>
#include <cstdint>

namespace sonar {

using Time = std::chrono::sys_time<std::chrono::nanoseconds>;
enum class Seed : std::uint64_t {};
enum class PingNumber : std::uint32_t {};

inline double seconds(std::chrono::nanoseconds d) { return std::chrono::duration<double>(d).count(); }
inline std::chrono::nanoseconds nanoseconds_from(double s) {
  return std::chrono::nanoseconds(static_cast<std::int64_t>(std::llround(s * 1e9)));
}

inline double amplitude_from_db(double db) { return std::pow(10.0, db / 20.0); }
inline double power_from_db(double db) { return std::pow(10.0, db / 10.0); }
inline double db_from_amplitude(double a) { return 20.0 * std::log10(a); }
inline double db_from_power(double p) { return 10.0 * std::log10(p); }

}  // namespace sonar
