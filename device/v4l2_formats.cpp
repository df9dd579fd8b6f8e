// SPDX-License-Identifier: Apache-2.0
#include "device/v4l2_formats.h"

#include <linux/videodev2.h>

#include <algorithm>
#include <array>

namespace mf {

namespace {

using enum PixelLayout;

constexpr V4l2Format unpacked(std::uint32_t fourcc, std::string_view name, PixelLayout layout, int bits) {
  return {fourcc, {0, name, {layout, bits}, bits == 8 ? Packing::bytes : Packing::words}};
}
constexpr V4l2Format mipi(std::uint32_t fourcc, std::string_view name, PixelLayout layout, int bits) {
  return {fourcc, {0, name, {layout, bits}, bits == 10 ? Packing::mipi_10 : Packing::mipi_12}};
}

constexpr std::array recordable{
    unpacked(V4L2_PIX_FMT_SRGGB16, "BayerRG16", bayer_rg, 16),
    unpacked(V4L2_PIX_FMT_SGRBG16, "BayerGR16", bayer_gr, 16),
    unpacked(V4L2_PIX_FMT_SGBRG16, "BayerGB16", bayer_gb, 16),
    unpacked(V4L2_PIX_FMT_SBGGR16, "BayerBG16", bayer_bg, 16),
    unpacked(V4L2_PIX_FMT_Y16, "Mono16", mono, 16),
    unpacked(V4L2_PIX_FMT_SRGGB14, "BayerRG14", bayer_rg, 14),
    unpacked(V4L2_PIX_FMT_SGRBG14, "BayerGR14", bayer_gr, 14),
    unpacked(V4L2_PIX_FMT_SGBRG14, "BayerGB14", bayer_gb, 14),
    unpacked(V4L2_PIX_FMT_SBGGR14, "BayerBG14", bayer_bg, 14),
    unpacked(V4L2_PIX_FMT_SRGGB12, "BayerRG12", bayer_rg, 12),
    unpacked(V4L2_PIX_FMT_SGRBG12, "BayerGR12", bayer_gr, 12),
    unpacked(V4L2_PIX_FMT_SGBRG12, "BayerGB12", bayer_gb, 12),
    unpacked(V4L2_PIX_FMT_SBGGR12, "BayerBG12", bayer_bg, 12),
    unpacked(V4L2_PIX_FMT_Y12, "Mono12", mono, 12),
    mipi(V4L2_PIX_FMT_SRGGB12P, "BayerRG12p", bayer_rg, 12),
    mipi(V4L2_PIX_FMT_SGRBG12P, "BayerGR12p", bayer_gr, 12),
    mipi(V4L2_PIX_FMT_SGBRG12P, "BayerGB12p", bayer_gb, 12),
    mipi(V4L2_PIX_FMT_SBGGR12P, "BayerBG12p", bayer_bg, 12),
    unpacked(V4L2_PIX_FMT_SRGGB10, "BayerRG10", bayer_rg, 10),
    unpacked(V4L2_PIX_FMT_SGRBG10, "BayerGR10", bayer_gr, 10),
    unpacked(V4L2_PIX_FMT_SGBRG10, "BayerGB10", bayer_gb, 10),
    unpacked(V4L2_PIX_FMT_SBGGR10, "BayerBG10", bayer_bg, 10),
    unpacked(V4L2_PIX_FMT_Y10, "Mono10", mono, 10),
    mipi(V4L2_PIX_FMT_SRGGB10P, "BayerRG10p", bayer_rg, 10),
    mipi(V4L2_PIX_FMT_SGRBG10P, "BayerGR10p", bayer_gr, 10),
    mipi(V4L2_PIX_FMT_SGBRG10P, "BayerGB10p", bayer_gb, 10),
    mipi(V4L2_PIX_FMT_SBGGR10P, "BayerBG10p", bayer_bg, 10),
    mipi(V4L2_PIX_FMT_Y10P, "Mono10p", mono, 10),
    unpacked(V4L2_PIX_FMT_SRGGB8, "BayerRG8", bayer_rg, 8),
    unpacked(V4L2_PIX_FMT_SGRBG8, "BayerGR8", bayer_gr, 8),
    unpacked(V4L2_PIX_FMT_SGBRG8, "BayerGB8", bayer_gb, 8),
    unpacked(V4L2_PIX_FMT_SBGGR8, "BayerBG8", bayer_bg, 8),
    unpacked(V4L2_PIX_FMT_GREY, "Mono8", mono, 8),
    V4l2Format{V4L2_PIX_FMT_YUYV, {0, "Mono8", {mono, 8}, Packing::luma_of_yuyv}},
};

}  // namespace

std::span<const V4l2Format> v4l2_formats() {
  return recordable;
}

std::optional<V4l2Format> known_v4l2_format(std::uint32_t fourcc) {
  const auto* found =
      std::find_if(recordable.begin(), recordable.end(), [&](const V4l2Format& f) { return f.fourcc == fourcc; });
  return found == recordable.end() ? std::nullopt : std::optional(*found);
}

std::string fourcc_name(std::uint32_t fourcc) {
  std::string name;
  for (unsigned shift = 0; shift < 32; shift += 8) {
    const auto c = static_cast<char>(fourcc >> shift & 0x7F);  // the top bit says big-endian
    name += c >= ' ' ? c : '?';
  }
  while (name.ends_with(' ')) name.pop_back();
  return name;
}

}  // namespace mf
