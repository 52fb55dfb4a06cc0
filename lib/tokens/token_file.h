// The file of tokens. It is replaced whole, so whoever reads it sees the old or the new one, and it
// is never written through a link: members of its group own what lies beside it, and root changes
// it too.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "tokens/token.h"

namespace bushd::tokens {

// Where the package bushd-web keeps them; members of the group write it, and bushd-web reads it.
inline constexpr const char* kSystemFile = "/var/lib/bushd-web/tokens";
inline constexpr const char* kGroup = "bushd";

// Those of the file; none if it is not there yet. Errors: those of parse(); the folder is not
// there, there is no right to it, the file is a link or no regular file.
Result<std::vector<Token>> read(const std::string& path);

// Adds one. An expired one of that name goes, as seen from token.made_s. Comments stay. Errors:
// those of read(), a name that is taken, kMaxTokens, what cannot be written. Waits for others who
// change the file.
Result<void> add(const std::string& path, const Token& token);
// Removes the one of that name. Errors: those of read(), no token of that name, what cannot be
// written.
Result<void> revoke(const std::string& path, const std::string& name);

}  // namespace bushd::tokens
