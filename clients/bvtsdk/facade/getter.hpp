// One getter, both interfaces: 3.x returns the value (0 for a bad handle), 4.x a code and the value through a pointer.
// The facade's sources are compiled once for each, with BVT_ABI 3 or 4 and that interface's header.
#pragma once

#include <bvt_sdk.h>

#include "clients/bvtsdk/facade/call.hpp"

// BVT_GETTER(int, Head, GetPingCount, Head, o.ping_count()) defines BVTHead_GetPingCount; `o` is the object, an Object.
// BVT_GETTER_AT also takes one argument list more, as (int row, int col).
#define BVT_UNPACK(...) __VA_ARGS__
#if BVT_ABI == 3
#define BVT_GETTER(Type, Class, Function, Kind, expression)                                               \
  Type BVT##Class##_##Function(BVT##Class self) {                                                         \
    return value<Kind>(self, static_cast<Type>(0), [&]([[maybe_unused]] Kind& o) { return expression; }); \
  }
#define BVT_GETTER_AT(Type, Class, Function, Kind, arguments, expression)                                 \
  Type BVT##Class##_##Function(BVT##Class self, BVT_UNPACK arguments) {                                   \
    return value<Kind>(self, static_cast<Type>(0), [&]([[maybe_unused]] Kind& o) { return expression; }); \
  }
#else
#define BVT_GETTER(Type, Class, Function, Kind, expression)                            \
  RetVal BVT##Class##_##Function(BVT##Class self, Type* out) {                         \
    return get<Kind>(self, out, [&]([[maybe_unused]] Kind& o) { return expression; }); \
  }
#define BVT_GETTER_AT(Type, Class, Function, Kind, arguments, expression)              \
  RetVal BVT##Class##_##Function(BVT##Class self, BVT_UNPACK arguments, Type* out) {   \
    return get<Kind>(self, out, [&]([[maybe_unused]] Kind& o) { return expression; }); \
  }
#endif
