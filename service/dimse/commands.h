#pragma once

namespace volsmooth {

// The commands of volsmooth-dimse (channel.h says what is said on the channel). They return when all is said;
// what they throw means that the other side, or the peer, could not be talked to any more.

void send_instances();     ///< C-STORE to a peer
void receive_instances();  ///< one association of a peer that sends by C-STORE
void check_tls();          ///< whether its files can be used

}  // namespace volsmooth
