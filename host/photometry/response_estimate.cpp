// SPDX-License-Identifier: Apache-2.0
#include "host/photometry/response_estimate.h"

#include <fmt/format.h>

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <mutex>

#include "common/check.h"
#include "common/error.h"
#include "host/photometry/response_fit.h"

namespace mf {

std::optional<std::string> ResponseOptions::validate() const {
  if (pixels < 100) return "pixels must be at least 100";
  if (!(knot_step >= 0.02 && knot_step <= 1)) return "knot_step must lie between 0.02 and 1";
  if (!(kink_scale > 0)) return "kink_scale must be positive";
  if (!(outlier_sigmas > 0)) return "outlier_sigmas must be positive";
  if (max_iterations < 1) return "max_iterations must be at least 1";
  if (!(noise_limit > 0)) return "noise_limit must be positive";
  return std::nullopt;
}

namespace {

struct SweepFacts {
  DarkReading dark;
  double saturation = 0;
  double last_code = 0;
};

// A black level and its standard deviation: before a fit where the search starts and how far it may go.
struct BlackLevel {
  double code = 0, sigma = 0;
};
BlackLevel black_prior(const ExposureSweep& sweep, const SweepFacts& facts) {
  const double near = 4 * facts.dark.noise + 0.005 * facts.last_code;
  // A frame that is nearly black itself knows better than a data sheet.
  if (facts.dark.code - facts.dark.extrapolated < 10 * facts.dark.noise) return {facts.dark.extrapolated, near};
  if (sweep.black_level_hint > 0) return {std::min(sweep.black_level_hint, facts.dark.code), near};
  return {facts.dark.extrapolated, std::max(near, facts.dark.code)};  // anywhere down to zero
}

[[noreturn]] void refuse_unseen(const ExposureSweep& sweep, const ChannelSamples& all, const SweepFacts& facts,
                                int channel) {
  std::size_t saturated = 0;
  for (const float code : all.codes) saturated += code >= facts.saturation ? 1 : 0;
  const bool bright = 2 * saturated > all.codes.size();
  throw InputError(
      sweep.source, "sweep",
      fmt::format("in channel {} {} hardly a pixel is seen clearly, and unsaturated in two frames: add {} exposures",
                  channel, bright ? "most readings are saturated and" : "the frames are dark and",
                  bright ? "shorter" : "longer"));
}

FitProblem problem_for(const ExposureSweep& sweep, const SweepFacts& facts, const ChannelSamples& all, int channel,
                       const ResponseOptions& options) {
  const BlackLevel prior = black_prior(sweep, facts);
  FitProblem problem;
  const double clear = prior.code + 15 * facts.dark.noise;  // 7 % noise: choosing such readings shifts them little
  problem.samples = spread_samples(all, static_cast<std::size_t>(options.pixels), clear, facts.saturation);
  if (problem.samples.pixel_count() < 20) refuse_unseen(sweep, all, facts, channel);
  problem.black = prior.code;
  problem.black_sigma = prior.sigma;
  problem.saturation = facts.saturation;
  problem.last_code = facts.last_code;
  problem.dark_noise = facts.dark.noise;
  return problem;
}

FitOptions fit_options(const ResponseOptions& options) {
  FitOptions fit;
  fit.knot_step = options.knot_step;
  fit.kink_scale = options.kink_scale;
  fit.outlier_sigmas = options.outlier_sigmas;
  fit.max_iterations = options.max_iterations;
  return fit;
}

// The channels' black levels as one, when they are one: the weighted mean, if no channel lies further from it than its
// uncertainty allows or than rounding to codes would show.
std::optional<BlackLevel> common_black(const std::vector<BlackLevel>& own) {
  double sum = 0, weight = 0;
  for (const BlackLevel& black : own) {
    const double w = 1 / std::max(1e-12, black.sigma * black.sigma);
    sum += w * black.code;
    weight += w;
  }
  const double mean = sum / weight;
  for (const BlackLevel& black : own)
    if (std::abs(black.code - mean) > std::max(0.25, 4 * black.sigma)) return std::nullopt;
  return BlackLevel{mean, 1 / std::sqrt(weight)};
}

CodeSpline with_black(const CodeSpline& curve, double black) {
  return {curve.first_u(), curve.step(), black, curve.log_increments()};
}

// Which codes the sweep's readings speak for: at least three readings within a code of it, not saturated.
std::vector<bool> observed_codes(const ChannelSamples& all, const SweepFacts& facts) {
  std::vector<std::size_t> count(static_cast<std::size_t>(facts.last_code) + 1, 0);
  for (const float code : all.codes)
    if (code < facts.saturation && code <= facts.last_code) ++count[static_cast<std::size_t>(code)];
  std::vector<bool> observed(count.size());
  for (std::size_t m = 0; m < count.size(); ++m) {
    std::size_t near = 0;
    for (std::size_t k = m > 0 ? m - 1 : 0; k <= std::min(m + 1, count.size() - 1); ++k) near += count[k];
    observed[m] = near >= 3;
  }
  return observed;
}

// How ln(exposure) at a code moves with the four coefficients that matter there, and with the black level.
struct Sensitivity {
  Eigen::Index first;
  Eigen::Vector4d coefficients;
  double black;
};
Sensitivity sensitivity(const CodeSpline& curve, double u) {
  const CodeSpline::Local at = curve.at(u);
  return {static_cast<Eigen::Index>(at.first), Eigen::Map<const Eigen::Vector4d>(at.basis.data()) / -at.slope,
          -1 / at.slope};
}

double covariance_of(const Sensitivity& a, const Sensitivity& b, const Eigen::MatrixXd& c) {
  const Eigen::Index black = c.rows() - 1;
  return a.coefficients.dot(c.block<4, 4>(a.first, b.first) * b.coefficients) +
         a.black * c.block<1, 4>(black, b.first).dot(b.coefficients.transpose()) +
         b.black * c.block<4, 1>(a.first, black).dot(a.coefficients) + a.black * b.black * c(black, black);
}

ResponseChannel tabulate(const ChannelFit& fit, std::vector<bool> observed, double unit_code) {
  const std::size_t levels = observed.size();
  ResponseChannel channel{std::vector<double>(levels, 0.0), std::move(observed), std::vector<double>(levels, 0.0)};
  const double unit_u = fit.curve.u_of(unit_code);
  const Sensitivity unit = sensitivity(fit.curve, unit_u);
  const double unit_variance = covariance_of(unit, unit, fit.covariance);
  for (std::size_t m = 0; m < levels; ++m) {
    const double code = static_cast<double>(m);
    if (code <= fit.curve.black()) continue;
    const double u = fit.curve.u_of(code);
    channel.exposure[m] = std::exp(u - unit_u);
    const Sensitivity here = sensitivity(fit.curve, u);
    const double variance =
        covariance_of(here, here, fit.covariance) + unit_variance - 2 * covariance_of(here, unit, fit.covariance);
    channel.relative_sigma[m] = std::sqrt(std::max(0.0, variance));
  }
  // Rising by construction; rounding may cost an ulp.
  for (std::size_t m = 1; m < levels; ++m) channel.exposure[m] = std::max(channel.exposure[m], channel.exposure[m - 1]);
  return channel;
}

// The code in the middle of what all channels observed: exposure 1.
double unit_code(const std::vector<std::vector<bool>>& observed, double black, double saturation) {
  std::vector<std::size_t> codes;
  for (std::size_t m = 0; m < observed.front().size(); ++m) {
    const bool inside = static_cast<double>(m) > black + 1 && static_cast<double>(m) < saturation;
    if (inside && std::all_of(observed.begin(), observed.end(), [m](const auto& o) { return o[m]; }))
      codes.push_back(m);
  }
  return codes.empty() ? (black + saturation) / 2 : static_cast<double>(codes[codes.size() / 2]);
}

double observed_fraction(const ResponseChannel& channel, double black, double saturation) {
  std::size_t seen = 0, all = 0;
  for (std::size_t m = 0; m < channel.observed.size(); ++m) {
    const double code = static_cast<double>(m);
    if (code <= black || code >= saturation) continue;
    ++all;
    seen += channel.observed[m] ? 1 : 0;
  }
  return all > 0 ? static_cast<double>(seen) / static_cast<double>(all) : 0;
}

class Estimation {
 public:
  Estimation(const ExposureSweep& sweep, const ResponseOptions& options, const Progress& progress)
      : sweep_(sweep),
        options_(options),
        progress_(progress),
        channels_(sweep.format.colour_channels()),
        samples_(static_cast<std::size_t>(channels_)),
        problems_(samples_.size()),
        fits_(samples_.size()),
        iterations_(samples_.size()) {
    facts_.dark = darkest_reading(sweep);
    require_rising_codes(sweep, facts_.dark);
    facts_.saturation = saturation_code(sweep, facts_.dark);
    facts_.last_code = sweep.format.level_count() - 1;
  }

