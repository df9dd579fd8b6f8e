// SPDX-License-Identifier: Apache-2.0
#include "host/calibration/tag_refinement.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "common/check.h"
#include "common/dense.h"
#include "common/homography.h"
#include "host/calibration/blurred_pattern.h"

namespace mf {

namespace {

// Parameters of the alignment: homography, blur, gradient of the light, then offset and gain of each colour.
constexpr int geometry_count = 8;
constexpr int blur_at = 8;
constexpr int gradient_at = 9;
constexpr int colour_at_parameter = 11;
constexpr int parameter_count = 17;
constexpr int per_pixel = 13;  // what one pixel depends on: all but the other two colours

using PixelMatrix = Eigen::Matrix<double, per_pixel, per_pixel>;
using PixelVector = Eigen::Matrix<double, per_pixel, 1>;
using FullMatrix = Eigen::Matrix<double, parameter_count, parameter_count>;
using Matrix8 = Eigen::Matrix<double, 8, 8>;
using FullVector = Eigen::Matrix<double, parameter_count, 1>;

struct Light {
  std::array<double, 3> offset{};
  std::array<double, 3> gain{};
  Eigen::Vector2d gradient = Eigen::Vector2d::Zero();
};

// Standard deviation squared of a pixel, in units of its gain, as a linear function of the model's 0…1.
struct Noise {
  double dark = 0.01;
  double bright = 0.01;
  [[nodiscard]] double variance(double t) const { return dark + (bright - dark) * std::clamp(t, 0.0, 1.0); }
};

struct NoiseSums {
  double dark = 0, bright = 0, dark_weight = 0, bright_weight = 0;
};

struct State {
  Eigen::Matrix3d picture_from_tag;  // tag: ± 1 at the border's corners, y up; picture: pixels from `centre`
  double blur_px = 0;
  Light light;
  std::array<Noise, 3> noise;  // by colour: each has its own gain
};

struct Sample {         // one pixel of the tag under the current state
  Eigen::Vector2d at;   // pixel − centre
  Eigen::Vector2d tag;  // u, v
  int colour = 0;
  double value = 0;
  BlurredPattern::Value model;
  Eigen::RowVector2d model_gradient;  // per pixel
};

constexpr double flat = 1e-3;                // model per pixel: inside a cell a pixel tells of the light only
constexpr double outer_margin_cells = 0.45;  // of the outermost ring: what lies beyond it is not known

class Alignment {
 public:
  Alignment(const ImageF& picture, PixelLayout layout, const TagPattern& pattern, const TagCorners& start)
      : picture_(picture), layout_(layout), pattern_(pattern), extent_(extent_of(pattern)) {
    centre_ = 0.25 * (start[0] + start[1] + start[2] + start[3]);
  }

  [[nodiscard]] bool begin(const TagCorners& start, double blur_px) {
    std::array<Eigen::Vector2d, 4> relative;
    for (std::size_t k = 0; k < 4; ++k) relative[k] = start[k] - centre_;
    const std::optional<Homography> h = fit_homography(tag_corners(), relative);
    if (!h || std::abs(h->matrix(2, 2)) < 1e-9) return false;
    state_.picture_from_tag = h->matrix / h->matrix(2, 2);
    state_.blur_px = blur_px;
    return fit_light();
  }

  // One Gauss–Newton step; the largest corner move in pixels, or nothing when it breaks down.
  [[nodiscard]] std::optional<double> step(bool free_blur);
  [[nodiscard]] std::optional<RefinedTag> result();

 private:
  static std::span<const Eigen::Vector2d> tag_corners() {
    static const std::array<Eigen::Vector2d, 4> corners{Eigen::Vector2d(-1, -1), Eigen::Vector2d(1, -1),
                                                        Eigen::Vector2d(1, 1), Eigen::Vector2d(-1, 1)};
    return corners;
  }
  static double extent_of(const TagPattern& pattern) {
    return (pattern.cells - 2 * outer_margin_cells) / pattern.border_cells;
  }
  [[nodiscard]] TagCorners corners(const Eigen::Matrix3d& picture_from_tag) const {
    TagCorners out;
    for (std::size_t k = 0; k < 4; ++k)
      out[k] = (picture_from_tag * tag_corners()[k].homogeneous()).hnormalized() + centre_;
    return out;
  }
  template <typename Visit>
  [[nodiscard]] int for_each_sample(Visit&& visit) const;
  [[nodiscard]] bool fit_light();
  [[nodiscard]] FullMatrix accumulate(FullVector& gradient);
  void update_noise(const std::array<NoiseSums, 3>& sums);

