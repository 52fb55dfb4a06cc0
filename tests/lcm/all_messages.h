// Every message, and the type that lcm-gen makes of its .lcm file.
#pragma once

#include <tuple>
#include <type_traits>
#include <variant>

#include "bushd/answer_t.hpp"
#include "bushd/arm_line_t.hpp"
#include "bushd/arm_t.hpp"
#include "bushd/camac_lam_t.hpp"
#include "bushd/camac_reply_t.hpp"
#include "bushd/camac_request_t.hpp"
#include "bushd/clear_faults_t.hpp"
#include "bushd/configuration_answer_t.hpp"
#include "bushd/configure_t.hpp"
#include "bushd/confirm_t.hpp"
#include "bushd/disable_t.hpp"
#include "bushd/disarm_t.hpp"
#include "bushd/emergency_stop_t.hpp"
#include "bushd/enable_t.hpp"
#include "bushd/erase_program_t.hpp"
#include "bushd/follow_t.hpp"
#include "bushd/get_history_t.hpp"
#include "bushd/get_status_t.hpp"
#include "bushd/get_table_t.hpp"
#include "bushd/health_t.hpp"
#include "bushd/hello_t.hpp"
#include "bushd/history_answer_t.hpp"
#include "bushd/hold_t.hpp"
#include "bushd/home_t.hpp"
#include "bushd/jog_t.hpp"
#include "bushd/list_programs_t.hpp"
#include "bushd/list_tables_t.hpp"
#include "bushd/mcu_description_t.hpp"
#include "bushd/mcu_state_t.hpp"
#include "bushd/move_line_t.hpp"
#include "bushd/move_path_t.hpp"
#include "bushd/move_t.hpp"
#include "bushd/pause_t.hpp"
#include "bushd/position_compare_t.hpp"
#include "bushd/program_reply_t.hpp"
#include "bushd/put_program_t.hpp"
#include "bushd/release_t.hpp"
#include "bushd/reload_tables_t.hpp"
#include "bushd/resume_t.hpp"
#include "bushd/run_programs_t.hpp"
#include "bushd/set_position_t.hpp"
#include "bushd/set_table_t.hpp"
#include "bushd/stop_t.hpp"
#include "bushd/subscribe_t.hpp"
#include "bushd/table_answer_t.hpp"
#include "bushd/use_table_t.hpp"
#include "bushd/welcome_t.hpp"
#include "lcm/codec.h"
#include "lcm/messages.h"

namespace bushd::test {

template <class MessageType, class OracleType>
struct Pair {
  using Message = MessageType;
  using Oracle = OracleType;
};
template <class Content, class Oracle>
using RequestPair = Pair<lcm::RequestMessage<Content>, Oracle>;

// The fuzzers' corpus counts the first 27 in this order.
using AllMessages = std::tuple<
    Pair<lcm::Answer, answer_t>, RequestPair<api::Arm, arm_t>,
    RequestPair<api::EmergencyStop, emergency_stop_t>, RequestPair<api::GetTable, get_table_t>,
    Pair<lcm::HealthMessage, health_t>, Pair<lcm::Timed<lcm::Hello>, hello_t>,
    Pair<lcm::DescriptionMessage, mcu_description_t>, Pair<lcm::StateMessage, mcu_state_t>,
    RequestPair<api::MoveLine, move_line_t>, RequestPair<api::Move, move_t>,
    RequestPair<api::PositionCompare, position_compare_t>,
    RequestPair<api::SetPosition, set_position_t>, RequestPair<api::SetTable, set_table_t>,
    RequestPair<api::Stop, stop_t>, Pair<lcm::Subscription, subscribe_t>,
    Pair<lcm::TableAnswer, table_answer_t>, RequestPair<api::UseTable, use_table_t>,
    Pair<lcm::Timed<lcm::Welcome>, welcome_t>, RequestPair<api::GetHistory, get_history_t>,
    Pair<lcm::AnswerWith<api::MotionHistory>, history_answer_t>, RequestPair<api::Jog, jog_t>,
    RequestPair<api::Camac, camac_request_t>,
    Pair<lcm::AnswerWith<api::CamacResult>, camac_reply_t>, Pair<lcm::CamacLamMessage, camac_lam_t>,
    RequestPair<api::MovePath, move_path_t>, RequestPair<api::Follow, follow_t>,
    RequestPair<api::ArmLine, arm_line_t>, RequestPair<api::Enable, enable_t>,
    RequestPair<api::Disable, disable_t>, RequestPair<api::ClearFaults, clear_faults_t>,
    RequestPair<api::ReloadTables, reload_tables_t>, RequestPair<api::Home, home_t>,
    RequestPair<api::Disarm, disarm_t>, RequestPair<api::ListTables, list_tables_t>,
    RequestPair<api::Confirm, confirm_t>, RequestPair<api::Configure, configure_t>,
    RequestPair<api::Pause, pause_t>, RequestPair<api::Resume, resume_t>,
    RequestPair<api::Hold, hold_t>, RequestPair<api::Release, release_t>,
    RequestPair<lcm::GetStatus, get_status_t>,
    Pair<lcm::AnswerWith<api::Configuration>, configuration_answer_t>,
    RequestPair<api::PutProgram, put_program_t>, RequestPair<api::EraseProgram, erase_program_t>,
    RequestPair<api::RunPrograms, run_programs_t>, RequestPair<api::ListPrograms, list_programs_t>,
    Pair<lcm::AnswerWith<api::ProgramList>, program_reply_t>>;

// Every request is among them.
template <class Request, class All>
inline constexpr bool kIsAmong = false;
template <class Request, class... Pairs>
inline constexpr bool kIsAmong<Request, std::tuple<Pairs...>> =
    (std::is_same_v<lcm::RequestMessage<Request>, typename Pairs::Message> || ...);
template <class... Request>
consteval bool has_all_of(const std::variant<Request...>* /*requests*/) {
  return (kIsAmong<Request, AllMessages> && ...);
}
static_assert(has_all_of(static_cast<const api::Request::variant*>(nullptr)));

}  // namespace bushd::test
