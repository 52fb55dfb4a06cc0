// Service procedures of LAMs (cclnk): a thread looks at the LAMs that have one, and calls it.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <thread>
#include <vector>

namespace bushd::esone {

class Links {
 public:
  using Procedure = void (*)();
  // Whether the LAM of this handle is raised. Called from the thread.
  using Test = std::function<bool(std::int32_t handle)>;

  explicit Links(Test is_raised) : is_raised_(std::move(is_raised)) {}
  Links(const Links&) = delete;
  Links& operator=(const Links&) = delete;
  ~Links();

  // When the LAM is raised the procedure is called, once until it is armed again. The one that was
  // linked before is not.
  void link(std::int32_t handle, Procedure procedure);
  // False: it has no procedure, here and below.
  bool arm(std::int32_t handle);
  // The procedure does not run when this returns, unless it is its caller.
  bool unlink(std::int32_t handle);

 private:
  struct Link {
    Procedure procedure = nullptr;
    bool armed = true;
  };

  void watch();
  void serve(std::int32_t handle, std::unique_lock<std::mutex>& lock);
  std::vector<std::int32_t> armed() const;

  const Test is_raised_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::map<std::int32_t, Link> links_;
  std::int32_t served_ = 0;  // its procedure runs; 0: none
  bool ends_ = false;
  std::thread thread_;  // since the first link
};

}  // namespace bushd::esone
