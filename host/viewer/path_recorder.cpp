// SPDX-License-Identifier: Apache-2.0
#include "host/viewer/path_recorder.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>

#include "common/atomic_file.h"
#include "common/check.h"
#include "common/error.h"
#include "common/json_file.h"
#include "host/io/image_file.h"
#include "host/lumigraph/camera_path.h"

namespace mf {

namespace {

CameraModel of_size(const CameraModel& camera, int width, int height) {
  const double scale = static_cast<double>(width) / camera.width;
  CameraModel sized = camera;
  sized.width = width;
  sized.height = height;
  for (std::size_t i = 0; i < 4; ++i) sized.parameters[i] *= scale;
  sized.parameters[3] += 0.5 * (height - camera.height * scale);  // c_y: the middle stays in the middle
  return sized;
}

// As lumigraph's read_camera_path reads it.
void write_path(const std::filesystem::path& file, const std::vector<View>& keys, int frames) {
  nlohmann::json views = nlohmann::json::array();
  for (const View& view : keys) {
    const CameraModel& c = view.camera;
    views.push_back(
        {{"camera_from_world", rigid3_to_json(view.cam_from_world)},
         {"K", {{c.fx(), 0, c.cx()}, {0, c.fy(), c.cy()}, {0, 0, 1}}},
         {"distortion", {c.parameters[4], c.parameters[5], c.parameters[6], c.parameters[7], c.parameters[8]}},
         {"size", {c.width, c.height}}});
  }
  write_json_file(file, {{"frames", frames}, {"views", views}});
}

// Runs a program of PATH without a word on the terminal; 0 when there is none.
pid_t spawn_quietly(const std::vector<std::string>& arguments) {
  std::vector<char*> raw;
  raw.reserve(arguments.size() + 1);
  for (const std::string& argument : arguments) raw.push_back(const_cast<char*>(argument.c_str()));  // POSIX's type
  raw.push_back(nullptr);
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  for (const int fd : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
    posix_spawn_file_actions_addopen(&files, fd, "/dev/null", O_RDWR, 0);
  pid_t child = 0;
  const int failed = posix_spawnp(&child, raw.front(), &files, nullptr, raw.data(), environ);
  posix_spawn_file_actions_destroy(&files);
  return failed == 0 ? child : 0;
}

}  // namespace

PathRecorder::~PathRecorder() {
  if (film_maker_ <= 0) return;
  ::kill(film_maker_, SIGTERM);
  ::waitpid(film_maker_, nullptr, 0);
}

void PathRecorder::add_key(const View& view) {
  keys_.push_back(view);
  const CameraModel& first = keys_.front().camera;
  keys_.back().camera = of_size(view.camera, first.width, first.height);
  status_ = fmt::format("{} key views", keys_.size());
}

void PathRecorder::drop_last_key() {
  if (!keys_.empty()) keys_.pop_back();
  status_ = fmt::format("{} key views", keys_.size());
}

void PathRecorder::start() {
  check(keys_.size() >= 2 && !is_working(), "a path of two keys or more, once the last one is done");
  std::error_code absent;
  std::filesystem::remove_all(folder_ / "frames", absent);
  std::filesystem::remove(folder_ / "path.mp4", absent);
  make_folder(folder_ / "frames");
  const int frames = frames_between_keys * (static_cast<int>(keys_.size()) - 1) + 1;
  write_path(folder_ / "path.json", keys_, frames);
  path_ = interpolated(keys_, frames);
  next_frame_ = 0;
}

void PathRecorder::work(const std::function<ImageU8(const View&)>& render) {
  if (film_maker_ > 0) return look_at_film();
  if (next_frame_ >= path_.size()) return;
  const View view = path_[next_frame_++];
  try {
    write_png(folder_ / "frames" / fmt::format("{:04}.png", next_frame_), render(view));
  } catch (const InputError&) {
    path_.clear();
    throw;
  }
  status_ = fmt::format("frame {} of {}", next_frame_, path_.size());
  if (next_frame_ == path_.size()) start_film();
}

void PathRecorder::start_film() {
  // H.264 of most players has even sides only.
  const std::vector<std::string> command{"ffmpeg",
                                         "-y",
                                         "-framerate",
                                         "30",
                                         "-i",
                                         (folder_ / "frames" / "%04d.png").string(),
                                         "-vf",
                                         "crop=trunc(iw/2)*2:trunc(ih/2)*2",
                                         "-pix_fmt",
                                         "yuv420p",
                                         (folder_ / "path.mp4").string()};
  film_maker_ = spawn_quietly(command);
  status_ = fmt::format("{} frames in {}", path_.size(), (folder_ / "frames").string());
  if (film_maker_ > 0) return;
  status_ += "; a film needs ffmpeg:";
  for (const std::string& argument : command) status_ += " " + argument;
}

void PathRecorder::look_at_film() {
  int outcome = 0;
  if (::waitpid(film_maker_, &outcome, WNOHANG) == 0) return;
  film_maker_ = 0;
  if (WIFEXITED(outcome) && WEXITSTATUS(outcome) == 0)
    status_ = fmt::format("{} frames, {}", path_.size(), (folder_ / "path.mp4").string());
  else
    status_ += "; ffmpeg failed: run it by hand to see why";
}

}  // namespace mf
