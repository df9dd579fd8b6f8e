// SPDX-License-Identifier: Apache-2.0
#include "host/lumigraph/leave_one_out.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "common/check.h"
#include "common/luminance.h"

namespace mf {

namespace {

float largest_of(const Picture& picture) {
  if (std::holds_alternative<ImageU8>(picture)) return 255;
  const auto& data = std::get<ImageF>(picture).data;
  return std::max(*std::max_element(data.begin(), data.end()), std::numeric_limits<float>::min());
}

// Rec. 709 luma of values that are relative to `largest`.
ImageF luma_of(const Picture& picture, float largest) {
  return std::visit(
      [&](const auto& image) {
        ImageF luma(image.width, image.height, 1);
        for (std::size_t i = 0; i < luma.data.size(); ++i)
          luma.data[i] = luminance_of({static_cast<float>(image.data[3 * i]), static_cast<float>(image.data[3 * i + 1]),
                                       static_cast<float>(image.data[3 * i + 2])}) /
                         largest;
        return luma;
      },
      picture);
}

ImageF product(const ImageF& a, const ImageF& b) {
  ImageF out = a;
  for (std::size_t i = 0; i < out.data.size(); ++i) out.data[i] *= b.data[i];
  return out;
}

// Gaussian of σ = 1.5 px over 11 pixels, the border repeated: the window of Wang et al.
ImageF blurred(const ImageF& image) {
  constexpr int reach = 5;
  std::array<float, 2 * reach + 1> kernel{};
  float sum = 0;
  for (int i = -reach; i <= reach; ++i)
    sum += kernel[static_cast<std::size_t>(i + reach)] = std::exp(-static_cast<float>(i * i) / (2 * 1.5F * 1.5F));
  for (float& value : kernel) value /= sum;
  const auto pass = [&](const ImageF& in, bool along_x) {
    ImageF out(in.width, in.height, 1);
    for (int y = 0; y < in.height; ++y)
      for (int x = 0; x < in.width; ++x)
        for (int i = -reach; i <= reach; ++i) {
          const int sx = along_x ? std::clamp(x + i, 0, in.width - 1) : x;
          const int sy = along_x ? y : std::clamp(y + i, 0, in.height - 1);
          out.at(x, y) += kernel[static_cast<std::size_t>(i + reach)] * in.at(sx, sy);
        }
    return out;
  };
  return pass(pass(image, true), false);
}

std::uint32_t nearest_to(const std::vector<Lumigraph::Source>& sources, std::size_t left_out) {
  const auto centre = [&](std::size_t i) { return sources[i].cam_from_world.inverse().translation; };
  std::size_t nearest = left_out == 0 ? 1 : 0;
  for (std::size_t i = 0; i < sources.size(); ++i)
    if (i != left_out && (centre(i) - centre(left_out)).norm() < (centre(nearest) - centre(left_out)).norm())
      nearest = i;
  return static_cast<std::uint32_t>(nearest);
}

}  // namespace

double psnr_db(const Picture& picture, const Picture& truth, const ImageU8& where) {
  const double largest = largest_of(truth);
  return std::visit(
      [&](const auto& a, const auto& b) {
        check(a.width == b.width && a.height == b.height, "pictures that are compared have one size");
        double sum = 0;
        std::size_t count = 0;
        for (std::size_t i = 0; i < where.data.size(); ++i) {
          if (where.data[i] != Covered::seen) continue;
          for (std::size_t c = 0; c < 3; ++c) {
            const double difference = (static_cast<double>(a.data[3 * i + c]) - b.data[3 * i + c]) / largest;
            sum += difference * difference;
            ++count;
          }
        }
        return count == 0 ? 0.0 : -10 * std::log10(std::max(sum / static_cast<double>(count), 1e-12));
      },
      picture, truth);
}

double ssim(const Picture& picture, const Picture& truth, const ImageU8& where) {
  const float largest = largest_of(truth);
  const ImageF a = luma_of(picture, largest);
  const ImageF b = luma_of(truth, largest);
  const ImageF mean_a = blurred(a);
  const ImageF mean_b = blurred(b);
  const ImageF aa = blurred(product(a, a));
  const ImageF bb = blurred(product(b, b));
  const ImageF ab = blurred(product(a, b));
  constexpr double c1 = 0.01 * 0.01;  // K1, K2 of the paper
  constexpr double c2 = 0.03 * 0.03;
  double sum = 0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < where.data.size(); ++i) {
    if (where.data[i] != Covered::seen) continue;
    const double ma = mean_a.data[i];
    const double mb = mean_b.data[i];
    const double va = aa.data[i] - ma * ma;
    const double vb = bb.data[i] - mb * mb;
    const double vab = ab.data[i] - ma * mb;
    sum += (2 * ma * mb + c1) * (2 * vab + c2) / ((ma * ma + mb * mb + c1) * (va + vb + c2));
    ++count;
  }
  return count == 0 ? 0 : sum / static_cast<double>(count);
}

namespace {

// What a photo's own mask leaves out is not compared: the frame about a mirror, a background.
void leave_to_mask(const ImageU8& mask, ImageU8& covered) {
  for (std::size_t i = 0; i < mask.data.size(); ++i)
    if (mask.data[i] < 128) covered.data[i] = Covered::nothing;
}

}  // namespace

LeaveOneOut leave_one_out(const FrameRenderer& renderer, const PhotoSet& set, const LumigraphOptions& options,
                          const TakeLeftOut& take, const Progress& progress) {
  const auto& sources = renderer.lumigraph().sources();
  check(sources.size() >= 2 && sources.size() == set.photos.size(), "a photo is left out of two or more");
  LumigraphOptions blended = options;
  LumigraphOptions alone = options;
  alone.penalty.k = 1;
  LeaveOneOut result;
  const auto count = static_cast<double>(sources.size());
  for (std::size_t i = 0; i < sources.size(); ++i) {
    report_progress(progress, "leaving one out", static_cast<double>(i) / count);
    std::vector<std::uint32_t> others;
    for (std::uint32_t j = 0; j < sources.size(); ++j)
      if (j != i) others.push_back(j);
    const View view{sources[i].camera, sources[i].cam_from_world};
    if (blended.moment && sources[i].time_s) blended.moment->time_s = *sources[i].time_s;
    LumigraphPicture foretold = renderer.render(view, blended, others);
    const std::uint32_t nearest = nearest_to(sources, i);
    LumigraphPicture by_nearest = renderer.render(view, alone, {&nearest, 1});
    leave_to_mask(set.photos[i].mask, foretold.covered);
    leave_to_mask(set.photos[i].mask, by_nearest.covered);
    const Picture& photo = set.photos[i].picture;
    const double pixels = static_cast<double>(foretold.covered.data.size());
    const auto covered = std::count_if(foretold.covered.data.begin(), foretold.covered.data.end(),
                                       [](auto v) { return v == Covered::seen; });
    const LeftOutView of_view{sources[i].name, psnr_db(foretold.picture, photo, foretold.covered),
                              ssim(foretold.picture, photo, foretold.covered),
                              psnr_db(by_nearest.picture, photo, by_nearest.covered),
                              static_cast<double>(covered) / pixels};
    if (take) take(of_view, {foretold, photo});
    result.views.push_back(of_view);
    result.psnr_db += of_view.psnr_db / count;
    result.ssim += of_view.ssim / count;
    result.nearest_view_psnr_db += of_view.nearest_view_psnr_db / count;
  }
  report_progress(progress, "leaving one out", 1);
  return result;
}

}  // namespace mf