  ResponseEstimate run() {
    fit_all();
    for (const std::optional<ChannelFit>& fit : fits_) own_.push_back({fit->curve.black(), fit->black_sigma});
    const std::optional<BlackLevel> black = common_black(own_);
    if (black) share_black(*black);
    return assemble();
  }

 private:
  // Channels are independent: one task each. Progress is called by one of them at a time.
  template <typename Work>
  void each_channel(const Work& work) {
    tbb::parallel_for(0, channels_, [&](int c) {
      work(static_cast<std::size_t>(c));
      const std::lock_guard lock(progress_mutex_);
      report_progress(progress_, "response", ++steps_ / (3.0 * channels_));
    });
  }

  void fit_all() {
    each_channel([&](std::size_t c) {
      samples_[c] = channel_samples(sweep_, static_cast<int>(c));
      problems_[c] = problem_for(sweep_, facts_, samples_[c], static_cast<int>(c), options_);
      const std::optional<CodeSpline> start = rough_curve(problems_[c], fit_options(options_));
      if (!start)
        throw InputError(
            sweep_.source, "sweep",
            "the codes do not rise with the exposures given: check exposure_s and nd_density of each frame");
      fits_[c] = fit_response(problems_[c], fit_options(options_), *start);
      iterations_[c] = fits_[c]->iterations;
    });
  }

