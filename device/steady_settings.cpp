// SPDX-License-Identifier: Apache-2.0
#include "device/steady_settings.h"

#include "device/feature_rows.h"

namespace mf {

SteadySettings hold_steady(FeatureAccess& access) {
  static const std::vector<SwitchRow> rows{
      {{"ExposureAuto"}, {}, {"Off"}},           {{"GainAuto"}, {}, {"Off"}},
      {{"BlackLevelAuto"}, {}, {"Off"}},         {{"BalanceWhiteAuto"}, {}, {"Off"}},
      {{"GammaEnable", "GammaEnabled"}, {}, {}}, {{"LUTEnable"}, {}, {}},
      {{"pgrHDRModeEnabled"}, {}, {}},  // four exposures in turn
  };
  FeatureNotes notes(access);
  for (const SwitchRow& row : rows) {
    if (!find_feature(access, row.names)) continue;
    std::string entry;
    FeatureNotes before(access);
    if (before.read_switch(row, entry) != SwitchState::off) notes.turn(row, false);
    (void)notes.read_switch(row, entry);
  }
  return {std::move(notes.readings), std::move(notes.remarks)};
}

}  // namespace mf
