#include "sim/board_line.h"

#include <algorithm>

namespace bushd::sim {

void BoardLine::send(TimeNs now_ns, std::span<const std::uint8_t> bytes) {
  for (const std::uint8_t byte : bytes) {
    const TimeNs free_ns = to_board_.empty() ? now_ns : std::max(now_ns, to_board_.back().at_ns);
    to_board_.push_back({free_ns + byte_ns_, byte});
  }
}

std::vector<std::uint8_t> BoardLine::advance(TimeNs now_ns) {
  while (true) {
    const TimeNs byte_ns = to_board_.empty() ? CommutatorBoard::kNever : to_board_.front().at_ns;
    const TimeNs next_ns = std::min(byte_ns, board.next_event_ns());
    if (next_ns > now_ns) break;
    run_board(next_ns);
    if (byte_ns != next_ns) continue;
    const std::uint8_t byte = to_board_.front().value;
    to_board_.pop_front();
    board.receive(next_ns, byte);
  }
  now_ns_ = now_ns;
  std::vector<std::uint8_t> arrived;
  while (!from_board_.empty() && from_board_.front().at_ns <= now_ns) {
    arrived.push_back(from_board_.front().value);
    from_board_.pop_front();
  }
  return arrived;
}

void BoardLine::run_board(TimeNs now_ns) {
  board.advance(now_ns);
  for (const std::uint8_t answer : board.take_answers()) {
    from_board_.push_back({now_ns + byte_ns_, answer});
  }
}

TimeNs BoardLine::next_event_ns() const {
  TimeNs next_ns = board.next_event_ns();
  if (!to_board_.empty()) next_ns = std::min(next_ns, to_board_.front().at_ns);
  if (!from_board_.empty()) next_ns = std::min(next_ns, from_board_.front().at_ns);
  return next_ns;
}

}  // namespace bushd::sim
