// Makes inputs for fuzz targets without libFuzzer: slightly changed seeds, and random bytes. The input depends only on its
// number, so that a failure can be repeated.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace sonar::fuzz {

using Input = std::vector<std::uint8_t>;

/// Returns the input of this number. Every tenth input is random; without seeds all are random.
Input made_up(std::uint32_t number, const std::vector<Input>& seeds, const std::vector<Input>& words);

/// Returns the words of a libFuzzer dictionary: lines of name="value" with \xAB, \\ and \" inside; none if it cannot be read.
std::vector<Input> dictionary_from(const std::string& file);

}  // namespace sonar::fuzz
