// What the moving mark adds to the time from a request to its first frame: from the loop's decision
// to the answer that the mark is on the disk, through the thread that writes it. Prints the median,
// the 99th of a hundred and the longest, for one motor and for 32 that start together.
//
//     bushd_bench_marks [FOLDER]    on the disk of this folder (default: the working directory)
#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include "daemon/shell/worker.h"
#include "state/store.h"

namespace {

using Clock = std::chrono::steady_clock;
namespace state = bushd::state;

constexpr int kRuns = 1000;
constexpr int kMotors = 32;

std::string name(int motor) {
  return "m" + std::to_string(motor);
}

// In microseconds.
std::vector<double> measure(bushd::daemon::Worker& worker, state::Store& store, int motors,
                            std::uint64_t& motion) {
  std::vector<double> took;
  for (int i = 0; i < kRuns; ++i) {
    std::vector<state::Mark> marks;
    ++motion;
    for (int motor = 0; motor < motors; ++motor) marks.push_back({name(motor), motion});
    const auto began = Clock::now();
    bool done = false;
    worker.post([&store, &done, marks = std::move(marks)]() -> bushd::daemon::Worker::Completion {
      return [&done, result = store.mark(marks)] {
        if (!result) throw std::runtime_error(result.error().text());
        done = true;
      };
    });
    while (!done) {
      pollfd polled{.fd = worker.fd(), .events = POLLIN, .revents = 0};
      poll(&polled, 1, -1);
      worker.handle();
    }
    took.push_back(std::chrono::duration<double, std::micro>(Clock::now() - began).count());
  }
  std::sort(took.begin(), took.end());
  return took;
}

}  // namespace

int main(int argc, char** argv) {
  const std::filesystem::path folder = std::filesystem::path(argc > 1 ? argv[1] : ".") /
                                       ("bushd-bench-" + std::to_string(::getpid()));
  state::Opening opening{.folder = folder, .utime_us = 1, .random = 1};
  for (int motor = 0; motor < kMotors; ++motor) opening.motors.push_back(name(motor));
  std::filesystem::create_directory(folder);
  int code = 1;
  if (auto store = state::Store::open(state::real_disk(), opening); !store) {
    fmt::print(stderr, "{}\n", store.error().text());
  } else {
    bushd::daemon::Worker worker;
    std::uint64_t motion = 0;
    if (worker.start()) {
      for (const int motors : {1, kMotors}) {
        const auto took = measure(worker, *store, motors, motion);
        fmt::print(
            "marks of {:2} motors: {:5.0f} us (median), {:5.0f} us (99 %), {:5.0f} us (longest)\n",
            motors, took[kRuns / 2], took[kRuns * 99 / 100], took.back());
      }
      code = 0;
    }
  }
  std::filesystem::remove_all(folder);
  return code;
}