  void share_black(const BlackLevel& black) {
    FitOptions settled = fit_options(options_);
    settled.first_kink_scale = settled.kink_scale;  // only the black level moves, by a fraction of a code
    each_channel([&](std::size_t c) {
      if (fits_.size() == 1) return;  // its own estimate is the common one already
      problems_[c].black = black.code;
      problems_[c].black_sigma = 0;
      fits_[c] = fit_response(problems_[c], settled, with_black(fits_[c]->curve, black.code));
      fits_[c]->covariance.bottomRightCorner<1, 1>().setConstant(black.sigma * black.sigma);
      iterations_[c] += fits_[c]->iterations;
    });
  }

  [[nodiscard]] ResponseEstimate assemble() {
    ResponseEstimate out;
    out.curve.black_level = facts_.last_code;
    double highest_black = 0;
    std::vector<std::vector<bool>> observed;
    for (std::size_t c = 0; c < fits_.size(); ++c) {
      out.curve.black_level = std::min(out.curve.black_level, std::max(0.0, fits_[c]->curve.black()));
      highest_black = std::max(highest_black, fits_[c]->curve.black());
      observed.push_back(observed_codes(samples_[c], facts_));
    }
    out.curve.saturation_code = facts_.saturation;
    out.curve.radiance_scale.assign(fits_.size(), 1.0);
    const double unit = unit_code(observed, highest_black, facts_.saturation);
    for (std::size_t c = 0; c < fits_.size(); ++c) out.curve.channels.push_back(tabulate(*fits_[c], observed[c], unit));
    out.channels.resize(fits_.size());
    each_channel([&](std::size_t c) { out.channels[c] = report(out.curve, c); });
    return out;
  }

  [[nodiscard]] ChannelReport report(const ResponseCurve& curve, std::size_t c) const {
    return {own_[c].code,
            own_[c].sigma,
            observed_fraction(curve.channels[c], curve.black_level, facts_.saturation),
            iterations_[c],
            fits_[c]->converged,
            problems_[c].samples.pixel_count(),
            measure_self_consistency(samples_[c], curve, static_cast<int>(c), fits_[c]->noise, options_.noise_limit)};
  }

  const ExposureSweep& sweep_;
  const ResponseOptions& options_;
  const Progress& progress_;
  int channels_;
  SweepFacts facts_;
  std::vector<ChannelSamples> samples_;  // every pixel, by channel
  std::vector<FitProblem> problems_;
  std::vector<std::optional<ChannelFit>> fits_;  // all there after fit_all()
  std::vector<BlackLevel> own_;                  // each channel's black level before they were joined
  std::vector<int> iterations_;
  std::mutex progress_mutex_;
  int steps_ = 0;
};

}  // namespace

ResponseEstimate estimate_response(const ExposureSweep& sweep, const ResponseOptions& options,
                                   const Progress& progress) {
  if (const std::optional<std::string> wrong = options.validate()) throw InputError("options", "", *wrong);
  sweep.require_usable();
  return Estimation(sweep, options, progress).run();
}

}  // namespace mf
