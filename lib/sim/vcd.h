// Edges into a Value Change Dump (IEEE 1364-2005, clause 18), for GTKWave, PulseView and
// tools/check-trace.
//
//     $timescale 1 ns $end
//     scopes `mcu<address>`, in each the wires `step0`..`step15`, `dir0`..`dir15`, `en`,
//     `common_dir`, `position_compare`, and the inputs `trigger` and `emergency` (1: closed); where
//     windings are measured the real variables `current0_a`..`current3_a` too, and where the supply
//     is, `supply`: what the sensor reads, 0..1023
//
// Time stamps rise strictly: edges of all MCUs are merged. Those of one ns stand in the order of
// the MCUs on the bus, those of one MCU in the order in which they were made.
#pragma once

#include <cstdint>
#include <cstdio>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "base/result.h"
#include "sim/edge.h"

namespace bushd::sim {

class VcdWriter final : public EdgeSink {
 public:
  // Creates (or empties) the file and writes its head. `addresses` in the order of the MCUs on the
  // bus.
  // Those of `measured` have windings, those of `supplied` a sensor of their supply. `comment`: for
  // the head, if not empty.
  static Result<std::unique_ptr<VcdWriter>> create(const std::string& path,
                                                   std::span<const std::uint8_t> addresses,
                                                   const std::set<std::uint8_t>& measured = {},
                                                   const std::string& comment = {},
                                                   const std::set<std::uint8_t>& supplied = {});

  // A writer that was not closed leaves a file without its end; call close() to know that all is
  // written.
  ~VcdWriter() override = default;

  void edge(const Edge& edge) override { pending_.push_back({edge, {}}); }
  void sample(const Sample& sample) override;
  void settled(TimeNs until_ns) override;

  // The first write that failed, if any; from then on nothing more is written. Known late, because
  // output is buffered.
  const std::optional<Error>& error() const { return error_; }

  // Writes what is pending, then the time stamp `end_ns` (so that a viewer shows the rest after the
  // last edge).
  Result<void> close(TimeNs end_ns);

  std::uint64_t edges_written() const { return edges_written_; }

 private:
  struct FileCloser {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  using File = std::unique_ptr<std::FILE, FileCloser>;

  VcdWriter(std::string path, File file, std::size_t mcus);
  // An edge, or if it has a value that of what is measured as `edge.index`.
  struct Change {
    Edge edge;
    std::optional<double> value;
  };
  void write_head(std::span<const std::uint8_t> addresses, const std::set<std::uint8_t>& measured,
                  const std::set<std::uint8_t>& supplied);
  void write_time(TimeNs time_ns);
  void write_value(std::size_t wire, bool level);
  void write_real(const Change& change);
  void write_pending(TimeNs until_ns);
  void flush_text();
  void fail_with(int error_number);

  std::string path_;
  File file_;
  std::vector<std::string> identifiers_;  // one per wire, kWiresPerMcu for each MCU
  std::vector<std::string> reals_;        // kRealsPerMcu for each MCU; "": none
  std::vector<Change> pending_;
  std::string text_;
  TimeNs last_time_ns_ = -1;
  std::uint64_t edges_written_ = 0;
  std::optional<Error> error_;
};

}  // namespace bushd::sim
