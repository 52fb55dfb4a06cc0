// A thread that writes what others have to say: lines for a terminal or the journal, or for a file.
// Any of these may take none for any time (Ctrl-S, a frozen ssh, a hung disk), and whoever says
// them has motors to feed. So they wait in a queue of bounded length; what finds no room there is
// dropped and counted, and the count is told as soon as there is room again.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>

namespace bushd::daemon {

class WriteThread {
 public:
  using Write = std::function<void()>;
  // Tells how many were dropped; called in the thread, once it has written all that waited.
  using TellDropped = std::function<void(std::uint64_t dropped)>;
  struct Limits {
    std::size_t lines;
    std::size_t bytes;
    std::chrono::milliseconds end;  // how long its end waits for what is still to be written
  };

  WriteThread(Limits limits, TellDropped tell_dropped);
  // Ends it: a thread that cannot write is left to itself, with all that its writes hold.
  ~WriteThread();
  WriteThread(const WriteThread&) = delete;
  WriteThread& operator=(const WriteThread&) = delete;

  // In the order of these calls; from any thread. Waits for nothing. `bytes`: of the line.
  void post(std::size_t bytes, Write write);
  // No more is posted. Returns whether all has been written, within Limits::end.
  bool end();

 private:
  struct State;
  static void run(State& state);

  std::shared_ptr<State> state_;  // the thread's too
};

}  // namespace bushd::daemon
