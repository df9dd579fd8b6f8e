// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <limits>
#include <optional>

namespace mf {

enum class ButtonEvent { start, stop };

struct ButtonTiming {
  std::chrono::milliseconds debounce{30};  // a contact counts once it has kept still for so long; 1 ms to 1 s
  std::chrono::milliseconds hold{1000};    // a press that stops is held for so long; longer than debounce, to 10 s

  // What is wrong with it, one line; empty: nothing.
  [[nodiscard]] const char* problem() const;
};

// What a push-button's contact means. A press starts a recording; only a long hold stops one, so that a knock can't.
//
// - A level counts once it has kept still for `debounce`; bounces in between neither start, stop nor break a hold.
// - A press that began while nothing was recorded is a start, and nothing else: held on, it doesn't stop what it began.
// - A press that began while recording is a stop once it was held for `hold`, and otherwise nothing.
// - A button that is down when it is first seen (stuck, or plugged in while pressed) says nothing before it was let go.
//
// It has no clock: the times are the caller's, nanoseconds of any clock that goes on. A time before the last one is
// taken as the last one.
class ButtonLogic {
 public:
  static constexpr std::int64_t never = std::numeric_limits<std::int64_t>::max();

  explicit ButtonLogic(const ButtonTiming& timing);

  // The contact is closed (pressed) or open from this time on.
  [[nodiscard]] std::optional<ButtonEvent> contact(std::int64_t time_ns, bool pressed);
  // Time has passed.
  [[nodiscard]] std::optional<ButtonEvent> advance(std::int64_t time_ns);
  // Unplugged: a press under way is void, and the next level seen is a first one.
  void unplugged();

  // After a start event it takes the rig as recording by itself; whoever ends a recording, cannot begin one, or begins
  // one by other means says so here.
  void set_recording(bool recording) { recording_ = recording; }

  // When advance() could next have something to say, if the contact stays as it is.
  [[nodiscard]] std::int64_t deadline_ns() const;

 private:
  enum class Press {
    none,      // the button is up
    ignored,   // down, and it means nothing more
    stopping,  // down, a stop if it is held
  };
  [[nodiscard]] std::optional<ButtonEvent> settle();

  std::int64_t debounce_ns_;
  std::int64_t hold_ns_;
  bool recording_ = false;
  bool seen_ = false;     // some level was seen since it was plugged in
  bool pressed_ = false;  // the contact as it is, bounces and all
  std::int64_t now_ns_ = std::numeric_limits<std::int64_t>::min();
  std::int64_t changed_ns_ = 0;      // when the contact last changed
  std::int64_t press_began_ns_ = 0;  // of the press under way
  Press press_ = Press::none;        // what is left when bounces are taken away
};

}  // namespace mf
