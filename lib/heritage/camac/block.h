// Block transfers: many cycles of a crate as one, of one register or of a row of them, for as long
// as Q says that there is more.
#pragma once

#include <cstdint>

#include "heritage/camac/crate.h"
#include "words/camac.h"

namespace bushd::camac {

// An answer X = 0 ends all but kSingle and kScan, which has to pass empty stations.
BlockResult transfer(Crate& crate, const Block& block);

}  // namespace bushd::camac
