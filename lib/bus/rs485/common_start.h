// Motors of a bus that begin at one tick: what is told of them, and how soon that can be.
#pragma once

#include <cstdint>

#include "bus/rs485/mcu_index.h"
#include "bus/rs485/tick.h"

namespace bushd::link {

// What messages tell an MCU how its motors begin.
enum class StartMessages : std::uint8_t {
  kTableRun,  // each motor's whole run (TableRuns::begin_table_run)
  kLineRun,   // the whole run of a line (LineRuns::begin_line_run)
  kStates,    // ticks, by states of runs where the MCU takes them
  kTicks,     // ticks, one by one
};

// Motors (a mask) of one MCU that are to begin.
struct ToBegin {
  McuIndex mcu;
  std::uint16_t motors;
  StartMessages messages;
};

// What takes how much of the line, as shares of it.
struct LineLoad {
  double polls = 0;    // and their answers, while all motors move
  double streams = 0;  // under way
  double more = 0;     // what is to begin besides
  double most = 0;     // that may be planned
  double all() const { return polls + streams + more; }
};

struct CommonStart {
  Tick at = 0;
  // Some MCUs may get their first frames in time and others not: BusMaster::confirm_start keeps
  // those from beginning alone.
  bool to_confirm = false;
};

}  // namespace bushd::link
