#pragma once
#include <cstdint>
#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>

namespace vantage {

/// Prometheus' text format, version 0.0.4. All samples of a family directly follow its head.
class MetricsText {
 public:
  using Labels = std::initializer_list<std::pair<std::string_view, std::string_view>>;

  /// type: counter, gauge or histogram.
  void family(std::string_view name, std::string_view type, std::string_view help);
  /// Of the family that was begun last; suffix: "_bucket" and such.
  void sample(double value, Labels labels = {}, std::string_view suffix = "");
  /// A family of one sample without labels.
  void single(std::string_view name, std::string_view type, std::string_view help, double value) {
    family(name, type, help);
    sample(value);
  }
  template <class Histogram, class Bounds>
  void histogram(std::string_view name, std::string_view help, const Histogram& histogram, const Bounds& bounds);

  const std::string& text() const { return text_; }

 private:
  static std::string number(double value);
  std::string text_, name_;
};

template <class Histogram, class Bounds>
void MetricsText::histogram(std::string_view name, std::string_view help, const Histogram& histogram,
                            const Bounds& bounds) {
  family(name, "histogram", help);
  for (std::size_t i = 0; i < bounds.size(); ++i)
    sample(static_cast<double>(histogram.num_up_to.at(i)), {{"le", number(bounds.at(i))}}, "_bucket");
  sample(static_cast<double>(histogram.num), {{"le", "+Inf"}}, "_bucket");
  sample(histogram.sum, {}, "_sum");
  sample(static_cast<double>(histogram.num), {}, "_count");
}

}  // namespace vantage
