// The one place that uses LCM's client library. Everything else sees messages of bushd's types, a
// descriptor to wait for, and no exceptions but its own.
#pragma once

#include <cstdint>
#include <exception>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "base/result.h"

// LCM's own handle, so that its headers stay out of here.
typedef struct _lcm_t lcm_t;
typedef struct _lcm_recv_buf_t lcm_recv_buf_t;

namespace bushd::lcm {

// handle() and subscribe() belong to one thread; publish() may be called from any.
class Transport {
 public:
  // Messages that wait for handle(), per subscription unless it asks for more; LCM drops the newest
  // beyond. LCM's default of 30 is less than one snapshot of 512 motors.
  static constexpr int kQueueCapacity = 256;

  // `url`: "udpm://239.255.76.67:7667?ttl=0", or "memq://" for messages that stay within this
  // object (tests). Takes up to 10 s when the network is there but swallows multicast packets; that
  // is an error too. LCM starts a receiving thread here, which inherits the signal mask and the
  // scheduling policy: block signals that are to be taken from a descriptor before, become
  // real-time after.
  // The socket's receive buffer is enlarged (lcm/receive_buffer.h), unless the URL has its size:
  // `&recv_buf_size=4194304`.
  // With `channels` the kernel keeps everything else away, so that a flood on other channels is
  // none here; and with `unheard` what comes on these, such as what this process sends itself. Up
  // to 8 in all.
  static Result<std::unique_ptr<Transport>> open(const std::string& url,
                                                 const std::vector<std::string>& channels = {},
                                                 const std::vector<std::string>& unheard = {});
  ~Transport();
  Transport(const Transport&) = delete;
  Transport& operator=(const Transport&) = delete;

  // Readable (level-triggered) while messages wait.
  int fd() const { return fd_; }

  // Calls the handlers of the messages that wait, at most kQueueCapacity of them and about
  // `max_bytes`, counted with a little more for each, so that a flood cannot keep the caller here;
  // never blocks. An exception of a handler comes out here, after the
  // library was left in order. Not to be called from a handler.
  void handle(std::size_t max_bytes = SIZE_MAX);

  // `handler` is called from handle() for every payload on exactly this channel, whatever it is,
  // for as long as this object lives: there is no unsubscribing, which within a handler would
  // corrupt LCM's memory.
  using BytesHandler = std::function<void(std::span<const std::uint8_t>)>;
  Result<void> subscribe(const std::string& channel, BytesHandler handler,
                         int queue_capacity = kQueueCapacity);

  // Fails when the channel's name is too long, or when the network is gone.
  Result<void> publish(const std::string& channel, std::span<const std::uint8_t> bytes);

  // When the message that a handler is called for came to this machine, in microseconds since 1970.
  std::int64_t received_utime_us() const { return received_utime_us_; }

 private:
  struct Subscription {
    Transport* transport;
    BytesHandler handler;
  };

  Transport(lcm_t* lcm, int fd) : lcm_(lcm), fd_(fd) {}
  static void on_message(const lcm_recv_buf_t* buffer, const char* channel, void* subscription);

  lcm_t* lcm_;
  int fd_;
  std::vector<std::unique_ptr<Subscription>> subscriptions_;  // LCM holds pointers to them
  std::exception_ptr thrown_;
  std::size_t handled_bytes_ = 0;  // by this call of handle()
  std::int64_t received_utime_us_ = 0;
};

}  // namespace bushd::lcm
