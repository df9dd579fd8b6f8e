// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace mf {

// The processes that work on one thing together, as `mpirun -n N mirrorfield …` starts them; usually one. Each has a
// rank from 0; rank 0 writes and prints. All of them share the same things in the same order, from one thread at a
// time. When one dies, mpirun ends the others.
class Team {
 public:
  Team();  // alone
  Team(Team&&) noexcept;
  Team& operator=(Team&&) noexcept;
  ~Team();

  // The team that mpirun (Open MPI) started this process in; alone, and at no cost, when it was not.
  [[nodiscard]] static Team join();

  [[nodiscard]] std::size_t rank() const;
  [[nodiscard]] std::size_t size() const;
  // Of tasks dealt out beforehand, whether this one is ours.
  [[nodiscard]] bool has(std::size_t task) const { return task % size() == rank(); }

  // What `from` has in `bytes` everyone has afterwards. All give as many.
  struct Share {
    std::span<std::byte> bytes;
    std::size_t from = 0;
  };
  // Many at once: the ranks wait for each other at the end only.
  void share(std::span<const Share>) const;

  // From any rank to rank 0, which receives what came first, or nothing when nothing is there yet and it does not want
  // to wait. send() returns at once, unless much is under way already.
  void send(std::string message);
  enum class Wait { no, yes };
  [[nodiscard]] std::optional<std::string> receive(Wait);

 private:
  friend class Turns;
  struct Link;
  std::unique_ptr<Link> link_;  // nothing when alone
};

// Tasks dealt on demand: whoever is free takes the next one, so that no rank waits for a slower one's share. It begins
// and ends for all ranks together. take() may be called while another thread sends or receives.
class Turns {
 public:
  explicit Turns(Team&);
  Turns(const Turns&) = delete;
  Turns& operator=(const Turns&) = delete;
  ~Turns();

  // 0, 1, 2 …: each number once, to one of the ranks.
  [[nodiscard]] std::size_t take();

 private:
  struct Counter;
  Team::Link* link_;
  std::unique_ptr<Counter> counter_;
};

// Rows of a picture that were made in turn, row y by rank y mod size: afterwards everyone has all.
template <typename Image>
void share_rows(const Team& team, Image& image) {
  std::vector<Team::Share> rows;
  for (int y = 0; y < image.height; ++y)
    rows.push_back({std::as_writable_bytes(image.row(y)), static_cast<std::size_t>(y) % team.size()});
  team.share(rows);
}

}  // namespace mf
