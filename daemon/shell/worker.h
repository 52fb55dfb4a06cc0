// A thread for what may take long, such as the disk: the loop has to feed motors meanwhile.
#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>

#include "base/result.h"

namespace bushd::daemon {

class Worker {
 public:
  // What is left to be done, in the thread of handle().
  using Completion = std::function<void()>;
  using Job = std::function<Completion()>;

  Worker() = default;
  // Waits for the jobs that were posted; what is left of them is not done any more.
  ~Worker();
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  Result<void> start();

  // Jobs are run one after the other, in the order in which they are posted.
  void post(Job job);
  // Posted and not yet handled.
  std::size_t waiting() const;

  // Readable while there is something to handle.
  int fd() const { return fd_; }
  // What is left of one job.
  void handle();

 private:
  void run();

  int fd_ = -1;
  mutable std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<Job> jobs_;  // guarded by mutex_, as all below
  std::deque<Completion> completions_;
  std::size_t waiting_ = 0;
  bool ending_ = false;
  std::thread thread_;
};

}  // namespace bushd::daemon
