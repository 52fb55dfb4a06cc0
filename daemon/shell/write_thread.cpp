#include "daemon/shell/write_thread.h"

#include <pthread.h>

#include <condition_variable>
#include <deque>
#include <mutex>
#include <thread>
#include <utility>

namespace bushd::daemon {

struct WriteThread::State {
  struct Line {
    std::size_t bytes;
    Write write;
  };
  State(Limits its_limits, TellDropped tell) : limits(its_limits), tell_dropped(std::move(tell)) {}

  const Limits limits;
  TellDropped tell_dropped;

  std::mutex mutex;  // guards all below
  std::condition_variable wake;
  std::condition_variable over;
  std::deque<Line> lines;
  std::size_t bytes = 0;
  std::uint64_t dropped = 0;
  bool ending = false;
  bool ended = false;
};

WriteThread::WriteThread(Limits limits, TellDropped tell_dropped)
    : state_(std::make_shared<State>(limits, std::move(tell_dropped))) {
  std::thread([state = state_] { run(*state); }).detach();
}

WriteThread::~WriteThread() {
  end();
}

void WriteThread::post(std::size_t bytes, Write write) {
  {
    const std::lock_guard lock(state_->mutex);
    if (state_->lines.size() >= state_->limits.lines ||
        state_->bytes + bytes > state_->limits.bytes) {
      ++state_->dropped;
      return;
    }
    state_->bytes += bytes;
    state_->lines.push_back({bytes, std::move(write)});
  }
  state_->wake.notify_one();
}

bool WriteThread::end() {
  std::unique_lock lock(state_->mutex);
  state_->ending = true;
  state_->wake.notify_one();
  return state_->over.wait_for(lock, state_->limits.end, [this] { return state_->ended; });
}

void WriteThread::run(State& state) {
  pthread_setname_np(pthread_self(), "lines");
  std::unique_lock lock(state.mutex);
  while (true) {
    state.wake.wait(lock,
                    [&] { return state.ending || !state.lines.empty() || state.dropped != 0; });
    if (state.lines.empty() && state.dropped == 0) break;
    Write write;
    if (state.lines.empty()) {
      write = [&state, dropped = std::exchange(state.dropped, 0)] { state.tell_dropped(dropped); };
    } else {
      state.bytes -= state.lines.front().bytes;
      write = std::move(state.lines.front().write);
      state.lines.pop_front();
    }
    lock.unlock();
    write();
    write = nullptr;
    lock.lock();
  }
  // What they hold ends here too: a file that is closed may wait for its disk.
  lock.unlock();
  state.tell_dropped = nullptr;
  lock.lock();
  state.ended = true;
  state.over.notify_all();
}

}  // namespace bushd::daemon
