// Macros that define a getter for both interfaces. In 3.x a getter returns the value, or 0 for a bad handle; in 4.x it returns a
// code and writes the value through a pointer. The sources are compiled once with BVT_ABI 3 and once with BVT_ABI 4.
#pragma once

#include <bvt_sdk.h>

#include "clients/bvtsdk/facade/call.hpp"

// BVT_GETTER(int, Head, GetPingCount, Head, o.ping_count()) defines BVTHead_GetPingCount; `o` is the object of the handle.
// BVT_GETTER_AT has one more argument, the parameters of the getter: (int row, int col).
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
