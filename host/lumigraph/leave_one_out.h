// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "common/progress.h"
#include "host/lumigraph/frame_renderer.h"

namespace mf {

// How well a lumigraph foretells a photo from all others, for every photo in turn.
struct LeftOutView {
  std::string name;
  double psnr_db = 0;               // over the pixels that are seen, see Covered, and that the photo's mask leaves
  double ssim = 0;                  // the same pixels
  double nearest_view_psnr_db = 0;  // the photo taken nearest by, alone, over what it sees
  double covered = 0;               // share of the photo's pixels that are seen
};

struct LeaveOneOut {
  std::vector<LeftOutView> views;
  double psnr_db = 0;  // means of the views
  double ssim = 0;
  double nearest_view_psnr_db = 0;
};

struct LeftOutPictures {
  const LumigraphPicture& foretold;
  const Picture& photo;
};
using TakeLeftOut = std::function<void(const LeftOutView&, const LeftOutPictures&)>;

// PSNR = −10 log₁₀ of the mean squared difference of all channels, 8-bit codes as 0…1; linear pictures relative to
// their photo's largest value. Where the options have a moment, each photo is foretold for its own. `take` gets each
// result as it comes; may be empty.
[[nodiscard]] LeaveOneOut leave_one_out(const FrameRenderer&, const PhotoSet&, const LumigraphOptions&,
                                        const TakeLeftOut& = {}, const Progress& = {});

// The same for two pictures of one size, over the pixels that are seen.
[[nodiscard]] double psnr_db(const Picture&, const Picture& truth, const ImageU8& where);
// Structural similarity (Wang et al. 2004) of luma, Gaussian windows of σ = 1.5 px.
[[nodiscard]] double ssim(const Picture&, const Picture& truth, const ImageU8& where);

}  // namespace mf
