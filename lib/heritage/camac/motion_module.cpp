#include "heritage/camac/motion_module.h"

namespace bushd::camac {
namespace {

enum Function { kRead = 0, kTestLam = 8, kClearLam = 10, kWrite = 16, kForbid = 24, kPermit = 26 };
// Subaddresses of kRead; kWrite has the first three.
enum Register { kMemory, kAddress, kControl, kRequests };

}  // namespace

Response MotionModule::cycle(const Command& command) {
  if (command.function == kRead) return read(command.subaddress);
  if (command.function == kWrite) return write(command.subaddress, command.data);
  if (command.subaddress != 0) return {};
  return control_cycle(command.function);
}

Response MotionModule::read(int register_number) {
  switch (register_number) {
    case kMemory: {
      const Response response{.x = true, .q = !lam(), .data = memory_.read()};
      next_address();
      return response;
    }
    case kAddress:
      return {.x = true, .q = true, .data = memory_.address()};
    case kControl:
      return {.x = true, .q = true, .data = control_};
    case kRequests:
      return {.x = true, .q = true, .data = request_register()};
    default:
      return {};
  }
}

Response MotionModule::write(int register_number, std::uint32_t data) {
  switch (register_number) {
    case kMemory: {
      const Response response{.x = true, .q = !lam()};
      memory_.write(static_cast<std::uint8_t>(data));
      next_address();
      return response;
    }
    case kAddress:
      memory_.set_address(data);
      return {.x = true, .q = true};
    case kControl:
      control_ = static_cast<std::uint8_t>(data);
      return {.x = true, .q = true};
    default:
      return {};
  }
}

Response MotionModule::control_cycle(int function) {
  switch (function) {
    case kTestLam:
      return {.x = true, .q = lam()};
    case kClearLam:
      clear_lam();
      break;
    case kForbid:
      stop();
      break;
    case kPermit:
      if (!inhibited_) start();
      break;
    default:
      return {};
  }
  return {.x = true};
}

void MotionModule::next_address() {
  if (memory_.count_up()) address_overflows();
}

void MotionModule::initialise() {
  stop();
  memory_.set_address(0);
  control_ = 0;
  clear_requests();
}

}  // namespace bushd::camac
