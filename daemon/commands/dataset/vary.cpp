#include "daemon/commands/dataset/vary.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>

#include "core/base/geometry.hpp"
#include "core/base/random.hpp"
#include "core/text/decimal.hpp"
#include "core/text/format.hpp"

namespace sonar::dataset {
namespace {

constexpr auto draws_domain = static_cast<Domain>(0x76617279u);  // differs from the domains of a ping
constexpr std::size_t most_words = 10000;

std::uint64_t hash_of(std::string_view name) {  // FNV-1a
  std::uint64_t hash = 14695981039346656037ull;
  for (const char c : name) hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211ull;
  return hash;
}

/// Two numbers in (0, 1) with 53 bits each.
std::array<double, 2> uniforms(Seed seed, std::uint64_t ping, std::uint32_t attempt, std::string_view name) {
  // The numbers depend on seed, name, ping and attempt only, so pings can be drawn in any order and on any machine.
  const std::uint64_t hash = hash_of(name);
  RandomKey key = key_of(seed, draws_domain);
  key.domain ^= static_cast<std::uint32_t>(hash >> 32);
  key.high ^= static_cast<std::uint32_t>(ping >> 32);
  const Random4 r = philox(static_cast<std::uint32_t>(ping), attempt, static_cast<std::uint32_t>(hash), key);
  // The added half keeps out 0, whose logarithm the normal distribution would need, and 1.
  const auto open = [](std::uint32_t high, std::uint32_t low) {
    return (static_cast<double>((std::uint64_t{high >> 6} << 26) | (low >> 6)) + 0.5) / 4503599627370496.0;
  };
  return {open(r.v[0], r.v[1]), open(r.v[2], r.v[3])};
}

bool is_name(std::string_view name) {
  const auto letter = [](char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; };
  return !name.empty() && std::isdigit(static_cast<unsigned char>(name.front())) == 0 &&
         std::all_of(name.begin(), name.end(), letter);
}

/// Exactly one kind is allowed, so all keys are read before they are counted.
Variation read_one(const std::string& name, const text::Node& node) {
  Variation v;
  v.name = name;
  if (!is_name(name)) node.fail("is not a name: use letters, digits and _, so that it can be used as $" + name);
  text::Map keys = node.map();
  int kinds = 0;
  const auto pair = [&](const char* key, Variation::Kind kind) {
    const text::Node n = keys.optional(key);
    if (!n.present()) return n;
    const auto ab = n.numbers<2>();
    v.kind = kind, v.a = ab[0], v.b = ab[1];
    ++kinds;
    return n;
  };
  const auto words = [&](const char* key, Variation::Kind kind) {
    const text::Node n = keys.optional(key);
    if (!n.present()) return;
    v.kind = kind;
    v.words = n.texts(1, most_words);
    ++kinds;
  };
  if (const auto n = pair("uniform", Variation::Kind::uniform); n.present() && v.a > v.b) n.fail("must go from low to high");
  if (const auto n = pair("normal", Variation::Kind::normal); n.present() && v.b < 0)
    n.fail("is [mean, deviation], and a deviation is not below 0");
  if (const auto n = pair("integer", Variation::Kind::integer);
      n.present() &&
      (v.a > v.b || v.a != std::floor(v.a) || v.b != std::floor(v.b) || std::abs(v.a) > 1e9 || std::abs(v.b) > 1e9))
    n.fail("must go from low to high, both whole numbers below 1e9");
  words("choice", Variation::Kind::choice);
  words("list", Variation::Kind::list);
  if (kinds != 1)
    node.fail("needs one of uniform: [low, high], normal: [mean, deviation], integer: [low, high], choice: [..], list: [..]");
  return v;
}

/// The number is written with nine digits, and formulas read it back from this text: file and formulas agree.
std::string word_of(const Variation& v, Seed seed, std::uint64_t ping, std::uint32_t attempt) {
  const auto [u, w] = uniforms(seed, ping, attempt, v.name);
  switch (v.kind) {
    case Variation::Kind::uniform:
      return text::format("%.9g", v.a + (v.b - v.a) * u);
    case Variation::Kind::normal:
      return text::format("%.9g", v.a + v.b * std::sqrt(-2 * std::log(u)) * std::cos(2 * pi * w));
    case Variation::Kind::integer:
      return text::format("%.0f", std::min(v.a + std::floor((v.b - v.a + 1) * u), v.b));
    case Variation::Kind::choice:
      return v.words[std::min(static_cast<std::size_t>(u * static_cast<double>(v.words.size())), v.words.size() - 1)];
    case Variation::Kind::list:
      // A list is not random: ping 1 gets the first word, ping 2 the second, and so on.
      return v.words[(ping - 1) % v.words.size()];
  }
  return {};
}

}  // namespace

std::vector<Variation> read_variations(const text::Node& node) {
  std::vector<Variation> all;
  for (const auto& [name, value] : node.map().entries()) all.push_back(read_one(name, value));
  return all;
}

Draws draw(const std::vector<Variation>& variations, Seed seed, std::uint64_t ping, std::uint32_t attempt) {
  Draws draws;
  for (const Variation& v : variations) {
    std::string word = v.words.empty() && v.kind >= Variation::Kind::choice ? std::string() : word_of(v, seed, ping, attempt);
    if (const auto number = text::parse_decimal(word)) draws.numbers[v.name] = *number;
    draws.words[v.name] = std::move(word);
  }
  return draws;
}

double draw_uniform(Seed seed, std::uint64_t ping, std::uint32_t attempt, std::string_view name) {
  return uniforms(seed, ping, attempt, name)[0];
}

std::string put_words(std::string_view text, const std::map<std::string, std::string>& words) {
  std::string out;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t dollar = text.find('$', at);
    out += text.substr(at, dollar - at);
    if (dollar == std::string_view::npos) break;
    std::size_t end = dollar + 1;
    while (end < text.size() && (std::isalnum(static_cast<unsigned char>(text[end])) != 0 || text[end] == '_')) ++end;
    const auto word = words.find(std::string(text.substr(dollar + 1, end - dollar - 1)));
    // A $name that is not a word of a draw stays as it is, because the formulas replace it later.
    out += word != words.end() ? word->second : std::string(text.substr(dollar, end - dollar));
    at = end;
  }
  return out;
}

}  // namespace sonar::dataset