  const ImageF& picture_;
  PixelLayout layout_;
  BlurredPattern pattern_;
  double extent_;
  Eigen::Vector2d centre_;
  State state_;
};

// Visits the pixels whose centre lies on the tag. Returns how many.
template <typename Visit>
int Alignment::for_each_sample(Visit&& visit) const {
  Eigen::AlignedBox2d box;
  for (const Eigen::Vector2d& corner : tag_corners())
    box.extend((state_.picture_from_tag * (extent_ * corner).homogeneous()).hnormalized() + centre_);
  const int x0 = std::max(0, static_cast<int>(std::floor(box.min().x())));
  const int y0 = std::max(0, static_cast<int>(std::floor(box.min().y())));
  const int x1 = std::min(picture_.width - 1, static_cast<int>(std::ceil(box.max().x())));
  const int y1 = std::min(picture_.height - 1, static_cast<int>(std::ceil(box.max().y())));
  const Eigen::Matrix3d tag_from_picture = state_.picture_from_tag.inverse();
  int count = 0;
  Sample s;
  for (int y = y0; y <= y1; ++y) {
    for (int x = x0; x <= x1; ++x) {
      s.at = Eigen::Vector2d(x + 0.5, y + 0.5) - centre_;
      const Eigen::Vector3d q = tag_from_picture * s.at.homogeneous();
      s.tag = q.hnormalized();
      if (!(s.tag.cwiseAbs().maxCoeff() < extent_)) continue;
      // d(u, v)/d(x, y) of the inverse homography.
      const Eigen::Matrix2d tag_per_pixel =
          (tag_from_picture.topLeftCorner<2, 2>() - s.tag * tag_from_picture.bottomLeftCorner<1, 2>()) / q.z();
      const std::optional<BlurredPattern::Value> model =
          pattern_.at(s.tag, state_.blur_px * tag_per_pixel.rowwise().norm());
      if (!model) continue;
      s.model = *model;
      s.model_gradient = s.model.gradient.transpose() * tag_per_pixel;
      s.colour = colour_at(layout_, x, y);
      s.value = static_cast<double>(picture_.at(x, y));
      visit(s);
      ++count;
    }
  }
  return count;
}

// Offset and gain of each colour by linear least squares, the geometry held.
bool Alignment::fit_light() {
  std::array<Eigen::Matrix2d, 3> normal;
  std::array<Eigen::Vector2d, 3> right;
  normal.fill(Eigen::Matrix2d::Zero());
  right.fill(Eigen::Vector2d::Zero());
  const int count = for_each_sample([&](const Sample& s) {
    const Eigen::Vector2d row(1, s.model.value);
    normal[static_cast<std::size_t>(s.colour)] += row * row.transpose();
    right[static_cast<std::size_t>(s.colour)] += row * s.value;
  });
  constexpr int fewest_pixels = 60;  // about one and a half a cell of tag36h11's payload
  if (count < fewest_pixels) return false;
  const std::size_t colours = layout_ == PixelLayout::mono ? 1 : 3;
  for (std::size_t c = 0; c < colours; ++c) {
    if (std::abs(normal[c].determinant()) < 1e-6 * normal[c](0, 0)) return false;
    const Eigen::Vector2d fit = normal[c].inverse() * right[c];
    if (!(fit[1] > 0)) return false;
    state_.light.offset[c] = fit[0];
    state_.light.gain[c] = fit[1];
  }
  return true;
}

FullMatrix Alignment::accumulate(FullVector& gradient) {
  std::array<PixelMatrix, 3> normal;
  std::array<PixelVector, 3> right;
  normal.fill(PixelMatrix::Zero());
  right.fill(PixelVector::Zero());
  std::array<NoiseSums, 3> noise{};
  const Light& light = state_.light;
  const Eigen::RowVector3d last_row = state_.picture_from_tag.row(2);
  (void)for_each_sample([&](const Sample& s) {
    const auto c = static_cast<std::size_t>(s.colour);
    const double slope = 1 + light.gradient.dot(s.tag);
    const double t = s.model.value;
    const double residual = (s.value - light.offset[c]) / light.gain[c] - t * slope;
    const double variance = state_.noise[c].variance(t);
    const double normalized2 = residual * residual / variance;
    constexpr double cauchy2 = 9;  // three standard deviations: Gaussian noise loses little
    const double robust = 1 / (1 + normalized2 / cauchy2);
    const double weight = robust / variance;
    // A point of the tag that moves by dx changes the model at this pixel by −∇T · dx.
    const double w = last_row.dot(s.tag.homogeneous());
    const Eigen::RowVector2d pull = -slope / w * s.model_gradient;
    const double along = pull.dot(s.at);
    PixelVector j;
    j << pull[0] * s.tag[0], pull[0] * s.tag[1], pull[0], pull[1] * s.tag[0], pull[1] * s.tag[1], pull[1],
        -along * s.tag[0], -along * s.tag[1], slope * s.model.per_log_blur, t * s.tag[0], t * s.tag[1], 1, t * slope;
    if (std::abs(s.model_gradient[0]) + std::abs(s.model_gradient[1]) > flat) {
      normal[c].noalias() += (weight * j) * j.transpose();
      right[c] += weight * residual * j;
    } else {
      const Eigen::Vector4d of_light = j.tail<4>();
      normal[c].bottomRightCorner<4, 4>().noalias() += (weight * of_light) * of_light.transpose();
      right[c].tail<4>() += weight * residual * of_light;
    }
    const double bright = std::clamp(t, 0.0, 1.0);
    noise[c].dark += robust * (1 - bright) * residual * residual;
    noise[c].bright += robust * bright * residual * residual;
    noise[c].dark_weight += robust * (1 - bright);
    noise[c].bright_weight += robust * bright;
  });
  update_noise(noise);
  FullMatrix full = FullMatrix::Zero();
  gradient.setZero();
  for (int c = 0; c < 3; ++c) {
    const PixelMatrix& n = normal[static_cast<std::size_t>(c)];
    const PixelVector& r = right[static_cast<std::size_t>(c)];
    const int at = colour_at_parameter + 2 * c;
    full.topLeftCorner<colour_at_parameter, colour_at_parameter>() +=
        n.topLeftCorner<colour_at_parameter, colour_at_parameter>();
    full.block<colour_at_parameter, 2>(0, at) = n.topRightCorner<colour_at_parameter, 2>();
    full.block<2, colour_at_parameter>(at, 0) = n.bottomLeftCorner<2, colour_at_parameter>();
    full.block<2, 2>(at, at) = n.bottomRightCorner<2, 2>();
    gradient.head<colour_at_parameter>() += r.head<colour_at_parameter>();
    gradient.segment<2>(at) = r.tail<2>();
  }
  if (layout_ == PixelLayout::mono) full.diagonal().tail<4>().setOnes();  // colours that a mono picture lacks
  // Weak prior: blur within a factor of e of where it is; without edges inside, it would drift.
  full(blur_at, blur_at) += 1;
  return full;
}

// Gaussian noise seen through a Cauchy weight of three sigma looks smaller: E[w r²]/E[w] = 0.849 σ².
void Alignment::update_noise(const std::array<NoiseSums, 3>& sums) {
  constexpr double seen_fraction = 0.849;
  constexpr double smallest = 1e-6;  // of the contrast squared: 8-bit quantization alone is 1e-6
  for (std::size_t c = 0; c < sums.size(); ++c) {
    const NoiseSums& s = sums[c];
    state_.noise[c].dark = std::max(s.dark / std::max(s.dark_weight, 1.0) / seen_fraction, smallest);
    state_.noise[c].bright = std::max(s.bright / std::max(s.bright_weight, 1.0) / seen_fraction, smallest);
  }
}

std::optional<double> Alignment::step(bool free_blur) {
  FullVector gradient;
  FullMatrix normal = accumulate(gradient);
  if (!free_blur) {
    normal.row(blur_at).setZero();
    normal.col(blur_at).setZero();
    normal(blur_at, blur_at) = 1;
    gradient[blur_at] = 0;
  }
  const std::optional<Eigen::MatrixXd> solution = solve_symmetric(normal, gradient);
  if (!solution) return std::nullopt;
  const FullVector d = *solution;
  const TagCorners before = corners(state_.picture_from_tag);
  Eigen::Matrix3d& h = state_.picture_from_tag;
  h.row(0) += d.segment<3>(0).transpose();
  h.row(1) += d.segment<3>(3).transpose();
  h.row(2).head<2>() += d.segment<2>(6).transpose();
  if (h.row(2).head<2>().cwiseAbs().sum() > 0.5) return std::nullopt;  // no tag is seen in such perspective
  state_.blur_px = std::clamp(state_.blur_px * std::exp(std::clamp(d[blur_at], -0.3, 0.3)), 0.2, 5.0);
  state_.light.gradient += d.segment<2>(gradient_at);
  const std::size_t colours = layout_ == PixelLayout::mono ? 1 : 3;
  for (std::size_t c = 0; c < colours; ++c) {
    const int at = colour_at_parameter + 2 * static_cast<int>(c);
    const double gain = state_.light.gain[c];
    state_.light.offset[c] += gain * d[at];
    state_.light.gain[c] += gain * d[at + 1];
    if (!(state_.light.gain[c] > 0)) return std::nullopt;
  }
  const TagCorners after = corners(h);
  double moved = 0;
  for (std::size_t k = 0; k < 4; ++k) moved = std::max(moved, (after[k] - before[k]).norm());
  return moved;
}

std::optional<RefinedTag> Alignment::result() {
  RefinedTag tag;
  tag.corners_px = corners(state_.picture_from_tag);
  tag.blur_px = state_.blur_px;
  FullVector gradient;
  const FullMatrix normal = accumulate(gradient);
  // Marginalize light and blur, then change from h to the corners.
  constexpr int rest = parameter_count - geometry_count;
  const Eigen::Matrix<double, geometry_count, rest> cross = normal.topRightCorner<geometry_count, rest>();
  const Eigen::Matrix<double, rest, geometry_count> crossed = cross.transpose();
  const std::optional<Eigen::MatrixXd> follow = solve_symmetric(normal.bottomRightCorner<rest, rest>(), crossed);
  if (!follow) return std::nullopt;
  const Matrix8 of_h = normal.topLeftCorner<geometry_count, geometry_count>() - cross.lazyProduct(*follow);
  Matrix8 corners_per_h = Matrix8::Zero();
  for (int k = 0; k < 4; ++k) {
    const Eigen::Vector3d q = tag_corners()[static_cast<std::size_t>(k)].homogeneous();
    const double w = state_.picture_from_tag.row(2).dot(q);
    const Eigen::Vector2d x = tag.corners_px[static_cast<std::size_t>(k)] - centre_;
    corners_per_h.block<1, 3>(2 * k, 0) = q.transpose() / w;
    corners_per_h.block<1, 3>(2 * k + 1, 3) = q.transpose() / w;
    corners_per_h.block<2, 2>(2 * k, 6) = -x * q.head<2>().transpose() / w;
  }
  const std::optional<Eigen::MatrixXd> inverse = inverse_of(corners_per_h);
  if (!inverse) return std::nullopt;
  const Matrix8 h_per_corners = *inverse;
  const Matrix8 of_corners = of_h.lazyProduct(h_per_corners);
  tag.information = h_per_corners.transpose().lazyProduct(of_corners);
  if (!tag.information.allFinite()) return std::nullopt;

  CellVote votes(pattern_);
  double st = 0, sy = 0, stt = 0, syy = 0, sty = 0, n = 0;
  (void)for_each_sample([&](const Sample& s) {
    const auto c = static_cast<std::size_t>(s.colour);
    const double y = (s.value - state_.light.offset[c]) / state_.light.gain[c] / (1 + state_.light.gradient.dot(s.tag));
    votes.add(s.tag, y);
    const double t = s.model.value;
    const double clipped = std::clamp(y, -1.0, 2.0);  // a highlight must not decide
    st += t, sy += clipped, stt += t * t, syy += clipped * clipped, sty += t * clipped, ++n;
  });
  tag.right_cells = votes.right_fraction();
  const double spread = std::sqrt(std::max((stt - st * st / n) * (syy - sy * sy / n), 1e-300));
  tag.correlation = std::max(0.0, (sty - st * sy / n) / spread);
  return tag;
}

double longest_move_in_cells(const TagCorners& a, const TagCorners& b, const TagPattern& pattern) {
  double edge = 0;
  double moved = 0;
  for (std::size_t k = 0; k < 4; ++k) {
    edge = std::max(edge, (a[k] - a[(k + 1) % 4]).norm());
    moved = std::max(moved, (a[k] - b[k]).norm());
  }
  return moved / (edge / pattern.border_cells);
}

}  // namespace

std::optional<RefinedTag> refine_tag(const ImageF& picture, PixelLayout layout, const TagPattern& pattern,
                                     const TagCorners& start, const TagRefinementOptions& options) {
  check(picture.channels == 1 && layout != PixelLayout::rgb, "tags are aligned in a mosaic or a mono picture");
  Alignment alignment(picture, layout, pattern, start);
  if (!alignment.begin(start, options.initial_blur_px)) return std::nullopt;
  constexpr double converged_px = 0.02;  // a fifth of what the noise leaves open
  constexpr int held_blur_steps = 2;     // until the edges overlap, blur would only grow to bridge the gap
  bool converged = false;
  for (int i = 0; i < options.max_iterations && !converged; ++i) {
    const std::optional<double> moved = alignment.step(i >= held_blur_steps);
    if (!moved) return std::nullopt;
    converged = i > held_blur_steps && *moved < converged_px;
  }
  if (!converged) return std::nullopt;
  std::optional<RefinedTag> tag = alignment.result();
  if (!tag || longest_move_in_cells(start, tag->corners_px, pattern) > options.max_shift_cells) return std::nullopt;
  return tag;
}

}  // namespace mf
