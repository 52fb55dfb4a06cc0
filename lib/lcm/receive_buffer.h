// Room for LCM's datagrams in the kernel. The state of 2048 motors is more than a hundred datagrams
// at once, and of what does not fit Linux tells nobody.
#pragma once

namespace bushd::lcm {

// As LCM's option recv_buf_size; Linux sets aside twice as much, for its own bookkeeping too.
inline constexpr int kReceiveBufferBytes = 4 * 1024 * 1024;

// Makes room for kReceiveBufferBytes, or for as much as the system allows: what net.core.rmem_max
// says, or anything with CAP_NET_ADMIN. Never makes a buffer smaller.
void enlarge_receive_buffer(int socket);

}  // namespace bushd::lcm
