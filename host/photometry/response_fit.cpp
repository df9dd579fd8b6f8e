// SPDX-License-Identifier: Apache-2.0
#include "host/photometry/response_fit.h"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "common/dense.h"

namespace mf {

double CodeNoise::at(double c) const {
  if (c <= code.front()) return sigma.front();
  if (c >= code.back()) return sigma.back();
  const auto upper = static_cast<std::size_t>(std::upper_bound(code.begin(), code.end(), c) - code.begin());
  const double fraction = (c - code[upper - 1]) / (code[upper] - code[upper - 1]);
  return sigma[upper - 1] + fraction * (sigma[upper] - sigma[upper - 1]);
}

namespace {

using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;

// One reading against the curve.
struct Reading {
  CodeSpline::Local at;
  double residual = 0;     // codes; reading − curve
  double weight = 0;       // 1/codes², robust; 0: says nothing
  double strangeness = 0;  // (residual / outlier limit)²
};

class Fit {
 public:
  Fit(const FitProblem& problem, const FitOptions& options, const CodeSpline& start)
      : problem_(problem), options_(options), curve_(start) {
    noise_ = {{0, problem.last_code}, {problem.dark_noise, problem.dark_noise}};
    start_exposures();
    measure_noise();
  }

  ChannelFit run() {
    kink_scale_ = std::max(options_.first_kink_scale, options_.kink_scale);
    bool converged = false;
    int iteration = 0;
    while (iteration < options_.max_iterations && !converged) {
      ++iteration;
      settle_exposures(curve_, log_exposure_);
      measure_noise();
      const double change = improve();
      converged = change < 1e-3 && kink_scale_ <= options_.kink_scale;  // of ln(df/du): a tenth of a per cent
      kink_scale_ = std::max(options_.kink_scale, 0.4 * kink_scale_);
    }
    return result(iteration, converged);
  }

 private:
  struct Normal {
    Matrix matrix;  // over (q, black)
    Vector right;
    double cost = 0;
  };

  [[nodiscard]] Reading read(const CodeSpline& curve, double u, double code) const {
    Reading r;
    r.at = curve.at(u);
    const bool saturated = code >= problem_.saturation;
    const bool floored = code <= 0;
    r.residual = (saturated ? problem_.saturation : code) - r.at.value;
    if ((saturated && r.residual < 0) || (floored && r.residual > 0)) return r;  // a bound that holds
    const double sigma = noise_.at(r.at.value);
    const double width = options_.outlier_sigmas * sigma;
    r.strangeness = r.residual * r.residual / (width * width);
    r.weight = 1 / (sigma * sigma * (1 + r.strangeness));
    return r;
  }

  // Cauchy's: near zero the squared residual in units of its noise.
  [[nodiscard]] double cost(const Reading& r) const {
    return options_.outlier_sigmas * options_.outlier_sigmas * std::log1p(r.strangeness);
  }

  void start_exposures() {
    const ChannelSamples& samples = problem_.samples;
    for (std::size_t j = 0; j < samples.pixel_count(); ++j) {
      double sum = 0, sum_weight = 0;
      for (std::size_t i = 0; i < samples.frame_count(); ++i) {
        const double code = samples.pixel(j)[i];
        if (code <= problem_.black + problem_.dark_noise || code >= problem_.saturation) continue;
        const double u = curve_.u_of(std::max(code, curve_.black() + 0.01));
        const double certainty = curve_.at(u).slope;  // d code / du: Robertson's weight, per relative error
        sum += certainty * certainty * (u - samples.log_exposure[i]);
        sum_weight += certainty * certainty;
      }
      log_exposure_.push_back(sum_weight > 0 ? sum / sum_weight : curve_.first_u());
    }
  }

