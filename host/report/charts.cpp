// SPDX-License-Identifier: Apache-2.0
#include "host/report/charts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "host/report/html.h"

namespace mf {

namespace {

// The drawing's own units; the page stretches it.
constexpr double width = 640;
constexpr double height = 280;
constexpr double left = 64;
constexpr double right = width - 12;
constexpr double top = 12;
constexpr double bottom = height - 44;

// One axis: data values to drawing positions, and where its ticks are. `round_up`: it ends at a tick.
class Axis {
 public:
  Axis(double low, double high, bool log, bool round_up, double from, double to) : log_(log), from_(from), to_(to) {
    if (log_) {
      low_ = std::floor(std::log10(low));
      high_ = std::max(low_ + 1, std::ceil(std::log10(high)));
      const double every = std::ceil((high_ - low_) / 8);
      for (double t = low_; t <= high_ + 1e-9; t += every) ticks_.push_back(std::pow(10.0, t));
      return;
    }
    low_ = low;
    const double rough = std::max(high - low, 1e-12) / 5;
    const double decade = std::pow(10.0, std::floor(std::log10(rough)));
    double step = 10 * decade;
    for (const double multiple : {1.0, 2.0, 5.0})
      if (step > 9.99 * decade && multiple * decade >= rough) step = multiple * decade;
    high_ = round_up ? std::ceil(high / step - 1e-9) * step : high;
    for (double t = std::ceil(low / step) * step; t <= high_ + 1e-9 * step; t += step) ticks_.push_back(t);
  }
  [[nodiscard]] double at(double value) const {
    const double v = log_ ? std::log10(value) : value;
    return from_ + (v - low_) / (high_ - low_) * (to_ - from_);
  }
  [[nodiscard]] const std::vector<double>& ticks() const { return ticks_; }

 private:
  bool log_;
  double from_, to_;
  double low_ = 0, high_ = 1;
  std::vector<double> ticks_;
};

std::string frame_and_ticks(const Axis& x, const Axis& y, const std::string& x_label, const std::string& y_label) {
  std::string svg;
  const auto out = std::back_inserter(svg);
  for (const double t : y.ticks())
    fmt::format_to(
        out,
        R"(<line class="grid" x1="{}" x2="{}" y1="{:.1f}" y2="{:.1f}"/><text x="{}" y="{:.1f}" class="end">{:.4g}</text>)",
        left, right, y.at(t), y.at(t), left - 6, y.at(t) + 4, t);
  for (const double t : x.ticks())
    fmt::format_to(
        out,
        R"(<line class="grid" x1="{:.1f}" x2="{:.1f}" y1="{}" y2="{}"/><text x="{:.1f}" y="{}" class="middle">{:.4g}</text>)",
        x.at(t), x.at(t), top, bottom, x.at(t), bottom + 17, t);
  fmt::format_to(out, R"(<text x="{}" y="{}" class="middle">{}</text>)", (left + right) / 2, height - 6,
                 html_escaped(x_label));
  fmt::format_to(out, R"svg(<text transform="translate(14 {}) rotate(-90)" class="middle">{}</text>)svg",
                 (top + bottom) / 2, html_escaped(y_label));
  return svg;
}

std::string svg_element(const std::string& label, const std::string& content) {
  return fmt::format(R"(<svg class="chart" viewBox="0 0 {} {}" role="img" aria-label="{}">{}</svg>)", width, height,
                     html_escaped(label), content);
}

}  // namespace

std::string line_chart(const std::vector<ChartSeries>& series, const ChartAxes& axes) {
  const auto shown = [&](const std::array<double, 2>& p) {
    return std::isfinite(p[0]) && std::isfinite(p[1]) && (!axes.log_x || p[0] > 0) && (!axes.log_y || p[1] > 0);
  };
  std::array<double, 2> low{INFINITY, INFINITY};
  std::array<double, 2> high{-INFINITY, -INFINITY};
  for (const ChartSeries& s : series)
    for (const auto& p : s.points)
      for (std::size_t k = 0; k < 2 && shown(p); ++k) {
        low.at(k) = std::min(low.at(k), p.at(k));
        high.at(k) = std::max(high.at(k), p.at(k));
      }
  if (!(low[0] <= high[0])) return "<p>Nothing to draw.</p>";
  const Axis x(low[0], high[0], axes.log_x, false, left, right);
  const Axis y(low[1], high[1], axes.log_y, true, bottom, top);
  std::string content = frame_and_ticks(x, y, axes.x_label, axes.y_label);
  for (const ChartSeries& s : series) {
    content += fmt::format(R"(<polyline class="{}" points=")", s.css_class);
    for (const auto& p : s.points)
      if (shown(p)) fmt::format_to(std::back_inserter(content), "{:.1f},{:.1f} ", x.at(p[0]), y.at(p[1]));
    content += "\"/>";
  }
  return svg_element(axes.y_label + " over " + axes.x_label, content);
}

std::string bar_chart(const std::vector<Bar>& bars, const std::string& x_label, const std::string& y_label,
                      double reference) {
  if (bars.empty()) return "<p>Nothing to draw.</p>";
  double highest = std::max(reference, 1e-6);
  for (const Bar& b : bars)
    if (b.good) highest = std::max(highest, b.value);
  const Axis x(0, static_cast<double>(bars.size()), false, false, left, right);
  const Axis y(0, highest, false, true, bottom, top);
  std::string content = frame_and_ticks(x, y, x_label, y_label);
  for (std::size_t i = 0; i < bars.size(); ++i) {
    const double x0 = x.at(static_cast<double>(i));
    const double x1 = x.at(static_cast<double>(i) + 0.85);
    const double y0 = bars[i].good ? y.at(bars[i].value) : top;
    fmt::format_to(std::back_inserter(content),
                   R"(<rect class="{}" x="{:.2f}" y="{:.1f}" width="{:.2f}" height="{:.1f}"><title>{}</title></rect>)",
                   bars[i].good ? "bar" : "missing", x0, y0, x1 - x0, bottom - y0, html_escaped(bars[i].hint));
  }
  if (reference > 0)
    fmt::format_to(std::back_inserter(content), R"(<line class="reference" x1="{}" x2="{}" y1="{:.1f}" y2="{:.1f}"/>)",
                   left, right, y.at(reference), y.at(reference));
  return svg_element(y_label + " over " + x_label, content);
}

}  // namespace mf
