#include "tests/fuzz/mutator.hpp"

#include <algorithm>
#include <fstream>

#include "core/base/random.hpp"

namespace sonar::fuzz {
namespace {

constexpr std::size_t longest_input = 8192;

/// The random numbers of one input.
class Dice {
 public:
  explicit Dice(std::uint32_t input) : input_(input) {}
  std::uint32_t draw() { return philox(input_, ++count_, 0, 0, 1, 0).v[0]; }
  std::size_t below(std::size_t n) { return n == 0 ? 0 : draw() % n; }

 private:
  std::uint32_t input_, count_ = 0;
};

std::ptrdiff_t signed_of(std::size_t n) { return static_cast<std::ptrdiff_t>(n); }

Input from_nowhere(Dice& dice) {
  Input bytes(dice.below(std::size_t{1} << dice.below(12)));
  const std::uint32_t kind = dice.draw() % 4;
  const auto same = static_cast<std::uint8_t>(dice.draw());
  for (std::uint8_t& b : bytes) {
    const std::uint32_t drawn = dice.draw();
    b = kind == 0 ? same : static_cast<std::uint8_t>(drawn & (kind == 1 ? 0x7Fu : 0xFFu));
  }
  return bytes;
}

void insert(Input& bytes, std::size_t at, const Input& what) {
  bytes.insert(bytes.begin() + signed_of(at), what.begin(), what.end());
}

void overwrite(Input& bytes, std::size_t at, const Input& what) {
  for (std::size_t i = 0; i < what.size() && at + i < bytes.size(); ++i) bytes[at + i] = what[i];
}

/// Returns a piece of another input or of this one.
Input piece_of(const Input& from, Dice& dice) {
  if (from.empty()) return {};
  const std::size_t at = dice.below(from.size()), n = 1 + dice.below(std::min<std::size_t>(64, from.size() - at));
  return {from.begin() + signed_of(at), from.begin() + signed_of(at + n)};
}

Input edge_number(Dice& dice) {
  static constexpr std::uint32_t edges[]{0,      1,      2,      0x7F,    0x80,       0xFF,       0x100,
                                         0x7FFF, 0x8000, 0xFFFF, 0x10000, 0x7FFFFFFF, 0x80000000, ~0u};
  const std::uint32_t value = edges[dice.below(std::size(edges))];
  Input bytes;
  for (std::size_t i = 0, n = std::size_t{1} << dice.below(3); i < n; ++i)
    bytes.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
  if (dice.draw() % 2 == 0) std::reverse(bytes.begin(), bytes.end());
  return bytes;
}

void change(Input& bytes, const std::vector<Input>& seeds, const std::vector<Input>& words, Dice& dice) {
  const std::size_t at = dice.below(bytes.size() + 1), inside = std::min(at, bytes.size() - !bytes.empty());
  const Input& word = words.empty() ? seeds.front() : words[dice.below(words.size())];
  switch (dice.draw() % 10) {
    case 0:
      if (!bytes.empty()) bytes[inside] = static_cast<std::uint8_t>(bytes[inside] ^ (1u << dice.below(8)));
      return;
    case 1:
      if (!bytes.empty()) bytes[inside] = static_cast<std::uint8_t>(dice.draw());
      return;
    case 2:
      return insert(bytes, at, {static_cast<std::uint8_t>(dice.draw())});
    case 3:
      bytes.erase(bytes.begin() + signed_of(at),
                  bytes.begin() + signed_of(at + dice.below(std::min<std::size_t>(32, bytes.size() - at) + 1)));
      return;
    case 4:
      return insert(bytes, at, word);
    case 5:
      return overwrite(bytes, at, word);
    case 6:
      return overwrite(bytes, at, edge_number(dice));
    case 7:
      return insert(bytes, at, piece_of(seeds[dice.below(seeds.size())], dice));
    case 8:
      return insert(bytes, at, piece_of(Input(bytes), dice));
    default:
      if (!bytes.empty()) bytes[inside] = static_cast<std::uint8_t>(bytes[inside] + (dice.draw() % 2 == 0 ? 1 : 255));
      return;
  }
}

int hex_digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  const char lower = static_cast<char>(c | 0x20);
  return lower >= 'a' && lower <= 'f' ? lower - 'a' + 10 : 0;
}

}  // namespace

Input made_up(std::uint32_t number, const std::vector<Input>& seeds, const std::vector<Input>& words) {
  Dice dice(number);
  if (seeds.empty() || number % 10 == 9) return from_nowhere(dice);
  Input bytes = seeds[dice.below(seeds.size())];
  for (std::size_t left = 1 + dice.below(std::size_t{1} << dice.below(5)); left > 0; --left) change(bytes, seeds, words, dice);
  if (bytes.size() > longest_input) bytes.resize(longest_input);
  return bytes;
}

std::vector<Input> dictionary_from(const std::string& file) {
  std::vector<Input> words;
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) {
    const std::size_t from = line.find('"'), to = line.rfind('"');
    if (line.starts_with('#') || from == std::string::npos || to <= from) continue;
    Input word;
    for (std::size_t i = from + 1; i < to; ++i) {
      if (line[i] == '\\' && i + 3 < to + 1 && line[i + 1] == 'x') {
        word.push_back(static_cast<std::uint8_t>(16 * hex_digit(line[i + 2]) + hex_digit(line[i + 3])));
        i += 3;
      } else {
        if (line[i] == '\\' && i + 1 < to) ++i;
        word.push_back(static_cast<std::uint8_t>(line[i]));
      }
    }
    words.push_back(std::move(word));
  }
  return words;
}

}  // namespace sonar::fuzz