  // Newton on each pixel's ln(exposure), the curve held.
  void settle_exposures(const CodeSpline& curve, std::vector<double>& us) const {
    const ChannelSamples& samples = problem_.samples;
    for (std::size_t j = 0; j < us.size(); ++j)
      for (int step = 0; step < 3; ++step) {
        double gradient = 0, curvature = 0;
        for (std::size_t i = 0; i < samples.frame_count(); ++i) {
          const Reading r = read(curve, us[j] + samples.log_exposure[i], samples.pixel(j)[i]);
          gradient += r.weight * r.at.slope * r.residual;
          curvature += r.weight * r.at.slope * r.at.slope;
        }
        if (curvature <= 0) break;
        const double change = std::clamp(gradient / curvature, -0.5, 0.5);
        us[j] += change;
        if (std::abs(change) < 1e-5) break;  // Newton: the next would be 1e-10
      }
  }

  // σ(code) from the spread of residuals about the curve, each enlarged by what its own pixel's exposure absorbed.
  void measure_noise() {
    constexpr std::size_t bin_count = 24;
    constexpr std::size_t enough = 60;     // a median of fewer scatters by more than a tenth
    constexpr double quantization = 0.29;  // √(1/12) codes
    std::array<std::vector<double>, bin_count> residuals;
    std::array<double, bin_count> code_sum{};
    const double reach = std::log1p((problem_.last_code - curve_.black()) / 10);
    each_pixel([&](std::span<const Reading> readings, double curvature) {
      for (const Reading& r : readings) {
        if (r.weight <= 0 || curvature <= 0) continue;
        const double absorbed = std::min(0.95, r.weight * r.at.slope * r.at.slope / curvature);
        const double place = std::log1p(std::max(0.0, r.at.value - curve_.black()) / 10) / reach * bin_count;
        const std::size_t bin = std::min(bin_count - 1, static_cast<std::size_t>(place));
        // Readings that absorb, or that saturation cuts off, scatter less than they should.
        if (absorbed > 0.9 || r.at.value > problem_.saturation - 2 * noise_.at(r.at.value)) continue;
        residuals[bin].push_back(std::abs(r.residual) / std::sqrt(1 - absorbed));
        code_sum[bin] += r.at.value;
      }
    });
    CodeNoise noise;
    for (std::size_t b = 0; b < bin_count; ++b) {
      std::vector<double>& values = residuals[b];
      if (values.size() < enough) continue;
      const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
      std::nth_element(values.begin(), middle, values.end());
      noise.code.push_back(code_sum[b] / static_cast<double>(values.size()));
      noise.sigma.push_back(std::max(quantization, 1.4826 * *middle));  // of a normal distribution
    }
    if (!noise.code.empty()) noise_ = noise;
  }

  // Calls visit(readings, Σ weight slope²) for every pixel.
  template <typename Visit>
  void each_pixel(const Visit& visit) const {
    const ChannelSamples& samples = problem_.samples;
    std::vector<Reading> readings(samples.frame_count());
    for (std::size_t j = 0; j < samples.pixel_count(); ++j) {
      double curvature = 0;
      for (std::size_t i = 0; i < readings.size(); ++i) {
        readings[i] = read(curve_, log_exposure_[j] + samples.log_exposure[i], samples.pixel(j)[i]);
        curvature += readings[i].weight * readings[i].at.slope * readings[i].at.slope;
      }
      visit(std::span<const Reading>(readings), curvature);
    }
  }

