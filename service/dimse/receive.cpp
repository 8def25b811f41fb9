#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dcostrma.h>
#include <dcmtk/dcmdata/dctk.h>

#include <algorithm>
#include <optional>
#include <string>
#include <string_view>

#include "service/dimse/association.h"
#include "service/dimse/channel.h"
#include "service/dimse/commands.h"
#include "service/dimse/part10.h"
#include "service/dimse/sandbox.h"
#include "service/dimse/tls.h"

namespace volsmooth {
namespace {

using nlohmann::json;

constexpr int kIdleSeconds = 300;                    ///< between two commands, and within one
constexpr std::chrono::minutes kDaemonPatience{30};  ///< for an instance to be durable while others are, too
constexpr std::int64_t kReceivingBytes = std::int64_t{1} << 30;  ///< nothing is kept but what is on its way

/// Those that the reader of DICOM uploads knows, and so what is asked for first is taken as it is.
constexpr const char* kTransferSyntaxes[] = {
    UID_LittleEndianExplicitTransferSyntax,
    UID_LittleEndianImplicitTransferSyntax,
    UID_BigEndianExplicitTransferSyntax,
    UID_DeflatedExplicitVRLittleEndianTransferSyntax,
    UID_RLELosslessTransferSyntax,
    UID_JPEGProcess1TransferSyntax,
    UID_JPEGProcess2_4TransferSyntax,
    UID_JPEGProcess14TransferSyntax,
    UID_JPEGProcess14SV1TransferSyntax,
    UID_JPEGLSLosslessTransferSyntax,
    UID_JPEGLSLossyTransferSyntax,
    UID_JPEG2000LosslessOnlyTransferSyntax,
    UID_JPEG2000TransferSyntax,
};

/// A stream of DCMTK's that ends in the channel.
class ChannelConsumer : public DcmConsumer {
 public:
  explicit ChannelConsumer(Channel& channel) : channel_(channel) {}
  OFBool good() const override { return OFTrue; }
  OFCondition status() const override { return EC_Normal; }
  OFBool isFlushed() const override { return OFTrue; }
  offile_off_t avail() const override { return kRoom; }
  offile_off_t write(const void* bytes, offile_off_t count) override {
    waiting_.append(static_cast<const char*>(bytes), static_cast<std::size_t>(count));
    if (waiting_.size() >= kPiece) flush();
    return count;
  }
  void flush() override {
    channel_.send_bytes(std::as_bytes(std::span(waiting_)));
    waiting_.clear();
  }

 private:
  static constexpr offile_off_t kRoom = 1 << 20;
  static constexpr std::size_t kPiece = std::size_t{256} << 10;
  Channel& channel_;
  std::string waiting_;
};

class ChannelStream : public DcmOutputStream {
 public:
  explicit ChannelStream(ChannelConsumer& consumer) : DcmOutputStream(&consumer) {}
};

/// One association, from the request on.
class Receiving {
 public:
  /// `tls`: null when the peer speaks without.
  Receiving(Channel& channel, DcmTLSTransportLayer* tls)
      : channel_(channel), is_secure_(tls != nullptr), network_(NET_ACCEPTOR) {
    if (is_secure_) ASC_setTransportLayer(network_.get(), tls, false);
  }

  void run() {
    if (!accept()) return;
    while (serve_command()) continue;
  }

 private:
  bool accept();
  std::uint32_t verdict_of_daemon();
  void reject(std::uint32_t reason);
  void choose_contexts();
  bool serve_command();
  void store(const T_DIMSE_C_StoreRQ& request, T_ASC_PresentationContextID context);

