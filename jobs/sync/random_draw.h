#pragma once
#include <algorithm>
#include <array>
#include <random>
#include <span>
#include <type_traits>

namespace vantage::sync {

/// N different elements; there must be that many. std::sample and the distributions differ between standard libraries;
/// this does not.
template <std::size_t N, typename T>
std::array<std::remove_const_t<T>, N> draw_from(std::span<T> all, std::mt19937& random) {
  std::array<std::remove_const_t<T>, N> drawn;
  std::array<std::size_t, N> picked{};
  for (std::size_t k = 0; k < N; ++k) {
    const auto before = picked.begin() + static_cast<std::ptrdiff_t>(k);
    do picked[k] = random() % all.size();
    while (std::find(picked.begin(), before, picked[k]) != before);
    drawn[k] = all[picked[k]];
  }
  return drawn;
}

}  // namespace vantage::sync
