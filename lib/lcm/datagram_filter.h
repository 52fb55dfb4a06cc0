// Keeps datagrams away from LCM that it does not survive.
//
// LCM's reassembly of fragmented messages (liblcm 1.3.1 and later) adds offset and length of a
// fragment in 32 bits before it compares them with the message's size; a fragment whose sum wraps
// around is copied outside the buffer, and the process dies or worse. bushd's messages are never
// fragmented, so the kernel is told to drop every datagram that is not a whole message, on LCM's
// own sockets, before LCM sees it.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "base/result.h"

namespace bushd::lcm {

// Descriptors of this process that are UDP sockets. LCM does not give its sockets out: they are
// those that are there after it was opened and were not before.
std::set<int> udp_sockets();

// Only datagrams with the magic of a whole LCM message reach the socket from now on; with
// `channels`, only those on one of these, and none on an `unheard` one. Precondition: up to 8 names
// of 1..63 characters.
Result<void> accept_whole_messages_only(int udp_socket,
                                        const std::vector<std::string>& channels = {},
                                        const std::vector<std::string>& unheard = {});

}  // namespace bushd::lcm
