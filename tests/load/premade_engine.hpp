// Pings made beforehand, 256 beams x 512 rows of 8 bit: an engine that needs almost no time, so that a load test measures the
// parts after it. Ping n shows picture n modulo their count, so that its reader can check that it is whole.
#pragma once

#include <chrono>

#include "core/pipeline/ping_engine.hpp"

namespace sonar::load {

inline constexpr std::size_t beams = 256, rows = 512, picture_bytes = beams * rows, pictures = 16;

/// Image of ping `number`.
std::span<const std::byte> picture_of(std::uint32_t number);

class PremadeEngine final : public PingEngine {
 public:
  std::vector<Ping> run(std::span<const PingRequest> requests) override;
  std::string description() const override { return "made beforehand"; }
};

}  // namespace sonar::load
