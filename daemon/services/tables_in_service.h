// Which table each group has, and how it gets another one: the table is read and checked against
// the buses and MCUs of its motors, the MCUs come to rest, get it and confirm it, and the choice is
// kept for the next daemon. Until then the old one stays in service. A motor that moves keeps its
// table; while a change waits for MCUs to come to rest no motor of theirs begins a move, or it
// might wait for ever.
#pragma once

#include <cstdint>
#include <list>
#include <map>
#include <string>
#include <vector>

#include "daemon/model/interlocks.h"
#include "daemon/model/outputs.h"
#include "daemon/model/service.h"

namespace bushd::daemon {

// What takes long of a table's check, a millisecond for the largest ones: whether a motor could
// move by it, by the tick of its bus. It depends on nothing else, and is made where nobody waits
// for it.
struct TableReview {
  TableReview(const config::Config& config, tables::TablePtr of);

  tables::TablePtr table;
  std::map<std::uint32_t, Result<void>> by_tick_ns;
};

class TablesInService final : public Service {
 public:
  TablesInService(Installation& installation, Interlocks& interlocks, Outputs& outputs);

  void request(const api::Asker& asker, const api::UseTable& request);
  void request(const api::Asker& asker, const api::ReloadTables& request);
  // Files of tables are read and written where nobody waits for the disk.
  void request(const api::Asker& asker, const api::ListTables& r) {
    outputs_.serve_tables(asker, r);
  }
  void request(const api::Asker& asker, const api::GetTable& r) { outputs_.serve_tables(asker, r); }
  void request(const api::Asker& asker, const api::SetTable& r) { outputs_.serve_tables(asker, r); }

  // A table that is no file, as the request for one; the next daemon is not told of it. One that
  // the group has already is not given to it again.
  void use(std::int64_t now_us, const api::Asker& asker, GroupId group, tables::TablePtr table);

  // Another table for the group would have to wait until motors of its MCUs rest.
  bool waits_for_motors(GroupId group) const;

  // Answers to Outputs::read_tables and keep_tables.
  void read(std::int64_t now_us, std::uint64_t ticket,
            const std::vector<Result<tables::TablePtr>>& tables);
  void kept(std::uint64_t ticket, const Result<void>& kept);

  // Whether groups that have a table by this name, and follow its changes, could move by this one.
  Result<void> check_content(const std::string& name, const TableReview& review) const;
  // Before the first port is opened: the group has another table than the configuration says.
  Result<void> restore(GroupId group, const std::string& wanted, tables::TablePtr table);

  void step(std::int64_t now_us) override;

 private:
  struct Part {
    GroupId group;
    std::string wanted;         // TABLE[@REV] that it is asked for by
    tables::TablePtr table{};   // once read
    tables::TablePtr before{};  // while uploading: what it goes back to if that fails
  };
  // From the request to its result.
  struct Change {
    enum class Stage { kReading, kResting, kUploading, kKeeping };
    api::Asker asker;  // without a session: not from a client
    std::uint64_t ticket;
    bool reload = false;  // groups whose table is what it was are left out
    bool kept = true;     // for the next daemon
    Stage stage = Stage::kReading;
    std::vector<Part> parts{};
    std::vector<McuId> mcus{};     // that need other tables
    std::vector<McuId> awaited{};  // while uploading: those that were not offline
    std::string refused{};         // groups that keep their tables, and why
    std::string notes{};
    std::int64_t deadline_us = 0;  // of the upload
  };
  using Changes = std::list<Change>;

  const std::string& name_of(GroupId group) const;
  void begin(Change change);
  void put_in_service(std::int64_t now_us, Changes::iterator change);
  Changes::iterator find(std::uint64_t ticket);
  bool unchanged(const Part& part) const;
  void take_part(Change& change, Part part, const Result<tables::TablePtr>& read);
  tables::TablePtr shared(const Tables& tables, tables::TablePtr table) const;
  // `review`: of the group's table, if there is one.
  Result<void> fits(const Tables& tables, GroupId group, const TableReview* review = nullptr) const;
  Result<void> fits(const std::vector<Part>& parts) const;
  void supersede(const Change& by);
  const Change* changing(McuId mcu) const;
  std::vector<McuId> mcus_of(const std::vector<Part>& parts) const;
  bool ready(const Change& change) const;
  void begin_upload(std::int64_t now_us, Change& change);
  std::int64_t upload_us(const Mcu& mcu) const;
  bool uploaded(const Change& change) const;
  void roll_back(Change& change);
  void keep(Changes::iterator change);
  void finish(Changes::iterator change, const Result<void>& kept);
  void refuse(Changes::iterator change);
  void complete(Changes::iterator change, api::Outcome outcome, const std::string& reason);

  Installation& installation_;
  Outputs& outputs_;
  ById<GroupId, std::string> wanted_;  // TABLE[@REV] that each group's table was asked for by
  Changes changes_;
  std::uint64_t last_ticket_ = 0;
};

}  // namespace bushd::daemon