  Channel& channel_;
  const bool is_secure_;
  const Network network_;
  Association association_;
};

bool Receiving::accept() {
  const OFCondition received =
      ASC_receiveAssociation(network_.get(), association_.into(), ASC_MAXIMUMPDUSIZE, nullptr, nullptr,
                             is_secure_, DUL_NOBLOCK, kAssociationSeconds);
  if (is_of_tls(received)) channel_.send({{"failure", "tls"}});
  if (received.bad()) return false;
  association_.opened();
  if (const std::uint32_t reason = verdict_of_daemon(); reason != 0) {
    reject(reason);
    return false;
  }
  choose_contexts();
  return ASC_acknowledgeAssociation(association_.get()).good();
}

/// 0 or why not, as ASC_REASON_... has it.
std::uint32_t Receiving::verdict_of_daemon() {
  char calling[DUL_LEN_TITLE + 1] = {}, called[DUL_LEN_TITLE + 1] = {};
  ASC_getAPTitles(association_.parameters(), calling, sizeof calling, called, sizeof called, nullptr, 0);
  channel_.send({{"called", called}, {"calling", calling}});
  const auto reason = channel_.receive_document(kDaemonPatience).at("reject").get<std::uint32_t>();
  char application[DUL_LEN_NAME + 1] = {};
  ASC_getApplicationContextName(association_.parameters(), application, sizeof application);
  if (reason == 0 && std::string_view(application) != UID_StandardApplicationContext)
    return ASC_REASON_SU_APPCONTEXTNAMENOTSUPPORTED;
  return reason;
}

void Receiving::reject(std::uint32_t reason) {
  const T_ASC_RejectParameters rejected{ASC_RESULT_REJECTEDPERMANENT,
                                        static_cast<T_ASC_RejectParametersSource>(reason >> 8),
                                        static_cast<T_ASC_RejectParametersReason>(reason)};
  ASC_rejectAssociation(association_.get(), &rejected);
  association_.ended();
}

/// Of each context the first syntax that we read, for every storage class there is or will be.
void Receiving::choose_contexts() {
  constexpr std::string_view kStorage = "1.2.840.10008.5.1.4.1.1.";
  T_ASC_Parameters* const parameters = association_.parameters();
  for (int i = 0; i < ASC_countPresentationContexts(parameters); ++i) {
    T_ASC_PresentationContext context{};
    if (ASC_getPresentationContext(parameters, i, &context).bad()) continue;
    const std::string_view wanted = context.abstractSyntax;
    const auto* const first = context.proposedTransferSyntaxes;
    const auto* const last = first + context.transferSyntaxCount;
    const auto* const syntax = std::find_if(first, last, [](const char* proposed) {
      return std::ranges::find(kTransferSyntaxes, std::string_view(proposed)) != std::end(kTransferSyntaxes);
    });
    if (wanted != UID_VerificationSOPClass && !wanted.starts_with(kStorage)) {
      ASC_refusePresentationContext(parameters, context.presentationContextID,
                                    ASC_P_ABSTRACTSYNTAXNOTSUPPORTED);
    } else if (syntax == last) {
      ASC_refusePresentationContext(parameters, context.presentationContextID,
                                    ASC_P_TRANSFERSYNTAXESNOTSUPPORTED);
    } else {
      ASC_acceptPresentationContext(parameters, context.presentationContextID, *syntax);
    }
  }
}

/// False: the association has ended.
bool Receiving::serve_command() {
  T_ASC_PresentationContextID context = 0;
  T_DIMSE_Message command{};
  const OFCondition received =
      DIMSE_receiveCommand(association_.get(), DIMSE_NONBLOCKING, kIdleSeconds, &context, &command, nullptr);
  if (received == DUL_PEERREQUESTEDRELEASE) {
    ASC_acknowledgeRelease(association_.get());
    association_.ended();
    channel_.send({{"released", true}});
    return false;
  }
  if (received.bad()) return false;
  if (command.CommandField == DIMSE_C_ECHO_RQ) {
    channel_.send({{"alive", true}});
    return DIMSE_sendEchoResponse(association_.get(), context, &command.msg.CEchoRQ, STATUS_Success, nullptr)
        .good();
  }
  if (command.CommandField != DIMSE_C_STORE_RQ) return false;
  store(command.msg.CStoreRQ, context);
  return true;
}

void Receiving::store(const T_DIMSE_C_StoreRQ& request, T_ASC_PresentationContextID context) {
  T_ASC_PresentationContext accepted{};
  if (ASC_findAcceptedPresentationContext(association_.parameters(), context, &accepted).bad())
    throw std::runtime_error("a context that was not accepted");
  ChannelConsumer consumer(channel_);
  ChannelStream stream(consumer);
  const std::string head = part10_head(request.AffectedSOPClassUID, request.AffectedSOPInstanceUID,
                                       accepted.acceptedTransferSyntax);
  stream.write(head.data(), static_cast<offile_off_t>(head.size()));
  T_ASC_PresentationContextID of_data = context;
  const OFCondition received = DIMSE_receiveDataSetInFile(association_.get(), DIMSE_NONBLOCKING, kIdleSeconds,
                                                          &of_data, &stream, nullptr, nullptr);
  consumer.flush();
  if (received.bad() || of_data != context) throw std::runtime_error("the data set broke off");
  channel_.send(
      {{"sop_class", request.AffectedSOPClassUID}, {"sop_instance", request.AffectedSOPInstanceUID}});
  T_DIMSE_C_StoreRSP response{};
  response.DimseStatus = channel_.receive_document(kDaemonPatience).at("status").get<std::uint16_t>();
  response.MessageIDBeingRespondedTo = request.MessageID;
  response.DataSetType = DIMSE_DATASET_NULL;
  response.opts = O_STORE_AFFECTEDSOPCLASSUID | O_STORE_AFFECTEDSOPINSTANCEUID;
  OFStandard::strlcpy(response.AffectedSOPClassUID, request.AffectedSOPClassUID,
                      sizeof response.AffectedSOPClassUID);
  OFStandard::strlcpy(response.AffectedSOPInstanceUID, request.AffectedSOPInstanceUID,
                      sizeof response.AffectedSOPInstanceUID);
  if (DIMSE_sendStoreResponse(association_.get(), context, &request, &response, nullptr).bad())
    throw std::runtime_error("the peer is gone");
}

}  // namespace

void receive_instances() {
  Channel channel(kChannelDescriptor);
  const json wanted = channel.receive_document(kDaemonPatience);
  std::optional<DcmTLSTransportLayer> tls;
  try {
    if (wanted.contains("tls")) set_up_tls(tls.emplace(NET_ACCEPTOR, nullptr, OFTrue), wanted["tls"]);
  } catch (const TlsFault&) {
    return channel.send({{"failure", "tls-files"}});
  }
  dcmExternalSocketHandle.set(kConnectionDescriptor);  // so that DCMTK listens nowhere itself
  enter_sandbox(kReceivingBytes);
  Receiving(channel, tls ? &*tls : nullptr).run();
}

}  // namespace volsmooth
