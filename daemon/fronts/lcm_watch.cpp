#include "daemon/fronts/lcm_watch.h"

#include <utility>

namespace bushd::daemon {

void LcmWatch::step(std::int64_t now_us) {
  watch_messages();
  watch_others(now_us);
}

void LcmWatch::watch_messages() {
  const std::string& trouble = front_.trouble();
  if (std::exchange(mute_, !trouble.empty()) == !trouble.empty()) return;
  if (mute_) {
    log_(LogLevel::kError,
         "LCM does not take messages: " + trouble + "; clients there hear nothing");
  } else {
    log_(LogLevel::kInfo, "LCM takes messages again");
  }
}

void LcmWatch::watch_others(std::int64_t now_us) {
  const std::string channels = "channels " + prefix_ + "_...";
  if (std::exchange(heard_, front_.others_heard()) != front_.others_heard()) {
    if (!std::exchange(other_heard_us_, now_us)) {
      log_(LogLevel::kError, "another bushd, with a bus \"" + front_.other_bus() +
                                 "\", sends its state on " + channels +
                                 " too, so clients of LCM command neither: end one of them, or "
                                 "give it another prefix in [lcm]");
      publishing_.set_trouble("another bushd uses " + channels);
    }
  } else if (other_heard_us_ && now_us - *other_heard_us_ > kGoneAfterUs) {
    other_heard_us_.reset();
    log_(LogLevel::kInfo, "the other bushd on " + channels + " is not heard any more");
    publishing_.set_trouble("");
  }
}

}  // namespace bushd::daemon
