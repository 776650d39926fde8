// A fault is a way in which an emulated sonar misbehaves on purpose, with a trigger, a duration and clients. check_fault()
// converts a user's record to faults, or returns an error.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.hpp"
#include "core/text/ipv4.hpp"
#include "protocol/control/operations.hpp"
#include "protocol/fault_kinds.hpp"

namespace sonar {

/// Events that a fault can wait for.
enum class Occasion { connect, config, status, disconnect };
inline constexpr std::array<std::string_view, 4> occasion_names = {"connect", "config", "status", "disconnect"};

using control::FaultRecord;

/// The duration of each occurrence of a fault, and the number of occurrences.
struct Span {
  std::chrono::nanoseconds time{0};  // 0 = not limited by time
  std::uint64_t pings = 0;           // 0 = not limited by pings
  std::uint64_t count = 0;           // number of occurrences; 0 = one at every trigger
};

/// Selects clients of a sonar.
struct ClientChoice {
  enum class Kind { all, newest, oldest, number, prefix } kind = Kind::all;
  std::uint64_t number = 0;
  text::Ipv4 address{};
  int prefix_bits = 32;
};

/// A checked record of one kind, with all parameters.
struct Fault {
  std::string name, what;  // as the user wrote it
  const FaultKind* kind = nullptr;
  std::map<std::string, double> numbers;
  std::map<std::string, std::string> words;
  std::string sonar;
  ClientChoice client;
  FaultRecord::At at;
  std::optional<Occasion> on;
  Span span;
  std::chrono::nanoseconds delay{0};  // time from the trigger to the beginning, for later parts of a trouble

  double number(const std::string& parameter) const;
  const std::string& word(const std::string& parameter) const;
  /// Returns the parameters that the journal states, such as "bytes 16, fill zero".
  std::map<std::string, std::string> used() const;
};

inline constexpr std::chrono::seconds longest_manual_fault{600};
inline constexpr std::size_t most_faults = 256;

/// Converts a record to faults: one, or several for a trouble, named NAME.1, NAME.2, ... (NAME: the record's name, else the
/// trouble's). Errors (usage) name the record, the wrong part and the possible values. `manual`: the request came to a running
/// daemon; such faults always have an end.
Result<std::vector<Fault>> check_fault(const FaultRecord& record, bool manual);
/// Returns a sentence if both faults would change the same part of a message, else empty.
std::string conflict_of(const Fault& a, const Fault& b);

}  // namespace sonar
