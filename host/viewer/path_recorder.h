// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "common/image.h"
#include "host/io/view.h"

namespace mf {

// A camera path from key views to pictures, a piece of work at a time so that a window stays alive:
//   FOLDER/path.json            the key views and the number of frames, for `lumigraph --camera-path`
//   FOLDER/frames/0001.png, …   what they show
//   FOLDER/path.mp4             the film of them, 30 a second, where ffmpeg is installed
// A path rendered again replaces the one before.
class PathRecorder {
 public:
  static constexpr int frames_between_keys = 30;

  explicit PathRecorder(std::filesystem::path folder) : folder_(std::move(folder)) {}
  PathRecorder(const PathRecorder&) = delete;
  PathRecorder& operator=(const PathRecorder&) = delete;
  ~PathRecorder();  // a film that is being made is given up

  // Keys have the first one's size: another picture is scaled to its width, and cut or widened about its middle.
  void add_key(const View&);
  void drop_last_key();
  [[nodiscard]] const std::vector<View>& keys() const { return keys_; }

  // Writes path.json and goes to work. Needs two keys. Throws InputError naming what cannot be written.
  void start();
  [[nodiscard]] bool is_working() const { return next_frame_ < path_.size() || film_maker_ > 0; }
  // The next frame, or a look at how the film goes on. Throws as start(); the work is then over.
  void work(const std::function<ImageU8(const View&)>& render);

  // A line for people about the last thing done.
  [[nodiscard]] const std::string& status() const { return status_; }

 private:
  void start_film();
  void look_at_film();

  std::filesystem::path folder_;
  std::vector<View> keys_;
  std::vector<View> path_;
  std::size_t next_frame_ = 0;
  pid_t film_maker_ = 0;  // ffmpeg; 0: none runs
  std::string status_;
};

}  // namespace mf
