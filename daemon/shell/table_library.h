// Tables on the disk, as the daemon sees them: where they are looked for, and which of them each
// group was given last. All functions may take as long as the disk does.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "base/result.h"
#include "config/config.h"
#include "tables/store/open.h"
#include "tables/table.h"

namespace bushd::daemon {

class TableLibrary {
 public:
  // `in_service`: the file that keeps what groups were given. Empty: the place that it has by
  // itself, in_service_file().
  TableLibrary(const config::Config& config, std::filesystem::path in_service);

  // For a configuration in /etc/bushd in /var/lib/bushd, else a file beside it.
  static std::filesystem::path in_service_file(const std::filesystem::path& config);

  // TABLE[@REV], looked for where the configuration's tables are.
  Result<tables::TablePtr> open(const std::string& wanted) const;

  // What the file of TABLE, or of a revision of it, says.
  Result<tables::TableContent> content(const std::string& wanted) const;
  // All tables that can be asked for, by name.
  std::vector<std::string> names() const;
  // The table gets this content as its next revision, as if bushtab had changed it, and returns
  // that revision's number. `expected_hash` and the content's revision are those of the content
  // that it was made from; if the table is another by now, nothing is done. Empty: the table is
  // new. A table that has the content already is left as it is.
  Result<std::uint32_t> set(const std::string& name, tables::TableContent content,
                            const std::string& expected_hash, const std::string& note) const;

  // What groups were given in place of the configuration's tables. What was given to a group that
  // is no longer there, or has got another table in the configuration since, does not count.
  Result<std::map<std::string, std::string>> kept() const;  // TABLE[@REV] by group
  const std::filesystem::path& in_service() const { return in_service_; }
  // From now on these, of all groups.
  Result<void> keep(const std::vector<std::string>& wanted) const;

 private:
  Result<tables::store::Place> home_of(const std::string& name) const;

  const config::Config& config_;
  std::vector<tables::store::Place> places_;
  std::filesystem::path in_service_;
};

}  // namespace bushd::daemon
