// SPDX-License-Identifier: Apache-2.0
#include "host/import/import_session.h"

#include <fmt/format.h>
#include <tbb/parallel_pipeline.h>

#include <cmath>
#include <thread>

#include "common/check.h"
#include "common/error.h"
#include "common/session.h"
#include "host/import/frame_source.h"
#include "host/import/new_folder.h"
#include "host/import/recording.h"

namespace mf {

namespace {

namespace fs = std::filesystem;

// The spot meter's disc must lie in the picture, or its mean would be of other pixels than the user measured.
void require_reference_inside(const SessionHeader& header, const fs::path& file) {
  if (!header.reference) return;
  const SessionHeader::Reference& r = *header.reference;
  const bool inside = r.x_px - r.radius_px >= 0 && r.y_px - r.radius_px >= 0 && r.x_px + r.radius_px <= header.width &&
                      r.y_px + r.radius_px <= header.height;
  if (!inside)
    throw InputError(file.string(), "pixel",
                     fmt::format("({}, {}) with radius {} reaches outside of the {} x {} picture: correct it", r.x_px,
                                 r.y_px, r.radius_px, header.width, header.height));
}

// Decoding and compressing run on every core; one thread at a time writes, in the order of the recording.
void copy_frames(const Recording& recording, SessionWriter& writer, const Progress& progress) {
  const std::vector<RecordedFrame>& frames = recording.frames;
  const std::size_t in_flight = 2 * std::max(1U, std::thread::hardware_concurrency());  // bounds the memory
  std::size_t next = 0;
  std::size_t done = 0;
  const auto read =
      tbb::make_filter<void, std::size_t>(tbb::filter_mode::serial_in_order, [&](tbb::flow_control& flow) {
        if (next == frames.size()) flow.stop();
        return next < frames.size() ? next++ : next;  // what is returned after stop() goes nowhere
      });
  const auto encode = tbb::make_filter<std::size_t, EncodedFrame>(tbb::filter_mode::parallel, [&](std::size_t index) {
    const Frame frame = read_recorded_frame(frames[index], recording.header.format);
    require_size(frames[index], frame, recording.header, frames.front().info.name);
    return writer.encode(frame);
  });
  const auto write =
      tbb::make_filter<EncodedFrame, void>(tbb::filter_mode::serial_in_order, [&](const EncodedFrame& frame) {
        writer.append(frame);
        report_progress(progress, "import", static_cast<double>(++done) / static_cast<double>(frames.size()));
      });
  tbb::parallel_pipeline(in_flight, read & encode & write);
}

std::int64_t bytes_of(const std::vector<RecordedFrame>& frames) {
  std::int64_t sum = 0;
  for (const RecordedFrame& frame : frames) sum += static_cast<std::int64_t>(fs::file_size(frame.file));
  return sum;
}

std::int64_t bytes_below(const fs::path& folder) {
  std::int64_t sum = 0;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file()) sum += static_cast<std::int64_t>(entry.file_size());
  return sum;
}

ImportResult summarize(const Recording& recording, const fs::path& written) {
  ImportResult result;
  result.format = recording.header.format;
  result.width = recording.header.width;
  result.height = recording.header.height;
  result.unlisted_files = recording.unlisted_files;
  for (const RecordedFrame& frame : recording.frames) {
    if (frame.info.role == FrameRole::mirror) ++result.mirror_frames;
    if (frame.info.role == FrameRole::sweep) ++result.sweep_frames;
    if (frame.info.role != FrameRole::scene) continue;
    ++result.scene_frames;
    result.scene_exposure_s = frame.info.exposure_s;
  }
  result.source_bytes = bytes_of(recording.frames);
  result.session_bytes = bytes_below(written);
  return result;
}

}  // namespace

std::optional<std::string> ImportOptions::validate() const {
  if (session.empty()) return "output is empty: name the session's folder";
  return std::nullopt;
}

ImportResult import_session(const ImportInput& input, const ImportOptions& options, const Progress& progress) {
  if (const auto wrong = options.validate()) throw InputError("import", "", *wrong);
  NewSessionFolder folder(options.session, options.overwrite);
  Recording recording = read_recording(input.folder);
  const Frame first = read_recorded_frame(recording.frames.front(), recording.header.format);
  recording.header.width = width_of(first);
  recording.header.height = height_of(first);
  require_reference_inside(recording.header, input.folder / "reference.json");
  {
    // An import can be repeated, so frames become durable together, which is faster than one by one.
    SessionWriter writer(folder.path(), recording.header, {SessionWriter::Durability::batches});
    copy_frames(recording, writer, progress);
    writer.finish();
  }
  const ImportResult result = summarize(recording, folder.path());
  folder.commit();
  return result;
}

}  // namespace mf
