#include "jobs/navspace/columns.h"

#include <algorithm>
#include <limits>

#include "schema/base/error.h"

namespace vantage {

std::vector<ColumnSimplex> sweep(const std::vector<int>& cameras, const ColumnTimes& times_s) {
  std::vector<int> sorted = cameras;
  std::sort(sorted.begin(), sorted.end());
  ColumnSimplex front;
  for (const int camera : sorted) {
    check(!times_s[static_cast<std::size_t>(camera)].empty(), "a column has an image");
    front.push_back({camera, 0});
  }
  const auto next_time_s = [&](const ColumnImage& image) {
    const auto& column = times_s[static_cast<std::size_t>(image.camera)];
    const auto next = static_cast<std::size_t>(image.number) + 1;
    return next < column.size() ? column[next] : std::numeric_limits<double>::infinity();
  };
  std::vector<ColumnSimplex> simplices;
  while (true) {
    const auto first = std::min_element(front.begin(), front.end(),
                                        [&](const auto& a, const auto& b) { return next_time_s(a) < next_time_s(b); });
    if (next_time_s(*first) == std::numeric_limits<double>::infinity()) return simplices;
    ColumnSimplex simplex = front;
    ++first->number;
    simplex.push_back(*first);
    simplices.push_back(std::move(simplex));
  }
}

}  // namespace vantage
