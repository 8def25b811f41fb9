#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dcistrmb.h>
#include <dcmtk/dcmdata/dctk.h>
#include <dcmtk/dcmnet/dcmlayer.h>

#include <array>
#include <memory>
#include <string>

#include "service/dimse/association.h"
#include "service/dimse/channel.h"
#include "service/dimse/commands.h"
#include "service/dimse/sandbox.h"
#include "service/dimse/tls.h"

namespace volsmooth {
namespace {

using nlohmann::json;

constexpr int kConnectSeconds = 10, kResponseSeconds = 120;
constexpr std::chrono::minutes kPatience{60};  // the daemon ends us when it does not want us any more
/// An instance and DCMTK's copy of it, each with the most pixels that fit into a file.
constexpr std::int64_t kSendingBytes = std::int64_t{10} << 30;

/// Shuts the sandbox as soon as the connection stands, before a byte of the peer's is looked at.
template <class Layer>
class Sandboxed : public Layer {
 public:
  using Layer::Layer;
  DcmTransportConnection* createConnection(DcmNativeSocketType socket, OFBool is_secure) override {
    enter_sandbox(kSendingBytes);
    return Layer::createConnection(socket, is_secure);
  }
};

std::unique_ptr<DcmTransportLayer> layer_for(const json& wanted) {
  if (!wanted.contains("tls")) return std::make_unique<Sandboxed<DcmTransportLayer>>();
  auto layer = std::make_unique<Sandboxed<DcmTLSTransportLayer>>(NET_REQUESTOR, nullptr, OFTrue);
  set_up_tls(*layer, wanted["tls"]);
  return layer;
}

/// In the syntax of the files, or in the one that every archive knows.
void propose(T_ASC_Parameters* parameters, const json& sop_classes) {
  const char* syntaxes[] = {UID_LittleEndianExplicitTransferSyntax, UID_LittleEndianImplicitTransferSyntax};
  int id = 1;
  for (const json& sop_class : sop_classes) {
    ASC_addPresentationContext(parameters, static_cast<T_ASC_PresentationContextID>(id),
                               sop_class.get_ref<const std::string&>().c_str(), syntaxes,
                               std::size(syntaxes));
    id += 2;
  }
}

json rejection_of(T_ASC_Association* association) {
  T_ASC_RejectParameters rejected{};
  ASC_getRejectParameters(association->params, &rejected);
  constexpr int kReasonBits = 0xFF;
  return {{"failure", "rejected"},
          {"result", static_cast<int>(rejected.result)},
          {"source", static_cast<int>(rejected.source)},
          {"reason", static_cast<int>(rejected.reason) & kReasonBits}};
}

/// {} or a failure.
json request(const Network& network, const json& wanted, Association& association) {
  T_ASC_Parameters* parameters = nullptr;
  ASC_createAssociationParameters(&parameters, ASC_DEFAULTMAXPDU);
  const std::string address =
      wanted.at("host").get<std::string>() + ":" + std::to_string(wanted.at("port").get<int>());
  static_assert(sizeof parameters->DULparams.calledPresentationAddress == kLongestAddress + 1);
  if (address.size() > kLongestAddress) return {{"failure", "internal"}};
  ASC_setAPTitles(parameters, wanted.at("calling").get<std::string>().c_str(),
                  wanted.at("called").get<std::string>().c_str(), nullptr);
  ASC_setPresentationAddresses(parameters, "localhost", address.c_str());
  ASC_setTransportLayerType(parameters, wanted.contains("tls"));
  propose(parameters, wanted.at("sop_classes"));
  const OFCondition result = ASC_requestAssociation(network.get(), parameters, association.into(), nullptr,
                                                    nullptr, DUL_NOBLOCK, kAssociationSeconds);
  if (result.good()) {
    association.opened();
    return json::object();
  }
  if (result == DUL_ASSOCIATIONREJECTED) return rejection_of(association.get());
  return {{"failure", is_of_tls(result) ? "tls" : "unreachable"}};
}

/// Whether a Part 10 file is one.
bool read(DcmFileFormat& file, const std::string& bytes) {
  DcmInputBufferStream stream;
  stream.setBuffer(bytes.data(), static_cast<offile_off_t>(bytes.size()));
  stream.setEos();
  file.transferInit();
  const OFCondition result = file.read(stream);
  file.transferEnd();
  return result.good();
}

json store(Association& association, const json& wanted, const std::string& bytes) {
  const auto sop_class = wanted.at("sop_class").get<std::string>();
  const auto sop_instance = wanted.at("sop_instance").get<std::string>();
  const auto context = ASC_findAcceptedPresentationContextID(association.get(), sop_class.c_str());
  if (context == 0) return {{"failure", "not-accepted"}};
  DcmFileFormat file;
  if (!read(file, bytes)) return {{"failure", "unreadable"}};
  T_DIMSE_C_StoreRQ asked{};
  asked.MessageID = association.get()->nextMsgID++;
  OFStandard::strlcpy(asked.AffectedSOPClassUID, sop_class.c_str(), sizeof asked.AffectedSOPClassUID);
  OFStandard::strlcpy(asked.AffectedSOPInstanceUID, sop_instance.c_str(),
                      sizeof asked.AffectedSOPInstanceUID);
  asked.DataSetType = DIMSE_DATASET_PRESENT;
  asked.Priority = DIMSE_PRIORITY_MEDIUM;
  T_DIMSE_C_StoreRSP answer{};
  DcmDataset* detail = nullptr;
  const OFCondition result =
      DIMSE_storeUser(association.get(), context, &asked, nullptr, file.getDataset(), nullptr, nullptr,
                      DIMSE_NONBLOCKING, kResponseSeconds, &answer, &detail);
  delete detail;
  if (result.good()) return {{"status", answer.DimseStatus}};
  return {{"failure", "lost"}};
}

/// Others are of the association, which ends with it.
bool is_of_an_instance(const json& failure) {
  return failure == "not-accepted" || failure == "unreadable";
}

}  // namespace

void send_instances() {
  Channel channel(kChannelDescriptor);
  dcmConnectionTimeout.set(kConnectSeconds);
  const json wanted = channel.receive_document(kPatience);
  std::unique_ptr<DcmTransportLayer> layer;
  try {
    layer = layer_for(wanted);
  } catch (const TlsFault&) {
    return channel.send({{"failure", "tls-files"}});
  }
  const Network network(NET_REQUESTOR);
  ASC_setTransportLayer(network.get(), layer.get(), false);
  Association association;
  json said = request(network, wanted, association);
  channel.send(said);
  std::string bytes;
  while (!said.contains("failure") || is_of_an_instance(said["failure"])) {
    const auto message = channel.receive(kPatience);
    if (!message) {
      if (ASC_releaseAssociation(association.get()).good()) association.ended();
      return;
    }
    if (!message->is_document) {
      bytes += message->content;
      continue;
    }
    channel.send(said = store(association, document_of(*message), bytes));
    bytes.clear();
  }
}

}  // namespace volsmooth
