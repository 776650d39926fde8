#include "core/image/outline.hpp"

#include <cstddef>

namespace sonar {

std::vector<Outline> outlines(int x0, int y0, int x1, int y1, const std::function<bool(int x, int y)>& is_in) {
  const auto in = [&](int x, int y) { return x >= x0 && x < x1 && y >= y0 && y < y1 && is_in(x, y); };
  const int width = x1 - x0;
  const auto place = [&](int x, int y) {
    return static_cast<std::size_t>(y - y0) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x - x0);
  };
  std::vector<bool> followed(static_cast<std::size_t>(width) * static_cast<std::size_t>(y1 - y0),
                             false);  // true if a pixel's upper edge is already part of an outline
  std::vector<Outline> found;
  for (int y = y0; y < y1; ++y)
    for (int x = x0; x < x1; ++x) {
      if (!in(x, y) || in(x, y - 1) || followed[place(x, y)]) continue;
      // Follows an edge with the region on its right. For each direction, the tables contain the pixels ahead of a corner, on
      // the right and on the left.
      constexpr int dx[] = {1, 0, -1, 0}, dy[] = {0, 1, 0, -1};
      constexpr int right_x[] = {0, -1, -1, 0}, right_y[] = {0, 0, -1, -1}, left_x[] = {0, 0, -1, -1}, left_y[] = {-1, 0, 0, -1};
      Outline outline{{x, y}};
      Corner at{x, y};
      std::size_t way = 0;
      long twice_area = 0;
      do {
        if (way == 0) followed[place(at.x, at.y)] = true;
        const Corner next{at.x + dx[way], at.y + dy[way]};
        twice_area += static_cast<long>(at.x) * next.y - static_cast<long>(next.x) * at.y;
        at = next;
        const std::size_t before = way;
        if (!in(at.x + right_x[way], at.y + right_y[way]))
          way = (way + 1) % 4;
        else if (in(at.x + left_x[way], at.y + left_y[way]))
          way = (way + 3) % 4;
        if (way != before && !(at == outline.front())) outline.push_back(at);
      } while (!(at == outline.front() && way == 0));
      if (twice_area > 0) found.push_back(std::move(outline));  // outlines of holes run in the opposite direction
    }
  return found;
}

}  // namespace sonar
