// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "common/dense.h"
#include "host/photometry/response_fit.h"

namespace mf {

namespace {

constexpr int knot_count = 48;

// ln I over z = ln(1 + (code − black)/s): for a linear sensor nearly a straight line, and even a logarithmic one is
// smooth in it. Linear between knots.
struct LogCurve {
  double black, scale;
  double first_z, step;
  Eigen::VectorXd value = Eigen::VectorXd::Zero(knot_count);

  struct Place {
    int first;
    double fraction;
  };
  [[nodiscard]] double z_of(double code) const { return std::log1p((code - black) / scale); }
  [[nodiscard]] double code_at(int knot) const { return black + scale * std::expm1(first_z + knot * step); }
  [[nodiscard]] Place place(double code) const {
    const double at = std::clamp((z_of(code) - first_z) / step, 0.0, static_cast<double>(knot_count - 1));
    const int first = std::min(knot_count - 2, static_cast<int>(at));
    return {first, at - first};
  }
};

// Adds one pixel's readings with its exposure eliminated.
void add_pixel(const FitProblem& problem, const LogCurve& curve, double lowest, const float* codes,
               Eigen::MatrixXd& normal, Eigen::VectorXd& right) {
  Eigen::VectorXd sum_row = Eigen::VectorXd::Zero(knot_count);
  double sum_weight = 0, sum_log = 0;
  for (std::size_t i = 0; i < problem.samples.frame_count(); ++i) {
    if (codes[i] < lowest || codes[i] >= problem.saturation) continue;
    // Certainty: a reading near the dark says little about ln I.
    const double above = (codes[i] - problem.black) / (6 * problem.dark_noise);
    const double weight = above * above / (1 + above * above);
    const LogCurve::Place at = curve.place(codes[i]);
    const std::array<double, 2> row{1 - at.fraction, at.fraction};
    const double log_t = problem.samples.log_exposure[i];
    for (int a = 0; a < 2; ++a) {
      for (int b = 0; b < 2; ++b)
        normal(at.first + a, at.first + b) +=
            weight * row[static_cast<std::size_t>(a)] * row[static_cast<std::size_t>(b)];
      right[at.first + a] += weight * row[static_cast<std::size_t>(a)] * log_t;
      sum_row[at.first + a] += weight * row[static_cast<std::size_t>(a)];
    }
    sum_weight += weight;
    sum_log += weight * log_t;
  }
  if (sum_weight <= 0) return;
  normal.noalias() -= sum_row * sum_row.transpose() / sum_weight;
  right -= sum_row * (sum_log / sum_weight);
}

void add_smoothness(double weight, Eigen::MatrixXd& normal) {
  for (int k = 1; k + 1 < knot_count; ++k) {
    const std::array<double, 3> d{1, -2, 1};
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b)
        normal(k - 1 + a, k - 1 + b) += weight * d[static_cast<std::size_t>(a)] * d[static_cast<std::size_t>(b)];
  }
}

// The rough curve as codes over u, continued as a line to the dark and with its last slope to the light.
class CodeOverU {
 public:
  CodeOverU(const LogCurve& curve, double least_rise) : black_(curve.black) {
    for (int k = 0; k < knot_count; ++k) {
      codes_.push_back(curve.code_at(k));
      us_.push_back(k == 0 ? curve.value[0] : std::max(curve.value[k], us_.back() + least_rise));
    }
    const std::size_t tail = us_.size() - 1, before = us_.size() - 5;  // four knots smooth the noise of one
    last_slope_ = (codes_[tail] - codes_[before]) / (us_[tail] - us_[before]);
  }
  [[nodiscard]] double u_of_rise(double codes_above_black) const {
    return us_.front() + std::log(codes_above_black / (codes_.front() - black_));
  }
  [[nodiscard]] double last_u() const { return us_.back(); }
  [[nodiscard]] double last_code() const { return codes_.back(); }
  [[nodiscard]] double last_slope() const { return last_slope_; }
  [[nodiscard]] double operator()(double u) const {
    if (u <= us_.front()) return black_ + (codes_.front() - black_) * std::exp(u - us_.front());
    if (u >= us_.back()) return codes_.back() + last_slope_ * (u - us_.back());
    const auto upper = static_cast<std::size_t>(std::upper_bound(us_.begin(), us_.end(), u) - us_.begin());
    const double fraction = (u - us_[upper - 1]) / (us_[upper] - us_[upper - 1]);
    return codes_[upper - 1] + fraction * (codes_[upper] - codes_[upper - 1]);
  }

 private:
  double black_, last_slope_ = 0;
  std::vector<double> codes_, us_;
};

CodeSpline spline_through(const CodeOverU& curve, const FitProblem& problem, const FitOptions& options) {
  constexpr double first_rise = 0.25;  // codes above black where the straight toe ends: well below the noise
  constexpr double longest_reach = 6;  // of ln(exposure) beyond the data: a curve that levels off has no end
  const double first_u = curve.u_of_rise(first_rise);
  const double missing = std::max(0.0, problem.last_code - curve.last_code()) / curve.last_slope();
  // The tail's slope may be off by a third: the prior, not a last slope held constant, continues the curve.
  const double last_u = curve.last_u() + std::min(longest_reach, 1.3 * missing + 3 * options.knot_step);
  std::vector<double> q;
  for (double u = first_u - options.knot_step; u < last_u + 2 * options.knot_step; u += options.knot_step)
    q.push_back(std::log(std::max(1e-6, curve(u + options.knot_step) - curve(u))));
  return {first_u, options.knot_step, problem.black, q};
}

}  // namespace

std::optional<CodeSpline> rough_curve(const FitProblem& problem, const FitOptions& options) {
  const ChannelSamples& samples = problem.samples;
  const double lowest = problem.black + 4 * problem.dark_noise;
  double highest = lowest;
  for (const float code : samples.codes)
    if (code < problem.saturation) highest = std::max(highest, static_cast<double>(code));
  if (samples.codes.empty() || highest < lowest + 4 * problem.dark_noise) return std::nullopt;
  LogCurve curve{problem.black, 4 * problem.dark_noise, 0, 1};
  curve.first_z = curve.z_of(lowest);
  curve.step = (curve.z_of(highest) - curve.first_z) / (knot_count - 1);

  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(knot_count, knot_count);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(knot_count);
  for (std::size_t j = 0; j < samples.pixel_count(); ++j)
    add_pixel(problem, curve, lowest, samples.pixel(j), normal, right);
  const double typical = normal.trace() / knot_count;
  add_smoothness(1e-3 * typical, normal);
  normal.diagonal().array() += 1e-9 * typical;  // the scale is free
  const std::optional<Eigen::MatrixXd> solution = solve_symmetric(normal, right);
  if (!solution) return std::nullopt;
  curve.value = *solution;
  if (!(curve.value[knot_count - 1] > curve.value[0])) return std::nullopt;
  return spline_through(CodeOverU(curve, 1e-4), problem, options);
}

}  // namespace mf
