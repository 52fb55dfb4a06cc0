#include "lcm/layout.h"

#include "lcm/types.h"

namespace bushd::lcm {
namespace {

constexpr Layout kTableRef{"sis"};
constexpr Layout kMovePlan{"llllsnSLLDnL"};
constexpr Layout kTable{"ssislinInI"};
constexpr Layout kPastMotion{"lssllssss"};
constexpr Layout kTableEntry{"stsidd", {&kTableRef}};

constexpr Layout kRequest{"llsl"};
constexpr Layout kBare{"t", {&kRequest}};
constexpr Layout kMotors{"tnS", {&kRequest}};
constexpr Layout kReplyHeader{"llslbssii"};
constexpr Layout kMotor{"slddlddbsbbsssslbbsbdd"};
constexpr Layout kMotorAmount{"sbld"};
constexpr Layout kMotorDescription{"shstsssbdbbdddd", {&kTableRef}};
constexpr Layout kMcuHealth{"sisiisillllllliddb"};

}  // namespace

#define BUSHD_LAYOUT(type, ...)                   \
  template <>                                     \
  const Layout& layout_of<type>() {               \
    static constexpr Layout kLayout{__VA_ARGS__}; \
    return kLayout;                               \
  }

BUSHD_LAYOUT(hello_t, "lsl")
BUSHD_LAYOUT(welcome_t, "llsll")
BUSHD_LAYOUT(subscribe_t, "bbb")

BUSHD_LAYOUT(arm_t, "tbldbbnT", {&kRequest, &kMotorAmount})
BUSHD_LAYOUT(arm_line_t, "tblbdbdbnT", {&kRequest, &kMotorAmount})
BUSHD_LAYOUT(camac_request_t, "tibiiinBBBI", {&kRequest})
BUSHD_LAYOUT(clear_faults_t, kMotors)
BUSHD_LAYOUT(configure_t, "tbnSnSSSs", {&kRequest})
BUSHD_LAYOUT(confirm_t, kMotors)
BUSHD_LAYOUT(disable_t, kMotors)
BUSHD_LAYOUT(disarm_t, kMotors)
BUSHD_LAYOUT(emergency_stop_t, kBare)
BUSHD_LAYOUT(enable_t, kMotors)
BUSHD_LAYOUT(follow_t, "tblbdnSnDnD", {&kRequest})
BUSHD_LAYOUT(get_history_t, "tsi", {&kRequest})
BUSHD_LAYOUT(get_status_t, kBare)
BUSHD_LAYOUT(get_table_t, "ts", {&kRequest})
BUSHD_LAYOUT(hold_t, kMotors)
BUSHD_LAYOUT(home_t, "tdbnSb", {&kRequest})
BUSHD_LAYOUT(jog_t, "tsdblbl", {&kRequest})
BUSHD_LAYOUT(list_tables_t, kBare)
BUSHD_LAYOUT(move_line_t, "tbbdbdnT", {&kRequest, &kMotorAmount})
BUSHD_LAYOUT(move_path_t, "tiibbdbnSnDnD", {&kRequest})
BUSHD_LAYOUT(move_t, "tbbdbnT", {&kRequest, &kMotorAmount})
BUSHD_LAYOUT(pause_t, kMotors)
BUSHD_LAYOUT(position_compare_t, "ttbll", {&kRequest, &kMotorAmount})
BUSHD_LAYOUT(release_t, kMotors)
BUSHD_LAYOUT(reload_tables_t, kBare)
BUSHD_LAYOUT(resume_t, kMotors)
BUSHD_LAYOUT(set_position_t, "tbnT", {&kRequest, &kMotorAmount})
BUSHD_LAYOUT(set_table_t, "tsst", {&kRequest, &kTable})
BUSHD_LAYOUT(stop_t, kMotors)
BUSHD_LAYOUT(use_table_t, "tss", {&kRequest})

BUSHD_LAYOUT(answer_t, "tnSSLDDSBHSBDnTnT", {&kReplyHeader, &kTableRef, &kMovePlan})
BUSHD_LAYOUT(camac_lam_t, "liiib")
BUSHD_LAYOUT(camac_reply_t, "tiinBBI", {&kReplyHeader})
BUSHD_LAYOUT(configuration_answer_t, "tssnSSSS", {&kReplyHeader})
BUSHD_LAYOUT(history_answer_t, "tnT", {&kReplyHeader, &kPastMotion})
BUSHD_LAYOUT(table_answer_t, "tnTnT", {&kReplyHeader, &kTableEntry, &kTable})

BUSHD_LAYOUT(mcu_state_t, "llliisssssillnT", {&kMotor})
BUSHD_LAYOUT(mcu_description_t, "llliissilssnT", {&kMotorDescription})
BUSHD_LAYOUT(health_t, "lliissblllnLLnT", {&kMcuHealth})

#undef BUSHD_LAYOUT

}  // namespace bushd::lcm
