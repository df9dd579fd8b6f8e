// SPDX-License-Identifier: Apache-2.0
#include "host/cli/command.h"

int main(int argc, char** argv) {
  mf::CommandLine program("mirrorfield",
                          "Mirrorfield: captures the light of a real place with a camera and a hand-held mirror, and "
                          "lights virtual objects with it.",
                          MIRRORFIELD_VERSION);
  mf::add_import_command(program);
  mf::add_photometry_command(program);
  mf::add_calibrate_command(program);
  mf::add_resample_command(program);
  mf::add_plate_command(program);
  mf::add_probe_command(program);
  mf::add_render_command(program);
  mf::add_composite_command(program);
  mf::add_lumigraph_command(program);
  mf::add_process_command(program);
  mf::add_view_command(program);
  return program.run(argc, argv);
}
