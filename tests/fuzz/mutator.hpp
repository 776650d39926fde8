// Makes inputs for fuzz targets without libFuzzer: slightly changed seeds, and random bytes. A pure function of the
// number, so that a failure can be run again.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace sonar::fuzz {

using Input = std::vector<std::uint8_t>;

/// Every tenth input is random; all are if there are no seeds.
Input made_up(std::uint32_t number, const std::vector<Input>& seeds, const std::vector<Input>& words);

/// The words of a libFuzzer dictionary: lines of name="value" with \xAB, \\ and \" inside. Empty when it cannot be read.
std::vector<Input> dictionary_from(const std::string& file);

}  // namespace sonar::fuzz
