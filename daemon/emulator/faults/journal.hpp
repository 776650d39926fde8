// The journal of faults. It records each effect, so that a driver's reaction can be compared with it.
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "core/base/units.hpp"
#include "protocol/fault_kinds.hpp"

namespace sonar {

struct FaultEntry {
  enum class What { began, injected, ended } what{};
  std::string fault, asked;  // name of the fault; code or trouble as the user wrote it
  const FaultKind* kind = nullptr;
  std::string sonar;
  std::string client;               // address of the client; empty = the device itself
  std::uint64_t client_number = 0;  // number of the client, counted from 1 over the life of the sonar
  std::uint32_t ping = 0;           // number of the ping; 0 = none
  /// Position in this client's stream of the first changed byte, of the pause or of the end; -1 = none.
  std::int64_t offset = -1;
  std::uint64_t bytes_before = 0, bytes_after = 0;  // size of the message
  std::map<std::string, std::string> with;          // the parameters used
  Time at{};
};
inline constexpr std::array<std::string_view, 3> fault_entry_names = {"began", "injected", "ended"};

class FaultJournal {
 public:
  virtual ~FaultJournal() = default;
  virtual void write(const FaultEntry& entry) = 0;
};

}  // namespace sonar
