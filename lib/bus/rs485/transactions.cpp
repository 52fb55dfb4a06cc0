#include "bus/rs485/transactions.h"

#include <algorithm>
#include <utility>

namespace bushd::link {

void Transactions::reset() {
  receiver_ = {};
  open_.reset();
  expired_ = {};
  patience_us_ = kMaxPatienceUs;
}

void Transactions::ask(std::int64_t now_us, const Request& request) {
  const std::uint8_t sequence =
      writer_.send(now_us, request.address, request.type, request.payload);
  const std::int64_t end_us =
      writer_.free_us() + writer_.line_us(request.reply_payload + BUSHD_FRAME_OVERHEAD + 1);
  const std::int64_t quiet_us = end_us + request.reply_windows_us;
  open_ = Open{.type = request.type,
               .sequence = sequence,
               .awaited = {{.mcu = request.mcu,
                            .address = request.address,
                            .longest_us = end_us,
                            .longest = request.reply_payload}},
               .sent_us = writer_.free_us(),
               .quiet_us = quiet_us,
               .timeout_us = quiet_us + patience_us_,
               .several = request.reply_windows > 1};
}

void Transactions::ask_all(std::int64_t now_us, std::uint8_t type,
                           std::span<const std::uint8_t> payload,
                           std::span<const ReplyWindow> windows, std::int64_t late_us) {
  const std::uint8_t sequence = writer_.send(now_us, kBroadcast, type, payload);
  const std::int64_t sent_us = writer_.free_us();
  const std::int64_t quiet_us = sent_us + windows.back().end_us + late_us;
  open_ = Open{.type = type,
               .sequence = sequence,
               .awaited = {},
               .sent_us = sent_us,
               .quiet_us = quiet_us,
               .timeout_us = quiet_us + patience_us_,
               .several = false};
  for (const ReplyWindow& window : windows) {
    open_->awaited.push_back({.mcu = window.mcu,
                              .address = window.address,
                              .longest_us = sent_us + window.end_us,
                              .longest = window.payload});
  }
  if (windows.size() > 1) {
    open_->last_answer_us = expected_of(open_->awaited.back(), bushd_report_size(0, 0));
  }
}

std::size_t Transactions::longest_answers() const {
  std::size_t bytes = 0;
  for (const Awaited& awaited : open_->awaited) {
    bytes += awaited.longest + BUSHD_FRAME_OVERHEAD + 1;
  }
  return bytes;
}

void Transactions::receive(std::int64_t now_us, std::span<const std::uint8_t> bytes) {
  for (const std::uint8_t byte : bytes) {
    bushd_frame frame;
    switch (bushd_receive_byte(&receiver_, byte, &frame)) {
      case BUSHD_RECEIVE_MORE:
        break;
      case BUSHD_RECEIVE_FRAME:
        handle_frame(now_us, frame);
        break;
      case BUSHD_RECEIVE_BAD_CRC:
      case BUSHD_RECEIVE_BAD_LENGTH:
        ++health_.crc_errors;
        break;
    }
  }
}

void Transactions::handle_frame(std::int64_t now_us, const bushd_frame& frame) {
  if ((frame.type & BUSHD_TYPE_REPLY) == 0) {
    listener_.overheard(now_us, frame);
    return;
  }
  Awaited* const from = awaited_from(frame);
  if (from == nullptr) {
    ++health_.stray_frames;
    if (take_if_expired(frame)) be_more_patient();
    return;
  }
  from->answered = true;
  const std::int64_t expected_us = expected_of(*from, frame.payload_size);
  note_latency(now_us, *from, expected_us);
  const McuIndex mcu = from->mcu;
  const Answer answer = {.mcu = mcu,
                         .type = open_->type,
                         .payload = {frame.payload, frame.payload_size},
                         .line_us = expected_us - open_->sent_us,
                         .in_time = now_us <= open_->timeout_us};
  if (!listener_.answered(now_us, answer)) ++health_.crc_errors;
  // Answers come in the order of their windows: after the last one nobody is waited for.
  if (open_ && !open_->several && mcu == open_->awaited.back().mcu) finish(now_us);
}

// The end of an answer with so many bytes, if nothing but the line takes time. It begins where the
// longest one would.
std::int64_t Transactions::expected_of(const Awaited& from, std::size_t payload) const {
  return from.longest_us - writer_.line_us(from.longest) +
         writer_.line_us(std::min(from.longest, payload));
}

Transactions::Awaited* Transactions::awaited_from(const bushd_frame& frame) {
  const bool fits =
      open_ && frame.sequence == open_->sequence && frame.type == (open_->type | BUSHD_TYPE_REPLY);
  if (!fits) return nullptr;
  const auto found = std::find_if(
      open_->awaited.begin(), open_->awaited.end(),
      [&](const Awaited& awaited) { return awaited.address == McuAddress{frame.address}; });
  if (found == open_->awaited.end() || (found->answered && !open_->several)) return nullptr;
  return &*found;
}

// That of another master may have the same type and sequence number: then less is lost than with
// answers that are never awaited.
bool Transactions::take_if_expired(const bushd_frame& frame) {
  const auto found = std::ranges::find_if(expired_, [&](const std::optional<Expired>& request) {
    return request && frame.sequence == request->sequence &&
           frame.type == (request->type | BUSHD_TYPE_REPLY);
  });
  if (found == expired_.end()) return false;
  found->reset();
  return true;
}

void Transactions::be_more_patient() {
  patience_us_ = std::min(2 * patience_us_, kMaxPatienceUs);
}

// In which of several windows an answer came is not known here. And one that is read when the last
// may be there has perhaps been left unread until then.
void Transactions::note_latency(std::int64_t now_us, const Awaited& from,
                                std::int64_t expected_us) {
  const bool left_unread = now_us >= open_->last_answer_us && &from != &open_->awaited.back();
  if (open_->several || left_unread) return;
  const std::int64_t latency_us = std::max<std::int64_t>(now_us - expected_us, 0);
  health_.latency.add(latency_us);
  patience_us_ = std::clamp(std::max(4 * latency_us, patience_us_ - patience_us_ / 8),
                            kMinPatienceUs, kMaxPatienceUs);
}

void Transactions::expire(std::int64_t now_us) {
  if (open_ && now_us >= open_->timeout_us) give_up(now_us);
}

void Transactions::give_up(std::int64_t now_us) {
  std::ranges::rotate(expired_, expired_.begin() + 1);
  expired_.back() = Expired{.type = open_->type, .sequence = open_->sequence};
  finish(now_us);
}

void Transactions::finish(std::int64_t now_us) {
  const Open over = *std::exchange(open_, std::nullopt);
  for (const Awaited& awaited : over.awaited) {
    if (awaited.answered || !listener_.unanswered(now_us, awaited.mcu, over.type)) continue;
    be_more_patient();
  }
  listener_.ended(now_us, over.awaited.front().mcu, over.type);
}

}  // namespace bushd::link
