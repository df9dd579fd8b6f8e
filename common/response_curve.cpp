// SPDX-License-Identifier: Apache-2.0
#include "common/response_curve.h"

#include <algorithm>
#include <cmath>

#include "common/check.h"

namespace mf {

namespace {

// Where the table has no flat part: exposure rises from 0 at the black level, which may lie between codes.
// The code and exposure at the lower end of the step that ends at code `upper`.
struct StepStart {
  double code = 0;
  double exposure = 0;
};
StepStart step_start(const ResponseCurve& curve, const ResponseChannel& channel, std::size_t upper) {
  const double lower = static_cast<double>(upper - 1);
  if (curve.black_level > lower && curve.black_level < static_cast<double>(upper)) return {curve.black_level, 0};
  return {lower, channel.exposure[upper - 1]};
}

const ResponseChannel& channel_of(const ResponseCurve& curve, int channel) {
  check(channel >= 0 && static_cast<std::size_t>(channel) < curve.channels.size(), "response has such a channel");
  return curve.channels[static_cast<std::size_t>(channel)];
}

}  // namespace

double ResponseCurve::exposure_of(int channel, double code) const {
  const ResponseChannel& table = channel_of(*this, channel);
  const double last = static_cast<double>(table.exposure.size() - 1);
  if (!(code > black_level)) return 0;
  if (code >= last) return table.exposure.back();
  const std::size_t upper = static_cast<std::size_t>(std::max(0.0, std::floor(code))) + 1;
  const StepStart start = step_start(*this, table, upper);
  const double fraction = (code - start.code) / (static_cast<double>(upper) - start.code);
  return start.exposure + fraction * (table.exposure[upper] - start.exposure);
}

double ResponseCurve::code_of(int channel, double exposure) const {
  const ResponseChannel& table = channel_of(*this, channel);
  if (!(exposure > 0)) return black_level;
  const auto above = std::upper_bound(table.exposure.begin(), table.exposure.end(), exposure);
  if (above == table.exposure.end()) return static_cast<double>(table.exposure.size() - 1);
  const std::size_t upper = static_cast<std::size_t>(above - table.exposure.begin());
  if (upper == 0) return black_level;
  const StepStart start = step_start(*this, table, upper);
  return start.code +
         (exposure - start.exposure) / (*above - start.exposure) * (static_cast<double>(upper) - start.code);
}

namespace {

template <typename ExposureAboveBlack>
ResponseCurve tabulate(int bits, double black_level, int channels, const ExposureAboveBlack& exposure) {
  check(bits >= 1 && bits <= 16 && channels >= 1, "a response has 1 to 16 bits and at least one channel");
  const std::size_t levels = std::size_t{1} << static_cast<unsigned>(bits);
  check(black_level >= 0 && black_level < static_cast<double>(levels - 1), "the black level lies among the codes");
  ResponseChannel channel;
  channel.exposure.resize(levels);
  channel.observed.assign(levels, true);
  channel.relative_sigma.assign(levels, 0.0);
  for (std::size_t code = 0; code < levels; ++code)
    channel.exposure[code] = exposure(std::max(0.0, static_cast<double>(code) - black_level));
  ResponseCurve curve;
  curve.black_level = black_level;
  curve.saturation_code = static_cast<double>(levels - 1);
  curve.channels.assign(static_cast<std::size_t>(channels), channel);
  curve.radiance_scale.assign(static_cast<std::size_t>(channels), 1.0);
  return curve;
}

}  // namespace

ResponseCurve linear_response(int bits, double black_level, double full_scale, int channels) {
  check(full_scale > 0, "full scale is positive");
  const double range = std::exp2(bits) - 1 - black_level;
  return tabulate(bits, black_level, channels, [&](double above) { return above / range * full_scale; });
}

ResponseCurve linlog_response(int bits, double black_level, double knee, double full_scale, int channels) {
  check(knee > 0 && knee < full_scale, "the knee lies below full scale");
  // above = gain · e up to the knee, gain · knee · (1 + ln(e / knee)) beyond: value and slope are continuous.
  const double range = std::exp2(bits) - 1 - black_level;
  const double codes_at_knee = range / (1 + std::log(full_scale / knee));
  return tabulate(bits, black_level, channels, [&](double above) {
    return above <= codes_at_knee ? above / codes_at_knee * knee : knee * std::exp(above / codes_at_knee - 1);
  });
}

std::vector<float> radiance_table(const ResponseCurve& curve, int channel, double effective_exposure_s) {
  const std::vector<double>& exposure = channel_of(curve, channel).exposure;
  const double scale = curve.radiance_scale.at(static_cast<std::size_t>(channel)) / effective_exposure_s;
  const double bound = std::min(curve.saturation_code, static_cast<double>(exposure.size() - 1));
  const double ceiling = curve.exposure_of(channel, bound);
  std::vector<float> table(exposure.size());
  for (std::size_t code = 0; code < table.size(); ++code)
    table[code] = static_cast<float>(scale * std::min(exposure[code], ceiling));
  return table;
}

namespace {

// Pixels of one row, `tables` repeating along it (1: mono, 2: a Bayer row, 3: red, green, blue).
void look_up_row(std::span<const std::uint16_t> codes, std::span<const std::vector<float>* const> tables,
                 std::span<float> radiance) {
  const std::size_t step = tables.size();
  for (std::size_t phase = 0; phase < step; ++phase) {
    const float* const table = tables[phase]->data();
    const std::size_t last = tables[phase]->size() - 1;
    for (std::size_t i = phase; i < codes.size(); i += step) radiance[i] = table[std::min<std::size_t>(codes[i], last)];
  }
}

ImageF look_up(const ImageU16& codes, const PixelFormat& format, const ResponseCurve& curve, double exposure_s) {
  std::vector<std::vector<float>> by_colour;
  by_colour.reserve(static_cast<std::size_t>(format.colour_channels()));
  for (int c = 0; c < format.colour_channels(); ++c) by_colour.push_back(radiance_table(curve, c, exposure_s));
  ImageF radiance(codes.width, codes.height, codes.channels);
  for (int y = 0; y < codes.height; ++y) {
    std::vector<const std::vector<float>*> tables;
    if (format.layout == PixelLayout::rgb || format.layout == PixelLayout::mono)
      for (const std::vector<float>& table : by_colour) tables.push_back(&table);
    else
      for (int x = 0; x < 2; ++x)
        tables.push_back(&by_colour[static_cast<std::size_t>(colour_at(format.layout, x, y))]);
    look_up_row(codes.row(y), tables, radiance.row(y));
  }
  return radiance;
}

ImageF scale_linear(const ImageF& values, const ResponseCurve& curve, double exposure_s) {
  ImageF radiance = values;
  const std::size_t channels = static_cast<std::size_t>(values.channels);
  check(curve.radiance_scale.size() == channels, "the response has the frame's channels");
  for (std::size_t c = 0; c < channels; ++c) {
    const float factor = static_cast<float>(curve.radiance_scale[c] / exposure_s);
    for (std::size_t i = c; i < radiance.data.size(); i += channels) radiance.data[i] *= factor;
  }
  return radiance;
}

void remove_vignetting(const Vignetting& vignetting, ImageF& image) {
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      const float factor = static_cast<float>(1 / vignetting.gain(x + 0.5, y + 0.5));
      for (int c = 0; c < image.channels; ++c) image.at(x, y, c) *= factor;
    }
}

}  // namespace

ImageF linearize(const Frame& frame, const PixelFormat& format, const ResponseCurve& curve) {
  const double exposure_s = frame.info.effective_exposure_s();
  check(exposure_s > 0, "a frame's exposure is positive");
  check(std::holds_alternative<ImageF>(frame.pixels) == format.linear_float, "the frame has the session's format");
  ImageF radiance;
  if (format.linear_float) {
    radiance = scale_linear(std::get<ImageF>(frame.pixels), curve, exposure_s);
  } else {
    check(curve.channels.size() == static_cast<std::size_t>(format.colour_channels()),
          "the response has the session's channels");
    radiance = look_up(std::get<ImageU16>(frame.pixels), format, curve, exposure_s);
  }
  if (!curve.vignetting.is_identity()) remove_vignetting(curve.vignetting, radiance);
  return radiance;
}

}  // namespace mf
