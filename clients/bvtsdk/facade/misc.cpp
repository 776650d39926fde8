// The functions for discovery, error texts, version and log. clients/bvtsdk/README.md describes their behaviour.
#include "clients/bvtsdk/core/codes.hpp"
#include "clients/bvtsdk/facade/getter.hpp"

using namespace sonar::bvt;
using namespace sonar::bvt::facade;

BVTSonarDiscoveryAgent BVTSonarDiscoveryAgent_Create() { return create<DiscoveryObject, BVTSonarDiscoveryAgent>(); }
void BVTSonarDiscoveryAgent_Destroy(BVTSonarDiscoveryAgent self) { destroy<DiscoveryObject>(self); }
RetVal BVTSonarDiscoveryAgent_Start(BVTSonarDiscoveryAgent self) {
  return on<DiscoveryObject>(self, [](DiscoveryObject& o) { return o.agent.start(); });
}
RetVal BVTSonarDiscoveryAgent_Stop(BVTSonarDiscoveryAgent self) {
  return on<DiscoveryObject>(self, [](DiscoveryObject& o) -> int {
    o.agent.stop();
    return success;
  });
}
BVT_GETTER(int, SonarDiscoveryAgent, GetSonarCount, DiscoveryObject, o.agent.sonars().size())
RetVal BVTSonarDiscoveryAgent_GetSonarInfo(BVTSonarDiscoveryAgent self, int i, char* buffer, int size) {
  if (buffer && size > 0) buffer[0] = '\0';
  return on<DiscoveryObject>(self, [&](DiscoveryObject& o) -> int {
    const std::vector<std::string>& found = o.agent.sonars();
    if (i < 0 || static_cast<std::size_t>(i) >= found.size()) return index_out_of_bounds;
    return copy_text(found[static_cast<std::size_t>(i)], buffer, size);
  });
}

const char* BVTError_GetString(RetVal code) { return error_text(code); }
const char* BVTError_GetName(RetVal code) { return error_name(code); }

int BVTSDK_MajorVersion() { return BVT_ABI; }
int BVTSDK_MinorVersion() { return BVT_ABI == 3 ? 6 : 4; }
int BVTSDK_BuildNumber() { return 0; }

#if BVT_ABI == 4
void BVTSDK_Init() {}  // programs call it, and there is nothing to initialise
void BVTSDK_Shutdown() {}
#endif

RetVal BVTLogger_SetLevel(int level) {
  if (level < -1 || level > 2) return bad_parameter;
  return guarded([&]() -> int {
    set_log_level(static_cast<LogLevel>(level));
    return success;
  });
}
RetVal BVTLogger_SetTarget(const char* target) {
  return guarded([&]() -> int { return !target ? bad_parameter : set_log_target(target) ? success : file_open; });
}
