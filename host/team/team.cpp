// SPDX-License-Identifier: Apache-2.0
#include "host/team/team.h"

#include <mpi.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <deque>
#include <mutex>
#include <vector>

#include "common/check.h"

namespace mf {

namespace {

constexpr int tile_tag = 1;
constexpr std::size_t most_under_way = 64;                    // messages of one rank: they wait in memory
constexpr std::size_t largest_share = std::size_t{1} << 30U;  // MPI counts in ints

void must(int code) {
  check(code == MPI_SUCCESS, "MPI works");  // by default it ends the process itself, with its own words
}

struct Sending {
  std::string message;
  MPI_Request request = MPI_REQUEST_NULL;
};

}  // namespace

struct Team::Link {
  std::size_t rank = 0;
  std::size_t size = 1;
  std::mutex calls;               // MPI is called from one thread at a time
  std::deque<Sending> under_way;  // a deque: messages stay where they are

  Link() {
    int provided = 0, number = 0;
    must(MPI_Init_thread(nullptr, nullptr, MPI_THREAD_SERIALIZED, &provided));
    check(provided >= MPI_THREAD_SERIALIZED, "MPI can be called from several threads in turn");
    must(MPI_Comm_rank(MPI_COMM_WORLD, &number));
    rank = static_cast<std::size_t>(number);
    must(MPI_Comm_size(MPI_COMM_WORLD, &number));
    size = static_cast<std::size_t>(number);
  }
  Link(const Link&) = delete;
  Link& operator=(const Link&) = delete;
  // After an error the others may wait for us for ever: then without farewell, and mpirun ends them.
  ~Link() {
    if (std::uncaught_exceptions() > 0) return;
    while (!under_way.empty()) finish_first();
    MPI_Finalize();
  }
  void finish_first() {
    must(MPI_Wait(&under_way.front().request, MPI_STATUS_IGNORE));
    under_way.pop_front();
  }
};

Team::Team() = default;
Team::Team(Team&&) noexcept = default;
Team& Team::operator=(Team&&) noexcept = default;
Team::~Team() = default;

Team Team::join() {
  Team team;
  const char* size = std::getenv("OMPI_COMM_WORLD_SIZE");
  if (size != nullptr && std::string(size) != "1") team.link_ = std::make_unique<Link>();
  return team;
}

std::size_t Team::rank() const {
  return link_ ? link_->rank : 0;
}
std::size_t Team::size() const {
  return link_ ? link_->size : 1;
}

void Team::share(std::span<const Share> shares) const {
  if (!link_) return;
  std::vector<MPI_Request> requests;
  for (const Share& share : shares)
    for (std::size_t begin = 0; begin < share.bytes.size(); begin += largest_share)
      must(MPI_Ibcast(share.bytes.data() + begin, static_cast<int>(std::min(largest_share, share.bytes.size() - begin)),
                      MPI_BYTE, static_cast<int>(share.from), MPI_COMM_WORLD, &requests.emplace_back()));
  must(MPI_Waitall(static_cast<int>(requests.size()), requests.data(), MPI_STATUSES_IGNORE));
}

void Team::send(std::string message) {
  check(link_ != nullptr && link_->rank > 0, "only other ranks send to rank 0");
  const std::lock_guard lock(link_->calls);
  if (link_->under_way.size() >= most_under_way) link_->finish_first();
  Sending& sending = link_->under_way.emplace_back();
  sending.message = std::move(message);
  must(MPI_Isend(sending.message.data(), static_cast<int>(sending.message.size()), MPI_BYTE, 0, tile_tag,
                 MPI_COMM_WORLD, &sending.request));
}

std::optional<std::string> Team::receive(Wait wait) {
  check(link_ != nullptr && link_->rank == 0, "only rank 0 receives");
  const std::lock_guard lock(link_->calls);
  MPI_Status status;
  int there = 1;
  if (wait == Wait::yes)
    must(MPI_Probe(MPI_ANY_SOURCE, tile_tag, MPI_COMM_WORLD, &status));
  else
    must(MPI_Iprobe(MPI_ANY_SOURCE, tile_tag, MPI_COMM_WORLD, &there, &status));
  if (there == 0) return std::nullopt;
  int size = 0;
  must(MPI_Get_count(&status, MPI_BYTE, &size));
  std::string message(static_cast<std::size_t>(size), '\0');
  must(MPI_Recv(message.data(), size, MPI_BYTE, status.MPI_SOURCE, tile_tag, MPI_COMM_WORLD, MPI_STATUS_IGNORE));
  return message;
}

// ---- turns ----

// A number that rank 0 keeps and every rank adds to (MPI-3 one-sided: no rank has to answer).
struct Turns::Counter {
  std::uint64_t* number = nullptr;  // rank 0's
  MPI_Win window = MPI_WIN_NULL;
  std::size_t alone = 0;
};

Turns::Turns(Team& team) : link_(team.link_.get()), counter_(new Counter) {
  if (link_ == nullptr) return;
  const MPI_Aint bytes = link_->rank == 0 ? sizeof *counter_->number : 0;
  must(MPI_Win_allocate(bytes, sizeof *counter_->number, MPI_INFO_NULL, MPI_COMM_WORLD, &counter_->number,
                        &counter_->window));
  if (link_->rank == 0) *counter_->number = 0;
  must(MPI_Barrier(MPI_COMM_WORLD));  // nobody takes a turn before there is a first one
  must(MPI_Win_lock_all(0, counter_->window));
}

Turns::~Turns() {
  if (link_ == nullptr || std::uncaught_exceptions() > 0) return;  // the others may never come: as Link does
  MPI_Win_unlock_all(counter_->window);
  MPI_Win_free(&counter_->window);
}

std::size_t Turns::take() {
  if (link_ == nullptr) return counter_->alone++;
  const std::lock_guard lock(link_->calls);
  const std::uint64_t one = 1;
  std::uint64_t taken = 0;
  must(MPI_Fetch_and_op(&one, &taken, MPI_UINT64_T, 0, 0, MPI_SUM, counter_->window));
  must(MPI_Win_flush(0, counter_->window));
  return taken;
}

}  // namespace mf
