// The functions BVTSonar_* of both interfaces. clients/bvtsdk/README.md describes their behaviour.
#include "clients/bvtsdk/facade/getter.hpp"

using namespace sonar::bvt;
using namespace sonar::bvt::facade;
using SonarObject = sonar::bvt::Sonar;

namespace {

template <class F>
int name(BVTSonar self, char* buffer, int size, F which) {
  return get_text<SonarObject>(self, buffer, size,
                               [&](SonarObject& o) { return o.source() ? which(o.source()->sonar()) : std::string(); });
}

}  // namespace

BVTSonar BVTSonar_Create() { return create<SonarObject, BVTSonar>(); }

void BVTSonar_Destroy(BVTSonar self) {
  guarded([&]() -> int {
    const std::shared_ptr<SonarObject> sonar = handles().remove<SonarObject>(self);
    if (!sonar) return invalid_ptr;
    const std::lock_guard lock(sonar->mutex);
    sonar->reset();
    return success;
  });
}

RetVal BVTSonar_Open(BVTSonar self, const char* type, const char* parameter) {
  return on<SonarObject>(self, [&](SonarObject& o) -> int {
    if (!type || !parameter) return bad_parameter;
    const int code = o.open(type, parameter, BVT_ABI);
    log(LogLevel::status, std::string("open ") + type + " " + parameter + ": " + std::to_string(code));
    return code;
  });
}

RetVal BVTSonar_CreateFile(BVTSonar self, const char* file_name, BVTSonar source, const char*) {
  if (!file_name) return bad_parameter;
  SonarDescription of;
  const int code = on<SonarObject>(source, [&](SonarObject& o) -> int {
    if (!o.source()) return net_not_connected;
    of = o.description();
    return success;
  });
  return code != success ? code : on<SonarObject>(self, [&](SonarObject& o) { return o.create_file(file_name, of); });
}

RetVal BVTSonar_GetHead(BVTSonar self, int number, BVTHead* out) {
  if (!out) return invalid_ptr;
  *out = nullptr;
  return on<SonarObject>(self, [&](SonarObject& o) -> int {
    std::shared_ptr<Head> head;
    const int code = o.head(number, head);
    if (code != success) return code;
    if (BVT_ABI == 4) return give(head, out);
    if (!head->borrowed) head->borrowed = handles().add(head);
    *out = static_cast<BVTHead>(head->borrowed);
    return *out ? success : memory_alloc;
  });
}

BVT_GETTER(int, Sonar, GetHeadCount, SonarObject, o.source() ? o.source()->sonar().heads.size() : 0)
BVT_GETTER(float, Sonar, GetTemperature, SonarObject, o.source() ? o.source()->sonar().temperature_c : 0)
BVT_GETTER(int, Sonar, GetFileSize, SonarObject, o.source() ? o.source()->kilobytes() : 0)

RetVal BVTSonar_GetSonarName(BVTSonar self, char* buffer, int size) {
  return name(self, buffer, size, [](const SonarDescription& s) { return s.name; });
}
RetVal BVTSonar_GetSerialNumber(BVTSonar self, char* buffer, int size) {
  return name(self, buffer, size, [](const SonarDescription& s) { return s.serial; });
}

#if BVT_ABI == 3

RetVal BVTSonar_GetSonarTypeAsString(BVTSonar self, char* buffer, int size) {
  return name(self, buffer, size, [](const SonarDescription& s) { return s.model; });
}

#else

RetVal BVTSonar_GetSonarModelName(BVTSonar self, char* buffer, int size) {
  return name(self, buffer, size, [](const SonarDescription& s) { return s.model; });
}
RetVal BVTSonar_GetFirmwareRevision(BVTSonar self, char* buffer, int size) {
  return name(self, buffer, size, [](const SonarDescription& s) { return s.firmware; });
}
RetVal BVTSonar_SetTimestampsUseLocalClock(BVTSonar self, int on_or_off) {
  return on<SonarObject>(self, [&](SonarObject& o) { return o.set_local_clock(on_or_off); });
}
RetVal BVTSonar_PutEventMark(BVTSonar self, const char* key, const char* text) {
  return on<SonarObject>(self, [&](SonarObject& o) -> int { return key && text ? o.put_event(key, text) : bad_parameter; });
}
BVT_GETTER(int, Sonar, GetTimestampsUseLocalClock, SonarObject, o.local_clock())
BVT_GETTER(int, Sonar, SupportsMulticast, SonarObject, 0)
BVT_GETTER(int, Sonar, GetNavDataCount, SonarObject, o.source() ? o.source()->nav_count() : 0)
BVT_GETTER(int, Sonar, GetTimeIndexedPingCount, SonarObject, o.source() ? o.source()->ping_count() : 0)
BVT_GETTER(int, Sonar, IsFile, SonarObject, o.source() && o.source()->is_file())
BVT_GETTER(int, Sonar, IsConnected, SonarObject, o.source() && o.source()->connected())

#endif
