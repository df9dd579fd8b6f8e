// SPDX-License-Identifier: Apache-2.0
#include "device/ptp.h"

#include "device/feature_rows.h"

namespace mf {

namespace {

struct PtpRow {
  SwitchRow enable;
  FeatureNames latch;  // a command: takes the values that are read next
  FeatureNames status;
  FeatureRow offset_ns;
};

const std::vector<PtpRow>& ptp_rows() {
  static const std::vector<PtpRow> rows{
      {{{"PtpEnable"}, {}, {}}, {"PtpDataSetLatch"}, {"PtpStatus"}, {{"PtpOffsetFromMaster"}}},
      {{{"GevIEEE1588"}, {}, {}},
       {"GevIEEE1588DataSetLatch"},
       {"GevIEEE1588StatusLatched", "GevIEEE1588Status"},
       {{"GevIEEE1588OffsetFromMaster"}}},
      {{{"PtpMode"}, {"Slave", "Auto", "Master"}, {"Off"}}, {}, {"PtpStatus"}, {}},
  };
  return rows;
}

const PtpRow* ptp_row_of(const FeatureAccess& access) {
  for (const PtpRow& row : ptp_rows())
    if (find_feature(access, row.enable.names)) return &row;
  return nullptr;
}

}  // namespace

PtpReport set_ptp(FeatureAccess& access, bool enabled) {
  const PtpRow* row = ptp_row_of(access);
  if (row == nullptr) return {};
  FeatureNotes notes(access);
  notes.turn(row->enable, enabled);
  PtpReport report = read_ptp(access);
  report.remarks.insert(report.remarks.begin(), notes.remarks.begin(), notes.remarks.end());
  return report;
}

PtpReport read_ptp(FeatureAccess& access) {
  const PtpRow* row = ptp_row_of(access);
  if (row == nullptr) return {};
  PtpReport report;
  report.available = true;
  FeatureNotes notes(access);
  std::string entry;
  report.enabled = notes.read_switch(row->enable, entry) == SwitchState::on;
  if (find_feature(access, row->latch)) {
    FeatureNotes unnoted(access);  // a command has no value to read back
    (void)unnoted.write({row->latch}, 1);
  }
  report.status = notes.read_choice(row->status).value_or("");
  report.offset_ns = notes.read(row->offset_ns);
  report.readings = std::move(notes.readings);
  report.remarks = std::move(notes.remarks);
  return report;
}

}  // namespace mf
