// SPDX-License-Identifier: Apache-2.0
// fuzz_NAME [CORPUS FOLDER] [libFuzzer's options]: the target's seeds are put into the corpus folder first.
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <string>

#include "tests/fuzz/fuzz_target.h"

extern "C" int LLVMFuzzerInitialize(int* count, char*** arguments) {
  if (*count < 2 || (*arguments)[1][0] == '-') return 0;
  const std::filesystem::path corpus((*arguments)[1]);
  if (std::filesystem::exists(corpus) && !std::filesystem::is_directory(corpus)) return 0;  // one input to run
  std::filesystem::create_directories(corpus);
  int number = 0;
  for (const std::string& seed : mf::fuzz::fuzz_target().seeds())
    std::ofstream(corpus / ("seed" + std::to_string(number++)), std::ios::binary) << seed;
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  static const mf::fuzz::FuzzTarget target = mf::fuzz::fuzz_target();
  target.run({bytes, size});
  return 0;
}
