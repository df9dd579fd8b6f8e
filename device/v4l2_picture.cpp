// SPDX-License-Identifier: Apache-2.0
#include "device/v4l2_picture.h"

#include <fmt/format.h>
#include <linux/videodev2.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <vector>

#include "common/error.h"

namespace mf {

namespace {

std::set<std::uint32_t> enumerated_formats(const V4l2Device& device) {
  std::set<std::uint32_t> found;
  v4l2_fmtdesc description{};
  description.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  constexpr std::uint32_t most = 256;  // far above any camera's: against a driver that does not end its list
  for (; description.index < most && device.control(VIDIOC_ENUM_FMT, &description) == 0; ++description.index)
    found.insert(description.pixelformat);
  return found;
}

std::string names(const std::set<std::uint32_t>& fourccs) {
  std::string list;
  for (const std::uint32_t fourcc : fourccs) {
    const auto known = known_v4l2_format(fourcc);
    list += (list.empty() ? "" : ", ") + (known ? std::string(known->wire.name) : fourcc_name(fourcc));
  }
  return list.empty() ? "none" : list;
}

v4l2_pix_format current_format(const V4l2Device& device) {
  v4l2_format format{};
  format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  device.demand(VIDIOC_G_FMT, &format, "pixel_format", "the camera does not tell its picture format");
  return format.fmt.pix;
}

V4l2Format choose_format(const V4l2Device& device, const std::optional<std::string>& wanted, std::uint32_t current) {
  const std::vector<V4l2Format> there = v4l2_formats_of(device);
  const auto best = std::find_if(there.begin(), there.end(), [&](const V4l2Format& f) {
    // Asked for Mono12 and the like, a camera that has the same codes packed only is as good.
    return !wanted || f.wire.name == *wanted || pixel_format_name(f.wire.format) == *wanted;
  });
  if (best == there.end())
    throw InputError(device.node(), "pixel_format",
                     fmt::format("{}, and the camera has: {}",
                                 wanted ? *wanted + " is not to be had" : "none of the camera's can be recorded",
                                 names(enumerated_formats(device))));
  const auto kept = known_v4l2_format(current);
  const bool keep = !wanted && kept && kept->wire.packing != Packing::luma_of_yuyv;
  return keep ? *kept : *best;
}

v4l2_pix_format write_format(const V4l2Device& device, v4l2_pix_format wanted) {
  v4l2_format format{};
  format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  wanted.field = V4L2_FIELD_NONE;
  wanted.bytesperline = 0;
  wanted.sizeimage = 0;
  format.fmt.pix = wanted;
  device.demand(VIDIOC_S_FMT, &format, "pixel_format", "choose one that the camera has");
  if (format.fmt.pix.pixelformat != wanted.pixelformat)
    throw InputError(
        device.node(), "pixel_format",
        fmt::format("the camera takes {} instead: choose another", fourcc_name(format.fmt.pix.pixelformat)));
  if (format.fmt.pix.field != V4L2_FIELD_NONE && format.fmt.pix.field != V4L2_FIELD_ANY)
    throw InputError(device.node(), "pixel_format", "its pictures are interlaced: choose another camera");
  return format.fmt.pix;
}

// False when the camera cannot crop.
bool crop(const V4l2Device& device, const std::array<int, 4>& region) {
  v4l2_selection selection{};
  selection.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  selection.target = V4L2_SEL_TGT_CROP;
  selection.r = {region[0], region[1], static_cast<std::uint32_t>(region[2]), static_cast<std::uint32_t>(region[3])};
  const int error = device.control(VIDIOC_S_SELECTION, &selection);
  if (error == ENOTTY || error == EINVAL) return false;
  if (error != 0) device.demand(VIDIOC_S_SELECTION, &selection, "region_px", "stay within the sensor and its steps");
  device.demand(VIDIOC_G_SELECTION, &selection, "region_px", "the camera does not tell its region");
  const v4l2_rect& r = selection.r;
  if (std::array{r.left, r.top, static_cast<int>(r.width), static_cast<int>(r.height)} != region)
    throw InputError(
        device.node(), "region_px",
        fmt::format("the camera takes [{}, {}, {}, {}] instead: choose that, or stay within the sensor and "
                    "its steps",
                    r.left, r.top, r.width, r.height));
  return true;
}

v4l2_pix_format write_region(const V4l2Device& device, v4l2_pix_format pix, const std::array<int, 4>& region) {
  if (!crop(device, region) && (region[0] != 0 || region[1] != 0))
    throw InputError(device.node(), "region_px",
                     "the camera cannot crop: let x and y be 0, and choose one of its picture sizes");
  pix.width = static_cast<std::uint32_t>(region[2]);
  pix.height = static_cast<std::uint32_t>(region[3]);
  const v4l2_pix_format taken = write_format(device, pix);
  if (taken.width != pix.width || taken.height != pix.height)
    throw InputError(device.node(), "region_px",
                     fmt::format("the camera takes {} x {} pixels instead: choose that, or another of its sizes",
                                 taken.width, taken.height));
  return taken;
}

std::optional<v4l2_captureparm> current_timing(const V4l2Device& device) {
  v4l2_streamparm parameters{};
  parameters.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (device.control(VIDIOC_G_PARM, &parameters) != 0) return std::nullopt;
  return parameters.parm.capture;
}

}  // namespace

std::size_t V4l2Picture::bytes() const {
  return bytes_per_line * static_cast<std::size_t>(height - 1) + format.wire.bytes_for(static_cast<std::size_t>(width));
}

std::vector<V4l2Format> v4l2_formats_of(const V4l2Device& device) {
  const std::set<std::uint32_t> there = enumerated_formats(device);
  std::vector<V4l2Format> recordable;
  for (const V4l2Format& format : v4l2_formats())
    if (there.contains(format.fourcc)) recordable.push_back(format);
  return recordable;
}

V4l2Picture set_v4l2_picture(const V4l2Device& device, const CameraSettings& settings) {
  v4l2_pix_format pix = current_format(device);
  const V4l2Format format = choose_format(device, settings.pixel_format, pix.pixelformat);
  pix.pixelformat = format.fourcc;
  pix = write_format(device, pix);
  if (settings.region_px) pix = write_region(device, pix, *settings.region_px);
  const std::size_t least = format.wire.bytes_for(pix.width);
  const V4l2Picture picture{format, static_cast<int>(pix.width), static_cast<int>(pix.height),
                            pix.bytesperline == 0 ? least : std::size_t{pix.bytesperline}};
  if (pix.width == 0 || pix.height == 0 || picture.bytes_per_line < least || pix.sizeimage < picture.bytes())
    throw InputError(device.node(), "pixel_format",
                     fmt::format("the driver tells {} bytes for {} x {} pixels of {}: choose another format",
                                 pix.sizeimage, pix.width, pix.height, format.wire.name));
  return picture;
}

void set_v4l2_frame_rate(const V4l2Device& device, double hz) {
  const auto current = current_timing(device);
  if (!current || (current->capability & V4L2_CAP_TIMEPERFRAME) == 0)
    throw InputError(device.node(), "frame_rate_hz", "the camera's frame rate cannot be set: leave it out");
  v4l2_streamparm parameters{};
  parameters.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  parameters.parm.capture.timeperframe = {1000, static_cast<std::uint32_t>(std::lround(1000 * hz))};
  device.demand(VIDIOC_S_PARM, &parameters, "frame_rate_hz", "choose another");
  const double taken = v4l2_frame_rate_hz(device);
  if (!(std::abs(taken - hz) <= 0.01 * hz))
    throw InputError(device.node(), "frame_rate_hz",
                     fmt::format("the camera takes {:.4g} instead of {:.4g}: choose that, or another from `v4l2-ctl -d "
                                 "{} --list-formats-ext`",
                                 taken, hz, device.node()));
}

double v4l2_frame_rate_hz(const V4l2Device& device) {
  const auto timing = current_timing(device);
  if (!timing || timing->timeperframe.numerator == 0) return 0;
  return static_cast<double>(timing->timeperframe.denominator) / timing->timeperframe.numerator;
}

}  // namespace mf
