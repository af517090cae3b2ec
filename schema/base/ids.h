#pragma once
#include <compare>
#include <cstdint>
#include <functional>

namespace vantage {

/// A number that names one kind of thing; mixing two kinds does not compile.
template <class Tag>
struct Id {
  std::int64_t value = 0;
  auto operator<=>(const Id&) const = default;
};

using ShotId = Id<struct ShotTag>;
using JobId = Id<struct JobTag>;

}  // namespace vantage

template <class Tag>
struct std::hash<vantage::Id<Tag>> {
  std::size_t operator()(const vantage::Id<Tag>& id) const noexcept { return std::hash<std::int64_t>{}(id.value); }
};
