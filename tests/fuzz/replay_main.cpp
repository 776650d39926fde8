// Runs a fuzz entry point over files named on the command line, or over made-up inputs when none is: random bytes of many
// lengths and long runs of one byte. Stands in for libFuzzer's main in ordinary builds.
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <vector>

#include "core/base/random.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace {

std::vector<std::uint8_t> random_bytes(std::uint32_t number) {
  const sonar::Random4 shape = sonar::philox(number, 0, 0, 0, 1, 0);
  std::vector<std::uint8_t> bytes(shape.v[0] % (1u << (shape.v[1] % 12)));
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    const sonar::Random4 draw = sonar::philox(number, static_cast<std::uint32_t>(i), 1, 0, 1, 0);
    bytes[i] = static_cast<std::uint8_t>(draw.v[0] & (shape.v[2] % 3 == 0 ? 0x7Fu : 0xFFu));  // a third of them is text
  }
  return bytes;
}

}  // namespace

int main(int argc, char** argv) {
  for (int i = 1; i < argc; ++i) {
    std::ifstream file(argv[i], std::ios::binary);
    const std::vector<char> text((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
    const std::vector<std::uint8_t> bytes(text.begin(), text.end());
    LLVMFuzzerTestOneInput(bytes.data(), bytes.size());
  }
  if (argc > 1) return 0;
  for (std::uint32_t number = 0; number < 2000; ++number) {
    const std::vector<std::uint8_t> bytes = random_bytes(number);
    LLVMFuzzerTestOneInput(bytes.data(), bytes.size());
  }
  for (int value = 0; value < 256; ++value) {
    const std::vector<std::uint8_t> bytes(777, static_cast<std::uint8_t>(value));
    LLVMFuzzerTestOneInput(bytes.data(), bytes.size());
  }
  std::puts("2256 made-up inputs survived");
}
