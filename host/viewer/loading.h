// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <functional>
#include <future>
#include <mutex>
#include <string>

#include "common/progress.h"
#include "host/viewer/window.h"

namespace mf {

// Work in a thread of its own, so that a window lives meanwhile. The work leaves its result where its caller looks for
// it once it has ended, and hands the progress it is given on to what takes long: there it is also called off.
class Loading {
 public:
  using Work = std::function<void(const Progress&)>;
  explicit Loading(Work);  // begins at once
  Loading(const Loading&) = delete;
  Loading& operator=(const Loading&) = delete;
  ~Loading();  // calls it off, and waits until it has noticed

  // Waits so long at most; throws what the work threw.
  [[nodiscard]] bool ends_within(std::chrono::milliseconds);

  // Calls it off and waits until it has noticed. Throws what the work threw for reasons of its own.
  void call_off();

  // "aligning photos, 40 %"; empty before the work tells anything.
  [[nodiscard]] std::string stage() const;

 private:
  void report(std::string_view stage, double fraction);

  mutable std::mutex mutex_;  // for the next two
  std::string stage_;
  bool called_off_ = false;
  std::future<void> future_;  // last: its thread uses the others
};

// Says in the window what is loaded and how far it is, until that has ended. False: the window was closed before. What
// the work throws (InputError) is shown in the window until that is closed, and then thrown.
[[nodiscard]] bool show_loading(Window&, Loading&, const std::string& what);

}  // namespace mf
