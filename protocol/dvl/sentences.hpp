// The sentences that the device sends on its serial line: comma-separated texts with a checksum.
#pragma once

#include <string>
#include <string_view>

#include "protocol/dvl/reports.hpp"

namespace sonar::dvl {

/// CRC-8 with the polynomial 0x07 and the initial value 0.
std::uint8_t crc8(std::string_view text);
/// The sentence with its checksum, as a line.
Bytes sentence_line(std::string_view sentence);

/// The sentences of a ping; empty if `output` selects none.
Bytes velocity_sentences(const Measurement& measured, std::chrono::nanoseconds since_last, Time sent_at, SerialOutput output);
Bytes position_sentence(const Reckoning& reckoning, Time at);

}  // namespace sonar::dvl
