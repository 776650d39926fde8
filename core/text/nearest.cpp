#include "core/text/nearest.hpp"

#include <algorithm>
#include <cstddef>
#include <vector>

#include "core/base/letters.hpp"
#include "core/text/format.hpp"

namespace sonar::text {
namespace {

std::string folded(std::string_view s) {
  std::string out = small_letters(s.substr(0, 64));  // a word that is longer than this is not a typing error
  for (char& c : out)
    if (c == '-' || c == ' ') c = '_';
  return out;
}

// Edit distance with swaps of neighbours (optimal string alignment).
std::size_t distance(const std::string& a, const std::string& b) {
  std::vector<std::size_t> before(b.size() + 1), last(b.size() + 1), now(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) last[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    now[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t change = last[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
      now[j] = std::min({change, last[j] + 1, now[j - 1] + 1});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) now[j] = std::min(now[j], before[j - 2] + 1);
    }
    before.swap(last);
    last.swap(now);
  }
  return last[b.size()];
}

}  // namespace

std::string_view nearest(std::string_view name, std::span<const std::string_view> candidates) {
  const std::string wanted = folded(name);
  std::string_view best;
  std::size_t best_distance = std::max<std::size_t>(1, wanted.size() / 3) + 1;
  for (const std::string_view candidate : candidates) {
    const std::string c = folded(candidate);
    std::size_t d = distance(wanted, c);
    // A missing suffix is also a common mistake: "xyz" for "xyz_m", "temperature" for "temperature_c".
    if (wanted.size() >= 3 && (c.starts_with(wanted + "_") || wanted.starts_with(c + "_"))) d = std::min<std::size_t>(d, 1);
    if (d < best_distance) {
      best_distance = d;
      best = candidate;
    }
  }
  return best;
}

std::string suggestion(std::string_view name, std::span<const std::string_view> candidates, std::string_view label) {
  if (const std::string_view near = nearest(name, candidates); !near.empty()) {
    return "; did you mean \"" + std::string(near) + "\"?";
  }
  if (candidates.empty()) return {};
  const std::size_t shown = std::min<std::size_t>(candidates.size(), 20);
  return "; " + std::string(label) + ": " + joined(candidates.first(shown)) + (shown < candidates.size() ? ", ..." : "");
}

}  // namespace sonar::text
