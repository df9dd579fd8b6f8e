// SPDX-License-Identifier: Apache-2.0
// The desk's light and the pictures made with it, against path-traced truth. Prints every figure.
#include <iostream>

#include "host/io/exr.h"
#include "tests/host/desk/desk_run.h"
#include "tests/host/desk/desk_truth.h"
#include "tests/support/run_command.h"
#include "tests/support/temporary_folder.h"

namespace mf::test {
namespace {

const char* const mirrorfield = MF_BINARY_DIR "/mirrorfield";

class DeskLight : public DeskRun {
 protected:
  TemporaryFolder out_;
};

TEST_F(DeskLight, ProbeIsRight) {
  const std::string file = out_ / "probe.exr";
  ASSERT_EQ(run_command(
                {mirrorfield, "probe", light_field().string(), "--at", "0", "0", "0.1", "--for", "blender", "-o", file})
                .exit_code,
            0);
  const ProbeError error = probe_error(read_exr(file), read_exr(desk_folder() / "truth" / "probe_0_0_0.1.exr"));
  std::cout << "probe: " << error.median_abs_stop << " stop, irradiance " << error.irradiance_ratio
            << " of truth, lamp off by " << error.lamp_deg << " deg\n";
  EXPECT_LE(error.median_abs_stop, 0.25);
  EXPECT_NEAR(error.irradiance_ratio, 1, 0.15);
  EXPECT_LE(error.lamp_deg, 1);
}

TEST_F(DeskLight, TheLampIsFoundInSpace) {
  const double error_m = lamp_error_m(read_light_field(light_field()));
  std::cout << "lamp: " << 1000 * error_m << " mm from its place\n";
  EXPECT_LE(error_m, 0.03);
}

TEST_F(DeskLight, TheTableCarriesTheLeavesShadows) {
  const TableError error = table_error(read_light_field(light_field()));
  std::cout << "table: correlation " << error.correlation << ", relative RMS " << error.relative_rms << ", mean "
            << error.mean_ratio << " of truth\n";
  EXPECT_GE(error.correlation, 0.75);
  EXPECT_LE(error.relative_rms, 0.3);
  EXPECT_NEAR(error.mean_ratio, 1, 0.15);
}

TEST_F(DeskLight, CompositesAreRight) {
  const std::filesystem::path truth = desk_folder() / "truth";
  for (const std::string view : {"0", "1"}) {
    const std::string file = out_ / "composite.exr";
    const std::filesystem::path plate = truth / ("plate" + view + ".exr");
    ASSERT_EQ(run_command({mirrorfield, "composite", light_field().string(), (truth / "suzanne.obj").string(),
                           "--plate", plate.string(), "--cameras", (truth / "views.json").string(), "--view", view,
                           "--albedo", "0.7", "-o", file})
                  .exit_code,
              0);
    const ImageF expected = read_exr(truth / ("suzanne" + view + ".exr"));
    const double psnr = composite_psnr(read_exr(file), expected, read_exr(plate));
    std::cout << "composite, view " << view << ": " << psnr << " dB; bare plate "
              << composite_psnr(read_exr(plate), expected, read_exr(plate)) << " dB\n";
    EXPECT_GE(psnr, 24);
  }
}

}  // namespace
}  // namespace mf::test
