// SPDX-License-Identifier: Apache-2.0
// Every file of a session is cut short and has bits flipped: what is intact is read, what is not is told of by name,
// and nothing ends the program.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <random>
#include <vector>

#include "common/error.h"
#include "common/file_bytes.h"
#include "common/session.h"
#include "tests/device/scripted_camera.h"
#include "tests/support/full_counts.h"
#include "tests/support/temporary_folder.h"

namespace mf {
namespace {

namespace fs = std::filesystem;

constexpr int frame_count = 12;

// Finished, or as a kill leaves it: with the rows of the last commits in session.db-wal.
void write_session(const fs::path& folder, bool finished) {
  SessionHeader header = test::header_with_target();
  const CameraDescription camera = test::scripted_description();
  header.format = camera.format;
  header.width = camera.width;
  header.height = camera.height;
  const fs::path written = finished ? folder : fs::path(folder.string() + ".writing");
  SessionWriter writer(written, header, {SessionWriter::Durability::batches});
  for (int i = 0; i < frame_count; ++i) {
    Frame picture;
    picture.info.name = fmt::format("{:06}", i);
    picture.info.exposure_s = 0.004;
    picture.info.time_s = 0.02 * i;
    picture.pixels = test::scripted_codes(i + 1);
    EncodedFrame frame = writer.encode(picture);
    frame.arrival = FrameArrival{i + 1, 1000 * i, 2000 * i, 3000 * i};
    writer.append(frame);
    if (i % 3 == 2) writer.commit();
  }
  writer.append(FrameGap{5, 2, 77, "skipped"});
  if (finished) return writer.finish();
  writer.commit();
  fs::copy(written, folder, fs::copy_options::recursive);
}

void put(const fs::path& file, const std::string& bytes) {
  std::ofstream(file, std::ios::binary | std::ios::trunc)
      .write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

struct Found {
  bool opened = false;
  int intact = 0, refused = 0;
  bool changed = false;  // a row tells something else than was written, and nobody has noticed
  std::int64_t without_row = 0;
  bool told = false;  // the reader's damage() is not empty
};

bool as_written(const SessionFrame& f) {
  const auto i = static_cast<int>(f.id);
  const bool info = f.info.name == fmt::format("{:06}", i) && f.info.role == FrameRole::mirror &&
                    f.info.exposure_s == 0.004 && f.info.nd_density == 0 && f.info.time_s == 0.02 * i;
  return info && f.arrival && f.arrival->device_frame == i + 1 && f.arrival->device_ns == 1000 * i &&
         f.arrival->monotonic_ns == 2000 * i && f.arrival->realtime_ns == 3000 * i;
}

// Nothing but InputError may be thrown, and it names a file of the session.
Found look(const fs::path& folder) {
  Found found;
  try {
    const SessionReader reader(folder);
    found.opened = true;
    for (const SessionFrame& frame : reader.frames()) {
      try {
        found.changed |= !as_written(frame) && !frame.damaged;
        EXPECT_EQ(std::get<ImageU16>(reader.read_frame(frame).pixels).data, test::scripted_codes(frame.id + 1).data);
        ++found.intact;
      } catch (const InputError& e) {
        EXPECT_NE(std::string(e.what()).find(frame.damaged ? "session.db: frames[" : frame.file), std::string::npos)
            << e.what();
        ++found.refused;
      }
    }
    found.without_row = reader.frames_without_row();
    found.told = !reader.damage().empty();
    found.changed |= reader.gaps().size() != 1 && !found.told;
    found.changed |= reader.gaps().size() > 1 || (reader.gaps().size() == 1 && reader.gaps()[0].missing != 2);
  } catch (const InputError& e) {
    EXPECT_NE(std::string(e.what()).find("session.db"), std::string::npos) << e.what();
  }
  return found;
}

class Damage : public testing::TestWithParam<bool> {
 protected:
  void SetUp() override {
    write_session(session(), GetParam());
    for (const auto& entry : fs::recursive_directory_iterator(session()))
      if (entry.is_regular_file()) files_.push_back(entry.path());
  }
  [[nodiscard]] fs::path session() const { return folder_ / "s"; }
  [[nodiscard]] static bool is_frame(const fs::path& file) { return file.extension() == ".tif"; }

  // Damages each file in turn, `times` times; `change` makes other bytes of its own.
  template <typename Change>
  void damage(int times, const Change& change);

  test::TemporaryFolder folder_;
  std::vector<fs::path> files_;
  int index_damages_ = 0, index_errors_ = 0, rows_lost_ = 0, rows_changed_ = 0;
};

template <typename Change>
void Damage::damage(int times, const Change& change) {
  for (const fs::path& file : files_) {
    const std::string whole = read_file_bytes(file);
    for (int i = 0; i < times; ++i) {
      // The reader opens a database with a log for writing, and might mend what it finds: a new copy each time.
      const fs::path copy = folder_ / "copy";
      fs::remove_all(copy);
      for (const fs::path& from : files_) {
        const fs::path to = copy / from.lexically_relative(session());
        fs::create_directories(to.parent_path());
        if (from != file) is_frame(from) ? fs::create_hard_link(from, to) : fs::copy(from, to);
      }
      put(copy / file.lexically_relative(session()), change(whole));
      const Found found = look(copy);
      if (is_frame(file)) {
        EXPECT_EQ(found.intact, frame_count - 1) << file;
        EXPECT_EQ(found.refused, 1) << file << ": damage is not noticed";
        EXPECT_FALSE(found.changed);
        continue;
      }
      ++index_damages_;
      index_errors_ += found.opened ? 0 : 1;
      const bool lost = found.opened && found.intact + found.refused < frame_count;
      rows_lost_ += lost ? 1 : 0;
      EXPECT_TRUE(!lost || found.told) << file << ": rows are lost unsaid";
      EXPECT_TRUE(!found.opened || found.without_row == frame_count - found.intact - found.refused);
      rows_changed_ += found.opened && found.changed ? 1 : 0;
    }
  }
}

TEST_P(Damage, TheWholeSessionIsRead) {
  const Found found = look(session());
  EXPECT_EQ(found.intact, frame_count);
  EXPECT_FALSE(found.changed || found.told);
}

TEST_P(Damage, CutShort) {
  std::mt19937 random(1);
  damage(test::repetitions(4, 200), [&](const std::string& whole) {
    return whole.substr(0, std::uniform_int_distribution<std::size_t>(0, whole.size() - 1)(random));
  });
  fmt::print("cut short: index {} times, {} errors, {} lost rows, {} changed rows\n", index_damages_, index_errors_,
             rows_lost_, rows_changed_);
  EXPECT_EQ(rows_changed_, 0);
}

TEST_P(Damage, BitsFlipped) {
  std::mt19937 random(2);
  damage(test::repetitions(12, 500), [&](std::string bytes) {
    const std::size_t at = std::uniform_int_distribution<std::size_t>(0, bytes.size() - 1)(random);
    bytes[at] = static_cast<char>(bytes[at] ^ 1 << std::uniform_int_distribution<int>(0, 7)(random));
    return bytes;
  });
  fmt::print("bits flipped: index {} times, {} errors, {} lost rows, {} changed rows\n", index_damages_, index_errors_,
             rows_lost_, rows_changed_);
  EXPECT_EQ(rows_changed_, 0);
}

INSTANTIATE_TEST_SUITE_P(Session, Damage, testing::Bool(),
                         [](const auto& tested) { return tested.param ? "Finished" : "WithItsLog"; });

}  // namespace
}  // namespace mf
