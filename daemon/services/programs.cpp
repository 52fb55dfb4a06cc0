#include "daemon/services/programs.h"

namespace bushd::daemon {
namespace {

void refuse(const api::Asker& asker) {
  asker.answer(api::Refused{"no MCU of this installation can have programs"});
}

}  // namespace

void Programs::request(const api::Asker& asker, const api::PutProgram&) {
  refuse(asker);
}
void Programs::request(const api::Asker& asker, const api::EraseProgram&) {
  refuse(asker);
}
void Programs::request(const api::Asker& asker, const api::RunPrograms&) {
  refuse(asker);
}
void Programs::request(const api::Asker& asker, const api::ListPrograms&) {
  refuse(asker);
}

}  // namespace bushd::daemon
