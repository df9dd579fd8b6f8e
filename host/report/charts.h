// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string>
#include <vector>

namespace mf {

// Charts as inline SVG. They scale with the page; text is the page's.

struct ChartSeries {
  std::string css_class;                      // red, green, blue, ink: colours of the page's style
  std::vector<std::array<double, 2>> points;  // in order of x; what a logarithmic axis cannot show is left out
};
struct ChartAxes {
  std::string x_label, y_label;
  bool log_x = false;
  bool log_y = false;
};
[[nodiscard]] std::string line_chart(const std::vector<ChartSeries>&, const ChartAxes&);

struct Bar {
  double value = 0;
  bool good = true;  // else drawn as a full-height mark: there is no value
  std::string hint;  // shown when pointed at
};
// Bars side by side, and a line across at `reference` when it is positive.
[[nodiscard]] std::string bar_chart(const std::vector<Bar>&, const std::string& x_label, const std::string& y_label,
                                    double reference);

}  // namespace mf
