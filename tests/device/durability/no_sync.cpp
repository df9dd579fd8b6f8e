// SPDX-License-Identifier: Apache-2.0
// A library to preload: a disk that only says that it has synced. The control run of the power-cut test, which must
// lose data with it, or the test shows nothing.
extern "C" {
int fsync(int /*descriptor*/) {
  return 0;
}
int fdatasync(int /*descriptor*/) {
  return 0;
}
}
