// SPDX-License-Identifier: Apache-2.0
#include "common/frame.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>

namespace mf {

namespace {

struct LayoutName {
  std::string_view name;
  PixelLayout layout;
};
constexpr std::array<LayoutName, 6> layout_names{{{"Mono", PixelLayout::mono},
                                                  {"BayerRG", PixelLayout::bayer_rg},
                                                  {"BayerGR", PixelLayout::bayer_gr},
                                                  {"BayerGB", PixelLayout::bayer_gb},
                                                  {"BayerBG", PixelLayout::bayer_bg},
                                                  {"RGB", PixelLayout::rgb}}};

constexpr std::array<std::string_view, 3> role_names{"mirror", "scene", "sweep"};

}  // namespace

std::optional<PixelFormat> parse_pixel_format(std::string_view name) {
  for (const LayoutName& candidate : layout_names) {
    if (!name.starts_with(candidate.name)) continue;
    const std::string_view rest = name.substr(candidate.name.size());
    const bool mosaic = candidate.layout != PixelLayout::mono && candidate.layout != PixelLayout::rgb;
    if (rest == "Float" && !mosaic) return PixelFormat{candidate.layout, 16, true};
    int bits = 0;
    const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), bits);
    if (error != std::errc{} || end != rest.data() + rest.size() || bits < 8 || bits > 16) return std::nullopt;
    return PixelFormat{candidate.layout, bits, false};
  }
  return std::nullopt;
}

std::string pixel_format_name(const PixelFormat& format) {
  for (const LayoutName& candidate : layout_names)
    if (candidate.layout == format.layout)
      return format.linear_float ? fmt::format("{}Float", candidate.name)
                                 : fmt::format("{}{}", candidate.name, format.bits);
  return {};
}

std::string_view frame_role_name(FrameRole role) {
  return role_names[static_cast<std::size_t>(role)];
}

std::optional<FrameRole> parse_frame_role(std::string_view name) {
  for (std::size_t i = 0; i < role_names.size(); ++i)
    if (role_names[i] == name) return static_cast<FrameRole>(i);
  return std::nullopt;
}

double FrameInfo::effective_exposure_s() const {
  return exposure_s * std::pow(10.0, -nd_density);
}

}  // namespace mf