  // Normal equations over (a, black), the exposures eliminated.
  [[nodiscard]] Normal data_normal() const {
    const std::size_t n = curve_.coefficient_count() + 1;
    const Eigen::Index size = static_cast<Eigen::Index>(n), black = size - 1;
    Normal normal{Matrix::Zero(size, size), Vector::Zero(size), 0};
    Vector coupling = Vector::Zero(size);
    each_pixel([&](std::span<const Reading> readings, double curvature) {
      double gradient = 0;
      std::size_t low = n, high = 0;
      for (const Reading& r : readings) {
        normal.cost += cost(r);
        if (r.weight <= 0) continue;
        const auto first = static_cast<Eigen::Index>(r.at.first);
        const Eigen::Map<const Eigen::Vector4d> basis(r.at.basis.data());
        normal.matrix.block<4, 4>(first, first).noalias() += r.weight * basis * basis.transpose();
        normal.matrix.block<1, 4>(black, first) += r.weight * basis.transpose();
        normal.matrix(black, black) += r.weight;
        normal.right.segment<4>(first) += r.weight * r.residual * basis;
        normal.right[black] += r.weight * r.residual;
        coupling.segment<4>(first) += r.weight * r.at.slope * basis;
        coupling[black] += r.weight * r.at.slope;
        gradient += r.weight * r.at.slope * r.residual;
        low = std::min(low, r.at.first);
        high = std::max(high, r.at.first + 4);
      }
      if (curvature <= 0) return;
      const auto start = static_cast<Eigen::Index>(low), length = static_cast<Eigen::Index>(high - low);
      const auto part = coupling.segment(start, length);
      normal.matrix.block(start, start, length, length)
          .selfadjointView<Eigen::Lower>()
          .rankUpdate(part, -1 / curvature);
      normal.matrix.block(black, start, 1, length).noalias() -= (coupling[black] / curvature) * part.transpose();
      normal.matrix(black, black) -= coupling[black] * coupling[black] / curvature;
      normal.right.segment(start, length) -= part * (gradient / curvature);
      normal.right[black] -= coupling[black] * gradient / curvature;
      coupling.segment(start, length).setZero();
      coupling[black] = 0;
    });
    normal.matrix.triangularView<Eigen::StrictlyUpper>() = normal.matrix.transpose();  // only the lower half was summed
    return normal;
  }

  // d(a, black)/d(q, black) = T has equal columns below a diagonal: products with it are sums. This is Tᵀ · m.
  [[nodiscard]] Matrix over_increments(const Matrix& m) const {
    const std::vector<double>& q = curve_.log_increments();
    const auto n = static_cast<Eigen::Index>(q.size());
    Matrix out(n + 1, m.cols());
    out.row(n) = m.row(n + 1);  // black
    Eigen::RowVectorXd later = Eigen::RowVectorXd::Zero(m.cols());
    for (Eigen::Index i = n - 1; i >= 0; --i) {
      later += m.row(i + 1);
      out.row(i) = std::exp(q[static_cast<std::size_t>(i)]) * later;
    }
    out.row(0) += std::exp(q[0]) / std::expm1(curve_.step()) * (later + m.row(0));
    return out;
  }

  // T · m · Tᵀ, the covariance of (a, black) from that of (q, black).
  [[nodiscard]] Matrix over_coefficients(const Matrix& m) const {
    const Eigen::Index size = m.rows() + 1;
    const Matrix t = over_increments(Matrix::Identity(size, size)).transpose();
    return t * m * t.transpose();
  }

  // Second differences of q; before the first knot the toe's line goes on.
  [[nodiscard]] static std::vector<double> kinks(const std::vector<double>& q, double step) {
    std::vector<double> d(q.size() - 1);
    d[0] = q[1] - q[0] - step;
    for (std::size_t k = 1; k + 1 < q.size(); ++k) d[k] = q[k + 1] - 2 * q[k] + q[k - 1];
    return d;
  }

  [[nodiscard]] double prior_cost(const CodeSpline& curve) const {
    double cost = 0;
    for (const double d : kinks(curve.log_increments(), curve.step()))
      cost += 2 * std::log1p(d * d / (kink_scale_ * kink_scale_));
    if (problem_.black_sigma > 0) cost += std::pow((curve.black() - problem_.black) / problem_.black_sigma, 2);
    return cost;
  }

