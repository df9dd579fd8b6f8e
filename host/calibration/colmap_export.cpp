// SPDX-License-Identifier: Apache-2.0
#include "host/calibration/colmap_export.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/atomic_file.h"
#include "common/demosaic.h"
#include "common/mirror_picture.h"
#include "common/virtual_view.h"
#include "host/io/image_file.h"

namespace mf {

namespace {

constexpr int direct_camera_id = 1;
constexpr int flipped_camera_id = 2;

std::string camera_line(int id, const CameraModel& camera) {
  const CameraModel::Parameters& p = camera.parameters;
  std::string line =
      fmt::format("{} {} {} {}", id, p[8] != 0 ? "FULL_OPENCV" : (camera.has_distortion() ? "OPENCV" : "PINHOLE"),
                  camera.width, camera.height);
  const std::size_t count = camera.has_distortion() ? 8 : 4;
  for (std::size_t i = 0; i < count; ++i) line += fmt::format(" {:.17g}", p[i]);
  if (p[8] != 0) line += fmt::format(" {:.17g} 0 0 0", p[8]);
  return line + "\n";
}

std::string image_line(int id, const Rigid3& view_from_world, int camera_id, const std::string& name) {
  const Eigen::Quaterniond& q = view_from_world.rotation;
  const Eigen::Vector3d& t = view_from_world.translation;
  // The second line, of 2-D points, is empty.
  return fmt::format("{} {:.17g} {:.17g} {:.17g} {:.17g} {:.17g} {:.17g} {:.17g} {} {}\n\n", id, q.w(), q.x(), q.y(),
                     q.z(), t.x(), t.y(), t.z(), camera_id, name);
}

// One for all pictures, so that they stay comparable: what brings the middle of the lit pixels to a photographic grey.
double grey_exposure(const ImageF& picture) {
  std::vector<float> lit;
  for (const float v : picture.data)
    if (v > 0) lit.push_back(v);
  if (lit.empty()) return 1;
  std::nth_element(lit.begin(), lit.begin() + static_cast<std::ptrdiff_t>(lit.size() / 2), lit.end());
  constexpr double grey = 0.18;
  return grey / static_cast<double>(lit[lit.size() / 2]);
}

std::string png_name(const std::string& frame_name) {
  return std::filesystem::path(frame_name).stem().string() + ".png";
}

class Export {
 public:
  Export(const std::filesystem::path& folder, const Calibration& calibration, const SessionReader& session,
         const ResponseCurve& response)
      : folder_(folder), calibration_(calibration), session_(session), response_(response) {
    make_folder(folder_ / "images" / "mirror");
    make_folder(folder_ / "images" / "scene");
    make_folder(folder_ / "masks" / "mirror");
  }

  void add_scene(const SessionFrame& frame) {
    const ImageF picture = read(frame);
    if (exposure_ == 0) exposure_ = grey_exposure(picture);
    const std::string name = "scene/" + png_name(frame.info.name);
    write_png(folder_ / "images" / name, to_srgb8(picture, exposure_));
    lines_ += image_line(++count_, calibration_.cam_from_world.value_or(Rigid3{}), direct_camera_id, name);
  }

  void add_mirror(const SessionFrame& frame, const MirrorPose& pose) {
    const std::optional<VirtualView> view =
        mirror_view(pose.cam_from_mirror, session_.header().target, calibration_.camera);
    if (!view) return;
    ImageF picture = read(frame);
    if (exposure_ == 0) exposure_ = grey_exposure(picture);
    flip_x(picture);
    ImageU8 mask = mask_of(view->opening_in_img, picture.width, picture.height);
    flip_x(mask);
    const std::string name = "mirror/" + png_name(frame.info.name);
    write_png(folder_ / "images" / name, to_srgb8(picture, exposure_));
    write_png(folder_ / "masks" / (name + ".png"), mask);  // COLMAP's name for the mask of an image
    const Rigid3 view_from_world = view->view_from_cam * calibration_.cam_from_world.value_or(Rigid3{});
    lines_ += image_line(++count_, view_from_world, flipped_camera_id, name);
  }

  [[nodiscard]] int finish() const {
    write_file_atomically(folder_ / "cameras.txt",
                          "# CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n" +
                              camera_line(direct_camera_id, calibration_.camera) +
                              camera_line(flipped_camera_id, flipped_camera(calibration_.camera)));
    write_file_atomically(folder_ / "images.txt",
                          "# IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME\n# POINTS2D[] (none)\n" + lines_);
    write_file_atomically(folder_ / "points3D.txt", "# POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[] (none)\n");
    return count_;
  }

 private:
  [[nodiscard]] ImageF read(const SessionFrame& frame) const {
    const PixelFormat& format = session_.header().format;
    return demosaic(linearize(session_.read_frame(frame), format, response_), format.layout);
  }

  std::filesystem::path folder_;
  const Calibration& calibration_;
  const SessionReader& session_;
  const ResponseCurve& response_;
  double exposure_ = 0;
  int count_ = 0;
  std::string lines_;
};

}  // namespace

ColmapSummary export_colmap(const std::filesystem::path& folder, const Calibration& calibration,
                            const SessionReader& session, const ResponseCurve& response, const Progress& progress) {
  Export out(folder, calibration, session, response);
  if (calibration.cam_from_world)
    for (const SessionFrame& frame : session.frames(FrameRole::scene)) out.add_scene(frame);
  const std::vector<SessionFrame> mirror = session.frames(FrameRole::mirror);
  for (std::size_t i = 0; i < mirror.size(); ++i) {
    const auto pose = std::find_if(calibration.frames.begin(), calibration.frames.end(),
                                   [&](const MirrorPose& p) { return p.name == mirror[i].info.name; });
    if (pose != calibration.frames.end() && pose->used) out.add_mirror(mirror[i], *pose);
    report_progress(progress, "exporting views", static_cast<double>(i + 1) / static_cast<double>(mirror.size()));
  }
  return {out.finish()};
}

}  // namespace mf
