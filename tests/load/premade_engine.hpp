// An engine with premade pings of 256 beams x 512 rows of 8 bit. It needs almost no time, so that a load test measures the code
// after it. Ping n has picture n modulo the number of pictures, so that readers can check it.
#pragma once

#include <chrono>

#include "core/pipeline/ping_engine.hpp"

namespace sonar::load {

inline constexpr std::size_t beams = 256, rows = 512, picture_bytes = beams * rows, pictures = 16;

/// Returns the image of ping `number`.
std::span<const std::byte> picture_of(std::uint32_t number);

class PremadeEngine final : public PingEngine {
 public:
  std::vector<Ping> run(std::span<const PingRequest> requests) override;
  std::string description() const override { return "made beforehand"; }
};

}  // namespace sonar::load
