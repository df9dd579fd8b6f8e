// SPDX-License-Identifier: Apache-2.0
// The session reader. The first byte of an input says what the rest is: session.db, or session.db-wal beside a whole
// session.db, or a frame's file (read as if its checksum were right, which no mutation would hit).
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <stdexcept>

#include "common/error.h"
#include "common/file_bytes.h"
#include "common/session.h"
#include "common/tiff_image.h"
#include "tests/fuzz/fuzz_target.h"

namespace mf::fuzz {
namespace {

namespace fs = std::filesystem;

constexpr char is_index = 'i', is_log = 'l', is_frame = 'f';

// A session as a kill leaves it: rows in the index, and later ones in its log.
class Scene {
 public:
  Scene() {
    std::string name = (fs::temp_directory_path() / "mirrorfield_fuzz_XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr) throw std::runtime_error("no temporary folder");
    folder_ = name;
    SessionHeader header;
    header.format = {PixelLayout::bayer_rg, 12};
    header.width = 16;
    header.height = 8;
    header.target = {"tag36h11", {0.34, 0.26}, {{0, 0.034, {-0.195, 0.155}}, {7, 0.034, {0.195, -0.155}}}};
    SessionWriter writer(folder_ / "made", header, {});
    for (int i = 0; i < 2; ++i) append(writer, i);
    fs::copy(folder_ / "made", session(), fs::copy_options::recursive);
    log = read_file_bytes(session() / "session.db-wal");
    writer.finish();
    index = read_file_bytes(folder_ / "made/session.db");
    frame = read_file_bytes(session() / "frames/000000.tif");
  }
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;
  ~Scene() {
    std::error_code ignored;
    fs::remove_all(folder_, ignored);
  }

  [[nodiscard]] fs::path session() const { return folder_ / "session"; }
  void put(const char* file, std::string_view bytes) const {
    std::ofstream(session() / file, std::ios::binary | std::ios::trunc)
        .write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  }
  void remove(const char* file) const { fs::remove(session() / file); }

  std::string index, log, frame;

 private:
  static void append(SessionWriter& writer, int i) {
    Frame picture;
    picture.info.name = "frame" + std::to_string(i);
    picture.info.exposure_s = 0.01;
    picture.pixels = ImageU16(16, 8, 1, static_cast<std::uint16_t>(100 * i + 7));
    EncodedFrame encoded = writer.encode(picture);
    encoded.arrival = FrameArrival{i + 1, 2, 3, 4};
    writer.append(encoded);
    writer.append(FrameGap{i, 1, 5, "skipped"});
  }
  fs::path folder_;
};

Scene& scene() {
  static Scene made;
  return made;
}

void require_one_line(const InputError& e) {
  const std::string line = e.what();
  if (line.empty() || line.find('\n') != std::string::npos) throw std::logic_error("an error is not one line: " + line);
}

void read_all() {
  try {
    const SessionReader reader(scene().session());
    for (const SessionFrame& frame : reader.frames()) {
      try {
        (void)reader.read_frame(frame);
      } catch (const InputError& e) {
        require_one_line(e);
      }
    }
  } catch (const InputError& e) {
    require_one_line(e);
  }
}

void run(std::span<const std::uint8_t> input) {
  if (input.empty()) return;
  const std::string_view rest(reinterpret_cast<const char*>(input.data()) + 1, input.size() - 1);
  const char kind = static_cast<char>(input[0]);
  if (kind == is_frame) {
    try {
      (void)decode_tiff(rest, "frame.tif");
    } catch (const InputError& e) {
      require_one_line(e);
    }
  } else if (kind == is_index || kind == is_log) {
    scene().remove("session.db-shm");
    scene().put("session.db", kind == is_index ? rest : std::string_view(scene().index));
    kind == is_log ? scene().put("session.db-wal", rest) : scene().remove("session.db-wal");
    read_all();
  }
}

std::vector<std::string> seeds() {
  return {is_index + scene().index, is_log + scene().log, is_frame + scene().frame};
}

}  // namespace

FuzzTarget fuzz_target() {
  return {run, seeds};
}

}  // namespace mf::fuzz