  void add_prior(Normal& normal) const {
    const std::vector<double> d = kinks(curve_.log_increments(), curve_.step());
    const Eigen::Index black = normal.right.size() - 1;
    for (std::size_t k = 0; k < d.size(); ++k) {
      const double weight = 2 / (kink_scale_ * kink_scale_ + d[k] * d[k]);
      const auto middle = static_cast<Eigen::Index>(k);
      // (−1, 1) at the toe, (1, −2, 1) elsewhere
      const Eigen::Vector3d row(k == 0 ? 0 : 1, k == 0 ? -1 : -2, 1);
      for (Eigen::Index a = 0; a < 3; ++a) {
        if (row[a] == 0) continue;
        normal.right[middle - 1 + a] -= weight * row[a] * d[k];
        for (Eigen::Index b = 0; b < 3; ++b)
          if (row[b] != 0) normal.matrix(middle - 1 + a, middle - 1 + b) += weight * row[a] * row[b];
      }
    }
    if (problem_.black_sigma > 0) {
      const double weight = 1 / (problem_.black_sigma * problem_.black_sigma);
      normal.matrix(black, black) += weight;
      normal.right[black] += weight * (problem_.black - curve_.black());
    } else {
      normal.matrix.row(black).setZero();
      normal.matrix.col(black).setZero();
      normal.matrix(black, black) = 1;
      normal.right[black] = 0;
    }
  }

  [[nodiscard]] Normal normal_equations() const {
    const Normal data = data_normal();
    Normal normal{over_increments(over_increments(data.matrix).transpose()), over_increments(data.right), data.cost};
    add_prior(normal);
    return normal;
  }

  [[nodiscard]] double data_cost(const CodeSpline& curve, const std::vector<double>& us) const {
    double sum = 0;
    const ChannelSamples& samples = problem_.samples;
    for (std::size_t j = 0; j < us.size(); ++j)
      for (std::size_t i = 0; i < samples.frame_count(); ++i)
        sum += cost(read(curve, us[j] + samples.log_exposure[i], samples.pixel(j)[i]));
    return sum;
  }

  // One damped step; returns the largest change of q, its common part (the free scale) not counted.
  double improve() {
    const Normal normal = normal_equations();
    const double before = normal.cost + prior_cost(curve_);
    const Eigen::Index n = normal.right.size() - 1;
    for (int attempt = 0; attempt < 8; ++attempt) {
      Matrix damped = normal.matrix;
      damped.diagonal().array() += damping_ * (normal.matrix.diagonal().array() + 1e-3);
      const std::optional<Matrix> solution = solve_symmetric(damped, normal.right);
      const Vector step =
          solution ? Vector(*solution) : Vector::Constant(n + 1, std::numeric_limits<double>::infinity()).eval();
      const double largest = step.head(n).cwiseAbs().maxCoeff();
      if (largest < 3) {
        std::vector<double> q = curve_.log_increments();
        for (Eigen::Index i = 0; i < n; ++i) q[static_cast<std::size_t>(i)] += step[i];
        const CodeSpline next(curve_.first_u(), curve_.step(), curve_.black() + step[n], q);
        std::vector<double> us = log_exposure_;
        settle_exposures(next, us);
        if (data_cost(next, us) + prior_cost(next) <= before * (1 + 1e-12)) {
          curve_ = next;
          log_exposure_ = std::move(us);
          damping_ = std::max(1e-9, damping_ * 0.2);
          return largest;
        }
      }
      damping_ = std::max(1e-7, damping_ * 10);
    }
    return 0;  // no step improves: this is the minimum
  }

  [[nodiscard]] ChannelFit result(int iterations, bool converged) const {
    Normal normal = normal_equations();
    normal.matrix.diagonal().array() += 1e-9 * normal.matrix.diagonal().mean();  // the scale is free
    const Eigen::Index size = normal.right.size();
    const Matrix covariance =
        solve_symmetric(normal.matrix, Matrix::Identity(size, size)).value_or(Matrix::Zero(size, size));
    ChannelFit fit{curve_, 0, noise_, over_coefficients(covariance), iterations, converged};
    if (problem_.black_sigma > 0) fit.black_sigma = std::sqrt(std::max(0.0, covariance(size - 1, size - 1)));
    return fit;
  }

  const FitProblem& problem_;
  const FitOptions& options_;
  CodeSpline curve_;
  CodeNoise noise_;
  std::vector<double> log_exposure_;  // of every pixel, at one second
  double kink_scale_ = 0.05;
  double damping_ = 1e-4;
};

}  // namespace

ChannelFit fit_response(const FitProblem& problem, const FitOptions& options, const CodeSpline& start) {
  return Fit(problem, options, start).run();
}

}  // namespace mf
